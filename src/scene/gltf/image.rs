//! Images: found, decoded within bounds.

use super::Reason;
use super::accessor::Accessors;
use super::files::load_uri;
use super::notes::label;
use crate::machine::MemoryLimit;
use crate::scene::texture::{Encoding, Image, Sampler, Wrap};
use gltf::json::texture::{MagFilter, WrappingMode};
use gltf::json::validation::Checked;
use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;
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
    /// Of each one to four: grey, grey and alpha, red green blue, or with alpha; as stored, row by row from the top.
    pub channels: Vec<u8>,
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
    if frame.color_type == png::ColorType::Indexed {
        return Err("damaged: its palette is missing".into());
    }
    Ok(Pixels { width, height, channels: raw })
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
    Ok(Pixels { width, height, channels: raw })
}

fn webp(bytes: &[u8], most: u64) -> Result<Pixels, Reason> {
    let mut decoder =
        image_webp::WebPDecoder::new(Cursor::new(bytes)).map_err(|e| format!("damaged: {e}"))?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, most)?;
    decoder.set_memory_limit(8 * MOST_PIXELS as usize);
    let mut raw = vec![0; decoder.output_buffer_size().ok_or("too many pixels")?];
    decoder.read_image(&mut raw).map_err(|e| format!("damaged: {e}"))?;
    Ok(Pixels { width, height, channels: raw })
}

/// A file's images, each decoded once for each way in which its numbers are meant.
pub(super) struct Images<'a> {
    accessors: &'a Accessors<'a>,
    folder: &'a Path,
    known: HashMap<(usize, Encoding), Result<Arc<Image>, Reason>>,
    /// Pixels that may still be decoded.
    left: u64,
    /// What the machine has for all of them.
    memory: Option<MemoryLimit>,
    /// Bytes that those decoded take.
    held: u64,
}

/// Bytes that a pixel takes while an image is decoded and made smaller: as it comes out of a file, as it is kept (four channels),
/// and two thirds as much again of smaller versions.
const PIXEL_BYTES: u64 = 12;

impl<'a> Images<'a> {
    /// None decoded yet.
    pub fn new(accessors: &'a Accessors<'a>, folder: &'a Path) -> Self {
        let memory = crate::machine::memory();
        Self { accessors, folder, known: HashMap::new(), left: MOST_PIXELS_OF_A_FILE, memory, held: 0 }
    }

    /// The image that a texture shows, and how it goes on beyond its edges. Err: why it cannot be had.
    pub fn get(&mut self, texture: usize, encoding: Encoding) -> Result<(Arc<Image>, Sampler), Reason> {
        let image = self.image_of(texture).ok_or("no image")?;
        let known = match self.known.get(&(image, encoding)) {
            Some(known) => known.clone(),
            None => {
                let name = label("image", image, self.accessors.root.images[image].name.as_deref());
                let made = self.decode(image, &name, encoding).map_err(|why| format!("{name}: {why}"));
                self.known.insert((image, encoding), made.clone());
                made
            }
        };
        Ok((known?, self.sampler_of(texture)))
    }

    /// The roughness, in green, of an image that has glossiness in alpha: 1 − `glossiness` × alpha.
    pub fn roughness_of_gloss(
        &mut self,
        texture: usize,
        glossiness: f32,
    ) -> Result<(Arc<Image>, Sampler), Reason> {
        let image = self.image_of(texture).ok_or("no image")?;
        let name = label("image", image, self.accessors.root.images[image].name.as_deref());
        let Pixels { width, height, channels } = self.pixels(image)?;
        let count = (width as usize * height as usize).max(1);
        let each = channels.len() / count;
        let rough = |alpha: u8| (255.0 - glossiness * f32::from(alpha)).round() as u8;
        let texel = |texel: &[u8]| {
            let alpha = if each.is_multiple_of(2) { texel[each - 1] } else { 255 };
            [255, rough(alpha), 255]
        };
        let texels = channels.chunks_exact(each.max(1)).flat_map(texel).collect();
        let made = Image::new(name, [width, height], texels, Encoding::Data).ok_or("no pixels")?;
        self.held += made.bytes() as u64;
        Ok((Arc::new(made), self.sampler_of(texture)))
    }

    fn sampler_of(&self, texture: usize) -> Sampler {
        let root = self.accessors.root;
        let sampler = root.textures.get(texture).and_then(|texture| texture.sampler);
        let Some(sampler) = sampler.and_then(|index| root.samplers.get(index.value())) else {
            return Sampler::default();
        };
        let wrap = [sampler.wrap_s, sampler.wrap_t].map(|wrap| match wrap {
            Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
            Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirrored,
            _ => Wrap::Repeat,
        });
        Sampler { wrap, linear: sampler.mag_filter != Some(Checked::Valid(MagFilter::Nearest)) }
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

    fn decode(&mut self, image: usize, name: &str, encoding: Encoding) -> Result<Arc<Image>, Reason> {
        let Pixels { width, height, channels } = self.pixels(image)?;
        let made = Image::new(name, [width, height], channels, encoding).ok_or("no pixels")?;
        self.held += made.bytes() as u64;
        Ok(Arc::new(made))
    }

    /// An image as it is stored.
    fn pixels(&mut self, image: usize) -> Result<Pixels, Reason> {
        let source = &self.accessors.root.images[image];
        let fits = self.memory.map_or(u64::MAX, |there| there.bytes.saturating_sub(self.held) / PIXEL_BYTES);
        let most = self.left.min(fits);
        let pixels = match (&source.uri, source.buffer_view) {
            (Some(uri), _) => Pixels::decode(&load_uri(uri, self.folder, MOST_BYTES)?, most)?,
            (None, Some(view)) => Pixels::decode(self.accessors.view(view.value())?, most)?,
            (None, None) => return Err("no image".into()),
        };
        self.left -= u64::from(pixels.width) * u64::from(pixels.height);
        Ok(pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!((pixels.width, pixels.height, pixels.channels), (20, 10, vec![7; 200]));
    }
}
