//! The filter itself, band of rows by band of rows.

use super::planes::{Planes, Three};
use super::taps::Tap;
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Rows that are filtered together: the two beyond them, which patches reach, are looked at twice.
const BAND: usize = 16;
/// By how many times what noise explains the squared difference of two patches may be larger.
const BEYOND: f32 = 4.0;
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
    /// Of each row and the two beyond: squared differences, and what is to be expected of noise, over three pixels side by side.
    squares: Vec<f32>,
    noise: Vec<f32>,
    /// A row before its sums.
    square: Vec<f32>,
    variance: Vec<f32>,
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
            squares: zeros(rows.len() + 2),
            noise: zeros(rows.len() + 2),
            square: zeros(1),
            variance: zeros(1),
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
            let y = (self.rows.start + k).checked_sub(1).filter(|y| *y < height);
            let there = y.and_then(|y| y.checked_add_signed(tap.dy)).filter(|y| *y < height);
            self.square.fill(0.0);
            self.variance.fill(0.0);
            if let (Some(y), Some(there)) = (y, there) {
                self.compare(y, there, &xs, tap.dx);
            }
            let row = k * width..(k + 1) * width;
            sums_of_three(&self.square, &mut self.squares[row.clone()]);
            sums_of_three(&self.variance, &mut self.noise[row]);
        }
        for y in self.rows.clone() {
            if let Some(there) = y.checked_add_signed(tap.dy).filter(|y| *y < height) {
                self.weigh(y, there, &xs, tap);
                self.add(y, there, &xs, tap.dx);
            }
        }
    }

    /// Squared differences of a row and one elsewhere, and what noise makes them in the mean.
    fn compare(&mut self, y: usize, there: usize, xs: &Range<usize>, dx: isize) {
        let (here, there) = (span(self.planes.width, y, xs, 0), span(self.planes.width, there, xs, dx));
        for axis in 0..3 {
            let (value, variance) = (&self.planes.value[axis], &self.planes.variance[axis]);
            let pairs = value[here.clone()].iter().zip(&value[there.clone()]);
            self.square[xs.clone()].iter_mut().zip(pairs).for_each(|(sum, (a, b))| *sum += (a - b) * (a - b));
            let pairs = variance[here.clone()].iter().zip(&variance[there.clone()]);
            self.variance[xs.clone()].iter_mut().zip(pairs).for_each(|(sum, (a, b))| *sum += a + b);
        }
    }

    /// What the neighbours of a row count.
    fn weigh(&mut self, y: usize, there: usize, xs: &Range<usize>, tap: Tap) {
        let Self { planes, rows, squares, noise, weight, .. } = self;
        let (width, k) = (planes.width, y - rows.start);
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
        let [s0, s1, s2] = [0, 1, 2].map(|row| &squares[span(width, k + row, xs, 0)]);
        let [n0, n1, n2] = [0, 1, 2].map(|row| &noise[span(width, k + row, xs, 0)]);
        let usable = &planes.usable[there];
        for (i, weight) in weight.iter_mut().enumerate() {
            let (squares, noise) = (s0[i] + s1[i] + s2[i], n0[i] + n1[i] + n2[i]);
            // Two patches without noise that are equal are: no difference is explained by nothing.
            let beyond = if squares <= noise { 0.0 } else { (squares - noise) / (BEYOND * noise) };
            let like = (1.0 - *weight - beyond).max(0.0);
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

/// Of each number and the two beside it.
fn sums_of_three(from: &[f32], to: &mut [f32]) {
    let last = from.len() - 1;
    if last == 0 {
        to[0] = from[0];
        return;
    }
    to[0] = from[0] + from[1];
    to[last] = from[last - 1] + from[last];
    to[1..last].iter_mut().zip(from.windows(3)).for_each(|(to, from)| *to = from[0] + from[1] + from[2]);
}
