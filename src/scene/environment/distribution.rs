//! Directions in proportion to the light that comes from them.

use super::Panorama;
use crate::sampling::Cumulative;
use glam::Vec3;
use std::f64::consts::PI;

/// Texels of a row whose sum is kept; those of one sum are gone through one by one.
const BLOCK: u32 = 16;

/// Places of a panorama in proportion to its radiance as it is seen: bilinear between the middles of texels.
///
/// A texel is chosen in proportion to its radiance and the solid angle of its row, then a place about its middle by the
/// tent that it is interpolated with, so that the density is interpolated as the radiance is: their quotient is constant but
/// for colour and for what rows differ.
pub(crate) struct Distribution {
    rows: Cumulative,
    /// Running sums of blocks within each row.
    blocks: Vec<f64>,
    /// Of one row.
    per_row: usize,
}

impl Distribution {
    /// None where it is black.
    pub fn new(panorama: &Panorama) -> Option<Self> {
        let (width, height) = (panorama.width(), panorama.height());
        let per_row = width.div_ceil(BLOCK) as usize;
        let mut blocks = Vec::with_capacity(per_row * height as usize);
        for y in 0..height {
            let mut sum = 0.0;
            for block in 0..per_row as u32 {
                sum += texels(block, width).map(|x| brightness(panorama, x, y)).sum::<f64>();
                blocks.push(sum);
            }
        }
        let row = |y: u32| row_share(y, height) * blocks[(y as usize + 1) * per_row - 1];
        let rows = Cumulative::new((0..height).map(row));
        (rows.total() > 0.0).then_some(Self { rows, blocks, per_row })
    }

    /// A place [u, v] of the panorama, from numbers in [0, 1).
    pub fn sample(&self, panorama: &Panorama, [a, b]: [f32; 2]) -> [f32; 2] {
        let (width, height) = (panorama.width(), panorama.height());
        let x = f64::from(b) * self.rows.total();
        let y = self.rows.index(x);
        let down = (x - self.rows.below(y)) / self.rows.weight(y);
        let blocks = &self.blocks[y * self.per_row..][..self.per_row];
        let x = f64::from(a) * blocks[self.per_row - 1];
        let block = blocks.partition_point(|sum| *sum <= x).min(self.per_row - 1);
        let mut rest = x - if block == 0 { 0.0 } else { blocks[block - 1] };
        let mut chosen = (block as u32 * BLOCK, 0.5);
        for column in texels(block as u32, width) {
            let weight = brightness(panorama, column, y as u32);
            if weight > 0.0 {
                chosen = (column, (rest / weight).clamp(0.0, 1.0));
                if rest < weight {
                    break;
                }
            }
            rest -= weight;
        }
        let u = (f64::from(chosen.0) + 0.5 + tent(chosen.1)) / f64::from(width);
        let v = (y as f64 + 0.5 + tent(down)) / f64::from(height);
        // Beyond a pole is the same row again.
        let v = if v < 0.0 {
            -v
        } else if v > 1.0 {
            2.0 - v
        } else {
            v
        };
        [(u - u.floor()) as f32, v as f32]
    }

    /// Density of [`sample`](Self::sample) over the unit square of places.
    pub fn density(&self, panorama: &Panorama, place: [f32; 2]) -> f32 {
        let height = panorama.height();
        let each = panorama
            .around(place)
            .map(|(x, y, share)| f64::from(share) * row_share(y, height) * brightness(panorama, x, y));
        let texels = f64::from(panorama.width()) * f64::from(height);
        (texels * each.iter().sum::<f64>() / self.rows.total()) as f32
    }

    /// What it takes in memory.
    pub fn bytes(&self) -> usize {
        8 * (self.blocks.len() + self.rows.len())
    }
}

/// In proportion to the solid angle of a texel of row `y`.
fn row_share(y: u32, height: u32) -> f64 {
    (PI * (f64::from(y) + 0.5) / f64::from(height)).sin()
}

/// What one number must tell of a colour.
fn brightness(panorama: &Panorama, x: u32, y: u32) -> f64 {
    panorama.at(x, y).as_dvec3().element_sum()
}

fn texels(block: u32, width: u32) -> std::ops::Range<u32> {
    block * BLOCK..((block + 1) * BLOCK).min(width)
}

/// In [−1, 1], with a density that falls evenly from zero to both ends.
fn tent(u: f64) -> f64 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 * (1.0 - u)).max(0.0).sqrt() }
}

/// ∫ L dω of a panorama as it is seen, bilinear between the middles of texels; sr times its unit.
pub(super) fn integral(panorama: &Panorama) -> Vec3 {
    let (width, height) = (panorama.width(), panorama.height());
    let mut sum = glam::DVec3::ZERO;
    for y in 0..height {
        let row = (0..width).fold(glam::DVec3::ZERO, |sum, x| sum + panorama.at(x, y).as_dvec3());
        sum += tent_integral(y, height) * row;
    }
    (2.0 * PI / f64::from(width) * sum).as_vec3()
}

/// ∫ tent(v) sin θ dθ of row `y`, which at a pole goes on as it is.
fn tent_integral(y: u32, height: u32) -> f64 {
    let step = PI / f64::from(height);
    let middle = step * (f64::from(y) + 0.5);
    // ∫ (1 − |x|/h) sin(m + x) dx over [−h, h] = sin m · 2 (1 − cos h) / h.
    let whole = 2.0 * (1.0 - step.cos()) / step * middle.sin();
    let pole = |middle: f64| {
        // From the pole to the middle all of it, where the tent has but its half: 1 − |x|/h, x = θ − m in [−m, 0].
        let flat = 1.0 - middle.cos();
        let below = integral_between(middle, step, -step, -0.0);
        flat - below
    };
    let first = if y == 0 { pole(middle) } else { 0.0 };
    let last = if y + 1 == height { pole(PI - middle) } else { 0.0 };
    whole + first + last
}

/// ∫ (1 − |x|/h) sin(m + x) dx from `a` to `b` ≤ 0.
fn integral_between(m: f64, h: f64, a: f64, b: f64) -> f64 {
    let antiderivative = |x: f64| -(1.0 + x / h) * (m + x).cos() + (m + x).sin() / h;
    antiderivative(b) - antiderivative(a)
}
