//! What every command that takes a scene takes.

use crate::error::{Error, Result};
use crate::scene::{Choice, Illumination, Scene};
use clap::Args;
use std::path::PathBuf;

/// Which scene, in which light.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// A .gltf or .glb file, or a built-in scene: builtin:caustic-box, builtin:cornell-spheres, builtin:two-spheres,
    /// builtin:concentric.
    #[arg(default_value = "builtin:caustic-box")]
    pub scene: PathBuf,

    /// Which scene of a file that has several: its name, or its number from 0. Default: the one that the file says.
    #[arg(id = "scene-of-file", long = "scene", value_name = "NAME|N")]
    pub scene_of_file: Option<String>,

    /// Which camera sees the scene: its name, or its number from 0. Default: the first.
    #[arg(long, value_name = "NAME|N")]
    pub camera: Option<String>,

    /// Illumination over the whole scene: global, local, shadowless, one-bounce, whitted, or a point S,T of the square
    /// (S inter-reflection, T shadowlessness, both 0…1). Materials that name their own in the file keep it unless --set
    /// says otherwise. Default: what the file says, else global.
    #[arg(long, value_name = "NAME|S,T")]
    pub illumination: Option<String>,

    /// Illumination of one material (`*` for all), over everything else; may be repeated. Also takes eight numbers
    /// A,B,C,D/E,F,G,H: the rows of the opaque and of the straight matrix.
    #[arg(long, value_name = "MATERIAL=…")]
    pub set: Vec<String>,
}

impl SceneArgs {
    /// Loads the scene and resolves its matrices.
    pub fn load(&self) -> Result<Scene> {
        let parse = |option: &str, text: &str| {
            text.parse::<Illumination>().map_err(|why| Error::Usage(format!("{option}: {why}")))
        };
        let asked = self.illumination.as_deref().map(|text| parse("--illumination", text)).transpose()?;
        let mut set = Vec::new();
        for entry in &self.set {
            let (name, text) = entry.rsplit_once('=').ok_or_else(|| {
                Error::Usage(format!("--set {entry}: write MATERIAL=ILLUMINATION, as in --set Glass=global"))
            })?;
            set.push((name.to_owned(), parse(&format!("--set {name}"), text)?));
        }
        let choice = Choice { scene: self.scene_of_file.clone(), camera: self.camera.clone() };
        let mut scene = Scene::load_chosen(&self.scene, &choice)?;
        scene.illuminate(asked, &set)?;
        Ok(scene)
    }
}
