//! Glass: indices from one to four, total reflection, glass in glass, eyes in glass.

use super::build::{Build, diffuse, film, finite, glass, look, mean_is};
use super::{Case, Check, Effort, Run};
use crate::light::{Invisible, Light};
use crate::measure::mean_and_error;
use crate::optics::{Dielectric, Lobe, Mirror};
use crate::pilot::learn;
use crate::plan::Plan;
use crate::scene::{Illumination, Luminaire, Shape, SpotCone};
use crate::shoot::shoot;
use glam::Vec3;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "ior",
        promise: "a slab of index 1, 1.0001, 1.5, 4 transmits what Fresnel says, looking and shooting",
        run: Run::AtOnce(slabs),
    },
    Case {
        name: "glass-in-glass",
        promise: "glass within glass refracts between the two; equal glass is not seen; the smaller displaces the larger",
        run: Run::AtOnce(nested),
    },
    Case {
        name: "water-in-a-glass",
        promise: "water that touches its glass, reaches into it, or leaves a gap transmits what Fresnel says",
        run: Run::AtOnce(water),
    },
    Case {
        name: "coincident-glass",
        promise: "faces that coincide are one interface between the two solids",
        run: Run::AtOnce(coincident),
    },
    Case {
        name: "total-reflection",
        promise: "nothing passes beyond the critical angle",
        run: Run::AtOnce(total),
    },
    Case {
        name: "coloured-liquid",
        promise: "a liquid has its colour whether it touches its glass, is displaced by it, or displaces it",
        run: Run::AtOnce(coloured),
    },
    Case {
        name: "facets",
        promise: "in a room that glows alike a ball of few facets shaded smooth is not seen, of glass or mirror",
        run: Run::AtOnce(facets),
    },
    Case {
        name: "hall-of-mirrors",
        promise: "a closed room of perfect mirrors is as bright as the lamp in it",
        run: Run::AtOnce(hall),
    },
    Case {
        name: "camera-inside",
        promise: "an eye in glass sees η² (1 − R) L, an eye in a wall sees its back",
        run: Run::AtOnce(inside),
    },
    Case {
        name: "light-inside",
        promise: "a lamp in glass is seen as (1 − R) / η² of itself, and is lit with 1 − R",
        run: Run::AtOnce(lamp_inside),
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
    let cone = SpotCone::of_cosines(0.999_999, 0.999_999);
    let intensity = Light::both(Vec3::splat(1.0 / cone.solid_angle()));
    build.0.luminaires.push(Luminaire::Spot {
        position: 2.0 * Vec3::Y,
        direction: -Vec3::Y,
        intensity,
        cone,
    });
    let plan = Plan::new(build.finish(), film(8, 8, 4000));
    let frame = learn(&plan);
    let arriving = |pass| -> f64 {
        let shot = shoot::<Invisible>(&plan, &frame, pass);
        let arrived = shot.by_class[1].iter().filter(|photon| photon.position.y == 0.0);
        arrived.map(|photon| f64::from(photon.power.0.x)).sum()
    };
    let passes: Vec<f64> = (0..24).map(arriving).collect();
    (format!("{what}, shot"), mean_and_error(&passes))
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

/// R between two indices.
fn between(a: f32, b: f32) -> f64 {
    r(f64::from(b) / f64::from(a))
}

const WATER: f32 = 1.33;
const GLASS: f32 = 1.5;
const DENSE: f32 = 2.0;

fn nested(_: Effort) -> Vec<Check> {
    let (outer, inner) = (between(1.0, GLASS), between(GLASS, DENSE));
    let within = |ior: f32| {
        move |build: &mut Build| {
            slab(build, 0.1, 0.9, GLASS);
            slab(build, 0.4, 0.6, ior);
        }
    };
    // Air in glass: its faces look out as those of other slabs do.
    let hollow = [outer, outer, outer, outer];
    // The lower slab is thinner: it is whole, and the upper ends where it begins.
    let across = |build: &mut Build| {
        slab(build, 0.4, 0.9, GLASS);
        slab(build, 0.1, 0.5, DENSE);
    };
    [
        both("index 2 in 1.5", within(DENSE), through(&[outer, inner, inner, outer])),
        both("index 1.5 in 1.5", within(GLASS), through(&[outer, outer])),
        both("index 1 in 1.5", within(1.0), through(&hollow)),
        both("2 across 1.5", across, through(&[outer, inner, between(1.0, DENSE)])),
    ]
    .concat()
}

fn water(_: Effort) -> Vec<Check> {
    let (wall, wet, free) = (between(1.0, GLASS), between(GLASS, WATER), between(1.0, WATER));
    // Glass, water, glass; by how much the water reaches into the glass.
    let tumbler = |into: f32| {
        move |build: &mut Build| {
            slab(build, 0.1, 0.4, GLASS);
            slab(build, 0.4 - into, 0.6 + into, WATER);
            slab(build, 0.6, 0.9, GLASS);
        }
    };
    [
        both("touching", tumbler(0.0), through(&[wall, wet, wet, wall])),
        both("reaching in", tumbler(0.01), through(&[wall, wet, wet, wall])),
        both("a gap of a micrometre", tumbler(-1e-6), through(&[wall, wall, free, free, wall, wall])),
    ]
    .concat()
}

fn coincident(_: Effort) -> Vec<Check> {
    let stacked = |upper: f32, lower: f32| {
        move |build: &mut Build| {
            slab(build, 0.1, 0.5, lower);
            slab(build, 0.5, 0.9, upper);
        }
    };
    let twice = |build: &mut Build| (0..2).for_each(|_| slab(build, 0.1, 0.9, GLASS));
    let (glass, dense) = (between(1.0, GLASS), between(1.0, DENSE));
    [
        both("1.5 on 1.5", stacked(GLASS, GLASS), through(&[glass, glass])),
        both("1.5 on 2", stacked(GLASS, DENSE), through(&[glass, between(GLASS, DENSE), dense])),
        both("2 on 1.5", stacked(DENSE, GLASS), through(&[glass, between(GLASS, DENSE), dense])),
        both("the same slab twice", twice, through(&[glass, glass])),
    ]
    .concat()
}

fn coloured(_: Effort) -> Vec<Check> {
    let tint = 0.8;
    // Index-matched: the outer faces reflect, and light crosses two faces of the liquid.
    let (r, within) = (between(1.0, GLASS), f64::from(tint).powi(2));
    let expected = (1.0 - r).powi(2) * within / (1.0 - (r * within).powi(2));
    let tumbler = |wall: f32, into: f32| {
        move |build: &mut Build| {
            slab(build, 0.4 - wall, 0.4, GLASS);
            let wine = Lobe::Dielectric(Dielectric { ior: GLASS, tint: Vec3::splat(tint) });
            let wine = build.material("Wine", wine);
            build.level(0.6 + into, 50.0, true, wine);
            build.level(0.4 - into, 50.0, false, wine);
            slab(build, 0.6, 0.6 + wall, GLASS);
        }
    };
    [
        both("touching", tumbler(0.1, 0.0), expected),
        both("reaching into a thin wall", tumbler(0.1, 0.01), expected),
        both("reaching into a thick wall", tumbler(0.35, 0.01), expected),
    ]
    .concat()
}

/// A ball of `around` × `down` facets about zero, shaded as a sphere.
fn ball(build: &mut Build, around: u32, down: u32, material: u32) {
    let place = |i: u32, j: u32| {
        let turn = (i % around) as f32 / around as f32;
        crate::sampling::warp::about_z((std::f32::consts::PI * j as f32 / down as f32).cos(), turn)
    };
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (j, i) in (0..down).flat_map(|j| (0..around).map(move |i| (j, i))) {
        let corners = [place(i, j), place(i, j + 1), place(i + 1, j + 1), place(i + 1, j)];
        let first = positions.len() as u32;
        positions.extend(corners);
        // At the poles a facet is one triangle.
        triangles.extend((j + 1 < down).then_some([first, first + 1, first + 2]));
        triangles.extend((j > 0).then_some([first, first + 2, first + 3]));
    }
    build.0.shape(Shape::new("ball", material, positions.iter().copied(), triangles).with_normals(positions));
}

fn facets(_: Effort) -> Vec<Check> {
    let mirror = Lobe::Mirror(Mirror::plain(Vec3::ONE, false));
    let one = |what: &str, lobe: Lobe, around: u32, down: u32| {
        let camera = look(Vec3::new(0.3, 0.5, 3.0), Vec3::ZERO, 0.7);
        let mut build = Build::new(Illumination::GLOBAL, camera);
        let wall = build.glowing(0.0, 1.0);
        build.room(Vec3::splat(-9.0), Vec3::splat(9.0), wall);
        let lobe = build.material("Ball", lobe);
        ball(&mut build, around, down, lobe);
        mean_is(format!("{what}, {around} × {down}"), build.finish(), film(64, 64, 1), 32, 1.0, 1e-4)
    };
    vec![
        one("glass", glass(GLASS), 6, 4),
        one("glass", glass(GLASS), 10, 6),
        one("glass", glass(GLASS), 24, 12),
        one("diamond", glass(2.4), 10, 6),
        one("mirror", mirror, 10, 6),
    ]
}

fn hall(_: Effort) -> Vec<Check> {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.1, -0.2, 1.5), Vec3::ZERO, 1.0));
    let wall = build.material("Mirror", Lobe::Mirror(Mirror::plain(Vec3::ONE, false)));
    build.room(Vec3::splat(-2.0), Vec3::splat(2.0), wall);
    let lamp = build.glowing(0.0, 1.0);
    let (min, size) = (Vec3::new(-0.1, -0.2, -0.15), Vec3::splat(0.6));
    let first = build.0.shapes.len();
    build.room(min, min + size, lamp);
    let outside = build.0.shapes[first..].iter_mut().flat_map(|shape| &mut shape.triangles);
    outside.for_each(|triangle| triangle.swap(1, 2));
    vec![mean_is("its brightness", build.finish(), film(32, 32, 1), 300, 1.0, 1e-4)]
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
    // In water between plates of glass, all of them above the floor.
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::Y, Vec3::ZERO, 1e-3));
    let floor = build.glowing(0.0, 1.0);
    build.level(0.0, 50.0, true, floor);
    slab(&mut build, 0.25, 1.75, GLASS);
    slab(&mut build, 0.5, 1.5, WATER);
    // What is reflected upwards does not come back: there is nothing above that shines, but the upper faces reflect.
    let (wall, wet) = (between(1.0, GLASS), between(GLASS, WATER));
    let half = 1.0 - through(&[wet, wall]);
    let expected = f64::from(WATER).powi(2) * (1.0 - half) / (1.0 - half * half);
    checks.push(mean_is("in water in glass", build.finish(), film(96, 96, 1), 16, expected, 1e-4));
    // Between the two faces of a wall of a lit room: their backs are dark.
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(1.05, 0.0, 0.0), Vec3::ZERO, 0.5));
    let wall = build.material("Wall", diffuse(0.5));
    build.room(-Vec3::ONE, Vec3::ONE, wall);
    build.point_light(Vec3::ZERO, 1.0);
    checks.push(finite("in a wall", false, build.finish(), film(8, 8, 1000), 2));
    checks
}

fn lamp_inside(_: Effort) -> Vec<Check> {
    // The floor, at zero, lies within.
    let in_glass = |build: &mut Build| slab(build, -1.0, 0.75, GLASS);
    let in_water = |build: &mut Build| {
        slab(build, -1.0, 0.75, GLASS);
        slab(build, -0.5, 0.5, WATER);
    };
    let glass = through(&[between(1.0, GLASS)]);
    let water = through(&[between(1.0, GLASS), between(GLASS, WATER)]);
    let lit = |what: &str, add: &dyn Fn(&mut Build), expected: f64| {
        let (what, measured) = shot(what, add);
        Check::number(what, expected, measured, 1e-4)
    };
    vec![
        seen("in glass", in_glass, glass / f64::from(GLASS).powi(2)),
        seen("in water in glass", in_water, water / f64::from(WATER).powi(2)),
        lit("in glass", &in_glass, glass),
        lit("in water in glass", &in_water, water),
    ]
}
