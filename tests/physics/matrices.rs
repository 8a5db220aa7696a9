//! The order of matrices: light multiplies from the left, rows from the right.

use crate::support::{Build, diffuse, look, measure, small};
use glam::Vec3;
use halflight::film::Layer;
use halflight::light::{Light, Matrix};
use halflight::plan::{Direct, Settings};
use halflight::render::Render;
use halflight::scene::{Illumination, Luminaire, Matter, Scene, SpotCone};
use std::f64::consts::PI;

pub const A: Matrix = Matrix::new([[0.5, 0.25], [0.1, 0.7]]);
pub const B: Matrix = Matrix::new([[0.3, 0.0], [0.6, 0.2]]);
const FLOOR: Matrix = Matrix::new([[0.0, 0.0], [0.8, 0.3]]);

/// A spot of (I_inv, I_vis) = (5, 2) above two sheets that do not commute, above a floor.
pub fn stack(upper: Matrix, lower: Matrix) -> Scene {
    let mut build = Build::new(Illumination::LOCAL, look(Vec3::new(2.0, 0.3, 0.0), Vec3::ZERO));
    build.yfov(0.001);
    let own = |straight| Illumination::Own(Matter { opaque: Matrix::ZERO, straight });
    let floor = build.material("Floor", diffuse(0.5));
    build.0.materials[floor as usize].opaque = Some(FLOOR);
    build.quad(Vec3::new(-2.5, 0.0, -2.5), Vec3::Z * 5.0, Vec3::X * 5.0, floor);
    for (name, matrix, y) in [("Lower", lower, 0.5), ("Upper", upper, 1.0)] {
        let sheet = build.material(name, diffuse(0.5));
        build.0.materials[sheet as usize].illumination = Some(own(matrix));
        build.quad(Vec3::new(-0.5, y, -0.5), Vec3::Z, Vec3::X, sheet);
    }
    let intensity = Light::new(Vec3::splat(5.0), Vec3::splat(2.0));
    let cone = SpotCone::of_cosines(0.99, 0.98);
    build.0.luminaires.push(Luminaire::Spot {
        position: Vec3::Y * 2.0,
        direction: -Vec3::Y,
        intensity,
        cone,
    });
    build.finish()
}

pub fn expected(upper: Matrix, lower: Matrix) -> f64 {
    let light = FLOOR * (lower * (upper * Light::new(Vec3::splat(5.0), Vec3::splat(2.0))));
    f64::from(light.visible.x) / 4.0 * 0.5 / PI
}

#[test]
fn connections_multiply_in_the_order_light_meets_them() {
    assert!((expected(A, B) / expected(B, A) - 1.0).abs() > 0.05, "the example must not commute");
    for (upper, lower) in [(A, B), (B, A)] {
        measure(stack(upper, lower), small(8, 8, 1), 4).must_be(expected(upper, lower), 0.001);
    }
}

#[test]
fn photons_multiply_in_the_order_light_meets_them() {
    for (upper, lower) in [(A, B), (B, A)] {
        let settings = Settings { direct: Direct::Photons, indirect_radius: 100.0, ..small(8, 8, 200_000) };
        let mut scene = stack(upper, lower);
        scene.camera = look(Vec3::new(2.0, 0.3, 0.0), Vec3::ZERO);
        scene.camera.projection = halflight::scene::Projection::Orthographic { half_height: 0.002 };
        measure(scene, settings, 48).must_be(expected(upper, lower), 0.002);
    }
}

#[test]
fn the_invisible_layer_reads_the_other_row() {
    // A floor that reflects into the invisible half only: the picture is black, the invisible layer is not.
    let mut build = Build::new(Illumination::LOCAL, look(Vec3::new(0.0, 1.0, 0.0), Vec3::ZERO));
    build.yfov(0.001);
    let floor = build.material("Floor", diffuse(0.5));
    build.0.materials[floor as usize].opaque = Some(Matrix::new([[0.4, 0.0], [0.0, 0.0]]));
    build.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, floor);
    let intensity = Light::both(Vec3::splat(5.0));
    build.0.luminaires.push(Luminaire::Point { position: Vec3::new(0.0, 2.0, 0.0), intensity });
    let mut render = Render::new(build.finish(), small(8, 8, 1000), &[Layer::Visible, Layer::Invisible])
        .expect("a render");
    render.pass();
    let mean = |layer| {
        let plane = render.film().mean(layer);
        plane.iter().map(|rgb| f64::from(rgb.x)).sum::<f64>() / plane.len() as f64
    };
    assert_eq!(mean(Layer::Visible), 0.0);
    let expected = 0.4 * 5.0 / 4.0 * 0.5 / PI;
    assert!((mean(Layer::Invisible) / expected - 1.0).abs() < 0.001);
}
