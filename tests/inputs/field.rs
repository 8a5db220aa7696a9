//! Files that others made: those of ../shared that are there. Where they are not, these tests say so and pass.

use crate::damage;
use halflight::scene::{Choice, Projection, Scene};
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

/// A file beside the repository; None, and a word, where it is not there.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(name);
    if path.is_file() {
        return Some(path);
    }
    println!("SKIPPED: {name} is not in ../shared");
    None
}

/// As it is found in; scenes without light are taken.
fn found(path: &Path, choice: &Choice) -> Scene {
    let choice = Choice { dark: true, ..choice.clone() };
    Scene::load_chosen(path, &choice).unwrap_or_else(|e| panic!("{e}")).scene
}

fn note(scene: &Scene, needle: &str) -> bool {
    scene.notes.iter().any(|note| note.contains(needle))
}

#[test]
fn all_of_the_corpus_is_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/corpus");
    let files = fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    for path in files.filter(|path| path.extension().is_some_and(|ending| ending == "glb")) {
        let scene = found(&path, &Choice::default());
        let (centre, radius) = scene.bounding_sphere();
        println!("{}: {} triangles, {radius} m about {centre}", path.display(), scene.mesh.triangles.len());
        assert!(radius > 0.0 && scene.mesh.normals.iter().all(|n| n.is_finite()));
    }
}

/// Triangles and bounds, m, as other viewers have them.
#[track_caller]
fn is(scene: &Scene, triangles: usize, min: [f64; 3], max: [f64; 3]) {
    let (low, high) = scene.mesh.bounds();
    let bounds = [low, high].map(|corner| (corner.as_dvec3() + scene.origin).to_array());
    let expected = [min, max];
    let off = bounds.iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs());
    let size = f64::from((high - low).length());
    assert!(off.fold(0.0, f64::max) < 2e-3 * size, "{bounds:?}");
    assert_eq!(scene.mesh.triangles.len(), triangles);
}

#[test]
fn packed_files_are_what_was_packed() {
    let plain = Choice::default();
    // What Google's own decoder makes of it, and the bounds of the accessors through the nodes.
    if let Some(path) = shared("corpus/carbon-sphere.glb") {
        is(&found(&path, &plain), 211_118, [-7.138, -6.365, -6.943], [6.865, 7.290, 6.943]);
    }
    if let Some(path) = shared("corpus/stanford-bunny.glb") {
        is(&found(&path, &plain), 144_046, [-0.9559, 0.021, -0.543], [0.6579, 1.6418, 0.6895]);
    }
    // Its accessors: 0 to 13081, 16383 and 3915 times 1.16282e-4, from (−.76058, −.00109, −.22947).
    if let Some(path) = shared("corpus/pirate.glb") {
        is(&found(&path, &plain), 5_010, [-0.7606, -0.0011, -0.2295], [0.7605, 1.9040, 0.2258]);
    }
}

#[test]
fn copies_poses_and_targets_of_the_corpus() {
    let at = |pose: &str| Choice { pose: Some(pose.parse().expect("a pose")), ..Choice::default() };
    if let Some(path) = shared("corpus/simple-instancing.glb") {
        let scene = found(&path, &Choice::default());
        assert_eq!((scene.surfaces.len(), scene.mesh.triangles.len()), (125, 1500));
    }
    if let Some(path) = shared("corpus/Fox.glb") {
        let rest = found(&path, &Choice::default());
        assert!(note(&rest, "Survey") && note(&rest, "Walk"), "{:?}", rest.notes);
        let (walk, later) = (found(&path, &at("Walk:0.2")), found(&path, &at("Walk:0.5")));
        assert_ne!(walk.mesh.positions, rest.mesh.positions);
        assert_ne!(walk.mesh.positions, later.mesh.positions);
        assert!((walk.bounding_sphere().1 / rest.bounding_sphere().1 - 1.0).abs() < 0.2, "a fox stays one");
    }
    if let Some(path) = shared("corpus/morph-stress-test.glb") {
        let rest = found(&path, &Choice::default());
        let pulse = found(&path, &at("Pulse:0.5"));
        assert!(
            pulse.mesh.bounds().1.y + pulse.origin.y as f32
                > rest.mesh.bounds().1.y + rest.origin.y as f32 + 0.1
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    /// Bytes of the binary chunk, where streams, keys and targets are.
    #[test]
    fn damaged_files_of_the_corpus(
        which in 0_usize..5,
        hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
    ) {
        let name = ["pirate", "simple-instancing", "Fox", "morph-stress-test", "japanese-bridge-garden"][which];
        if let Some(path) = shared(&format!("corpus/{name}.glb")) {
            let mut bytes = fs::read(path).expect("a file");
            let start = 28 + bytes[12..16].iter().rev().fold(0, |n, byte| n << 8 | usize::from(*byte));
            for (index, value) in hits {
                let at = start + index.index(bytes.len() - start);
                bytes[at] = value;
            }
            damage::scene(&bytes);
        }
    }
}

#[test]
fn geometry_scene_and_camera_of_the_field() {
    let plain = Choice::default();
    let load = |name: &str| shared(&format!("field/gltf/{name}.gltf")).map(|path| found(&path, &plain));
    for name in
        ["animation-pointer-without-node", "integer-written-as-float", "nodes-but-no-scene", "quantized"]
    {
        if let Some(scene) = load(name) {
            assert!(scene.mesh.triangles.len() > 1, "{name}");
        }
    }
    for extension in [
        "EXT_texture_webp",
        "KHR_materials_clearcoat",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_xmp_json_ld",
    ] {
        if let Some(scene) = load(&format!("required-{extension}")) {
            assert!(!scene.mesh.triangles.is_empty(), "{extension}");
        }
    }
    if let Some(scene) = load("two-scenes") {
        assert!(note(&scene, "--scene NAME or N"), "{:?}", scene.notes);
    }
    if let Some(scene) = load("camera-16-to-9") {
        assert!((scene.camera.aspect.expect("an aspect") - 16.0 / 9.0).abs() < 1e-3);
    }
    if let Some(scene) = load("nodes-but-no-scene") {
        assert!(matches!(scene.camera.projection, Projection::Perspective { .. }));
    }
}
