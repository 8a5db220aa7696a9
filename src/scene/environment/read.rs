//! Panoramas from files.

use super::panorama::{Panorama, Texels};
use crate::error::{Error, Result};
use crate::pictures::{Pixels, Radiance, check_exr};
use ::exr::block::samples::FromNativeSample;
use ::exr::prelude::{MetaData, ReadChannels, ReadLayers, ReadSpecificChannel, SampleType, Vec2, read};
use glam::Vec3;
use half::f16;
use std::fs::{self, File};
use std::io::{Cursor, Read};
use std::path::Path;

/// How large a panorama may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Pixels.
    pub pixels: u64,
    /// Bytes of memory that may be taken while it is read.
    pub bytes: u64,
}

impl Default for Limits {
    /// 32768 × 8192 pixels, as far as there is memory.
    fn default() -> Self {
        let bytes = crate::machine::memory().map_or(u64::MAX, |there| there.bytes);
        Self { pixels: 1 << 28, bytes }
    }
}

/// Bytes that a pixel takes while it is decoded: as it comes out of a file, and as it is kept.
const PIXEL_BYTES: u64 = 16;
/// Times that the pixels of an EXR file are held: as they are kept, and blocks on their way.
const EXR_HELD: u64 = 2;

impl Panorama {
    /// From a file: Radiance (.hdr), OpenEXR (`R G B`, or `Y` alone), PNG, JPEG or WebP (sRGB, of 8 or 16 bits). What a file is, its
    /// bytes say. Alpha says nothing.
    pub fn read(path: &Path, limits: Limits) -> Result<Self> {
        let bytes = read_file(path, limits.bytes)?;
        Self::decode(&bytes, limits).map_err(|reason| Error::Image { path: path.into(), reason })
    }

    /// The same from the bytes of a file. Err: why not, and the way out.
    pub fn decode(bytes: &[u8], limits: Limits) -> std::result::Result<Self, String> {
        let room = limits.bytes.saturating_sub(bytes.len() as u64);
        let most = limits.pixels.min(room / PIXEL_BYTES);
        match bytes {
            [0x76, 0x2F, 0x31, 0x01, ..] => of_exr(bytes, most),
            _ if Radiance::begins(bytes) => of_radiance(bytes, most),
            _ => of_pixels(bytes, most),
        }
    }
}

fn read_file(path: &Path, most: u64) -> Result<Vec<u8>> {
    let unread = |source| Error::Read { path: path.into(), source };
    let wrong = |reason: &str| Error::Image { path: path.into(), reason: reason.into() };
    let there = fs::metadata(path).map_err(unread)?;
    if !there.is_file() {
        return Err(wrong("is no file (a folder, a pipe or a device); name a picture"));
    }
    let large = || wrong("is larger than the memory there is; make it smaller or free some memory");
    let length =
        usize::try_from(there.len()).ok().filter(|length| *length as u64 <= most).ok_or_else(large)?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(length).map_err(|_| large())?;
    File::open(path).and_then(|file| file.take(length as u64).read_to_end(&mut bytes)).map_err(unread)?;
    Ok(bytes)
}

fn of_radiance(bytes: &[u8], most: u64) -> std::result::Result<Panorama, String> {
    let Radiance { width, height, pixels, scale } = Radiance::decode(bytes, most)?;
    Panorama::of(width, height, Texels::Shared(pixels, Vec3::from_array(scale)))
}

fn of_pixels(bytes: &[u8], most: u64) -> std::result::Result<Panorama, String> {
    let known = |why: String| match why.as_str() {
        "neither PNG, JPEG nor WebP" => "is neither Radiance (.hdr), OpenEXR, PNG, JPEG nor WebP".into(),
        _ => why,
    };
    let Pixels { width, height, channels, depth } = Pixels::decode_deep(bytes, most).map_err(known)?;
    let each = channels.len() / (width as usize * height as usize).max(1);
    let texels = match depth {
        1 => Texels::Srgb(channels.chunks_exact(each.max(1)).map(colour).collect()),
        _ => {
            let channels: Vec<u16> =
                channels.as_chunks().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
            Texels::DeepSrgb(channels.chunks_exact((each / 2).max(1)).map(colour).collect())
        }
    };
    Panorama::of(width, height, texels)
}

/// Of grey, grey and alpha, red green blue, or with alpha.
fn colour<T: Copy>(channels: &[T]) -> [T; 3] {
    match channels {
        [r, g, b, ..] => [*r, *g, *b],
        [grey, ..] => [*grey; 3],
        [] => unreachable!("a pixel has a channel"),
    }
}

fn of_exr(bytes: &[u8], most: u64) -> std::result::Result<Panorama, String> {
    let meta = check_exr(&mut Cursor::new(bytes), bytes.len() as u64, EXR_HELD)?;
    let Found { size, colours, half } = find(&meta)?;
    let [width, height] = [size.0, size.1].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    if u64::from(width) * u64::from(height) > most {
        return Err(format!("{width}x{height} pixels are too many"));
    }
    let texels = match (colours, half) {
        (true, true) => Texels::Half(colours_of::<f16>(bytes)?),
        (true, false) => Texels::Float(colours_of::<f32>(bytes)?),
        (false, true) => Texels::Half(greys_of::<f16>(bytes)?),
        (false, false) => Texels::Float(greys_of::<f32>(bytes)?),
    };
    Panorama::of(width, height, texels)
}

/// What of an EXR file is read.
struct Found {
    size: Vec2<usize>,
    /// `R G B`, else `Y`.
    colours: bool,
    /// All of them are of half precision.
    half: bool,
}

/// The first part with channels `R`, `G` and `B`, else the first with `Y`.
fn find(meta: &MetaData) -> std::result::Result<Found, String> {
    let whole = |sampling: Vec2<usize>| sampling == Vec2(1, 1);
    let channels = |header: &::exr::meta::header::Header| header.channels.list.clone();
    if meta.headers.iter().flat_map(channels).any(|channel| !whole(channel.sampling)) {
        return Err("some of its channels have fewer pixels than others; save it without subsampling".into());
    }
    let find = |names: &[&str]| {
        meta.headers.iter().filter(|header| !header.deep).find_map(|header| {
            let channel = |name: &&str| header.channels.list.iter().find(|channel| channel.name.eq(name));
            let kinds: Option<Vec<_>> = names.iter().map(|name| Some(channel(name)?.sample_type)).collect();
            let half = kinds?.iter().all(|kind| *kind == SampleType::F16);
            Some(Found { size: header.layer_size, colours: names.len() == 3, half })
        })
    };
    let none = "it holds no channels R, G, B (nor Y); save it as an RGB picture";
    find(&["R", "G", "B"]).or_else(|| find(&["Y"])).ok_or_else(|| none.into())
}

fn unreadable(e: ::exr::error::Error) -> String {
    format!("not a readable EXR file ({e}); export it again")
}

/// Pixels under way: how many a row has, and all of them.
type Canvas<S> = (usize, Vec<[S; 3]>);

fn canvas<S: Copy + Default>(size: Vec2<usize>) -> Canvas<S> {
    (size.width(), vec![[S::default(); 3]; size.area()])
}

fn colours_of<S: FromNativeSample + Default>(bytes: &[u8]) -> std::result::Result<Vec<[S; 3]>, String> {
    let channels = read().no_deep_data().largest_resolution_level().specific_channels();
    let pixels = channels.required("R").required("G").required("B").collect_pixels(
        |size, _| canvas::<S>(size),
        |(width, pixels), place, (r, g, b): (S, S, S)| pixels[place.y() * *width + place.x()] = [r, g, b],
    );
    let picture = pixels.first_valid_layer().all_attributes().from_buffered(Cursor::new(bytes));
    Ok(picture.map_err(unreadable)?.layer_data.channel_data.pixels.1)
}

fn greys_of<S: FromNativeSample + Default>(bytes: &[u8]) -> std::result::Result<Vec<[S; 3]>, String> {
    let channels = read().no_deep_data().largest_resolution_level().specific_channels();
    let pixels = channels.required("Y").collect_pixels(
        |size, _| canvas::<S>(size),
        |(width, pixels), place, (y,): (S,)| pixels[place.y() * *width + place.x()] = [y; 3],
    );
    let picture = pixels.first_valid_layer().all_attributes().from_buffered(Cursor::new(bytes));
    Ok(picture.map_err(unreadable)?.layer_data.channel_data.pixels.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, SmallVec, WritableImage};

    const SUN: f32 = 1_234_567.0;

    fn exr(size: (usize, usize), channels: Vec<(&str, FlatSamples)>) -> Vec<u8> {
        let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples));
        let image = Image::from_channels(size, AnyChannels::sort(channels.collect::<SmallVec<[_; 4]>>()));
        let mut file = Cursor::new(Vec::new());
        image.write().to_buffered(&mut file).expect("written");
        file.into_inner()
    }

    fn read(bytes: &[u8]) -> std::result::Result<Panorama, String> {
        Panorama::decode(bytes, Limits::default())
    }

    #[test]
    fn single_and_half_precision_are_kept_to_the_bit() {
        let plane = |at: f32| -> Vec<f32> { (0..8).map(|i| if i == 5 { SUN + at } else { at }).collect() };
        let float = |at: f32| FlatSamples::F32(plane(at));
        let panorama = read(&exr(
            (4, 2),
            vec![("R", float(0.1)), ("G", float(0.2)), ("B", float(0.3)), ("A", float(1.0))],
        ));
        let panorama = panorama.expect("an EXR file");
        assert_eq!((panorama.width(), panorama.height(), panorama.bytes()), (4, 2, 96));
        assert_eq!(panorama.at(1, 1).to_array(), [SUN + 0.1, SUN + 0.2, SUN + 0.3]);
        assert_eq!(panorama.at(1, 0).to_array(), [0.1, 0.2, 0.3]);
        let half = FlatSamples::F16([0.5, 0.1, 60000.0].map(f16::from_f32).to_vec());
        let panorama = read(&exr((3, 1), vec![("Y", half.clone())])).expect("a grey EXR file");
        assert_eq!(panorama.bytes(), 18);
        assert_eq!(panorama.at(2, 0), Vec3::splat(f16::from_f32(60000.0).to_f32()));
        let mixed = FlatSamples::F32(vec![SUN; 3]);
        let panorama =
            read(&exr((3, 1), vec![("R", half.clone()), ("G", mixed), ("B", half)])).expect("mixed");
        assert_eq!(panorama.at(0, 0).to_array(), [0.5, SUN, 0.5]);
    }

    #[test]
    fn what_a_file_lacks_is_told() {
        let samples = || FlatSamples::F32(vec![1.0; 2]);
        assert!(
            read(&exr((2, 1), vec![("Z", samples())])).is_err_and(|why| why.contains("no channels R, G, B"))
        );
        let wrong = FlatSamples::F32(vec![1.0, f32::NEG_INFINITY]);
        let why =
            read(&exr((2, 1), vec![("R", samples()), ("G", wrong), ("B", samples())])).expect_err("no light");
        assert!(why.contains("column 1, row 0") && why.contains("-inf"), "{why}");
        assert!(read(b"hello").is_err_and(|why| why.contains("neither Radiance")));
        assert!(read(b"\x76\x2F\x31\x01").is_err_and(|why| why.contains("not a readable EXR file")));
        let small = Limits { pixels: 1, bytes: 1 << 20 };
        let two = exr((2, 1), vec![("Y", samples())]);
        assert!(Panorama::decode(&two, small).is_err_and(|why| why.contains("too many")));
        let tight = Limits { pixels: 9, bytes: two.len() as u64 + 31 };
        assert!(Panorama::decode(&two, tight).is_err_and(|why| why.contains("too many")));
        assert!(Panorama::decode(&two, Limits { bytes: tight.bytes + 1, ..tight }).is_ok());
    }

    fn png(color: png::ColorType, depth: png::BitDepth, bytes: &[u8]) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.write_header().and_then(|mut writer| writer.write_image_data(bytes)).expect("written");
        file
    }

    #[test]
    fn pictures_in_srgb_become_linear() {
        use png::{BitDepth, ColorType};
        let panorama = read(&png(ColorType::Rgba, BitDepth::Eight, &[0, 188, 255, 9, 255, 0, 0, 0]))
            .expect("a PNG file");
        assert!((panorama.at(0, 0) - Vec3::new(0.0, 0.502_886, 1.0)).abs().max_element() < 1e-6);
        assert_eq!((panorama.at(1, 0), panorama.bytes()), (Vec3::X, 6));
        // Sixteen bits tell apart what eight do not.
        let deep = read(&png(ColorType::Grayscale, BitDepth::Sixteen, &[0x80, 0x00, 0x80, 0x01]))
            .expect("a deep one");
        let [a, b] = [0, 1].map(|x| deep.at(x, 0).x);
        assert!(a < b && b < a * 1.0001 && (a - 0.214_041).abs() < 2e-5, "{a} {b}");
    }

    #[test]
    fn a_file_that_cannot_be_read_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let missing = folder.path().join("missing.hdr");
        let why = Panorama::read(&missing, Limits::default()).expect_err("missing").to_string();
        assert!(why.contains("missing.hdr") && why.contains("check the path"), "{why}");
        let why = Panorama::read(folder.path(), Limits::default()).expect_err("a folder").to_string();
        assert!(why.contains("is no file"), "{why}");
        fs::write(&missing, [0; 100]).expect("written");
        let why = Panorama::read(&missing, Limits { pixels: 9, bytes: 99 }).expect_err("large").to_string();
        assert!(why.contains("missing.hdr: is larger"), "{why}");
    }

    /// Skies of Poly Haven, where they are there.
    #[test]
    fn real_skies_are_read_as_other_programs_read_them() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/corpus");
        for (file, texel, expected, mean) in REAL {
            let path = folder.join(file);
            if path.exists() {
                let sky = Panorama::read(&path, Limits::default()).expect(file);
                assert_eq!((sky.width(), sky.height()), (1024, 512));
                assert_eq!(sky.at(texel[0], texel[1]).to_array(), expected, "{file}");
                let sum: f64 = (0..512)
                    .flat_map(|y| (0..1024).map(move |x| (x, y)))
                    .map(|(x, y)| f64::from(sky.at(x, y).y))
                    .sum();
                assert!((sum / (1024.0 * 512.0) / mean - 1.0).abs() < 1e-6, "{file}: {sum}");
            }
        }
    }

    /// File, a texel, its radiance, and the mean of green over all texels, by an own decoder in another language.
    const REAL: [(&str, [u32; 2], [f32; 3], f64); 2] = [
        ("chinese_garden_1k.hdr", [615, 169], [78848.0, 66048.0, 57856.0], 0.457_705_633_511_068_3),
        (
            "qwantani_afternoon_puresky_1k.hdr",
            [614, 139],
            [109_568.0, 105_472.0, 98304.0],
            0.706_960_342_824_459_1,
        ),
    ];
}
