//! A hundred pictures as a few: all pictures of the square lie near a space of few dimensions.
//!
//! Principal components of pictures all over the square, each divided by its own mean, with pixels weighted by their
//! brightness. The picture at (s, t) is then Σ c_q(s, t) U_q, and every c_q is again a sum of sⁿ tᵐ.

use crate::atlas::Atlas;
use glam::Vec3;
use rayon::prelude::*;

/// The pictures of an atlas in few components.
pub struct Reduced {
    /// The components U_q, linear RGB radiance: no picture of the square has more of it than ±1 times.
    pub components: Vec<Vec<Vec3>>,
    /// For each component what each stored pair of powers contributes to c_q.
    pub coefficients: Vec<Vec<f64>>,
}

/// Pictures are looked at on a lattice of so many steps in each direction.
const STEPS: usize = 9;
/// No more components than this.
const MOST_COMPONENTS: usize = 16;
/// Enough of them when the rest is this share of a picture (root mean square), anywhere on the lattice.
const ENOUGH: f64 = 1.5e-3;
/// Pixels that decide about the components.
const MOST_PIXELS: usize = 40_000;
/// The frontier itself, where pictures grow without bound, is left out by this.
const WITHIN: f64 = 0.97;

impl Reduced {
    /// Finds the components.
    pub fn of(atlas: &Atlas) -> Self {
        let points: Vec<(f64, f64)> = (0..STEPS * STEPS)
            .map(|i| {
                let share = |i: usize| i as f64 / (STEPS - 1) as f64;
                let t = share(i / STEPS);
                let most = atlas.frontier.largest_s(t);
                (share(i % STEPS) * if most < 1.0 { WITHIN * most } else { 1.0 }, t)
            })
            .collect();
        let means: Vec<f64> = atlas.planes.iter().map(|plane| mean(plane)).collect();
        // Column p: what the stored pictures are multiplied by for the picture at point p, over its mean.
        let columns: Vec<Vec<f64>> = points
            .iter()
            .map(|&(s, t)| {
                let weights = atlas.weights(s, t);
                let whole: f64 = weights.iter().zip(&means).map(|(w, m)| w * m).sum();
                weights.iter().map(|w| if whole > 0.0 { w / whole } else { 0.0 }).collect()
            })
            .collect();
        let gram = gram(atlas);
        let through: Vec<Vec<f64>> = columns.iter().map(|column| times(&gram, column)).collect();
        let between = through.iter().map(|a| columns.iter().map(|b| dot(a, b)).collect()).collect();
        let (values, vectors) = eigen(between);
        let mut rest: Vec<f64> = columns.iter().zip(&through).map(|(a, b)| dot(a, b)).collect();
        let whole = rest.clone();
        let mut reduced = Self { components: Vec::new(), coefficients: Vec::new() };
        for (value, vector) in values.iter().zip(&vectors).take(MOST_COMPONENTS) {
            let worst = rest.iter().zip(&whole).map(|(r, w)| r / w).fold(0.0, f64::max);
            if worst.is_nan() || worst <= ENOUGH * ENOUGH || *value <= 1e-12 * values[0] {
                break;
            }
            rest.iter_mut().zip(vector).for_each(|(rest, x)| *rest -= value * x * x);
            reduced.push(atlas, &columns, &through, *value, vector, &points);
        }
        reduced
    }

    fn push(
        &mut self,
        atlas: &Atlas,
        columns: &[Vec<f64>],
        through: &[Vec<f64>],
        value: f64,
        vector: &[f64],
        points: &[(f64, f64)],
    ) {
        let combined = |rows: &[Vec<f64>]| -> Vec<f64> {
            (0..atlas.planes.len())
                .map(|bin| rows.iter().zip(vector).map(|(row, x)| row[bin] * x).sum::<f64>() / value.sqrt())
                .collect()
        };
        let (mut into, mut from) = (combined(columns), combined(through));
        let largest = points.iter().map(|&(s, t)| dot(&from, &atlas.weights(s, t)).abs()).fold(0.0, f64::max);
        from.iter_mut().for_each(|c| *c /= largest);
        into.iter_mut().for_each(|c| *c *= largest);
        let mut component = vec![Vec3::ZERO; atlas.width as usize * atlas.height as usize];
        for (plane, weight) in atlas.planes.iter().zip(&into) {
            let weight = *weight as f32;
            component.iter_mut().zip(plane).for_each(|(sum, x)| *sum += weight * *x);
        }
        self.components.push(component);
        self.coefficients.push(from);
    }

    /// The picture at (s, t), of one pixel.
    pub fn pixel(&self, weights: &[f64], pixel: usize) -> Vec3 {
        let components = self.coefficients.iter().zip(&self.components);
        components.map(|(c, plane)| dot(c, weights) as f32 * plane[pixel]).sum()
    }
}

/// Products of the stored pictures with each other, in units of brightness: Σ A_a A_b / (L² + (mean/20)²) over pixels
/// and channels, L half-way into the square.
fn gram(atlas: &Atlas) -> Vec<Vec<f64>> {
    let weights = atlas.weights(0.5 * atlas.frontier.largest_s(0.5), 0.5);
    let pixels = atlas.width as usize * atlas.height as usize;
    let stride = pixels.div_ceil(MOST_PIXELS);
    let chosen: Vec<usize> = (0..pixels).step_by(stride).collect();
    let at = |plane: &Vec<Vec3>, i: usize| plane.get(i).copied().unwrap_or(Vec3::ZERO);
    let brightness: Vec<Vec3> = chosen
        .iter()
        .map(|&i| atlas.planes.iter().zip(&weights).map(|(plane, w)| *w as f32 * at(plane, i)).sum())
        .collect();
    let floor = 0.05 * mean(&brightness) as f32;
    let scaled: Vec<Vec<Vec3>> = atlas
        .planes
        .par_iter()
        .map(|plane| {
            let pixels = chosen.iter().zip(&brightness);
            pixels.map(|(&i, l)| at(plane, i) / (*l * *l + floor * floor).map(f32::sqrt)).collect()
        })
        .collect();
    let over = 1.0 / (3.0 * chosen.len() as f64);
    (0..scaled.len())
        .into_par_iter()
        .map(|a| {
            let product = |b: &Vec<Vec3>| {
                let pairs = scaled[a].iter().zip(b);
                over * pairs.map(|(x, y)| f64::from(x.dot(*y))).sum::<f64>()
            };
            if atlas.planes[a].is_empty() {
                vec![0.0; scaled.len()]
            } else {
                scaled.iter().map(product).collect()
            }
        })
        .collect()
}

fn mean(plane: &[Vec3]) -> f64 {
    plane.iter().map(|v| f64::from(v.element_sum())).sum::<f64>() / (3.0 * plane.len().max(1) as f64)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn times(matrix: &[Vec<f64>], vector: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| dot(row, vector)).collect()
}

/// Eigenvalues of a symmetric matrix, largest first, and their unit vectors: Jacobi's rotations.
fn eigen(mut a: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
    const SWEEPS: usize = 30;
    let n = a.len();
    let mut vectors: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for _ in 0..SWEEPS {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i][j] * a[i][j]).sum();
        let trace: f64 = (0..n).map(|i| a[i][i] * a[i][i]).sum();
        if off <= 1e-28 * trace {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let tan = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let cos = 1.0 / tan.hypot(1.0);
                let sin = tan * cos;
                for row in &mut a {
                    (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
                }
                let (upper, lower) = a.split_at_mut(q);
                rotate(&mut upper[p], &mut lower[0], cos, sin);
                let (upper, lower) = vectors.split_at_mut(q);
                rotate(&mut upper[p], &mut lower[0], cos, sin);
            }
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|i, j| a[*j][*j].total_cmp(&a[*i][*i]));
    (order.iter().map(|&i| a[i][i]).collect(), order.iter().map(|&i| vectors[i].clone()).collect())
}

fn rotate(p: &mut [f64], q: &mut [f64], cos: f64, sin: f64) {
    for (x, y) in p.iter_mut().zip(q) {
        (*x, *y) = (cos * *x - sin * *y, sin * *x + cos * *y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_and_vectors() {
        let matrix = vec![vec![2.0, 1.0, 0.0], vec![1.0, 2.0, 0.0], vec![0.0, 0.0, 5.0]];
        let (values, vectors) = eigen(matrix.clone());
        for (found, expected) in values.iter().zip([5.0, 3.0, 1.0]) {
            assert!((found - expected).abs() < 1e-12);
        }
        for (value, vector) in values.iter().zip(&vectors) {
            let off =
                times(&matrix, vector).iter().zip(vector).map(|(a, b)| (a - value * b).abs()).sum::<f64>();
            assert!(off < 1e-10 && (dot(vector, vector) - 1.0).abs() < 1e-12);
        }
    }
}
