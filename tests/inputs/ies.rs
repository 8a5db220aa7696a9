//! Lamps that shine as a laboratory measured them, as EXT_lights_ies has them, and extras `ies`.

use crate::damage;
use crate::small::Small;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::Vec3;
use halflight::film::Layer;
use halflight::light::Light;
use halflight::plan::Settings;
use halflight::render::Render;
use halflight::scene::{Choice, Loaded, Luminaire, Scene};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::f32::consts::PI;

const NAME: &str = "EXT_lights_ies";

/// 100 cd ahead, linear to nothing at a right angle; a third of it to ±y.
const PROFILE: &str = "IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 -1 2 3 2 1 2 0 0 0\n1 1 60\n0 45 90\n0 90\n50 25 0\n50 10 0\n";

/// The small file with such a lamp in place of its bulb.
fn lamp(profile: &str, instance: Value) -> Small {
    let uri = format!("data:application/x-ies-lm-63;base64,{}", STANDARD.encode(profile));
    let mut small = Small::new();
    small.json["nodes"][2]["extensions"] = json!({ NAME: instance });
    small.json["extensions"] = json!({ NAME: { "lights": [{ "name": "Web", "uri": uri }] } });
    small
}

fn only(scene: &Scene) -> (Vec3, Light) {
    let [Luminaire::Profile { position, intensity, profile: 0 }] = scene.luminaires[..] else {
        panic!("{:?}", scene.luminaires)
    };
    (position, intensity)
}

/// W sr⁻¹ in a direction.
fn at(scene: &Scene, out: Vec3) -> Vec3 {
    scene.profiles[0].at(out.normalize()) * only(scene).1.invisible
}

#[test]
fn a_lamp_shines_by_its_profile_color_and_multiplier_where_its_node_turns_it() {
    let half = 0.5_f64.sqrt();
    let plain = lamp(PROFILE, json!({ "light": 0 })).good();
    assert!(plain.notes.iter().all(|note| !note.contains(NAME)), "{:?}", plain.notes);
    assert_eq!(only(&plain).0.as_dvec3(), glam::DVec3::new(0.0, 3.0, 0.0) - plain.origin);
    let tinted = lamp(PROFILE, json!({ "light": 0, "multiplier": 3, "color": [1, 0.5, 0] })).good();
    let turned =
        lamp(PROFILE, json!({ "light": 0 })).with("/nodes/2/rotation", json!([-half, 0, 0, half])).good();
    let mirrored = lamp(PROFILE, json!({ "light": 0 })).with("/nodes/2/scale", json!([2, 3, -0.5])).good();
    let close = |found: Vec3, expected: Vec3| (found - expected).abs().max_element() < 1e-3;
    for (to, expected) in [
        (Vec3::NEG_Z, 100.0),
        (Vec3::new(1.0, 0.0, -1.0), 50.0),
        (Vec3::new(-1.0, 0.0, -1.0), 50.0),
        (Vec3::new(0.0, 1.0, -1.0), 20.0),
        (Vec3::new(1.0, 1.0, -(2.0_f32.sqrt())), 35.0),
        (Vec3::Z, 0.0),
    ] {
        assert!(close(at(&plain, to), Vec3::splat(expected)), "{to}: {}", at(&plain, to));
        assert!(close(at(&tinted, to), expected * Vec3::new(3.0, 1.5, 0.0)), "{to}: {}", at(&tinted, to));
        // −z is turned down, y to −z.
        let down = Vec3::new(to.x, to.z, -to.y);
        assert!(close(at(&turned, down), Vec3::splat(expected)), "{to}: {}", at(&turned, down));
        let back = Vec3::new(to.x, to.y, -to.z);
        assert!(close(at(&mirrored, back), Vec3::splat(expected)), "{to}: {}", at(&mirrored, back));
    }
}

#[test]
fn its_power_is_the_integral_of_its_profile() {
    // ∫ (1 − 2θ/π) sin θ dθ = 1 − 2/π; the mean of 45° rows between 25 and 10 lowers what lies between.
    let even = PROFILE.replace("50 10 0", "50 25 0");
    let scene = lamp(&even, json!({ "light": 0 })).good();
    let power = scene.luminaires[0].power(1.0).invisible.x;
    let expected = 100.0 * 2.0 * PI * (1.0 - 2.0 / PI);
    assert!((power / expected - 1.0).abs() < 1e-5, "{power} for {expected}");
}

#[test]
fn a_profile_may_lie_in_a_file_or_a_buffer_and_serve_many_lamps() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a lamp.ies"), PROFILE).expect("written");
    let mut small = lamp(PROFILE, json!({ "light": 0 }))
        .with(&format!("/extensions/{NAME}/lights/0/uri"), json!("a%20lamp.ies"));
    small.json["nodes"][1]["extensions"] = json!({ NAME: { "light": 0, "multiplier": 0.5 } });
    let path = folder.path().join("small.gltf");
    std::fs::write(&path, small.embedded().json.to_string()).expect("written");
    let loaded = Scene::load_chosen(&path, &Choice::default()).expect("a scene");
    assert!(loaded.files.iter().any(|file| file.ends_with("a lamp.ies")), "{:?}", loaded.files);
    assert_eq!((loaded.scene.luminaires.len(), loaded.scene.profiles.len()), (2, 2));

    let mut small = lamp(PROFILE, json!({ "light": 0 }));
    let start = small.binary.len();
    small.binary.extend(PROFILE.bytes());
    small.json["buffers"][0]["byteLength"] = json!(small.binary.len());
    let views = small.json["bufferViews"].as_array_mut().expect("a list");
    views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": PROFILE.len() }));
    let light = json!({ "bufferView": views.len() - 1, "mimeType": "application/x-ies-lm-63" });
    let scene = small.with(&format!("/extensions/{NAME}/lights/0"), light).good();
    assert!((at(&scene, Vec3::NEG_Z).x - 100.0).abs() < 1e-3);
}

#[test]
fn what_is_wrong_with_a_lamp_is_told_in_a_line() {
    for (instance, word) in [
        (json!({}), "light profile does not exist"),
        (json!({ "light": 1 }), "light profile does not exist"),
        (json!({ "light": 0, "multiplier": -1 }), "multiplier of its EXT_lights_ies is -1"),
        (json!({ "light": 0, "multiplier": "x" }), "0 or more"),
        (json!({ "light": 0, "multiplier": 1e38 }), "power or place is not finite"),
        (json!({ "light": 0, "color": [1, 2, 1] }), "from 0 to 1"),
        (json!({ "light": 0, "color": [1, 1] }), "from 0 to 1"),
    ] {
        let why = lamp(PROFILE, instance).error();
        assert!(why.contains("node `Bulb`") && why.contains(word), "{why}");
    }
    let flat = lamp(PROFILE, json!({ "light": 0 })).with("/nodes/2/scale", json!([0, 1, 1])).error();
    assert!(flat.contains("scaled to nothing"), "{flat}");
    let light = format!("/extensions/{NAME}/lights/0");
    for (source, word) in [
        (json!({ "name": "Web", "uri": "../x.ies" }), "in the folder of the scene"),
        (json!({ "name": "Web", "uri": "x.ies" }), "cannot be read"),
        (json!({ "name": "Web", "bufferView": 99 }), "buffer view that does not exist"),
        (json!({ "name": "Web" }), "neither a uri nor a buffer view"),
    ] {
        let why = lamp(PROFILE, json!({ "light": 0 })).with(&light, source).error();
        assert!(why.contains("light profile `Web`") && why.contains(word), "{why}");
    }
    let short = lamp(&PROFILE[..PROFILE.len() - 5], json!({ "light": 0 })).error();
    assert!(short.contains("light profile `Web`") && short.contains("ends before its intensity"), "{short}");
    let dark = lamp(PROFILE, json!({ "light": 0, "multiplier": 0 }))
        .with("/materials/0/emissiveFactor", json!([1, 1, 1]));
    let dark = dark.good();
    assert!(dark.notes.iter().any(|note| note.contains("without power")), "{:?}", dark.notes);
}

/// The small file with its bulb measured by a file beside it, loaded; `change` says what else is different.
fn beside(profile: &[u8], change: impl FnOnce(&mut Value)) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a lamp.ies"), profile).expect("written");
    let mut small = Small::new();
    small.json["nodes"][2]["extras"] = json!({ "ies": "a%20lamp.ies" });
    change(&mut small.json);
    let path = folder.path().join("small.gltf");
    std::fs::write(&path, small.embedded().json.to_string()).expect("written");
    Scene::load_chosen(&path, &Choice::default()).map_err(|error| error.to_string())
}

/// What a pass of a small picture shows.
fn picture(scene: Scene) -> Vec<Vec3> {
    let settings = Settings { width: 12, height: 8, ..Settings::for_film(12, 8) };
    let mut render = Render::new(scene, settings, &[Layer::Visible]).expect("a render");
    render.pass();
    render.film().mean(Layer::Visible)
}

#[test]
fn extras_of_a_light_hang_the_same_lamp_as_the_extension() {
    let turn = json!([-0.6, 0.1, -0.2, 0.7]);
    let by_extension = lamp(PROFILE, json!({ "light": 0, "multiplier": 3, "color": [1, 0.5, 0.25] }))
        .with("/nodes/2/rotation", turn.clone())
        .good();
    let (position, intensity) = only(&by_extension);
    // As a light says it, exactly: both give the mean over all directions.
    let strength = intensity.invisible.x;
    let light = |strength: f32, kind: &str| {
        json!({ "name": "Lux", "type": kind, "intensity": f64::from(strength), "color": [1, 0.5, 0.25],
                "spot": { "outerConeAngle": 0.3 } })
    };
    let hung = |strength: f32, kind: &str| {
        let light = light(strength, kind);
        let loaded = beside(PROFILE.as_bytes(), |json| {
            json["nodes"][2]["rotation"] = turn.clone();
            json["extensions"]["KHR_lights_punctual"]["lights"][0] = light;
        });
        let loaded = loaded.expect("a scene");
        assert!(loaded.files.iter().any(|file| file.ends_with("a lamp.ies")), "{:?}", loaded.files);
        loaded.scene
    };
    let by_extras = hung(strength, "point");
    assert_eq!(only(&by_extras), (position, intensity));
    assert_eq!(by_extras.hash(), by_extension.hash());
    assert!(by_extras.notes.iter().all(|note| !note.contains("ies")), "{:?}", by_extras.notes);
    let shown = picture(by_extension);
    assert_eq!(picture(by_extras), shown);
    assert!(shown.iter().copied().sum::<Vec3>().min_element() > 0.0);
    let off = hung(1.02 * strength, "point");
    assert_ne!(picture(off), shown);
    // The file says where a spot shines, not its cone.
    let spot = hung(strength, "spot");
    assert!(
        spot.notes.iter().any(|note| note.contains("cone of spots that shine by an IES file")),
        "{:?}",
        spot.notes
    );
    assert_eq!(picture(spot), shown);
}

#[test]
fn a_lamp_of_extras_keeps_the_power_of_its_light() {
    // What Blender writes of a lamp of 60 W.
    let lumens = 683.0 * 60.0 / (4.0 * PI);
    let scene = beside(PROFILE.as_bytes(), |json| {
        json["asset"]["generator"] = json!("Khronos glTF Blender I/O v4.5.47");
        json["nodes"][2]["extras"] = Value::Null;
        let light = &mut json["extensions"]["KHR_lights_punctual"]["lights"][0];
        light["intensity"] = json!(lumens);
        light["extras"] = json!({ "ies": "a lamp.ies", "emission": [1, 0.5] });
    });
    let scene = scene.expect("a scene").scene;
    let power = scene.luminaires[0].power(1.0);
    let agrees = |found: f32, expected: f32| (found / expected - 1.0).abs() < 1e-5;
    assert!(agrees(power.invisible.x, 60.0) && agrees(power.visible.x, 30.0), "{power:?}");
    assert!(!agrees(1.02 * power.invisible.x, 60.0));
    // 100 cd straight ahead where the mean is less.
    assert!(scene.profiles[0].at(Vec3::NEG_Z) > 4.0);
}

#[test]
fn what_is_wrong_with_a_measured_light_is_told_in_a_line() {
    let of_light = |key: &str, value: Value| {
        beside(PROFILE.as_bytes(), |json| {
            json["extensions"]["KHR_lights_punctual"]["lights"][0][key] = value;
        })
    };
    let named = |name: Value| beside(PROFILE.as_bytes(), |json| json["nodes"][2]["extras"]["ies"] = name);
    let beside_it =
        |key: &str, value: Value| beside(PROFILE.as_bytes(), |json| json["nodes"][2]["extras"][key] = value);
    let long = vec![b' '; 16 << 20 | 1];
    for (found, words) in [
        (
            named(json!("no.ies")),
            [
                "light `Lux`: extras `ies` names `no.ies`: its file `no.ies` cannot be read",
                "put it beside the scene",
            ],
        ),
        (named(json!("../a lamp.ies")), ["extras `ies` names `../a lamp.ies`", "move the file there"]),
        (named(json!("/etc/hostname")), ["extras `ies` names `/etc/hostname`", "in the folder of the scene"]),
        (named(json!(".")), ["extras `ies` names `.`", "put the file itself there"]),
        (named(json!(7)), ["node `Bulb`: extras `ies` is 7", "such as \"lamp.ies\""]),
        (named(json!("")), ["extras `ies` is \"\"", "such as \"lamp.ies\""]),
        (named(json!("small.gltf")), ["names `small.gltf`: has no line TILT=", "download it again"]),
        (beside(&long, |_| ()), ["names `a%20lamp.ies`", "longer than the 16777216 bytes"]),
        (
            beside(&PROFILE.as_bytes()[..PROFILE.len() - 5], |_| ()),
            ["names `a%20lamp.ies`", "ends before its intensity"],
        ),
        (
            of_light("type", json!("directional")),
            ["light `Lux`: extras `ies` is for point and spot lights", "remove it"],
        ),
        (
            beside_it("warn", json!([1, 0, 0, 1])),
            ["`warn` and `ies` both say how it shines", "leave one out"],
        ),
        (beside_it("sphere", json!(0.1)), ["extras `ies` is for lights without extent", "or `sphere`"]),
    ] {
        let why = found.map(drop).expect_err(words[0]);
        assert!(words.iter().all(|word| why.contains(word)) && !why.contains('\n'), "{why}");
        assert!(why.contains("small.gltf: "), "{why}");
    }
    let twice =
        lamp(PROFILE, json!({ "light": 0 })).with("/nodes/2/extras", json!({ "ies": "a.ies" })).error();
    assert!(twice.contains("`ies` and EXT_lights_ies both say how it shines"), "{twice}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_profiles_are_read_or_refused(
        hits in prop::collection::vec((any::<prop::sample::Index>(), 0_usize..12, any::<u8>()), 1..6)
    ) {
        let mut bytes = PROFILE.as_bytes().to_vec();
        for (index, kind, byte) in hits {
            let words: [&[u8]; 11] =
                [b"-", b".", b"e", b" ", b"\n", b"9", b" 1e308 ", b" 1024 ", b" 1e-300 ", b"TILT=INCLUDE\n", b"0"];
            let at = index.index(bytes.len());
            match words.get(kind) {
                Some(word) => drop(bytes.splice(at..at + 1, word.iter().copied())),
                None => bytes[at] = byte,
            }
        }
        let uri = format!("data:application/x-ies-lm-63;base64,{}", STANDARD.encode(&bytes));
        let small = lamp("", json!({ "light": 0 })).with(&format!("/extensions/{NAME}/lights/0/uri"), json!(uri));
        damage::scene(small.embedded().json.to_string().as_bytes());
    }
}
