//! One photon, none, a million in one place; films of one pixel and of one line; a million luminaires.

use super::build::{Build, diffuse, film, finite, look, mean_is};
use super::{Case, Check, Effort, Rows, Run};
use crate::light::Invisible;
use crate::photon::Photon;
use crate::photon_map::PhotonMap;
use crate::plan::{Direct, Settings};
use crate::scene::{Illumination, Projection, Scene};
use glam::Vec3;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "one-photon",
        promise: "one photon a pass is noisy and right on average",
        run: Run::AtOnce(one_photon),
    },
    Case {
        name: "no-photons",
        promise: "no light, or none that is seen: black",
        run: Run::AtOnce(no_photons),
    },
    Case {
        name: "photons-in-one-point",
        promise: "a million photons in one point lose no power in the sum",
        run: Run::AtOnce(one_point),
    },
    Case {
        name: "photons-on-one-plane",
        promise: "a million photons on one axis-aligned plane are found",
        run: Run::AtOnce(one_plane),
    },
    Case { name: "film-shapes", promise: "films of 1×1 and 8192×4 pixels", run: Run::ByRow(film_shapes) },
    Case {
        name: "million-luminaires",
        promise: "a lamp of a million triangles is one lamp",
        run: Run::ByRow(million_luminaires),
    },
];

fn furnace(albedo: f32) -> Scene {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::ZERO, Vec3::X, 0.6));
    let wall = build.glowing(albedo, 1.0);
    build.room(-Vec3::ONE, Vec3::ONE, wall);
    build.finish()
}

fn one_photon(_: Effort) -> Vec<Check> {
    // One photon shows only in pixels within its radius: a wide one.
    let settings = Settings { indirect_radius: 8.0, ..film(8, 8, 1) };
    vec![mean_is("a path a pass", furnace(0.3), settings, 80_000, 1.0 / (1.0 - f64::from(0.3_f32)), 1e-3)]
}

fn no_photons(_: Effort) -> Vec<Check> {
    let floor = || {
        let mut build = Build::new(Illumination::GLOBAL, look(Vec3::Y, Vec3::ZERO, 0.5));
        let floor = build.material("Floor", diffuse(0.5));
        build.level(0.0, 1.0, true, floor);
        build
    };
    let dark = floor();
    let mut away = floor();
    away.point_light(-Vec3::Y, 1.0);
    let empty = Build::new(Illumination::GLOBAL, look(Vec3::Y, Vec3::ZERO, 0.5));
    let mut lamp_alone = Build::new(Illumination::GLOBAL, look(Vec3::Y, Vec3::ZERO, 0.5));
    lamp_alone.point_light(Vec3::Y, 1.0);
    [
        ("no luminaire", dark),
        ("light from below", away),
        ("nothing at all", empty),
        ("a light alone", lamp_alone),
    ]
    .into_iter()
    .map(|(what, build)| finite(what, false, build.finish(), film(8, 8, 1000), 2))
    .collect()
}

const MILLION: u32 = 1_000_000;

fn one_point(_: Effort) -> Vec<Check> {
    let power = 0.1_f32;
    let photon = Photon::new(Vec3::splat(0.3), Vec3::Y, Invisible(Vec3::splat(power)), 0);
    let map = PhotonMap::build(vec![photon; MILLION as usize]);
    let flux = map.flux(Vec3::splat(0.3), Vec3::Y, 0.01, u16::MAX);
    let expected = f64::from(power) * f64::from(MILLION);
    vec![Check::number("power", expected, (f64::from(flux.whole.0.x), 0.0), 1e-4)]
}

fn one_plane(_: Effort) -> Vec<Check> {
    [Vec3::X, Vec3::Y, Vec3::Z]
        .into_iter()
        .map(|normal| {
            // A lattice, so that the count in a disk is known but for its rim.
            let side = 1000;
            let (a, b) = (Vec3::new(normal.y, normal.z, normal.x), Vec3::new(normal.z, normal.x, normal.y));
            let place = |i: u32| (i % side) as f32 * 1e-3 * a + (i / side) as f32 * 1e-3 * b;
            let photons =
                (0..MILLION).map(|i| Photon::new(place(i), normal, Invisible(Vec3::ONE), 0)).collect();
            let map = PhotonMap::build(photons);
            let radius = 0.2_f32;
            let flux = map.flux(0.5 * (a + b), normal, radius, u16::MAX);
            let expected = std::f64::consts::PI * f64::from(radius).powi(2) * f64::from(MILLION);
            // Gauss's circle problem: the rim is worth about r^(2/3) points of π r² with r = 200.
            Check::number(format!("normal {normal}"), expected, (f64::from(flux.whole.0.x), 0.0), 1e-3)
        })
        .collect()
}

fn film_shapes(_: Effort) -> Rows {
    // Width, height, full vertical view; radius in pixels: some tenths of the wall; paths, passes.
    let shapes = [
        (1, 1, 1.0, 0.45, 300, 16_000),
        (8192, 4, 5e-4, 1600.0, 16_000, 32),
        (4, 2048, 1.0, 800.0, 5000, 32),
    ];
    Box::new(shapes.into_iter().map(|(width, height, yfov, indirect_radius, paths, passes)| {
        let mut scene = furnace(0.5);
        scene.camera.projection = Projection::Perspective { yfov };
        let settings = Settings { indirect_radius, ..film(width, height, paths) };
        mean_is(format!("{width}×{height}"), scene, settings, passes, 2.0, 1e-3)
    }))
}

fn million_luminaires(effort: Effort) -> Rows {
    let cells = if effort == Effort::Full { 708 } else { 200 };
    // Connections need many pixels, photons many paths; the radius is 6 cm in both.
    let ways = [(Direct::Connection, film(16, 16, 1), 300.0), (Direct::Photons, film(4, 4, 1_000_000), 75.0)];
    let row = move |(direct, settings, indirect_radius): (Direct, Settings, f32)| {
        let mut build =
            Build::new(Illumination::ONE_BOUNCE, look(Vec3::new(0.0, 0.1, 0.3), Vec3::ZERO, 1e-2));
        let floor = build.material("Floor", diffuse(0.5));
        let lamp = build.glowing(0.0, 1.0);
        build.level(0.0, 0.15, true, floor); // what lands elsewhere need not be stored
        build.grid(Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z, [cells, cells], lamp);
        let x = 0.5_f64;
        let root = (1.0 + x * x).sqrt();
        let expected = 0.5 * 4.0 * (2.0 * x / root * (x / root).atan()) / (2.0 * std::f64::consts::PI);
        let settings = Settings { direct, indirect_radius, ..settings };
        let scene = build.finish();
        let what = format!("{} luminaires, {direct:?}", scene.luminaires.len());
        mean_is(what, scene, settings, 32, expected, 0.002)
    };
    Box::new(ways.into_iter().map(row))
}
