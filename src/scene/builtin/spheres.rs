//! Scenes of two spheres: the paper's comparison with OpenGL, and a closed form.

use crate::light::Light;
use crate::optics::{Diffuse, Lobe};
use crate::scene::{
    Camera, Emission, Illumination, Luminaire, Material, Projection, Scene, SceneBuilder, Shape,
};
use glam::Vec3;

/// The paper's figure 4: 500 000 triangles under a luminaire that is not seen.
pub(super) fn two_spheres(name: String) -> Result<Scene, String> {
    let projection = Projection::Perspective { yfov: 35.0_f32.to_radians() };
    let mut camera = Camera::look_at(Vec3::new(0.0, 1.6, 5.2), Vec3::new(0.0, 0.6, 0.0), Vec3::Y, projection);
    camera.aspect = Some(4.0 / 3.0);
    let mut scene = SceneBuilder::new(name).camera(camera).illumination(Illumination::LOCAL);
    let floor = scene.material(Material::diffuse("Floor", Vec3::splat(0.6)));
    let back = scene.material(Material::diffuse("BackBall", Vec3::new(0.75, 0.35, 0.25)));
    let front = scene.material(Material::diffuse("FrontBall", Vec3::new(0.3, 0.45, 0.75)));
    let radiance = Light::new(Vec3::splat(25.0), Vec3::ZERO);
    let lamp = Material::diffuse("Lamp", Vec3::ZERO).with_emission(Emission { radiance, two_sided: false });
    let lamp = scene.material(lamp);
    let corners = [[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]];
    scene.shape(Shape::quad("Floor", floor, corners));
    scene.shape(Shape::sphere("BackBall", back, [-0.6, 0.8, -0.5], 0.7, 500));
    scene.shape(Shape::sphere("FrontBall", front, [0.7, 0.6, 0.6], 0.5, 500));
    let corners = [[-0.5, 3.0, -0.5], [0.5, 3.0, -0.5], [0.5, 3.0, 0.5], [-0.5, 3.0, 0.5]];
    scene.shape(Shape::quad("Lamp", lamp, corners));
    scene.built()
}

/// What can be chosen about [`concentric`].
pub(super) struct Concentric {
    /// ρ of both spheres.
    pub albedo: f32,
    /// Radius of the inner sphere; that of the room is 1 m.
    pub ratio: f32,
    /// Whether both sides reflect.
    pub two_sided: bool,
}

/// A spherical room around a sphere with a point light between them, shadowless: its multiplication factor has
/// a closed form, see `scenes/README.md`.
pub(super) fn concentric(name: String, chosen: &Concentric) -> Result<Scene, String> {
    let between = |share: f32| chosen.ratio + share * (1.0 - chosen.ratio);
    let light = Luminaire::Point {
        position: between(0.5) * Vec3::new(0.7, 0.7, 0.14).normalize(),
        intensity: Light::both(Vec3::ONE),
    };
    let eye = between(0.9) * Vec3::new(0.0, 0.35, 1.0).normalize();
    let projection = Projection::Perspective { yfov: 75.0_f32.to_radians() };
    let camera = Camera::look_at(eye, Vec3::ZERO, Vec3::Y, projection);
    let mut scene = SceneBuilder::new(name).camera(camera).illumination(Illumination::SHADOWLESS);
    let lobe = Lobe::Diffuse(Diffuse {
        albedo: Vec3::splat(chosen.albedo),
        two_sided: chosen.two_sided,
        under: None,
    });
    let room = scene.material(Material::new("Room", lobe));
    let ball = scene.material(Material::new("Ball", lobe));
    // Flat triangles: interpolated normals would not conserve energy exactly.
    scene.shape(Shape::sphere("Room", room, [0.0; 3], 1.0, 256).flat().inside_out());
    scene.shape(Shape::sphere("Ball", ball, [0.0; 3], f64::from(chosen.ratio), 256).flat());
    scene.luminaire(light);
    scene.built()
}
