//! Packed geometry: what it unpacks to is what was packed, and damage is told in a line.

use crate::damage;
use crate::small::{Small, message};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use halflight::scene::{Choice, Scene};
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{
    ExpMode, IndexEncoding, VertexEncoding, encode_filter_exp, encode_filter_oct, encode_index_buffer,
    encode_index_sequence, encode_vertex_buffer,
};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeSet;

const EXT: &str = "EXT_meshopt_compression";
const KHR: &str = "KHR_meshopt_compression";
const DRACO: &str = "KHR_draco_mesh_compression";

/// Triangles whichever corner comes first, each corner with its place and normal in 64ths.
fn facets(scene: &Scene) -> BTreeSet<[[i64; 6]; 3]> {
    let mesh = &scene.mesh;
    let corner = |vertex: u32| {
        let place = mesh.positions[vertex as usize].as_dvec3() + scene.origin;
        let normal = mesh.normals[vertex as usize].as_dvec3();
        [place.x, place.y, place.z, normal.x, normal.y, normal.z].map(|x| (64.0 * x).round() as i64)
    };
    let facet = |triangle: &[u32; 3]| {
        let mut corners = triangle.map(corner);
        let first = (0..3).min_by_key(|i| corners[*i]).expect("three");
        corners.rotate_left(first);
        corners
    };
    mesh.triangles.iter().map(facet).collect()
}

/// The small scene with every buffer view packed, by name and version of the streams.
fn by_meshopt(name: &str, version: u8) -> Small {
    let mut small = Small::new();
    let plain = std::mem::take(&mut small.binary);
    let mut space = Workspace::default();
    let vertices = VertexEncoding::new(version, 2).expect("a version");
    let floats = |bytes: &[u8]| -> Vec<f32> {
        bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
    };
    let normals: Vec<f32> =
        floats(&plain[48..96]).as_chunks::<3>().0.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0.0]).collect();
    let oct = encode_filter_oct(4, 4, 8, &normals, &mut space).expect("normals");
    let exp = encode_filter_exp(4, 12, 15, &floats(&plain[120..168]), ExpMode::SharedVector, &mut space);
    let indices: Vec<u32> =
        plain[96..120].as_chunks::<2>().0.iter().map(|bytes| u16::from_le_bytes(*bytes).into()).collect();
    let streams = [
        encode_vertex_buffer(&plain[..48], 4, 12, vertices, &mut space).expect("positions"),
        encode_vertex_buffer(&oct, 4, 4, vertices, &mut space).expect("normals"),
        encode_index_buffer(&indices, IndexEncoding::DEFAULT, &mut space).expect("triangles"),
        encode_vertex_buffer(&exp.expect("floats"), 4, 12, vertices, &mut space).expect("positions"),
        encode_index_sequence(&[0, 1, 2, 3], IndexEncoding::DEFAULT, &mut space).expect("a strip"),
    ];
    let says = [
        ("ATTRIBUTES", "NONE", 4, 12),
        ("ATTRIBUTES", "OCTAHEDRAL", 4, 4),
        ("TRIANGLES", "NONE", 12, 2),
        ("ATTRIBUTES", "EXPONENTIAL", 4, 12),
        ("INDICES", "NONE", 4, 4),
    ];
    let mut offset = 0;
    let mut views = Vec::new();
    for (stream, (mode, filter, count, stride)) in streams.iter().zip(says) {
        let packing = json!({ "buffer": 0, "byteOffset": small.binary.len(), "byteLength": stream.len(),
            "byteStride": stride, "count": count, "mode": mode, "filter": filter });
        let length = count * stride;
        let mut view = json!({ "buffer": 1, "byteOffset": offset, "byteLength": length, "extensions": { name: packing } });
        if mode == "ATTRIBUTES" {
            view["byteStride"] = json!(stride);
        }
        views.push(view);
        offset += length;
        small.binary.extend(stream);
    }
    let fallback = json!({ "byteLength": offset, "extensions": { name: { "fallback": true } } });
    let length = small.binary.len();
    let accessors = small.json["accessors"].as_array_mut().expect("a list");
    accessors.push(json!({ "bufferView": 4, "componentType": 5125, "type": "SCALAR", "count": 4 }));
    small
        .with("/buffers", json!([{ "byteLength": length }, fallback]))
        .with("/bufferViews", json!(views))
        .with("/accessors/1/componentType", json!(5120))
        .with("/accessors/1/normalized", json!(true))
        .with("/meshes/1/primitives/0/indices", json!(4))
        .with("/extensionsUsed", json!([name, "KHR_mesh_quantization"]))
        .with("/extensionsRequired", json!([name, "KHR_mesh_quantization"]))
}

#[test]
fn buffer_views_packed_by_meshopt_unpack_to_the_same_scene() {
    let plain = facets(&Small::new().good());
    assert_eq!(plain.len(), 6);
    for (name, version) in [(EXT, 0), (EXT, 1), (KHR, 0), (KHR, 1)] {
        let scene = by_meshopt(name, version).good();
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        assert_eq!(facets(&scene), plain, "{name} {version}");
        // The fallback is not asked for, whether or not the file says that it cannot do without the extension.
        let used = by_meshopt(name, version).with("/extensionsRequired", json!(["KHR_mesh_quantization"]));
        let gone = used.with("/buffers/1/uri", json!("not-there.bin")).good();
        assert_eq!(facets(&gone), plain);
    }
}

#[test]
fn plain_numbers_beside_packed_ones_are_read_where_a_file_has_both() {
    let garbage =
        json!({ EXT: { "buffer": 0, "byteLength": 48, "count": 4, "byteStride": 12, "mode": "ATTRIBUTES" } });
    let small = Small::new().with("/bufferViews/0/extensions", garbage);
    assert_eq!(facets(&small.clone().good()), facets(&Small::new().good()));
    let required = small.with("/extensionsRequired", json!([EXT]));
    let error = required.error();
    assert!(error.contains("accessor 0") && error.contains(EXT) && error.contains("is damaged"), "{error}");
}

#[test]
fn what_is_wrong_with_a_packed_view_is_told() {
    let packing = format!("/bufferViews/0/extensions/{EXT}");
    let with = |key: &str, value: Value| by_meshopt(EXT, 0).with(&format!("{packing}/{key}"), value).error();
    let cases = [
        ("mode", json!("WORDS"), "an unknown mode"),
        ("filter", json!("BLUR"), "an unknown filter"),
        ("filter", json!("QUATERNION"), "is damaged"),
        ("count", Value::Null, "no count"),
        ("count", json!(3), "beyond its buffer view"),
        ("byteStride", json!(13), "is damaged"),
        ("byteLength", json!(1_000_000), "leads to no bytes"),
        ("byteOffset", json!(u64::MAX), "leads to no bytes"),
        ("buffer", json!(7), "leads to no bytes"),
    ];
    for (key, value, needle) in cases {
        let error = with(key, value);
        assert!(error.contains(needle) && error.contains("export it again"), "{error}");
    }
    let many = with("count", json!(1_u64 << 40));
    assert!(many.contains("MB of packed buffer views"), "{many}");
    // Also where an animation would read it before the scene is counted.
    let lively = by_meshopt(EXT, 0)
        .with(&format!("{packing}/count"), json!(1_u64 << 40))
        .with("/animations", json!([{ "channels": [], "samplers": [] }]));
    let folder = tempfile::TempDir::new().expect("a folder");
    let path = folder.path().join("small.gltf");
    std::fs::write(&path, lively.embedded().json.to_string()).expect("written");
    let pose = Some("1".parse().expect("a pose"));
    let refused = Scene::load_chosen(path, &Choice { pose, ..Choice::default() }).map(|loaded| loaded.scene);
    assert!(message("small.gltf", refused).contains("MB of packed buffer views"));
    let index = format!("/bufferViews/2/extensions/{EXT}/filter");
    let filtered = by_meshopt(EXT, 0).with(&index, json!("OCTAHEDRAL")).error();
    assert!(filtered.contains("only attributes"), "{filtered}");
}

/// The tetrahedron with its normals as Draco 1.5.7 packs it: unquantized, edge breaker, level 7; 2 is the normal, 3 the position.
const TETRAHEDRON: &str = "RFJBQ08CAgEBAAAABAQDAwAAAS8BARD/AmZA/wJmQP8CZkAEAAAAAQAAAgAA/wAAAQICBAEAAQEDCQIBAQABAQkDAAIA\
AQAJAwADAgEBAQAIBwEQCwEQASADABiQFBQPOjn1oiFW4AMAAAAA/wAAAAAAAD8AAAA/AAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAAAA\
mpkZv5qZGb+amRm/AACAPwAAAAAAAAAAAQEBAAMDARABMAMAUIIkkQQAAAAA/z8AAAAAAAAAAAAAAAAAAAAAgD8O";

fn by_draco() -> Small {
    let mut small = Small::new();
    let stream = STANDARD.decode(TETRAHEDRON).expect("base64");
    let start = small.binary.len();
    small.binary.extend(&stream);
    small.binary.resize(small.binary.len().next_multiple_of(4), 0);
    let length = small.binary.len();
    let view = json!({ "buffer": 0, "byteOffset": start, "byteLength": stream.len() });
    small.json["bufferViews"].as_array_mut().expect("a list").push(view);
    let packing = json!({ DRACO: { "bufferView": 4, "attributes": { "POSITION": 3, "NORMAL": 2 } } });
    for accessor in 0..3 {
        small = small.with(&format!("/accessors/{accessor}/bufferView"), Value::Null);
    }
    small
        .with("/buffers/0/byteLength", json!(length))
        .with("/meshes/0/primitives/0/extensions", packing)
        .with("/extensionsUsed", json!([DRACO]))
        .with("/extensionsRequired", json!([DRACO]))
}

#[test]
fn primitives_packed_by_draco_unpack_to_the_same_scene() {
    let plain = facets(&Small::new().good());
    let scene = by_draco().good();
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    assert_eq!(facets(&scene), plain);
    assert!(scene.surfaces[0].closed && scene.surfaces[0].smooth);
    // What the accessors announce does not count; what is packed does.
    let announced = by_draco().with("/accessors/0/count", json!(3)).with("/accessors/2/count", json!(3));
    assert_eq!(facets(&announced.good()), plain);
    let bytes = by_draco().with("/accessors/2/componentType", json!(5121));
    assert_eq!(facets(&bytes.good()), plain, "indices of the type that the accessor says");
}

#[test]
fn packed_strips_are_the_faces_that_are_packed() {
    let plain = facets(&Small::new().good());
    let mode = |mode: u32| by_draco().with("/meshes/0/primitives/0/mode", json!(mode));
    let strip = mode(5).good();
    assert!(strip.notes.is_empty(), "{:?}", strip.notes);
    assert_eq!(facets(&strip), plain);
    assert_eq!(strip.mesh.triangles.len(), plain.len());
    // A strip of four faces has six corners.
    assert_eq!(facets(&mode(5).with("/accessors/2/count", json!(6)).good()), plain);
    let fan = mode(6).error();
    assert!(fan.contains("mesh `Tetra`") && fan.contains("a triangle fan packed by"), "{fan}");
    // Lines are no surface, packed or not.
    assert_eq!(facets(&mode(1).good()).len(), 2);
}

#[test]
fn what_is_wrong_with_a_packed_primitive_is_told() {
    let at = format!("/meshes/0/primitives/0/extensions/{DRACO}");
    let expect = |small: Small, needle: &str| {
        let error = small.error();
        assert!(error.contains("mesh `Tetra`") && error.contains(needle), "{error}");
    };
    expect(by_draco().with(&format!("{at}/bufferView"), json!(9)), "does not exist");
    expect(by_draco().with(&format!("{at}/bufferView"), json!(0)), "is damaged");
    expect(by_draco().with(&format!("{at}/attributes/NORMAL"), json!(8)), "no attribute 8");
    expect(by_draco().with(&format!("{at}/attributes/NORMAL"), json!(1)), "accessor 1");
    expect(by_draco().with("/accessors/1/type", json!("VEC9")), "unknown type");
    expect(by_draco().with("/meshes/0/primitives/0/indices", Value::Null), "without indices");
    let again = by_draco().json["meshes"][0]["primitives"][0].clone();
    let mut twice = by_draco();
    twice.json["meshes"][0]["primitives"].as_array_mut().expect("a list").push(again);
    expect(twice, "packed twice");
    let mut cut = by_draco();
    cut.json["bufferViews"][4]["byteLength"] = json!(100);
    expect(cut, "is damaged");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_streams_of_meshopt(
        version in 0_u8..2,
        hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut small = by_meshopt(KHR, version);
        for (index, value) in hits {
            let at = index.index(small.binary.len());
            small.binary[at] = value;
        }
        damage::scene(&small.glb());
    }

    #[test]
    fn any_streams(bytes in prop::collection::vec(any::<u8>(), 4..200)) {
        damage::packed(&bytes);
    }

    #[test]
    fn damaged_streams_of_draco(hits in prop::collection::vec((168_usize..400, any::<u8>()), 1..6)) {
        let mut small = by_draco();
        for (at, value) in hits.into_iter().filter(|(at, _)| *at < small.binary.len()).collect::<Vec<_>>() {
            small.binary[at] = value;
        }
        damage::scene(&small.glb());
    }
}

/// Streams as the fuzz target `packed` takes them: damage to one of each codec.
#[test]
fn the_streams_of_the_fuzz_target_are_read() {
    for seed in std::fs::read_dir("fuzz/seeds/packed").expect("seeds") {
        damage::packed(&std::fs::read(seed.expect("a seed").path()).expect("bytes"));
    }
}
