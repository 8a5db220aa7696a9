//! The error bar anywhere in the square: standard errors over passes at 25 points, interpolated linearly in between.
//!
//! Orders of one pixel share photons, so errors of single orders would not do. At each point the spread of the picture
//! itself is measured, pass by pass, later by small groups of passes. As a function of s and t a standard error is smooth,
//! increasing and (but for rounding) convex, so the lines between points lie above it, by no more than about a tenth.

use super::frontier::Frontier;
use super::nodes::{self, Colours, Nodes};
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

/// Sums of squared deviations at every point, one group of passes after another (Welford).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColourSpread {
    pub(super) spread: [DVec3; POINTS],
}

impl ColourSpread {
    /// Adds `passes` after `before` others; `away`: how far their average colours are from those of the others.
    pub fn add(&mut self, away: &[DVec3; POINTS], before: u32, passes: u32) {
        let (n, k) = (f64::from(before), f64::from(passes));
        for (spread, away) in self.spread.iter_mut().zip(away) {
            *spread += *away * *away * (n * k / (n + k));
        }
    }

    /// Standard errors of the mean of `passes` in `groups` (two or more).
    pub fn errors(&self, passes: u32, groups: u32) -> [DVec3; POINTS] {
        let scale = f64::from(passes) * (f64::from(groups) - 1.0);
        self.spread.map(|spread| (spread / scale).map(f64::sqrt))
    }
}

/// What sums by stored powers make at every point of the grid: sⁿ tᵐ of each.
pub struct AtGrid {
    /// tᵐ of every t, by node of m.
    t_powers: Vec<[f32; GRID.len()]>,
    /// sⁿ of every point, by node of n.
    s_powers: Vec<[f32; POINTS]>,
}

impl AtGrid {
    /// For these powers, where images exist up to the frontier.
    pub fn new(n: &Nodes, m: &Nodes, frontier: &Frontier) -> Self {
        let t_powers = |m: &u8| GRID.map(|t| t.powi((*m).into()) as f32);
        let s_powers = |n: &u8| {
            std::array::from_fn(|at| {
                point(frontier, at / GRID.len(), at % GRID.len()).0.powi((*n).into()) as f32
            })
        };
        Self {
            t_powers: m.powers().iter().map(t_powers).collect(),
            s_powers: n.powers().iter().map(s_powers).collect(),
        }
    }

    /// The picture at every point; `sums` by node of n, then m.
    #[inline(always)]
    pub fn of<S: Simd>(&self, simd: S, sums: &[Colours]) -> [Colours; POINTS] {
        let mut values = [Colours::default(); POINTS];
        for (sums, s_powers) in sums.chunks_exact(self.t_powers.len()).zip(&self.s_powers) {
            let s_powers = s_powers.as_chunks::<{ GRID.len() }>().0;
            for (i, (values, s_powers)) in values.chunks_exact_mut(GRID.len()).zip(s_powers).enumerate() {
                let mut by_t = [f32x8::simd_from(simd, 0.0); 3];
                for (sum, t_powers) in sums.iter().zip(&self.t_powers) {
                    if t_powers[i] != 0.0 {
                        nodes::add(simd, &mut by_t, sum, t_powers[i]);
                    }
                }
                for (value, s_power) in values.iter_mut().zip(s_powers).filter(|(_, power)| **power != 0.0) {
                    for (value, by_t) in value.iter_mut().zip(by_t) {
                        (f32x8::load_array_ref(simd, value) + by_t * *s_power).store_array(value);
                    }
                }
            }
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::super::frontier::Sample;
    use super::*;
    use crate::atlas::places::ABREAST;
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
        let mut sums = vec![Colours::default(); n.len() * m.len()];
        for (i, x) in sums.as_flattened_mut().as_flattened_mut().iter_mut().enumerate() {
            *x = 1.0 + (i * 7 % 11) as f32;
        }
        let at_grid = AtGrid::new(&n, &m, &frontier);
        let found = dispatch!(Level::new(), simd => at_grid.of(simd, &sums));
        for at in 0..POINTS {
            let (s, t) = point(&frontier, at / GRID.len(), at % GRID.len());
            let (across, along) = (n.weights(s), m.weights(t));
            for (channel, pixel) in (0..3).flat_map(|channel| (0..ABREAST).map(move |pixel| (channel, pixel)))
            {
                let weights = across.iter().flat_map(|a| along.iter().map(move |b| a * b));
                let terms = weights.zip(&sums).map(|(w, sum)| w * f64::from(sum[channel][pixel]));
                let truth: f64 = terms.sum();
                let found = f64::from(found[at][channel][pixel]);
                assert!((found / truth - 1.0).abs() < 1e-5, "{s} {t}: {found} for {truth}");
            }
        }
    }

    #[test]
    fn spreads_are_those_of_two_sweeps() {
        let passes = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0_f32];
        let mut colour = ColourSpread::default();
        for (before, x) in passes.iter().enumerate() {
            let mean = passes[..before].iter().sum::<f32>() / before.max(1) as f32;
            colour.add(&[DVec3::splat(f64::from(*x - mean)); POINTS], before as u32, 1);
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
            let (mut before, mut all) = (0, 0.0);
            for k in groups {
                let these = (0..k).map(|_| f64::from(rng.f32())).sum::<f64>();
                let away = these / f64::from(k) - all / f64::from(before.max(1));
                colour.add(&[DVec3::splat(away); POINTS], before, k);
                (before, all) = (before + k, all + these);
            }
            sum += colour.errors(passes, groups.len() as u32)[3].x.powi(2);
        }
        // Uniform numbers have variance 1/12.
        let ratio = sum / f64::from(runs) * 12.0 * f64::from(passes);
        assert!((ratio - 1.0).abs() < 0.015, "{ratio}");
    }
}
