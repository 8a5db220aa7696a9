//! What can be wrong with a file: one line each, which names the thing. Never a panic.

use crate::small::{Small, load_bytes, message};
use glam::Vec3;
use halflight::scene::Scene;
use serde_json::{Value, json};
use tempfile::TempDir;

fn expect(small: Small, needles: &[&str]) {
    let message = small.error();
    for needle in needles {
        assert!(message.contains(needle), "`{needle}` is not in: {message}");
    }
}

#[test]
fn files_that_are_no_scenes() {
    let folder = TempDir::new().unwrap();
    let missing = folder.path().join("missing.glb");
    assert!(message("missing.glb", Scene::load(&missing)).contains("check the path"));
    let directory = folder.path().join("directory.glb");
    std::fs::create_dir(&directory).unwrap();
    assert!(message("directory.glb", Scene::load(&directory)).contains("directory"));

    let say = |name: &str, bytes: &[u8], needle: &str| {
        let message = message(name, load_bytes(name, bytes));
        assert!(message.contains(needle), "{message}");
    };
    say("empty.glb", b"", "is empty");
    say("blank.gltf", b" \n ", "not a glTF file");
    say("text.gltf", b"hello", "not a glTF file");
    say("image.glb", b"\x89PNG\r\n\x1a\n", "not a glTF file");
    say("other.gltf", b"{\"a\": 1}", "asset");
    say("half.gltf", b"{\"asset\": {\"version\": \"2.0\"", "damaged");
    say("utf16.gltf", b"\xFF\xFE{\0", "not a glTF file");
    say("old.gltf", b"{\"asset\": {\"version\": \"1.0\"}}", "glTF 1.0");
    say("new.gltf", b"{\"asset\": {\"version\": \"2.0\", \"minVersion\": \"3.0\"}}", "glTF 3.0");
    say("deep.gltf", "[".repeat(100_000).replacen('[', "{\"asset\":[", 1).as_bytes(), "damaged");
    say("nothing.gltf", b"{\"asset\": {\"version\": \"2.0\"}}", "no scene");
    say("bom.gltf", b"\xEF\xBB\xBF{\"asset\": {\"version\": \"2.0\"}}", "no scene");

    let glb = Small::new().glb();
    assert!(load_bytes("good.glb", &glb).is_ok());
    for length in [5, 12, 16, 20, 100, glb.len() - 1] {
        say("cut.glb", &glb[..length], "truncated");
    }
    let mut other = glb.clone();
    other[4] = 1;
    say("version.glb", &other, "version 1");
    let mut short = glb.clone();
    short[8..12].copy_from_slice(&5_u32.to_le_bytes());
    say("short.glb", &short, "no JSON chunk");
}

#[test]
fn documents_without_what_a_picture_needs() {
    let no_light = Small::new().with("/scenes/0/extras", json!({ "environment": "none" }));
    let told = ["nothing emits light", "--environment studio"];
    expect(no_light.clone().with("/nodes/2/extensions", Value::Null), &told);
    expect(no_light.with("/extensions/KHR_lights_punctual/lights/0/intensity", json!(0)), &told);
    expect(Small::new().with("/scenes/0/nodes", json!([2, 3])), &["no triangles"]);
    expect(Small::new().with("/scene", json!(7)), &["default scene"]);
    expect(Small::new().with("/scenes/0/nodes", json!([9])), &["node 9"]);
    let scene = Small::new().with("/scene", Value::Null).good();
    assert_eq!(scene.mesh.triangles.len(), 6);

    let blind = Small::new().with("/nodes/3/camera", Value::Null).good();
    assert!(blind.notes.iter().any(|n| n.contains("no camera")), "{:?}", blind.notes);
    // From the front (+Z) and 15 to 20 degrees above, all of the bounding sphere on a film of any shape.
    let forward = blind.camera.forward;
    assert!(forward.x == 0.0 && forward.z < 0.0 && (15.0..20.0).contains(&(-forward.y).asin().to_degrees()));
    let (centre, radius) = blind.bounding_sphere();
    for aspect in [0.3, 1.0, 16.0 / 9.0] {
        let mut nearest = 1.0_f32;
        for i in 0..1000_u32 {
            let (sin, cos) = (0.01 * std::f32::consts::PI * (i / 10) as f32).sin_cos();
            let (s, c) = (0.2 * std::f32::consts::PI * (i % 10) as f32).sin_cos();
            let place = centre + radius * Vec3::new(sin * s, cos, sin * c);
            let film = blind.camera.film(place, aspect).expect("before the camera");
            assert!(film.iter().all(|x| (-1e-3..=1.001).contains(x)), "{film:?} on a film of {aspect}");
            nearest = film.iter().fold(nearest, |nearest, x| nearest.min(*x).min(1.0 - *x));
        }
        assert!(nearest < 0.05, "it fills the film: {nearest}");
    }
}

#[test]
fn damaged_geometry() {
    let small = Small::new;
    expect(small().with_float(4, f32::NAN), &["mesh `Tetra`", "finite", "vertex 1"]);
    expect(small().with_float(4, f32::INFINITY), &["mesh `Tetra`", "finite"]);
    expect(small().with_float(12, f32::NAN), &["mesh `Tetra`", "normal"]);
    expect(small().with("/accessors/0/count", json!(3)), &["mesh `Tetra`", "3 positions and 4 normals"]);
    let no_normals = small().with("/meshes/0/primitives/0/attributes", json!({ "POSITION": 0 }));
    expect(no_normals.with("/accessors/0/count", json!(3)), &["mesh `Tetra`", "vertex 3 of 3"]);
    expect(small().with("/accessors/2/count", json!(11)), &["mesh `Tetra`", "11 corners"]);
    expect(small().with("/accessors/2/type", json!("VEC3")), &["mesh `Tetra`", "accessor 2", "type"]);
    expect(small().with("/accessors/2/componentType", json!(5126)), &["accessor 2", "type"]);
    expect(small().with("/accessors/0/componentType", json!(5123)), &["accessor 0", "type"]);
    expect(small().with("/accessors/0/componentType", json!(1)), &["accessor 0", "type"]);
    expect(small().with("/accessors/0/type", json!("VEC5")), &["accessor 0", "type"]);
    expect(small().with("/accessors/0/count", json!(5)), &["accessor 0", "beyond"]);
    expect(small().with("/accessors/0/count", json!(u64::MAX)), &["accessor 0", "beyond"]);
    expect(small().with("/accessors/0/byteOffset", json!(u64::MAX)), &["accessor 0", "beyond"]);
    expect(small().with("/accessors/0/byteOffset", json!(1)), &["accessor 0", "beyond"]);
    expect(small().with("/accessors/0/bufferView", json!(9)), &["accessor 0", "does not exist"]);
    expect(small().with("/bufferViews/0/byteLength", json!(u64::MAX)), &["accessor 0", "beyond its buffer"]);
    expect(small().with("/bufferViews/0/byteOffset", json!(1000)), &["accessor 0", "beyond its buffer"]);
    expect(small().with("/bufferViews/0/buffer", json!(9)), &["accessor 0", "does not exist"]);
    expect(small().with("/bufferViews/0/byteStride", json!(4)), &["accessor 0", "stride"]);
    expect(small().with("/bufferViews/0/byteStride", json!(0)), &["accessor 0", "stride"]);
    expect(small().with("/meshes/0/primitives/0/attributes/POSITION", json!(99)), &["accessor 99"]);
    expect(small().with("/meshes/0/primitives/0/indices", json!(99)), &["accessor 99"]);
    expect(small().with("/meshes/0/primitives/0/mode", json!(99)), &["Tetra", "mode"]);
    expect(small().with("/meshes/0/primitives/0/material", json!(99)), &["material 99"]);
    expect(small().with("/nodes/0/mesh", json!(99)), &["node `Body`", "mesh 99"]);
    let zeros = small().with("/accessors/0/bufferView", Value::Null);
    expect(zeros.with("/accessors/0/count", json!(u32::MAX)), &["accessor 0", "without data"]);
    expect(small().with("/nodes/0/scale", json!([1e20, 1e20, 1e20])), &["`Body`", "too large"]);
    expect(small().with("/nodes/0/rotation", json!([0, 0, 0, 0])), &["node `Body`", "transform"]);
    let sparse = json!({ "count": 1, "indices": { "bufferView": 2, "byteOffset": 2, "componentType": 5121 },
        "values": { "bufferView": 3 } });
    let moved = small().with("/accessors/0/sparse", sparse.clone()).good();
    let lowest = moved.mesh.positions[..4].iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    assert_eq!(f64::from(lowest) + moved.origin.y, -1.0); // vertex 2 went to the quad's corner
    let mut beyond = sparse.clone();
    beyond["indices"]["byteOffset"] = json!(23);
    let mut far = small().with("/accessors/0/sparse", beyond);
    far.binary[96 + 23] = 200;
    expect(far, &["accessor 0", "sparse index"]);
    let mut long = sparse;
    long["count"] = json!(1_000_000_000_000_u64);
    expect(small().with("/accessors/0/sparse", long), &["accessor 0", "beyond"]);
}

#[test]
fn zeros_stand_for_absent_data_and_have_no_area() {
    let scene = Small::new().with("/accessors/0/bufferView", Value::Null).good();
    assert_eq!(scene.mesh.triangles.len(), 2);
    assert!(scene.notes.contains(&"4 triangles without area were left out".into()), "{:?}", scene.notes);
    let one = Small::new().with_float(3, 0.0).good(); // vertex 1 falls onto vertex 0
    assert!(one.notes.contains(&"2 triangles without area were left out".into()), "{:?}", one.notes);
}

#[test]
fn nodes_that_are_no_tree() {
    for (pointer, value) in [
        ("/nodes/0/children", json!([0])),
        ("/nodes/0/children", json!([1])),
        ("/scenes/0/nodes", json!([0, 0, 1, 2, 3])),
    ] {
        expect(Small::new().with(pointer, value), &["reached twice", "tree"]);
    }
    let mut cycle = Small::new().with("/nodes/0/children", json!([4]));
    cycle.json["nodes"].as_array_mut().unwrap().push(json!({ "name": "Back", "children": [0] }));
    expect(cycle, &["node `Body`", "reached twice"]);

    let mut deep = Small::new();
    let nodes = deep.json["nodes"].as_array_mut().unwrap();
    for i in 4..100_000 {
        nodes.push(json!({ "children": [i + 1] }));
    }
    nodes.push(json!({}));
    assert!(deep.with("/scenes/0/nodes", json!([0, 2, 4])).load().is_ok());
}

#[test]
fn buffers_that_cannot_be_had() {
    let uri = |uri: &str| Small::new().with("/buffers/0/uri", json!(uri));
    expect(uri("gone.bin"), &["buffer 0", "gone.bin", "beside the scene"]);
    expect(uri("a%FFb"), &["buffer 0", "a%FFb", "UTF-8"]);
    expect(uri("../../secret.bin"), &["buffer 0", "../../secret.bin", "folder"]);
    expect(uri("%2e%2e/secret.bin"), &["buffer 0", "folder"]);
    expect(uri("/etc/hostname"), &["buffer 0", "folder"]);
    expect(uri("https://example.org/x.bin"), &["buffer 0", "folder"]);
    expect(uri("data:application/octet-stream;base64,%%%"), &["buffer 0", "data uri is damaged"]);
    expect(uri("data:application/octet-stream,AAAA"), &["buffer 0", "not base64"]);
    expect(uri("data:"), &["buffer 0", "not base64"]);
    expect(uri("data:;base64,AAAA"), &["buffer 0", "3 bytes where 168"]);
    let glb = Small::new().with("/buffers/0/byteLength", json!(1_000_000)).glb();
    assert!(message("long.glb", load_bytes("long.glb", &glb)).contains("buffer 0"));
    let absent = Small::new().json.to_string();
    assert!(message("absent.gltf", load_bytes("absent.gltf", absent.as_bytes())).contains("buffer 0"));

    let folder = TempDir::new().unwrap();
    let small = uri("a%20b.bin");
    std::fs::write(folder.path().join("a b.bin"), &small.binary).unwrap();
    std::fs::write(folder.path().join("external.gltf"), small.json.to_string()).unwrap();
    assert_eq!(Scene::load(folder.path().join("external.gltf")).unwrap().mesh.triangles.len(), 6);
}

#[test]
fn wrong_facts_of_ours_name_their_owner() {
    let skin = |extras: Value| Small::new().with("/materials/0/extras", extras);
    expect(skin(json!({ "illumination": "globel" })), &["material `Skin`", "globel", "one-bounce"]);
    expect(skin(json!({ "illumination": [0.5, 2] })), &["material `Skin`", "[0.5,2]", "0…1"]);
    expect(skin(json!({ "illumination": 3 })), &["material `Skin`", "illumination"]);
    let rows = json!([[0, 0, 0.1], [0, 0, 0.95], [0, 0, 0]]);
    expect(
        skin(json!({ "fluorescence": rows })),
        &["material `Skin`", "of blue light its fluorescence sends out", "\"gain\": true"],
    );
    assert!(skin(json!({ "fluorescence": { "matrix": rows, "gain": true } })).load().is_ok());
    let mut six = [[0.0; 6]; 6];
    six[3][4] = -0.5;
    expect(
        skin(json!({ "fluorescence": { "matrix": six } })),
        &["material `Skin`", "visible green←invisible blue is -0.5"],
    );
    expect(skin(json!({ "fluorescence": [1, 0] })), &["material `Skin`", "fluorescence", "three rows"]);
    expect(skin(json!({ "opaque": [1, 0, 0] })), &["material `Skin`", "opaque", "four numbers"]);
    expect(skin(json!({ "straight": "no" })), &["material `Skin`", "straight", "four numbers"]);
    expect(skin(json!({ "straight": [1, 0, 0, -1] })), &["material `Skin`", "straight"]);
    expect(skin(json!({ "emission": "unseen" })), &["material `Skin`", "emission", "invisible"]);
    expect(skin(json!({ "thin": "maybe" })), &["material `Skin`", "thin", "true or false"]);
    let stage = Small::new().with("/scenes/0/extras", json!({ "illumination": "dark" }));
    expect(stage, &["scene `Stage`", "dark"]);
    let light = |extras: Value| Small::new().with("/extensions/KHR_lights_punctual/lights/0/extras", extras);
    expect(light(json!({ "warn": [1, 0, 0] })), &["light `Lux`", "warn", "a0"]);
    expect(light(json!({ "warn": [1, 0, 0, 0] })), &["light `Lux`", "warn"]);
    expect(light(json!({ "emission": [-1, 0] })), &["light `Lux`", "emission"]);
    let node = Small::new().with("/nodes/2/extras", json!({ "warn": true }));
    expect(node, &["node `Bulb`", "warn"]);
    let camera = |extras: Value| Small::new().with("/cameras/0/extras", extras);
    expect(camera(json!({ "fstop": 2.8 })), &["camera `Lens`", "`fstop` needs `focus`"]);
    expect(camera(json!({ "aperture": "f/2", "focus": 1 })), &["camera `Lens`", "aperture"]);
    let flat = json!({ "name": "Lens", "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1 } });
    expect(
        Small::new().with("/cameras/0", flat).with("/cameras/0/extras", json!({ "fstop": 2, "focus": 1 })),
        &["camera `Lens`", "orthographic camera has no lens"],
    );
    let unused = Small::new().with("/meshes/0/primitives/0/material", json!(1));
    expect(unused.with("/materials/0/extras", json!({ "thin": 7 })), &["material `Skin`", "thin"]);
    let odd = skin(json!({ "illumination": "a\nb" })).with("/materials/0/name", json!("two\nlines"));
    expect(odd, &["material `two lines`"]);
}

#[test]
fn numbers_out_of_range_name_their_owner() {
    let small = Small::new;
    let pbr = "/materials/0/pbrMetallicRoughness";
    expect(
        small().with(&format!("{pbr}/baseColorFactor"), json!([2, 0, 0, 1])),
        &["`Skin`", "baseColorFactor"],
    );
    expect(small().with(&format!("{pbr}/metallicFactor"), json!(-1)), &["`Skin`", "metallicFactor"]);
    expect(small().with(&format!("{pbr}/roughnessFactor"), json!(7)), &["`Skin`", "roughnessFactor"]);
    expect(small().with("/materials/0/emissiveFactor", json!([0, -1, 0])), &["`Skin`", "emission"]);
    let glass = |ior: f32| json!({ "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_ior": { "ior": ior } });
    expect(small().with("/materials/0/extensions", glass(0.0)), &["`Skin`", "ior"]);
    let light = "/extensions/KHR_lights_punctual/lights/0";
    expect(small().with(&format!("{light}/intensity"), json!(-1)), &["light `Lux`", "intensity"]);
    expect(small().with(&format!("{light}/type"), json!("laser")), &["light `Lux`", "type"]);
    expect(small().with(&format!("{light}/type"), json!("spot")), &["light `Lux`", "cone"]);
    let spot = small().with(&format!("{light}/type"), json!("spot"));
    let cone = json!({ "innerConeAngle": 1.0, "outerConeAngle": 0.5 });
    expect(spot.with(&format!("{light}/spot"), cone), &["light `Lux`", "cone"]);
    expect(small().with("/nodes/2/extensions/KHR_lights_punctual/light", json!(4)), &["`Bulb`", "light 4"]);
    expect(small().with("/nodes/3/camera", json!(4)), &["node `Eye`", "camera 4"]);
    expect(small().with("/cameras/0/perspective/yfov", json!(4)), &["camera `Lens`", "yfov"]);
    expect(small().with("/cameras/0/perspective/aspectRatio", json!(0)), &["camera `Lens`", "aspect"]);
    expect(small().with("/cameras/0/type", json!("fisheye")), &["camera `Lens`", "projection"]);
    expect(small().with("/nodes/3/scale", json!([0, 0, 0])), &["node `Eye`", "scale"]);
    let sun = small().with(&format!("{light}/type"), json!("directional"));
    expect(sun.with(&format!("{light}/extras"), json!({ "warn": [1, 0, 0, 1] })), &["light `Lux`", "warn"]);
}
