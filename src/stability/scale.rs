//! Scenes that are tiny, huge, or far away.

use super::build::{Build, diffuse, film, look, rendered};
use super::{Case, Check, Effort, Run};
use crate::film::{Film, Layer};
use crate::measure::{Estimate, agreement};
use crate::scene::{Illumination, Scene};
use base64::Engine as _;
use glam::Vec3;
use serde_json::json;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "scaled",
        promise: "a scene scaled by 1e-6 … 1e6 is the same picture",
        run: Run::AtOnce(scaled),
    },
    Case {
        name: "far-away",
        promise: "a scene moved 1e5 and 1e9 m away is the same picture",
        run: Run::AtOnce(far_away),
    },
];

/// A room with a lamp and a block, every length times `scale`.
fn room(scale: f32) -> Scene {
    let mut build = Build::new(
        Illumination::GLOBAL,
        look(scale * Vec3::new(0.4, 0.5, 0.8), scale * Vec3::new(-0.3, -0.4, -1.0), 1.2),
    );
    let wall = build.material("Wall", diffuse(0.7));
    let lamp = build.glowing(0.0, 3.0);
    build.room(scale * Vec3::new(-1.0, -1.0, -1.25), scale * Vec3::new(1.0, 1.0, 1.25), wall);
    build.level(scale * 0.75, scale * 0.25, false, lamp);
    build.level(scale * -0.25, scale * 0.3, true, wall);
    build.finish()
}

const PASSES: u32 = 24;

fn picture(scale: f32) -> Result<Film, String> {
    Ok(rendered(room(scale), film(24, 24, 5000), PASSES)?.film().clone())
}

/// How two pictures compare, in words.
pub(super) fn compare(a: &Film, b: &Film) -> String {
    let differing =
        a.mean(Layer::Visible).iter().zip(&b.mean(Layer::Visible)).filter(|(a, b)| a != b).count();
    if differing == 0 {
        return "the same bits".into();
    }
    match (Estimate::from_film(a), Estimate::from_film(b)) {
        (Some(a), Some(b)) if agreement(&a, &b, None).accepted() => "the same within noise".into(),
        (Some(a), Some(b)) => format!("{:?}", agreement(&a, &b, None)),
        _ => "too few passes".into(),
    }
}

fn scaled(_: Effort) -> Vec<Check> {
    let one = match picture(1.0) {
        Ok(one) => one,
        Err(why) => return vec![Check::fact("scale 1", "an image", why)],
    };
    let powers_of_two = [-20, 20].map(|e| (2.0_f32.powi(e), "the same bits"));
    let others = [1e-6, 1e-3, 1e3, 1e6].map(|scale| (scale, "the same within noise"));
    powers_of_two
        .into_iter()
        .chain(others)
        .map(|(scale, expected)| {
            let got = picture(scale).map_or_else(|why| why, |picture| compare(&picture, &one));
            Check::fact(format!("scale {scale:e}"), expected, got)
        })
        .collect()
}

/// A lit floor in a glTF file, everything under one node at `x`.
pub(super) fn far_file(x: f64) -> serde_json::Value {
    let corners: [[f32; 3]; 4] = [[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]];
    let triangles: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let mut bytes: Vec<u8> = corners.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend(triangles.iter().flat_map(|i| i.to_le_bytes()));
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 683.0 }] } },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "translation": [x, 0.0, 0.0], "children": [1, 2, 3] },
            { "mesh": 0 },
            { "camera": 0, "translation": [0.0, 1.0, 0.0], "rotation": [-0.707_106_77, 0.0, 0.0, 0.707_106_77] },
            { "translation": [0.3, 0.7, 0.2], "extensions": { "KHR_lights_punctual": { "light": 0 } } }
        ],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.9, "znear": 0.01 } }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0 } }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1.0, 0.0, -1.0], "max": [1.0, 0.0, 1.0] },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" }
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 12 }
        ],
        "buffers": [{ "byteLength": 60, "uri": format!("data:application/octet-stream;base64,{data}") }]
    })
}

/// What such a file shows.
fn far_picture(file: &serde_json::Value) -> Result<Vec<Vec3>, String> {
    let folder = tempfile::tempdir().map_err(|why| why.to_string())?;
    let path = folder.path().join("far.gltf");
    std::fs::write(&path, file.to_string()).map_err(|why| why.to_string())?;
    let scene = Scene::load(&path).map_err(|why| why.to_string())?;
    Ok(rendered(scene, film(32, 32, 1000), 2)?.film().mean(Layer::Visible))
}

fn far_away(_: Effort) -> Vec<Check> {
    far_from_home(&[1e5, 1e9], far_file)
}

/// Pictures of a file whose contents lie at x, beside that at zero.
pub(super) fn far_from_home(places: &[f64], file: fn(f64) -> serde_json::Value) -> Vec<Check> {
    let near = match far_picture(&file(0.0)) {
        Ok(near) => near,
        Err(why) => return vec![Check::fact("at home", "an image", why)],
    };
    places
        .iter()
        .map(|&x| {
            let got = far_picture(&file(x)).map_or_else(
                |why| why,
                |far| {
                    // glTF stores places in f32, the light's and the camera's among them, and adds them in f64: what
                    // is left of a millimetre at 1e9 m is 1e-7 m.
                    let worst = far.iter().zip(&near).map(|(a, b)| (*a / *b - 1.0).abs().max_element());
                    let worst = worst.fold(0.0, f32::max);
                    if worst < 1e-5 { "within 1e-5".into() } else { format!("a pixel is off by {worst:e}") }
                },
            );
            Check::fact(format!("{x:e} m"), "within 1e-5", got)
        })
        .collect()
}
