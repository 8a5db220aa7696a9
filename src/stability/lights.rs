//! Luminaires that are tiny, huge, near, grazing.

use super::build::{Build, diffuse, film, finite, look, mean_is};
use super::{Case, Check, Effort, Run};
use crate::light::Light;
use crate::plan::{Method, Settings};
use crate::scene::{Illumination, Luminaire};
use glam::Vec3;
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "luminaire-size",
        promise: "a luminaire of 1e-4 to 1e4 of the scene's size",
        run: Run::AtOnce(size),
    },
    Case {
        name: "lamp-near-zero",
        promise: "a lamp shines however near its plane the scene's zero lies",
        run: Run::AtOnce(near_zero),
    },
    Case {
        name: "point-light-touching",
        promise: "a point light on a surface lights its neighbourhood, finitely",
        run: Run::AtOnce(touching),
    },
    Case {
        name: "grazing", promise: "parallel light at 89.999° from the normal", run: Run::AtOnce(grazing)
    },
    Case { name: "powers", promise: "powers from 1e-12 to 1e12 alike", run: Run::AtOnce(powers) },
    Case {
        name: "faint-beside-bright",
        promise: "a luminaire 1e-24 as strong as another is not lost",
        run: Run::AtOnce(faint),
    },
];

const ALBEDO: f64 = 0.5;

fn floor(half: f32, camera: Vec3) -> Build {
    let mut build = Build::new(Illumination::ONE_BOUNCE, look(camera, Vec3::ZERO, 1e-4));
    let floor = build.material("Floor", diffuse(ALBEDO as f32));
    build.level(0.0, half, true, floor);
    build
}

fn size(_: Effort) -> Vec<Check> {
    [1e-4_f32, 1e-2, 1.0, 1e2, 1e4]
        .iter()
        .map(|&side| {
            let mut build = floor(1.0, Vec3::new(0.0, 0.1, 0.3));
            let lamp = build.glowing(0.0, 1.0);
            build.level(1.0, 0.5 * side, false, lamp);
            // Form factor of a square from a point below its middle, four times that of a quarter; Howell C-11.
            let x = 0.5 * f64::from(side);
            let root = (1.0 + x * x).sqrt();
            let factor = 4.0 * (2.0 * x / root * (x / root).atan()) / (2.0 * std::f64::consts::PI);
            mean_is(format!("side {side}"), build.finish(), film(32, 32, 1), 64, ALBEDO * factor, 1e-4)
        })
        .collect()
}

fn near_zero(_: Effort) -> Vec<Check> {
    let methods = [film(32, 32, 1), Settings { method: Method::Path, samples: 16, ..film(32, 32, 1) }];
    let at = |up: f32, settings: &Settings| {
        let camera = Vec3::new(0.0, up - 0.9, 0.3);
        let below = Vec3::Y * (up - 1.0);
        let mut build = Build::new(Illumination::ONE_BOUNCE, look(camera, below, 1e-4));
        let floor = build.material("Floor", diffuse(ALBEDO as f32));
        build.level(up - 1.0, 1.0, true, floor);
        let lamp = build.glowing(0.0, 1.0);
        build.level(up, 0.5, false, lamp);
        // As of a lamp of side 1 above.
        let root = 1.25_f64.sqrt();
        let factor = 4.0 / root * (0.5 / root).atan() / (2.0 * std::f64::consts::PI);
        let what = format!("{up} above zero, {}", settings.method.name());
        mean_is(what, build.finish(), settings.clone(), 64, ALBEDO * factor, 1e-4)
    };
    [0.0, 1e-9, 1e-5, 1e-3, 0.02, 0.1, 1e3].iter().flat_map(|up| methods.iter().map(|s| at(*up, s))).collect()
}

fn touching(_: Effort) -> Vec<Check> {
    let mut checks = Vec::new();
    for height in [1e-3_f32, 1e-6, 1e-12, 0.0] {
        let mut build = floor(2.0, Vec3::new(0.0, 1.0, 0.0));
        build.point_light(Vec3::new(0.25, height, 0.0), 1.0);
        let distance = 0.0625 + f64::from(height).powi(2);
        let expected = ALBEDO * FRAC_1_PI * f64::from(height) / distance.powf(1.5);
        checks.push(mean_is(
            format!("{height} above, seen beside"),
            build.finish(),
            film(4, 4, 1),
            4,
            expected,
            1e-3,
        ));
        let mut build = floor(2.0, Vec3::new(0.0, 1.0, 0.0));
        build.0.illumination = Some(Illumination::GLOBAL);
        build.point_light(Vec3::new(0.0, height, 0.0), 1.0);
        checks.push(finite(
            format!("{height} above, seen there"),
            height > 0.0,
            build.finish(),
            film(9, 9, 1000),
            2,
        ));
    }
    checks
}

fn grazing(_: Effort) -> Vec<Check> {
    [80.0_f64, 89.0, 89.9, 89.99, 89.999]
        .iter()
        .map(|&degrees| {
            let angle = degrees.to_radians();
            let direction = Vec3::new(angle.sin() as f32, -(angle.cos() as f32), 0.0);
            let mut build = floor(2.0, Vec3::new(0.0, 1.0, 0.0));
            let irradiance = Light::both(Vec3::ONE);
            build.0.luminaires.push(Luminaire::Directional { direction, irradiance });
            let expected = ALBEDO * FRAC_1_PI * (FRAC_PI_2 - angle).sin();
            mean_is(format!("{degrees}°"), build.finish(), film(4, 4, 1), 4, expected, 1e-4)
        })
        .collect()
}

/// A closed room that glows.
fn furnace(build: &mut Build, centre: Vec3, radiance: f32) {
    let wall = build.glowing(ALBEDO as f32, radiance);
    build.room(centre - 1.0, centre + 1.0, wall);
}

fn powers(_: Effort) -> Vec<Check> {
    [1e-12_f32, 1e-6, 1.0, 1e6, 1e12]
        .iter()
        .map(|&power| {
            let mut build = Build::new(Illumination::GLOBAL, look(Vec3::ZERO, Vec3::X, 0.6));
            furnace(&mut build, Vec3::ZERO, power);
            let expected = f64::from(power) / (1.0 - ALBEDO);
            let settings = Settings { indirect_radius: 16.0, ..film(16, 16, 10_000) };
            mean_is(format!("radiance {power:e}"), build.finish(), settings, 32, expected, 1e-3)
        })
        .collect()
}

fn faint(_: Effort) -> Vec<Check> {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::ZERO, Vec3::X, 0.6));
    furnace(&mut build, Vec3::ZERO, 1e-12);
    furnace(&mut build, 4.0 * Vec3::X, 1e12);
    let settings = Settings { indirect_radius: 128.0, ..film(128, 128, 160_000) };
    let expected = 1e-12_f32;
    vec![mean_is("the faint room", build.finish(), settings, 64, f64::from(expected) / (1.0 - ALBEDO), 1e-3)]
}
