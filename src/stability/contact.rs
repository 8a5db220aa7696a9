//! Where things touch, lie close together or are small: a gather disk of several pixels must see as much light as there is.
//!
//! All is in a room that glows everywhere, so that radiance is the same everywhere that light reaches: emission / (1 − albedo).

use super::build::{Build, film, look, mean_is};
use super::{Case, Check, Effort, Run};
use crate::scene::Illumination;
use glam::Vec3;

pub(super) const CASES: &[Case] = &[Case {
    name: "contact",
    promise: "in a room that glows alike nothing is darker or brighter for what stands, lies or hangs close by",
    run: Run::AtOnce(contact),
}];

const ALBEDO: f32 = 0.8;
/// The floor's height.
const FLOOR: f32 = -1.0;

/// A room of 2 m of which the camera sees 80 cm of the floor, 5 cm to a pixel; first radii are 4 pixels.
fn seen(what: &str, passes: u32, make: impl Fn(&mut Build, u32)) -> Check {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::ZERO, FLOOR * Vec3::Y, 2.0 * 0.4_f32.atan()));
    let matter = build.glowing(ALBEDO, 1.0);
    build.room(-Vec3::ONE, Vec3::ONE, matter);
    make(&mut build, matter);
    let expected = 1.0 / (1.0 - f64::from(ALBEDO));
    let settings = crate::plan::Settings { indirect_radius: 4.0, ..film(16, 16, 30_000) };
    mean_is(what, build.finish(), settings, passes, expected, 1e-3)
}

/// A horizontal rectangle, seen from above.
fn sheet(build: &mut Build, [least, most]: [Vec3; 2], matter: u32) {
    build.quad(least, (most - least) * Vec3::Z, (most - least) * Vec3::X, matter);
}

/// A box without a bottom. What is one-sided takes the light within.
fn block(build: &mut Build, [least, most]: [Vec3; 2], matter: u32) {
    let d = most - least;
    let (x, y, z) = (d * Vec3::X, d * Vec3::Y, d * Vec3::Z);
    build.quad(most, -z, -x, matter);
    build.quad(least, y, x, matter);
    build.quad(least, z, y, matter);
    build.quad(most, -x, -y, matter);
    build.quad(most, -y, -z, matter);
}

fn contact(effort: Effort) -> Vec<Check> {
    let passes = if effort == Effort::Full { 40 } else { 20 };
    let above = |height: f32| [Vec3::new(-0.35, FLOOR + height, -0.3), Vec3::new(0.0, FLOOR + height, 0.3)];
    vec![
        seen("a block on the floor", passes, |build, matter| {
            block(build, [Vec3::new(-0.7, FLOOR, -0.3), Vec3::new(0.0, FLOOR + 0.4, 0.25)], matter);
        }),
        seen("two faces 4 mm above it", passes, |build, matter| {
            let [least, most] = above(0.004);
            sheet(build, [least, most], matter);
            let d = most - least;
            build.quad(least, d * Vec3::X, d * Vec3::Z, matter);
        }),
        seen("a tile of 8 mm", passes, |build, matter| {
            let [least, most] = above(0.008);
            block(build, [Vec3::new(least.x, FLOOR, least.z), most], matter);
        }),
        seen("beads of a pixel or two", passes, |build, matter| {
            for (i, j) in (-2..=2).flat_map(|i| (-2..=2).map(move |j| (i, j))) {
                let place = Vec3::new(0.14 * i as f32, FLOOR + 0.3, 0.13 * j as f32);
                build.ball(place, 0.02 + 0.004 * (i + j) as f32 * 0.5, 12, 6, matter);
            }
        }),
    ]
}
