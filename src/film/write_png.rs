//! PNG and JPEG: what the picture looks like on a display.

use crate::error::{Error, Result};
use crate::film::layer::Layer;
use crate::film::ours::SIGNATURE;
use crate::film::preview::Preview;
use crate::film::replace::replace_file;
use crate::film::sums::Film;
use glam::Vec3;
use std::io;
use std::path::Path;

/// Writes the visible mean as an 8-bit sRGB picture, by a view at an exposure (a number of stops stands for the standard view). Values
/// outside [0, 1] saturate: this is a display, not an estimate. Returns how many pixels are not finite; these are painted magenta,
/// and the user must be told.
pub fn write_png(path: &Path, film: &Film, preview: impl Into<Preview>) -> Result<usize> {
    write_rgb_png(path, film.width(), film.height(), &film.mean(Layer::Visible), preview)
}

/// The same for any plane of linear RGB, row-major from top left.
pub fn write_rgb_png(
    path: &Path,
    width: u32,
    height: u32,
    plane: &[Vec3],
    preview: impl Into<Preview>,
) -> Result<usize> {
    assert_eq!(plane.len(), width as usize * height as usize, "a plane of another size");
    let (bytes, lost) = displayed(plane, preview.into());
    write_bytes_png(path, width, height, &bytes)?;
    Ok(lost)
}

/// The bytes of the file that [`write_rgb_png`] writes, for who shows it at once.
pub fn rgb_png(width: u32, height: u32, plane: &[Vec3], preview: impl Into<Preview>) -> Vec<u8> {
    assert_eq!(plane.len(), width as usize * height as usize, "a plane of another size");
    let (bytes, _) = displayed(plane, preview.into());
    encode(width, height, &bytes).expect("memory takes what is written")
}

/// The sRGB bytes that [`write_rgb_png`] writes of a plane, three a pixel.
pub fn rgb_bytes(plane: &[Vec3], preview: impl Into<Preview>) -> Vec<u8> {
    displayed(plane, preview.into()).0
}

/// A PNG file of 8-bit sRGB as it is, three bytes a pixel: packed quickly rather than well, for who shows it once.
pub fn quick_png(width: u32, height: u32, rgb: &[u8]) -> Vec<u8> {
    assert_eq!(rgb.len(), 3 * width as usize * height as usize, "bytes of another size");
    encode_with(width, height, rgb, Some(png::Compression::Fast)).expect("memory takes what is written")
}

/// The same as a JPEG file, which has no more than 65,535 pixels a side.
pub fn write_rgb_jpg(
    path: &Path,
    width: u32,
    height: u32,
    plane: &[Vec3],
    preview: impl Into<Preview>,
) -> Result<usize> {
    assert_eq!(plane.len(), width as usize * height as usize, "a plane of another size");
    let (bytes, lost) = displayed(plane, preview.into());
    let encoded =
        encode_jpg(width, height, &bytes).map_err(|reason| Error::Write { path: path.into(), reason })?;
    replace_file(path, |file| file.write_all(&encoded))?;
    Ok(lost)
}

/// Three sRGB bytes a pixel, and how many pixels are not finite.
fn displayed(plane: &[Vec3], Preview { exposure, view }: Preview) -> (Vec<u8>, usize) {
    let scale = exposure.stops(plane).exp2() as f32;
    let mut lost = 0;
    let mut bytes = Vec::with_capacity(3 * plane.len());
    for pixel in plane {
        if pixel.is_finite() {
            bytes.extend(view.shown(scale * *pixel).to_array().map(srgb_encode));
        } else {
            lost += 1;
            bytes.extend([255, 0, 255]);
        }
    }
    (bytes, lost)
}

/// Writes an 8-bit sRGB picture as it is: three bytes a pixel, row-major from top left.
pub fn write_bytes_png(path: &Path, width: u32, height: u32, rgb: &[u8]) -> Result<()> {
    let encoded =
        encode(width, height, rgb).map_err(|e| Error::Write { path: path.into(), reason: e.to_string() })?;
    replace_file(path, |file| file.write_all(&encoded))
}

fn encode(width: u32, height: u32, rgb: &[u8]) -> io::Result<Vec<u8>> {
    encode_with(width, height, rgb, None)
}

/// None: as the encoder likes it.
fn encode_with(
    width: u32,
    height: u32,
    rgb: &[u8],
    compression: Option<png::Compression>,
) -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    compression.into_iter().for_each(|compression| encoder.set_compression(compression));
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    encoder.add_text_chunk("Software".into(), SIGNATURE.into())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(file)
}

/// At this quality colours keep the resolution of brightness.
const JPEG_QUALITY: u8 = 95;

fn encode_jpg(width: u32, height: u32, rgb: &[u8]) -> std::result::Result<Vec<u8>, String> {
    let side = |n: u32| u16::try_from(n).map_err(|_| format!("a JPEG file holds no side of {n} pixels"));
    let mut file = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut file, JPEG_QUALITY);
    encoder
        .encode(rgb, side(width)?, side(height)?, jpeg_encoder::ColorType::Rgb)
        .map_err(|e| e.to_string())?;
    // A comment that says who wrote it, behind the JFIF segment, which must be first.
    let words = SIGNATURE.as_bytes();
    let jfif = file.get(4..6).map_or(0, |length| usize::from(u16::from_be_bytes([length[0], length[1]])));
    let comment = [&[0xff, 0xfe, 0, words.len() as u8 + 2][..], words].concat();
    file.splice(4 + jfif..4 + jfif, comment);
    Ok(file)
}

/// A linear value in [0, 1] as an 8-bit sRGB one, by the transfer function of IEC 61966-2-1; saturates outside.
pub fn srgb_encode(linear: f32) -> u8 {
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::preview::{Exposure, View};

    #[test]
    fn automatic_exposure_does_not_depend_on_how_bright_a_scene_is() {
        let plane: Vec<Vec3> = (0..1000_u16)
            .map(|i| {
                let x = f32::from(i * 37 % 1000) / 1000.0;
                if i % 3 == 0 { Vec3::ZERO } else { Vec3::new(x, x * x, 0.2 + 0.01 * x) }
            })
            .collect();
        for view in View::ALL {
            let preview = Preview { exposure: Exposure::Auto, view };
            let expected = displayed(&plane, preview);
            for times in [1000.0, 1e-9, 3.7e12] {
                let brighter: Vec<Vec3> = plane.iter().map(|rgb| times * *rgb).collect();
                assert_eq!(displayed(&brighter, preview), expected, "{view} × {times}");
            }
        }
    }

    #[test]
    fn a_picture_in_memory_is_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let plane: Vec<Vec3> = (0..6_u8).map(|i| Vec3::new(f32::from(i) / 5.0, 0.5, 2.0)).collect();
        write_rgb_png(&path, 3, 2, &plane, -1.0).expect("written");
        assert_eq!(rgb_png(3, 2, &plane, -1.0), std::fs::read(&path).expect("read"));
        assert_ne!(rgb_png(3, 2, &plane, 0.0), rgb_png(3, 2, &plane, -1.0));
    }

    #[test]
    fn a_view_bends_what_is_written_and_standard_does_not() {
        let byte = |view: View, x: f32| {
            let (bytes, lost) = displayed(&[Vec3::splat(x), Vec3::NAN], Preview { view, ..1.0_f32.into() });
            assert_eq!((lost, &bytes[3..]), (1, &[255, 0, 255][..]));
            bytes[0]
        };
        // Twice 0.25, as it is, less 0.04, and bent.
        assert_eq!([0.25, 0.5].map(|x| byte(View::Standard, x)), [188, 255]);
        assert_eq!(byte(View::Neutral, 0.25), srgb_encode(0.46));
        assert_eq!(byte(View::Agx, 0.5), 202);
    }
}
