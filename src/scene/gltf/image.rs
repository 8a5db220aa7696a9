//! Images: found, decoded within bounds.

use super::Reason;
use super::accessor::Accessors;
use super::files::load_uri;
use super::notes::label;
use crate::machine::MemoryLimit;
use crate::pictures::Pixels;
use crate::scene::texture::{Encoding, Image, Sampler, Wrap};
use gltf::json::texture::{MagFilter, WrappingMode};
use gltf::json::validation::Checked;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Pixels of one image, 8192 squared: 256 MB decoded.
const MOST_PIXELS: u64 = 1 << 26;
/// Pixels of all images of a file together: a few seconds.
const MOST_PIXELS_OF_A_FILE: u64 = 1 << 29;

/// Bytes of an image file.
const MOST_BYTES: u64 = 1 << 30;

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
                let name = self.name(image);
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
        let name = self.name(image);
        let Pixels { width, height, channels, .. } = self.pixels(image)?;
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

    /// How messages call an image, whether or not it is there.
    pub fn name(&self, image: usize) -> String {
        let source = self.accessors.root.images.get(image);
        label("image", image, source.and_then(|source| source.name.as_deref()))
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
        let Pixels { width, height, channels, .. } = self.pixels(image)?;
        let made = Image::new(name, [width, height], channels, encoding).ok_or("no pixels")?;
        self.held += made.bytes() as u64;
        Ok(Arc::new(made))
    }

    /// An image as it is stored, to be made single precision of. Err: why it cannot be had.
    pub fn stored(&mut self, image: usize) -> Result<Pixels, Reason> {
        if image >= self.accessors.root.images.len() {
            return Err("does not exist; export it again".into());
        }
        let pixels = self.pixels(image)?;
        self.held += PIXEL_BYTES * u64::from(pixels.width) * u64::from(pixels.height);
        Ok(pixels)
    }

    /// An image as it is stored.
    fn pixels(&mut self, image: usize) -> Result<Pixels, Reason> {
        let source = &self.accessors.root.images[image];
        let fits = self.memory.map_or(u64::MAX, |there| there.bytes.saturating_sub(self.held) / PIXEL_BYTES);
        let most = self.left.min(fits).min(MOST_PIXELS);
        let pixels = match (&source.uri, source.buffer_view) {
            (Some(uri), _) => Pixels::decode(&load_uri(uri, self.folder, MOST_BYTES)?, most)?,
            (None, Some(view)) => Pixels::decode(self.accessors.view(view.value())?, most)?,
            (None, None) => return Err("no image".into()),
        };
        self.left -= u64::from(pixels.width) * u64::from(pixels.height);
        Ok(pixels)
    }
}
