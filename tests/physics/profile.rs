//! Lamps that shine as they were measured: closed forms, and photons against paths.

use crate::agreement::{mixed, must_agree_in};
use crate::support::{Build, diffuse, look, measure, small};
use glam::{Mat3, Vec3};
use halflight::emission::Emitters;
use halflight::light::{Invisible, Light, Power};
use halflight::plan::{Direct, Method, Settings};
use halflight::sampling::Sobol;
use halflight::scene::{Illumination, Luminaire, Profile, Scene};
use std::f64::consts::PI;

/// Linear from 9 ahead to 3 at 60° and 1 behind, where it shines to x; twice as strong at 60° to y, half as strong to −x.
const IES: &[u8] = b"TILT=NONE\n1 -1 1 3 3 1 2 0 0 0 1 1 60 0 60 180 0 90 180 9 3 1 9 6 1 9 1.5 1";

const HEIGHT: f32 = 1.5;

/// A floor under a lamp that shines down, as its x lies, seen at `at`.
fn floor(at: Vec3, albedo: f32) -> Scene {
    let mut build = Build::new(Illumination::LOCAL, look(at + Vec3::new(0.5, 2.0, 2.0), at));
    let material = build.material("Floor", diffuse(albedo));
    build.quad(Vec3::new(-40.0, 0.0, -40.0), 80.0 * Vec3::Z, 80.0 * Vec3::X, material);
    build.yfov(0.001);
    let down = Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y);
    let profile = build.0.profile(Profile::parse(IES).expect("a good file").turned(down));
    let intensity = Light::both(Vec3::splat(2.0));
    build.0.luminaire(Luminaire::Profile { position: HEIGHT * Vec3::Y, intensity, profile });
    build.finish()
}

/// The integral of the profile over all directions, in its own unit: for each row of angles ∫ I sin θ dθ times the mean over turns.
fn whole() -> f64 {
    let row = |[a, b]: [f64; 2], [from, to]: [f64; 2]| {
        let slope = (to - from) / (b - a);
        from * a.cos() - to * b.cos() + slope * (b.sin() - a.sin())
    };
    // Trapezoids over the turn: 3, 6, 1.5 at 60°.
    let middle = (0.5 * 3.0 + 6.0 + 0.5 * 1.5) / 2.0;
    let third = PI / 3.0;
    2.0 * PI * (row([0.0, third], [9.0, middle]) + row([third, PI], [middle, 1.0]))
}

/// Where it is seen and the intensity of the profile there.
fn places() -> [(Vec3, f64); 3] {
    let aside = HEIGHT * 3.0_f32.sqrt();
    [
        (Vec3::ZERO, 9.0),
        // 60° from below, to the lamp's y, which is −z.
        (Vec3::new(0.0, 0.0, -aside), 6.0),
        // 30° from below, to −x.
        (Vec3::new(-HEIGHT / 3.0_f32.sqrt(), 0.0, 0.0), 0.5 * (9.0 + 1.5)),
    ]
}

#[test]
fn a_measured_lamp_lights_a_floor_by_its_intensity_in_each_direction() {
    let mean = whole() / (4.0 * PI);
    for (at, profile) in places() {
        let square = f64::from(at.length_squared() + HEIGHT * HEIGHT);
        let cos = f64::from(HEIGHT) / square.sqrt();
        let expected = 2.0 * profile / mean * cos / square * 0.8 / PI;
        let scene = floor(at, 0.8);
        let connected = Settings { direct: Direct::Connection, ..small(4, 4, 1000) };
        measure(scene.clone(), connected, 4).must_be(expected, 2e-3);
        let traced = Settings { method: Method::Path, ..small(4, 4, 1000) };
        measure(scene, traced, 4).must_be(expected, 2e-3);
    }
}

#[test]
fn photons_and_paths_agree_on_what_it_lights() {
    let mut build = mixed(false, false);
    build.0.materials.iter_mut().for_each(|material| material.emission = None);
    let aslant = Mat3::from_cols(Vec3::Z, Vec3::new(-0.6, 0.8, 0.0), Vec3::new(-0.8, -0.6, 0.0));
    let profile = build.0.profile(Profile::parse(IES).expect("a good file").turned(aslant));
    let intensity = Light::both(Vec3::new(0.5, 0.4, 0.3));
    build.0.luminaire(Luminaire::Profile { position: Vec3::new(0.2, 0.1, -0.3), intensity, profile });
    must_agree_in(300, "a measured lamp", &build.finish(), Direct::Photons);
}

#[test]
fn its_photons_carry_its_power_to_each_part_of_a_floor() {
    let scene = floor(Vec3::ZERO, 0.8);
    let emitters = Emitters::<Invisible>::new(&scene).expect("a lamp");
    let n = 1 << 17;
    let sobol = Sobol::new(9);
    let (mut all, mut cone) = (0.0, 0.0);
    for i in 0..n {
        let emitted = emitters.emit(n, sobol.point(i, 0));
        let power = f64::from(emitted.power.total()) / 3.0;
        all += power;
        if emitted.direction.y < -0.5 {
            cone += power;
        }
    }
    let third = PI / 3.0;
    let middle = (0.5 * 3.0 + 6.0 + 0.5 * 1.5) / 2.0;
    let slope = (middle - 9.0) / third;
    let in_cone = 2.0 * PI * (9.0 - middle * third.cos() + slope * third.sin());
    for (found, expected) in [(all, 2.0 * 4.0 * PI), (cone, 2.0 * 4.0 * PI * in_cone / whole())] {
        let fits = |over: f64| (found / (over * expected) - 1.0).abs() < 3e-3;
        assert!(fits(1.0) && !fits(1.02) && !fits(0.98), "{found} W for {expected}");
    }
}
