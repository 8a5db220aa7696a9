//! Directions in proportion to the light that comes from them.

use super::Panorama;
use crate::sampling::Cumulative;
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Texels of a row whose sum is kept; those of one sum are gone through one by one.
const BLOCK: u32 = 8;

/// Directions of a panorama in proportion to its radiance, which is bilinear between the middles of texels: a texel by its mean
/// radiance and solid angle, and any direction within it alike.
pub(crate) struct Distribution {
    rows: Cumulative,
    /// Running sums of blocks within each row.
    blocks: Vec<f64>,
    /// Of one row.
    per_row: usize,
}

/// A texel and a place in it, both from its upper left, 0 to 1.
#[derive(Clone, Copy, Debug)]
struct Within {
    texel: [u32; 2],
    place: [f64; 2],
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
                sum += weights(panorama, block, y).map(|(_, weight)| weight).sum::<f64>();
                blocks.push(sum);
            }
        }
        let row = |y: u32| row_share(y, height) * blocks[(y as usize + 1) * per_row - 1];
        let rows = Cumulative::new((0..height).map(row));
        (rows.total() > 0.0).then_some(Self { rows, blocks, per_row })
    }

    /// Unit, from numbers in [0, 1).
    pub fn sample(&self, panorama: &Panorama, [a, b]: [f32; 2]) -> Vec3 {
        let x = f64::from(b) * self.rows.total();
        let y = self.rows.index(x);
        let down = ((x - self.rows.below(y)) / self.rows.weight(y)).clamp(0.0, 1.0);
        let blocks = self.of_row(y as u32);
        let x = f64::from(a) * blocks[self.per_row - 1];
        let block = blocks.partition_point(|sum| *sum <= x).min(self.per_row - 1);
        let mut rest = x - below(blocks, block);
        let mut chosen = (block as u32 * BLOCK, 0.5);
        for (column, weight) in weights(panorama, block as u32, y as u32) {
            if weight > 0.0 {
                chosen = (column, (rest / weight).clamp(0.0, 1.0));
                if rest < weight {
                    break;
                }
            }
            rest -= weight;
        }
        let within = Within { texel: [chosen.0, y as u32], place: [chosen.1, down] };
        direction(panorama, within)
    }

    /// The numbers that [`sample`](Self::sample) makes a unit vector of.
    pub fn numbers(&self, panorama: &Panorama, to: Vec3) -> [f32; 2] {
        let Within { texel: [x, y], place: [right, down] } = within(panorama, to);
        let b = (self.rows.below(y as usize) + down * self.rows.weight(y as usize)) / self.rows.total();
        let blocks = self.of_row(y);
        let block = x / BLOCK;
        let before = weights(panorama, block, y).take_while(|(column, _)| *column < x);
        let own =
            weights(panorama, block, y).find(|(column, _)| *column == x).map_or(0.0, |(_, weight)| weight);
        let sum = below(blocks, block as usize) + before.map(|(_, weight)| weight).sum::<f64>() + right * own;
        let whole = blocks[self.per_row - 1];
        [if whole > 0.0 { sum / whole } else { 0.5 }, b].map(|x| (x as f32).clamp(0.0, 1.0 - f32::EPSILON))
    }

    /// Density of [`sample`](Self::sample) in solid angle, sr⁻¹.
    pub fn density(&self, panorama: &Panorama, to: Vec3) -> f32 {
        let Within { texel: [x, y], .. } = within(panorama, to);
        let weight = weights(panorama, x / BLOCK, y).find(|(column, _)| *column == x);
        let per_texel = TAU / f64::from(panorama.width());
        (weight.map_or(0.0, |(_, weight)| weight) / (per_texel * self.rows.total())) as f32
    }

    /// What it takes in memory.
    pub fn bytes(&self) -> usize {
        8 * (self.blocks.len() + self.rows.len())
    }

    fn of_row(&self, y: u32) -> &[f64] {
        &self.blocks[y as usize * self.per_row..][..self.per_row]
    }
}

fn below(sums: &[f64], index: usize) -> f64 {
    if index == 0 { 0.0 } else { sums[index - 1] }
}

/// The share of the sphere's height that row `y` takes: its solid angle over 2π.
fn row_share(y: u32, height: u32) -> f64 {
    let edge = |y: u32| PI * f64::from(y) / f64::from(height);
    // cos a − cos b, exact also at the poles.
    let (a, b) = (edge(y), edge(y + 1));
    2.0 * (0.5 * (a + b)).sin() * (0.5 * (b - a)).sin()
}

/// Texels of a block of row `y` and the mean of all colours together over each, as it is seen: an eighth of what there is beside,
/// above and below.
fn weights(panorama: &Panorama, block: u32, y: u32) -> impl Iterator<Item = (u32, f64)> + '_ {
    let (width, height) = (panorama.width(), panorama.height());
    let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)];
    let column = move |x: u32| {
        let [a, b, c] = rows.map(|y| panorama.at(x, y).element_sum());
        0.125 * f64::from(a) + 0.75 * f64::from(b) + 0.125 * f64::from(c)
    };
    let first = block * BLOCK;
    let mut left = column((first + width - 1) % width);
    let mut middle = column(first);
    (first..(first + BLOCK).min(width)).map(move |x| {
        let right = column((x + 1) % width);
        let weight = 0.125 * left + 0.75 * middle + 0.125 * right;
        (left, middle) = (middle, right);
        (x, weight)
    })
}

/// Where a texel's place is: places are even in solid angle.
fn direction(panorama: &Panorama, Within { texel: [x, y], place: [right, down] }: Within) -> Vec3 {
    let (width, height) = (f64::from(panorama.width()), f64::from(panorama.height()));
    let turn = TAU * ((f64::from(x) + right) / width - 0.5);
    // Versines from the nearer pole are exact there.
    let north = 2.0 * f64::from(y) + 1.0 <= height;
    let versine = |y: f64| {
        let angle = PI / height * if north { y } else { height - y };
        2.0 * (0.5 * angle).sin().powi(2)
    };
    let (above, below) = (versine(f64::from(y)), versine(f64::from(y) + 1.0));
    let versine = above + down * (below - above);
    let sine = (versine * (2.0 - versine)).max(0.0).sqrt();
    let up = if north { 1.0 - versine } else { versine - 1.0 };
    DVec3::new(sine * turn.cos(), up, sine * turn.sin()).normalize().as_vec3()
}

/// The texel that a unit vector meets, and where.
fn within(panorama: &Panorama, to: Vec3) -> Within {
    let (width, height) = (panorama.width(), panorama.height());
    let to = to.as_dvec3();
    let sine = to.x.hypot(to.z);
    let across = f64::from(width) * (to.z.atan2(to.x) / TAU + 0.5);
    let angle = sine.atan2(to.y);
    let x = (across as u32).min(width - 1);
    let y = ((angle / PI * f64::from(height)) as u32).min(height - 1);
    let edge = |y: u32| PI * f64::from(y) / f64::from(height);
    // cos a − cos b once more.
    let drop = |a: f64, b: f64| 2.0 * (0.5 * (a + b)).sin() * (0.5 * (b - a)).sin();
    let down = drop(edge(y), angle) / drop(edge(y), edge(y + 1));
    Within { texel: [x, y], place: [across - f64::from(x), down].map(|x| x.clamp(0.0, 1.0)) }
}

/// ∫ L dω of a panorama as it is seen, bilinear between the middles of texels; sr times its unit.
pub(super) fn integral(panorama: &Panorama) -> Vec3 {
    let (width, height) = (panorama.width(), panorama.height());
    let mut sum = DVec3::ZERO;
    for y in 0..height {
        let row = (0..width).fold(DVec3::ZERO, |sum, x| sum + panorama.at(x, y).as_dvec3());
        sum += tent_integral(y, height) * row;
    }
    (TAU / f64::from(width) * sum).as_vec3()
}

/// ∫ tent(v) sin θ dθ of row `y`, which at a pole goes on as it is.
fn tent_integral(y: u32, height: u32) -> f64 {
    let step = PI / f64::from(height);
    let middle = step * (f64::from(y) + 0.5);
    // ∫ (1 − |x|/h) sin(m + x) dx over [−h, h] = sin m · 2 (1 − cos h) / h.
    let whole = 2.0 * (1.0 - step.cos()) / step * middle.sin();
    // From a pole to the middle all of it, where the tent rises from below the pole.
    let pole = |middle: f64| 1.0 - middle.cos() - rising(middle, step);
    let first = if y == 0 { pole(middle) } else { 0.0 };
    let last = if y + 1 == height { pole(PI - middle) } else { 0.0 };
    whole + first + last
}

/// ∫ (1 + x/h) sin(m + x) dx over [−h, 0].
fn rising(m: f64, h: f64) -> f64 {
    let antiderivative = |x: f64| -(1.0 + x / h) * (m + x).cos() + (m + x).sin() / h;
    antiderivative(0.0) - antiderivative(-h)
}
