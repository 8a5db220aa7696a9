//! What users get wrong: one line that names the thing and the way out, exit code 2, nothing written.

use crate::{halflight, said};
use halflight::plan::Omittable;
use std::fs;

/// Runs with `arguments`; the message must be one line with all of `words` in it.
#[track_caller]
fn must_refuse(arguments: &str, words: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("notes.glb"), "these are notes, not a scene").expect("written");
    fs::write(folder.path().join("dark.gltf"), DARK).expect("written");
    let before = fs::read_dir(folder.path()).expect("a folder").count();
    let output = halflight(folder.path(), arguments);
    let said = said(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
    assert_eq!(said.trim_end().lines().count(), 1, "{arguments}: {said}");
    for word in words {
        assert!(said.contains(word), "{arguments}: `{word}` is not in: {said}");
    }
    assert!(output.stdout.is_empty());
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), before, "{arguments} wrote something");
}

/// One triangle, nothing that shines.
const DARK: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"scene":0,"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

#[test]
fn scenes_that_are_none() {
    must_refuse("render nowhere.glb", &["nowhere.glb"]);
    must_refuse("render notes.glb", &["notes.glb"]);
    must_refuse("render builtin:teapot", &["builtin:teapot", "caustic-box"]);
    must_refuse("render dark.gltf --environment none", &["dark.gltf", "light", "--environment studio"]);
    must_refuse("plan nowhere.glb", &["nowhere.glb"]);
    must_refuse("render .", &["folder", ".glb"]);
}

#[test]
fn illuminations_that_are_none() {
    must_refuse("render --illumination lokal", &["lokal", "local"]);
    must_refuse("render --illumination 0.5,1.5", &["0.5,1.5", "0…1"]);
    must_refuse("render --set Glas=global", &["Glas", "Glass"]);
    must_refuse("render --set Glass", &["--set", "Glass"]);
    must_refuse("render --set Glass=global --set Glass=local", &["--set", "Glass", "twice"]);
    must_refuse("compare --set Glass=global --set Glass=local", &["--set", "Glass", "twice"]);
}

#[test]
fn places_that_cannot_be_written() {
    must_refuse("render -o no/such/folder/x.exr", &["no/such/folder"]);
    must_refuse("render -o notes.glb", &["notes.glb", ".exr"]);
}

#[test]
fn settings_that_do_not_go_together() {
    must_refuse("render --method path --layers caustic", &["caustic", "photon"]);
    must_refuse("render builtin:concentric --method path-plain", &["path-plain", "path"]);
    must_refuse("render --layers visible,depht", &["depht", "depth"]);
    must_refuse("render --samples 9", &["--samples 9", "--method path"]);
    must_refuse("plan --samples 9", &["--samples 9", "--method path"]);
    must_refuse("compare --methods photon --samples 9", &["--samples 9", "path"]);
    must_refuse("render --method nearest --samples 9", &["--samples 9", "--method path"]);
    must_refuse("render --method path --one-path", &["--one-path", "path", "--method photon"]);
    must_refuse("render --method nearest --layers visible,bias", &["bias", "nearest", "--method photon"]);
    must_refuse(
        "render --method nearest --layers fluorescent",
        &["fluorescent", "nearest", "--method photon"],
    );
    must_refuse("render --method nearest --layers visible,error --atlas", &["nearest", "atlas"]);
    must_refuse("render --method nearest --indirect-radius 9", &["--indirect-radius", "--method photon"]);
    must_refuse("plan --method nearest --nearest 1", &["--nearest 1", "2 to 65536"]);
    must_refuse("render --method nearest --cone 0.9", &["--cone 0.9", "1 or more"]);
    must_refuse("render --method nearest --cone nan", &["--cone NaN", "1 or more"]);
    must_refuse("render --nearest 50", &["--nearest", "--method nearest"]);
    must_refuse("render --method path --cone 2", &["--cone", "--method nearest"]);
    must_refuse("compare --reference-method nearest", &["bias", "path or photon"]);
}

#[test]
fn a_scene_in_place_of_a_command_is_told_what_to_write() {
    must_refuse("notes.glb", &["halflight render notes.glb"]);
    must_refuse("builtin:caustic-box", &["halflight render builtin:caustic-box"]);
}

#[test]
fn numbers_that_are_none() {
    for (arguments, word) in [
        ("render --size 0x10", "0x10"),
        ("render --size 0x0", "1 to 65536 pixels"),
        ("render --size 100000x100000", "1 to 65536 pixels"),
        ("render --photons 1e-6", "whole number"),
        ("render --max-triangles 0", "whole number"),
        ("render --time soon", "soon"),
        ("render --error 0", "`0`"),
        ("render --passes 0", "0"),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let output = halflight(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments}");
        assert!(said(&output).contains(word), "{arguments}: {}", said(&output));
    }
}

#[test]
fn what_cannot_be_kept_is_told_with_what_can() {
    let folder = tempfile::tempdir().expect("a folder");
    for command in ["plan", "render"] {
        let output = halflight(folder.path(), &format!("{command} builtin:cornell-spheres --keep shadows"));
        assert_eq!(output.status.code(), Some(2));
        let message = said(&output);
        assert_eq!(message.lines().count(), 1, "{message}");
        let names = Omittable::ALL.map(Omittable::name);
        assert!(
            message.contains("--keep shadows") && names.iter().all(|name| message.contains(name)),
            "{message}"
        );
    }
    assert!(fs::read_dir(folder.path()).expect("a folder").next().is_none());
}
