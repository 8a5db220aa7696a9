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
    for command in ["render", "plan", "check"] {
        for (choice, word) in [
            ("--scene 7", "`Room`"),
            ("--camera Nobody", "--camera"),
            ("--scene 1 --camera 2", "Wide, Square"),
        ] {
            let output = halflight(folder.path(), &format!("{command} two.gltf {choice}"));
            let said = said(&output);
            assert_eq!(output.status.code(), Some(2), "{said}");
            assert!(said.lines().count() == 1 && said.contains("two.gltf") && said.contains(word), "{said}");
        }
    }
}
