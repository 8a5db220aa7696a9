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

/// Mean and sum of squared deviations at every point, one pass after another (Welford).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColourSpread {
    mean: [DVec3; POINTS],
    spread: [DVec3; POINTS],
}

impl ColourSpread {
    /// Adds the average colours of the pass after `before` others.
    pub fn add(&mut self, colours: &[DVec3; POINTS], before: u32) {
        let n = f64::from(before) + 1.0;
        for (i, colour) in colours.iter().enumerate() {
            let away = *colour - self.mean[i];
            self.mean[i] += away / n;
            self.spread[i] += away * (*colour - self.mean[i]);
        }
    }

    /// Standard errors of the mean of `passes` (two or more).
    pub fn errors(&self, passes: u32) -> [DVec3; POINTS] {
        let n = f64::from(passes);
        self.spread.map(|spread| (spread / (n * (n - 1.0))).map(f64::sqrt))
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
pub fn add_to_record(record: &mut [f32], j: usize, values: &AtEachT, before: u32) {
    let (means, spreads) = record.split_at_mut(GRID.len() * LANES);
    let (means, spreads) = (&mut means[j * LANES..][..LANES], &mut spreads[j * LANES..][..LANES]);
    let over = 1.0 / (before as f32 + 1.0);
    for lane in 0..LANES {
        let away = values[lane] - means[lane];
        means[lane] += away * over;
        spreads[lane] += away * (values[lane] - means[lane]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::frontier::Sample;
    use super::*;

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
        let passes = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0_f32];
        let mut record = vec![0.0; RECORD];
        let mut colour = ColourSpread::default();
        for (before, x) in passes.iter().enumerate() {
            add_to_record(&mut record, 2, &[*x; LANES], before as u32);
            colour.add(&[DVec3::splat(f64::from(*x)); POINTS], before as u32);
        }
        let mean = passes.iter().sum::<f32>() / 6.0;
        let spread = passes.iter().map(|x| (x - mean) * (x - mean)).sum::<f32>();
        assert!(
            (record[place_of_spread(7)] - spread).abs() < 1e-4 && (record[2 * LANES + 3] - mean).abs() < 1e-6
        );
        let error = (f64::from(spread) / 30.0).sqrt();
        assert!((colour.errors(6)[7].x - error).abs() < 1e-6);
    }
}
