//! Which way pictures of a sky lie: as Blender's World does about a scene that it exports to glTF. The numbers are of
//! docs/blender/orientation.py, by Cycles of Blender 4.5.15.

use crate::small::Small;
use exr::prelude::write_rgb_file;
use glam::{Quat, Vec3};
use halflight::film::Layer;
use halflight::plan::Settings;
use halflight::render::Render;
use halflight::scene::{Choice, Scene, Surroundings};
use serde_json::json;
use std::fs;
use std::path::Path;

/// Directions in the exported file, and what Cycles sees there of the patches. In Blender they are ±x, ±y and nearly ±z.
const PATCHES: [([f32; 3], [f32; 3]); 6] = [
    ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
    ([-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
    ([0.0, 0.0, -1.0], [1.0, 0.0, 0.0]),
    ([0.0, 0.0, 1.0], [1.0, 1.0, 0.0]),
    ([0.03, 0.99875, -0.04], [1.0, 1.0, 1.0]),
    ([0.03, -0.99875, -0.04], [1.0, 0.0, 1.0]),
];

/// The same for ramps: how far from the left and from the top of the picture Cycles sees.
const RAMPS: [([f32; 3], [f32; 2]); 10] = [
    ([1.0, 0.0, 0.0], [0.5, 0.5]),
    ([-1.0, 0.0, 0.0], [0.5, 0.5]), // the seam: half of either end
    ([0.0, 0.0, -1.0], [0.25, 0.5]),
    ([0.0, 0.0, 1.0], [0.75, 0.5]),
    ([0.03, 0.99875, -0.04], [0.3524, 0.0159]),
    ([0.03, -0.99875, -0.04], [0.3524, 0.9841]),
    ([0.48, 0.64, -0.6], [0.3574, 0.2789]),
    ([0.8, -0.36, 0.48], [0.586, 0.6172]),
    ([-0.48, 0.6, 0.64], [0.8524, 0.2952]),
    ([-0.6, -0.48, -0.64], [0.1301, 0.6594]),
];

/// 8 × 4 texels: white above, magenta below, and from the left green, red, blue, yellow, green.
fn write_patches(path: &Path) {
    let sides = [[0, 255, 0], [255, 0, 0], [0, 0, 255], [255, 255, 0]];
    let ring: Vec<u8> = (0..8_usize).flat_map(|x| sides[x.div_ceil(2) % 4]).collect();
    let bytes = [[255; 24].to_vec(), ring.clone(), ring, [255, 0, 255].repeat(8)].concat();
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 8, 4);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&bytes)).expect("encoded");
    fs::write(path, file).expect("written");
}

/// What a camera in free air sees along a direction of the file.
fn seen(folder: &Path, to: Vec3, around: &Surroundings) -> Vec3 {
    let turn = Quat::from_rotation_arc(Vec3::NEG_Z, to.normalize()).to_array();
    let file = Small::new()
        .with("/nodes/3/rotation", json!(turn))
        .with("/nodes/3/translation", json!([70, 50, 90]))
        .with("/cameras/0/perspective/yfov", json!(0.001));
    let path = folder.join("eye.gltf");
    fs::write(&path, file.embedded().json.to_string()).expect("written");
    let choice = Choice { around: around.clone(), ..Choice::default() };
    let scene = Scene::load_chosen(&path, &choice).unwrap_or_else(|e| panic!("{e}")).scene;
    let settings = Settings { width: 4, height: 4, paths: Some(1000), ..Settings::default() };
    let mut render = Render::new(scene, settings, &[Layer::Visible]).expect("an image");
    (0..4).for_each(|_| render.pass());
    render.film().mean_colour().as_vec3()
}

fn around(path: &Path) -> Surroundings {
    Surroundings {
        source: Some(path.to_string_lossy().parse().expect("a picture")),
        ..Surroundings::default()
    }
}

#[test]
fn six_patches_are_where_blenders_world_has_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("patches.png");
    write_patches(&path);
    for (to, colour) in PATCHES {
        let found = seen(folder.path(), to.into(), &around(&path));
        assert!((found - Vec3::from(colour)).abs().max_element() < 0.01, "{to:?}: {found}, not {colour:?}");
    }
}

#[test]
fn between_the_axes_a_picture_is_where_blenders_world_has_it_to_a_thousandth() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("ramps.exr");
    write_rgb_file(&path, 64, 32, |x, y| ((x as f32 + 0.5) / 64.0, (y as f32 + 0.5) / 32.0, 0.0_f32))
        .expect("written");
    for (to, [u, v]) in RAMPS {
        let found = seen(folder.path(), to.into(), &around(&path));
        let off = (found - Vec3::new(u, v, 0.0)).abs();
        // A thousandth of a radian is seen, more of the picture near its poles and its seam.
        let allowed = if to[0] == -1.0 { 0.02 } else { 1e-3 };
        assert!(off.x.max(off.y) < allowed, "{to:?}: {found}, not {u}, {v}");
    }
}

#[test]
fn a_rotation_is_counter_clockwise_as_seen_from_above() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("patches.png");
    write_patches(&path);
    let blue = Vec3::Z;
    for (rotation, to) in
        [(90.0, Vec3::NEG_Z), (-90.0, Vec3::Z), (180.0, Vec3::NEG_X), (360.0, Vec3::X), (-630.0, Vec3::NEG_Z)]
    {
        let turned = Surroundings { rotation: Some(rotation), ..around(&path) };
        assert!((seen(folder.path(), to, &turned) - blue).abs().max_element() < 0.01, "{rotation}");
    }
}
