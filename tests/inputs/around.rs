//! What files say of what is around them, and files without a light.

use crate::small::Small;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use exr::prelude::write_rgb_file;
use halflight::film::Layer;
use halflight::plan::Settings;
use halflight::render::Render;
use halflight::scene::{Background, Choice, Loaded, Luminaire, Scene, Surroundings};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// The small file with such extras on its scene, beside a picture of two texels, `a sky.exr`, of which the second is (1, `green`, 2).
fn load(extras: Value, green: f32, around: Surroundings) -> Result<(Loaded, PathBuf), String> {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("a sky.exr");
    write_rgb_file(&picture, 2, 1, |x, _| if x == 0 { (1.0, 1.0, 1.0_f32) } else { (1.0, green, 2.0) })
        .expect("written");
    let path = folder.path().join("small.gltf");
    let file = Small::new().with("/scenes/0/extras", extras).embedded();
    fs::write(&path, file.json.to_string()).expect("written");
    let loaded = Scene::load_chosen(&path, &Choice { around, ..Choice::default() });
    let picture = picture.canonicalize().expect("a file");
    loaded.map(|loaded| (loaded, picture)).map_err(|e| {
        assert_eq!(e.exit_code(), 2);
        e.to_string()
    })
}

fn good(extras: Value) -> Scene {
    load(extras, 1.0, Surroundings::default()).unwrap_or_else(|e| panic!("{e}")).0.scene
}

#[test]
fn a_scene_names_its_sky_its_turn_its_strength_and_what_is_seen_of_it() {
    let scene = good(json!({ "environment": "a%20sky.exr", "environment-rotation": 30,
        "environment-strength": 0.5, "background": "0.25" }));
    let sky = scene.environment.as_ref().expect("a sky");
    // Red is 1 everywhere.
    let seen = sky.radiance(glam::Vec3::X);
    assert_eq!((seen.invisible.x, seen.visible.x), (0.5, 0.25));
    assert!(matches!(scene.luminaires[..], [Luminaire::Point { .. }, Luminaire::Environment { .. }]));
    let day = good(json!({ "environment": "sky:elevation=20" }));
    assert!(matches!(day.luminaires[1..], [Luminaire::Sun { .. }, Luminaire::Environment { .. }]));
    for (extras, environment) in [
        (json!({ "environment": "studio", "background": false }), true),
        (json!({ "environment": "#80a0ff", "background": true }), true),
        (json!({ "environment": "none" }), false),
        (json!({}), false),
    ] {
        assert_eq!(good(extras.clone()).environment.is_some(), environment, "{extras}");
    }
}

#[test]
fn a_picture_that_a_scene_names_is_among_its_files_by_its_own_name() {
    let (loaded, picture) =
        load(json!({ "environment": "a%20sky.exr" }), 1.0, Surroundings::default()).expect("a scene");
    assert!(loaded.files.contains(&picture), "{:?}", loaded.files);
}

#[test]
fn who_renders_it_has_the_last_word_and_the_turn_of_another_sky_goes_with_it() {
    let of_file = json!({ "environment": "a%20sky.exr", "environment-rotation": 30,
        "environment-strength": 9, "background": "0.25" });
    let with = |around| load(of_file.clone(), 1.0, around).unwrap_or_else(|e| panic!("{e}")).0;
    let source = |text: &str| Some(text.parse().expect("an environment"));
    let none = with(Surroundings { source: source("none"), ..Surroundings::default() });
    assert!(none.scene.environment.is_none() && none.scene.luminaires.len() == 1);
    let grey = with(Surroundings { source: source("0.75"), ..Surroundings::default() });
    let seen = grey.scene.environment.expect("a sky").radiance(glam::Vec3::Y);
    assert_eq!((seen.invisible.x, seen.visible.x), (0.75, 0.25), "strength 9 was of the other");
    assert_eq!(grey.files.len(), 1, "what is not read is no file of it: {:?}", grey.files);
    let dim = with(Surroundings {
        strength: Some(2.0),
        background: Some(Background::Same),
        ..Surroundings::default()
    });
    let seen = dim.scene.environment.expect("a sky").radiance(glam::Vec3::Y);
    assert_eq!((seen.invisible.x, seen.visible.x), (2.0, 2.0));
}

#[test]
fn what_is_wrong_around_a_scene_is_told_in_a_line_that_names_the_scene() {
    for (extras, word) in [
        (json!({ "environment": 3 }), "studio"),
        (json!({ "environment": ["sky"] }), "studio"),
        (json!({ "environment": "forest" }), "forest"),
        (json!({ "environment": "sky:elevation=95" }), "elevation"),
        (json!({ "environment": "../sky.exr" }), "in the folder of the scene"),
        (json!({ "environment": "/etc/sky.exr" }), "in the folder of the scene"),
        (json!({ "environment": "file:///sky.exr" }), "in the folder of the scene"),
        (json!({ "environment": "nowhere.exr" }), "cannot be read"),
        (json!({ "environment": "now\nhere\u{1b}[2J.exr" }), "cannot be read"),
        (json!({ "environment": "sky", "environment-rotation": "east" }), "degrees"),
        (json!({ "environment": "sky", "environment-rotation": [1] }), "degrees"),
        (json!({ "environment": "sky", "environment-strength": -1 }), "0 or more"),
        (json!({ "environment": "sky", "environment-strength": 1e39 }), "0 or more"),
        (json!({ "environment": "white", "environment-strength": 3e38 }), "3.4e38 W"),
        (json!({ "environment": "sky", "background": 4 }), "#404040"),
        (json!({ "environment": "sky", "background": "sky" }), "#404040"),
        (json!({ "environment-rotation": 3 }), "nothing is around it"),
        (json!({ "environment": "none", "background": false }), "nothing is around it"),
    ] {
        let why = load(extras.clone(), 1.0, Surroundings::default()).expect_err("it is wrong");
        assert!(why.contains("small.gltf: ") && why.contains(word), "{extras}: {why}");
        assert!(!why.contains(['\n', '\u{1b}']), "{why:?}");
    }
}

#[test]
fn a_texel_that_is_no_light_is_named_with_its_file_and_the_scene() {
    for (green, word) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (-0.5, "-0.5")] {
        let why = load(json!({ "environment": "a%20sky.exr" }), green, Surroundings::default())
            .expect_err("no light");
        let told = ["small.gltf", "a sky.exr", "column 1, row 0", word];
        assert!(told.iter().all(|part| why.contains(part)) && !why.contains('\n'), "{why}");
    }
}

/// Files that others made; none where they are not there.
fn field() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/field/gltf");
    let files = fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    let mut files: Vec<_> =
        files.filter(|path| path.extension().is_some_and(|ending| ending == "gltf")).collect();
    files.sort();
    files
}

#[test]
fn every_file_without_a_light_is_seen_at_once_in_the_studio() {
    for path in field() {
        let scene = Scene::load(&path).unwrap_or_else(|e| panic!("{e}"));
        let text = fs::read_to_string(&path).expect("a file");
        let shines = ["KHR_lights_punctual", "emissiveFactor", "KHR_materials_unlit"];
        let lamp = shines.iter().any(|word| text.contains(word));
        assert!(lamp || scene.lit_by_studio, "{}", path.display());
        let told = scene.notes.iter().any(|note| note.contains("the built-in studio lights it"));
        assert_eq!(told, scene.lit_by_studio, "{}: {:?}", path.display(), scene.notes);
        if scene.lit_by_studio {
            let settings = Settings { width: 16, height: 16, paths: Some(5000), ..Settings::default() };
            let mut render = Render::new(scene, settings, &[Layer::Visible]).expect("an image");
            render.pass();
            let picture = render.film().mean(Layer::Visible);
            assert!(picture.iter().all(|rgb| rgb.is_finite()), "{}", path.display());
            let lit = picture.iter().filter(|rgb| rgb.min_element() > 0.01).count();
            assert!(lit > 128, "{}: {lit} of 256 pixels are lit", path.display());
        }
    }
}

/// The small file without its lamp, one thing of which has an emissive picture of this strength; with a camera or without.
fn glowing(strength: f64, camera: bool) -> Scene {
    let image = crate::images::png(&[[255, 255, 255]]);
    let uri = format!("data:image/png;base64,{}", STANDARD.encode(image));
    let mut file = Small::new()
        .with("/nodes/2", json!({ "name": "Bulb" }))
        .with("/extensions", Value::Null)
        .with("/images", json!([{ "uri": uri }]))
        .with("/textures", json!([{ "source": 0 }]))
        .with("/materials/0/emissiveFactor", json!([1, 1, 1]))
        .with("/materials/0/emissiveTexture", json!({ "index": 0 }))
        .with(
            "/materials/0/extensions/KHR_materials_emissive_strength",
            json!({ "emissiveStrength": strength }),
        );
    if !camera {
        file = file.with("/nodes/3", json!({ "name": "Eye" }));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("glowing.gltf");
    fs::write(&path, file.embedded().json.to_string()).expect("written");
    Scene::load(&path).expect("a good file")
}

#[test]
fn a_model_that_only_glimmers_is_lit_by_the_studio_too_and_a_scene_is_not() {
    for (strength, camera, studio) in [(1.0, false, true), (20.0, false, false), (1.0, true, false)] {
        let scene = glowing(strength, camera);
        assert_eq!(scene.lit_by_studio, studio, "{strength} {camera}: {:?}", scene.notes);
        let told = scene.notes.iter().any(|note| note.contains("the built-in studio lights it too"));
        assert_eq!(told, studio);
    }
}
