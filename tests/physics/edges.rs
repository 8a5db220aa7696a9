//! Pixels that edges cross are given several camera paths a pass: their mean is right, and so is the error that is told.

use crate::moved::somewhere;
use crate::support::{Build, Measured, diffuse, glow};
use glam::Vec3;
use halflight::film::{Film, Layer};
use halflight::plan::{Method, Settings};
use halflight::render::Render;
use halflight::scene::{Camera, Illumination, Projection, Scene};

/// Pixels along a side; a pixel is a metre wide.
const SIDE: u32 = 16;
const PASSES: u32 = 48;
const RADIANCE: f64 = 2.0;
/// Where the lamp begins and ends, m from the upper left corner of the film.
const LAMP: [[f64; 2]; 2] = [[3.3, 11.45], [5.85, 12.2]];

/// A lamp that faces the camera, in front of nothing.
fn lamp() -> Scene {
    let from = Vec3::new(0.0, 0.0, 5.0);
    let half = SIDE as f32 / 2.0;
    let projection = Projection::Orthographic { half_height: half };
    let mut build = Build::new(Illumination::LOCAL, Camera::look_at(from, Vec3::ZERO, Vec3::Y, projection));
    let shining = build.material("Lamp", diffuse(0.0));
    build.0.materials[shining as usize].emission = glow(RADIANCE as f32);
    let [[left, right], [top, bottom]] = LAMP.map(|ends| ends.map(|end| end as f32));
    let (across, up) = ((right - left) * Vec3::X, (bottom - top) * Vec3::Y);
    build.quad(Vec3::new(left - half, half - bottom, 0.0), across, up, shining);
    build.finish()
}

fn film(scene: &Scene, settings: Settings, passes: u32) -> Film {
    let mut render = Render::new(scene.clone(), settings, &[Layer::Visible]).expect("a render");
    (0..passes).for_each(|_| render.pass());
    render.film().clone()
}

/// The share of a row or column of pixels that the lamp covers.
fn covered([first, last]: [f64; 2], i: u32) -> f64 {
    (last.min(f64::from(i + 1)) - first.max(f64::from(i))).max(0.0)
}

#[test]
fn a_lamp_covers_as_much_of_each_pixel_as_it_does() {
    let settings = Settings { width: SIDE, height: SIDE, ..Settings::default() };
    let films: Vec<Film> = (0..16)
        .map(|seed| film(&somewhere(&lamp(), seed), Settings { seed, ..settings.clone() }, PASSES))
        .collect();
    let mut told_and_one_path = [0.0; 2];
    let (mut sums, mut whole) = (vec![0.0; films.len()], 0.0);
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        let i = (y * SIDE + x) as usize;
        let share = covered(LAMP[0], x) * covered(LAMP[1], y);
        let expected = RADIANCE * share;
        let values: Vec<f64> = films.iter().map(|film| f64::from(film.mean(Layer::Visible)[i].x)).collect();
        if share == 0.0 || (share - 1.0).abs() < 1e-9 {
            assert!(values.iter().all(|value| (value - expected).abs() < 1e-5), "{x}, {y}: {values:?}");
            continue;
        }
        let Measured { mean, error } = Measured::of(&values);
        assert!((mean - expected).abs() < 4.5 * error, "{x}, {y}: {mean} ± {error} for {expected}");
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        whole += expected;
        let squares = films.iter().map(|film| f64::from(film.standard_error()[i].x).powi(2));
        told_and_one_path[0] += squares.sum::<f64>() / films.len() as f64;
        told_and_one_path[1] += RADIANCE.powi(2) * share * (1.0 - share) / f64::from(PASSES);
    }
    Measured::of(&sums).must_be(whole, 0.0);
    let [told, one_path] = told_and_one_path;
    assert!(told < 0.05 * one_path, "variance {told} for {one_path} with one path a pass");
}

/// A room in direct light from its whole ceiling, with a block and a ball in it.
fn room() -> Scene {
    let camera =
        Camera::look_at(Vec3::new(0.3, 0.4, 3.6), Vec3::ZERO, Vec3::Y, Projection::Perspective { yfov: 0.6 });
    let mut build = Build::new(Illumination::LOCAL, camera);
    let (white, grey) = (build.material("White", diffuse(0.8)), build.material("Grey", diffuse(0.1)));
    let lamp = build.material("Lamp", diffuse(0.0));
    build.0.materials[lamp as usize].emission = glow(2.0);
    build.quad(Vec3::new(-1.0, 1.5, -1.0), 2.0 * Vec3::X, 2.0 * Vec3::Z, lamp);
    build.quad(Vec3::new(-1.0, -0.6, 1.0), 2.0 * Vec3::X, -2.0 * Vec3::Z, white);
    build.quad(Vec3::new(-1.0, -0.6, -1.0), 2.0 * Vec3::X, 1.6 * Vec3::Y, grey);
    build.sphere(Vec3::new(-0.35, -0.2, 0.0), 0.3, (48, 24), false, white);
    build.sphere(Vec3::new(0.4, -0.3, 0.2), 0.25, (48, 24), false, grey);
    build.finish()
}

/// Only pixels that differ from one beside them.
#[test]
fn edges_of_what_is_lit_are_as_a_path_tracer_without_connections_finds_them() {
    let settings = Settings { width: 20, height: 20, ..Settings::default() };
    let plain = Settings { method: Method::PathPlain, samples: 64, ..settings.clone() };
    let sums = |settings: &Settings, passes: u32, edges: &[bool]| -> Measured {
        let sums: Vec<f64> = (1..13)
            .map(|seed| {
                let film = film(&somewhere(&room(), seed), Settings { seed, ..settings.clone() }, passes);
                let values = film.mean(Layer::Visible).into_iter().zip(edges);
                values.filter(|(_, edge)| **edge).map(|(value, _)| f64::from(value.x)).sum()
            })
            .collect();
        Measured::of(&sums)
    };
    let seen = film(&room(), settings.clone(), 32).mean(Layer::Visible);
    let differs = |i: usize, j: usize| (seen[i].x - seen[j].x).abs() > 0.2 * seen[i].x.max(seen[j].x);
    let edges: Vec<bool> = (0..400)
        .map(|i| (i % 20 < 19 && differs(i, i + 1)) || (i + 20 < 400 && differs(i, i + 20)))
        .collect();
    let number = edges.iter().filter(|edge| **edge).count();
    assert!((40..200).contains(&number), "{number} pixels");
    let (photon, plain) = (sums(&settings, 24, &edges), sums(&plain, 40, &edges));
    Measured { mean: photon.mean, error: photon.error.hypot(plain.error) }.must_be(plain.mean, 0.0);
}
