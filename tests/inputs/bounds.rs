//! Small files that ask for much, and files that lead elsewhere: refused in one line before anything is built or opened.

use crate::small::{Small, load_bytes, message};
use halflight::scene::{Choice, Scene};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

#[track_caller]
fn refused(small: Small, words: &[&str]) {
    let message = small.error();
    assert!(words.iter().all(|word| message.contains(word)), "{words:?} in {message}");
}

#[test]
fn zeros_that_are_many_are_counted_before_they_are_made() {
    // 16 million vertices without data, forty times: 1.9 kB that took 6 GB.
    let mut small = Small::new().with("/accessors/3/bufferView", Value::Null);
    small.json["accessors"][3]["count"] = json!(16_777_215);
    let primitive = json!({ "attributes": { "POSITION": 3 } });
    small.json["meshes"][1]["primitives"] = json!(vec![primitive; 40]);
    refused(small.clone(), &["triangles", "--max-triangles"]);
    // Vertices that no triangle has count too, and so do instances that are empty.
    let few = json!({ "attributes": { "POSITION": 3 }, "indices": 2 });
    small.json["meshes"][1]["primitives"] = json!(vec![few; 40]);
    refused(small, &["vertices", "--max-triangles"]);
    let mut lines = Small::new();
    lines.json["meshes"][1]["primitives"] = json!(vec![json!({ "attributes": {}, "mode": 1 }); 20_000]);
    refused(with_instances(lines, 20_000), &["triangles", "--max-triangles"]);
}

/// The quad's mesh under so many nodes more.
fn with_instances(mut small: Small, count: usize) -> Small {
    let nodes = small.json["nodes"].as_array_mut().expect("nodes");
    let first = nodes.len();
    nodes.extend((0..count).map(|_| json!({ "mesh": 1 })));
    small.json["scenes"][0]["nodes"] = json!([vec![0, 1, 2, 3], (first..first + count).collect()].concat());
    small
}

#[test]
fn instances_are_multiplied_before_they_are_made() {
    let mut small = Small::new();
    let strip = json!({ "attributes": { "POSITION": 3 }, "mode": 5, "material": 1 });
    small.json["meshes"][1]["primitives"] = json!(vec![strip; 5_000]);
    refused(with_instances(small, 20_000), &["200010004 triangles", "--max-triangles 50000000"]);
}

#[test]
fn the_limit_is_the_users_own() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("small.gltf");
    fs::write(&path, Small::new().embedded().json.to_string()).unwrap();
    let load = |most: u64| Scene::load_chosen(&path, &Choice { max_triangles: most, ..Choice::default() });
    let loaded = load(6).unwrap();
    assert_eq!((loaded.scene.mesh.triangles.len(), loaded.files), (6, vec![path.clone()]));
    let message = load(5).unwrap_err().to_string();
    assert!(message.contains("6 triangles") && message.contains("--max-triangles 5 "), "{message}");
}

/// A scene in a folder whose buffer is called so, and the folder.
fn external(uri: &str, more: impl FnOnce(&Path)) -> (TempDir, Result<Scene, halflight::error::Error>) {
    let folder = TempDir::new().expect("a folder");
    let small = Small::new().with("/buffers/0/uri", json!(uri));
    fs::write(folder.path().join("real.bin"), &small.binary).expect("written");
    fs::create_dir(folder.path().join("scene")).expect("made");
    more(&folder.path().join("scene"));
    let path = folder.path().join("scene/small.gltf");
    fs::write(&path, small.json.to_string()).expect("written");
    let scene = Scene::load(path);
    (folder, scene)
}

#[test]
fn one_file_under_many_names_is_read_once() {
    let folder = TempDir::new().unwrap();
    let mut small = Small::new();
    let mut binary = small.binary.clone();
    // 16 MB, two thousand times: 32 GB where each is a copy.
    binary.resize(16 << 20, 0);
    fs::write(folder.path().join("b.bin"), &binary).unwrap();
    let buffer = |i: usize| {
        let uri = ["b.bin", "./b.bin", "%62.bin", "././b.bin"][i % 4];
        json!({ "uri": uri, "byteLength": binary.len() })
    };
    small.json["buffers"] = json!((0..2_000).map(buffer).collect::<Vec<_>>());
    let path = folder.path().join("small.gltf");
    fs::write(&path, small.json.to_string()).unwrap();
    assert_eq!(Scene::load(&path).unwrap().mesh.triangles.len(), 6);
}

#[test]
fn a_buffer_that_is_longer_than_it_says_is_refused() {
    let padded = |bytes: usize| {
        let (_folder, scene) = external("long.bin", |folder| {
            let mut binary = Small::new().binary;
            binary.resize(binary.len() + bytes, 0);
            fs::write(folder.join("long.bin"), binary).unwrap();
        });
        scene
    };
    assert!(padded(0).is_ok() && padded(3).is_ok(), "padding to four bytes is usual");
    assert!(message("small.gltf", padded(4)).contains("longer than"));
}

#[cfg(unix)]
#[test]
fn links_lead_nowhere_but_into_the_folder() {
    use std::os::unix::fs::symlink;
    let (_folder, scene) = external("b.bin", |folder| symlink("../real.bin", folder.join("b.bin")).unwrap());
    assert!(message("small.gltf", scene).contains("leads out of the folder"));
    // A folder that is a link leads out as well.
    let (_folder, scene) = external("up/real.bin", |folder| symlink("..", folder.join("up")).unwrap());
    assert!(message("small.gltf", scene).contains("leads out of the folder"));
    let (_folder, scene) = external("b.bin", |folder| {
        fs::copy(folder.join("../real.bin"), folder.join("c.bin")).unwrap();
        symlink("c.bin", folder.join("b.bin")).unwrap();
    });
    assert!(scene.is_ok());
}

#[cfg(unix)]
#[test]
fn pipes_devices_and_folders_are_no_buffers_and_no_scenes() {
    let pipe = |path: &Path| {
        assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
    };
    let (folder, scene) = external("b.bin", |folder| pipe(&folder.join("b.bin")));
    assert!(message("small.gltf", scene).contains("a pipe or a device"));
    let (_folder, scene) = external("b", |folder| fs::create_dir(folder.join("b")).unwrap());
    assert!(message("small.gltf", scene).contains("no file"));
    pipe(&folder.path().join("pipe.glb"));
    assert!(message("pipe.glb", Scene::load(folder.path().join("pipe.glb"))).contains("a pipe"));
    assert!(message("zero", Scene::load("/dev/zero")).contains("a device"));
    assert!(message("scene", Scene::load(folder.path().join("scene"))).contains("is a folder"));
}

#[test]
fn other_formats_are_told_the_way() {
    let cases: [(&str, &[u8], &str); 9] = [
        ("a.obj", b"v 0 0 0\n", "OBJ"),
        ("a.blend", b"BLENDER-v280", "Blender"),
        ("a.fbx", b"Kaydara FBX Binary", "FBX"),
        ("a.usd", b"PXR-USDC", "USD"),
        ("a.usdz", b"PK\x03\x04", "USD"),
        ("a.STL", b"solid cube", "STL"),
        ("a.ply", b"ply\nformat ascii", "PLY"),
        ("a.dae", b"<?xml version", "Collada"),
        ("a.3ds", b"MM\0\0", "3ds"),
    ];
    for (name, bytes, format) in cases {
        let message = message(name, load_bytes(name, bytes));
        assert!(message.contains(format) && message.contains("Export > glTF 2.0"), "{message}");
    }
}

#[test]
fn a_hundred_thousand_names_are_read_at_once_and_told_in_a_line() {
    let mut small = Small::new();
    let many = 100_000;
    small.json["extensionsUsed"] = json!((0..many).map(|i| format!("EXT_{i}")).collect::<Vec<_>>());
    let materials = small.json["materials"].as_array_mut().unwrap();
    let skin = materials[0].clone();
    for i in 0..many {
        let mut material = skin.clone();
        material["name"] = json!(format!("M{i}"));
        material["extras"] = json!({ "illumination": [1.0, f64::from(i) / f64::from(many)] });
        materials.push(material);
    }
    let strip = |i: i32| json!({ "attributes": { "POSITION": 3 }, "mode": 5, "material": i });
    small.json["meshes"][1]["primitives"] = json!((2..many + 2).map(strip).collect::<Vec<_>>());
    let nodes = small.json["nodes"].as_array_mut().unwrap();
    nodes.extend(
        (0..many).map(|i| json!({ "name": format!("N{i}"), "skin": 0, "extensions": { "EXT_x": {} } })),
    );
    let first = nodes.len() - many as usize;
    small.json["scenes"][0]["nodes"] = json!([vec![0, 1, 2, 3], (first..first + 100_000).collect()].concat());
    let scene = small.good();
    assert!(
        scene.notes.len() < 20 && scene.notes.iter().all(|note| note.len() < 400),
        "{:?}",
        scene.notes.len()
    );
    assert!(scene.notes.iter().any(|note| note.contains("EXT_0, EXT_1") && note.contains("99992 more")));
    assert!(scene.describe_illumination().len() < 1000);
}
