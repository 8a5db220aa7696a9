//! `--environment` and what belongs to it: what is taken, what is refused in a line, and that pictures of skies are not overwritten.

use crate::files::{done, refused, scene, triangle};
use crate::{halflight, said};
use exr::prelude::write_rgb_file;
use halflight::film::read_exr;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const SMALL: &str = "--size 8x8 --passes 1 --photons 2000";

/// A folder with a lit scene, `s.gltf`, one without a light, `dark.gltf`, and skies.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let put = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect("written");
    let lit = scene("b.bin", "t.png", 10.0);
    put("b.bin", &triangle());
    put("s.gltf", lit.as_bytes());
    put("dark.gltf", lit.replace(r#""nodes":[0,1]"#, r#""nodes":[0]"#).as_bytes());
    let own = r#""nodes":[0,1],"extras":{"environment":"sky%31.exr"}"#;
    put("own.gltf", lit.replace(r#""nodes":[0,1]"#, own).as_bytes());
    put("sky.hdr", b"#?RADIANCE\n\n-Y 1 +X 2\n\x80\x80\x80\x81\x80\x40\x20\x82");
    // 2^126 times 1e30.
    put("bright.hdr", b"#?RADIANCE\nEXPOSURE=1e-30\n\n-Y 1 +X 2\n\x80\x80\x80\x81\x80\x40\x20\xff");
    put("notes.hdr", b"these are notes, not a sky");
    let exr = |name: &str, green: f32| {
        let texel = |x: usize, y: usize| (0.5, if (x, y) == (2, 1) { green } else { 0.5_f32 }, 0.5);
        write_rgb_file(folder.path().join(name), 4, 2, texel).expect("written");
    };
    exr("sky.exr", 0.5);
    exr("sky1.exr", 0.5);
    exr("nan.exr", f32::NAN);
    exr("minus.exr", -2.0);
    folder
}

#[test]
fn every_kind_of_environment_lights_a_file_without_a_light() {
    let folder = folder();
    let here = folder.path();
    let mut pictures = Vec::new();
    for (number, environment) in [
        "studio",
        "sky",
        "sky:elevation=20,turbidity=4,azimuth=90",
        "0.5",
        "#80a0ff",
        "0.2,0.3,0.4",
        "sky.hdr",
        "sky.exr",
        "sky.hdr --environment-rotation -90 --environment-strength 0.5",
        "white --background #404040",
        "white --background hidden",
    ]
    .into_iter()
    .enumerate()
    {
        done(here, &format!("render dark.gltf {SMALL} --environment {environment} -o {number}.exr"));
        let picture = read_exr(&here.join(format!("{number}.exr"))).expect("a picture");
        let visible = picture.layer("visible").expect("the visible half").to_vec();
        assert!(!pictures.contains(&visible), "{environment} is like another");
        pictures.push(visible);
    }
}

#[test]
fn what_is_no_environment_is_refused_in_a_line() {
    let folder = folder();
    let here = folder.path();
    for (arguments, words) in [
        ("s.gltf --environment nowhere.hdr", &["nowhere.hdr", "check the path"][..]),
        ("s.gltf --environment notes.hdr", &["notes.hdr", "neither Radiance"]),
        ("s.gltf --environment nan.exr", &["nan.exr", "column 2, row 1", "NaN"]),
        ("s.gltf --environment minus.exr", &["minus.exr", "column 2, row 1", "-2"]),
        ("s.gltf --environment bright.hdr", &["bright.hdr", "column 1, row 0", "inf"]),
        ("s.gltf --environment none --environment-rotation 3", &["s.gltf", "nothing is around it"]),
        ("s.gltf --environment-strength 2", &["s.gltf", "nothing is around it"]),
        ("s.gltf --background hidden", &["s.gltf", "nothing is around it"]),
        ("builtin:caustic-box --background hidden", &["caustic-box", "nothing is around it"]),
        ("dark.gltf --environment none", &["dark.gltf", "--environment studio"]),
    ] {
        refused(here, &format!("render {arguments} {SMALL} -o x.exr"), words);
    }
    refused(here, "check --quick --environment sky", &["name a scene", "--environment"]);
}

#[test]
fn words_and_numbers_that_are_none_are_refused_by_name() {
    let folder = folder();
    for (arguments, word) in [
        ("--environment forest", "`forest` is no environment"),
        ("--environment sky.blend", ".hdr, .exr"),
        ("--environment sky:elevation=95", "elevation"),
        ("--environment sky --environment-rotation east", "`east` is no number of degrees"),
        ("--environment sky --environment-rotation nan", "no number of degrees"),
        ("--environment sky --environment-strength -1", "`-1` is no factor"),
        ("--environment sky --environment-strength inf", "`inf` is no factor"),
        ("--environment sky --background grey", "`grey` is no background"),
    ] {
        let output = halflight(folder.path(), &format!("render s.gltf {SMALL} {arguments}"));
        assert_eq!(output.status.code(), Some(2), "{arguments}");
        assert!(said(&output).contains(word), "{arguments}: {}", said(&output));
    }
}

#[test]
fn the_picture_of_a_sky_is_never_overwritten() {
    let folder = folder();
    let here: &Path = folder.path();
    for more in ["", "--overwrite"] {
        for (scene, picture) in [
            ("s.gltf --environment sky.exr", "sky.exr"),
            ("s.gltf --environment ./sky.exr", "sky.exr"),
            ("builtin:caustic-box --environment sky.exr", "./sky.exr"),
            ("own.gltf", "sky1.exr"),
        ] {
            refused(
                here,
                &format!("render {scene} {SMALL} {more} -o {picture}"),
                &[picture.trim_start_matches("./"), "it is read"],
            );
        }
    }
    // With another sky its own is not read.
    done(here, &format!("render own.gltf {SMALL} --environment white --overwrite -o sky1.exr"));
}
