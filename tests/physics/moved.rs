//! A scene looks the same wherever it stands, however it is turned, whatever its size.
//!
//! Rounding depends on where zero is and along which axes things lie. So tests of agreement look at scenes that stand in places
//! of their own, with a lamp in a plane through zero as often as not.

use crate::area_light::corner_form_factor;
use crate::support::{Build, diffuse, glow, look, measure, small};
use glam::{DQuat, DVec3, Mat3, Vec3};
use halflight::plan::{Method, Settings};
use halflight::sampling::{Rng, Stream};
use halflight::scene::{Illumination, Luminaire, Projection, Scene};
use std::sync::Arc;

/// `scene` turned, then made `scale` times as large, so that `centre` of it comes to lie at zero. Radiance stays as it is.
pub fn placed(scene: &Scene, centre: DVec3, turn: DQuat, scale: f64) -> Scene {
    let mut scene = scene.clone();
    let place = |p: Vec3| (scale * (turn * (p.as_dvec3() - centre))).as_vec3();
    let turned = |v: Vec3| (turn * v.as_dvec3()).as_vec3();
    let size = scale as f32;
    scene.mesh.positions.iter_mut().for_each(|p| *p = place(*p));
    scene.mesh.normals.iter_mut().for_each(|n| *n = turned(*n).normalize());
    scene.materials.iter_mut().for_each(|material| material.absorption /= size);
    let camera = &mut scene.camera;
    camera.position = place(camera.position);
    [camera.right, camera.up, camera.forward] = [camera.right, camera.up, camera.forward].map(turned);
    if let Projection::Orthographic { half_height } = &mut camera.projection {
        *half_height *= size;
    }
    if let Some(lens) = &mut camera.lens {
        (lens.radius, lens.focus) = (size * lens.radius, size * lens.focus);
    }
    let by = Mat3::from_quat(turn.as_quat());
    if let Some(environment) = &mut scene.environment {
        *environment = Arc::new(environment.turned(by));
    }
    scene.profiles.iter_mut().for_each(|profile| *profile = profile.turned(by));
    for luminaire in scene.luminaires.iter_mut().chain(&mut scene.skies) {
        match luminaire {
            Luminaire::Triangle { area, .. } => *area *= size * size,
            Luminaire::Point { position, intensity } | Luminaire::Profile { position, intensity, .. } => {
                (*position, *intensity) = (place(*position), size * size * *intensity);
            }
            Luminaire::Spot { position, direction, intensity, .. } => {
                (*position, *direction) = (place(*position), turned(*direction));
                *intensity = size * size * *intensity;
            }
            Luminaire::Warn { position, direction, attenuation: [_, a1, a2], .. } => {
                (*position, *direction) = (place(*position), turned(*direction));
                (*a1, *a2) = (*a1 / size, *a2 / (size * size));
            }
            Luminaire::Directional { direction, .. } => *direction = turned(*direction),
            Luminaire::Sun { direction, .. } => *direction = turned(*direction).normalize(),
            Luminaire::Environment { .. } => {}
            _ => unreachable!("a luminaire that this does not know how to move"),
        }
    }
    scene
}

/// `scene` somewhere else, by chance; the same for the same number.
pub fn somewhere(scene: &Scene, number: u64) -> Scene {
    let mut rng = Rng::new(17, Stream::Test, 0, number);
    let (min, max) = scene.mesh.bounds();
    let lamps: Vec<Vec3> = scene.luminaires.iter().filter_map(|luminaire| middle(scene, luminaire)).collect();
    let middle = 0.5 * (min + max).as_dvec3();
    let centre = match rng.u32() % 3 {
        _ if lamps.is_empty() => middle,
        0 => middle + (max - min).as_dvec3() * f64::from(rng.f32()),
        _ => lamps[rng.u32() as usize % lamps.len()].as_dvec3(),
    };
    let [x, y, z] = [(); 3].map(|()| f64::from(rng.f32()) - 0.5);
    // As often as not along the axes, where coordinates are the same to the bit.
    let turn = match rng.u32() % 2 {
        0 => DQuat::IDENTITY,
        _ => DQuat::from_xyzw(x, y, z, f64::from(rng.f32()) - 0.5).normalize(),
    };
    placed(scene, centre, turn, 1e4_f64.powf(f64::from(rng.f32()) - 0.5))
}

fn middle(scene: &Scene, luminaire: &Luminaire) -> Option<Vec3> {
    match *luminaire {
        Luminaire::Triangle { triangle, .. } => Some(scene.mesh.corners(triangle).iter().sum::<Vec3>() / 3.0),
        Luminaire::Point { position, .. }
        | Luminaire::Spot { position, .. }
        | Luminaire::Warn { position, .. }
        | Luminaire::Profile { position, .. } => Some(position),
        _ => None,
    }
}

const RADIANCE: f64 = 3.0;
const ALBEDO: f64 = 0.6;
const HEIGHT: f64 = 0.75;
const HALF: f64 = 0.5;

/// What is seen of a floor straight below the middle of a square lamp: a closed form (Lambert's).
fn expected() -> f64 {
    ALBEDO * RADIANCE * 4.0 * corner_form_factor(HALF, HALF, HEIGHT)
}

/// A floor below a lamp, and a camera that sees the middle of it.
fn lamp_above_floor() -> Scene {
    lamp_and(|_, _| {})
}

fn lamp_and(more: impl Fn(&mut Build, u32)) -> Scene {
    let mut build = Build::new(Illumination::ONE_BOUNCE, look(Vec3::new(3.0, 0.8, 0.0), Vec3::ZERO));
    build.yfov(0.004);
    let floor = build.material("Floor", diffuse(ALBEDO as f32));
    let lamp = build.material("Lamp", diffuse(0.0));
    build.0.materials[lamp as usize].emission = glow(RADIANCE as f32);
    build.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, floor);
    let (half, height) = (HALF as f32, HEIGHT as f32);
    build.quad(Vec3::new(-half, height, -half), Vec3::X * 2.0 * half, Vec3::Z * 2.0 * half, lamp);
    more(&mut build, floor);
    build.finish()
}

fn methods() -> [Settings; 4] {
    let keep = [halflight::plan::Omittable::LightSamples];
    [
        small(16, 16, 1),
        // Without the closed form all light comes by connections.
        Settings { keep: keep.into_iter().collect(), ..small(16, 16, 1) },
        Settings { method: Method::Path, samples: 16, ..small(16, 16, 1) },
        Settings { method: Method::PathPlain, samples: 256, ..small(16, 16, 1) },
    ]
}

#[test]
fn a_lamp_lights_wherever_zero_is() {
    let scene = lamp_above_floor();
    // From the lamp's own plane to where its coordinates are as large as the way.
    for below in [0.0, 1e-9, 1e-5, 1e-3, 0.02, -0.05, 0.1, 0.75] {
        let here = placed(&scene, DVec3::new(0.0, HEIGHT - below, 0.0), DQuat::IDENTITY, 1.0);
        for settings in methods().into_iter().take(if below == 0.0 { 4 } else { 3 }) {
            measure(here.clone(), settings, 64).must_be(expected(), 0.001);
        }
    }
}

#[test]
fn a_lamp_does_not_light_itself_however_it_is_turned() {
    // All that is seen is the lamp, which reflects: in its own plane no light arrives.
    let mut build = Build::new(Illumination::ONE_BOUNCE, look(Vec3::new(0.3, -3.0, 0.2), Vec3::ZERO));
    let lamp = build.material("Lamp", diffuse(0.9));
    build.0.materials[lamp as usize].emission = glow(1.0);
    build.quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, lamp);
    let scene = build.finish();
    for number in 0..24 {
        let here = somewhere(&scene, number);
        for settings in methods().into_iter().take(3) {
            measure(here.clone(), settings, 4).must_be(1.0, 1e-5);
        }
    }
}

#[test]
fn a_lamp_in_the_plane_of_a_ceiling_lights() {
    // Of surfaces that coincide the first is met; loaders put lamps first.
    let scene = lamp_and(|build, white| {
        let height = HEIGHT as f32;
        build.quad(Vec3::new(-2.0, height, -2.0), Vec3::X * 4.0, Vec3::Z * 4.0, white);
    });
    for up in [0.0, 0.3, HEIGHT, 7.0] {
        let here = placed(&scene, DVec3::new(0.1, up, 0.0), DQuat::IDENTITY, 1.0);
        for settings in methods() {
            measure(here.clone(), settings, 64).must_be(expected(), 0.001);
        }
    }
}

#[test]
fn a_lamp_lights_however_the_scene_is_turned_and_whatever_its_size() {
    let scene = lamp_above_floor();
    for number in 0..24 {
        let here = somewhere(&scene, number);
        for settings in methods().into_iter().take(3) {
            measure(here.clone(), settings, 64).must_be(expected(), 0.001);
        }
    }
}
