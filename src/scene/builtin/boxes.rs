//! Scenes in a Cornell box that is open towards the camera. Half its side is 1.28 m, its walls look inward.

use super::shapes::{Builder, Look, Setting};
use crate::light::Light;
use crate::optics::{Dielectric, Lobe, Mirror};
use crate::scene::{Camera, Emission, Projection, Scene};
use glam::Vec3;
use std::f32::consts::FRAC_PI_4;

const HALF: f64 = 1.28;

/// A glass sphere whose caustic falls on the floor, and a mirror sphere that sees it.
pub(super) fn caustic_box(name: String) -> Result<Scene, String> {
    let mut builder = Builder::default();
    walls(&mut builder, 0.15, 150.0);
    let mirror =
        builder.material("Mirror", Lobe::Mirror(Mirror { tint: Vec3::splat(0.95), two_sided: false }));
    let glass = builder.material("Glass", Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::ONE }));
    let look = Look { around: 96, smooth: true, inward: false };
    builder.sphere("MirrorSphere", mirror, [-0.55, -0.78, -0.35], 0.5, look);
    // The sphere hangs where it brings the lamp to a focus on the floor: 1/f = 1/a + 1/b with f = 1.5 radii.
    builder.sphere("GlassSphere", glass, [0.5, -0.45, 0.35], 0.4, Look { around: 128, ..look });
    builder.finish(setting(name))
}

/// The paper's figure 1: everything is diffuse, and the luminaire is seen.
pub(super) fn cornell_spheres(name: String) -> Result<Scene, String> {
    let mut builder = Builder::default();
    walls(&mut builder, 0.5, 20.0);
    let ball = builder.diffuse("Ball", [0.73, 0.73, 0.73]);
    let look = Look { around: 64, smooth: true, inward: false };
    builder.sphere("BackBall", ball, [-0.55, -0.78, -0.3], 0.5, look);
    builder.sphere("FrontBall", ball, [0.55, -0.78, 0.3], 0.5, look);
    builder.finish(setting(name))
}

/// Floor, ceiling, back, red and green walls, and a lamp of the given side and radiance just below the ceiling.
fn walls(builder: &mut Builder, side: f64, radiance: f32) {
    let white = builder.diffuse("White", [0.73, 0.73, 0.73]);
    let red = builder.diffuse("Red", [0.63, 0.065, 0.05]);
    let green = builder.diffuse("Green", [0.14, 0.45, 0.091]);
    let radiance = Light::both(Vec3::splat(radiance));
    let lamp = builder.lamp(Emission { radiance, two_sided: false });
    let h = HALF;
    builder.quad("Floor", white, [[-h, -h, h], [h, -h, h], [h, -h, -h], [-h, -h, -h]]);
    builder.quad("Ceiling", white, [[-h, h, -h], [h, h, -h], [h, h, h], [-h, h, h]]);
    builder.quad("Back", white, [[-h, -h, -h], [h, -h, -h], [h, h, -h], [-h, h, -h]]);
    builder.quad("Left", red, [[-h, -h, h], [-h, -h, -h], [-h, h, -h], [-h, h, h]]);
    builder.quad("Right", green, [[h, -h, -h], [h, -h, h], [h, h, h], [h, h, -h]]);
    let (s, y) = (0.5 * side, 1.27);
    builder.quad("Lamp", lamp, [[-s, y, -s], [s, y, -s], [s, y, s], [-s, y, s]]);
}

fn setting(name: String) -> Setting {
    let eye = Vec3::new(0.0, 0.0, 4.1);
    let projection = Projection::Perspective { yfov: FRAC_PI_4 };
    let mut camera = Camera::look_at(eye, Vec3::ZERO, Vec3::Y, projection);
    camera.aspect = Some(1.0);
    Setting { name, camera, lights: Vec::new(), illumination: None }
}
