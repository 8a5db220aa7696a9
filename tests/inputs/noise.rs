//! Random damage: a file is read or refused, it never brings the program down.

use crate::damage;
use crate::small::{Small, load_bytes};
use glam::Vec3;
use halflight::film::{
    Asides, Film, Header, Key, Layer, PassImage, Preview, StateFile, StateHead, read_exr, write_exr,
    write_state,
};
use proptest::prelude::*;
use std::path::Path;

fn rich() -> Small {
    let extras = serde_json::json!({ "illumination": [0.5, 0.5], "emission": "both", "thin": false });
    let glass = serde_json::json!({ "KHR_materials_transmission": { "transmissionFactor": 0.5 },
        "KHR_materials_emissive_strength": { "emissiveStrength": 2 } });
    let profile = "data:;base64,VElMVD1OT05FCjEgLTEgMSAyIDEgMSAyIDAgMCAwIDEgMSA2MCAwIDkwIDAgNSA1";
    let mut small = Small::new();
    let lamp = serde_json::json!({ "light": 0, "multiplier": 2, "color": [1, 1, 0] });
    small.json["nodes"][0]["extensions"] = serde_json::json!({ "EXT_lights_ies": lamp });
    small.json["extensions"]["EXT_lights_ies"] = serde_json::json!({ "lights": [{ "uri": profile }] });
    small
        .with("/materials/0/extras", extras)
        .with("/materials/0/extensions", glass)
        .with("/materials/0/emissiveFactor", serde_json::json!([1, 1, 1]))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bytes_of_a_glb(hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = rich().glb();
        for (index, value) in hits {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        damage::scene(&bytes);
    }

    #[test]
    fn floats_and_indices_of_a_glb(hits in prop::collection::vec((0_usize..168, any::<u8>()), 1..20)) {
        let mut small = rich();
        for (index, value) in hits {
            small.binary[index] = value;
        }
        damage::scene(&small.glb());
    }

    #[test]
    fn length_of_a_glb(cut in any::<prop::sample::Index>()) {
        let bytes = rich().glb();
        damage::scene(&bytes[..cut.index(bytes.len())]);
    }

    #[test]
    fn values_in_the_json(hits in prop::collection::vec((any::<prop::sample::Index>(), 0_usize..12), 1..4)) {
        let mut small = rich().embedded();
        for (index, kind) in hits {
            let mut leaves = Vec::new();
            collect(&small.json, String::new(), &mut leaves);
            let pointer = &leaves[index.index(leaves.len())];
            let strange = [
                "null", "-1", "0", "1", "4294967296", "18446744073709551615", "1e39", "-1e30", "[]", "{}", "\"x\"", "true",
            ][kind];
            *small.json.pointer_mut(pointer).expect("a leaf") = serde_json::from_str(strange).expect("json");
        }
        damage::scene(small.json.to_string().as_bytes());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Parts are lost, doubled and put in each other's places: accessors, nodes, extras, whole lists.
    #[test]
    fn structure_of_the_json(
        hits in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0_usize..4), 1..5)
    ) {
        let mut small = rich().embedded();
        for (index, other, change) in hits {
            let mut places = Vec::new();
            collect(&small.json, String::new(), &mut places);
            let (place, from) = (&places[index.index(places.len())], &places[other.index(places.len())]);
            let part = small.json.pointer(from).expect("a place").clone();
            match change {
                0 => *small.json.pointer_mut(place).expect("a place") = part,
                1 => match small.json.pointer_mut(place).expect("a place") {
                    serde_json::Value::Array(list) => list.push(part),
                    serde_json::Value::Object(map) => drop(map.insert("extras".into(), part)),
                    other => *other = part,
                },
                2 => match small.json.pointer_mut(place).expect("a place") {
                    serde_json::Value::Array(list) => drop(list.pop()),
                    serde_json::Value::Object(map) => map.clear(),
                    other => *other = serde_json::Value::Null,
                },
                _ => if let Some((parent, key)) = place.rsplit_once('/')
                    && let Some(serde_json::Value::Object(map)) = small.json.pointer_mut(parent) {
                    map.remove(key);
                }
            }
            prop_assume!(small.json.to_string().len() < 200_000);
        }
        damage::scene(small.json.to_string().as_bytes());
    }

    /// Nodes that have each other, themselves or nothing for children, and places far from anything.
    #[test]
    fn node_graphs(links in prop::collection::vec((0_usize..6, 0_usize..8), 0..10), x in prop::num::f32::ANY) {
        let mut small = rich().embedded();
        let node = |i: usize| {
            let children: Vec<usize> = links.iter().filter(|(from, _)| *from == i).map(|(_, to)| *to).collect();
            let mut node = serde_json::json!({ "mesh": 0, "translation": [x, 0, 0] });
            if !children.is_empty() {
                node["children"] = children.into();
            }
            node
        };
        let nodes = small.json["nodes"].as_array_mut().expect("nodes");
        nodes.extend((0..6).map(node));
        let count = nodes.len();
        small.json["scenes"][0]["nodes"] = (0..count).collect::<Vec<_>>().into();
        damage::scene(small.json.to_string().as_bytes());
    }
}

/// A picture of 5×3 pixels with two layers, as a render writes it.
fn picture() -> Vec<u8> {
    let layers = [Layer::Visible, Layer::Depth];
    let mut film = Film::new(5, 3, &layers);
    let planes =
        film.accumulated().map(|layer| (layer, (0..15).map(|i| Vec3::splat(i as f32)).collect())).collect();
    film.add(&PassImage { width: 5, height: 3, planes, asides: Asides::default() });
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("picture.exr");
    write_exr(&path, &film, &Header::new()).expect("written");
    std::fs::read(path).expect("read")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bytes_of_an_exr(hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = picture();
        for (index, value) in hits {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        damage::exr(&bytes);
    }

    #[test]
    fn length_of_an_exr(cut in any::<prop::sample::Index>()) {
        let bytes = picture();
        damage::exr(&bytes[..cut.index(bytes.len())]);
    }
}

/// A state of two passes of 5×3 pixels, as a render stores it.
fn state() -> Vec<u8> {
    let layers = [Layer::Visible, Layer::Error, Layer::Depth];
    let mut film = Film::new(5, 3, &layers);
    for pass in 0..2 {
        let value =
            |i: u32| Vec3::new(0.1 + i as f32, 1.0 / (1 + pass + i) as f32, if i == 7 { 1e30 } else { 0.0 });
        let planes = film.accumulated().map(|layer| (layer, (0..15).map(value).collect())).collect();
        film.add(&PassImage { width: 5, height: 3, planes, asides: Asides::default() });
    }
    let head = StateHead {
        key: Key([("scene".to_owned(), "a".to_owned())].into()),
        pass_size: 1,
        width: 5,
        height: 3,
        layers: film.layers().to_vec(),
        passes: film.pass_set().clone(),
        photons: 0,
        nanoseconds: 0,
        facts: Header::new(),
        preview: Preview::from(0.0),
        annex: None,
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.halflight");
    write_state(&path, &head, &film).expect("written");
    std::fs::read(path).expect("read")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bytes_of_a_state(hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = state();
        for (index, value) in hits {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        damage::state(&bytes);
    }
}

/// A state of three passes of 5×3 pixels with an atlas.
fn state_with_an_atlas() -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/state/atlas.halflight"))
        .expect("a seed")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bytes_of_a_state_with_an_atlas(
        hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        from_the_end in 1..8_usize,
    ) {
        let mut bytes = state_with_an_atlas();
        // Most of it are numbers, any of which is one; what is to be known of them stands before.
        let within = bytes.len() / from_the_end;
        for (index, value) in hits {
            let at = index.index(within);
            bytes[at] = value;
        }
        damage::state(&bytes);
    }
}

/// So that damage of states is not refused for what they all have in common.
#[test]
fn the_seeds_of_states_are_of_the_format_as_it_is() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/state");
    let seeds = std::fs::read_dir(folder).expect("seeds").map(|seed| seed.expect("a seed").path());
    let read = seeds.map(|seed| StateFile::open(&seed).map(drop)).collect::<Result<Vec<()>, _>>();
    assert_eq!(read.expect("states").len(), 3);
    damage::state(&state());
    damage::state(&state_with_an_atlas());
}

fn collect(value: &serde_json::Value, path: String, leaves: &mut Vec<String>) {
    match value {
        serde_json::Value::Object(map) => {
            map.iter().for_each(|(k, v)| collect(v, format!("{path}/{k}"), leaves));
        }
        serde_json::Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, v)| collect(v, format!("{path}/{i}"), leaves));
        }
        _ => {}
    }
    leaves.push(path);
}

#[test]
fn the_undamaged_file_is_good() {
    assert!(load_bytes("rich.glb", &rich().glb()).is_ok());
}

#[test]
fn the_undamaged_picture_is_good() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("picture.exr");
    std::fs::write(&path, picture()).expect("written");
    let image = read_exr(&path).expect("a picture");
    assert_eq!((image.width, image.height, image.layers.len()), (5, 3, 2));
}
