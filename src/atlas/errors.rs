//! The error bar anywhere in the square: standard errors over passes at 25 points, and lines between them.
//!
//! Orders of one pixel share photons, so errors of single orders would not do: at each point it is the picture
//! itself whose spread is measured, pass by pass, later by small groups of passes. As a function of s and t a standard error is
//! a smooth, rising and (but for rounding) convex one, so that the lines between points lie above it, by no more than
//! about a tenth.

use super::frontier::Frontier;
use super::nodes::Nodes;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use glam::DVec3;

/// Points in each direction: t, and s as a share of the largest that is served at t.
pub const GRID: [f64; 5] = [0.0, 0.4, 0.7, 0.9, 1.0];
/// All points.
pub const POINTS: usize = GRID.len() * GRID.len();

/// The point of the grid with row `i` (t) and column `j` (share of s), as (s, t).
pub fn point(frontier: &Frontier, i: usize, j: usize) -> (f64, f64) {
    (GRID[j] * frontier.largest_s(GRID[i]), GRID[i])
}

/// The four points around (s, t) and their weights, which add up to one.
pub fn around(frontier: &Frontier, s: f64, t: f64) -> [(usize, f64); 4] {
    let share = s / frontier.largest_s(t).max(f64::MIN_POSITIVE);
    let ((i, a), (j, b)) = (cell(t), cell(share));
    let n = GRID.len();
    [
        (i * n + j, (1.0 - a) * (1.0 - b)),
        (i * n + j + 1, (1.0 - a) * b),
        ((i + 1) * n + j, a * (1.0 - b)),
        ((i + 1) * n + j + 1, a * b),
    ]
}

fn cell(x: f64) -> (usize, f64) {
    let i = GRID.partition_point(|at| *at <= x).clamp(1, GRID.len() - 1) - 1;
    (i, ((x - GRID[i]) / (GRID[i + 1] - GRID[i])).clamp(0.0, 1.0))
}

/// Mean and sum of squared deviations at every point, one group of passes after another (Welford).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColourSpread {
    mean: [DVec3; POINTS],
    spread: [DVec3; POINTS],
}

impl ColourSpread {
    /// Adds the average colours of `passes` after `before` others.
    pub fn add(&mut self, colours: &[DVec3; POINTS], before: u32, passes: u32) {
        let (n, k) = (f64::from(before), f64::from(passes));
        for (i, colour) in colours.iter().enumerate() {
            let away = *colour - self.mean[i];
            self.mean[i] += away * (k / (n + k));
            self.spread[i] += away * away * (n * k / (n + k));
        }
    }

    /// Standard errors of the mean of `passes` in `groups` (two or more).
    pub fn errors(&self, passes: u32, groups: u32) -> [DVec3; POINTS] {
        let scale = f64::from(passes) * (f64::from(groups) - 1.0);
        self.spread.map(|spread| (spread / scale).map(f64::sqrt))
    }
}

/// Numbers of a picture at every point of the grid; see [`place`].
pub const RECORD: usize = 3 * POINTS;
/// The same of all points with one share of s.
const COLUMN: usize = 3 * GRID.len();
/// What vector units add at once: a number for each t, and zeros.
const VECTOR: usize = 8;

/// Where a channel at a point is among [`RECORD`] numbers.
pub fn place(point: usize, channel: usize) -> usize {
    point % GRID.len() * COLUMN + channel * GRID.len() + point / GRID.len()
}

/// What sums by stored powers make at every point of the grid: sⁿ tᵐ of each.
pub struct AtGrid {
    /// tᵐ of every t, by node of m.
    t_powers: Vec<[f32; VECTOR]>,
    /// sⁿ of every t, by node of n and share of s.
    s_powers: Vec<[[f32; VECTOR]; GRID.len()]>,
}

impl AtGrid {
    /// For these powers, where images exist up to the frontier.
    pub fn new(n: &Nodes, m: &Nodes, frontier: &Frontier) -> Self {
        let at_each_t = |value: &dyn Fn(usize) -> f64| -> [f32; VECTOR] {
            std::array::from_fn(|i| if i < GRID.len() { value(i) as f32 } else { 0.0 })
        };
        let t_powers = m.powers().iter().map(|m| at_each_t(&|i| GRID[i].powi((*m).into()))).collect();
        let s_power = |n: u8, j: usize| at_each_t(&|i| point(frontier, i, j).0.powi(n.into()));
        let s_powers = n.powers().iter().map(|n| std::array::from_fn(|j| s_power(*n, j))).collect();
        Self { t_powers, s_powers }
    }

    /// `sums`: RGB by nodes of n, then m.
    #[inline(always)]
    pub fn of<S: Simd>(&self, simd: S, sums: &[f32]) -> [f32; RECORD] {
        let zero = [f32x8::simd_from(simd, 0.0); 3];
        let mut values = [zero; GRID.len()];
        let across = 3 * self.t_powers.len();
        for (sums, s_powers) in sums.chunks_exact(across).zip(&self.s_powers) {
            let mut by_t = zero;
            for (rgb, powers) in sums.as_chunks::<3>().0.iter().zip(&self.t_powers) {
                let powers = f32x8::load_array_ref(simd, powers);
                for (by_t, x) in by_t.iter_mut().zip(rgb) {
                    *by_t += powers * *x;
                }
            }
            for (values, powers) in values.iter_mut().zip(s_powers) {
                let powers = f32x8::load_array_ref(simd, powers);
                for (value, by_t) in values.iter_mut().zip(by_t) {
                    *value += powers * by_t;
                }
            }
        }
        let mut all = [0.0; RECORD];
        for (all, value) in all.as_chunks_mut::<{ GRID.len() }>().0.iter_mut().zip(values.as_flattened()) {
            let value = value.to_array();
            *all = std::array::from_fn(|i| value[i]);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::super::frontier::Sample;
    use super::*;
    use crate::sampling::{Rng, Stream};
    use fearless_simd::{Level, dispatch};

    #[test]
    fn points_are_met_exactly_and_weights_add_up() {
        let frontier = Frontier::from_samples(vec![
            Sample { t: 0.0, kappa: 0.8, error: 0.0 },
            Sample { t: 1.0, kappa: 1.3, error: 0.0 },
        ])
        .expect("rising");
        for i in 0..GRID.len() {
            for j in 0..GRID.len() {
                let (s, t) = point(&frontier, i, j);
                let weight: f64 = around(&frontier, s, t)
                    .iter()
                    .filter(|(k, _)| *k == i * GRID.len() + j)
                    .map(|(_, w)| w)
                    .sum();
                assert!((weight - 1.0).abs() < 1e-9, "{i} {j}: {weight}");
            }
        }
        let four = around(&frontier, 0.3, 0.55);
        assert!((four.iter().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(four.iter().all(|(k, w)| *k < POINTS && *w >= 0.0));
    }

    #[test]
    fn sums_at_the_grid_are_those_of_the_series() {
        let frontier = Frontier::from_samples(vec![
            Sample { t: 0.0, kappa: 0.8, error: 0.0 },
            Sample { t: 1.0, kappa: 1.3, error: 0.0 },
        ])
        .expect("rising");
        let (n, m) = (Nodes::up_to(9), Nodes::up_to(2));
        let sums: Vec<f32> = (0..3 * n.len() * m.len()).map(|i| 1.0 + (i * 7 % 11) as f32).collect();
        let at_grid = AtGrid::new(&n, &m, &frontier);
        let found = dispatch!(Level::new(), simd => at_grid.of(simd, &sums));
        for at in 0..POINTS {
            let (s, t) = point(&frontier, at / GRID.len(), at % GRID.len());
            let (across, along) = (n.weights(s), m.weights(t));
            for channel in 0..3 {
                let weights = across.iter().flat_map(|a| along.iter().map(move |b| a * b));
                let terms = weights.zip(sums.chunks(3)).map(|(w, rgb)| w * f64::from(rgb[channel]));
                let truth: f64 = terms.sum();
                let found = f64::from(found[place(at, channel)]);
                assert!((found / truth - 1.0).abs() < 1e-5, "{s} {t}: {found} for {truth}");
            }
        }
    }

    #[test]
    fn spreads_are_those_of_two_sweeps() {
        let passes = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0_f32];
        let mut colour = ColourSpread::default();
        for (before, x) in passes.iter().enumerate() {
            colour.add(&[DVec3::splat(f64::from(*x)); POINTS], before as u32, 1);
        }
        let mean = passes.iter().sum::<f32>() / 6.0;
        let spread = passes.iter().map(|x| (x - mean) * (x - mean)).sum::<f32>();
        let error = (f64::from(spread) / 30.0).sqrt();
        assert!((colour.errors(6, 6)[7].x - error).abs() < 1e-6);
    }

    #[test]
    fn errors_of_uneven_groups_are_those_of_passes() {
        let (mut rng, runs) = (Rng::new(7, Stream::Test, 0, 0), 40_000);
        let groups = [1, 1, 2, 1, 4, 3];
        let passes: u32 = groups.iter().sum();
        let mut sum = 0.0;
        for _ in 0..runs {
            let mut colour = ColourSpread::default();
            let mut before = 0;
            for k in groups {
                let mean = (0..k).map(|_| f64::from(rng.f32())).sum::<f64>() / f64::from(k);
                colour.add(&[DVec3::splat(mean); POINTS], before, k);
                before += k;
            }
            sum += colour.errors(passes, groups.len() as u32)[3].x.powi(2);
        }
        // Uniform numbers have variance 1/12.
        let ratio = sum / f64::from(runs) * 12.0 * f64::from(passes);
        assert!((ratio - 1.0).abs() < 0.015, "{ratio}");
    }
}
