//! Copies, morph targets, animations and variants: what stands where, in which form.

use crate::small::{Small, message};
use glam::{DQuat, DVec3};
use halflight::error::Error;
use halflight::scene::{Choice, Loaded, Luminaire, Scene};
use serde_json::{Value, json};
use tempfile::TempDir;

fn note(scene: &Scene, needle: &str) -> bool {
    scene.notes.iter().any(|note| note.contains(needle))
}

fn chosen(small: Small, choice: &Choice) -> Result<Loaded, Error> {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("small.gltf");
    std::fs::write(&path, small.embedded().json.to_string()).expect("written");
    Scene::load_chosen(path, choice)
}

fn posed(small: Small, pose: &str) -> Result<Scene, Error> {
    let pose = Some(pose.parse().expect("a pose"));
    chosen(small, &Choice { pose, ..Choice::default() }).map(|loaded| loaded.scene)
}

/// Vertices in the world.
fn places(scene: &Scene) -> Vec<DVec3> {
    scene.mesh.positions.iter().map(|p| p.as_dvec3() + scene.origin).collect()
}

/// The tetrahedron has a corner at each of these.
#[track_caller]
fn corners_at(scene: &Scene, expected: &[DVec3]) {
    let there = places(scene);
    for place in expected {
        assert!(there.iter().any(|p| p.distance(*place) < 1e-5), "{place} is not in {there:?}");
    }
}

fn instanced() -> Small {
    let mut small = Small::new();
    let (s, c) = 0.25_f32.sin_cos();
    let translations = small.add("VEC3", &[1.0, 0.0, 0.0, 0.0, 5.0, 0.0, -4.0, 0.0, 2.0]);
    let rotations = small.add("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, s, 0.0, c, 0.0, 0.0, 2.0 * s, 2.0 * c]);
    let scales = small.add("VEC3", &[1.0, 1.0, 1.0, 2.0, 3.0, 4.0, 1.0, 1.0, -1.0]);
    let attributes = json!({ "TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales, "_ID": 9 });
    small
        .with("/nodes/0/extensions", json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } }))
        .with("/nodes/0/translation", json!([0, 0, 7]))
        .with("/extensionsRequired", json!(["EXT_mesh_gpu_instancing"]))
}

#[test]
fn each_copy_of_a_mesh_stands_where_its_attributes_put_it() {
    let scene = instanced().good();
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    assert_eq!((scene.mesh.triangles.len(), scene.surfaces.len()), (3 * 4 + 2, 4));
    let node = DVec3::new(0.0, 0.0, 7.0);
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let copies = [
        (DVec3::X, DQuat::IDENTITY, DVec3::ONE),
        (DVec3::new(0.0, 5.0, 0.0), DQuat::from_rotation_y(0.5), DVec3::new(2.0, 3.0, 4.0)),
        (DVec3::new(-4.0, 0.0, 2.0), DQuat::from_rotation_z(0.5), DVec3::new(1.0, 1.0, -1.0)),
    ];
    for (translation, rotation, scale) in copies {
        corners_at(&scene, &corners.map(|corner| node + translation + rotation * (scale * corner)));
    }
    // A mirrored copy keeps its front.
    for surface in 0..3_u32 {
        let of = |t: &u32| scene.mesh.surface[*t as usize] == surface;
        let triangles: Vec<u32> = (0..scene.mesh.triangles.len() as u32).filter(of).collect();
        let all: Vec<_> = triangles.iter().flat_map(|t| scene.mesh.corners(*t)).collect();
        let centre = all.iter().sum::<glam::Vec3>() / all.len() as f32;
        for triangle in triangles {
            let [a, ..] = scene.mesh.corners(triangle);
            assert!(scene.mesh.normal(triangle).dot(a - centre) > 0.0, "surface {surface}");
        }
    }
}

#[test]
fn copies_are_counted_and_wrong_ones_are_named() {
    let limited = chosen(instanced(), &Choice { max_triangles: 13, ..Choice::default() });
    assert!(message("small.gltf", limited.map(|l| l.scene)).contains("14 triangles"));
    let at = "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes";
    let uneven = instanced().with(&format!("{at}/SCALE"), json!(0)).error();
    assert!(uneven.contains("node `Body`") && uneven.contains("3 copies and 4"), "{uneven}");
    let typed = instanced().with(&format!("{at}/ROTATION"), json!(4)).error();
    assert!(typed.contains("node `Body`") && typed.contains("wrong type"), "{typed}");
    let mut nowhere = instanced();
    nowhere.json["accessors"][5]["bufferView"] = Value::Null;
    let nowhere = nowhere.error();
    assert!(nowhere.contains("copy 0") && nowhere.contains("turn nowhere"), "{nowhere}");
    let once = instanced().with("/nodes/0/extensions/EXT_mesh_gpu_instancing", json!({}));
    assert_eq!(once.good().mesh.triangles.len(), 6);
    let mut many = instanced();
    for accessor in 4..7 {
        many.json["accessors"][accessor]["count"] = json!(16_000_000);
        many.json["accessors"][accessor].as_object_mut().expect("an accessor").remove("bufferView");
    }
    let many = many.error();
    assert!(many.contains("64000002 triangles") && many.contains("--max-triangles"), "{many}");
}

/// Two targets of the tetrahedron: one moves its tip (vertex 1), one, sparse, its last vertex and all normals.
fn morphed() -> Small {
    let mut small = Small::new();
    let tip = small.add("VEC3", &[0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let last = small.add("VEC3", &[0.0, 0.0, 5.0]);
    let index = small.add("SCALAR", &[f32::from_bits(3)]);
    let views = [last, index].map(|accessor| small.json["accessors"][accessor]["bufferView"].clone());
    let sparse = json!({ "count": 1, "indices": { "bufferView": views[1], "componentType": 5125 },
        "values": { "bufferView": views[0] } });
    let accessors = small.json["accessors"].as_array_mut().expect("a list");
    accessors.push(json!({ "componentType": 5126, "type": "VEC3", "count": 4, "sparse": sparse }));
    let sparse = accessors.len() - 1;
    let turned = small.add("VEC3", &[0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0]);
    let targets = json!([{ "POSITION": tip }, { "POSITION": sparse, "NORMAL": turned }]);
    small.with("/meshes/0/primitives/0/targets", targets)
}

#[test]
fn morph_targets_are_added_by_their_weights() {
    let plain = places(&Small::new().good());
    assert_eq!(places(&morphed().good()), plain, "without weights nothing moves");
    let of_mesh = morphed().with("/meshes/0/weights", json!([0.5, 0]));
    corners_at(&of_mesh.clone().good(), &[DVec3::new(2.5, 0.0, 0.0), DVec3::Z, DVec3::Y]);
    let of_node =
        of_mesh.with("/nodes/0/weights", json!([-1, 0.2])).with("/nodes/0/translation", json!([0, 0, 1]));
    let scene = of_node.good();
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    corners_at(&scene, &[DVec3::new(-2.0, 0.0, 1.0), DVec3::new(0.0, 0.0, 3.0)]);
    // (1, 0, 0) + 0.2 · (0, 0, 2)
    let expected = glam::Vec3::new(1.0, 0.0, 0.4).normalize();
    assert!(scene.mesh.normals.iter().any(|n| n.distance(expected) < 1e-5), "{:?}", scene.mesh.normals);
}

#[test]
fn wrong_morph_targets_are_named_where_they_have_weight() {
    let short = morphed().with("/accessors/4/count", json!(3));
    assert!(short.clone().load().is_ok());
    let short = short.with("/nodes/0/weights", json!([1])).error();
    assert!(short.contains("mesh `Tetra`: has 4 vertices and a morph target of 3"), "{short}");
    let far = morphed().with("/nodes/0/weights", json!([1]));
    let floats = far.binary.len() / 4;
    let start = Small::new().binary.len() / 4;
    let nan = far.with_float(start + 3, f32::NAN).error();
    assert!(start < floats && nan.contains("no finite number"), "{nan}");
    let mut many = Small::new()
        .with("/accessors/0/bufferView", Value::Null)
        .with("/accessors/0/count", json!(10_000_000));
    many.json["meshes"][0]["primitives"][0]["targets"] = json!(vec![json!({ "POSITION": 0 }); 1000]);
    let many = many.error();
    assert!(many.contains("morph targets move 10000000000 vertices"), "{many}");
}

/// The small scene with two animations. The first, `Go`, moves the tetrahedron from (1, 0, 0) at 1 s to (5, 0, 0) at 3 s, turns the
/// sheet by a quarter about y, jumps the lamp and grows the camera's node; the second, without a name, bends the targets.
fn animated() -> Small {
    let mut small = morphed();
    let times = small.add("SCALAR", &[1.0, 3.0]);
    let moves = small.add("VEC3", &[1.0, 0.0, 0.0, 5.0, 0.0, 0.0]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // The second turn is written the long way round.
    let turns = small.add("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, -half, 0.0, -half]);
    let jumps = small.add("VEC3", &[0.0, 3.0, 0.0, 0.0, 9.0, 0.0]);
    let weights = small.add("SCALAR", &[0.0, 0.0, 1.0, 0.5]);
    let cubic = small.add(
        "VEC3",
        &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 4.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0, 1.0, 1.0, 0.0, 0.0, 0.0],
    );
    let target = |node: usize, path: &str, sampler: usize| json!({ "sampler": sampler, "target": { "node": node, "path": path } });
    let sampler =
        |output: usize, how: &str| json!({ "input": times, "output": output, "interpolation": how });
    let go = json!({ "name": "Go",
        "channels": [target(0, "translation", 0), target(1, "rotation", 1), target(2, "translation", 2)],
        "samplers": [{ "input": times, "output": moves }, sampler(turns, "LINEAR"), sampler(jumps, "STEP")] });
    let bend = json!({ "channels": [target(0, "weights", 0), target(0, "scale", 1)],
        "samplers": [sampler(weights, "LINEAR"), sampler(cubic, "CUBICSPLINE")] });
    small.with("/animations", json!([go, bend]))
}

#[test]
fn a_pose_is_the_first_animation_at_a_time() {
    let rest = animated().good();
    assert!(
        note(&rest, "is seen at rest; --pose [NAME:]SECONDS") && note(&rest, "`Go`, animation 1"),
        "{:?}",
        rest.notes
    );
    for (seconds, x) in [("0", 1.0), ("1", 1.0), ("1.5", 2.0), ("3", 5.0), ("8", 5.0), ("-4", 1.0)] {
        let scene = posed(animated(), seconds).expect(seconds);
        corners_at(&scene, &[DVec3::new(x, 0.0, 0.0), DVec3::new(x + 1.0, 0.0, 0.0)]);
        assert!(note(&scene, "posed by animation `Go`; --pose NAME:SECONDS takes another: animation 1"));
        assert_eq!(note(&scene, "animation `Go` ends at 3 s"), seconds == "8");
    }
    // A turn takes the short way: at half time by an eighth about y.
    let scene = posed(animated(), "Go:2").unwrap();
    let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_4);
    corners_at(&scene, &[turn * DVec3::new(-2.0, -1.0, 2.0), turn * DVec3::new(2.0, -1.0, -2.0)]);
    let lamp = |pose: &str| {
        let scene = posed(animated(), pose).unwrap();
        let Luminaire::Point { position, .. } = scene.luminaires[0] else { panic!("a point light") };
        position.as_dvec3() + scene.origin
    };
    assert!(lamp("2.9").distance(DVec3::new(0.0, 3.0, 0.0)) < 1e-6, "steps wait for their time");
    assert!(lamp("3").distance(DVec3::new(0.0, 9.0, 0.0)) < 1e-6);
}

#[test]
fn a_pose_is_that_of_the_animation_that_is_named() {
    let scene = posed(animated(), "1:2").unwrap();
    // Weights ½ and ¼. The scale along x goes from 1, with slope 4, to 3, with slope 2 over two seconds: 2 + (8 − 4) / 8.
    corners_at(&scene, &[DVec3::new(2.5 * 2.5, 0.0, 0.0), DVec3::new(0.0, 0.0, 2.25)]);
    assert!(!note(&scene, "--pose"));
    assert!(posed(animated(), "Go:1").is_ok());
    let unknown = message("small.gltf", posed(animated(), "Stop:1"));
    assert!(
        unknown.contains("no animation `Stop`") && unknown.contains("animation `Go`, animation 1"),
        "{unknown}"
    );
    let none = message("small.gltf", posed(Small::new(), "1"));
    assert!(none.contains("leave out --pose"), "{none}");
    let loaded = chosen(animated(), &Choice::default()).unwrap();
    assert_eq!(loaded.animations, ["animation `Go`", "animation 1"]);
    let pose = Some("1".parse().unwrap());
    let builtin = Scene::load_chosen("builtin:caustic-box", &Choice { pose, ..Choice::default() });
    assert!(message("builtin", builtin.map(|l| l.scene)).contains("--pose"));
}

#[test]
fn what_is_wrong_with_an_animation_is_told_who_asks_for_a_pose() {
    let expect = |pointer: &str, value: Value, needle: &str| {
        let small = animated().with(pointer, value);
        assert!(small.clone().load().is_ok(), "at rest nobody minds");
        let error = message("small.gltf", posed(small, "2"));
        assert!(error.contains("animation `Go`: channel") && error.contains(needle), "{error}");
    };
    expect("/animations/0/channels/0/target/node", json!(77), "channel 0 moves node 77");
    expect("/animations/0/channels/1/sampler", json!(9), "no sampler");
    expect("/animations/0/samplers/0/input", Value::Null, "without times");
    expect("/animations/0/samplers/0/input", json!(99), "no keys");
    expect("/animations/0/samplers/0/output", json!(99), "accessor 99");
    expect("/animations/0/samplers/1/output", json!(0), "wrong type");
    expect("/animations/0/samplers/0/interpolation", json!("WOBBLE"), "`WOBBLE`");
    expect("/animations/0/samplers/0/interpolation", json!("CUBICSPLINE"), "too few");
    let pointer = json!({ "sampler": 0, "target": { "path": "pointer" } });
    let passed_over = posed(animated().with("/animations/0/channels/2", pointer), "2").unwrap();
    assert!(note(&passed_over, "move no node were passed over: animation `Go`"), "{:?}", passed_over.notes);
    let nowhere = animated().with("/animations/0/samplers/1/output", json!(10));
    assert!(posed(nowhere, "2").is_err());
}

fn variants() -> Small {
    let says = json!({ "variants": [{ "name": "Oak" }, { "name": "Snow" }] });
    let mapping =
        json!({ "mappings": [{ "material": 1, "variants": [1] }, { "material": 9, "variants": [7] }] });
    Small::new()
        .with("/extensions/KHR_materials_variants", says)
        .with("/meshes/0/primitives/0/extensions", json!({ "KHR_materials_variants": mapping }))
        .with("/extensionsUsed", json!(["KHR_materials_variants"]))
}

#[test]
fn variants_are_chosen_by_name_and_listed() {
    let wearing = |variant: Option<&str>| {
        let variant = variant.map(Into::into);
        chosen(variants(), &Choice { variant, ..Choice::default() }).map(|loaded| loaded.scene)
    };
    let body = |scene: &Scene| {
        let surface = scene.surfaces.iter().find(|surface| surface.name == "Body").expect("a body");
        scene.materials[surface.material as usize].name.clone()
    };
    let plain = wearing(None).unwrap();
    assert_eq!(body(&plain), "Skin");
    assert!(note(&plain, "--variant NAME shows one of them: Oak, Snow"), "{:?}", plain.notes);
    for (name, material) in [("Oak", "Skin"), ("Snow", "Cloth"), ("1", "Cloth")] {
        let scene = wearing(Some(name)).unwrap();
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        assert_eq!(body(&scene), material, "{name}");
    }
    let unknown = message("small.gltf", wearing(Some("Gold")));
    assert!(unknown.contains("no variant `Gold`") && unknown.contains("Oak, Snow"), "{unknown}");
    let none = chosen(Small::new(), &Choice { variant: Some("Oak".into()), ..Choice::default() });
    assert!(message("small.gltf", none.map(|l| l.scene)).contains("leave out --variant"));
    assert_eq!(chosen(variants(), &Choice::default()).unwrap().variants, ["Oak", "Snow"]);
}
