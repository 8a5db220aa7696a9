//! Images: found, decoded within bounds, averaged.

use super::Reason;
use super::accessor::Accessors;
use super::files::load_uri;
use glam::Vec3;
use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Pixels of one image, 8192 squared: 256 MB decoded.
const MOST_PIXELS: u64 = 1 << 26;
/// Pixels of all images of a file together: a few seconds.
const MOST_PIXELS_OF_A_FILE: u64 = 1 << 29;

/// Bytes of an image file.
const MOST_BYTES: u64 = 1 << 30;

/// A decoded image.
pub(super) struct Pixels {
    pub width: u32,
    pub height: u32,
    /// Red, green, blue, alpha of each, as stored (colours are in sRGB); row by row from the top.
    pub rgba: Vec<[u8; 4]>,
}

impl Pixels {
    /// Decodes a PNG, JPEG or WebP file. Err: why not.
    pub fn decode(bytes: &[u8], most: u64) -> Result<Self, Reason> {
        match bytes {
            [0x89, b'P', b'N', b'G', ..] => png(bytes, most),
            [0xFF, 0xD8, 0xFF, ..] => jpeg(bytes, most),
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => webp(bytes, most),
            _ => Err("neither PNG, JPEG nor WebP".into()),
        }
    }
}

fn check_size(width: u32, height: u32, most: u64) -> Result<usize, Reason> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels <= most.min(MOST_PIXELS) {
        Ok(pixels as usize)
    } else {
        Err(format!("{width}x{height} pixels are too many"))
    }
}

fn png(bytes: &[u8], most: u64) -> Result<Pixels, Reason> {
    let limits = png::Limits { bytes: 8 * MOST_PIXELS as usize };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(|e| format!("damaged: {e}"))?;
    let (width, height) = (reader.info().width, reader.info().height);
    check_size(width, height, most)?;
    let mut raw = vec![0; reader.output_buffer_size().ok_or("too many pixels")?];
    let frame = reader.next_frame(&mut raw).map_err(|e| format!("damaged: {e}"))?;
    raw.truncate(frame.buffer_size());
    let rgba = match frame.color_type {
        png::ColorType::Grayscale => spread::<1>(&raw, |[y]| [y, y, y, 255]),
        png::ColorType::GrayscaleAlpha => spread::<2>(&raw, |[y, a]| [y, y, y, a]),
        png::ColorType::Rgb => spread::<3>(&raw, |[r, g, b]| [r, g, b, 255]),
        png::ColorType::Rgba => spread::<4>(&raw, |pixel| pixel),
        png::ColorType::Indexed => return Err("damaged: its palette is missing".into()),
    };
    Ok(Pixels { width, height, rgba })
}

fn jpeg(bytes: &[u8], most: u64) -> Result<Pixels, Reason> {
    let options = DecoderOptions::default()
        .jpeg_set_out_colorspace(ColorSpace::RGB)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX));
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|e| format!("damaged: {e}"))?;
    let info = decoder.info().ok_or("damaged: it has no size")?;
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    let pixels = check_size(width, height, most)?;
    let raw = decoder.decode().map_err(|e| format!("damaged: {e}"))?;
    if raw.len() != 3 * pixels {
        return Err("its colours are not RGB".into());
    }
    Ok(Pixels { width, height, rgba: spread::<3>(&raw, |[r, g, b]| [r, g, b, 255]) })
}

fn webp(bytes: &[u8], most: u64) -> Result<Pixels, Reason> {
    let mut decoder =
        image_webp::WebPDecoder::new(Cursor::new(bytes)).map_err(|e| format!("damaged: {e}"))?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, most)?;
    decoder.set_memory_limit(8 * MOST_PIXELS as usize);
    let mut raw = vec![0; decoder.output_buffer_size().ok_or("too many pixels")?];
    decoder.read_image(&mut raw).map_err(|e| format!("damaged: {e}"))?;
    let rgba = if decoder.has_alpha() {
        spread::<4>(&raw, |pixel| pixel)
    } else {
        spread::<3>(&raw, |[r, g, b]| [r, g, b, 255])
    };
    Ok(Pixels { width, height, rgba })
}

fn spread<const N: usize>(raw: &[u8], to_rgba: impl Fn([u8; N]) -> [u8; 4]) -> Vec<[u8; 4]> {
    raw.as_chunks::<N>().0.iter().map(|pixel| to_rgba(*pixel)).collect()
}

/// What stands in for an image: its mean over all pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mean {
    /// Of red, green and blue as colours: in linear light.
    pub colour: Vec3,
    /// Of red, green and blue as numbers: as stored.
    pub data: Vec3,
}

impl Mean {
    /// That of at least one pixel.
    fn of(pixels: &Pixels) -> Self {
        let mut counts = [[0_u64; 256]; 3];
        for pixel in &pixels.rgba {
            for (channel, value) in counts.iter_mut().zip(pixel) {
                channel[usize::from(*value)] += 1;
            }
        }
        let all = pixels.rgba.len() as f64;
        let mean = |worth: fn(f64) -> f64| {
            Vec3::from_array(counts.map(|channel| {
                let parts =
                    channel.iter().enumerate().map(|(value, n)| *n as f64 * worth(value as f64 / 255.0));
                (parts.sum::<f64>() / all) as f32
            }))
        };
        Self { colour: mean(to_linear), data: mean(|value| value) }
    }
}

/// From sRGB to linear light, IEC 61966-2-1.
fn to_linear(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// A file's images, each decoded once.
pub(super) struct Images<'a> {
    accessors: &'a Accessors<'a>,
    folder: &'a Path,
    means: HashMap<usize, Result<Mean, Reason>>,
    /// Pixels that may still be decoded.
    left: u64,
}

impl<'a> Images<'a> {
    /// None decoded yet.
    pub fn new(accessors: &'a Accessors<'a>, folder: &'a Path) -> Self {
        Self { accessors, folder, means: HashMap::new(), left: MOST_PIXELS_OF_A_FILE }
    }

    /// The mean of the image that a texture shows. Err: why it cannot be had.
    pub fn mean(&mut self, texture: usize) -> Result<Mean, Reason> {
        let image = self.image_of(texture).ok_or("no image")?;
        if let Some(known) = self.means.get(&image) {
            return known.clone();
        }
        let mean = self.decode(image).map(|pixels| Mean::of(&pixels));
        self.means.insert(image, mean.clone());
        mean
    }

    /// The plain image of a texture, else the WebP that stands in its place.
    fn image_of(&self, texture: usize) -> Option<usize> {
        let root = self.accessors.root;
        let texture = root.textures.get(texture)?;
        let plain = texture.source.value();
        if plain < root.images.len() {
            return Some(plain);
        }
        let others = &texture.extensions.as_ref()?.others;
        let sources = others.iter().filter(|(name, _)| *name == "EXT_texture_webp");
        let source = sources.filter_map(|(_, webp)| webp["source"].as_u64()).next();
        source.and_then(|index| usize::try_from(index).ok()).filter(|index| *index < root.images.len())
    }

    fn decode(&mut self, image: usize) -> Result<Pixels, Reason> {
        let source = &self.accessors.root.images[image];
        let pixels = match (&source.uri, source.buffer_view) {
            (Some(uri), _) => Pixels::decode(&load_uri(uri, self.folder, MOST_BYTES)?, self.left)?,
            (None, Some(view)) => Pixels::decode(self.accessors.view(view.value())?, self.left)?,
            (None, None) => return Err("no image".into()),
        };
        if pixels.rgba.is_empty() {
            return Err("no pixels".into());
        }
        self.left -= u64::from(pixels.width) * u64::from(pixels.height);
        Ok(pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_colours_is_taken_in_linear_light() {
        let rgba = vec![[255, 188, 0, 255], [0, 0, 0, 0]];
        let mean = Mean::of(&Pixels { width: 2, height: 1, rgba });
        // sRGB 188 is 0.5029 of the light of 255; half of that in the mean with black.
        assert!((mean.colour - Vec3::new(0.5, 0.2514, 0.0)).length() < 1e-4, "{mean:?}");
        assert!((mean.data - Vec3::new(0.5, 0.5 * 188.0 / 255.0, 0.0)).length() < 1e-6, "{mean:?}");
    }

    #[test]
    fn what_is_no_image_or_too_large_is_an_error() {
        assert!(Pixels::decode(b"", 100).is_err_and(|e| e.contains("neither")));
        assert!(Pixels::decode(b"\x89PNG\r\n\x1a\n", 100).is_err_and(|e| e.contains("damaged")));
        assert!(Pixels::decode(b"\xFF\xD8\xFF\xE0", 100).is_err_and(|e| e.contains("damaged")));
        assert!(Pixels::decode(b"RIFF\x04\0\0\0WEBP", 100).is_err_and(|e| e.contains("damaged")));
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 20, 10);
        encoder.set_color(png::ColorType::Grayscale);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[7; 200]).unwrap();
        drop(writer);
        assert!(Pixels::decode(&file, 199).is_err_and(|e| e.contains("too many")));
        let pixels = Pixels::decode(&file, 200).unwrap();
        assert_eq!((pixels.width, pixels.height, pixels.rgba[199]), (20, 10, [7, 7, 7, 255]));
    }
}
