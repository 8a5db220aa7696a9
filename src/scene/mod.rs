//! What is there: one flat soup of triangles with surfaces and materials, luminaires, a camera.
//!
//! [`Scene::load`] reads a file; [`Scene::builder`] makes a scene in code:
//!
//! ```
//! use glam::Vec3;
//! use halflight::scene::{Camera, Illumination, Luminaire, Material, Projection, Scene, Shape};
//! use halflight::{film::Layer, light::Light, plan::Settings, render::Render};
//!
//! # fn main() -> halflight::error::Result<()> {
//! let projection = Projection::Perspective { yfov: 0.01 };
//! let camera = Camera::look_at(0.5 * Vec3::Y, Vec3::ZERO, Vec3::Z, projection);
//! let mut scene = Scene::builder("veil").camera(camera).illumination(Illumination::GLOBAL);
//! let floor = scene.material(Material::diffuse("Floor", Vec3::splat(0.5)));
//! let veil = Material::diffuse("Veil", Vec3::ZERO).with_straight([[0.25, 0.0], [0.0, 1.0]]);
//! let veil = scene.material(veil);
//! let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
//! let level = |y: f64| corners.map(|[x, z]| [x, y, z]);
//! scene.shape(Shape::new("Floor", floor, level(0.0), [[0, 1, 2], [0, 2, 3]]));
//! scene.shape(Shape::quad("Veil", veil, level(1.0)));
//! let intensity = Light::both(Vec3::splat(3.0));
//! scene.luminaire(Luminaire::Point { position: 2.0 * Vec3::Y, intensity });
//!
//! let settings = Settings { width: 8, height: 8, paths: Some(1_000), ..Settings::default() };
//! let mut render = Render::new(scene.build()?, settings, &[Layer::Visible])?;
//! (0..4).for_each(|_| render.pass());
//! // A quarter of 3 W/sr arrives 2 m below; half of that is reflected, over π.
//! let expected = 0.25 * 3.0 / 4.0 * 0.5 / std::f32::consts::PI;
//! assert!(render.film().mean(Layer::Visible).iter().all(|rgb| (rgb.x / expected - 1.0).abs() < 1e-3));
//! # Ok(())
//! # }
//! ```
//!
//! Everything refers by index. Positions are f32 relative to [`Scene::origin`], so that a scene far from the world's
//! origin loses no precision.

mod assembly;
mod build;
mod builtin;
mod camera;
mod centre;
mod check;
pub mod environment;
mod fluorescence;
mod gltf;
mod hash;
#[cfg(test)]
mod hash_tests;
mod illumination;
mod lm63;
mod luminaire;
mod material;
mod matter_at;
mod mesh;
pub(crate) mod names;
mod part;
mod pbr;
mod pose;
mod profile;
mod shape;
pub mod texture;
mod uneven;
mod web;

pub use build::SceneBuilder;
pub use camera::{Camera, Lens, Projection, View};
pub use environment::{Background, Environment, Surroundings};
pub use fluorescence::Fluorescence;
pub(crate) use hash::Fnv;
pub use illumination::{Illumination, Matter};
pub use luminaire::{Emission, Luminaire, SpotCone, versine_between, warn_falloff};
pub use material::{Backs, Material};
pub use matter_at::MatterAt;
pub(crate) use mesh::gamma;
pub use mesh::{Mesh, Surface, SurfacePoint};
pub use part::Part;
pub(crate) use part::Parts;
pub use pbr::{Alpha, Anisotropy, Factor, NormalMap, Parameters, Pbr, VertexColours};
pub use pose::Pose;
pub use profile::Profile;
pub use shape::Shape;
pub use texture::Inputs;

use crate::error::{Error, Result};
use crate::light::Light;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
    /// How those of them shine that were measured.
    pub profiles: Vec<Profile>,
    /// From where it is seen.
    pub camera: Camera,
    /// World position (m) of the point that `mesh` and `camera` call zero.
    pub origin: DVec3,
    /// The scene's own default illumination (glTF scene extras), if it has one.
    pub illumination: Option<Illumination>,
    /// What shines from all around, which is one of the luminaires as far as it is of use to anything that reflects.
    pub environment: Option<Arc<Environment>>,
    /// What a line sees that meets nothing else: the luminaires at infinity, also those that light nothing.
    pub skies: Vec<Luminaire>,
    /// Nothing in its file lights it, so that the built-in studio does.
    pub lit_by_studio: bool,
    /// What the loader has to tell the user, one line each.
    pub notes: Vec<String>,
}

/// What is shown of a file that holds several scenes, or of a scene that several cameras see; and how much of it there may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// A scene by its name, else by its number from 0 in the order of the file. None: the file's default.
    pub scene: Option<String>,
    /// A camera by the name of its node, else by its own, else by its number from 0 among those of the scene. None: the
    /// first.
    pub camera: Option<String>,
    /// As an animation has it at a time. None: at rest.
    pub pose: Option<Pose>,
    /// A variant of its materials by its name, else by its number from 0. None: the materials that its meshes name.
    pub variant: Option<String>,
    /// More triangles than this, every instance counted, are refused before anything of the file is built.
    pub max_triangles: u64,
    /// What is around it, over what its file says.
    pub around: Surroundings,
    /// A scene in which nothing emits light is taken, with a note, by who wants to know what is in it.
    pub dark: bool,
}

impl Default for Choice {
    fn default() -> Self {
        Self {
            scene: None,
            camera: None,
            pose: None,
            variant: None,
            max_triangles: MAX_TRIANGLES,
            around: Surroundings::default(),
            dark: false,
        }
    }
}

impl Choice {
    /// True where nothing is chosen of what is in a file.
    fn is_empty(&self) -> bool {
        self.scene.is_none() && self.camera.is_none() && self.pose.is_none() && self.variant.is_none()
    }
}

/// What is noted of a scene without a camera of its own. It is seen in a square, and more of it on a film of another shape.
pub(crate) const NO_CAMERA: &str = "has no camera; it is seen from the front and slightly above";

/// More illuminations than these are counted instead of described.
const MOST_TOLD: usize = 16;

/// A scene and where it came from.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// The files that it is of: its own, buffers, images. None for a built-in scene.
    pub files: Vec<PathBuf>,
    /// The names of the variants of its materials that its file has.
    pub variants: Vec<String>,
    /// The animations of its file, each by its name, else by its number.
    pub animations: Vec<String>,
}

/// More triangles than this, every instance counted, are a mistake or an attack sooner than a scene.
pub const MAX_TRIANGLES: u64 = 50_000_000;

impl Scene {
    /// A scene to be built in code; `name` is for messages.
    pub fn builder(name: impl Into<String>) -> SceneBuilder {
        SceneBuilder::new(name)
    }

    /// Loads a `.gltf` or `.glb` file, or one of the built-in scenes by its name (`builtin:caustic-box`, …).
    ///
    /// Illumination is resolved with nothing asked for on the command line.
    ///
    /// # Errors
    /// One line that names the file, the thing and the way out.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        Self::load_chosen(path, &Choice::default()).map(|loaded| loaded.scene)
    }

    /// The same, where a file has more than one scene or camera; with the files that it is of.
    ///
    /// # Errors
    /// As [`load`](Self::load); also where there is no such scene or camera, or more triangles than may be or than memory holds.
    pub fn load_chosen(path: impl AsRef<Path>, choice: &Choice) -> Result<Loaded> {
        let path = path.as_ref();
        match path.to_str().and_then(|p| p.strip_prefix("builtin:")) {
            Some(name) if choice.is_empty() => {
                let mut scene = builtin::scene(name)?;
                scene.put_into(&choice.around, None)?;
                let files = choice.around.file(None)?.into_iter().collect();
                Ok(Loaded { scene, files, variants: Vec::new(), animations: Vec::new() })
            }
            Some(name) => {
                let only = "a built-in scene is one scene with one camera at rest; leave out --scene, --camera, --pose and \
                            --variant";
                Err(Error::scene(format!("builtin:{name}"), only))
            }
            None => gltf::load(path, choice),
        }
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
        for (name, _) in set {
            if name != "*" && !self.materials.iter().any(|material| material.name == *name) {
                let known = names::listed(self.materials.iter().map(|m| m.name.as_str()));
                return Err(Error::Usage(format!(
                    "--set {name}=…: {} has no material of that name; it has {}",
                    self.name,
                    if known.is_empty() { "none" } else { &known }
                )));
            }
        }
        self.resolve(asked, set);
        Ok(())
    }

    /// Puts it into an environment, one for another.
    pub fn surround(&mut self, environment: Environment) {
        let other = |luminaire: &Luminaire| !matches!(luminaire, Luminaire::Environment { .. });
        self.luminaires.retain(other);
        self.skies.retain(other);
        let fluence = environment.fluence();
        if !fluence.is_zero() {
            self.luminaires.push(Luminaire::Environment { fluence });
            self.skies.push(Luminaire::Environment { fluence });
        }
        self.environment = Some(Arc::new(environment));
    }

    /// Which of the luminaires each of the [`skies`](Self::skies) is, by index. None: it lights nothing.
    pub fn lighting_skies(&self) -> Vec<Option<u32>> {
        let same = |a: &Luminaire, b: &Luminaire| match (a, b) {
            (Luminaire::Environment { .. }, Luminaire::Environment { .. }) => true,
            (
                Luminaire::Sun { direction: a, versine: v, .. },
                Luminaire::Sun { direction: b, versine: w, .. },
            ) => (a, v) == (b, w),
            _ => false,
        };
        let index = |sky| self.luminaires.iter().position(|luminaire| same(sky, luminaire)).map(|i| i as u32);
        self.skies.iter().map(index).collect()
    }

    /// What a luminaire at infinity radiates from the unit vector `to`, W m⁻² sr⁻¹: an environment in the components that the
    /// luminaire shines in.
    pub fn radiance_from(&self, luminaire: &Luminaire, to: Vec3) -> Light {
        match luminaire {
            Luminaire::Environment { fluence } => self
                .environment
                .as_ref()
                .map_or(Light::ZERO, |environment| environment.radiance(to).kept_where(*fluence)),
            Luminaire::Sun { direction, radiance, versine }
                if versine_between(to, -*direction) <= *versine =>
            {
                *radiance
            }
            _ => Light::ZERO,
        }
    }

    fn resolve(&mut self, asked: Option<Illumination>, set: &[(String, Illumination)]) {
        let around = asked.or(self.illumination).unwrap_or(Illumination::GLOBAL);
        for material in &mut self.materials {
            let chosen = set.iter().rev().find(|(name, _)| name == "*" || *name == material.name);
            material.resolve(around, chosen.map(|(_, illumination)| *illumination));
        }
        let reads_visible = self.materials.iter().any(Material::reads_visible);
        if let Some(environment) = &mut self.environment {
            Arc::make_mut(environment).visible_lights(reads_visible);
        }
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
        let mut known = HashMap::new();
        for material in &self.materials {
            let index = *known.entry(material.resolved.as_str()).or_insert_with(|| {
                seen.push((&material.resolved, Vec::new()));
                seen.len() - 1
            });
            seen[index].1.push(&material.name);
        }
        seen.sort_by_key(|(_, names)| std::cmp::Reverse(names.len()));
        match &seen[..] {
            [] => "none".into(),
            [(all, _)] => (*all).into(),
            [(most, _), rest @ ..] => {
                let told = rest.iter().take(MOST_TOLD);
                let mut told: Vec<_> =
                    told.map(|(word, of)| format!("{} {word}", names::listed(of.iter().copied()))).collect();
                if rest.len() > MOST_TOLD {
                    told.push(format!("{} more", rest.len() - MOST_TOLD));
                }
                format!("{most}; {}", told.join("; "))
            }
        }
    }

    /// A hash of everything that decides the picture, and of nothing else that can be told apart: geometry about
    /// [`origin`](Self::origin), resolved matrices, luminaires, camera. Names, notes and the place in the world have no part in it.
    ///
    /// Stable: the same on every machine and with every compiler (FNV-1a of 64 bits over the fields). It finds what was mixed up
    /// or changed by mistake, not by malice.
    pub fn hash(&self) -> u64 {
        hash::hash(self)
    }

    /// True where some matter re-radiates light in other colours.
    pub fn fluoresces(&self) -> bool {
        let mut terms = self.materials.iter().flat_map(|material| &material.bsdf.terms);
        terms.any(|term| term.turn.is_reradiated())
    }

    /// The images of all textures, each once.
    pub fn images(&self) -> Vec<&Arc<texture::Image>> {
        let mut images: Vec<&Arc<texture::Image>> = Vec::new();
        let patterns = self.materials.iter().filter_map(|material| material.pattern.as_deref());
        for texture in patterns.flat_map(Pbr::textures) {
            if !images.iter().any(|known| Arc::ptr_eq(known, &texture.image)) {
                images.push(&texture.image);
            }
        }
        images
    }

    /// What they take in memory, and the environment, and how lamps shine that were measured.
    pub fn image_bytes(&self) -> usize {
        let environment = self.environment.as_ref().map_or(0, |environment| environment.bytes());
        let profiles: usize = self.profiles.iter().map(Profile::bytes).sum();
        self.images().iter().map(|image| image.bytes()).sum::<usize>() + environment + profiles
    }

    /// The surface that a triangle belongs to.
    #[inline]
    pub fn surface_of(&self, triangle: u32) -> &Surface {
        &self.surfaces[self.mesh.surface[triangle as usize] as usize]
    }

    /// The material of a triangle.
    #[inline]
    pub fn material_of(&self, triangle: u32) -> &Material {
        &self.materials[self.surface_of(triangle).material as usize]
    }

    /// Centre and radius of the bounding sphere of all triangles; a point at zero where there are none.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        let (min, max) = self.mesh.bounds();
        let centre = 0.5 * (min + max);
        let radius = self.mesh.positions.iter().map(|p| p.distance(centre)).fold(0.0, f32::max);
        (centre, radius)
    }
}
