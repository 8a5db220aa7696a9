//! The only builder of scenes: for users of the library, for the glTF loader, for the built-in scenes.

use super::assembly::{Assembly, assemble};
use super::centre::Eye;
use super::check::check;
use super::names::{listed, one_line};
use super::{Camera, Environment, Illumination, Luminaire, Material, Profile, Scene, Shape};
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
    /// How those of them shine that were measured; they refer by index.
    pub profiles: Vec<Profile>,
    /// From where it is seen; there must be one.
    pub camera: Option<Camera>,
    /// The scene's default illumination. None: global.
    pub illumination: Option<Illumination>,
    /// What shines from all around. None: nothing.
    pub environment: Option<Environment>,
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
            profiles: Vec::new(),
            camera: None,
            illumination: None,
            environment: None,
            origin: None,
            notes: Vec::new(),
        }
    }

    /// What it is called in messages.
    pub fn name(&self) -> &str {
        &self.name
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

    /// With light from all around.
    #[must_use]
    pub fn environment(self, environment: Environment) -> Self {
        Self { environment: Some(environment), ..self }
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

    /// Adds what shines without being a shape: point, spot, Warn and directional lights, measured lamps, suns.
    pub fn luminaire(&mut self, luminaire: Luminaire) -> &mut Self {
        self.luminaires.push(luminaire);
        self
    }

    /// Adds how a lamp shines and returns its index, which [`Luminaire::Profile`] refers to it by.
    pub fn profile(&mut self, profile: Profile) -> u32 {
        self.profiles.push(profile);
        self.profiles.len() as u32 - 1
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
                | Luminaire::Warn { position, .. }
                | Luminaire::Profile { position, .. } => *position = local(*position),
                Luminaire::Triangle { .. }
                | Luminaire::Directional { .. }
                | Luminaire::Sun { .. }
                | Luminaire::Environment { .. } => {}
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
        let skies = assembly.luminaires.iter().filter(|luminaire| luminaire.is_sky()).copied().collect();
        let mut scene = Scene {
            name: self.name,
            mesh: assembly.mesh,
            surfaces: assembly.surfaces,
            materials: self.materials,
            luminaires: assembly.luminaires,
            profiles: self.profiles,
            camera,
            origin: assembly.origin,
            illumination: self.illumination,
            environment: None,
            skies,
            lit_by_studio: false,
            notes: self.notes,
        };
        if let Some(environment) = self.environment {
            scene.surround(environment);
        }
        scene.resolve(None, &[]);
        scene
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Emission, Lens, Projection};

    /// A lamp above a floor, 1000 km from the world's zero.
    fn far() -> SceneBuilder {
        let at = 1e6 * Vec3::X;
        let camera = Camera::look_at(at + Vec3::Z, at, Vec3::Y, Projection::Perspective { yfov: 1.0 });
        let mut scene = Scene::builder("far").camera(camera).illumination(Illumination::LOCAL);
        let floor = scene.material(Material::diffuse("Floor", Vec3::ONE));
        let lamp = Material::diffuse("Lamp", Vec3::ZERO).with_emission(Emission::front(Vec3::ONE));
        let lamp = scene.material(lamp);
        let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
        let level = |y: f64| corners.map(|[x, z]| [1e6 + x, y, z]);
        scene.shape(Shape::quad("Floor", floor, level(0.0)));
        scene.shape(Shape::quad("Lamp", lamp, level(1.0)).inside_out());
        scene.luminaire(Luminaire::Point { position: at, intensity: crate::light::Light::both(Vec3::ONE) });
        scene
    }

    #[test]
    fn what_is_built_is_ready_to_be_planned() {
        let scene = far().build().unwrap();
        assert_eq!(scene.origin, DVec3::new(1e6 + 0.5, 0.5, 0.5));
        assert_eq!(scene.camera.position, Vec3::new(-0.5, -0.5, 0.5));
        assert_eq!(scene.surfaces.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["Lamp", "Floor"]);
        let [Luminaire::Triangle { triangle: 0, area: 0.5, .. }, _, Luminaire::Point { position, .. }] =
            scene.luminaires[..]
        else {
            panic!("{:?}", scene.luminaires)
        };
        assert_eq!((position, scene.mesh.normal(0)), (Vec3::new(-0.5, -0.5, -0.5), Vec3::NEG_Y));
        assert_eq!(scene.material_of(2).resolved(), "local");
        assert_eq!(far().origin(DVec3::X).build().unwrap().mesh.corners(2)[0].x, 1e6 - 1.0);
    }

    #[test]
    fn what_cannot_be_is_told_in_a_line() {
        type Spoil = fn(&mut SceneBuilder);
        let nan = f32::NAN;
        let cases: [(&str, Spoil); 18] = [
            ("no camera", |s| s.camera = None),
            ("camera: ", |s| s.camera.as_mut().unwrap().forward = Vec3::NAN),
            ("camera: ", |s| s.camera.as_mut().unwrap().projection = Projection::Perspective { yfov: 4.0 }),
            ("camera: its aspect", |s| s.camera.as_mut().unwrap().aspect = Some(0.0)),
            ("camera: Lens", |s| s.camera.as_mut().unwrap().lens = Some(Lens { radius: 0.1, focus: 0.0 })),
            ("camera: an orthographic camera has no lens", |s| {
                let camera = s.camera.as_mut().unwrap();
                camera.lens = Some(Lens { radius: 0.1, focus: 1.0 });
                camera.projection = Projection::Orthographic { half_height: 1.0 };
            }),
            ("`Floor`: there is no material 2", |s| s.shapes[0].material = 2),
            ("`Floor`: a triangle refers to vertex 4 of 4", |s| s.shapes[0].triangles[1][2] = 4),
            ("`Floor`: the position of vertex 3", |s| s.shapes[0].positions[3].y = f64::INFINITY),
            ("4 positions and 3 normals", |s| s.shapes[0].normals = Some(vec![Vec3::Y; 3])),
            ("`Floor`: the normal of vertex 0", |s| s.shapes[0].normals = Some(vec![Vec3::NAN; 4])),
            ("`Floor`: Diffuse", |s| s.materials[0] = Material::diffuse("Floor", Vec3::NEG_X)),
            ("`Glass`: its ior is 0", |s| s.materials[0] = Material::glass("Glass", 0.0)),
            ("negative", |s| s.materials[0].straight = Some([[0.0, -1.0], [0.0, 0.0]].into())),
            ("outside the square", |s| s.illumination = Some(Illumination::Square { s: 2.0, t: 0.0 })),
            ("`Lamp`: its emission", |s| s.materials[1].emission = Some(Emission::front(Vec3::INFINITY))),
            ("more power", |s| s.materials[1].emission = Some(Emission::front(Vec3::splat(1e38)))),
            ("its direction", |s| {
                s.luminaires.push(Luminaire::Directional {
                    direction: Vec3::ZERO,
                    irradiance: crate::light::Light::ZERO,
                });
            }),
        ];
        for (needle, spoil) in cases {
            let mut scene = far();
            spoil(&mut scene);
            let told = scene.build().expect_err(needle).to_string();
            assert!(told.starts_with("far: ") && told.contains(needle) && !told.contains('\n'), "{told}");
        }
        let itself = Camera::look_at(Vec3::ONE, Vec3::ONE, Vec3::Y, Projection::Perspective { yfov: nan });
        assert!(far().camera(itself).build().is_err());
    }
}
