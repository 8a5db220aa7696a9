//! What denoisers are told of mirrors and glass: the surfaces that are seen in them.

use crate::support::{Build, Measured, diffuse, glow, look, small};
use glam::Vec3;
use halflight::film::{Layer, PassImage};
use halflight::optics::{Lobe, Mirror, ThinDielectric};
use halflight::plan::Plan;
use halflight::render::{learn, render_pass};
use halflight::scene::{Illumination, Scene};

const LAYERS: [Layer; 4] = [Layer::Normal, Layer::Albedo, Layer::DenoisingNormal, Layer::DenoisingAlbedo];

/// The layers of so many passes, each on its own.
fn passes(scene: Scene, passes: u32) -> Vec<PassImage> {
    let plan = Plan::new(scene, small(8, 8, 500));
    let frame = learn(&plan);
    (0..passes).map(|pass| render_pass(&plan, &frame, pass, &LAYERS).0).collect()
}

fn plane(pass: &PassImage, layer: Layer) -> &[Vec3] {
    &pass.planes.iter().find(|(is, _)| *is == layer).expect("it was asked for").1
}

/// The mean of a component over pixels, from pass to pass.
fn mean(passes: &[PassImage], layer: Layer, component: fn(Vec3) -> f32) -> Measured {
    let of = |pass: &PassImage| {
        let plane = plane(pass, layer);
        plane.iter().map(|value| f64::from(component(*value))).sum::<f64>() / plane.len() as f64
    };
    Measured::of(&passes.iter().map(of).collect::<Vec<_>>())
}

fn looking_down() -> Build {
    let mut build =
        Build::new(Illumination::GLOBAL, look(Vec3::new(0.3, 2.0, 0.2), Vec3::new(0.3, 0.0, 0.2)));
    build.yfov(0.02);
    build
}

/// A level square of this side about the vertical axis, whose front looks up, or down.
fn level(build: &mut Build, height: f32, side: f32, material: u32, up: bool) {
    let corner = Vec3::new(-0.5 * side, height, -0.5 * side);
    let (a, b) = if up { (Vec3::Z, Vec3::X) } else { (Vec3::X, Vec3::Z) };
    build.quad(corner, side * a, side * b, material);
}

fn lamp(build: &mut Build) {
    let lamp = build.material("Lamp", diffuse(0.0));
    build.0.materials[lamp as usize].emission = glow(1.0);
    level(build, 9.0, 1.0, lamp, false);
}

#[test]
fn a_surface_that_scatters_is_what_its_own_layers_say() {
    let mut build = looking_down();
    let floor = build.material("Floor", diffuse(0.5));
    level(&mut build, 0.0, 4.0, floor, true);
    lamp(&mut build);
    for pass in passes(build.finish(), 2) {
        assert_eq!(plane(&pass, Layer::DenoisingNormal), plane(&pass, Layer::Normal));
        assert_eq!(plane(&pass, Layer::DenoisingAlbedo), vec![Vec3::splat(0.5); 64]);
    }
}

#[test]
fn a_mirror_is_what_it_shows_of_the_ceiling_behind_the_camera() {
    let mut build = looking_down();
    let mirror = build.material("Mirror", Lobe::Mirror(Mirror::plain(Vec3::splat(0.8), false)));
    let ceiling = build.material("Ceiling", diffuse(0.5));
    level(&mut build, 0.0, 4.0, mirror, true);
    level(&mut build, 3.0, 4.0, ceiling, false);
    lamp(&mut build);
    let shown = passes(build.finish(), 4);
    mean(&shown, Layer::DenoisingAlbedo, |rgb| rgb.x).must_be(0.8 * 0.5, 1e-6);
    mean(&shown, Layer::DenoisingNormal, |xyz| xyz.y).must_be(-1.0, 1e-6);
    mean(&shown, Layer::Normal, |xyz| xyz.y).must_be(1.0, 1e-6);
}

#[test]
fn a_pane_is_what_lies_behind_and_before_it_by_fresnels_share() {
    let mut build = looking_down();
    let pane = build.material("Pane", Lobe::ThinDielectric(ThinDielectric { ior: 1.5, tint: Vec3::ONE }));
    let (floor, ceiling) = (build.material("Floor", diffuse(0.6)), build.material("Ceiling", diffuse(0.9)));
    level(&mut build, 1.0, 4.0, pane, true);
    level(&mut build, 0.0, 4.0, floor, true);
    level(&mut build, 3.0, 4.0, ceiling, false);
    lamp(&mut build);
    let shown = passes(build.finish(), 16);
    // At normal incidence each face reflects ((n − 1) / (n + 1))² = 0.04, and both with all orders 2R / (1 + R).
    let reflected = 2.0 * 0.04 / 1.04;
    let albedo = (1.0 - reflected) * 0.6 + reflected * 0.9;
    mean(&shown, Layer::DenoisingAlbedo, |rgb| rgb.x).must_be(albedo, 1e-4);
    mean(&shown, Layer::DenoisingNormal, |xyz| xyz.y).must_be(1.0 - 2.0 * reflected, 1e-4);
}

#[test]
fn where_nothing_scatters_both_are_zero() {
    let mut build = looking_down();
    let mirror = build.material("Mirror", Lobe::Mirror(Mirror::plain(Vec3::splat(0.8), false)));
    level(&mut build, 0.0, 4.0, mirror, true);
    let lamp = build.material("Lamp", diffuse(0.5));
    build.0.materials[lamp as usize].emission = glow(1.0);
    build.quad(Vec3::new(9.0, 9.0, 9.0), Vec3::X, Vec3::Z, lamp);
    let shown = passes(build.finish(), 2);
    for layer in [Layer::DenoisingAlbedo, Layer::DenoisingNormal] {
        assert!(shown.iter().all(|pass| plane(pass, layer) == vec![Vec3::ZERO; 64]), "{layer}");
    }
    mean(&shown, Layer::Albedo, |rgb| rgb.x).must_be(0.8, 1e-6);
}
