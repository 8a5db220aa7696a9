//! The error bar anywhere in the square: standard errors over passes at 25 points, and lines between them.
//!
//! Orders of one pixel share photons, so errors of single orders would not do: at each point it is the picture
//! itself whose spread is measured, pass by pass. As a function of s and t a standard error is a smooth, rising and
//! (but for rounding) convex one, so that the lines between points lie above it, by no more than about a tenth.

use super::frontier::Frontier;
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

/// So many passes at the beginning are all measured.
const ALL_MEASURED: u32 = 8;
/// Then one in so many: reading a pixel at every point of the grid costs more than a tenth of a pass.
const ONE_IN: u32 = 4;

/// For how many passes the spread of `pass` stands; zero where it is not measured.
fn weight(pass: u32) -> f64 {
    match pass {
        _ if pass < ALL_MEASURED => 1.0,
        _ if pass.is_multiple_of(ONE_IN) => ONE_IN.into(),
        _ => 0.0,
    }
}

/// How one pass changes means and spreads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Its weight.
    weight: f64,
    /// That, relative to the weight of all passes so far and its own.
    share: f64,
}

impl Step {
    /// None: `pass` is not measured.
    pub fn of(pass: u32) -> Option<Self> {
        let weight = weight(pass);
        (weight > 0.0).then(|| Self { weight, share: weight / Measured::of(pass + 1).weights })
    }
}

/// What is known of the passes whose spread was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    passes: f64,
    /// Sums over them of weights and squared weights.
    weights: f64,
    squares: f64,
}

impl Measured {
    /// Of the first `passes`.
    pub fn of(passes: u32) -> Self {
        let sum = |power: i32| (0..passes).map(|pass| weight(pass).powi(power)).sum();
        Self { passes: passes.into(), weights: sum(1), squares: sum(2) }
    }

    /// By this the sum of squared deviations is multiplied for the squared standard error of the mean of all passes; two or
    /// more. Unbiased: passes of weights w spread by σ² (Σw − Σw²/Σw).
    pub fn scale(&self) -> f64 {
        1.0 / (self.passes * (self.weights - self.squares / self.weights))
    }

    /// So many passes of equal weight would tell the spread as well.
    pub fn equal_passes(&self) -> u32 {
        (self.weights * self.weights / self.squares) as u32
    }
}

/// Weighted mean and sum of squared deviations at every point, one pass after another (West 1979).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColourSpread {
    mean: [DVec3; POINTS],
    spread: [DVec3; POINTS],
}

impl ColourSpread {
    /// Adds the average colours of a pass.
    pub fn add(&mut self, colours: &[DVec3; POINTS], step: &Step) {
        for (i, colour) in colours.iter().enumerate() {
            let away = *colour - self.mean[i];
            self.mean[i] += step.share * away;
            self.spread[i] += step.weight * away * (*colour - self.mean[i]);
        }
    }

    /// Standard errors of the mean of the passes (two or more).
    pub fn errors(&self, measured: &Measured) -> [DVec3; POINTS] {
        self.spread.map(|spread| (spread * measured.scale()).map(f64::sqrt))
    }
}

/// Red, green and blue at each t of the grid, in one row that vector units like.
pub type AtEachT = [f32; LANES];
/// Its length: the last lane is spare.
pub const LANES: usize = 16;
/// Numbers in a pixel's record: means, then spreads, each row by row (share of s).
pub const RECORD: usize = 2 * GRID.len() * LANES;

/// Where the spread of a point's red is in the record; green and blue follow.
pub fn place_of_spread(point: usize) -> usize {
    GRID.len() * LANES + point % GRID.len() * LANES + 3 * (point / GRID.len())
}

/// The same as [`ColourSpread::add`] for one pixel and the row `j` of its record.
#[inline(always)]
pub fn add_to_record(record: &mut [f32], j: usize, values: &AtEachT, step: &Step) {
    let (means, spreads) = record.split_at_mut(GRID.len() * LANES);
    let (means, spreads) = (&mut means[j * LANES..][..LANES], &mut spreads[j * LANES..][..LANES]);
    let (weight, share) = (step.weight as f32, step.share as f32);
    for lane in 0..LANES {
        let away = values[lane] - means[lane];
        means[lane] += share * away;
        spreads[lane] += weight * away * (values[lane] - means[lane]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::frontier::Sample;
    use super::*;
    use crate::sampling::{Rng, Stream};

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
    fn spreads_are_those_of_two_sweeps() {
        // Numbers of pass n are i.i.d.; of the later ones only those count that are measured.
        let passes: Vec<f32> = (0..30_u32).map(|n| (n * n * 7 % 11) as f32).collect();
        let mut record = vec![0.0; RECORD];
        let mut colour = ColourSpread::default();
        for (pass, x) in (0_u32..).zip(&passes) {
            let Some(step) = Step::of(pass) else { continue };
            add_to_record(&mut record, 2, &[*x; LANES], &step);
            colour.add(&[DVec3::splat(f64::from(*x)); POINTS], &step);
        }
        let weighted = || (0_u32..).zip(&passes).map(|(pass, x)| (weight(pass), f64::from(*x)));
        let all: f64 = weighted().map(|(w, _)| w).sum();
        let mean = weighted().map(|(w, x)| w * x).sum::<f64>() / all;
        let spread: f64 = weighted().map(|(w, x)| w * (x - mean).powi(2)).sum();
        assert!((f64::from(record[place_of_spread(7)]) / spread - 1.0).abs() < 1e-5);
        assert!((f64::from(record[2 * LANES + 3]) - mean).abs() < 1e-5);
        let measured = Measured::of(30);
        let error = (spread * measured.scale()).sqrt();
        assert!((colour.errors(&measured)[7].x - error).abs() < 1e-6);
    }

    #[test]
    fn where_all_passes_are_measured_errors_are_the_plain_ones() {
        for passes in 2..=8 {
            let measured = Measured::of(passes);
            let n = f64::from(passes);
            assert!((measured.scale() * n * (n - 1.0) - 1.0).abs() < 1e-12);
            assert_eq!(measured.equal_passes(), passes);
        }
        assert_eq!((Measured::of(64).weights, Measured::of(64).equal_passes()), (64.0, 17));
    }

    #[test]
    fn the_squared_error_is_unbiased() {
        let (passes, trials) = (29_u32, 4_000_u32);
        let mut rng = Rng::new(5, Stream::Test, 0, 0);
        let (mut estimated, mut squares) = (0.0, 0.0);
        for _ in 0..trials {
            let mut colour = ColourSpread::default();
            for pass in 0..passes {
                let x = DVec3::splat(f64::from(rng.f32()));
                Step::of(pass).iter().for_each(|step| colour.add(&[x; POINTS], step));
            }
            let variance = colour.errors(&Measured::of(passes))[0].x.powi(2);
            estimated += variance;
            squares += variance * variance;
        }
        let n = f64::from(trials);
        let (mean, truth) = (estimated / n, 1.0 / 12.0 / f64::from(passes));
        let error = ((squares / n - mean * mean) / n).sqrt();
        assert!((mean - truth).abs() < 3.5 * error, "{mean} ± {error} for {truth}");
        assert!((mean - 1.02 * truth).abs() > 3.5 * error, "too noisy to tell 2 %");
    }
}
