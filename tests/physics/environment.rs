//! Light from infinity: closed forms under skies and suns, and whether shooting and gathering agree about them. That the plain path
//! tracer finds a sky by chance alone, when its lines escape, makes it an independent witness.

use crate::agreement::{four_balls, must_agree, must_agree_in};
use crate::moved::somewhere;
use crate::support::{Build, Measured, diffuse, look, measure, small};
use glam::{Mat3, Vec3};
use halflight::light::Light;
use halflight::optics::{Dielectric, Lobe, Mirror};
use halflight::plan::{Direct, Method, Settings};
use halflight::scene::environment::{Panorama, upright};
use halflight::scene::{Background, Environment, Illumination, Luminaire, Material, Projection, Scene};
use std::f64::consts::PI;

/// Brighter towards the zenith, +x and a small bright disk; coarse, so that much of it is between texels.
fn gradient() -> Environment {
    let (width, height) = (24, 12);
    let texel = |i: u32| {
        let place = [i % width, i / width];
        let to = Panorama::direction([
            (place[0] as f32 + 0.5) / width as f32,
            (place[1] as f32 + 0.5) / height as f32,
        ]);
        let disk = if place == [9, 3] { 20.0 } else { 0.0 };
        Vec3::splat(1.5 + to.y + 0.4 * to.x + disk)
    };
    let texels = (0..width * height).map(texel).collect();
    let panorama = Panorama::new(width, height, texels).expect("light");
    Environment::new("gradient", panorama, 0.8, upright(20.0), Background::Same)
}

/// ∫ L cos dω over the hemisphere about `up`, by a grid.
fn irradiance(sky: &Environment, up: Vec3) -> f64 {
    let (right, ahead) = up.any_orthonormal_pair();
    let (rings, turns) = (1500, 1500);
    let mut sum = 0.0;
    for i in 0..rings {
        // Even in cos².
        let cos = ((f64::from(i) + 0.5) / f64::from(rings)).sqrt();
        let sin = (1.0 - cos * cos).sqrt();
        for j in 0..turns {
            let phi = (f64::from(j) + 0.5) / f64::from(turns) * 2.0 * PI;
            let [x, y, z] = [sin * phi.cos(), sin * phi.sin(), cos].map(|x| x as f32);
            sum += f64::from(sky.radiance((x * right + y * ahead + z * up).normalize()).invisible.x);
        }
    }
    PI * sum / f64::from(rings) / f64::from(turns)
}

/// A floor under a sky.
fn plane(sky: Environment, up: Vec3, albedo: f32) -> Scene {
    let (right, ahead) = up.any_orthonormal_pair();
    let mut build = Build::new(Illumination::GLOBAL, look(2.0 * up + 0.3 * right, Vec3::ZERO));
    let floor = build.material("Floor", diffuse(albedo));
    build.quad(-right - ahead, 2.0 * right, 2.0 * ahead, floor);
    build.0.environment = Some(sky);
    build.finish()
}

fn settings(method: Method) -> Settings {
    Settings { method, samples: 64, ..small(32, 32, 20_000) }
}

#[test]
fn a_plane_under_a_gradient_shows_its_irradiance() {
    for up in [Vec3::Y, Vec3::new(0.6, 0.0, -0.8), Vec3::new(0.0, -0.96, 0.28)] {
        let expected = 0.5 / PI * irradiance(&gradient(), up);
        for (method, number) in [(Method::Photon, 1), (Method::Path, 2), (Method::PathPlain, 3)] {
            let scene = somewhere(&plane(gradient(), up, 0.5), number);
            measure(scene, settings(method), 48).must_be(expected, 1e-3);
        }
    }
}

#[test]
fn photons_of_a_sky_bring_its_irradiance() {
    let expected = 0.5 / PI * irradiance(&gradient(), Vec3::Y);
    let direct = Settings { direct: Direct::Photons, ..settings(Method::Photon) };
    measure(somewhere(&plane(gradient(), Vec3::Y, 0.5), 4), direct, 200).must_be(expected, 1e-3);
}

#[test]
fn under_an_even_sky_convex_bodies_need_no_samples() {
    let sky = Environment::constant(Vec3::splat(0.7));
    let mut build = Build::new(Illumination::LOCAL, look(Vec3::new(1.0, 2.0, 6.0), Vec3::ZERO));
    build.yfov(0.2);
    let white = build.material("White", diffuse(0.5));
    build.sphere(Vec3::ZERO, 1.0, (64, 32), false, white);
    build.0.environment = Some(sky);
    let scene = build.finish();
    let found = measure(scene.clone(), settings(Method::Photon), 2);
    // Without shadows each point sees the whole sky above it: albedo times its radiance, whatever the shading normal.
    assert!((found.mean / 0.35 - 1.0).abs() < 1e-5 && found.error < 1e-7, "{found:?}");
    measure(somewhere(&scene, 5), settings(Method::PathPlain), 16).must_be(0.35, 1e-3);
}

/// Whatever is white is as bright as the even sky around it: a corner of walls, a ball of glass, a mirror and a white ball in it.
fn white_corner() -> Scene {
    let mut build =
        Build::new(Illumination::GLOBAL, look(Vec3::new(3.0, 2.5, 3.5), Vec3::new(0.5, 0.4, 0.5)));
    build.yfov(0.5);
    let white = build.material("White", diffuse(1.0));
    let glass = build.material("Glass", Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::ONE }));
    let mirror = build.material("Mirror", Lobe::Mirror(Mirror::plain(Vec3::ONE, false)));
    let (x, y, z) = (2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z);
    build.quad(Vec3::ZERO, z, x, white).quad(Vec3::ZERO, x, y, white).quad(Vec3::ZERO, y, z, white);
    for (at, material) in [(0.4, glass), (1.0, mirror), (1.6, white)] {
        build.sphere(Vec3::new(at, 0.3, 2.0 - at), 0.28, (48, 24), false, material);
    }
    build.0.environment = Some(Environment::constant(Vec3::ONE));
    build.finish()
}

#[test]
fn an_open_furnace_cannot_be_told_from_its_sky() {
    for (method, passes) in [(Method::Photon, 400), (Method::Path, 8), (Method::PathPlain, 8)] {
        let scene = somewhere(&white_corner(), 6);
        // Radii at the edge of what is shut in are the bias of a map; paths have none.
        let rounding = if method == Method::Photon { 0.004 } else { 1e-3 };
        let settings = Settings { caustic_radius: 0.5, indirect_radius: 0.5, ..settings(method) };
        measure(scene, settings, passes).must_be(1.0, rounding);
    }
}

const ANGLE: f32 = 0.05;

fn sun(to: Vec3) -> Luminaire {
    Luminaire::sun(-to, Light::both(Vec3::splat(3.0)), ANGLE)
}

#[test]
fn a_sun_brings_the_irradiance_that_it_is_made_for_and_is_seen_as_a_disk() {
    let to = Vec3::new(0.48, 0.8, -0.36);
    let mut build = Build::new(Illumination::GLOBAL, look(2.0 * Vec3::Y, Vec3::ZERO));
    let floor = build.material("Floor", diffuse(0.5));
    build.quad(-Vec3::X - Vec3::Z, 2.0 * Vec3::Z, 2.0 * Vec3::X, floor);
    build.0.luminaire(sun(to));
    let scene = build.finish();
    let expected = 0.5 / PI * 3.0 * 0.8;
    for (method, number) in [(Method::Photon, 1), (Method::Path, 2)] {
        measure(somewhere(&scene, number), settings(method), 32).must_be(expected, 1e-3);
    }
    let by_photons = Settings { direct: Direct::Photons, ..settings(Method::Photon) };
    measure(somewhere(&scene, 3), by_photons, 200).must_be(expected, 1e-3);
    // Looked at, it fills π sin² of the tangent plane.
    let mut at = scene.clone();
    at.camera = halflight::scene::Camera::look_at(
        Vec3::Y,
        Vec3::Y + to,
        Vec3::X,
        Projection::Perspective { yfov: 4.0 * ANGLE },
    );
    let radiance = 3.0 / (PI * f64::from(ANGLE).sin().powi(2));
    let seen = PI * f64::from(ANGLE).tan().powi(2) / (4.0 * f64::from(2.0 * ANGLE).tan().powi(2));
    for method in [Method::Photon, Method::Path, Method::PathPlain] {
        measure(at.clone(), settings(method), 64).must_be(seen * radiance, 1e-3);
    }
}

#[test]
fn half_of_a_sun_beyond_an_edge_is_half_a_shadow() {
    // A point straight below the edge of a wide sheet, the sun in the zenith.
    let mut build = Build::new(Illumination::ONE_BOUNCE, look(Vec3::new(0.0, 0.5, 1.5), Vec3::ZERO));
    build.yfov(0.004);
    let (floor, sheet) = (build.material("Floor", diffuse(0.5)), build.material("Sheet", diffuse(0.0)));
    build.quad(-3.0 * (Vec3::X + Vec3::Z), 6.0 * Vec3::Z, 6.0 * Vec3::X, floor);
    build.quad(Vec3::new(0.0, 1.0, -3.0), 6.0 * Vec3::Z, 3.0 * Vec3::X, sheet);
    build.0.luminaire(sun(Vec3::Y));
    let scene = build.finish();
    let expected = 0.5 * 0.5 / PI * 3.0;
    for (method, number) in [(Method::Photon, 1), (Method::Path, 2)] {
        let measured = measure(scene.clone(), Settings { seed: number, ..settings(method) }, 100);
        measured.must_be(expected, 2e-3);
    }
}

/// The power (W) that a ball of glass under a sun in the zenith sends to a square of a floor, its middle `height` below that of the
/// ball: rays in their thousands by Fresnel's formulas, once refracted on either side, through a perfect sphere.
fn caustic_power(radius: f64, height: f64, half: f64, ior: f64) -> f64 {
    let fresnel = |cos: f64| {
        let sin2 = (1.0 - cos * cos) / (ior * ior);
        let behind = (1.0 - sin2).sqrt();
        let s = (cos - ior * behind) / (cos + ior * behind);
        let p = (behind - ior * cos) / (behind + ior * cos);
        0.5 * (s * s + p * p)
    };
    let n = 100_000;
    let each = (0..n).map(|i| {
        let b2 = (f64::from(i) + 0.5) / f64::from(n);
        let (at, within) = (b2.sqrt().asin(), (b2.sqrt() / ior).asin());
        // It leaves where it has gone π − 2 within about the middle, turned by 2 (at − within).
        let (out, turned) = (at - 2.0 * within, 2.0 * (at - within));
        let (x, y) = (-radius * out.sin(), -radius * out.cos());
        let place = (x - (height + y) * turned.tan()).abs();
        let share = match place {
            _ if turned >= 0.5 * PI => 0.0,
            place if place <= half => 1.0,
            place => (1.0 - 4.0 / PI * (half / place).acos()).max(0.0),
        };
        share * (1.0 - fresnel((1.0 - b2).sqrt())).powi(2)
    });
    PI * radius * radius * each.sum::<f64>() / f64::from(n)
}

/// A ball under a sun, over a floor of so many metres to each side, must show the caustic of [`caustic_power`].
#[track_caller]
fn must_show_its_caustic(floor_half: f32) {
    let (radius, ior) = (0.25_f32, 1.5_f32);
    // From below, through a floor that only absorbs what it does not show; the picture covers the caustic and no more.
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO));
    let half = 0.17_f32;
    build.0.camera = Some(halflight::scene::Camera::look_at(
        Vec3::new(0.0, 0.04, 0.0),
        Vec3::ZERO,
        Vec3::X,
        Projection::Orthographic { half_height: half },
    ));
    let floor = build.material("Floor", diffuse(0.5));
    let glass = build.material("Glass", Lobe::Dielectric(Dielectric { ior, tint: Vec3::ONE }));
    let (x, z) = (2.0 * floor_half * Vec3::X, 2.0 * floor_half * Vec3::Z);
    build.quad(-0.5 * (x + z), z, x, floor);
    build.sphere(Vec3::new(0.0, 0.3, 0.0), radius, (512, 256), false, glass);
    build.0.luminaire(Luminaire::sun(-Vec3::Y, Light::both(Vec3::splat(3.0)), 0.00465));
    let scene = build.finish();
    // All that is seen is in the ball's shadow; what is reflected inside the ball is left out.
    let power = 3.0 * caustic_power(radius.into(), 0.3, half.into(), ior.into());
    let expected = 0.5 / PI * power / f64::from(4.0 * half * half);
    let settings = Settings { max_reflections: Some(3), ..small(64, 64, 60_000) };
    let measured: Vec<f64> =
        (0..8).map(|seed| measure(scene.clone(), Settings { seed, ..settings.clone() }, 8).mean).collect();
    Measured::of(&measured).must_be(expected, 4e-3);
}

#[test]
fn the_caustic_of_a_ball_under_the_sun_has_the_power_of_fresnels_formulas() {
    must_show_its_caustic(2.0);
}

#[test]
fn it_has_on_a_plain_of_six_kilometres() {
    must_show_its_caustic(3000.0);
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn it_has_on_a_plain_of_any_width() {
    [30.0, 300.0].into_iter().for_each(must_show_its_caustic);
}

fn diffuse_matter(albedo: [f32; 3]) -> Material {
    let lobe = halflight::optics::Diffuse { albedo: Vec3::from_array(albedo), two_sided: false, under: None };
    Material::new("Diffuse", Lobe::Diffuse(lobe))
}

/// A room with a window under a sky with a sun, and four balls.
fn window(illumination: Illumination) -> Scene {
    let mut build = Build::new(illumination, look(Vec3::new(0.0, 1.0, 3.5), Vec3::new(0.0, 0.5, 0.0)));
    build.yfov(0.6);
    let wall = build.material("Wall", diffuse(0.6));
    let (x, y, z) = (2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z);
    let corner = Vec3::new(-1.0, 0.0, -1.0);
    build.quad(corner, z, x, wall).quad(corner, x, y, wall);
    // Half a wall on the left; nothing on the right and above.
    build.quad(corner, 0.4 * y, z, wall);
    let glass = Material::new("Glass", Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::ONE }));
    let mirror = Material::new("Mirror", Lobe::Mirror(Mirror::plain(Vec3::splat(0.9), false)));
    let metal = Material::new("Metal", crate::agreement::rough(0.3, Vec3::new(0.9, 0.7, 0.4)));
    four_balls(&mut build, [glass, mirror, metal, diffuse_matter([0.2, 0.6, 0.3])]);
    build.0.environment = Some(gradient());
    build.0.luminaire(Luminaire::sun(
        -Vec3::new(0.48, 0.8, 0.36),
        Light::new(Vec3::new(2.0, 1.8, 1.5), Vec3::splat(0.3)),
        0.1,
    ));
    build.finish()
}

#[test]
fn methods_agree_under_a_sky_with_a_sun() {
    must_agree_in(600, "sky and sun", &window(Illumination::GLOBAL), Direct::Connection);
}

#[test]
#[ignore = "long physics: with the sky at corners of the square, and by photons alone"]
fn methods_agree_under_skies_at_other_corners() {
    must_agree("sky, shadowless", &window(Illumination::SHADOWLESS), Direct::Connection);
    must_agree("sky, one bounce", &window(Illumination::ONE_BOUNCE), Direct::Connection);
    must_agree("sky, by photons", &window(Illumination::GLOBAL), Direct::Photons);
    let mut even = window(Illumination::GLOBAL);
    even.surround(Environment::constant(Vec3::new(0.5, 0.7, 1.0)));
    must_agree("even sky", &even, Direct::Connection);
}

#[test]
fn a_background_of_its_own_lights_nothing() {
    let lit = |background| {
        let sky = Panorama::constant(Vec3::ONE);
        plane(Environment::new("even", sky, 1.0, Mat3::IDENTITY, background), Vec3::Y, 0.5)
    };
    for background in [Background::Same, Background::Black, Background::Colour(Vec3::splat(7.0))] {
        let found = measure(lit(background), settings(Method::Photon), 2);
        assert!((found.mean - 0.5).abs() < 1e-5, "{background:?}: {found:?}");
        let mut away = lit(background);
        away.camera = look(2.0 * Vec3::Y, 4.0 * Vec3::Y);
        let seen = match background {
            Background::Same => 1.0,
            Background::Black => 0.0,
            Background::Colour(colour) => f64::from(colour.x),
        };
        for method in [Method::Photon, Method::Path, Method::PathPlain] {
            let found = measure(away.clone(), settings(method), 2);
            assert!((found.mean - seen).abs() < 1e-5, "{background:?}: {found:?} for {seen}");
        }
    }
}
