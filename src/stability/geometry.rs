//! Triangles that coincide, that are slivers, or that are hit exactly where they meet.

use super::build::{Build, diffuse, film, look, mean_is};
use super::{Case, Check, Effort, Run};
use crate::rays::{Ray, Rays};
use crate::scene::{Illumination, Scene};
use glam::Vec3;
use std::f64::consts::FRAC_1_PI;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "coincident-opposite",
        promise: "a sheet of two opposite faces is lit on the side it is lit from, whichever comes first",
        run: Run::AtOnce(coincident),
    },
    Case {
        name: "slivers",
        promise: "triangles a million times as long as wide are as good as others",
        run: Run::AtOnce(slivers),
    },
    Case {
        name: "edges-and-corners",
        promise: "a line through an edge or a corner crosses one triangle",
        run: Run::AtOnce(edges),
    },
    Case {
        name: "axis-parallel",
        promise: "lines along the axes, in the planes of walls too, enter and leave a box",
        run: Run::AtOnce(axes),
    },
];

const ALBEDO: f64 = 0.5;

/// A floor seen from straight above and lit from there; `make` builds it.
fn lit(what: impl Into<String>, make: impl Fn(&mut Build, u32), illumination: Illumination) -> Check {
    let mut build =
        Build::new(illumination, look(Vec3::new(0.013, 1.0, 0.017), Vec3::new(0.013, 0.0, 0.017), 1e-3));
    let floor = build.material("Floor", diffuse(ALBEDO as f32));
    make(&mut build, floor);
    build.point_light(Vec3::new(0.013, 2.0, 0.017), 1.0);
    mean_is(what, build.finish(), film(16, 16, 1000), 4, ALBEDO * FRAC_1_PI / 4.0, 1e-4)
}

fn coincident(_: Effort) -> Vec<Check> {
    let mut checks = Vec::new();
    for up_first in [true, false] {
        for illumination in
            [Illumination::ONE_BOUNCE, Illumination::GLOBAL, Illumination::LOCAL, Illumination::SHADOWLESS]
        {
            let order = if up_first { "front first" } else { "back first" };
            let what = format!("{}, {order}", illumination.describe());
            checks.push(lit(
                what,
                |build, floor| {
                    [up_first, !up_first].into_iter().for_each(|up| build.level(0.0, 1.0, up, floor));
                },
                illumination,
            ));
        }
    }
    checks
}

fn slivers(_: Effort) -> Vec<Check> {
    let strips = |build: &mut Build, floor: u32| {
        // 2 m long, 2 µm wide, below the camera and the light; a coarse floor around them.
        build.grid(Vec3::new(0.0125, 0.0, -1.0), 2.0 * Vec3::Z, 1e-3 * Vec3::X, [1, 500], floor);
        build.quad(Vec3::new(-1.0, 0.0, -1.0), 2.0 * Vec3::Z, 1.0125 * Vec3::X, floor);
        build.quad(Vec3::new(0.0135, 0.0, -1.0), 2.0 * Vec3::Z, 0.9865 * Vec3::X, floor);
    };
    let mut checks = vec![lit("lit from above", strips, Illumination::ONE_BOUNCE)];
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::Y, Vec3::ZERO, 0.1));
    let floor = build.material("Floor", diffuse(0.5));
    strips(&mut build, floor);
    let crossings =
        |x: f32| Ray { origin: Vec3::new(x, 1.0, 0.1), direction: -Vec3::Y, t_max: f32::INFINITY };
    let rays = (1..10_000).map(|i| crossings(0.0125 + 1e-7 * i as f32));
    checks.push(crossed("lines across them", &build.finish(), rays, 1));
    checks
}

/// Whether each line crosses so many triangles, whatever goes straight through.
fn crossed(what: &str, scene: &Scene, lines: impl Iterator<Item = Ray>, expected: usize) -> Check {
    let mut scene = scene.clone();
    let all = Illumination::SHADOWLESS;
    if let Err(why) = scene.illuminate(Some(all), &[("*".into(), all)]) {
        return Check::fact(what, "a scene", why.to_string());
    }
    let rays = Rays::build(&scene);
    let mut hits = Vec::new();
    let (mut wrong, mut count) = (0, 0);
    for line in lines {
        rays.crossings(&line, &mut hits);
        count += 1;
        wrong += usize::from(hits.len() != expected);
    }
    let all = format!("{count} of {count} cross {expected}");
    let got = format!("{} of {count} cross {expected}", count - wrong);
    Check::fact(what, all, got)
}

fn edges(_: Effort) -> Vec<Check> {
    let mut build = Build::new(Illumination::SHADOWLESS, look(Vec3::Y, Vec3::ZERO, 0.1));
    let floor = build.material("Floor", diffuse(0.5));
    build.grid(Vec3::new(-1.0, 0.0, -1.0), 2.0 * Vec3::Z, 2.0 * Vec3::X, [32, 32], floor);
    let scene = build.finish();
    let inner = |steps: i32| (1..steps).map(move |i| 2.0 * i as f32 / steps as f32 - 1.0);
    let down =
        |x: f32, z: f32| Ray { origin: Vec3::new(x, 1.0, z), direction: -Vec3::Y, t_max: f32::INFINITY };
    let corners = inner(32).flat_map(|x| inner(32).map(move |z| down(x, z)));
    let along = inner(32).flat_map(|x| inner(1000).map(move |z| down(x, z)));
    let across = inner(777).flat_map(|x| inner(32).map(move |z| down(x, z)));
    let slanted = inner(32).flat_map(|x| {
        inner(32).map(move |z| {
            let origin = Vec3::new(0.3, 1.7, -0.4);
            Ray { origin, direction: (Vec3::new(x, 0.0, z) - origin).normalize(), t_max: f32::INFINITY }
        })
    });
    vec![
        crossed("straight at corners", &scene, corners, 1),
        crossed("straight at edges", &scene, along, 1),
        crossed("straight at the other edges", &scene, across, 1),
        crossed("aslant at corners", &scene, slanted, 1),
    ]
}

fn axes(_: Effort) -> Vec<Check> {
    let mut build = Build::new(Illumination::SHADOWLESS, look(Vec3::Y, Vec3::ZERO, 0.1));
    let wall = build.material("Wall", diffuse(0.5));
    build.room(-Vec3::ONE, Vec3::ONE, wall);
    let scene = build.finish();
    let places = || (-3..=3).flat_map(|i| (-3..=3).map(move |j| (i as f32 / 4.0, j as f32 / 4.0)));
    [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z]
        .into_iter()
        .map(|direction| {
            let (a, b) = (
                Vec3::new(direction.y, direction.z, direction.x),
                Vec3::new(direction.z, direction.x, direction.y),
            );
            let lines = places().map(move |(u, v)| Ray {
                origin: u * a + v * b - 3.0 * direction,
                direction,
                t_max: f32::INFINITY,
            });
            crossed(&format!("along {direction}"), &scene, lines, 2)
        })
        .collect()
}
