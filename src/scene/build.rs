//! The only builder of scenes: for users of the library, for the glTF loader, for what is built in.

use super::assembly::{Assembly, assemble};
use super::centre::Eye;
use super::check::check;
use super::names::{listed, one_line};
use super::{Camera, Illumination, Luminaire, Material, Scene, Shape};
use crate::error::{Error, Result};
use glam::{DVec3, Vec3};

/// Collects what is there, in world space, and makes a [`Scene`] of it.
///
/// Positions of shapes are f64; those of the camera and of luminaires f32, so build what lies far from the world's zero about
/// zero.
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    name: String,
    /// What shapes are made of; they refer by index.
    pub materials: Vec<Material>,
    /// Triangles; the first is met where some coincide, after those that shine.
    pub shapes: Vec<Shape>,
    /// What shines beside the triangles whose material does, which are found.
    pub luminaires: Vec<Luminaire>,
    /// From where it is seen; there must be one.
    pub camera: Option<Camera>,
    /// The scene's default illumination. None: global.
    pub illumination: Option<Illumination>,
    /// The world position (m) that the scene calls zero. None: where f32 loses least of what the camera sees.
    pub origin: Option<DVec3>,
    /// What to tell whoever renders it, one line each.
    pub notes: Vec<String>,
}

impl SceneBuilder {
    /// Nothing yet.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            materials: Vec::new(),
            shapes: Vec::new(),
            luminaires: Vec::new(),
            camera: None,
            illumination: None,
            origin: None,
            notes: Vec::new(),
        }
    }

    /// With a camera, in world space.
    #[must_use]
    pub fn camera(self, camera: Camera) -> Self {
        Self { camera: Some(camera), ..self }
    }

    /// With a default illumination, which materials may have their own beside.
    #[must_use]
    pub fn illumination(self, illumination: Illumination) -> Self {
        Self { illumination: Some(illumination), ..self }
    }

    /// With a zero (m, in the world) of your own choice.
    #[must_use]
    pub fn origin(self, origin: DVec3) -> Self {
        Self { origin: Some(origin), ..self }
    }

    /// Adds a material and returns its index, which shapes refer to it by.
    pub fn material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        self.materials.len() as u32 - 1
    }

    /// Adds triangles.
    pub fn shape(&mut self, shape: Shape) -> &mut Self {
        self.shapes.push(shape);
        self
    }

    /// Adds what shines without being a shape: point, spot, Warn and directional lights.
    pub fn luminaire(&mut self, luminaire: Luminaire) -> &mut Self {
        self.luminaires.push(luminaire);
        self
    }

    /// The scene, its matrices resolved for its own illumination; [`Scene::illuminate`] resolves them for another.
    ///
    /// Triangles without area are left out, and of luminous triangles that are there twice one; the notes tell so.
    ///
    /// # Errors
    /// [`Error::Scene`], in one line that names the thing: no camera; numbers that are not finite, or negative where an amount is
    /// asked for; an index that leads nowhere; as many normals as positions not given; more power or larger triangles than
    /// single precision holds.
    pub fn build(self) -> Result<Scene> {
        let name = self.name.clone();
        self.built().map_err(|reason| Error::scene(name, one_line(&reason)))
    }

    /// The same, for who names the scene in another way.
    pub(super) fn built(mut self) -> std::result::Result<Scene, String> {
        let mut camera = self.camera.ok_or("has no camera; give it one, as Camera::look_at makes them")?;
        check(&self, &camera)?;
        let mut assembly = self.assemble(Some(Eye::of(&camera)))?;
        self.notes.extend(assembly.lines());
        if !assembly.inside_out.is_empty() {
            let names = listed(assembly.inside_out.iter().map(String::as_str));
            self.notes.push(format!("{}: {names}", Assembly::INSIDE_OUT));
        }
        let local = |p: Vec3| (p.as_dvec3() - assembly.origin).as_vec3();
        camera.position = local(camera.position);
        for luminaire in &mut self.luminaires {
            match luminaire {
                Luminaire::Point { position, .. }
                | Luminaire::Spot { position, .. }
                | Luminaire::Warn { position, .. } => *position = local(*position),
                Luminaire::Triangle { .. } | Luminaire::Directional { .. } => {}
            }
        }
        assembly.luminaires.append(&mut self.luminaires);
        Ok(self.finish(assembly, camera))
    }

    /// Puts the shapes together about a zero of the builder's own, or one for `eye`.
    pub(super) fn assemble(&mut self, eye: Option<Eye>) -> std::result::Result<Assembly, String> {
        assemble(std::mem::take(&mut self.shapes), &self.materials, self.origin, eye)
    }

    /// The scene of what [`assemble`](Self::assemble) made, with all its luminaires, and a camera in its space.
    pub(super) fn finish(self, assembly: Assembly, camera: Camera) -> Scene {
        let mut scene = Scene {
            name: self.name,
            mesh: assembly.mesh,
            surfaces: assembly.surfaces,
            materials: self.materials,
            luminaires: assembly.luminaires,
            camera,
            origin: assembly.origin,
            illumination: self.illumination,
            notes: self.notes,
        };
        scene.resolve(None, &[]);
        scene
    }
}
