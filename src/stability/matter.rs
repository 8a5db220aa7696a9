//! Matter that reflects nothing, nearly nothing, or everything; matrices with entries that are zero, tiny or above one.

use super::build::{Build, diffuse, film, finite, look, mean_is};
use super::{Case, Check, Effort, Run};
use crate::light::{Light, Matrix};
use crate::plan::Settings;
use crate::scene::{Illumination, Matter};
use glam::Vec3;
use std::f64::consts::FRAC_1_PI;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "tiny-reflections",
        promise: "a reflectance of 1e-12 adds 1e-12, and is not lost",
        run: Run::AtOnce(tiny),
    },
    Case {
        name: "black-and-white",
        promise: "black stays black; pure white in an open scene has its image, in a closed one none",
        run: Run::AtOnce(black_and_white),
    },
    Case {
        name: "matrix-entries",
        promise: "entries 0, 1e-12 and 1e3 multiply as matrices do",
        run: Run::AtOnce(entries),
    },
];

fn tiny(_: Effort) -> Vec<Check> {
    // A floor that reflects 1e-12 is lit by a point light and seen: nothing but the reflection is seen.
    let mut checks = Vec::new();
    for albedo in [1e-6_f32, 1e-12, 1e-20] {
        let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 1.0, 0.0), Vec3::ZERO, 1e-3));
        let floor = build.material("Floor", diffuse(albedo));
        build.level(0.0, 1.0, true, floor);
        build.point_light(2.0 * Vec3::Y, 1.0);
        let expected = f64::from(albedo) * FRAC_1_PI / 4.0;
        checks.push(mean_is(
            format!("seen, albedo {albedo:e}"),
            build.finish(),
            film(8, 8, 1000),
            4,
            expected,
            1e-4,
        ));
    }
    // A million photons, of which each is reflected with a probability of 1e-3 by one wall of a black room.
    let albedo = 1e-3_f32;
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.2, 0.1, 0.3), Vec3::X, 1.0));
    let wall = build.glowing(albedo, 1.0);
    build.room(-Vec3::ONE, Vec3::ONE, wall);
    let settings = Settings { indirect_radius: 3.0, ..film(8, 8, 100_000) };
    let expected = 1.0 / (1.0 - f64::from(albedo));
    checks.push(mean_is("furnace, albedo 1e-3", build.finish(), settings, 10, expected, 1e-5));
    checks
}

fn black_and_white(_: Effort) -> Vec<Check> {
    let floor = |albedo: f32| {
        let mut build = Build::new(Illumination::GLOBAL, look(Vec3::Y, Vec3::ZERO, 1e-3));
        let floor = build.material("Floor", diffuse(albedo));
        build.level(0.0, 1.0, true, floor);
        build.point_light(2.0 * Vec3::Y, 1.0);
        build.finish()
    };
    let mut closed = Build::new(Illumination::GLOBAL, look(Vec3::ZERO, Vec3::X, 1.0));
    let wall = closed.glowing(1.0, 1.0);
    closed.room(-Vec3::ONE, Vec3::ONE, wall);
    let refused = match super::build::rendered(closed.finish(), film(8, 8, 1), 0) {
        Ok(_) => "an image".to_owned(),
        Err(why) => why.split(':').next().unwrap_or_default().to_owned(),
    };
    vec![
        finite("black", false, floor(0.0), film(8, 8, 1000), 2),
        mean_is("white, open", floor(1.0), film(8, 8, 1000), 4, FRAC_1_PI / 4.0, 1e-4),
        Check::fact("white, closed", "no image exists", refused),
    ]
}

/// A sheet above a floor, lit by a light above both, seen from between.
fn entries(_: Effort) -> Vec<Check> {
    let floor_matrix = Matrix::new([[0.0, 0.0], [1.0, 0.5]]);
    let sheets = [
        ("zeros", Matrix::new([[0.0, 0.0], [0.0, 1.0]])),
        ("tiny", Matrix::new([[1e-12, 0.0], [0.0, 1e-12]])),
        ("large", Matrix::new([[1e3, 2e3], [0.0, 1e3]])),
        ("tiny and large", Matrix::new([[1e-12, 1e3], [1e3, 1e-12]])),
    ];
    sheets
        .into_iter()
        .map(|(what, straight)| {
            let mut build = Build::new(Illumination::ONE_BOUNCE, look(0.5 * Vec3::Y, Vec3::ZERO, 1e-3));
            let floor = build.material("Floor", diffuse(0.5));
            build.0.materials[floor as usize].illumination =
                Some(Illumination::Own(Matter { opaque: floor_matrix, straight: Matrix::ZERO }));
            let sheet = build.material("Sheet", diffuse(0.5));
            build.0.materials[sheet as usize].illumination =
                Some(Illumination::Own(Matter { opaque: Matrix::ZERO, straight }));
            build.level(0.0, 1.0, true, floor);
            build.level(1.0, 1.0, true, sheet);
            build.point_light(2.0 * Vec3::Y, 1.0);
            let light = floor_matrix * (straight * Light::both(Vec3::ONE));
            let expected = f64::from(light.visible.x) * 0.5 * FRAC_1_PI / 4.0;
            mean_is(what, build.finish(), film(8, 8, 1000), 4, expected, 1e-4)
        })
        .collect()
}
