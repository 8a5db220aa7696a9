//! Which powers are stored, and how the others are shared out among them.
//!
//! Low powers are kept one by one. Of the high ones only some are stored, as *nodes*; xⁿ between nodes is written as
//! Σ wⱼ x^aⱼ over the six nearest nodes, with the weights that fit best (least squares) where images exist. What must be
//! right is the picture: where the whole square has images it is within 10⁻³ everywhere; where light multiplies by up to
//! κ = 1.3 at (1, 1) it is within 0.5 % where it is not brighter than 30 times its first reflection.
//!
//! Where images exist depends on both variables, and beyond the frontier light grows without bound. Pictures near it are
//! bright: if light multiplies by κ(t) from one reflection to the next, the picture at (s, t) is about 1 / (1 − s κ(t)). So
//! an error of sⁿ at s is weighted by how large tᵐ can be relative to such a picture, and an error of tᵐ at t by how large
//! sⁿ can be.

use super::frontier::Frontier;
use super::places::ABREAST;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x8};
use glam::Vec4;

/// The nodes, as far as they may be needed.
const NODES: [u8; 13] = [0, 1, 2, 3, 4, 6, 9, 13, 19, 28, 42, 62, 92];
/// So many nodes share a power between them.
const SHARED: usize = 6;
/// Fits look at so many places in [0, 1].
const PLACES: usize = 160;

/// The powers of one variable that are stored, rising from 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Nodes {
    powers: Vec<u8>,
}

impl Nodes {
    /// Up to the first node that is `most` or more (the last there is, where none is).
    pub fn up_to(most: u8) -> Self {
        let count = NODES.iter().position(|node| *node >= most).map_or(NODES.len(), |last| last + 1);
        Self { powers: NODES[..count].to_vec() }
    }

    /// From powers as a file names them: rising, the first is 0. None where they are not.
    pub fn from_powers(powers: Vec<u8>) -> Option<Self> {
        let rising = powers.windows(2).all(|pair| pair[0] < pair[1]);
        (rising && powers.first() == Some(&0)).then_some(Self { powers })
    }

    /// The stored powers.
    pub fn powers(&self) -> &[u8] {
        &self.powers
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.powers.len()
    }

    /// Never: zero is always a node.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The largest.
    pub fn last(&self) -> u8 {
        *self.powers.last().expect("zero is a node")
    }

    /// x to the power of each node.
    pub fn weights(&self, x: f64) -> Vec<f64> {
        self.powers.iter().map(|power| x.powi(i32::from(*power))).collect()
    }
}

/// Nodes by index, and their weights.
type Share = Vec<(u8, f32)>;

/// A number of each of the pixels that are added at once, and red, green and blue of them.
pub type Pixels = [f32; ABREAST];
pub type Colours = [Pixels; 3];

/// How every pair (n, m) is shared out: first m among the nodes of t, then n among the nodes of s, which for all m is one sum
/// of rows.
pub struct Shares {
    /// Powers of t.
    across: usize,
    /// The nodes of t as powers.
    nodes: Vec<u8>,
    /// The powers of t between them.
    between: Vec<u8>,
    /// For each n, then each power of t between nodes, its weight at every node of t.
    between_weights: Vec<f32>,
    /// For each node of s every n that has a share in it, rising, and its weights at every node of t.
    across_powers: Vec<Vec<u8>>,
    across_weights: Vec<Vec<f32>>,
}

/// Room to share out in.
#[derive(Default)]
pub struct Room {
    /// Of one n, by power of t.
    powers: Vec<Colours>,
    /// By n, then node of t.
    rows: Vec<Colours>,
}

impl Shares {
    /// For pictures of all points that have one.
    pub fn new(n: &Nodes, m: &Nodes, frontier: &Frontier) -> Self {
        let places: Vec<f64> = (1..=PLACES).map(|i| i as f64 / PLACES as f64).collect();
        let everywhere = frontier.largest_s(1.0) >= 1.0;
        let along_s =
            Weights::new(&places, |s| frontier.largest_t(s).unwrap_or(0.0), |s, t| (s, t), frontier);
        let along_t = Weights::new(&places, |t| frontier.largest_s(t), |t, s| (s, t), frontier);
        let all = |nodes: &Nodes, counts: Vec<f64>| -> Vec<Share> {
            let powers = 0..=nodes.last();
            powers.map(|power| share(&nodes.powers, power, &places, &counts, everywhere)).collect()
        };
        let nodes = m.powers.clone();
        let between: Vec<u8> = (0..=m.last()).filter(|power| !nodes.contains(power)).collect();
        let mut between_weights = Vec::new();
        for power in 0..=n.last() {
            let by_m = all(m, along_t.of(power));
            for m in &between {
                let mut weights = vec![0.0; nodes.len()];
                by_m[usize::from(*m)].iter().for_each(|&(node, weight)| weights[usize::from(node)] = weight);
                between_weights.extend(weights);
            }
        }
        // By the node of t, then n.
        let by_n: Vec<Vec<Share>> = m.powers.iter().map(|m| all(n, along_s.of(*m))).collect();
        let mut across_powers: Vec<Vec<u8>> = vec![Vec::new(); n.len()];
        let mut across_weights: Vec<Vec<f32>> = vec![Vec::new(); n.len()];
        for power in 0..=n.last() {
            for (j, by_n) in by_n.iter().enumerate() {
                for &(node, weight) in &by_n[usize::from(power)] {
                    let node = usize::from(node);
                    let (powers, weights) = (&mut across_powers[node], &mut across_weights[node]);
                    if powers.last() != Some(&power) {
                        powers.push(power);
                        weights.resize(weights.len() + nodes.len(), 0.0);
                    }
                    weights[(powers.len() - 1) * nodes.len() + j] = weight;
                }
            }
        }
        let across = usize::from(m.last()) + 1;
        Self { across, nodes, between, between_weights, across_powers, across_weights }
    }

    /// Shares out each pixel's light by (n, m), at n * (powers of t) + m; where it ends there is no more, and the fourth number of
    /// each means nothing. Fills `sums` with the colours of all pairs of nodes, at
    /// (index of n) * (nodes of t) + (index of m).
    #[inline(always)]
    pub fn share_out<S: Simd>(
        &self,
        simd: S,
        light: &[[Vec4; ABREAST]],
        Room { powers, rows }: &mut Room,
        sums: &mut [Colours],
    ) {
        let (across, along) = (self.across, self.nodes.len());
        let used = light.len().div_ceil(across);
        powers.resize(across, Colours::default());
        rows.resize(used * along, Colours::default());
        for ((n, rows), light) in rows.chunks_exact_mut(along).enumerate().zip(light.chunks(across)) {
            for (powers, light) in powers.iter_mut().zip(light) {
                store(by_colour(simd, light), powers);
            }
            powers[light.len()..].fill(Colours::default());
            let weights = &self.between_weights[n * self.between.len() * along..];
            for (j, (node, row)) in self.nodes.iter().zip(rows).enumerate() {
                let mut sum = load(simd, &powers[usize::from(*node)]);
                for (m, weights) in self.between.iter().zip(weights.chunks_exact(along)) {
                    if weights[j] != 0.0 {
                        add(simd, &mut sum, &powers[usize::from(*m)], weights[j]);
                    }
                }
                store(sum, row);
            }
        }
        // The row of each node of s: the sum of all rows with a share in it.
        let nodes = self.across_powers.iter().zip(&self.across_weights);
        for ((powers, weights), sums) in nodes.zip(sums.chunks_exact_mut(along)) {
            let lit = powers.partition_point(|n| usize::from(*n) < used);
            let rows = Rows { rows, along, powers: &powers[..lit], weights };
            let (pairs, last) = sums.as_chunks_mut::<2>();
            for (i, pair) in pairs.iter_mut().enumerate() {
                *pair = rows.sum(simd, 2 * i);
            }
            for sum in last {
                [*sum] = rows.sum(simd, along - 1);
            }
        }
    }
}

/// Rows by n of as many colours as there are nodes of t, and those with a share in one node of s.
struct Rows<'a> {
    rows: &'a [Colours],
    along: usize,
    /// Their n, rising.
    powers: &'a [u8],
    /// Of each of them, at every node of t.
    weights: &'a [f32],
}

impl Rows<'_> {
    /// The weighted sums at J nodes of t, from the `first`. Several of them, as a sum waits for each of its additions.
    #[inline(always)]
    fn sum<const J: usize, S: Simd>(&self, simd: S, first: usize) -> [Colours; J] {
        let mut sums = [[f32x8::simd_from(simd, 0.0); 3]; J];
        for (n, weights) in self.powers.iter().zip(self.weights.chunks_exact(self.along)) {
            let rows = &self.rows[usize::from(*n) * self.along + first..][..J];
            for ((sum, row), weight) in sums.iter_mut().zip(rows).zip(&weights[first..][..J]) {
                add(simd, sum, row, *weight);
            }
        }
        sums.map(|sum| {
            let mut colours = Colours::default();
            store(sum, &mut colours);
            colours
        })
    }
}

/// Red, green and blue of pixels side by side; their fourth numbers are dropped.
#[inline(always)]
fn by_colour<S: Simd>(simd: S, light: &[Vec4; ABREAST]) -> [f32x8<S>; 3] {
    let light = light.map(|light| f32x4::simd_from(simd, light.to_array()));
    let four = |first: usize| {
        let (red_blue, green) = light[first].deinterleave(light[first + 1]);
        let (more_red_blue, more_green) = light[first + 2].deinterleave(light[first + 3]);
        let (red, blue) = red_blue.deinterleave(more_red_blue);
        [red, green.unzip_low(more_green), blue]
    };
    let (left, right) = (four(0), four(4));
    std::array::from_fn(|c| left[c].combine(right[c]))
}

#[inline(always)]
fn load<S: Simd>(simd: S, from: &Colours) -> [f32x8<S>; 3] {
    std::array::from_fn(|c| f32x8::load_array_ref(simd, &from[c]))
}

#[inline(always)]
fn store<S: Simd>(colours: [f32x8<S>; 3], to: &mut Colours) {
    colours.into_iter().zip(to).for_each(|(colour, to)| colour.store_array(to));
}

/// Adds colours times a number.
#[inline(always)]
pub fn add<S: Simd>(simd: S, sum: &mut [f32x8<S>; 3], colours: &Colours, factor: f32) {
    let factor = f32x8::simd_from(simd, factor);
    for (sum, colour) in sum.iter_mut().zip(load(simd, colours)) {
        *sum += factor * colour;
    }
}

/// How much errors in one variable count, by its place and by the power of the other variable.
struct Weights {
    /// At each place, some values of the other variable up to the largest that has an image there, and one over about how
    /// bright that picture is.
    others: Vec<[(f64, f64); STEPS]>,
}

/// So many values of the other variable are looked at.
const STEPS: usize = 50;

impl Weights {
    /// `most`: the largest value of the other variable at a place. `point`: (s, t) of a place and such a value.
    fn new(
        places: &[f64],
        most: impl Fn(f64) -> f64,
        point: impl Fn(f64, f64) -> (f64, f64),
        frontier: &Frontier,
    ) -> Self {
        let at = |x: &f64| {
            std::array::from_fn(|i| {
                let other = most(*x) * (i + 1) as f64 / STEPS as f64;
                let (s, t) = point(*x, other);
                (other, (1.0 - s * frontier.kappa(t)).max(0.0))
            })
        };
        Self { others: places.iter().map(at).collect() }
    }

    /// At each place, where the other variable stands with this power.
    fn of(&self, power: u8) -> Vec<f64> {
        let largest = |others: &[(f64, f64); STEPS]| {
            others.iter().map(|(x, share)| x.powi(power.into()) * share).fold(0.0, f64::max)
        };
        self.others.iter().map(largest).collect()
    }
}

/// Minimises Σ (c (xⁿ − Σ wⱼ x^aⱼ))² over `places` x, where errors count `counts` c; if asked for, `exact` at x = 1.
fn share(powers: &[u8], power: u8, places: &[f64], counts: &[f64], exact: bool) -> Share {
    if let Some(node) = powers.iter().position(|node| *node == power) {
        return vec![(node as u8, 1.0)];
    }
    let above = powers.partition_point(|node| *node < power);
    let count = SHARED.min(powers.len());
    let first = above.saturating_sub(count / 2).min(powers.len() - count);
    // Columns of length one: the equations stay well conditioned however small the powers are.
    let column = |power: u8| -> Vec<f64> {
        places.iter().zip(counts).map(|(x, c)| c * x.powi(i32::from(power))).collect()
    };
    let length = |column: &[f64]| column.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut columns: Vec<Vec<f64>> = powers[first..first + count].iter().map(|a| column(*a)).collect();
    let lengths: Vec<f64> = columns.iter().map(|column| length(column)).collect();
    let mut target = column(power);
    let size = length(&target);
    if size == 0.0 || lengths.contains(&0.0) {
        return vec![(above as u8, 1.0)]; // no picture has such light
    }
    target.iter_mut().for_each(|x| *x /= size);
    for (column, length) in columns.iter_mut().zip(&lengths) {
        column.iter_mut().for_each(|x| *x /= length);
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let mut rows: Vec<Vec<f64>> = columns
        .iter()
        .zip(&lengths)
        .map(|(a, length)| {
            let products = columns.iter().map(|b| dot(a, b));
            products.chain(exact.then_some(1.0 / length)).chain([dot(a, &target)]).collect()
        })
        .collect();
    if exact {
        rows.push(lengths.iter().map(|length| 1.0 / length).chain([0.0, 1.0 / size]).collect());
    }
    let weights = solved(rows);
    (0..count).map(|i| ((first + i) as u8, (weights[i] * size / lengths[i]) as f32)).collect()
}

/// Solves a small linear system, each row with its right side last, by elimination with pivots.
fn solved(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let n = rows.len();
    for column in 0..n {
        let largest = |a: &usize, b: &usize| rows[*a][column].abs().total_cmp(&rows[*b][column].abs());
        let pivot = (column..n).max_by(largest).expect("a row is left");
        rows.swap(column, pivot);
        let (done, below) = rows.split_at_mut(column + 1);
        let pivot = &done[column];
        for row in below {
            let factor = row[column] / pivot[column];
            for (entry, above) in row[column..].iter_mut().zip(&pivot[column..]) {
                *entry -= factor * above;
            }
        }
    }
    let mut solution = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| rows[i][j] * solution[j]).sum();
        solution[i] = (rows[i][n] - known) / rows[i][i];
    }
    solution
}

#[cfg(test)]
#[path = "nodes_tests.rs"]
mod tests;
