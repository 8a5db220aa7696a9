//! What one facet of a rough interface of two indices does not send on, tabulated by index when one is first asked for (about
//! 35 ms for each of the four rows that a glass needs).
//!
//! From the side where the index on the other side is η times the own one, M(μ, α, η) of the light at cosine μ meets a second
//! facet: what is mirrored down or refracted up, and what is shadowed. The coordinate of cosines is √ln(1 + μ/α), of roughnesses
//! √α, and of indices the root of (η − 1) / (η + 1) with its sign: where η falls below one, total reflection begins at a cosine
//! that goes with that root.

use super::albedo::{GAUSS, lerp, place};
use super::fresnel_dielectric;
use super::microfacet::{Ggx, mirror};
use glam::DVec3;
use std::array;
use std::sync::OnceLock;

/// Nodes in cosines, roughnesses and indices; of averages, even in ln α.
const COSINES: usize = 32;
const ROUGHNESSES: usize = 20;
const INDICES: usize = 49;
const AVERAGES: usize = 192;
/// The largest root of a contrast, that of an index of 99.5: what is beyond is taken for it.
const LARGEST: f64 = 0.99;
/// The smallest roughness that is told from zero, α and √α.
const SMALLEST: f32 = 1e-6;
const SMOOTHEST: f32 = 1e-3;
/// Facets that are looked at, around and out.
const FACETS: [u32; 2] = [16, 24];

/// Of one index.
struct Row {
    missing: [[f32; COSINES]; ROUGHNESSES],
    mean: [f32; AVERAGES],
}

static ROWS: [OnceLock<Box<Row>>; INDICES] = [const { OnceLock::new() }; INDICES];

/// M for light at cosine `mu` in [0, 1].
pub(super) fn missing(mu: f32, alpha: f32, eta: f64) -> f32 {
    of_rows(eta, |row| row.missing(mu, alpha))
}

/// Its cosine-weighted average.
pub(super) fn mean(alpha: f32, eta: f64) -> f32 {
    of_rows(eta, |row| row.mean(alpha))
}

/// Between the rows on both sides of an index.
fn of_rows(eta: f64, look: impl Fn(&Row) -> f32) -> f32 {
    let contrast = (eta - 1.0) / (eta + 1.0);
    let root = contrast.abs().sqrt().copysign(contrast);
    let (k, t) = place((0.5 * (root / LARGEST + 1.0)) as f32, INDICES);
    let row = |k: usize| ROWS[k].get_or_init(|| Row::build(index_of(k)));
    lerp(look(row(k)), look(row(k + 1)), t)
}

/// The index of a row.
fn index_of(k: usize) -> f64 {
    let root = LARGEST * (2.0 * k as f64 / (INDICES - 1) as f64 - 1.0);
    let contrast = (root * root).copysign(root);
    (1.0 + contrast) / (1.0 - contrast)
}

fn roughness_of(i: usize) -> f64 {
    let root = SMOOTHEST + (1.0 - SMOOTHEST) * i as f32 / (ROUGHNESSES - 1) as f32;
    f64::from(root * root)
}

impl Row {
    fn build(eta: f64) -> Box<Self> {
        let missing = array::from_fn(|i| {
            let alpha = roughness_of(i);
            let cosine = |j: usize| {
                let x = j as f64 / (COSINES - 1) as f64;
                alpha * ((1.0 / alpha).ln_1p() * x * x).exp_m1()
            };
            array::from_fn(|j| integrate(cosine(j).min(1.0), alpha, eta, FACETS) as f32)
        });
        let mut row = Box::new(Self { missing, mean: [0.0; AVERAGES] });
        row.mean = array::from_fn(|i| row.average(SMALLEST.powf(1.0 - i as f32 / (AVERAGES - 1) as f32)));
        row
    }

    fn missing(&self, mu: f32, alpha: f32) -> f32 {
        let alpha = alpha.clamp(SMALLEST, 1.0);
        let (i, s) = place((alpha.sqrt() - SMOOTHEST) / (1.0 - SMOOTHEST), ROUGHNESSES);
        let (j, t) = place(((mu / alpha).ln_1p() / (1.0 / alpha).ln_1p()).sqrt(), COSINES);
        let [a, b] = [i, i + 1].map(|i| lerp(self.missing[i][j], self.missing[i][j + 1], t));
        lerp(a, b, s)
    }

    fn mean(&self, alpha: f32) -> f32 {
        let (i, t) = place(1.0 - alpha.clamp(SMALLEST, 1.0).ln() / SMALLEST.ln(), AVERAGES);
        lerp(self.mean[i], self.mean[i + 1], t)
    }

    /// Of the table as it is interpolated, so that what is given back is what is missing; panel by panel between its cosines.
    fn average(&self, alpha: f32) -> f32 {
        let a = f64::from(alpha);
        let length = (1.0 / a).ln_1p();
        let panel = |panel: usize| {
            GAUSS.map(|(node, weight)| {
                let x = (panel as f64 + node) / (COSINES - 1) as f64;
                let mu = a * (length * x * x).exp_m1();
                let weight = 2.0 * x * length * (mu + a) * weight / (COSINES - 1) as f64;
                2.0 * mu * weight * f64::from(self.missing(mu as f32, alpha))
            })
        };
        (0..COSINES - 1).flat_map(panel).sum::<f64>() as f32
    }
}

/// M: the mean over the facets that `mu` sees, evenly on the cap that they mirror.
fn integrate(mu: f64, alpha: f64, eta: f64, [around, out]: [u32; 2]) -> f64 {
    let facets = Ggx { alpha: [alpha; 2] };
    let wo = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
    let one = |k: u32| {
        let [a, b] =
            [(k % around, around), (k / around, out)].map(|(i, n)| (f64::from(i) + 0.5) / f64::from(n));
        // One half is as the other; the steepest are few, and lose most.
        let half = facets.facet(wo, [0.5 * a, 1.0 - b * b]);
        let fresnel = f64::from(fresnel_dielectric(wo.dot(half).clamp(0.0, 1.0) as f32, eta as f32));
        let reflected = fresnel * lost(&facets, wo, mirror(wo, half));
        // Seen from below, what is refracted is above.
        let through = |wi: DVec3| (1.0 - fresnel) * lost(&facets, wo, wi.with_z(-wi.z));
        2.0 * b * (reflected + refracted(wo, half, eta).map_or(0.0, through))
    };
    // Rounding may find less than nothing lost.
    ((0..around * out).map(one).sum::<f64>() / f64::from(around * out)).max(0.0)
}

/// Where a facet sends what it refracts. None: nowhere.
pub(super) fn refracted(wo: DVec3, half: DVec3, eta: f64) -> Option<DVec3> {
    let cos = wo.dot(half);
    let sin2 = (1.0 - cos * cos).max(0.0) / (eta * eta);
    (sin2 < 1.0).then(|| (cos / eta - (1.0 - sin2).sqrt()) * half - wo / eta)
}

/// What of light from `wo` that a facet sends to `wi`, z > 0 where it leaves, meets another.
fn lost(facets: &Ggx, wo: DVec3, wi: DVec3) -> f64 {
    if wi.z <= 0.0 {
        return 1.0;
    }
    // What `wo` sees of facets is 2 / (1 + stretch / z) of them.
    let (o, i) = (facets.stretch(wo), facets.stretch(wi));
    1.0 - (wo.z + o) * wi.z / (o * wi.z + i * wo.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rows_are_what_facets_lose() {
        let mut off_by = Vec::new();
        for alpha in [1e-5, 1e-3, 0.01, 0.09, 0.2, 0.36, 0.6, 1.0_f64] {
            for eta in [1.5, 1.0 / 1.5, 1.05, 1.0 / 1.05, 2.4, 1.0 / 2.4_f64] {
                let (mut worst, mut sum, n) = (0.0_f64, 0.0, 40);
                for k in 0..n {
                    let mu = (f64::from(k) + 0.5) / f64::from(n);
                    let exact = integrate(mu, alpha, eta, [80, 160]);
                    let off = f64::from(missing(mu as f32, alpha as f32, eta)) - exact;
                    worst = worst.max(off.abs());
                    sum += off * 2.0 * mu / f64::from(n);
                }
                off_by.push((worst, sum.abs()));
            }
        }
        assert!(off_by.iter().all(|(worst, sum)| *worst < 0.012 && *sum < 0.002), "{off_by:?}");
    }

    #[test]
    fn averages_are_those_of_what_is_averaged() {
        for alpha in [1e-6, 3e-5, 1e-3, 0.01, 0.09, 0.3, 0.6, 1.0_f32] {
            for eta in [1.5, 1.0 / 1.5, 1.1, 1.0 / 3.0] {
                let n = 100_000;
                // Evenly in μ³, so that grazing angles are not missed: 2 μ dμ = 6 μ t² dt.
                let one = |i: u32| {
                    let t = (f64::from(i) + 0.5) / f64::from(n);
                    6.0 * t.powi(5) / f64::from(n) * f64::from(missing(t.powi(3) as f32, alpha, eta))
                };
                let (sum, mean) = ((0..n).map(one).sum::<f64>(), f64::from(mean(alpha, eta)));
                assert!((mean / sum - 1.0).abs() < 5e-3, "{alpha} {eta}: {mean} for {sum}");
            }
        }
    }
}
