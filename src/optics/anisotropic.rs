//! What [`albedo`](super::albedo) has for one roughness, for two: M, which is missing after one facet, by cosine and azimuth.
//! Tabulated when the first such lobe is asked for, in some tens of milliseconds.

use super::albedo::{GAUSS, gauss, lerp, place, reflected};
use super::microfacet::Ggx;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

/// Nodes in the root of the larger α, of the ratio of both α, in azimuth and in cosine.
const NODES: [usize; 4] = [11, 6, 4, 12];
/// Nodes of the averages in ln α and in the root of the ratio.
const MEANS: [usize; 2] = [48, 11];
const SMALLEST: f64 = 1e-6;

struct Tables {
    /// M, the last node fastest.
    missing: Vec<f32>,
    /// ln of the cosine-weighted average of M.
    mean: [[f32; MEANS[1]]; MEANS[0]],
}

static TABLES: LazyLock<Tables> = LazyLock::new(Tables::build);

/// M for light from `w`, z > 0, on facets of roughnesses `alpha` along x and y.
pub(super) fn missing(w: DVec3, alpha: [f32; 2]) -> f32 {
    TABLES.missing(w, alpha.map(f64::from))
}

/// The cosine-weighted average of M.
pub(super) fn mean(alpha: [f32; 2]) -> f32 {
    TABLES.mean(alpha.map(f64::from))
}

/// The larger α, and the root of the smaller over it.
fn shape([a, b]: [f64; 2]) -> [f64; 2] {
    let larger = a.max(b).clamp(SMALLEST, 1.0);
    [larger, (a.min(b) / larger).sqrt()]
}

/// Roughness in the plane of incidence, whose azimuth from the larger α is `turn` quarters of a turn.
fn in_plane([larger, ratio]: [f64; 2], turn: f64) -> f64 {
    let (sin, cos) = (FRAC_PI_2 * turn).sin_cos();
    larger * cos.hypot(ratio * ratio * sin).max(SMALLEST)
}

impl Tables {
    fn build() -> Self {
        let [a, b, c, d] = NODES;
        let node = |i: usize, nodes: usize| i as f64 / (nodes - 1) as f64;
        let missing = (0..a * b * c * d).map(|k| {
            let larger = node(k / (b * c * d), a).powi(2).max(SMALLEST);
            let shape = [larger, node(k / (c * d) % b, b).max(LEAST)];
            let turn = node(k / d % c, c);
            let x = node(k % d, d).powi(2);
            let alpha = in_plane(shape, turn);
            let mu = (alpha * x / (1.0 + alpha - x)).min(1.0);
            let (sin, cos) = (FRAC_PI_2 * turn).sin_cos();
            let r = (1.0 - mu * mu).sqrt();
            let facets = Ggx { alpha: [larger, larger * shape[1] * shape[1]] };
            // Both sides: they are not alike.
            let chords = gauss(2).flat_map(|(node, weight)| [(node, 0.5 * weight), (-node, 0.5 * weight)]);
            reflected(&facets, DVec3::new(r * cos, r * sin, mu), chords)[0] as f32
        });
        let mut tables = Self { missing: missing.collect(), mean: [[0.0; MEANS[1]]; MEANS[0]] };
        for i in 0..MEANS[0] {
            for j in 0..MEANS[1] {
                let larger = SMALLEST.powf(1.0 - node(i, MEANS[0]));
                let ratio = node(j, MEANS[1]).max(LEAST);
                tables.mean[i][j] = tables.average([larger, larger * ratio * ratio]).ln() as f32;
            }
        }
        tables
    }

    fn missing(&self, w: DVec3, alpha: [f64; 2]) -> f32 {
        let [x, y] = if alpha[0] >= alpha[1] { [w.x, w.y] } else { [w.y, w.x] };
        let shape = shape(alpha);
        let turn = y.abs().atan2(x.abs()) / FRAC_PI_2;
        let alpha = in_plane(shape, turn);
        let x = w.z * (1.0 + alpha) / (w.z + alpha);
        let at = [shape[0].sqrt(), shape[1], turn, x.sqrt()];
        let places: [(usize, f32); 4] = std::array::from_fn(|k| place(at[k] as f32, NODES[k]));
        self.corner(&places, 0)
    }

    /// Between both nodes of the first of `places`, and so on.
    fn corner(&self, places: &[(usize, f32)], from: usize) -> f32 {
        let [(node, t), rest @ ..] = places else { return self.missing[from] };
        let below = from * NODES[NODES.len() - places.len()] + node;
        lerp(self.corner(rest, below), self.corner(rest, below + 1), *t)
    }

    fn mean(&self, alpha: [f64; 2]) -> f32 {
        let [larger, ratio] = shape(alpha);
        let (i, s) = place((1.0 - larger.ln() / SMALLEST.ln()) as f32, MEANS[0]);
        let (j, t) = place(ratio as f32, MEANS[1]);
        let [a, b] = [i, i + 1].map(|i| lerp(self.mean[i][j], self.mean[i][j + 1], t));
        lerp(a, b, s).exp()
    }

    /// Of the table as it is interpolated, so that what is given back is what is missing; over ln(μ + α).
    fn average(&self, alpha: [f64; 2]) -> f64 {
        let (turns, panels) = (6, 6);
        let mut sum = 0.0;
        for turn in 0..turns {
            let turn = (f64::from(turn) + 0.5) / f64::from(turns);
            let (sin, cos) = (FRAC_PI_2 * turn).sin_cos();
            let a = in_plane(shape(alpha), turn);
            let length = (1.0 / a).ln_1p() / f64::from(panels);
            for panel in 0..panels {
                for (node, weight) in GAUSS {
                    let mu = (a * (length * (f64::from(panel) + node)).exp_m1()).min(1.0);
                    let r = (1.0 - mu * mu).sqrt();
                    let here = f64::from(self.missing(DVec3::new(r * cos, r * sin, mu), alpha));
                    sum += 2.0 * mu * (mu + a) * length * weight * here;
                }
            }
        }
        sum / f64::from(turns)
    }
}

/// The smallest root of a ratio that is told from zero.
const LEAST: f64 = 1e-3;
