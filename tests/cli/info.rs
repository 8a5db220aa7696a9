use crate::support::{done, refused, text};
use serde_json::Value;
use std::fs;

fn printed(arguments: &[&str]) -> String {
    String::from_utf8(done(arguments).stdout).expect("text")
}

#[test]
fn a_scene_is_told_as_it_was_read() {
    let text = printed(&["info", "builtin:cornell-spheres", "--illumination", "0.5,0.25"]);
    assert!(text.starts_with("builtin:cornell-spheres: 7948 triangles in 8 surfaces (2 smooth)"), "{text}");
    assert!(text.contains("camera: perspective"), "{text}");
    assert!(text.contains("one-sided; 0.5,0.25, opaque [0.5 0; 1 0], straight [0.25 0; 0 0]"), "{text}");
    assert!(
        text.contains("light: 2 triangles of Lamp, ") && text.contains("multiplication factor: "),
        "{text}"
    );
}

#[test]
fn programs_read_it_as_json_and_power_is_what_lamps_send() {
    let info: Value =
        serde_json::from_str(&printed(&["info", "builtin:cornell-spheres", "--json"])).expect("JSON");
    let materials = info["materials"].as_array().expect("materials");
    let lamp = materials.iter().find(|material| material["name"] == "Lamp").expect("the lamp");
    // Lambertian: π times radiance and area.
    let number = |value: &Value| value.as_f64().expect("a number");
    let expected = std::f64::consts::PI * number(&lamp["emission"]["visible"][0]) * number(&lamp["area"]);
    let power = number(&info["luminaires"][0]["visible_watts"][0]);
    assert!(expected > 0.0 && (power / expected - 1.0).abs() < 1e-5, "{power} for {expected}");
    let triangles: u64 =
        materials.iter().map(|material| material["triangles"].as_u64().expect("a count")).sum();
    assert_eq!(Some(triangles), info["triangles"].as_u64());
    // Global matter: no more than the largest albedo.
    assert!(info["multiplication_factor"]["at_most"].as_f64().is_some_and(|k| k > 0.0 && k < 1.0), "{info}");
}

#[test]
fn files_that_are_not_there_are_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let broken = folder.path().join("broken.gltf");
    fs::write(&broken, "{").expect("written");
    for scene in ["nowhere.glb", text(&broken), "builtin:nothing"] {
        let message = refused(&["info", scene]);
        assert!(message.contains(scene), "{message}");
    }
}

#[test]
fn a_file_without_light_is_told_with_what_lights_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("dark.gltf");
    let document = r#"{ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0, 0, 0], "max": [1, 1, 0] }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }] }"#;
    fs::write(&file, document).expect("written");
    let told = printed(&["info", text(&file)]);
    assert!(
        told.contains(": 1 triangle in 1 surface (0 smooth), 1 material;") && told.contains("0.5000 m²"),
        "{told}"
    );
    let by_studio = "note: has no light: the built-in studio lights it";
    assert!(told.contains("light: environment") && told.contains(by_studio), "{told}");
    let dark = printed(&["info", text(&file), "--environment", "none"]);
    assert!(dark.contains("light: none") && dark.contains("note: nothing emits light"), "{dark}");
    let picture = folder.path().join("a.exr");
    let message = refused(&["render", text(&file), "--environment", "none", "-o", text(&picture)]);
    assert!(message.contains("nothing emits light") && !picture.exists(), "{message}");
}

#[test]
fn images_are_listed_with_what_shows_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, image) = (folder.path().join("textured.gltf"), folder.path().join("two.png"));
    let mut png = png::Encoder::new(fs::File::create(&image).expect("a file"), 2, 1);
    png.set_color(png::ColorType::Rgb);
    let mut png = png.write_header().expect("written");
    png.write_image_data(&[255, 0, 0, 0, 0, 255]).expect("written");
    drop(png);
    let document = r#"{ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "material": 0 }] }],
        "materials": [{ "name": "Flag", "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorTexture": { "index": 0 } } }],
        "images": [{ "uri": "two.png" }], "textures": [{ "source": 0 }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }] }"#;
    fs::write(&file, document).expect("written");
    let words = printed(&["info", text(&file)]);
    assert!(words.contains("texture image 0: 2 × 1, colours of 3 channels"), "{words}");
    assert!(words.contains("; base colour of Flag\n") && words.contains("varies by base colour"), "{words}");
    let info: Value = serde_json::from_str(&printed(&["info", text(&file), "--json"])).expect("JSON");
    assert_eq!(info["textures"][0]["size"], serde_json::json!([2, 1]));
    assert_eq!(info["textures"][0]["shown_as"][0], "base colour of Flag");
    assert_eq!(info["materials"][0]["varies_by"][0], "base colour");
}
