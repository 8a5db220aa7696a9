//! The thin lens: how wide what is out of focus is, and how bright; and whether both ways of rendering see through the same.

use crate::moved::somewhere;
use crate::support::{Build, Measured, diffuse, glow};
use glam::Vec3;
use halflight::film::{Film, Layer};
use halflight::light::Light;
use halflight::measure::{Estimate, agreement};
use halflight::plan::{Method, Settings};
use halflight::render::Render;
use halflight::scene::{Camera, Illumination, Lens, Luminaire, Projection, Scene};

const LENS: Lens = Lens { radius: 0.05, focus: 2.0 };
/// Distance of the lamp, m.
const FAR: f32 = 6.0;
/// Its side, m.
const SIDE: f32 = 0.06;
/// Half of what is seen, at distance 1.
const HALF: f32 = 0.025;
const PIXELS: u32 = 48;

/// A small square lamp that faces the camera, from the middle of whose picture it is.
fn lamp(lens: Option<Lens>) -> Scene {
    let (from, to) = (Vec3::new(1.0, 2.0, 5.0), Vec3::new(0.2, 0.4, -0.3));
    let yfov = 2.0 * HALF.atan();
    let mut camera = Camera::look_at(from, to, Vec3::Y, Projection::Perspective { yfov });
    camera.lens = lens;
    let mut build = Build::new(Illumination::GLOBAL, camera);
    let shining = build.material("Lamp", diffuse(0.0));
    build.0.materials[shining as usize].emission = glow(3.0);
    let (right, up) = (SIDE * camera.right, SIDE * camera.up);
    build.quad(from + FAR * camera.forward - 0.5 * (right + up), right, up, shining);
    build.finish()
}

fn film(scene: &Scene, settings: Settings, layer: Layer, passes: u32) -> Film {
    let mut render = Render::new(scene.clone(), settings, &[layer]).expect("a render");
    (0..passes).for_each(|_| render.pass());
    render.film().clone()
}

/// Brightness of the whole film, and the mean square of the distance from its middle that this brightness has, in tangents.
fn spread(scene: &Scene, method: Method, seed: u64) -> [f64; 2] {
    let settings =
        Settings { method, seed, width: PIXELS, height: PIXELS, samples: 16, ..Settings::default() };
    let film = film(scene, settings, Layer::Visible, if method == Method::Photon { 64 } else { 8 });
    let pixel = f64::from(2.0 * HALF) / f64::from(PIXELS);
    let (mut sum, mut square) = (0.0, 0.0);
    for (i, rgb) in film.mean(Layer::Visible).iter().enumerate() {
        let [x, y] =
            [i as u32 % PIXELS, i as u32 / PIXELS].map(|i| (f64::from(i) + 0.5) * pixel - f64::from(HALF));
        let radiance = f64::from(rgb.y);
        sum += radiance;
        // Within a pixel light may lie anywhere.
        square += radiance * (x * x + y * y + pixel * pixel / 6.0);
    }
    [sum / f64::from(PIXELS * PIXELS), square / sum]
}

#[test]
fn a_small_lamp_has_the_circle_of_confusion_of_the_formula_and_keeps_its_light() {
    let (far, side) = (f64::from(FAR), f64::from(SIDE));
    let Lens { radius, focus } = LENS;
    // Through a point l of the lens the lamp at distance z is seen in the direction −l (1/z − 1/f).
    let circle = f64::from(radius) * (1.0 / far - 1.0 / f64::from(focus));
    // Half of r² over a disk; a sixth of the side's square over a square.
    let expected = 0.5 * circle * circle + side * side / (6.0 * far * far);
    // It is as large through every point of the lens.
    let brightness = 3.0 * side * side / (far * far) / f64::from(4.0 * HALF * HALF);
    for method in [Method::Photon, Method::Path] {
        let samples: Vec<[f64; 2]> = (0..24).map(|seed| spread(&lamp(Some(LENS)), method, seed)).collect();
        Measured::of(&samples.iter().map(|s| s[0]).collect::<Vec<_>>()).must_be(brightness, 0.001);
        Measured::of(&samples.iter().map(|s| s[1]).collect::<Vec<_>>()).must_be(expected, 0.001);
    }
    let [sharp, square] = spread(&lamp(None), Method::Path, 1);
    assert!((sharp / brightness - 1.0).abs() < 0.01 && square < 0.15 * expected, "a pinhole sees it sharp");
    let [_, in_focus] = spread(&lamp(Some(Lens { focus: FAR, ..LENS })), Method::Path, 1);
    assert!((in_focus / square - 1.0).abs() < 0.05, "{in_focus} and {square}");
}

/// A floor under a point light, and a sheet near the camera that hides half of it.
fn half_hidden(lens: Option<Lens>) -> Scene {
    let mut camera = Camera::look_at(
        Vec3::new(0.1, 2.0, 2.6),
        Vec3::new(0.0, 0.1, 0.0),
        Vec3::Y,
        Projection::Perspective { yfov: 0.5 },
    );
    camera.lens = lens;
    let mut build = Build::new(Illumination::ONE_BOUNCE, camera);
    let (floor, sheet) = (build.material("Floor", diffuse(0.8)), build.material("Sheet", diffuse(0.3)));
    build.quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z, floor);
    build.quad(Vec3::new(0.02, 1.0, 1.6), 2.0 * Vec3::X, -0.7 * Vec3::Z + 0.3 * Vec3::Y, sheet);
    let intensity = Light::both(Vec3::new(9.0, 6.0, 3.0));
    build.0.luminaire(Luminaire::Point { position: Vec3::new(-0.4, 2.5, 0.3), intensity });
    build.finish()
}

#[test]
fn photons_and_paths_see_through_the_same_lens() {
    let lens = Lens { radius: 0.12, focus: 3.1 };
    let estimate = |scene: &Scene, method: Method, number: u64| {
        let settings =
            Settings { method, seed: number, width: 20, height: 20, samples: 4, ..Settings::default() };
        Estimate::from_film(&film(&somewhere(scene, number), settings, Layer::Visible, 1200))
            .expect("several passes")
    };
    let (photon, path) = (
        estimate(&half_hidden(Some(lens)), Method::Photon, 1),
        estimate(&half_hidden(Some(lens)), Method::Path, 2),
    );
    let verdict = agreement(&photon, &path, None);
    assert!(verdict.accepted(), "{verdict:?}");
    for radius in [0.0, 0.09, 0.16] {
        let other = (radius > 0.0).then_some(Lens { radius, ..lens });
        let other = estimate(&half_hidden(other), Method::Path, 3);
        assert!(!agreement(&photon, &other, None).accepted(), "it cannot tell a lens of {radius}");
    }
}

#[test]
fn depth_is_measured_from_the_lens() {
    let settings = Settings { width: 8, height: 8, ..Settings::default() };
    let blurred = film(&lamp(Some(LENS)), settings, Layer::Depth, 64);
    let depths = blurred.mean(Layer::Depth);
    // The lamp stands across the direction of view; rays lean by no more than the lens and the film make them.
    let lean = LENS.radius / LENS.focus + 2.0 * HALF;
    let seen = depths.iter().map(|d| d.x).filter(|d| d.is_finite() && *d > 0.0);
    let (low, high) = seen.fold((f32::INFINITY, 0.0_f32), |(low, high), d| (low.min(d), high.max(d)));
    assert!(low > 0.999 * FAR && high < FAR * (1.0 + lean * lean), "{low} to {high}");
}
