//! Which scene, which camera, and the shape of the film.

use crate::{halflight, said};
use std::fs;
use std::path::Path;

/// One triangle in two scenes, the second of which has two cameras, 16:9 and square.
const TWO: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]},{"name":"Room","nodes":[0,1,2]}],
"nodes":[{"mesh":0,"name":"Tri"},{"camera":0,"name":"Wide","translation":[0,0,3]},{"camera":1,"name":"Square","translation":[0,0,3]}],
"cameras":[{"type":"perspective","perspective":{"yfov":0.8,"aspectRatio":1.7777777777777777}},
{"type":"orthographic","orthographic":{"xmag":1,"ymag":1}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"materials":[{"emissiveFactor":[1,1,1]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

/// What a render of it says.
fn render(folder: &Path, more: &str) -> String {
    fs::write(folder.join("two.gltf"), TWO).expect("written");
    let output =
        halflight(folder, &format!("render two.gltf --max-reflections 0 --passes 1 -o two.exr {more}"));
    let said = said(&output);
    assert!(output.status.success(), "{said}");
    said
}

#[test]
fn the_film_has_the_shape_of_the_cameras_picture_unless_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let plain = render(folder.path(), "");
    assert!(plain.contains("shows scene 0") && plain.contains("scene `Room`"), "{plain}");
    assert!(plain.contains("has no camera") && plain.contains("512x512"), "{plain}");
    let wide = render(folder.path(), "--size 90x40");
    assert!(wide.contains("has no camera") && !wide.contains("the camera's picture"), "{wide}");
    let room = render(folder.path(), "--scene Room");
    assert!(room.contains("Wide; --camera") && room.contains("Square"), "{room}");
    assert!(room.contains("512x288") && !room.contains("the camera's picture"), "{room}");
    let square = render(folder.path(), "--scene 1 --camera Square");
    assert!(square.contains("512x512") && !square.contains("--camera"), "{square}");
    let narrow = render(folder.path(), "--scene Room --size 90x90");
    assert!(narrow.contains("the camera's picture is 1.7778:1, the film 90x90: it also shows"), "{narrow}");
    assert!(narrow.contains("above and below (--size 512x288"), "{narrow}");
}

#[test]
fn scenes_and_cameras_that_are_not_there_are_refused_by_every_command() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("two.gltf"), TWO).expect("written");
    for command in ["render", "plan", "check", "info", "compare"] {
        for (choice, word) in [
            ("--scene 7", "`Room`"),
            ("--camera Nobody", "--camera"),
            ("--scene 1 --camera 2", "Wide, Square"),
            ("--pose Walk:1", "leave out --pose"),
            ("--variant Oak", "leave out --variant"),
        ] {
            let output = halflight(folder.path(), &format!("{command} two.gltf {choice}"));
            let said = said(&output);
            assert_eq!(output.status.code(), Some(2), "{said}");
            assert!(said.lines().count() == 1 && said.contains("two.gltf") && said.contains(word), "{said}");
        }
    }
}

/// The same with an animation that lifts the triangle from 2 s to 4 s, and two variants.
fn lively() -> String {
    let mut json: serde_json::Value = serde_json::from_str(TWO).expect("json");
    // Times 2 and 4, then (0, 0, 0) and (0, 1, 0).
    let data = "data:application/octet-stream;base64,AAAAQAAAgEAAAAAAAAAAAAAAAAAAAAAAAACAPwAAAAA=";
    let push = |list: &mut serde_json::Value, thing: serde_json::Value| {
        list.as_array_mut().expect("a list").push(thing);
    };
    push(&mut json["buffers"], serde_json::json!({ "byteLength": 32, "uri": data }));
    push(&mut json["bufferViews"], serde_json::json!({ "buffer": 1, "byteLength": 8 }));
    push(&mut json["bufferViews"], serde_json::json!({ "buffer": 1, "byteOffset": 8, "byteLength": 24 }));
    let accessor = |view: u32, kind: &str| serde_json::json!({ "bufferView": view, "componentType": 5126, "count": 2, "type": kind });
    push(&mut json["accessors"], accessor(1, "SCALAR"));
    push(&mut json["accessors"], accessor(2, "VEC3"));
    json["animations"] = serde_json::json!([{ "name": "Rise",
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
        "samplers": [{ "input": 1, "output": 2 }] }]);
    json["extensions"] = serde_json::json!({ "KHR_materials_variants": { "variants": [{ "name": "Oak" }, { "name": "Snow" }] } });
    json.to_string()
}

#[test]
fn info_lists_animations_and_variants_and_shows_the_pose() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("lively.gltf"), lively()).expect("written");
    let info = |more: &str| {
        let output = halflight(folder.path(), &format!("info lively.gltf {more}"));
        assert!(output.status.success(), "{}", said(&output));
        String::from_utf8(output.stdout).expect("text")
    };
    let rest = info("");
    assert!(
        rest.contains("variants: Oak, Snow\n") && rest.contains("animations: animation `Rise`\n"),
        "{rest}"
    );
    assert!(rest.contains("from (0, 0, 0) to (1, 1, 0) m"), "{rest}");
    assert!(rest.contains("--pose [NAME:]SECONDS") && rest.contains("--variant NAME"), "{rest}");
    let risen = info("--pose Rise:3 --variant Snow");
    assert!(
        risen.contains("from (0, 0.5, 0) to (1, 1.5, 0) m") && !risen.contains("note: is seen at rest"),
        "{risen}"
    );
    let json: serde_json::Value = serde_json::from_str(&info("--json")).expect("json");
    assert_eq!((&json["variants"][1], &json["animations"][0]), (&"Snow".into(), &"animation `Rise`".into()));
    let wrong = halflight(folder.path(), "info lively.gltf --pose soon");
    assert!(wrong.status.code() == Some(2) && said(&wrong).contains("NAME:SECONDS"), "{}", said(&wrong));
}
