//! The same image smaller and smaller, averaged in linear light.

use rayon::prelude::*;

/// Values of a texel, of which there are `channels`, at most four.
pub(super) type Texel = [f32; 4];

/// All levels below the image itself, each half as wide and high as the one before, to a single texel.
///
/// Values are square roots in 16 bits: dark ones are as true to what they average as bright ones, to 3e-5 of the largest.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mips {
    levels: Vec<Level>,
    values: Vec<u16>,
    channels: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Level {
    size: [u32; 2],
    start: usize,
}

/// Texels of a larger row that a smaller one covers, and how much of it each fills.
struct Share {
    first: usize,
    weights: Vec<f32>,
}

impl Mips {
    /// Of an image of `size` with `channels` values a texel, which `texel` gives for a column and a row.
    pub fn of(size: [u32; 2], channels: usize, texel: impl Fn(usize, usize) -> Texel + Sync) -> Self {
        let mut mips = Self { channels, ..Self::default() };
        let mut above = size;
        while above != [1, 1] {
            let below = above.map(|side| (side / 2).max(1));
            let values = match mips.levels.len() {
                0 => halved(above, below, channels, &texel),
                n => halved(above, below, channels, &|x, y| mips.texel(n - 1, x as u32, y as u32)),
            };
            mips.levels.push(Level { size: below, start: mips.values.len() });
            mips.values.extend(values);
            above = below;
        }
        mips
    }

    /// Values of all levels, and what they take.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.values[..]) + size_of_val(&self.levels[..])
    }

    /// How many levels there are.
    pub fn len(&self) -> usize {
        self.levels.len()
    }

    /// Width and height of a level in texels.
    pub fn size(&self, level: usize) -> [u32; 2] {
        self.levels[level].size
    }

    /// A texel's values.
    #[inline]
    pub fn texel(&self, level: usize, x: u32, y: u32) -> Texel {
        let Level { size, start } = self.levels[level];
        let index = start + (y as usize * size[0] as usize + x as usize) * self.channels;
        let mut texel = [0.0; 4];
        for (value, stored) in texel.iter_mut().zip(&self.values[index..index + self.channels]) {
            *value = unpacked(*stored);
        }
        texel
    }
}

fn packed(value: f32) -> u16 {
    (value.sqrt() * f32::from(u16::MAX)).round() as u16
}

fn unpacked(stored: u16) -> f32 {
    let root = f32::from(stored) * (1.0 / f32::from(u16::MAX));
    root * root
}

/// One level from the one above.
fn halved(
    above: [u32; 2],
    below: [u32; 2],
    channels: usize,
    texel: &(impl Fn(usize, usize) -> Texel + Sync),
) -> Vec<u16> {
    let across = shares(above[0] as usize, below[0] as usize);
    let down = shares(above[1] as usize, below[1] as usize);
    let row = across.len() * channels;
    let mut values = vec![0; row * down.len()];
    values.par_chunks_mut(row).zip(&down).for_each(|(row, down)| {
        for (out, across) in row.chunks_mut(channels).zip(&across) {
            let mut sum = [0.0; 4];
            for (y, down) in (down.first..).zip(&down.weights) {
                for (x, across) in (across.first..).zip(&across.weights) {
                    let texel = texel(x, y);
                    (0..channels).for_each(|c| sum[c] += down * across * texel[c]);
                }
            }
            out.iter_mut().zip(sum).for_each(|(out, sum)| *out = packed(sum));
        }
    });
    values
}

/// `above` texels in a row seen as `below` of equal width: each of the larger row counts in all as much as any other, so that
/// the mean stays the same.
fn shares(above: usize, below: usize) -> Vec<Share> {
    let width = above as f64 / below as f64;
    let share = |i: usize| {
        let (from, to) = (i as f64 * width, (i + 1) as f64 * width);
        let (first, last) = (from.floor() as usize, (to.ceil() as usize).min(above));
        let covered = |j: usize| (to.min((j + 1) as f64) - from.max(j as f64)).max(0.0);
        Share { first, weights: (first..last).map(|j| (covered(j) / width) as f32).collect() }
    };
    (0..below).map(share).collect()
}
