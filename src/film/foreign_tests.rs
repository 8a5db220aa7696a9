//! Pictures as other programs write them, whole and damaged.

use super::read_exr;
use crate::error::Error;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes,
    IntegerBounds, Layer, LayerAttributes, LineOrder, Text, Vec2, WritableImage, f16,
};
use glam::Vec3;
use std::path::Path;
use tempfile::NamedTempFile;

const SIZE: (usize, usize) = (9, 5);

type Part = Layer<AnyChannels<FlatSamples>>;

fn part(name: Option<&str>, channels: Vec<(&str, FlatSamples)>, encoding: Encoding) -> Part {
    let list = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples));
    let attributes = LayerAttributes { layer_name: name.map(Text::from), ..LayerAttributes::default() };
    Layer::new(SIZE, attributes, encoding, AnyChannels::sort(list.collect()))
}

fn write(path: &Path, parts: Vec<Part>) {
    let window = IntegerBounds::new(Vec2(0, 0), Vec2(SIZE.0, SIZE.1));
    Image::from_layers(ImageAttributes::new(window), parts).write().to_file(path).unwrap();
}

fn ramp(step: f32) -> FlatSamples {
    FlatSamples::F32((0..SIZE.0 * SIZE.1).map(|i| step * i as f32).collect())
}

#[test]
fn half_floats_counts_and_grey_are_read() {
    let file = NamedTempFile::new().unwrap();
    let n = SIZE.0 * SIZE.1;
    let halves = FlatSamples::F16((0..n).map(|i| f16::from_f32(i as f32 / 4.0)).collect());
    let counts = FlatSamples::U32((0..n as u32).collect());
    let rgb = vec![("R", halves), ("G", counts), ("B", ramp(1.0)), ("A", ramp(0.0)), ("Z", ramp(2.0))];
    write(file.path(), vec![part(None, rgb, Encoding::default())]);
    let image = read_exr(file.path()).unwrap();
    assert_eq!(image.layer_names(), "visible, depth");
    assert_eq!(image.layer("visible").unwrap()[8], Vec3::new(2.0, 8.0, 8.0));
    assert_eq!(image.layer("depth").unwrap()[8], Vec3::new(16.0, 0.0, 0.0));
    write(file.path(), vec![part(None, vec![("Y", ramp(1.0))], Encoding::default())]);
    assert_eq!(read_exr(file.path()).unwrap().layer("visible").unwrap()[7], Vec3::splat(7.0));
    write(file.path(), vec![part(None, vec![("A", ramp(1.0))], Encoding::default())]);
    assert!(matches!(read_exr(file.path()), Err(Error::Image { .. })));
}

#[test]
fn parts_and_prefixes_name_layers() {
    let file = NamedTempFile::new().unwrap();
    let rgb = |step| vec![("R", ramp(step)), ("G", ramp(step)), ("B", ramp(step))];
    let dotted = vec![("View.glow.R", ramp(3.0)), ("View.glow.G", ramp(3.0)), ("View.glow.B", ramp(3.0))];
    let parts = vec![
        part(Some("visible"), rgb(1.0), Encoding::default()),
        part(Some("direct"), rgb(2.0), Encoding::default()),
        part(Some("View"), dotted, Encoding::default()),
    ];
    write(file.path(), parts);
    let image = read_exr(file.path()).unwrap();
    assert_eq!((image.width, image.height), (9, 5));
    for (name, step) in [("visible", 1.0), ("direct", 2.0), ("View.glow", 3.0)] {
        assert_eq!(image.layer(name).map(|l| l[2].y), Some(2.0 * step), "{}", image.layer_names());
    }
}

#[test]
fn every_compression_and_tiles_are_read_and_damage_is_an_error() {
    let compressions = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
    ];
    let file = NamedTempFile::new().unwrap();
    let mut state = 5_u64;
    let mut at = |limit: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % limit
    };
    for compression in compressions {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(4, 4))] {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            write(
                file.path(),
                vec![part(None, vec![("R", ramp(1.0)), ("G", ramp(1.0)), ("B", ramp(1.0))], encoding)],
            );
            let image = read_exr(file.path()).unwrap();
            assert!((image.layer("visible").unwrap()[11].z - 11.0).abs() < 0.01, "{compression:?}");
            let good = std::fs::read(file.path()).unwrap();
            for _ in 0..ROUNDS {
                let mut bad = good.clone();
                for _ in 0..=at(3) {
                    let place = at(bad.len());
                    bad[place] = if at(2) == 0 { at(256) as u8 } else { bad[place] ^ (1 << at(8)) };
                }
                if at(4) == 0 {
                    bad.truncate(at(bad.len()));
                }
                std::fs::write(file.path(), &bad).unwrap();
                if let Err(e) = read_exr(file.path()) {
                    assert!(matches!(e, Error::Image { .. }) && !e.to_string().contains('\n'), "{e}");
                }
            }
        }
    }
}

/// Damaged copies per kind of file. Five thousand of each were tried once, without a panic.
const ROUNDS: usize = 40;

#[test]
fn sizes_that_a_file_cannot_hold_are_refused_before_anything_is_allocated() {
    let file = NamedTempFile::new().unwrap();
    let message = || {
        let error = read_exr(file.path()).unwrap_err();
        assert!(matches!(error, Error::Image { .. }) && !error.to_string().contains('\n'), "{error}");
        error.to_string()
    };
    for compression in [Compression::DWAA(None), Compression::DWAB(None)] {
        let encoding = Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
        write(file.path(), vec![part(None, vec![("Y", ramp(1.0))], encoding)]);
        assert!(message().contains("compression"), "{}", message());
    }
    // A data window of a hundred thousand by a hundred thousand pixels in a file of nine by five.
    let encoding = Encoding {
        compression: Compression::ZIP1,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    write(file.path(), vec![part(None, vec![("Y", ramp(1.0))], encoding)]);
    let mut bytes = std::fs::read(file.path()).unwrap();
    for name in [&b"dataWindow\0box2i\0\x10\0\0\0"[..], b"displayWindow\0box2i\0\x10\0\0\0"] {
        let at = bytes.windows(name.len()).position(|window| window == name).unwrap() + name.len();
        for corner in [at + 8, at + 12] {
            bytes[corner..corner + 4].copy_from_slice(&99_999_i32.to_le_bytes());
        }
    }
    std::fs::write(file.path(), bytes).unwrap();
    assert!(message().contains("damaged"), "{}", message());
}
