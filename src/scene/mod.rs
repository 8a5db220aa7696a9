//! What is there: one flat soup of triangles with surfaces and materials, luminaires, a camera.
//!
//! Everything refers by index. Positions are f32 relative to [`Scene::origin`], so that a scene far from the
//! world's origin loses nothing.

mod assembly;
mod builtin;
mod camera;
mod centre;
mod gltf;
mod illumination;
mod luminaire;
mod material;
mod mesh;

pub use camera::{Camera, Projection, View};
pub use illumination::{Illumination, Matter};
pub use luminaire::{Emission, Luminaire, SpotCone, versine_between, warn_falloff};
pub use material::{Backs, Follows, Material};
pub(crate) use mesh::gamma;
pub use mesh::{Mesh, Surface, SurfacePoint};

use crate::error::{Error, Result};
use glam::DVec3;
use std::path::Path;

/// A scene, ready to be planned.
#[derive(Clone, Debug)]
pub struct Scene {
    /// File name or `builtin:…`.
    pub name: String,
    /// All triangles.
    pub mesh: Mesh,
    /// What the triangles belong to: one per glTF primitive instance.
    pub surfaces: Vec<Surface>,
    /// What surfaces are made of.
    pub materials: Vec<Material>,
    /// What shines.
    pub luminaires: Vec<Luminaire>,
    /// From where it is seen.
    pub camera: Camera,
    /// World position (m) of the point that `mesh` and `camera` call zero.
    pub origin: DVec3,
    /// The scene's own default illumination (glTF scene extras), if it has one.
    pub illumination: Option<Illumination>,
    /// What the loader has to tell the user, one line each.
    pub notes: Vec<String>,
}

/// What is shown of a file that holds several scenes, or of a scene that several cameras see.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choice {
    /// A scene by its name, else by its number from 0 in the order of the file. None: the file's default.
    pub scene: Option<String>,
    /// A camera by the name of its node, else by its own, else by its number from 0 among those of the scene. None: the
    /// first.
    pub camera: Option<String>,
}

impl Scene {
    /// Loads a `.gltf` or `.glb` file, or one of the built-in scenes by its name (`builtin:caustic-box`, …).
    ///
    /// Illumination is resolved with nothing asked for on the command line.
    ///
    /// # Errors
    /// One line that names the file, the thing and the way out.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        Self::load_chosen(path, &Choice::default())
    }

    /// The same, where a file has more than one scene or camera.
    ///
    /// # Errors
    /// As `load`; also where there is no such scene or camera.
    pub fn load_chosen(path: impl AsRef<Path>, choice: &Choice) -> Result<Self> {
        let path = path.as_ref();
        let mut scene = match path.to_str().and_then(|p| p.strip_prefix("builtin:")) {
            Some(name) if *choice == Choice::default() => builtin::scene(name)?,
            Some(name) => {
                let only = "a built-in scene is one scene with one camera; leave out --scene and --camera";
                return Err(Error::scene(format!("builtin:{name}"), only));
            }
            None => gltf::load(path, choice)?,
        };
        scene.illuminate(None, &[])?;
        Ok(scene)
    }

    /// The built-in scenes: name and what each shows.
    pub fn builtins() -> &'static [(&'static str, &'static str)] {
        builtin::LIST
    }

    /// Resolves every material's matrices: `set` (by material name, `*` for all) over the material's own extras
    /// over `asked` over the scene's default over global. Later entries of `set` win.
    ///
    /// # Errors
    /// A name in `set` that no material has.
    pub fn illuminate(&mut self, asked: Option<Illumination>, set: &[(String, Illumination)]) -> Result<()> {
        let around = asked.or(self.illumination).unwrap_or(Illumination::GLOBAL);
        for (name, _) in set {
            if name != "*" && !self.materials.iter().any(|material| material.name == *name) {
                let known: Vec<_> = self.materials.iter().map(|m| m.name.as_str()).collect();
                return Err(Error::Usage(format!(
                    "--set {name}=…: {} has no material of that name; it has {}",
                    self.name,
                    if known.is_empty() { "none".to_owned() } else { known.join(", ") }
                )));
            }
        }
        for material in &mut self.materials {
            let chosen = set.iter().rev().find(|(name, _)| name == "*" || *name == material.name);
            material.resolve(around, chosen.map(|(_, illumination)| *illumination));
        }
        Ok(())
    }

    /// The scene's point (s, t) of the illumination square. None where no material's matrices follow it; a number that
    /// no matrix follows reads 1.
    pub fn point(&self) -> Option<(f32, f32)> {
        let s = self.materials.iter().find_map(|material| material.follows.s);
        let t = self.materials.iter().find_map(|material| material.follows.t);
        (s.is_some() || t.is_some()).then(|| (s.unwrap_or(1.0), t.unwrap_or(1.0)))
    }

    /// The same scene at another point of the square. Matrices of a material's own, and what `illuminate` set for
    /// single materials, stay.
    #[must_use]
    pub fn at(&self, s: f32, t: f32) -> Self {
        let mut scene = self.clone();
        scene.materials.iter_mut().for_each(|material| material.move_to(s, t));
        scene
    }

    /// The illumination of the scene in words: of all materials, or of each where they differ.
    pub fn describe_illumination(&self) -> String {
        let mut seen: Vec<(&str, Vec<&str>)> = Vec::new();
        for material in &self.materials {
            match seen.iter_mut().find(|(illumination, _)| *illumination == material.resolved) {
                Some((_, names)) => names.push(&material.name),
                None => seen.push((&material.resolved, vec![&material.name])),
            }
        }
        seen.sort_by_key(|(_, names)| std::cmp::Reverse(names.len()));
        match &seen[..] {
            [] => "none".into(),
            [(all, _)] => (*all).into(),
            [(most, _), rest @ ..] => {
                let rest: Vec<_> =
                    rest.iter().map(|(word, names)| format!("{} {word}", names.join(", "))).collect();
                format!("{most}; {}", rest.join("; "))
            }
        }
    }

    /// A hash of everything that decides the picture: equal scenes have equal hashes.
    pub fn hash(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        let bits = |v: &glam::Vec3| v.to_array().map(f32::to_bits);
        self.mesh.positions.iter().for_each(|p| bits(p).hash(&mut hasher));
        self.mesh.normals.iter().for_each(|n| bits(n).hash(&mut hasher));
        self.mesh.triangles.hash(&mut hasher);
        self.mesh.surface.hash(&mut hasher);
        let rest =
            format!("{:?} {:?} {:?} {:?}", self.surfaces, self.materials, self.luminaires, self.camera);
        rest.hash(&mut hasher);
        hasher.finish()
    }

    /// The material of a triangle.
    pub fn material_of(&self, triangle: u32) -> &Material {
        &self.materials[self.surfaces[self.mesh.surface[triangle as usize] as usize].material as usize]
    }

    /// Centre and radius of the bounding sphere of all triangles; a point at zero where there are none.
    pub fn bounding_sphere(&self) -> (glam::Vec3, f32) {
        let (min, max) = self.mesh.bounds();
        let centre = 0.5 * (min + max);
        let radius = self.mesh.positions.iter().map(|p| p.distance(centre)).fold(0.0, f32::max);
        (centre, radius)
    }
}
