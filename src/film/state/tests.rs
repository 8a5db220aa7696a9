//! States come back bit for bit, add up in any order, and are refused in one line where they are damaged.

use super::*;
use crate::error::Error;
use crate::film::{Asides, Film, Header, Layer, PassImage, PassSet, Preview};
use glam::Vec3;
use std::fs;
use std::path::{Path, PathBuf};

const LAYERS: [Layer; 4] = [Layer::Visible, Layer::Error, Layer::Bias, Layer::Depth];
const SIZE: (u32, u32) = (7, 5);

/// A number that depends on nothing but these three, of any size.
fn value(pass: u32, layer: Layer, at: usize) -> f32 {
    let mut x = (u64::from(pass) << 40) ^ ((layer as u64) << 32) ^ at as u64;
    for _ in 0..3 {
        x = (x ^ (x >> 31)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }
    let fraction = (x >> 40) as f32 / 2.0_f32.powi(24);
    match x & 63 {
        0 if layer == Layer::Depth => f32::INFINITY,
        1 => -fraction,
        2 => 0.0,
        3 => fraction * 1e-30,
        4 => fraction * 1e18,
        _ => fraction,
    }
}

fn image(pass: u32) -> PassImage {
    let (width, height) = SIZE;
    let planes = [Layer::Visible, Layer::Bias, Layer::Depth].map(|layer| {
        let pixel = |at: usize| Vec3::from_array([0, 1, 2].map(|axis| value(pass, layer, 3 * at + axis)));
        (layer, (0..(width * height) as usize).map(pixel).collect())
    });
    PassImage { width, height, planes: planes.into(), asides: Asides::default() }
}

fn film(passes: impl IntoIterator<Item = u32>) -> Film {
    let mut film = Film::new(SIZE.0, SIZE.1, &LAYERS);
    passes.into_iter().for_each(|pass| film.add_pass(pass, &image(pass)));
    film
}

fn head(film: &Film) -> StateHead {
    StateHead {
        key: Key([("scene".to_owned(), "a".to_owned())].into()),
        pass_size: 3,
        width: SIZE.0,
        height: SIZE.1,
        layers: film.layers().to_vec(),
        passes: film.pass_set().clone(),
        photons: 10 * u64::from(film.passes()),
        nanoseconds: u64::from(film.passes()),
        facts: Header::new()
            .with("scene", "Käfig")
            .with("k", 0.5)
            .with("k_at_most", 1.0)
            .with("passes", 1_u32),
        preview: Preview::from(0.5),
        annex: None,
    }
}

fn written(folder: &Path, name: &str, film: &Film) -> PathBuf {
    let path = folder.join(name);
    write_state(&path, &head(film), film).unwrap();
    path
}

fn read(path: &Path, film: &mut Film) -> crate::error::Result<StateHead> {
    let state = StateFile::open(path)?;
    let head = state.head().clone();
    state.add_to(film)?;
    Ok(head)
}

fn pixels(film: &Film) -> Vec<u32> {
    let all = LAYERS.iter().flat_map(|layer| film.mean(*layer));
    all.flat_map(|v| v.to_array()).map(f32::to_bits).collect()
}

#[test]
fn shards_merged_in_any_order_are_the_whole_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let whole = film(0..42);
    let bytes = fs::read(written(folder.path(), "whole", &whole)).unwrap();
    for shards in [2, 3, 7] {
        for turn in 0..shards {
            let mut merged = Film::new(SIZE.0, SIZE.1, &LAYERS);
            for shard in 0..shards {
                let shard = film(((shard + turn) % shards..42).step_by(shards as usize));
                read(&written(folder.path(), "shard", &shard), &mut merged).unwrap();
            }
            assert_eq!(pixels(&merged), pixels(&whole), "{shards} from {turn}");
            assert_eq!(merged.relative_error().unwrap().to_bits(), whole.relative_error().unwrap().to_bits());
            assert_eq!(merged.relative_bias().unwrap().to_bits(), whole.relative_bias().unwrap().to_bits());
            assert_eq!(merged.mean_colour_error(), whole.mean_colour_error());
            assert!(fs::read(written(folder.path(), "merged", &merged)).unwrap() == bytes, "another state");
            let mut in_memory = film([]);
            in_memory.merge(&merged).unwrap();
            assert_eq!(pixels(&in_memory), pixels(&whole));
            assert_eq!(in_memory.merge(&film([41])), Err(41));
        }
    }
    // A bit that is lost is seen.
    let mut off = film(0..41);
    let mut last = image(41);
    last.planes[0].1[11].y = f32::from_bits(last.planes[0].1[11].y.to_bits() ^ 1);
    off.add_pass(41, &last);
    assert!(fs::read(written(folder.path(), "off", &off)).unwrap() != bytes);
}

#[test]
fn a_film_resumed_anywhere_is_the_whole_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let whole = pixels(&film(0..12));
    for stop in 0..12 {
        let path = written(folder.path(), "state", &film(0..stop));
        let mut resumed = film([]);
        let head = read(&path, &mut resumed).unwrap();
        assert_eq!(head, self::head(&film(0..stop)));
        (stop..12).for_each(|pass| resumed.add_pass(pass, &image(pass)));
        assert_eq!(pixels(&resumed), whole, "{stop}");
    }
}

#[test]
fn what_does_not_belong_together_is_named() {
    let one = head(&film(0..4));
    let next = head(&film(4..6));
    let mut joined = one.clone();
    joined.join(&next).unwrap();
    assert_eq!((joined.passes.len(), joined.photons, joined.nanoseconds), (6, 60, 6));
    assert_eq!(joined.header().get("passes").unwrap().as_integer(), Some(6));
    assert_eq!(joined.join(&next), Err("pass 4 is in both".into()));
    let other = StateHead { key: Key([("scene".to_owned(), "b".to_owned())].into()), ..next.clone() };
    assert_eq!(joined.join(&other), Err("scene: b there, a here".into()));
    let other = StateHead { pass_size: 4, ..next.clone() };
    assert_eq!(joined.join(&other), Err("pass size: 4 there, 3 here".into()));
    let other = StateHead { width: 8, passes: PassSet::default(), ..next };
    assert_eq!(joined.join(&other), Err("pixels: 8x5 there, 7x5 here".into()));
}

#[test]
fn a_state_has_no_more_than_three_times_the_bytes_of_its_picture() {
    let folder = tempfile::tempdir().unwrap();
    let (width, height) = (64, 8);
    let mut film = Film::new(width, height, &[Layer::Visible, Layer::Error]);
    for pass in 0..160 {
        let planes = [Layer::Visible, Layer::Bias].map(|layer| {
            let channel = |at: usize| value(pass, layer, at).abs().clamp(0.0625, 1.0) * (at % 7 + 1) as f32;
            let pixel = |at: usize| Vec3::from_array([0, 1, 2].map(|axis| channel(3 * at + axis)));
            (layer, (0..(width * height) as usize).map(pixel).collect())
        });
        film.add_pass(pass, &PassImage { width, height, planes: planes.into(), asides: Asides::default() });
    }
    let path = folder.path().join("state");
    let head = StateHead { width, height, layers: film.layers().to_vec(), ..head(&film) };
    write_state(&path, &head, &film).unwrap();
    let each = fs::metadata(&path).unwrap().len() as f64 / f64::from(width * height);
    // Two layers of three numbers of four bytes.
    assert!(each <= 3.0 * 24.0, "{each} bytes a pixel");
}

/// One line that names the file.
fn refused(path: &Path) {
    let mut all = film([]);
    match read(path, &mut all) {
        Err(e @ Error::Image { .. }) => {
            let said = e.to_string();
            assert!(!said.contains('\n') && said.contains("no state to go on from"), "{said}");
        }
        other => panic!("it was read: {:?}", other.map(|head| head.passes)),
    }
}

#[test]
fn a_file_that_ends_early_is_refused_wherever_it_ends() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), "state", &film(0..2));
    let good = fs::read(&path).unwrap();
    for end in 0..good.len() {
        fs::write(&path, &good[..end]).unwrap();
        refused(&path);
    }
    fs::write(&path, [&good[..], &[0]].concat()).unwrap();
    refused(&path);
}

#[test]
fn a_byte_that_differs_is_refused_wherever_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), "state", &film(0..2));
    let good = fs::read(&path).unwrap();
    for at in 0..good.len() {
        let mut bad = good.clone();
        bad[at] ^= 1 << (at % 8);
        fs::write(&path, &bad).unwrap();
        refused(&path);
    }
}

#[test]
fn rows_that_fit_their_checksum_and_make_no_sense_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), "state", &film(0..2));
    let good = fs::read(&path).unwrap();
    let begin = MAGIC.len() + 4;
    let length = |at: usize| u32::from_le_bytes(good[at..at + 4].try_into().unwrap()) as usize;
    let colours = begin + 4 + length(begin) + 8;
    let row = colours + 4 + length(colours) + 8;
    let (from, end) = (row + 4, row + 4 + length(row));
    let mut state = 1_u64;
    let mut read_anyway = 0;
    for _ in 0..2000 {
        let mut bad = good.clone();
        for _ in 0..3 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            bad[from + (state >> 33) as usize % (end - from)] = (state >> 20) as u8;
        }
        let sum = checksum(&bad[from..end]).to_le_bytes();
        bad[end..end + 8].copy_from_slice(&sum);
        fs::write(&path, &bad).unwrap();
        // Other numbers are numbers, too; but nothing panics, and what is refused is refused in a line.
        let mut all = film([]);
        match read(&path, &mut all) {
            Ok(_) => {
                all.standard_error();
                read_anyway += 1;
            }
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
        }
    }
    assert!((1..2000).contains(&read_anyway));
}

#[test]
fn heads_that_promise_too_much_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state");
    let good = head(&film(0..2)).to_json();
    let with = |name: &str, value: serde_json::Value| {
        let mut json = good.clone();
        json[name] = value;
        let json = json.to_string();
        let length = (json.len() as u32).to_le_bytes();
        let sum = checksum(json.as_bytes()).to_le_bytes();
        fs::write(&path, [&MAGIC[..], &VERSION.to_le_bytes(), &length, json.as_bytes(), &sum].concat())
            .unwrap();
        refused(&path);
    };
    with("size", serde_json::json!([65_536, 65_536]));
    with("size", serde_json::json!([u32::MAX, 1]));
    with("size", serde_json::json!([0, 1]));
    with("size", serde_json::json!("big"));
    with("passes", serde_json::json!([[0, 2, 2_000_000_000_u32]]));
    with("passes", serde_json::json!([[0, 0, 2]]));
    with("layers", serde_json::json!(["visible", "visible"]));
    with("layers", serde_json::json!(["error"]));
    with("photons", serde_json::json!(-1));
    with("preview", serde_json::json!(null));
    with("key", serde_json::json!({"a": 1}));
    fs::write(&path, [&MAGIC[..], &(VERSION - 1).to_le_bytes()].concat()).unwrap();
    refused(&path);
    fs::write(&path, [&MAGIC[..], &VERSION.to_le_bytes(), &u32::MAX.to_le_bytes()].concat()).unwrap();
    refused(&path);
}
