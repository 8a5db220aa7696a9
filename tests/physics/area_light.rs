//! A square luminaire above a plane: irradiance below its centre, and what shadows do to it.

use crate::support::{Build, diffuse, glow, look, measure, small};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{Mat3, Mat4, Vec3};
use halflight::film::Layer;
use halflight::plan::{Direct, Method, Settings};
use halflight::render::Render;
use halflight::scene::{Backs, Camera, Illumination, Scene};
use serde_json::{Value, json};
use std::f64::consts::PI;
use tempfile::TempDir;

const RADIANCE: f64 = 3.0;
const HALF: f64 = 0.5;
const HEIGHT: f64 = 0.75;
const ALBEDO: f64 = 0.6;

/// Form factor from a point to a parallel rectangle a × b whose corner lies at distance h straight above it (Lambert).
pub fn corner_form_factor(a: f64, b: f64, h: f64) -> f64 {
    let (x, y) = (a / h, b / h);
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / p * (y / p).atan() + y / q * (x / q).atan()) / (2.0 * PI)
}

/// Radiance of the floor straight below the centre.
fn expected() -> f64 {
    ALBEDO * RADIANCE * 4.0 * corner_form_factor(HALF, HALF, HEIGHT)
}

fn scene(illumination: Illumination, blocker: bool) -> Scene {
    build(illumination, blocker).finish()
}

fn build(illumination: Illumination, blocker: bool) -> Build {
    let mut build = Build::new(illumination, look(Vec3::new(3.0, 0.8, 0.0), Vec3::ZERO));
    // A camera so far off and narrow that the form factor is constant over what it sees.
    build.yfov(0.004);
    let floor = build.material("Floor", diffuse(ALBEDO as f32));
    let lamp = build.material("Lamp", diffuse(0.0));
    build.0.materials[lamp as usize].emission = glow(RADIANCE as f32);
    build.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, floor);
    let (half, height) = (HALF as f32, HEIGHT as f32);
    build.quad(Vec3::new(-half, height, -half), Vec3::X * 2.0 * half, Vec3::Z * 2.0 * half, lamp);
    if blocker {
        build.quad(Vec3::new(-half, 0.5, -half), Vec3::Z * 2.0 * half, Vec3::X * 2.0 * half, floor);
    }
    build
}

#[test]
fn connection_gives_the_irradiance_of_a_rectangle() {
    for illumination in [Illumination::LOCAL, Illumination::ONE_BOUNCE] {
        measure(scene(illumination, false), small(16, 16, 1), 64).must_be(expected(), 0.001);
    }
}

#[test]
fn a_surface_is_seen_however_dark_it_is() {
    let albedo = 1e-30_f32;
    let mut dark = scene(Illumination::GLOBAL, false);
    dark.materials[0].lobes = vec![(1.0, diffuse(albedo))];
    dark.illuminate(None, &[]).expect("no names");
    let seen = expected() / ALBEDO * f64::from(albedo);
    for settings in [small(16, 16, 1), Settings { method: Method::Path, samples: 16, ..small(16, 16, 1) }] {
        measure(dark.clone(), settings, 64).must_be(seen, 0.001);
    }
}

#[test]
fn photons_alone_give_it_too() {
    let settings = Settings { direct: Direct::Photons, indirect_radius: 50.0, ..small(8, 8, 200_000) };
    for illumination in [Illumination::LOCAL, Illumination::ONE_BOUNCE] {
        measure(scene(illumination, false), settings.clone(), 96).must_be(expected(), 0.002);
    }
}

#[test]
fn an_opaque_sheet_shadows_and_a_shadowless_one_does_not() {
    measure(scene(Illumination::LOCAL, true), small(16, 16, 1), 64).must_be(expected(), 0.001);
    let dark = measure(scene(Illumination::ONE_BOUNCE, true), small(16, 16, 1), 8);
    assert_eq!(dark.mean, 0.0);
}

/// A sheet in the way of camera or light, which turns its back to it.
fn behind_a_sheet(backs: Backs, of_light: bool) -> Scene {
    let mut build = build(Illumination::ONE_BOUNCE, false);
    let sheet = build.material("Sheet", diffuse(0.9));
    build.0.materials[sheet as usize].backs = backs;
    if of_light {
        build.quad(Vec3::new(-1.0, 0.5, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, sheet);
    } else {
        build.quad(Vec3::new(1.5, 0.1, -1.0), Vec3::Z * 2.0, Vec3::Y, sheet);
    }
    build.finish()
}

#[test]
fn the_eye_looks_through_backs_where_light_does_not_pass() {
    let path = Settings { method: Method::Path, samples: 16, ..small(16, 16, 1) };
    for settings in [small(16, 16, 1), path] {
        measure(behind_a_sheet(Backs::Unseen, false), settings.clone(), 64).must_be(expected(), 0.001);
        for (backs, of_light) in [(Backs::Seen, false), (Backs::Seen, true), (Backs::Unseen, true)] {
            assert_eq!(measure(behind_a_sheet(backs, of_light), settings.clone(), 4).mean, 0.0, "{backs:?}");
        }
    }
}

#[test]
fn half_a_shadow_lets_half_through() {
    let half = Illumination::Square { s: 0.0, t: 0.5 };
    measure(scene(half, true), small(16, 16, 1), 64).must_be(0.5 * expected(), 0.001);
    let settings = Settings { direct: Direct::Photons, indirect_radius: 50.0, ..small(8, 8, 200_000) };
    measure(scene(half, true), settings, 128).must_be(0.5 * expected(), 0.002);
}

#[test]
fn no_pixel_behind_a_fence_is_below_zero() {
    // Half shadows everywhere, of bars as thin as a pixel.
    let mut build = build(Illumination::ONE_BOUNCE, false);
    build.0.camera = Some(look(Vec3::new(40.0, 20.0, 0.0), Vec3::ZERO));
    let bar = build.material("Bar", diffuse(0.5));
    for i in 0..16_u8 {
        let x = -1.5 + 0.2 * f32::from(i);
        build.quad(Vec3::new(x, 0.15, -1.5), Vec3::Z * 3.0, Vec3::X * 0.03, bar);
    }
    let scene = build.finish();
    let mut render = Render::new(scene, small(96, 96, 1), &[Layer::Visible]).expect("a render");
    for _ in 0..8 {
        render.pass();
    }
    let picture = render.film().mean(Layer::Visible);
    assert!(picture.iter().all(|pixel| pixel.min_element() >= 0.0));
    let lit = picture.iter().filter(|pixel| pixel.x > 0.1 * expected() as f32).count();
    assert!(lit > picture.len() / 12, "{lit}");
}

#[test]
fn local_keeps_attached_shadows() {
    // The half of a ball that faces away from the light stays dark: f_opaque is one-sided, paper eq. 6.
    let mut build = Build::new(Illumination::LOCAL, look(Vec3::new(0.0, -3.0, 0.0), Vec3::ZERO));
    let ball = build.material("Ball", diffuse(0.8));
    let lamp = build.material("Lamp", diffuse(0.0));
    build.0.materials[lamp as usize].emission = glow(5.0);
    build.sphere(Vec3::ZERO, 0.5, (64, 32), false, ball);
    build.quad(Vec3::new(-0.2, 2.0, -0.2), Vec3::X * 0.4, Vec3::Z * 0.4, lamp);
    assert_eq!(measure(build.finish(), small(16, 16, 1), 4).mean, 0.0);
}

/// The same floor below the middle of a lamp that looks down from a file.
fn of_file(lamp: Value) -> Scene {
    let floor = [[-2.0, 0.0, 2.0], [2.0, 0.0, 2.0], [-2.0, 0.0, -2.0], [2.0, 0.0, -2.0_f32]];
    let bytes: Vec<u8> = floor.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let Camera { right, up, forward, position, .. } = look(Vec3::new(3.0, 0.8, 0.0), Vec3::ZERO);
    let turn = Mat3::from_cols(right, up, -forward);
    let eye = Mat4::from_translation(position) * Mat4::from_mat3(turn);
    let down = Mat4::from_translation(Vec3::Y * HEIGHT as f32) * Mat4::from_rotation_x(-0.5 * PI as f32);
    let mut lamp = lamp;
    lamp["matrix"] = json!(down.to_cols_array());
    let file = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [{ "mesh": 0 }, lamp, { "camera": 0, "matrix": eye.to_cols_array() }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "mode": 5, "material": 0 }] }],
        "materials": [{ "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorFactor": [ALBEDO, ALBEDO, ALBEDO, 1] },
            "extensions": { "KHR_materials_specular": { "specularFactor": 0 } } }],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": INTENSITY }] } },
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.004, "znear": 0.1 } }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4,
            "min": [-2, 0, -2], "max": [2, 0, 2] }],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
        "buffers": [{ "byteLength": bytes.len(),
            "uri": format!("data:application/octet-stream;base64,{}", STANDARD.encode(&bytes)) }]
    });
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("lamp.gltf");
    std::fs::write(&path, file.to_string()).expect("written");
    Scene::load(path).expect("a good file")
}

/// W sr⁻¹ of the point light that the lamps stand for, or π of it, or 4π of it, W.
const INTENSITY: f64 = 2.0;
const RADIUS: f64 = 0.4;

/// Irradiance (W m⁻²) below the middle of the lamp, by connections and along paths.
fn must_light(lamp: &Value, irradiance: f64, rounding: f64) {
    let path = Settings { method: Method::Path, samples: 16, ..small(16, 16, 1) };
    for (settings, passes) in [(small(16, 16, 1), 64), (path, 16)] {
        measure(of_file(lamp.clone()), settings, passes).must_be(ALBEDO / PI * irradiance, rounding);
    }
}

/// The same by so many photons a pass. Light falls off to the sides, so disks that are too wide miss some of it.
fn must_shoot(lamp: &Value, photons: u32, irradiance: f64, rounding: f64) {
    let settings = Settings { direct: Direct::Photons, indirect_radius: 16.0, ..small(8, 8, photons) };
    measure(of_file(lamp.clone()), settings, 96).must_be(ALBEDO / PI * irradiance, rounding);
}

/// A light with these extras.
fn light(extras: Value) -> Value {
    json!({ "extras": extras, "extensions": { "KHR_lights_punctual": { "light": 0 } } })
}

#[test]
fn a_disk_of_a_file_lights_what_is_below_it() {
    // π L r² / (r² + h²), and L is I / π r², or P / π² r².
    let irradiance = INTENSITY / (RADIUS * RADIUS + HEIGHT * HEIGHT);
    must_light(&light(json!({ "disk": RADIUS })), irradiance, 0.001);
    must_shoot(&light(json!({ "disk": RADIUS })), 100_000, irradiance, 0.002);
    must_light(&json!({ "extras": { "disk": RADIUS, "power": PI * INTENSITY } }), irradiance, 0.001);
}

#[test]
fn a_sphere_of_a_file_lights_as_the_point_in_its_middle() {
    // π L r² / h², and L is I / π r², or P / 4π² r².
    let irradiance = INTENSITY / (HEIGHT * HEIGHT);
    must_light(&light(json!({ "sphere": RADIUS })), irradiance, 0.003);
    must_shoot(&light(json!({ "sphere": RADIUS })), 500_000, irradiance, 0.003);
    must_light(&json!({ "extras": { "sphere": RADIUS, "power": 4.0 * PI * INTENSITY } }), irradiance, 0.003);
}

#[test]
fn a_rectangle_of_a_file_lights_what_is_below_it() {
    let (width, height) = (0.6, 1.4);
    let form = 4.0 * corner_form_factor(0.5 * width, 0.5 * height, HEIGHT);
    let lamp = json!({ "extras": { "area": [width, height], "radiance": RADIANCE } });
    must_light(&lamp, PI * RADIANCE * form, 0.001);
    must_light(&light(json!({ "area": [width, height] })), PI * INTENSITY / (width * height) * form, 0.001);
}
