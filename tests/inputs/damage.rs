//! What must hold for any bytes given as a scene, as a picture or as the state of a render. Tests run it on damaged files, and so do the fuzz targets in
//! `fuzz/`.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use halflight::atlas::{Atlas, AtlasSums};
use halflight::error::Error;
use halflight::film::{Film, Header, Layer, StateFile, StateHead, read_exr, write_state, write_state_with};
use halflight::scene::{Choice, Pose, Scene};
use serde_json::json;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A file of these bytes in a folder of its own.
fn file(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    (folder, path)
}

/// They are read as a sound scene, or refused in one line.
///
/// # Panics
/// Where neither is so.
pub fn scene(bytes: &[u8]) {
    let name = if bytes.starts_with(b"glTF") { "damaged.glb" } else { "damaged.gltf" };
    let (_folder, path) = file(name, bytes);
    match Scene::load(&path) {
        Ok(scene) => sound(&scene),
        Err(error) => one_line(&error),
    }
    let pose = Some(Pose { animation: None, seconds: 0.4 });
    match Scene::load_chosen(path, &Choice { pose, ..Choice::default() }) {
        Ok(loaded) => sound(&loaded.scene),
        Err(error) => one_line(&error),
    }
}

/// They are unpacked as whatever their first four bytes choose, or refused in one line: the codec, how many elements of which
/// length, the filter. The rest is the stream.
///
/// # Panics
/// Where neither is so.
pub fn packed(bytes: &[u8]) {
    let Some(([codec, count, stride, filter], stream)) = bytes.split_first_chunk() else { return };
    let pick = |from: &[&'static str], by: u8| from[usize::from(by) % from.len()];
    let stride = 4 * (1 + u64::from(*stride % 16));
    let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(stream));
    let accessor =
        |kind: &str, component: u32| json!({ "type": kind, "componentType": component, "count": count });
    let mut json = json!({
        "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "buffers": [{ "byteLength": stream.len(), "uri": uri }],
        "bufferViews": [{ "buffer": 0, "byteLength": stream.len() }],
        "accessors": [accessor("VEC3", 5126), accessor("SCALAR", 5125), accessor("VEC3", 5126)],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 2 }, "indices": 1 }] }],
        "materials": [{ "emissiveFactor": [1, 1, 1] }],
    });
    if codec % 4 == 0 {
        json["meshes"][0]["primitives"][0]["extensions"] = json!({ "KHR_draco_mesh_compression": {
            "bufferView": 0, "attributes": { "POSITION": filter % 8, "NORMAL": filter / 8 % 8 } } });
    } else {
        let mode = pick(&["ATTRIBUTES", "TRIANGLES", "INDICES"], codec % 4 - 1);
        let filter = pick(&["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"], *filter);
        json["extensionsRequired"] = json!(["KHR_meshopt_compression"]);
        json["bufferViews"][0]["extensions"] = json!({ "KHR_meshopt_compression": { "buffer": 0,
            "byteLength": stream.len(), "byteStride": stride, "count": count, "mode": mode, "filter": filter } });
        for accessor in 0..3 {
            json["accessors"][accessor]["bufferView"] = json!(0);
        }
    }
    scene(json.to_string().as_bytes());
}

/// No number that is not finite, no index out of bounds.
fn sound(scene: &Scene) {
    let mesh = &scene.mesh;
    assert!(mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite()));
    assert_eq!(mesh.positions.len(), mesh.normals.len());
    assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < mesh.positions.len()));
    for triangle in 0..mesh.triangles.len() as u32 {
        assert!(mesh.normal(triangle).is_normalized() && scene.material_of(triangle).lobes.len() < 4);
    }
    assert!(scene.luminaires.iter().all(|l| l.power(1.0).is_finite() || l.is_delta()));
    assert!(scene.camera.position.is_finite() && scene.camera.right.is_normalized());
}

/// They are read as layers of as many pixels as they say, perhaps as an atlas too, or refused in one line.
///
/// # Panics
/// Where neither is so.
pub fn exr(bytes: &[u8]) {
    let (_folder, path) = file("damaged.exr", bytes);
    match read_exr(&path) {
        Ok(image) => {
            let pixels = image.width as usize * image.height as usize;
            assert!(
                !image.layers.is_empty() && image.layers.iter().all(|(_, values)| values.len() == pixels)
            );
            if let Err(why) = Atlas::from_image(&image) {
                assert!(!why.is_empty() && !why.contains('\n'), "{why:?}");
            }
        }
        Err(error) => one_line(&error),
    }
}

fn one_line(error: &Error) {
    let text = error.to_string();
    assert!(error.exit_code() == 2 && text.contains("damaged.") && !text.contains('\n'), "{text:?}");
}

/// The largest film that damaged states are added to, in pixels.
const MOST_PIXELS: u64 = 1 << 16;

/// They are read as a state whose sums come back as they are, or refused in one line; also with checksums that fit.
///
/// # Panics
/// Where neither is so.
pub fn state(bytes: &[u8]) {
    as_they_are(bytes);
    as_they_are(&with_checksums(bytes));
}

fn as_they_are(bytes: &[u8]) {
    let (folder, path) = file("damaged.halflight", bytes);
    let state = match StateFile::open(&path) {
        Ok(state) => state,
        Err(error) => return one_line(&error),
    };
    let head = state.head().clone();
    if u64::from(head.width) * u64::from(head.height) > MOST_PIXELS {
        return;
    }
    let mut film = Film::new(head.width, head.height, &head.layers);
    if head.annex.is_some() {
        match state.add_to_and_leave(&mut film).and_then(AtlasSums::of_annex) {
            Ok(atlas) => comes_back(&atlas, &head, &film),
            Err(error) => one_line(&error),
        }
        return;
    }
    if let Err(error) = state.add_to(&mut film) {
        return one_line(&error);
    }
    film.standard_error();
    film.relative_bias();
    head.layers.iter().for_each(|layer| drop(film.mean(*layer)));
    let again = folder.path().join("again.halflight");
    write_state(&again, &head, &film).expect("what was read is written");
    let mut read = Film::new(head.width, head.height, &head.layers);
    StateFile::open(&again).and_then(|state| state.add_to(&mut read)).expect("what was written is read");
    let both = [&film, &read].map(|film| film.mean(Layer::Visible));
    let bits = both.map(|plane| plane.iter().map(|v| v.to_array().map(f32::to_bits)).collect::<Vec<_>>());
    assert!(bits[0] == bits[1], "other sums came back");
}

/// The sums of an atlas are those that were read when they are stored again, and make an atlas whose file can be described.
fn comes_back(atlas: &AtlasSums, head: &StateHead, film: &Film) {
    let mut header = Header::new();
    assert!(!atlas.layers(&mut header).is_empty() && header.entries.len() > 3);
    let folder = tempfile::tempdir().expect("a folder");
    let [once, twice] = ["once", "twice"].map(|name| folder.path().join(name));
    let store = |path: &Path, atlas: &AtlasSums| {
        atlas.as_annex(|annex| write_state_with(path, head, film, annex)).expect("what was read is written");
        std::fs::read(path).expect("there")
    };
    let bytes = store(&once, atlas);
    let mut read = Film::new(head.width, head.height, &head.layers);
    let state = StateFile::open(&once).and_then(|state| state.add_to_and_leave(&mut read));
    let again = state.and_then(AtlasSums::of_annex).expect("what was written is read");
    assert!(store(&twice, &again) == bytes, "other sums came back");
}

/// Bytes before the first block of a state: its name and its version.
const BEFORE_BLOCKS: usize = 20;

/// A state with the checksum that each of its blocks should have, as far as there are whole ones.
fn with_checksums(bytes: &[u8]) -> Vec<u8> {
    let mut mended = bytes.to_vec();
    let mut at = BEFORE_BLOCKS;
    while let Some(length) = mended.get(at..).and_then(<[u8]>::first_chunk) {
        let begin = at + 4;
        let end = begin + u32::from_le_bytes(*length) as usize;
        let Some(block) = mended.get(begin..end) else { break };
        let sum = block.iter().fold(0xcbf2_9ce4_8422_2325, |sum, byte| {
            (sum ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        let Some(place) = mended.get_mut(end..end + 8) else { break };
        place.copy_from_slice(&u64::to_le_bytes(sum));
        at = end + 8;
    }
    mended
}
