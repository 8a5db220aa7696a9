//! Cubes of pictures around a scene, as EXT_lights_image_based has them.

use crate::damage;
use crate::small::{Small, message};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::Vec3;
use halflight::scene::{Choice, Luminaire, Scene, Surroundings};
use proptest::prelude::*;
use serde_json::{Value, json};

const NAME: &str = "EXT_lights_image_based";

/// A square PNG of these pixels, of three channels or four.
fn png<const N: usize>(pixels: &[[u8; N]]) -> Vec<u8> {
    let side = (pixels.len() as f64).sqrt() as u32;
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, side, side);
    encoder.set_color(if N == 4 { png::ColorType::Rgba } else { png::ColorType::Rgb });
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(pixels.as_flattened()).expect("written");
    writer.finish().expect("written");
    file
}

/// The same pixels, each 16 × 16 times.
fn enlarged<const N: usize>(pixels: &[[u8; N]]) -> Vec<[u8; N]> {
    let side = (pixels.len() as f64).sqrt() as usize;
    let all = 16 * side;
    (0..all * all).map(|i| pixels[i / all / 16 * side + i % all / 16]).collect()
}

/// The small file in a cube of pictures, whose light has more to say.
fn cube(side: u32, faces: &[Vec<u8>], more: &Value) -> Small {
    let uri = |face: &Vec<u8>| format!("data:image/png;base64,{}", STANDARD.encode(face));
    let images: Vec<Value> = faces.iter().map(|face| json!({ "uri": uri(face) })).collect();
    let mut light = json!({ "name": "Around", "specularImageSize": side,
        "specularImages": [(0..faces.len()).collect::<Vec<_>>(), [0, 0, 0, 0, 0, 0]] });
    for (key, value) in more.as_object().expect("an object") {
        light[key] = value.clone();
    }
    let mut small = Small::new().with("/images", json!(images));
    small.json["extensions"][NAME] = json!({ "lights": [{}, light] });
    small.json["scenes"][0]["extensions"] = json!({ NAME: { "light": 1 } });
    small
}

/// What lights from a direction, and is seen there.
fn from(scene: &Scene, to: Vec3) -> Vec3 {
    let light = scene.environment.as_ref().expect("an environment").radiance(to.normalize());
    assert_eq!(light.invisible, light.visible);
    light.invisible
}

fn close(found: Vec3, expected: Vec3) -> bool {
    (found - expected).abs().max_element() < 1e-3 * expected.max_element()
}

/// Directions that fill a sphere evenly.
fn sphere(n: u32) -> impl Iterator<Item = Vec3> {
    (0..n).map(move |i| {
        let (z, turn) = (1.0 - 2.0 * (i as f32 + 0.5) / n as f32, 2.399_963 * i as f32);
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * turn.cos(), z, r * turn.sin())
    })
}

#[test]
fn colour_to_the_power_of_2_2_over_alpha_times_intensity_is_radiance_from_everywhere() {
    let face = png(&[[188, 255, 64, 85]; 16]);
    let scene = cube(4, &vec![face; 6], &json!({ "intensity": 2.5 })).good();
    let value = |stored: f32| 2.5 * (stored / 255.0).powf(2.2) / (85.0 / 255.0);
    let expected = Vec3::new(value(188.0), value(255.0), value(64.0));
    for to in sphere(300) {
        assert!(close(from(&scene, to), expected), "{to}: {} for {expected}", from(&scene, to));
        assert!(!close(from(&scene, to), 1.02 * expected));
    }
    assert!(matches!(scene.luminaires[..], [Luminaire::Point { .. }, Luminaire::Environment { .. }]));
}

#[test]
fn pictures_without_alpha_are_srgb() {
    let scene = cube(2, &vec![png(&[[188, 255, 0]; 4]); 6], &json!({})).good();
    assert!(close(from(&scene, Vec3::ONE), Vec3::new(0.502_886, 1.0, 0.0)), "{}", from(&scene, Vec3::ONE));
}

/// Faces of one colour each, as they are listed, and where they lie.
const COLOURS: [([u8; 3], Vec3); 6] = [
    ([255, 0, 0], Vec3::X),
    ([0, 255, 0], Vec3::NEG_X),
    ([0, 0, 255], Vec3::Y),
    ([255, 255, 0], Vec3::NEG_Y),
    ([255, 0, 255], Vec3::Z),
    ([0, 255, 255], Vec3::NEG_Z),
];

fn coloured(more: &Value) -> Scene {
    let faces: Vec<_> = COLOURS.iter().map(|(colour, _)| png(&enlarged(&[*colour]))).collect();
    cube(16, &faces, more).good()
}

fn rgb(colour: [u8; 3]) -> Vec3 {
    Vec3::from_array(colour.map(|x| f32::from(x) / 255.0))
}

#[test]
fn each_face_lies_on_its_axis() {
    let scene = coloured(&json!({}));
    for (colour, to) in COLOURS {
        for aside in [Vec3::ZERO, 0.9 * to.any_orthonormal_vector(), Vec3::splat(0.3) - 0.3 * to.abs()] {
            assert!(
                close(from(&scene, to + aside), rgb(colour)),
                "{to} {aside}: {}",
                from(&scene, to + aside)
            );
        }
    }
}

#[test]
fn its_rotation_turns_it_counter_clockwise_about_the_axis() {
    let half = 0.5_f64.sqrt();
    let about_y = coloured(&json!({ "rotation": [0, half, 0, half] }));
    let about_x = coloured(&json!({ "rotation": [half, 0, 0, half] }));
    for (face, y, x) in [
        (0, Vec3::NEG_Z, Vec3::X),
        (1, Vec3::Z, Vec3::NEG_X),
        (2, Vec3::Y, Vec3::Z),
        (3, Vec3::NEG_Y, Vec3::NEG_Z),
        (4, Vec3::X, Vec3::NEG_Y),
        (5, Vec3::NEG_X, Vec3::Y),
    ] {
        let colour = rgb(COLOURS[face].0);
        assert!(close(from(&about_y, y), colour), "face {face} about y: {}", from(&about_y, y));
        assert!(close(from(&about_x, x), colour), "face {face} about x: {}", from(&about_x, x));
    }
}

#[test]
fn faces_are_seen_from_within_and_not_in_a_mirror() {
    // Upper left red, upper right green, lower left blue, lower right white.
    let quarters = png(&enlarged(&[[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]]));
    let scene = cube(32, &vec![quarters; 6], &json!({})).good();
    for ((_, ahead), up) in COLOURS.iter().zip([Vec3::Y, Vec3::Y, Vec3::NEG_Z, Vec3::Z, Vec3::Y, Vec3::Y]) {
        let right = ahead.cross(up);
        for (across, down, expected) in
            [(-1.0, -1.0, Vec3::X), (1.0, -1.0, Vec3::Y), (-1.0, 1.0, Vec3::Z), (1.0, 1.0, Vec3::ONE)]
        {
            let found = from(&scene, *ahead + 0.8 * (across * right - down * up));
            assert!(close(found, expected), "{ahead}, {across} across, {down} down: {found}");
        }
    }
}

#[test]
fn options_and_extras_stand_over_it_and_turn_and_dim_it() {
    let small = |extras: Value| {
        let faces: Vec<_> = COLOURS.iter().map(|(colour, _)| png(&enlarged(&[*colour]))).collect();
        cube(16, &faces, &json!({ "intensity": 3 })).with("/scenes/0/extras", extras)
    };
    let dim = small(json!({ "environment-strength": 0.5, "environment-rotation": 90, "background": "0.25" }))
        .good();
    let seen = dim.environment.as_ref().expect("a sky").radiance(Vec3::NEG_Z);
    assert!(close(seen.invisible, 1.5 * Vec3::X) && close(seen.visible, Vec3::splat(0.25)), "{seen:?}");
    let grey = small(json!({ "environment": "0.75" })).good();
    assert_eq!(from(&grey, Vec3::X), Vec3::splat(0.75));
    assert!(small(json!({ "environment": "none" })).good().environment.is_none());

    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("small.gltf");
    std::fs::write(&path, small(json!({})).embedded().json.to_string()).expect("written");
    let chosen = |source: &str| {
        let source = Some(source.parse().expect("an environment"));
        let around = Surroundings { source, ..Surroundings::default() };
        Scene::load_chosen(&path, &Choice { around, ..Choice::default() }).expect("a scene").scene
    };
    assert_eq!(from(&chosen("0.5"), Vec3::X), Vec3::splat(0.5));
    assert!(chosen("none").environment.is_none());
}

#[test]
fn a_file_whose_only_light_it_is_needs_no_studio() {
    let small = cube(1, &vec![png(&[[255, 255, 255]]); 6], &json!({}));
    let scene = small.with("/nodes/2", json!({ "name": "Bulb" })).good();
    assert!(!scene.lit_by_studio && scene.luminaires.len() == 1, "{:?}", scene.notes);
    assert!(scene.notes.iter().all(|note| !note.contains(NAME)), "{:?}", scene.notes);
}

#[test]
fn what_is_wrong_with_it_is_told_in_a_line() {
    let good = || vec![png(&[[200, 100, 50, 255]; 4]); 6];
    for (more, word) in [
        (json!({ "specularImages": [[0, 1, 2, 3, 4]] }), "six faces"),
        (json!({ "specularImages": [[0, 1, 2, 3, 4, "x"]] }), "six faces"),
        (json!({ "specularImages": [] }), "no specularImages"),
        (
            json!({ "specularImages": null, "irradianceCoefficients": [[1, 1, 1]] }),
            "irradianceCoefficients alone",
        ),
        (json!({ "specularImages": [[0, 1, 2, 3, 4, 6]] }), "image 6: does not exist"),
        (json!({ "specularImageSize": 4 }), "is 2 × 2 where specularImageSize says 4 × 4"),
        (json!({ "specularImageSize": null }), "specularImageSize is null"),
        (json!({ "specularImageSize": 0 }), "1 to 2048"),
        (json!({ "specularImageSize": 4294967298_u64 }), "1 to 2048"),
        (json!({ "intensity": -1 }), "intensity is -1"),
        (json!({ "intensity": 1e39 }), "0 or more"),
        (json!({ "intensity": 3e38 }), "3.4e38 W"),
        (json!({ "rotation": [0, 0, 0, 0] }), "quaternion"),
        (json!({ "rotation": [0, 1e30, 0, 1e30] }), "quaternion"),
        (json!({ "rotation": [0, 1, 0] }), "quaternion"),
    ] {
        let why = cube(2, &good(), &more).error();
        assert!(why.contains(word), "{more}: {why}");
    }
    for (reference, word) in
        [(json!({ "light": 2 }), "image-based light 2 does not exist"), (json!(3), "names no light")]
    {
        let why =
            cube(2, &good(), &json!({})).with(&format!("/scenes/0/extensions/{NAME}"), reference).error();
        assert!(why.contains("scene `Stage`") && why.contains(word), "{why}");
    }
    let spoilt = |face: Vec<u8>| {
        let mut faces = good();
        faces[4] = face;
        message("small.gltf", cube(2, &faces, &json!({})).load())
    };
    let dark = spoilt(png(&[[9, 9, 9, 255], [9, 9, 9, 255], [0, 0, 0, 255], [9, 9, 9, 0]]));
    assert!(
        dark.contains("`Around`: image 4: its texel in column 1, row 1") && dark.contains("alpha 0"),
        "{dark}"
    );
    assert!(spoilt(b"hello".to_vec()).contains("image 4: neither PNG"));
    assert!(spoilt(png(&[[9, 9, 9, 255]; 9])).contains("is 3 × 3"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn strange_values_are_read_or_refused(key in 0_usize..9, kind in 0_usize..10) {
        let places = [
            "", "/intensity", "/rotation", "/rotation/1", "/specularImages", "/specularImages/0", "/specularImages/0/3",
            "/specularImageSize", "/name",
        ];
        let strange = ["null", "-1", "0", "4294967296", "1e39", "[]", "{}", "\"x\"", "true", "[[0]]"][kind];
        let more = json!({ "intensity": 1, "rotation": [0, 0, 0, 1] });
        let small = cube(1, &vec![png(&[[200, 100, 50, 255]]); 6], &more);
        let place = format!("/extensions/{NAME}/lights/1{}", places[key]);
        let small = small.with(&place, serde_json::from_str(strange).expect("json"));
        damage::scene(small.embedded().json.to_string().as_bytes());
    }
}
