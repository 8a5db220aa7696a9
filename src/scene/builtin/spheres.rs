//! Scenes of two spheres: the paper's comparison with OpenGL, and a closed form.

use super::shapes::{Builder, Look, Setting};
use crate::light::Light;
use crate::optics::{Diffuse, Lobe};
use crate::scene::{Camera, Emission, Illumination, Luminaire, Projection, Scene};
use glam::Vec3;

/// The paper's figure 4: 500 000 triangles under a luminaire that is not seen.
pub(super) fn two_spheres(name: String) -> Result<Scene, String> {
    let mut builder = Builder::default();
    let floor = builder.diffuse("Floor", [0.6, 0.6, 0.6]);
    let back = builder.diffuse("BackBall", [0.75, 0.35, 0.25]);
    let front = builder.diffuse("FrontBall", [0.3, 0.45, 0.75]);
    let radiance = Light::new(Vec3::splat(25.0), Vec3::ZERO);
    let lamp = builder.lamp(Emission { radiance, two_sided: false });
    builder.quad("Floor", floor, [[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]]);
    let look = Look { around: 500, smooth: true, inward: false };
    builder.sphere("BackBall", back, [-0.6, 0.8, -0.5], 0.7, look);
    builder.sphere("FrontBall", front, [0.7, 0.6, 0.6], 0.5, look);
    builder.quad("Lamp", lamp, [[-0.5, 3.0, -0.5], [0.5, 3.0, -0.5], [0.5, 3.0, 0.5], [-0.5, 3.0, 0.5]]);
    let projection = Projection::Perspective { yfov: 35.0_f32.to_radians() };
    let mut camera = Camera::look_at(Vec3::new(0.0, 1.6, 5.2), Vec3::new(0.0, 0.6, 0.0), Vec3::Y, projection);
    camera.aspect = Some(4.0 / 3.0);
    let illumination = Some(Illumination::LOCAL);
    builder.finish(Setting { name, camera, lights: Vec::new(), illumination })
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
    let mut builder = Builder::default();
    let lobe = Lobe::Diffuse(Diffuse { albedo: Vec3::splat(chosen.albedo), two_sided: chosen.two_sided });
    let room = builder.material("Room", lobe);
    let ball = builder.material("Ball", lobe);
    // Flat triangles: interpolated normals would not conserve energy exactly.
    let look = Look { around: 256, smooth: false, inward: false };
    builder.sphere("Room", room, [0.0; 3], 1.0, Look { inward: true, ..look });
    builder.sphere("Ball", ball, [0.0; 3], f64::from(chosen.ratio), look);
    let between = |share: f32| chosen.ratio + share * (1.0 - chosen.ratio);
    let light = Luminaire::Point {
        position: between(0.5) * Vec3::new(0.7, 0.7, 0.14).normalize(),
        intensity: Light::both(Vec3::ONE),
    };
    let eye = between(0.9) * Vec3::new(0.0, 0.35, 1.0).normalize();
    let projection = Projection::Perspective { yfov: 75.0_f32.to_radians() };
    let camera = Camera::look_at(eye, Vec3::ZERO, Vec3::Y, projection);
    let illumination = Some(Illumination::SHADOWLESS);
    builder.finish(Setting { name, camera, lights: vec![light], illumination })
}
