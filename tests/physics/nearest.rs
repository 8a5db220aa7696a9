//! The photon map of the textbooks: right where light is even over its disks, and in the limit of small ones.
//!
//! Only its density estimate is its own; who connects, shoots and follows camera rays is tested elsewhere.

use crate::agreement::{cornell, extrapolated, film, in_blocks, left_to_the_long_run, mixed, must_be_alike};
use crate::agreement::{settings, traced};
use crate::furnace::furnace;
use crate::matrices;
use crate::moved::somewhere;
use crate::support::{Build, diffuse, look, measure, small};
use glam::Vec3;
use halflight::film::Layer;
use halflight::light::Matrix;
use halflight::measure::Estimate;
use halflight::optics::{Lobe, Mirror};
use halflight::plan::{Direct, Method, Settings};
use halflight::render::Render;
use halflight::scene::{Environment, Illumination, Matter, Projection, Scene};

/// Light from the nearest so many photons.
fn nearest(count: u32, cone: f32, settings: Settings) -> Settings {
    Settings { method: Method::Nearest, nearest: count, cone, ..settings }
}

/// A floor far from its rims, under a sky of radiance 1.
fn floor() -> Build {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 2.0, 0.3), Vec3::ZERO));
    let floor = build.material("Floor", diffuse(0.5));
    build.quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X, floor);
    build.0.environment = Some(Environment::constant(Vec3::ONE));
    build
}

#[test]
fn photons_of_a_sky_light_a_floor_as_it_does() {
    for (cone, number) in [(1.0, 1), (1.5, 2), (f32::INFINITY, 3)] {
        let settings = Settings { direct: Direct::Photons, ..small(16, 16, 30_000) };
        let scene = somewhere(&floor().finish(), number);
        measure(scene, nearest(100, cone, settings), 300).must_be(0.5, 1e-3);
    }
}

#[test]
fn a_mirror_shows_the_floor_the_sky_that_it_hides() {
    // What the wall hides of an even sky it brings by reflection: a caustic as smooth as the wall is far.
    let mut build = floor();
    let mirror = build.material("Mirror", Lobe::Mirror(Mirror::plain(Vec3::ONE, false)));
    build.quad(Vec3::new(-2.0, 0.0, -1.0), 4.0 * Vec3::X, 2.0 * Vec3::Y, mirror);
    let scene = build.finish();
    let direct = Settings { max_reflections: Some(1), ..nearest(50, 1.0, small(16, 16, 1000)) };
    let hidden = 1.0 - measure(scene.clone(), direct, 50).mean / 0.5;
    assert!(hidden > 0.2, "the mirror matters little: {hidden}");
    measure(somewhere(&scene, 4), nearest(50, 1.0, small(16, 16, 40_000)), 400).must_be(0.5, 1e-3);
}

/// Within any distance of a point of a ball lies as much of it as of a plane.
#[test]
fn a_furnace_glows_as_its_albedo_says() {
    for (albedo, cone) in [(0.5, 1.0), (0.9, 1.0), (0.5, f32::INFINITY)] {
        let measured =
            measure(furnace(albedo, Illumination::GLOBAL), nearest(60, cone, small(24, 24, 20_000)), 40);
        measured.must_be(1.0 / (1.0 - f64::from(albedo)), 0.003);
    }
}

#[test]
fn both_halves_are_read_alike_where_matter_makes_them_alike() {
    let layers = [Layer::Visible, Layer::Invisible];
    let settings = nearest(60, 1.0, small(16, 16, 5_000));
    let mut render = Render::new(furnace(0.5, Illumination::GLOBAL), settings, &layers).expect("a render");
    (0..8).for_each(|_| render.pass());
    let [visible, invisible] = layers.map(|layer| render.film().mean(layer));
    let alike = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element() < 1e-5;
    assert!(visible.iter().zip(&invisible).all(alike) && visible[0].x > 1.5);
}

#[test]
fn photons_of_both_halves_multiply_in_the_order_light_meets_matrices() {
    for (upper, lower) in [(matrices::A, matrices::B), (matrices::B, matrices::A)] {
        // Photons of a point are spread more evenly than by chance, which makes 1 / (2 k) too dark at the most.
        let settings = nearest(400, 1.0, Settings { direct: Direct::Photons, ..small(8, 8, 40_000) });
        let mut scene = matrices::stack(upper, lower);
        scene.camera = look(Vec3::new(2.0, 0.3, 0.0), Vec3::ZERO);
        scene.camera.projection = Projection::Orthographic { half_height: 0.002 };
        measure(scene, settings, 150).must_be(matrices::expected(upper, lower), 0.002);
    }
}

/// From four times as many photons the disk is twice as wide: its bias, which is linear at rims and shadows, is taken off.
fn extrapolated_from(scene: &Scene, passes: u32) -> Estimate {
    let at = |count, seed| {
        let settings = nearest(count, 1.0, Settings { paths: Some(24_000), ..settings(seed) });
        Estimate::from_film(&film(scene, settings, passes)).expect("several passes")
    };
    extrapolated(&at(24, 1), &at(6, 2))
}

/// In blocks of pixels it agrees with the path tracer.
#[track_caller]
fn must_agree(name: &str, scene: &Scene, passes: u32) {
    let number = name.bytes().fold(0, |number: u64, byte| 31 * number + u64::from(byte));
    let map = extrapolated_from(&somewhere(scene, number), passes);
    let path = traced(&somewhere(scene, number + 1), Method::Path, passes);
    must_be_alike(name, &in_blocks(&map, true), &in_blocks(&path, false));
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn in_the_limit_it_agrees_with_paths() {
    must_agree("global", &cornell(Illumination::GLOBAL), 600);
    if !left_to_the_long_run("a box of plain walls, own matrices") {
        must_agree("plain", &mixed(false, false).finish(), 600);
        let matter = Matter {
            opaque: Matrix::new([[0.5, 0.2], [0.9, 0.4]]),
            straight: Matrix::new([[0.3, 0.1], [0.05, 0.2]]),
        };
        must_agree("own matrices", &cornell(Illumination::Own(matter)), 600);
    }
}
