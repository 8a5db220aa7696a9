use super::mips::{Mips, Texel};
use super::sampler::Sampler;
use crate::scene::hash::Fnv;
use glam::{Vec2, Vec4};
use std::sync::LazyLock;

/// What the numbers of an image mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// Red, green and blue are colours in sRGB.
    Colour,
    /// They are numbers as they stand, 255 for 1.
    Data,
}

/// A decoded image with all its smaller versions, 8 bits a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    name: String,
    size: [u32; 2],
    channels: usize,
    encoding: Encoding,
    /// Row by row from the top.
    texels: Vec<u8>,
    mips: Mips,
    least: Vec4,
    most: Vec4,
    mean: Vec4,
    digest: u64,
}

/// From what is stored of a channel to what it means.
type Meanings = [f32; 256];

static COLOURS: LazyLock<Meanings> = LazyLock::new(|| meanings(to_linear));
static NUMBERS: LazyLock<Meanings> = LazyLock::new(|| meanings(|value| value));

fn meanings(of: fn(f64) -> f64) -> Meanings {
    std::array::from_fn(|stored| of(stored as f64 / 255.0) as f32)
}

/// From sRGB to linear light, IEC 61966-2-1.
pub(in crate::scene) fn to_linear(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

impl Image {
    /// Of `width` × `height` texels, row by row from the top, of one (grey), two (grey, alpha), three (red, green, blue) or four
    /// channels each. Channels that say nothing are not kept. None: that is not what `texels` holds, or it holds none.
    pub fn new(
        name: impl Into<String>,
        [width, height]: [u32; 2],
        texels: Vec<u8>,
        encoding: Encoding,
    ) -> Option<Self> {
        let count = (width as usize).checked_mul(height as usize).filter(|count| *count > 0)?;
        let channels = texels.len() / count;
        if !(1..=4).contains(&channels)
            || texels.len() != count * channels
            || width.max(height) > i32::MAX as u32 / 4
        {
            return None;
        }
        let (channels, texels) = fewest_channels(channels, texels);
        let mut image = Self {
            name: name.into(),
            size: [width, height],
            channels,
            encoding,
            texels,
            mips: Mips::default(),
            least: Vec4::ONE,
            most: Vec4::ONE,
            mean: Vec4::ONE,
            digest: 0,
        };
        image.mips = Mips::of(image.size, channels, |x, y| image.texel(x, y));
        image.measure();
        image.digest = image.digest();
        Some(image)
    }

    /// For messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width and height in texels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Values of a texel that are kept: grey, grey and alpha, red green blue, or all four.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// What its numbers mean.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// The least of each channel over all texels, linear.
    pub fn least(&self) -> Vec4 {
        self.least
    }

    /// The largest of each channel over all texels, linear.
    pub fn most(&self) -> Vec4 {
        self.most
    }

    /// The mean of each channel over all texels, linear.
    pub fn mean(&self) -> Vec4 {
        self.mean
    }

    /// What it takes in memory.
    pub fn bytes(&self) -> usize {
        self.texels.len() + self.mips.bytes()
    }

    /// A hash of all that is seen of it.
    pub(in crate::scene) fn content(&self) -> u64 {
        self.digest
    }

    /// At a place, in units of the image; the image itself.
    pub(super) fn finest(&self, sampler: &Sampler, place: Vec2) -> Vec4 {
        let [width, height] = self.size;
        if sampler.linear {
            return self.blended(0, sampler, place);
        }
        let [x, y] = [(place.x, width, 0), (place.y, height, 1)].map(|(place, size, axis)| {
            let wrap = sampler.wrap[axis];
            wrap.texel(wrap.place(place, size as f32).floor() as i32, size)
        });
        self.spread(self.texel(x as usize, y as usize))
    }

    /// The mean over a square of side `width` > 0 at a place, in units of the image: between the two versions of it whose texels
    /// are nearest to that size.
    pub(super) fn filtered(&self, sampler: &Sampler, place: Vec2, width: f32) -> Vec4 {
        let [across, down] = self.size.map(|side| side as f32);
        let level = (width * (across * down).sqrt()).log2();
        if level.is_nan() || level <= 0.0 {
            return self.finest(sampler, place);
        }
        let last = self.mips.len();
        let finer = (level as usize).min(last);
        let fine = if finer == 0 { self.finest(sampler, place) } else { self.blended(finer, sampler, place) };
        if finer == last {
            return fine;
        }
        fine.lerp(self.blended(finer + 1, sampler, place), level - finer as f32)
    }

    /// True where `fits` holds for every texel that is seen between two corners, in units of the image. Where it says false, it may
    /// do so all the same.
    pub(super) fn every(
        &self,
        sampler: &Sampler,
        [low, high]: [Vec2; 2],
        fits: &dyn Fn(Vec4) -> bool,
    ) -> bool {
        let axis =
            |axis: usize| sampler.wrap[axis].texels([low[axis], high[axis]], self.size[axis], sampler.linear);
        let (Some(across), Some(down)) = (axis(0), axis(1)) else { return false };
        let texel = |place: i32, axis: usize| sampler.wrap[axis].texel(place, self.size[axis]) as usize;
        down.into_iter().all(|y| {
            let y = texel(y, 1);
            across.clone().all(|x| fits(self.spread(self.texel(texel(x, 0), y))))
        })
    }

    /// Between the four texels around a place of a level, of which 0 is the image itself.
    fn blended(&self, level: usize, sampler: &Sampler, place: Vec2) -> Vec4 {
        let size = if level == 0 { self.size } else { self.mips.size(level - 1) };
        let axis = |axis: usize, place: f32| {
            let wrap = sampler.wrap[axis];
            let centre = wrap.place(place, size[axis] as f32) - 0.5;
            let first = centre.floor();
            let texels = [0, 1].map(|next| wrap.texel(first as i32 + next, size[axis]));
            (texels, centre - first)
        };
        let ([x0, x1], across) = axis(0, place.x);
        let ([y0, y1], down) = axis(1, place.y);
        let texel = |x: u32, y: u32| {
            self.spread(match level {
                0 => self.texel(x as usize, y as usize),
                _ => self.mips.texel(level - 1, x, y),
            })
        };
        let row = |y: u32| texel(x0, y).lerp(texel(x1, y), across);
        row(y0).lerp(row(y1), down)
    }

    /// The channels of a texel of the image itself, linear.
    #[inline]
    fn texel(&self, x: usize, y: usize) -> Texel {
        let index = (y * self.size[0] as usize + x) * self.channels;
        let colours = self.colours();
        let mut texel = [0.0; 4];
        for (c, stored) in self.texels[index..index + self.channels].iter().enumerate() {
            let alpha = c + 1 == self.channels && self.channels.is_multiple_of(2);
            texel[c] = if alpha { f32::from(*stored) / 255.0 } else { colours[usize::from(*stored)] };
        }
        texel
    }

    fn colours(&self) -> &'static Meanings {
        match self.encoding {
            Encoding::Colour => &COLOURS,
            Encoding::Data => &NUMBERS,
        }
    }

    /// Kept channels as red, green, blue and alpha.
    #[inline]
    fn spread(&self, [a, b, c, d]: Texel) -> Vec4 {
        match self.channels {
            1 => Vec4::new(a, a, a, 1.0),
            2 => Vec4::new(a, a, a, b),
            3 => Vec4::new(a, b, c, 1.0),
            _ => Vec4::new(a, b, c, d),
        }
    }

    fn measure(&mut self) {
        let mut counts = [[0_u64; 256]; 4];
        for texel in self.texels.chunks_exact(self.channels) {
            for (count, stored) in counts.iter_mut().zip(texel) {
                count[usize::from(*stored)] += 1;
            }
        }
        let all = (self.texels.len() / self.channels) as f64;
        let (mut least, mut most, mut mean) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        for (c, count) in counts.iter().enumerate().take(self.channels) {
            let alpha = c + 1 == self.channels && self.channels.is_multiple_of(2);
            let meanings = if alpha { &*NUMBERS } else { self.colours() };
            let there = || meanings.iter().zip(count).filter(|(_, n)| **n > 0);
            least[c] = there().map(|(value, _)| *value).fold(f32::INFINITY, f32::min);
            most[c] = there().map(|(value, _)| *value).fold(0.0, f32::max);
            mean[c] = (there().map(|(value, n)| f64::from(*value) * *n as f64).sum::<f64>() / all) as f32;
        }
        (self.least, self.most, self.mean) = (self.spread(least), self.spread(most), self.spread(mean));
    }

    fn digest(&self) -> u64 {
        let mut fnv = Fnv::EMPTY;
        let [width, height] = self.size.map(u64::from);
        let encoding = u64::from(self.encoding == Encoding::Colour);
        [width, height, self.channels as u64, encoding].into_iter().for_each(|word| fnv.word(word));
        let (words, rest) = self.texels.as_chunks::<8>();
        words.iter().for_each(|word| fnv.word(u64::from_le_bytes(*word)));
        fnv.bytes(rest);
        fnv.0
    }
}

/// Without an alpha that is 255 everywhere, and without colours that are grey everywhere.
fn fewest_channels(channels: usize, texels: Vec<u8>) -> (usize, Vec<u8>) {
    let every = |fits: fn(&[u8]) -> bool| texels.chunks_exact(channels).all(fits);
    let opaque = channels.is_multiple_of(2) && every(|texel| texel.last() == Some(&255));
    let grey = channels >= 3 && every(|texel| texel[0] == texel[1] && texel[1] == texel[2]);
    let alpha = channels.is_multiple_of(2) && !opaque;
    let kept: &[usize] = match (channels < 3 || grey, alpha) {
        (true, false) => &[0],
        (true, true) => &[0, channels - 1],
        (false, false) => &[0, 1, 2],
        (false, true) => &[0, 1, 2, 3],
    };
    if kept.len() == channels {
        return (channels, texels);
    }
    let mut fewer = Vec::with_capacity(texels.len() / channels * kept.len());
    for texel in texels.chunks_exact(channels) {
        kept.iter().for_each(|c| fewer.push(texel[*c]));
    }
    (kept.len(), fewer)
}
