//! The filter itself, band of rows by band of rows.

use super::planes::{Planes, Three};
use super::taps::Tap;
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Rows that are filtered together: the two beyond them, which patches reach, are looked at twice.
const BAND: usize = 16;
/// From how many times what noise explains on, and once more, the squared difference of two patches tells them apart.
const BEYOND: f32 = 3.0;
/// By how many times their variances may differ: two pixels that show the same have errors alike. It leaves bright outliers alone, which
/// would light all around them.
const SPREAD: f32 = 16.0;
/// The difference of albedos, and that of normals, from which two pixels have nothing to do with each other.
const ALBEDO: f32 = 0.1;
const NORMAL: f32 = 0.5;

/// What each value is to be changed by.
pub(super) fn changes(planes: &Planes, taps: &[Tap]) -> Vec<Vec3> {
    let bands = planes.height.div_ceil(BAND);
    let band = |b: usize| Band::new(planes, b * BAND..((b + 1) * BAND).min(planes.height)).filtered(taps);
    (0..bands).into_par_iter().flat_map_iter(band).collect()
}

/// Rows under way.
struct Band<'a> {
    planes: &'a Planes,
    rows: Range<usize>,
    /// Σ weight · (value of the neighbour − own), and Σ weight.
    changes: Three,
    weights: Vec<f32>,
    /// Of each row and the two beyond: squared differences by what is to be expected of noise, the mean of three pixels side by side.
    differences: Vec<f32>,
    /// A row of them before the mean.
    difference: Vec<f32>,
    weight: Vec<f32>,
}

impl<'a> Band<'a> {
    fn new(planes: &'a Planes, rows: Range<usize>) -> Self {
        let width = planes.width;
        let zeros = |rows: usize| vec![0.0; rows * width];
        Self {
            planes,
            changes: [(); 3].map(|()| zeros(rows.len())),
            weights: zeros(rows.len()),
            differences: zeros(rows.len() + 2),
            difference: zeros(1),
            weight: zeros(1),
            rows,
        }
    }

    fn filtered(mut self, taps: &[Tap]) -> Vec<Vec3> {
        for tap in taps {
            self.meet(*tap);
        }
        let Self { changes: [r, g, b], weights, .. } = &self;
        (0..weights.len()).map(|i| Vec3::new(r[i], g[i], b[i]) / weights[i]).collect()
    }

    /// Takes in one neighbour of every pixel.
    fn meet(&mut self, tap: Tap) {
        let (width, height) = (self.planes.width, self.planes.height);
        let Some(xs) = overlap(width, tap.dx) else { return };
        if overlap(height, tap.dy).is_none_or(|ys| ys.start >= self.rows.end || ys.end <= self.rows.start) {
            return;
        }
        for k in 0..self.rows.len() + 2 {
            if let Some((y, there)) = self.pair(k, tap.dy) {
                self.compare(y, there, &xs, tap.dx);
                means_of_three(&self.difference[xs.clone()], &mut self.differences[span(width, k, &xs, 0)]);
            }
        }
        for y in self.rows.clone() {
            if let Some(there) = y.checked_add_signed(tap.dy).filter(|y| *y < height) {
                self.weigh(y, there, &xs, tap);
                self.add(y, there, &xs, tap.dx);
            }
        }
    }

    /// The `k`th row under way, the first of which is the one before the band, and the one that is compared with it. None: they are not
    /// both in the picture.
    fn pair(&self, k: usize, dy: isize) -> Option<(usize, usize)> {
        let inside = |y: &usize| *y < self.planes.height;
        let y = (self.rows.start + k).checked_sub(1).filter(inside)?;
        Some((y, y.checked_add_signed(dy).filter(inside)?))
    }

    /// Squared differences of a row and one elsewhere, by their variances.
    fn compare(&mut self, y: usize, there: usize, xs: &Range<usize>, dx: isize) {
        let (here, there) = (span(self.planes.width, y, xs, 0), span(self.planes.width, there, xs, dx));
        let row = &mut self.difference[xs.clone()];
        row.fill(0.0);
        for value in &self.planes.value {
            let pairs = value[here.clone()].iter().zip(&value[there.clone()]);
            row.iter_mut().zip(pairs).for_each(|(sum, (a, b))| *sum += (a - b) * (a - b));
        }
        let variances = self.planes.variance[here].iter().zip(&self.planes.variance[there]);
        // What is equal is, also without noise; without noise nothing else is.
        let explained =
            |(sum, (a, b)): (&mut f32, (&f32, &f32))| *sum = if *sum > 0.0 { *sum / (a + b) } else { 0.0 };
        row.iter_mut().zip(variances).for_each(explained);
    }

    /// What the neighbours of a row count.
    fn weigh(&mut self, y: usize, there: usize, xs: &Range<usize>, tap: Tap) {
        let k = y - self.rows.start;
        // At the rim of the picture the row itself stands for the one that is not there.
        let around = [k, k + 1, k + 2].map(|row| self.pair(row, tap.dy).map_or(k + 1, |_| row));
        let Self { planes, differences, weight, .. } = self;
        let width = planes.width;
        let (here, there) = (span(width, y, xs, 0), span(width, there, xs, tap.dx));
        let weight = &mut weight[xs.clone()];
        weight.fill(0.0);
        for (features, limit) in [(&planes.albedo, ALBEDO), (&planes.normal, NORMAL)] {
            for plane in features {
                let pairs = plane[here.clone()].iter().zip(&plane[there.clone()]);
                let difference = |(sum, (a, b)): (&mut f32, (&f32, &f32))| *sum += ((a - b) / limit).powi(2);
                weight.iter_mut().zip(pairs).for_each(difference);
            }
        }
        let [above, own, below] = around.map(|row| &differences[span(width, row, xs, 0)]);
        let (variance, others, usable) =
            (&planes.variance[here], &planes.variance[there.clone()], &planes.usable[there]);
        for (i, weight) in weight.iter_mut().enumerate() {
            let difference = (above[i] + own[i] + below[i]) / 3.0;
            let (most, least) = (variance[i].max(others[i]), variance[i].min(others[i]));
            let spread = if most > least { most / least - 1.0 } else { 0.0 };
            let like = 1.0 - *weight - (difference - 1.0).max(0.0) / BEYOND - spread / SPREAD;
            let like = like.max(0.0);
            *weight = tap.weight * usable[i] * like * like;
        }
    }

    /// Adds the neighbours of a row by their weights.
    fn add(&mut self, y: usize, there: usize, xs: &Range<usize>, dx: isize) {
        let width = self.planes.width;
        let (here, there) = (span(width, y, xs, 0), span(width, there, xs, dx));
        let own = span(width, y - self.rows.start, xs, 0);
        let weight = &self.weight[xs.clone()];
        self.weights[own.clone()].iter_mut().zip(weight).for_each(|(sum, weight)| *sum += weight);
        for (value, changes) in self.planes.value.iter().zip(&mut self.changes) {
            let pairs = value[here.clone()].iter().zip(&value[there.clone()]).zip(weight);
            let change = |(sum, ((a, b), weight)): (&mut f32, ((&f32, &f32), &f32))| *sum += weight * (b - a);
            changes[own.clone()].iter_mut().zip(pairs).for_each(change);
        }
    }
}

/// Of so many places those that have a neighbour `by` further on. None: none has.
fn overlap(len: usize, by: isize) -> Option<Range<usize>> {
    let (before, after) = ((-by).max(0) as usize, by.max(0) as usize);
    (before + after < len).then(|| before..len - after)
}

/// Where in a plane pixels `xs` of a row lie, moved by `dx`.
fn span(width: usize, y: usize, xs: &Range<usize>, dx: isize) -> Range<usize> {
    let begin = (y * width + xs.start).wrapping_add_signed(dx);
    begin..begin + xs.len()
}

/// Of each number and the two beside it, or the one.
fn means_of_three(from: &[f32], to: &mut [f32]) {
    let last = from.len() - 1;
    to[0] = from[0];
    if last > 0 {
        to[0] = 0.5 * (from[0] + from[1]);
        to[last] = 0.5 * (from[last - 1] + from[last]);
        to[1..last]
            .iter_mut()
            .zip(from.windows(3))
            .for_each(|(to, from)| *to = (from[0] + from[1] + from[2]) / 3.0);
    }
}
