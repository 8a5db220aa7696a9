//! Files that are good but looser, larger or richer than the smallest: several scenes, extensions, f64, skins.

use crate::small::{Small, load_bytes, message};
use glam::{DVec3, Vec3};
use halflight::scene::{Choice, Luminaire, Scene};
use serde_json::{Value, json};
use tempfile::TempDir;

fn note(scene: &Scene, needle: &str) -> bool {
    scene.notes.iter().any(|note| note.contains(needle))
}

/// Loads with a choice of scene and camera.
fn chosen(small: Small, scene: Option<&str>, camera: Option<&str>) -> Result<Scene, halflight::error::Error> {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("small.gltf");
    std::fs::write(&path, small.embedded().json.to_string()).expect("written");
    let choice = Choice { scene: scene.map(Into::into), camera: camera.map(Into::into), ..Choice::default() };
    Scene::load_chosen(path, &choice).map(|loaded| loaded.scene)
}

#[test]
fn whole_numbers_may_be_written_as_floats_and_nothing_as_null() {
    fn as_floats(value: &mut Value) {
        match value {
            Value::Number(number) => *value = json!(number.as_f64().unwrap()),
            Value::Array(values) => values.iter_mut().for_each(as_floats),
            Value::Object(map) => map.values_mut().for_each(as_floats),
            _ => {}
        }
    }
    let mut loose = Small::new().embedded();
    as_floats(&mut loose.json);
    assert!(loose.json.to_string().contains("\"count\":12.0"));
    loose.json["nodes"][0]["skin"] = Value::Null;
    loose.json["extensionsUsed"] = Value::Null;
    let (loose, plain) = (loose.good(), Small::new().good());
    assert_eq!(loose.mesh.positions, plain.mesh.positions);
    assert_eq!(loose.luminaires, plain.luminaires);
}

#[test]
fn what_is_wrong_with_an_animation_does_not_matter() {
    let pointer = json!([{ "channels": [{ "sampler": 0, "target": { "path": "pointer" } }], "samplers": 7 }]);
    let scene = Small::new().with("/animations", pointer).good();
    assert!(note(&scene, "is seen at rest; --pose [NAME:]SECONDS"));
}

#[test]
fn a_file_without_scenes_shows_all_its_nodes() {
    let mut small = Small::new().with("/scene", Value::Null).with("/scenes", Value::Null);
    small.json["nodes"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "children": [0, 1], "translation": [0, 0, -7] }));
    let scene = small.clone().good();
    assert_eq!((scene.mesh.triangles.len(), scene.luminaires.len()), (6, 1));
    assert_eq!(scene.origin, DVec3::new(0.0, 0.0, -7.0), "children stand where their parents put them, once");
    assert!(small.with("/scenes", json!([])).load().is_ok());
}

#[test]
fn other_scenes_are_named_and_can_be_chosen_by_name_or_number() {
    let two = || {
        let scenes = json!([{ "name": "Stage", "nodes": [0, 2] }, { "name": "1st act", "nodes": [0, 1, 2] }, { "nodes": [1, 2] }]);
        Small::new().with("/scenes", scenes)
    };
    let scene = two().good();
    assert_eq!(scene.mesh.triangles.len(), 4);
    assert!(note(
        &scene,
        "shows scene `Stage`; --scene NAME or N (from 0) shows another: scene `1st act`, scene 2"
    ));
    for (wanted, triangles) in [("1st act", 6), ("1", 6), ("2", 2), ("Stage", 4), ("0", 4)] {
        let scene = chosen(two(), Some(wanted), None).unwrap();
        assert_eq!(scene.mesh.triangles.len(), triangles, "{wanted}");
        assert!(!note(&scene, "--scene"));
    }
    let error = message("small.gltf", chosen(two(), Some("3"), None));
    assert!(error.contains("no scene `3`") && error.contains("`1st act`"), "{error}");
    assert!(
        message(
            "builtin",
            Scene::load_chosen(
                "builtin:caustic-box",
                &Choice { scene: Some("0".into()), ..Choice::default() }
            )
            .map(|loaded| loaded.scene)
        )
        .contains("--scene")
    );
}

#[test]
fn other_cameras_are_named_and_can_be_chosen_by_name_or_number() {
    let two = || {
        let mut small = Small::new().with("/nodes/1/camera", json!(1));
        let wide = json!({ "name": "Wide", "type": "perspective", "perspective": { "yfov": 1.5 } });
        small.json["cameras"].as_array_mut().expect("a list").push(wide);
        small
    };
    let yfov = |scene: Scene| match scene.camera.projection {
        halflight::scene::Projection::Perspective { yfov } => yfov,
        other => panic!("{other:?}"),
    };
    let scene = two().good();
    assert!(note(&scene, "seen by the first camera, Sheet; --camera NAME or N (from 0) takes another: Eye"));
    assert_eq!(yfov(scene), 1.5);
    for (wanted, angle) in
        [("Eye", 0.7), ("Lens", 0.7), ("1", 0.7), ("Sheet", 1.5), ("Wide", 1.5), ("0", 1.5)]
    {
        let scene = chosen(two(), None, Some(wanted)).unwrap();
        assert!(!note(&scene, "--camera"));
        assert_eq!(yfov(scene), angle, "{wanted}");
    }
    let error = message("small.gltf", chosen(two(), None, Some("Ear")));
    assert!(error.contains("no camera `Ear`") && error.contains("Sheet, Eye"), "{error}");
}

#[test]
fn what_a_file_requires_is_told_as_what_it_uses() {
    for name in [
        "KHR_materials_clearcoat",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_xmp_json_ld",
        "EXT_texture_webp",
        "KHR_materials_made_up",
        "XYZ_unheard_of",
        "KHR_draco_mesh_compression",
        "KHR_interactivity",
    ] {
        let used = Small::new().with("/extensionsUsed", json!([name]));
        let required = used.clone().with("/extensionsRequired", json!([name])).good();
        assert_eq!(required.notes, used.good().notes, "{name}");
    }
    let strange = Small::new().with("/extensionsRequired", json!(["XYZ_unheard_of"])).good();
    assert!(note(&strange, "XYZ_unheard_of"));
}

#[cfg(not(any(feature = "draco", feature = "meshopt")))]
#[test]
fn packed_geometry_is_refused_by_the_name_of_its_packing() {
    let draco = "KHR_draco_mesh_compression";
    let packed = |small: Small| {
        let extension = json!({ draco: { "bufferView": 0, "attributes": { "POSITION": 0 } } });
        small.with("/meshes/0/primitives/0/extensions", extension).with("/extensionsUsed", json!([draco]))
    };
    let required = packed(Small::new()).with("/extensionsRequired", json!([draco]));
    assert!(required.error().contains(draco));
    let bare = packed(Small::new()).with("/accessors/0/bufferView", Value::Null);
    assert!(bare.error().contains(draco));
    assert!(packed(Small::new()).good().notes.is_empty(), "the plain numbers are there too");

    let meshopt = json!({ "EXT_meshopt_compression": { "buffer": 0, "byteLength": 48 } });
    let small = Small::new().with("/bufferViews/0/extensions", meshopt);
    let required = small.clone().with("/extensionsRequired", json!(["EXT_meshopt_compression"]));
    assert!(required.error().contains("EXT_meshopt_compression"));
    assert!(small.load().is_ok());
}

/// The small scene with the numbers of its tetrahedron as integers: positions of 16 bits, normals of 8.
fn quantized() -> Small {
    let mut small = Small::new();
    let positions: [[i16; 4]; 4] = [[0, 0, 0, 0], [32_767, 0, 0, 0], [0, 32_767, 0, 0], [0, 0, 32_767, 0]];
    let normals: [[i8; 4]; 4] = [[-76, -76, -76, 0], [127, 0, 0, 0], [0, 127, 0, 0], [0, 0, 127, 0]];
    let start = small.binary.len();
    small.binary.extend(positions.iter().flatten().flat_map(|x| x.to_le_bytes()));
    small.binary.extend(normals.iter().flatten().flat_map(|x| x.to_le_bytes()));
    let views = small.json["bufferViews"].as_array_mut().expect("a list");
    views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": 32, "byteStride": 8 }));
    views.push(json!({ "buffer": 0, "byteOffset": start + 32, "byteLength": 16, "byteStride": 4 }));
    let length = small.binary.len();
    let accessor = |view: u32, component: u32| json!({ "bufferView": view, "componentType": component, "normalized": true, "type": "VEC3", "count": 4 });
    small
        .with("/buffers/0/byteLength", json!(length))
        .with("/accessors/0", accessor(4, 5122))
        .with("/accessors/1", accessor(5, 5120))
        .with("/extensionsRequired", json!(["KHR_mesh_quantization"]))
}

#[test]
fn quantized_meshes_are_the_same_meshes() {
    let (plain, scene) = (Small::new().good(), quantized().good());
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    assert_eq!(scene.mesh.positions, plain.mesh.positions);
    for (found, expected) in scene.mesh.normals.iter().zip(&plain.mesh.normals) {
        assert!((*found - *expected).length() < 0.01, "{found} for {expected}");
    }
    let whole = quantized()
        .with("/accessors/0/normalized", json!(false))
        .with("/nodes/0/scale", json!([1.0 / 32_767.0, 1.0 / 32_767.0, 1.0 / 32_767.0]))
        .good();
    for (found, expected) in whole.mesh.positions.iter().zip(&plain.mesh.positions) {
        assert!((*found - *expected).length() < 1e-6);
    }
    let undeclared = quantized().with("/extensionsRequired", Value::Null);
    assert!(undeclared.error().contains("accessor 0"));
}

#[test]
fn a_scene_may_stand_anywhere_by_each_of_its_nodes_or_by_one_parent() {
    let (offset, small) = (DVec3::new(430_000.3, -17.7, 5_400_000.1), Small::new());
    let here = small.clone().good();
    let mut each = small.clone();
    for node in each.json["nodes"].as_array_mut().expect("a list") {
        let own = node["translation"]
            .as_array()
            .map_or(DVec3::ZERO, |t| DVec3::from_array([0, 1, 2].map(|i| t[i].as_f64().unwrap())));
        node["translation"] = json!((own + offset).to_array());
    }
    let mut parent = small;
    let node = json!({ "translation": offset.to_array(), "children": [0, 1, 2, 3] });
    parent.json["nodes"].as_array_mut().expect("a list").push(node);
    let matrix = |small: &Small| {
        let mut small = small.clone();
        for node in small.json["nodes"].as_array_mut().expect("a list") {
            let Some(place) = node.as_object_mut().unwrap().remove("translation") else { continue };
            let place: Vec<f64> = place.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
            node["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, place[0], place[1], place[2], 1]);
        }
        small
    };
    assert!((offset.as_vec3().as_dvec3() - offset).length() > 0.05, "f32 would lose it");
    for moved in [matrix(&each), each, parent.with("/scenes/0/nodes", json!([4]))] {
        let there = moved.good();
        assert!((there.origin - offset - here.origin).length() < 1e-8);
        for (found, expected) in there.mesh.positions.iter().zip(&here.mesh.positions) {
            assert!((*found - *expected).length() < 1e-6, "{found} for {expected}");
        }
        assert!((there.camera.position - here.camera.position).length() < 1e-6);
        let Luminaire::Point { position, .. } = there.luminaires[0] else { panic!("a point light") };
        assert!((position - Vec3::new(0.0, 3.0, 0.0)).length() < 1e-6);
    }
}

/// The small scene whose tetrahedron hangs on two joints, at half weight each but for its last vertex.
fn skinned() -> Small {
    let mut small = Small::new();
    let start = small.binary.len();
    let joints: [[u8; 4]; 4] = [[0, 1, 9, 0], [0, 1, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0]];
    let weights: [[f32; 4]; 4] =
        [[0.5, 0.5, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]];
    // Both joints were bound at (0, 0, 10).
    let back: [f32; 16] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., -10., 1.];
    small.binary.extend(joints.as_flattened());
    small.binary.extend(weights.iter().flatten().chain(&back).chain(&back).flat_map(|x| x.to_le_bytes()));
    let length = small.binary.len();
    for (offset, size) in [(0, 16), (16, 64), (80, 128)] {
        let view = json!({ "buffer": 0, "byteOffset": start + offset, "byteLength": size });
        small.json["bufferViews"].as_array_mut().expect("a list").push(view);
    }
    let accessors = small.json["accessors"].as_array_mut().expect("a list");
    accessors.push(json!({ "bufferView": 4, "componentType": 5121, "type": "VEC4", "count": 4 }));
    accessors.push(json!({ "bufferView": 5, "componentType": 5126, "type": "VEC4", "count": 4 }));
    accessors.push(json!({ "bufferView": 6, "componentType": 5126, "type": "MAT4", "count": 2 }));
    let nodes = small.json["nodes"].as_array_mut().expect("a list");
    nodes.push(json!({ "name": "Root", "translation": [0, 5, 10], "children": [5, 6] }));
    nodes.push(json!({ "name": "A", "translation": [1, 0, 0] }));
    nodes.push(json!({ "name": "B", "translation": [3, 0, 0] }));
    small
        .with("/buffers/0/byteLength", json!(length))
        .with(
            "/meshes/0/primitives/0/attributes",
            json!({ "POSITION": 0, "NORMAL": 1, "JOINTS_0": 4, "WEIGHTS_0": 5 }),
        )
        .with("/skins", json!([{ "joints": [5, 6], "inverseBindMatrices": 6 }]))
        .with("/nodes/0/skin", json!(0))
        .with("/scenes/0/nodes", json!([0, 1, 2, 3, 4]))
}

#[test]
fn skins_stand_where_their_joints_are_whatever_node_the_mesh_hangs_on() {
    // The transform of the mesh's node: hands that hung a hundred times too far away.
    let hung = skinned()
        .with("/nodes/0/scale", json!([100, 100, 100]))
        .with("/nodes/0/translation", json!([7, 8, 9]));
    for small in [skinned(), hung] {
        let scene = small.good();
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        let world: Vec<DVec3> =
            scene.mesh.positions[..4].iter().map(|p| p.as_dvec3() + scene.origin).collect();
        // Half way between the joints, (2, 5, 10), less where they were bound; the last vertex on the second alone.
        let expected = [[2.0, 5.0, 0.0], [3.0, 5.0, 0.0], [2.0, 6.0, 0.0], [3.0, 5.0, 1.0]];
        for place in expected {
            let place = DVec3::from_array(place);
            assert!(world.iter().any(|p| p.distance(place) < 1e-5), "{place} is not in {world:?}");
        }
    }
    let turned = skinned().with("/nodes/4/scale", json!([1, 1, -1])).good();
    let centre = turned.mesh.positions[..4].iter().sum::<Vec3>() / 4.0;
    for triangle in 0..4 {
        let [a, ..] = turned.mesh.corners(triangle);
        assert!(turned.mesh.normal(triangle).dot(a - centre) > 0.0, "mirrored joints keep the front");
    }
}

#[test]
fn damaged_skins_are_named() {
    let mut beyond = skinned();
    beyond.binary[168 + 1] = 7; // vertex 0 at half weight on joint 7
    assert!(beyond.error().contains("joint 7"));
    assert!(skinned().with("/nodes/0/skin", json!(3)).error().contains("skin 3"));
    assert!(
        skinned().with("/accessors/6/count", json!(1)).error().contains("skin 0 has 2 joints and 1 inverse")
    );
    let lost = skinned().with("/scenes/0/nodes", json!([0, 1, 2, 3])).good();
    assert!(note(&lost, "seen unposed: Body"));
    let negative = skinned().with_float((168 + 16) / 4, -0.5);
    assert!(negative.error().contains("joint weight"));
}

#[test]
fn light_beyond_single_precision_is_refused() {
    let light = "/extensions/KHR_lights_punctual/lights/0";
    assert!(
        Small::new()
            .with(&format!("{light}/intensity"), json!(1e38))
            .error()
            .contains("light `Lux`: its power")
    );
    assert!(Small::new().with(&format!("{light}/intensity"), json!(1e34)).load().is_ok());
    let glow = Small::new().with("/materials/0/emissiveFactor", json!([1e38, 1e38, 1e38]));
    assert!(glow.error().contains("`Body` shines with more power"));
}

#[test]
fn a_spot_however_narrow_has_its_power() {
    for angle in [0.3_f64, 1e-3, 1e-4, 1e-6, 1e-8] {
        let light = "/extensions/KHR_lights_punctual/lights/0";
        let cone = json!({ "innerConeAngle": angle, "outerConeAngle": angle });
        let small =
            Small::new().with(&format!("{light}/type"), json!("spot")).with(&format!("{light}/spot"), cone);
        let scene = small.with(&format!("{light}/intensity"), json!(1e9)).good();
        let power = f64::from(scene.luminaires[0].power(1.0).visible.x);
        let expected = 1e9 * 4.0 * std::f64::consts::PI * (0.5 * angle).sin().powi(2);
        assert!((power / expected - 1.0).abs() < 1e-6, "{angle}: {power} W for {expected}");
        assert_eq!(note(&scene, "spots that light less than a pixel"), angle < 1e-3);
    }
}

#[test]
fn no_light_is_lit_by_the_studio_which_says_what_blender_needs() {
    let dark = Small::new().with("/nodes/2/extensions", Value::Null);
    let told = |file: &Small| file.clone().good().notes.join("; ");
    let plain = told(&dark);
    assert!(plain.contains("the built-in studio lights it") && !plain.contains("Blender"), "{plain}");
    let blender = told(&dark.with("/asset/generator", json!("Khronos glTF Blender I/O v5.0.21")));
    for needle in
        ["area lights", "World", "Punctual Lights", "Cameras", "Custom Properties", "docs/blender.md"]
    {
        assert!(blender.contains(needle), "`{needle}` is not in: {blender}");
    }
}

#[test]
fn where_nothing_shines_what_else_was_lost_is_told_too() {
    let dark = Small::new().with("/nodes/2/extensions", Value::Null).with("/animations", json!([{}]));
    let none = dark.with("/scenes/0/extras", json!({ "environment": "none" })).error();
    for needle in ["nothing emits light", "--environment studio", "Besides: is seen at rest"] {
        assert!(none.contains(needle), "`{needle}` is not in: {none}");
    }
}

#[test]
fn json_of_any_depth_is_refused_in_a_line() {
    let deep = format!(
        "{{\"asset\": {{\"version\": \"2.0\"}}, \"extras\": {}1{}}}",
        "[".repeat(5000),
        "]".repeat(5000)
    );
    assert!(message("deep.gltf", load_bytes("deep.gltf", deep.as_bytes())).contains("damaged"));
    let list = Small::new().glb();
    let mut array = list.clone();
    array[20] = b'[';
    assert!(message("array.glb", load_bytes("array.glb", &array)).contains("damaged"));
}
