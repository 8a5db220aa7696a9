//! Matter that re-radiates: rooms that glow against Neumann's series of their 3×3 matrix, and the matrix of paper eq. 17.

use super::build::{Build, diffuse, film, look, rendered};
use super::{Case, Check, Effort, Run};
use crate::existence::Existence;
use crate::light::Light;
use crate::plan::{Method, Plan, Settings};
use crate::render::Render;
use crate::scene::{Emission, Fluorescence, Illumination, Luminaire, Material, Scene};
use glam::{DMat3, DVec3, Mat3, Vec3};
use std::f64::consts::FRAC_1_PI;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "fluorescent-furnace",
        promise: "a closed room whose walls re-radiate glows at (I − ρ − M)⁻¹ E, one colour out of the other",
        run: Run::AtOnce(furnace),
    },
    Case {
        name: "fluorescent-k",
        promise: "k is the largest eigenvalue over all three colours, and matter that gains too much is refused",
        run: Run::AtOnce(k),
    },
    Case {
        name: "matrix-of-eq-17",
        promise: "all 36 entries of a 6×6 reflectance do what they say",
        run: Run::AtOnce(full),
    },
];

const NAMES: [&str; 3] = ["red", "green", "blue"];

/// A closed cube that glows everywhere, of base colour `base`.
fn room(base: Vec3, fluorescence: Fluorescence, emits: Vec3) -> Scene {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::ZERO, Vec3::X, 0.6));
    let wall =
        Material::diffuse("Wall", base).with_fluorescence(fluorescence).with_emission(Emission::front(emits));
    let wall = build.0.material(wall);
    build.room(-Vec3::ONE, Vec3::ONE, wall);
    build.finish()
}

fn by_rows(matrix: [[f32; 3]; 3]) -> DMat3 {
    Mat3::from_cols_array_2d(&matrix).transpose().as_dmat3()
}

/// Radiance by a sum of the series of reflections.
fn neumann(base: Vec3, matrix: [[f32; 3]; 3], emits: Vec3) -> DVec3 {
    let once = DMat3::from_diagonal(base.as_dvec3()) + by_rows(matrix);
    (DMat3::IDENTITY - once).inverse() * emits.as_dvec3()
}

/// Each colour of a film's mean against its closed form.
fn colours(what: &str, render: Result<Render, String>, expected: DVec3, rounding: f64) -> Vec<Check> {
    match render {
        Err(why) => vec![Check::fact(what, "an image", why)],
        Ok(render) => {
            let film = render.film();
            let (mean, error) = (film.mean_colour(), film.mean_colour_error().unwrap_or_default());
            let row = |c: usize| {
                Check::number(format!("{what}, {}", NAMES[c]), expected[c], (mean[c], error[c]), rounding)
            };
            (0..3).map(row).collect()
        }
    }
}

fn furnace(effort: Effort) -> Vec<Check> {
    let one_way = [[0.0, 0.0, 0.125], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]];
    let in_a_circle = [[0.0, 0.0, 0.25], [0.25, 0.0, 0.0], [0.0, 0.25, 0.0]];
    let stiff = [[0.0, 0.0, 0.4], [0.4, 0.0, 0.0], [0.0, 0.4, 0.0]];
    let blue = Vec3::new(0.0, 0.0, 1.0);
    let rooms = [
        ("one way", 0.25, one_way, blue, 40_000, 128),
        ("in a circle", 0.5, in_a_circle, Vec3::new(0.0, 0.5, 1.0), 20_000, 160),
        ("in a circle, k = 0.99", 0.59, stiff, blue, 2000, 48),
    ];
    let photons = rooms.into_iter().flat_map(|(what, base, matrix, emits, paths, passes)| {
        let base = Vec3::splat(base);
        let settings = Settings { indirect_radius: 8.0, ..film(8, 8, paths) };
        let render = rendered(room(base, Fluorescence::colours(matrix), emits), settings, passes);
        colours(what, render, neumann(base, matrix, emits), 1e-3)
    });
    // A metre of wall is as white whatever its yield: nothing is lost at 1, next to nothing gained at 1e-12.
    let faint = |yields: f32| {
        let dye = Fluorescence::dye([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], yields);
        let matrix = [[0.0; 3], [0.0, 0.0, yields], [0.0; 3]];
        let render = rendered(
            room(Vec3::ZERO, dye, blue),
            Settings { indirect_radius: 8.0, ..film(32, 32, 5_000) },
            96,
        );
        let expected = neumann(Vec3::ZERO, matrix, blue);
        colours(&format!("yield {yields:e}"), render, expected, 1e-3).split_off(1)
    };
    let paths = |method: Method| {
        let samples = if effort == Effort::Full { 1024 } else { 256 };
        let settings = Settings { method, samples, ..film(2, 2, 1) };
        let scene = room(Vec3::splat(0.25), Fluorescence::colours(one_way), blue);
        let expected = neumann(Vec3::splat(0.25), one_way, blue);
        colours(&format!("one way, {}", method.name()), rendered(scene, settings, 64), expected, 1e-3)
    };
    let yields = [1.0, 1e-12].into_iter().flat_map(faint);
    photons.chain(yields).chain([Method::Path, Method::PathPlain].into_iter().flat_map(paths)).collect()
}

fn k(_: Effort) -> Vec<Check> {
    // Eigenvalues of a circulant matrix: ρ + a is that of white light.
    let circle = |a: f32| Fluorescence::colours([[0.0, 0.0, a], [a, 0.0, 0.0], [0.0, a, 0.0]]);
    let mut checks = Vec::new();
    for (base, a) in [(0.25_f32, 0.25_f32), (0.5, 0.375), (0.0, 0.9375)] {
        let scene = room(Vec3::splat(base), circle(a), Vec3::Z);
        let settings = Settings { keep_everything: true, ..film(8, 8, 1) };
        let (what, expected) = (format!("ρ {base}, circle {a}"), f64::from(base + a));
        checks.push(match Plan::new(scene, settings).existence {
            Existence::Measured(m) => Check::number(what, expected, (m.k, m.error), 1e-5),
            Existence::Certain { reason, .. } => Check::fact(what, "measured", reason),
        });
    }
    // One way there is nothing to couple: a share that grows with the number of reflections is no growth of each.
    let one_way = Fluorescence::colours([[0.0; 3], [0.0, 0.0, 0.5], [0.0; 3]]);
    let settings = Settings { keep_everything: true, ..film(8, 8, 1) };
    checks.push(match Plan::new(room(Vec3::splat(0.5), one_way, Vec3::Z), settings).existence {
        Existence::Measured(m) => Check::number("ρ 0.5, one way", 0.5, (m.k, m.error), 1e-5),
        Existence::Certain { reason, .. } => Check::fact("ρ 0.5, one way", "measured", reason),
    });
    let verdict = |fluorescence: Fluorescence| match rendered(
        room(Vec3::splat(0.5), fluorescence.with_gain(), Vec3::Z),
        film(8, 8, 100),
        1,
    ) {
        Ok(_) => "rendered".into(),
        Err(why) => why.split(':').next().unwrap_or_default().to_owned(),
    };
    // Four watts of green for each of blue: more than comes in, but only once.
    let once = Fluorescence::colours([[0.0; 3], [0.0, 0.0, 4.0], [0.0; 3]]);
    checks.push(Check::fact("gain on the way from blue to green", "rendered", verdict(once)));
    checks.push(Check::fact("gain in a circle", "no image exists", verdict(circle(0.625))));
    checks
}

/// A floor that a point light lights, seen from above.
fn full(_: Effort) -> Vec<Check> {
    let matrix: [[f32; 6]; 6] =
        std::array::from_fn(|i| std::array::from_fn(|j| 0.01 * (1 + (5 * i + 7 * j) % 11) as f32));
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 1.0, 0.0), Vec3::ZERO, 1e-3));
    let floor = build.material("Floor", diffuse(0.5));
    build.0.materials[floor as usize].fluorescence = Some(Fluorescence::full(matrix));
    build.level(0.0, 1.0, true, floor);
    let intensity = Light::new(Vec3::new(1.0, 2.0, 3.0), Vec3::new(5.0, 7.0, 11.0));
    build.0.luminaire(Luminaire::Point { position: 2.0 * Vec3::Y, intensity });
    let scene = build.finish();
    let came = |j: usize| f64::from([intensity.invisible, intensity.visible][j % 2][j / 2]);
    let visible = |c: usize| (0..6).map(|j| f64::from(matrix[2 * c + 1][j]) * came(j)).sum::<f64>();
    let expected = DVec3::from_array([0, 1, 2].map(visible)) * (FRAC_1_PI / 4.0);
    let shot = rendered(scene.clone(), film(8, 8, 1000), 4);
    let settings = Settings { method: Method::Path, samples: 4, ..film(8, 8, 1) };
    let gathered = rendered(scene, settings, 4);
    [colours("photon", shot, expected, 1e-4), colours("path", gathered, expected, 1e-4)].concat()
}
