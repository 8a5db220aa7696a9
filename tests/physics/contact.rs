//! Where things touch, lie on each other or are small, gather disks of several pixels see no more light than there is.
//!
//! Each scene is looked at with the radii of a usual picture. The light that comes to the place that is looked at is scattered light
//! for the most part: the lamp hangs behind a shade.

use crate::agreement::must_agree_from;
use crate::support::{Build, diffuse, glow, look};
use glam::Vec3;
use halflight::film::Layer;
use halflight::light::Light;
use halflight::measure::Estimate;
use halflight::plan::{Direct, Settings};
use halflight::render::Render;
use halflight::scene::{Illumination, Luminaire, Scene};

/// A room, its floor at y = 0 seen from above, with a lamp that shines at the ceiling. `beyond`: by how much the floor is larger.
fn room(beyond: f32) -> (Build, u32) {
    let mut build =
        Build::new(Illumination::GLOBAL, look(Vec3::new(0.1, 1.9, 0.2), Vec3::new(0.1, 0.0, 0.2)));
    build.yfov(0.7);
    let grey = build.material("Grey", diffuse(0.6));
    let (x, z) = (2.0 * Vec3::X, 2.0 * Vec3::Z);
    let corner = Vec3::new(-1.0, 0.0, -1.0);
    let more = beyond * Vec3::new(1.0, 0.0, 1.0);
    build.quad(corner - more, z + 2.0 * beyond * Vec3::Z, x + 2.0 * beyond * Vec3::X, grey);
    walls(&mut build, corner, Vec3::splat(2.0), grey);
    let lamp = build.material("Lamp", diffuse(0.0));
    build.0.materials[lamp as usize].emission = glow(8.0);
    build.quad(Vec3::new(0.3, 1.5, -0.9), 0.6 * Vec3::Z, 0.6 * Vec3::X, lamp);
    (build, grey)
}

/// The walls and the ceiling of a room, seen from within.
fn walls(build: &mut Build, corner: Vec3, size: Vec3, material: u32) {
    let (x, y, z) = (size.x * Vec3::X, size.y * Vec3::Y, size.z * Vec3::Z);
    build.quad(corner + y, x, z, material);
    build.quad(corner, x, y, material);
    build.quad(corner + z, y, x, material);
    build.quad(corner, y, z, material);
    build.quad(corner + x, z, y, material);
}

/// A box without a bottom where `open`.
fn block(build: &mut Build, least: Vec3, size: Vec3, material: u32, open: bool) {
    let (x, y, z) = (size.x * Vec3::X, size.y * Vec3::Y, size.z * Vec3::Z);
    build.quad(least + y, z, x, material);
    build.quad(least, y, x, material);
    build.quad(least + z, x, y, material);
    build.quad(least, z, y, material);
    build.quad(least + x, y, z, material);
    if !open {
        build.quad(least, x, z, material);
    }
}

#[track_caller]
fn must_be_right(name: &str, build: Build) {
    must_agree_from(4.0, 500, name, &build.finish(), Direct::Connection);
}

#[test]
fn a_block_on_a_floor_and_walls_that_stand_on_it() {
    let (mut build, grey) = room(0.3);
    block(&mut build, Vec3::new(-0.3, 0.0, 0.0), Vec3::new(0.35, 0.35, 0.35), grey, true);
    must_be_right("a block on a floor", build);
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn sheets_and_tiles_close_above_a_floor() {
    let (mut build, grey) = room(0.0);
    build.quad(Vec3::new(-0.3, 0.004, -0.2), 0.4 * Vec3::Z, 0.4 * Vec3::X, grey);
    block(&mut build, Vec3::new(0.25, 0.0, 0.1), Vec3::new(0.3, 0.01, 0.3), grey, false);
    must_be_right("a sheet on a floor", build);
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn a_floor_that_is_there_twice() {
    let (mut build, grey) = room(0.0);
    build.quad(Vec3::new(-0.3, 0.0, -0.2), 0.7 * Vec3::Z, 0.6 * Vec3::X, grey);
    build.quad(Vec3::new(-0.3, 0.0, -0.2), 0.7 * Vec3::Z, 0.6 * Vec3::X, grey);
    must_be_right("a floor that is there twice", build);
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn beads_and_balls_of_few_facets() {
    let (mut build, grey) = room(0.0);
    build.sphere(Vec3::new(-0.15, 0.04, 0.1), 0.04, (24, 12), false, grey);
    build.sphere(Vec3::new(0.3, 0.15, 0.3), 0.15, (7, 4), false, grey);
    build.flatten();
    must_be_right("a bead on a floor", build);
}

#[test]
fn no_light_comes_from_the_next_room() {
    let mut build =
        Build::new(Illumination::GLOBAL, look(Vec3::new(0.5, 1.9, 0.0), Vec3::new(0.5, 0.0, 0.0)));
    build.yfov(1.0);
    let grey = build.material("Grey", diffuse(0.6));
    for left in [-1.0, 0.01] {
        walls(&mut build, Vec3::new(left, 0.0, -1.0), Vec3::new(0.99, 2.0, 2.0), grey);
    }
    // One floor lies under both, and under the wall between them.
    build.quad(Vec3::new(-1.0, 0.0, -1.0), 2.0 * Vec3::Z, 2.0 * Vec3::X, grey);
    let position = Vec3::new(-0.5, 1.0, 0.0);
    build.0.luminaires.push(Luminaire::Point { position, intensity: Light::both(Vec3::ONE) });
    assert_eq!(brightest(build.finish()), 0.0);
}

fn brightest(scene: Scene) -> f32 {
    let settings = Settings { width: 24, height: 24, paths: Some(50_000), ..Settings::default() };
    let mut render = Render::new(scene, settings, &[Layer::Visible]).expect("a render");
    (0..8).for_each(|_| render.pass());
    let picture = Estimate::from_film(render.film()).expect("several passes");
    picture.mean.iter().map(|rgb| rgb.max_element()).fold(0.0, f32::max)
}
