//! The arguments of every command that takes a scene.

use super::settings_args::whole;
use crate::error::{Error, Result};
use crate::scene::environment::Around;
use crate::scene::{Background, Choice, Illumination, Loaded, MAX_TRIANGLES, Pose, Scene, Surroundings};
use clap::Args;
use std::path::PathBuf;

/// Which scene, in which light.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// A .gltf or .glb file, or a built-in scene: builtin:caustic-box, builtin:cornell-spheres,
    /// builtin:fluorescent-box, builtin:two-spheres, builtin:concentric.
    #[arg(default_value = "builtin:caustic-box")]
    pub scene: PathBuf,

    /// Which scene of a file that has several: its name, or its number from 0. Default: the one that the file says.
    #[arg(id = "scene-of-file", long = "scene", value_name = "NAME|N")]
    pub scene_of_file: Option<String>,

    /// Which camera sees the scene: its name, or its number from 0. Default: the first.
    #[arg(long, value_name = "NAME|N")]
    pub camera: Option<String>,

    /// The scene as its first animation has it at so many seconds, or as the animation of that name does: joints, nodes, lamps,
    /// cameras and morph targets. Default: at rest.
    #[arg(long, value_name = "[NAME:]SECONDS", allow_negative_numbers = true)]
    pub pose: Option<Pose>,

    /// Which variant of its materials the scene wears (KHR_materials_variants): its name, or its number from 0. `halflight
    /// info` lists them. Default: the materials that meshes name.
    #[arg(long, value_name = "NAME|N")]
    pub variant: Option<String>,

    /// Illumination over the whole scene: global, local, shadowless, one-bounce, whitted, or a point S,T of the square
    /// (S inter-reflection, T shadowlessness, both 0…1). Materials that name their own in the file keep it unless --set
    /// says otherwise. Default: what the file says, else global.
    #[arg(long, value_name = "NAME|S,T")]
    pub illumination: Option<String>,

    /// Illumination of one material (`*` for all), over everything else; may be repeated. Also takes eight numbers
    /// A,B,C,D/E,F,G,H: the rows of the opaque and of the straight matrix.
    #[arg(long, value_name = "MATERIAL=…")]
    pub set: Vec<String>,

    #[command(flatten)]
    pub around: AroundArgs,

    /// The most triangles that a scene may have, every instance counted.
    #[arg(long, value_name = "N", default_value_t = MAX_TRIANGLES, value_parser = whole::<u64>)]
    pub max_triangles: u64,
}

/// What is around a scene.
#[derive(Args, Clone, Debug, Default)]
pub struct AroundArgs {
    /// What shines from all around: studio, sky, sky:elevation=30,turbidity=3,azimuth=0 (degrees), a colour (white, #80a0ff, 0.5), a
    /// picture of all directions (.hdr, .exr, .png, .jpg, .webp; equirectangular), or none. Default: what the file says; where
    /// nothing in it shines, studio.
    #[arg(long, value_name = "SKY")]
    pub environment: Option<Around>,

    /// Turns the environment counter-clockwise, as seen from above, by so many degrees.
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = degrees)]
    pub environment_rotation: Option<f32>,

    /// What the light of the environment is multiplied by.
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = factor)]
    pub environment_strength: Option<f32>,

    /// What is seen of the environment: seen, hidden (it lights all the same), or a colour in its place.
    #[arg(long, value_name = "seen|hidden|COLOUR")]
    pub background: Option<Background>,
}

impl AroundArgs {
    /// True where any of them is there.
    pub fn says_something(&self) -> bool {
        self.surroundings() != Surroundings::default()
    }

    fn surroundings(&self) -> Surroundings {
        Surroundings {
            source: self.environment.clone(),
            rotation: self.environment_rotation,
            strength: self.environment_strength,
            background: self.background,
        }
    }
}

fn degrees(text: &str) -> std::result::Result<f32, String> {
    let number = text.parse().ok().filter(|x: &f32| x.is_finite());
    number.ok_or_else(|| format!("`{text}` is no number of degrees"))
}

fn factor(text: &str) -> std::result::Result<f32, String> {
    let number = text.parse().ok().filter(|x: &f32| *x >= 0.0 && x.is_finite());
    number.ok_or_else(|| format!("`{text}` is no factor; write a number from 0 up"))
}

/// Names of materials and their illuminations.
type ByMaterial = Vec<(String, Illumination)>;

impl SceneArgs {
    /// Loads the scene and resolves its matrices.
    pub fn load(&self) -> Result<Scene> {
        self.load_with_files().map(|loaded| loaded.scene)
    }

    /// The same, with the files that it is of.
    pub fn load_with_files(&self) -> Result<Loaded> {
        self.load_as(false)
    }

    /// The same; if `dark`, also a scene in which nothing emits light.
    pub fn load_as(&self, dark: bool) -> Result<Loaded> {
        let (asked, set) = self.illuminations()?;
        let choice = Choice {
            scene: self.scene_of_file.clone(),
            camera: self.camera.clone(),
            pose: self.pose.clone(),
            variant: self.variant.clone(),
            max_triangles: self.max_triangles,
            around: self.around.surroundings(),
            dark,
        };
        let mut loaded = Scene::load_chosen(&self.scene, &choice)?;
        loaded.scene.illuminate(asked, &set)?;
        Ok(loaded)
    }

    /// Over the whole scene, and by material: what is wrong with them without a look at the scene.
    pub fn illuminations(&self) -> Result<(Option<Illumination>, ByMaterial)> {
        let parse = |option: &str, text: &str| {
            text.parse::<Illumination>().map_err(|why| Error::Usage(format!("{option}: {why}")))
        };
        let asked = self.illumination.as_deref().map(|text| parse("--illumination", text)).transpose()?;
        let mut set = ByMaterial::new();
        for entry in &self.set {
            let (name, text) = entry.rsplit_once('=').ok_or_else(|| {
                Error::Usage(format!("--set {entry}: write MATERIAL=ILLUMINATION, as in --set Glass=global"))
            })?;
            if set.iter().any(|(known, _)| known == name) {
                return Err(Error::Usage(format!("--set names {name} twice; name each material once")));
            }
            set.push((name.to_owned(), parse(&format!("--set {name}"), text)?));
        }
        Ok((asked, set))
    }
}
