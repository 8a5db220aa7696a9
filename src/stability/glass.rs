//! Glass: indices from one to four, total reflection, glass in glass, eyes in glass.

use super::build::{Build, diffuse, film, finite, glass, look, mean_is};
use super::{Case, Check, Effort};
use crate::light::{Invisible, Light};
use crate::plan::Plan;
use crate::scene::{Illumination, Luminaire, SpotCone};
use crate::shoot::shoot;
use glam::Vec3;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "ior",
        promise: "a slab of index 1, 1.0001, 1.5, 4 transmits what Fresnel says, looking and shooting",
        run: slabs,
    },
    Case {
        name: "glass-in-glass",
        promise: "an index is relative to what surrounds it; nested slabs transmit what Fresnel says",
        run: nested,
    },
    Case {
        name: "water-in-a-glass",
        promise: "water a hair's breadth from its glass transmits what Fresnel says",
        run: water,
    },
    Case {
        name: "coincident-glass",
        promise: "faces that coincide: no power is made, no pixel is lost",
        run: coincident,
    },
    Case { name: "total-reflection", promise: "nothing passes beyond the critical angle", run: total },
    Case {
        name: "camera-inside",
        promise: "an eye in glass sees η² (1 − R) L, an eye in a wall sees its back",
        run: inside,
    },
];

/// Fresnel at normal incidence.
fn r(eta: f64) -> f64 {
    ((eta - 1.0) / (eta + 1.0)).powi(2)
}

/// Transmittance of interfaces one behind the other, all reflections between them included.
fn through(reflectances: &[f64]) -> f64 {
    1.0 / (1.0 + reflectances.iter().map(|r| r / (1.0 - r)).sum::<f64>())
}

/// A slab of glass between two heights.
fn slab(build: &mut Build, low: f32, high: f32, ior: f32) {
    let glass = build.material("Glass", glass(ior));
    build.level(high, 50.0, true, glass);
    build.level(low, 50.0, false, glass);
}

/// A glowing floor seen from above through what `add` puts between 0 and 1.
fn seen(what: &str, add: impl Fn(&mut Build), expected: f64) -> Check {
    let mut build = Build::new(Illumination::GLOBAL, look(2.0 * Vec3::Y, Vec3::ZERO, 1e-3));
    let floor = build.glowing(0.0, 1.0);
    build.level(0.0, 50.0, true, floor);
    add(&mut build);
    mean_is(format!("{what}, seen"), build.finish(), film(64, 64, 1), 16, expected, 1e-4)
}

/// Power of a beam from above that arrives on the floor.
fn shot(what: &str, add: impl Fn(&mut Build)) -> (String, (f64, f64)) {
    let mut build = Build::new(Illumination::GLOBAL, look(2.0 * Vec3::Y, Vec3::ZERO, 1e-3));
    let floor = build.material("Floor", diffuse(1e-6));
    build.level(0.0, 50.0, true, floor);
    add(&mut build);
    let cone = SpotCone { cos_inner: 0.999_999, cos_outer: 0.999_999 };
    let intensity = Light::both(Vec3::splat(1.0 / cone.solid_angle()));
    build.0.luminaires.push(Luminaire::Spot {
        position: 2.0 * Vec3::Y,
        direction: -Vec3::Y,
        intensity,
        cone,
    });
    let plan = Plan::new(build.finish(), film(8, 8, 4000));
    let passes: Vec<f64> = (0..24)
        .map(|pass| {
            plan.photons.as_ref().map_or(0.0, |photons| {
                let shot = shoot::<Invisible>(&plan, photons, pass);
                let arrived = shot.by_class[1].iter().filter(|photon| photon.position.y == 0.0);
                arrived.map(|photon| f64::from(photon.power.0.x)).sum()
            })
        })
        .collect();
    let n = passes.len() as f64;
    let mean = passes.iter().sum::<f64>() / n;
    let variance = passes.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (format!("{what}, shot"), (mean, (variance / n).sqrt()))
}

fn both(what: &str, add: impl Fn(&mut Build), expected: f64) -> [Check; 2] {
    let (what_shot, measured) = shot(what, &add);
    [seen(what, &add, expected), Check::number(what_shot, expected, measured, 1e-4)]
}

fn slabs(_: Effort) -> Vec<Check> {
    let one = |ior: f32| {
        let r = r(f64::from(ior));
        both(&format!("index {ior}"), |build| slab(build, 0.25, 0.75, ior), through(&[r, r]))
    };
    [1.0, 1.0001, 1.5, 4.0].into_iter().flat_map(one).collect()
}

fn nested(_: Effort) -> Vec<Check> {
    let (outer, inner) = (1.5_f32, 4.0 / 3.0_f32);
    let (a, b) = (r(f64::from(outer)), r(f64::from(inner)));
    let add = |build: &mut Build| {
        slab(build, 0.1, 0.9, outer);
        slab(build, 0.4, 0.6, inner);
    };
    both("a slab of 2 in one of 1.5", add, through(&[a, b, b, a])).into()
}

fn water(_: Effort) -> Vec<Check> {
    let (glass, water) = (1.5_f32, 1.33_f32);
    let (a, b) = (r(f64::from(glass)), r(f64::from(water)));
    // Glass, a gap of a micrometre, water, a gap, glass.
    let add = |build: &mut Build| {
        slab(build, 0.1, 0.2, glass);
        slab(build, 0.200_001, 0.699_999, water);
        slab(build, 0.7, 0.8, glass);
    };
    both("glass, water, glass", add, through(&[a, a, b, b, a, a])).into()
}

fn coincident(_: Effort) -> Vec<Check> {
    let add = |build: &mut Build| {
        slab(build, 0.1, 0.5, 1.5);
        slab(build, 0.5, 0.9, 1.5);
    };
    let (what, (mean, error)) = shot("two slabs", add);
    let got =
        if mean > 0.0 && mean - 3.5 * error <= 1.0 { "between 0 and 1".to_owned() } else { mean.to_string() };
    let mut build = Build::new(Illumination::GLOBAL, look(2.0 * Vec3::Y, Vec3::ZERO, 0.1));
    let floor = build.glowing(0.0, 1.0);
    build.level(0.0, 50.0, true, floor);
    add(&mut build);
    vec![
        Check::fact(format!("{what}: power"), "between 0 and 1", got),
        finite("two slabs: picture", true, build.finish(), film(16, 16, 1), 4),
    ]
}

fn total(_: Effort) -> Vec<Check> {
    // An eye inside a slab of index 1.5 that looks down at 45°, beyond the critical 41.8°.
    let camera = look(Vec3::new(0.0, 0.5, 0.0), Vec3::new(1.0, -0.5, 0.0), 1e-3);
    let mut build = Build::new(Illumination::GLOBAL, camera);
    let floor = build.glowing(0.0, 1.0);
    build.level(0.0, 50.0, true, floor);
    slab(&mut build, 0.25, 0.75, 1.5);
    // Lossless: a ray that goes to and fro for ever is ended by roulette.
    vec![finite("from inside at 45°", false, build.finish(), film(16, 16, 1), 4)]
}

fn inside(_: Effort) -> Vec<Check> {
    let mut checks = Vec::new();
    for ior in [1.0001_f32, 1.5, 4.0] {
        let eta = f64::from(ior);
        let mut build = Build::new(Illumination::GLOBAL, look(Vec3::Y, Vec3::ZERO, 1e-3));
        let floor = build.glowing(0.0, 1.0);
        let glass = build.material("Glass", glass(ior));
        build.level(0.0, 50.0, true, floor);
        build.level(0.5, 50.0, false, glass);
        let expected = eta * eta * (1.0 - r(eta));
        checks.push(mean_is(
            format!("in glass of {ior}"),
            build.finish(),
            film(96, 96, 1),
            16,
            expected,
            1e-4,
        ));
    }
    // Between the two faces of a wall of a lit room: their backs are dark.
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(1.05, 0.0, 0.0), Vec3::ZERO, 0.5));
    let wall = build.material("Wall", diffuse(0.5));
    build.room(-Vec3::ONE, Vec3::ONE, wall);
    build.point_light(Vec3::ZERO, 1.0);
    checks.push(finite("in a wall", false, build.finish(), film(8, 8, 1000), 2));
    checks
}
