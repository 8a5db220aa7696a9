//! Pictures as bytes.

use glam::Vec3;
use halflight::error::Result;
use halflight::film::write_bytes_png;
use std::path::Path;

/// A picture of displayed values: linear RGB, in the paper's sense that 1 is white.
#[derive(Clone)]
pub struct Shown {
    /// Pixels per row.
    pub width: u32,
    /// Row-major from top left.
    pub pixels: Vec<Vec3>,
}

impl Shown {
    /// Rows.
    pub fn height(&self) -> u32 {
        self.pixels.len() as u32 / self.width
    }

    /// The part from column `x`, row `y`, with every pixel as a block of `by` × `by`.
    pub fn detail(&self, [x, y, width, height]: [u32; 4], by: u32) -> Self {
        let pixel = |i: u32| {
            let (column, row) = (x + i % (by * width) / by, y + i / (by * width) / by);
            self.pixels[(row * self.width + column) as usize]
        };
        Self { width: by * width, pixels: (0..by * by * width * height).map(pixel).collect() }
    }

    /// What differs from `other`, `gain` times, on middle grey.
    pub fn less(&self, other: &Self, gain: f32) -> Self {
        let pairs = self.pixels.iter().zip(&other.pixels);
        Self { width: self.width, pixels: pairs.map(|(a, b)| 0.5 + gain * (*a - *b)).collect() }
    }

    /// Written as a display without tone mapping or transfer function takes it: 0 to 1 become 0 to 255.
    pub fn write(&self, path: &Path) -> Result<()> {
        let byte = |value: f32| (255.0 * value.clamp(0.0, 1.0)).round() as u8;
        let bytes: Vec<u8> = self.pixels.iter().flat_map(|pixel| pixel.to_array().map(byte)).collect();
        write_bytes_png(path, self.width, self.height(), &bytes)
    }
}
