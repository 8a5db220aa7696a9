//! Directional albedos of GGX mirrors by roughness, tabulated when they are first asked for (some milliseconds).
//!
//! A rough mirror that reflects all reflects E(μ, α) = 1 − M(μ, α) of what comes at cosine μ by one facet; the rest M meets
//! a second one. Of E the share Φ carries Schlick's (1 − wo·h)⁵, so that E (f0 (1 − Φ) + f90 Φ) is reflected. For small α all
//! of this happens within grazing angles of cosine α; hence the table's coordinate √x with x = μ (1 + α) / (μ + α), in which
//! it has a limit. Roughnesses are spaced evenly in √α.

use super::microfacet::{Ggx, mirror};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

/// Nodes in x and in √α.
const COSINES: usize = 32;
const ROUGHNESSES: usize = 24;
/// Nodes of the averages, even in ln α.
const AVERAGES: usize = 128;
/// The smallest roughness that is told from zero, α and √α.
const SMALLEST: f32 = 1e-6;
const SMOOTHEST: f32 = 1e-3;

/// What a GGX mirror makes of light from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Albedo {
    /// M: what a mirror that reflects all would pass to a second facet, in [0, 1].
    pub(crate) missing: f32,
    /// Φ: the share of the rest that goes with f90 instead of f0, in [0, 1].
    pub(crate) grazing: f32,
}

/// Averages over the cosine-weighted hemisphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mean {
    /// Of M.
    pub(crate) missing: f32,
    /// Of (1 − M) Φ.
    pub(crate) grazing: f32,
}

/// Of light that does not leave a rough mirror by one facet, `missing` of it on the average, what comes back after all from
/// facets that reflect `mean` on the average: F̄² Ē / (1 − F̄ (1 − Ē)), Kulla & Conty 2017.
pub(crate) fn again(mean: f32, missing: f32) -> f32 {
    mean * mean * (1.0 - missing) / (1.0 - mean * missing)
}

/// The cosine-weighted average of Schlick's (1 − cos)⁵.
pub(crate) const SCHLICK_MEAN: f32 = 1.0 / 21.0;

/// The cosine-weighted average of `f` over cosines in [0, 1].
pub(crate) fn cosine_weighted(f: impl Fn(f32) -> f32) -> f32 {
    // Twice as many nodes near grazing angles, where layers turn opaque.
    let panel = |from: f64, to: f64| -> f64 {
        let part = |(node, weight): (f64, f64)| {
            let mu = from + (to - from) * node;
            2.0 * mu * weight * (to - from) * f64::from(f(mu as f32))
        };
        GAUSS.into_iter().map(part).sum()
    };
    (panel(0.0, 0.25) + panel(0.25, 1.0)) as f32
}

/// Panels of four nodes over chords and along each, and how exactly its ends are found.
const CHORDS: u32 = 3;
const ALONG: u32 = 3;
const HALVINGS: u32 = 7;

struct Tables {
    /// M, and (Φ − (1 − μ)⁵) / α.
    by_cosine: [[[f32; 2]; COSINES]; ROUGHNESSES],
    mean: [Mean; AVERAGES],
}

static TABLES: LazyLock<Box<Tables>> = LazyLock::new(Tables::build);

/// For light of cosine `mu` in [0, 1] on a surface of roughness `alpha`.
pub(crate) fn albedo(mu: f32, alpha: f32) -> Albedo {
    TABLES.albedo(mu, alpha)
}

/// The average over all directions, cosine-weighted, for roughness `alpha`.
pub(crate) fn mean(alpha: f32) -> Mean {
    TABLES.mean(alpha)
}

impl Tables {
    fn build() -> Box<Self> {
        let zero = Mean { missing: 0.0, grazing: 0.0 };
        let mut tables =
            Box::new(Self { by_cosine: [[[0.0; 2]; COSINES]; ROUGHNESSES], mean: [zero; AVERAGES] });
        for (i, row) in tables.by_cosine.iter_mut().enumerate() {
            let root = SMOOTHEST + (1.0 - SMOOTHEST) * i as f32 / (ROUGHNESSES - 1) as f32;
            let alpha = f64::from(root * root);
            for (j, entry) in row.iter_mut().enumerate() {
                let x = (j as f64 / (COSINES - 1) as f64).powi(2);
                *entry = integrate((alpha * x / (1.0 + alpha - x)).min(1.0), alpha).map(|value| value as f32);
            }
        }
        for i in 0..AVERAGES {
            let alpha = SMALLEST.powf(1.0 - i as f32 / (AVERAGES - 1) as f32);
            tables.mean[i] = tables.average(alpha);
        }
        tables
    }

    fn albedo(&self, mu: f32, alpha: f32) -> Albedo {
        let alpha = alpha.clamp(SMALLEST, 1.0);
        let x = mu * (1.0 + alpha) / (mu + alpha);
        let (i, s) = place((alpha.sqrt() - SMOOTHEST) / (1.0 - SMOOTHEST), ROUGHNESSES);
        let (j, t) = place(x.sqrt(), COSINES);
        let [missing, grazing] = [0, 1].map(|k| {
            let [a, b] = [i, i + 1].map(|i| lerp(self.by_cosine[i][j][k], self.by_cosine[i][j + 1][k], t));
            lerp(a, b, s)
        });
        Albedo { missing, grazing: (alpha * grazing + (1.0 - mu).powi(5)).clamp(0.0, 1.0) }
    }

    fn mean(&self, alpha: f32) -> Mean {
        let (i, t) = place(1.0 - alpha.clamp(SMALLEST, 1.0).ln() / SMALLEST.ln(), AVERAGES);
        let (a, b) = (self.mean[i], self.mean[i + 1]);
        Mean { missing: lerp(a.missing, b.missing, t), grazing: lerp(a.grazing, b.grazing, t) }
    }

    /// Of the table as it is interpolated, so that what is given back is what is missing; over ln(μ + α).
    fn average(&self, alpha: f32) -> Mean {
        let (a, panels) = (f64::from(alpha), 24);
        let length = (1.0 / a).ln_1p() / f64::from(panels);
        let (mut missing, mut grazing) = (0.0, 0.0);
        for panel in 0..panels {
            for (node, weight) in GAUSS {
                let mu = a * (length * (f64::from(panel) + node)).exp_m1();
                let weight = 2.0 * mu * (mu + a) * length * weight;
                let here = self.albedo(mu as f32, alpha);
                missing += weight * f64::from(here.missing);
                grazing += weight * f64::from((1.0 - here.missing) * here.grazing);
            }
        }
        Mean { missing: missing as f32, grazing: grazing as f32 }
    }
}

/// Gauss and Legendre's four nodes in [0, 1] and their weights.
pub(super) const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_7, 0.173_927_422_568_726_9),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273_1),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_1),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_9),
];

/// M and (Φ − (1 − μ)⁵) / α.
fn integrate(mu: f64, alpha: f64) -> [f64; 2] {
    let wo = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
    let [missing, grazing] = reflected(&Ggx { alpha: [alpha; 2] }, wo, gauss(CHORDS));
    [missing, (grazing / (1.0 - missing) - (1.0 - mu).powi(5)) / alpha]
}

/// Means over the facets that `wo` sees: what goes on to another one, and (1 − wo·h)⁵ of what does not.
///
/// Where facets are a hemisphere, those are evenly half of a disk across the view and half of an ellipse (Heitz 2018). They
/// are cut into chords in planes that stand upright, along which facets tilt from one horizon of what they mirror to the
/// other. `chords` says where, in quarters of a turn sideways, and gives weights that sum to one over all.
pub(super) fn reflected(facets: &Ggx, wo: DVec3, chords: impl Iterator<Item = (f64, f64)>) -> [f64; 2] {
    let round = facets.round(wo);
    let out = DVec3::new(round.x, round.y, 0.0).try_normalize().unwrap_or(DVec3::X);
    let (up, aside) = (DVec3::Z * out.dot(round) - round.z * out, DVec3::new(-out.y, out.x, 0.0));
    let (mut missing, mut grazing) = (0.0, 0.0);
    for (node, weight) in chords {
        let (y, end) = (FRAC_PI_2 * node).sin_cos();
        let weight = 2.0 * weight * end * end / (1.0 + round.z);
        let facet = |tilt: f64| {
            let (x, along) = tilt.sin_cos();
            let half = along * round + x * up + y / end * aside;
            DVec3::new(facets.alpha[0] * half.x, facets.alpha[1] * half.y, half.z).normalize()
        };
        let ends = [-round.z.min(1.0).asin(), FRAC_PI_2];
        let [from, to] = ends.map(|end| horizon(|t| mirror(wo, facet(t * end)).z) * end);
        missing += weight * (1.0 + round.z - (to.sin() - from.sin()));
        for (node, part) in gauss(ALONG) {
            // Denser near both ends, where shadowing changes fast.
            let tilt = from + (to - from) * node * node * (3.0 - 2.0 * node);
            let weight = weight * part * 6.0 * node * (1.0 - node) * (to - from) * tilt.cos();
            let half = facet(tilt);
            let lost = lost(facets, wo, mirror(wo, half));
            missing += weight * lost;
            grazing += weight * (1.0 - lost) * (1.0 - wo.dot(half)).powi(5);
        }
    }
    [missing, grazing]
}

/// Nodes in [0, 1] and their weights.
pub(super) fn gauss(panels: u32) -> impl Iterator<Item = (f64, f64)> {
    let n = f64::from(panels);
    let nodes = move |panel: u32| GAUSS.map(|(node, weight)| ((f64::from(panel) + node) / n, weight / n));
    (0..panels).flat_map(nodes)
}

/// Where `height` falls through zero in [0, 1], where it is below.
fn horizon(height: impl Fn(f64) -> f64) -> f64 {
    let (mut above, mut below) = ((0.0, height(0.0)), (1.0, height(1.0)));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (above.0 + below.0);
        let here = (middle, height(middle));
        if here.1 > 0.0 { above = here } else { below = here }
    }
    let fall = above.1 - below.1;
    // Where all facets look along the horizon, nothing falls.
    if fall > 0.0 { above.0 + (below.0 - above.0) * (above.1 / fall).clamp(0.0, 1.0) } else { 1.0 }
}

/// What of light from `wo` that a facet mirrors to `wi` meets another: one minus the visibility of `wi` where `wo` sees it.
fn lost(facets: &Ggx, wo: DVec3, wi: DVec3) -> f64 {
    if wi.z <= 0.0 {
        return 1.0;
    }
    let (o, i) = (facets.stretch(wo), facets.stretch(wi));
    let rough = (facets.alpha[0] * wi.x).powi(2) + (facets.alpha[1] * wi.y).powi(2);
    wo.z * rough / ((i + wi.z) * (o * wi.z + i * wo.z))
}

/// The node below and how far on it is to the next; `x` in [0, 1].
pub(super) fn place(x: f32, nodes: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (nodes - 1) as f32;
    let i = (x as usize).min(nodes - 2);
    (i, x - i as f32)
}

pub(super) fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same integral, much finer.
    fn fine(mu: f64, alpha: f64) -> [f64; 2] {
        let n = 400;
        let facets = Ggx { alpha: [alpha; 2] };
        let wo = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
        let (mut missing, mut grazing) = (0.0, 0.0);
        for i in 0..n * n {
            let [a, b] = [i / n, i % n].map(|k| (f64::from(k) + 0.5) / f64::from(n));
            let half = facets.facet(wo, [0.5 * a, b]);
            let lost = lost(&facets, wo, mirror(wo, half));
            missing += lost;
            grazing += (1.0 - lost) * (1.0 - wo.dot(half)).powi(5);
        }
        [missing / f64::from(n * n), grazing / f64::from(n * n)]
    }

    #[test]
    fn the_tables_are_what_facets_reflect() {
        let mut worst = [0.0_f64; 2];
        for alpha in [1e-6, 3e-5, 1e-3, 4e-3, 0.02, 0.09, 0.2, 0.36, 0.6, 0.95, 1.0_f64] {
            for k in 0..40 {
                let x = (f64::from(k) + 0.37) / 40.0;
                for mu in [alpha * x / (1.0 + alpha - x), x] {
                    let here = albedo(mu as f32, alpha as f32);
                    let [missing, grazing] = fine(mu, alpha);
                    let off = [
                        (f64::from(here.missing) - missing).abs(),
                        (f64::from((1.0 - here.missing) * here.grazing) - grazing).abs(),
                    ];
                    worst = [worst[0].max(off[0]), worst[1].max(off[1])];
                }
            }
        }
        assert!(worst[0] < 1.5e-3 && worst[1] < 4e-3, "{worst:?}");
    }

    #[test]
    fn averages_are_those_of_what_is_averaged() {
        for alpha in [1e-6, 3e-5, 1e-3, 0.01, 0.09, 0.3, 0.6, 1.0_f32] {
            let n = 100_000;
            let (mut missing, mut grazing) = (0.0, 0.0);
            // Evenly in μ³, so that grazing angles are not missed: 2 μ dμ = 6 μ t² dt.
            for i in 0..n {
                let t = (f64::from(i) + 0.5) / f64::from(n);
                let here = albedo(t.powi(3) as f32, alpha);
                let weight = 6.0 * t.powi(5) / f64::from(n);
                missing += weight * f64::from(here.missing);
                grazing += weight * f64::from((1.0 - here.missing) * here.grazing);
            }
            let mean = mean(alpha);
            assert!(
                (f64::from(mean.missing) / missing - 1.0).abs() < 5e-3,
                "{alpha}: {mean:?} for {missing}"
            );
            assert!((f64::from(mean.grazing) - grazing).abs() < 1e-4, "{alpha}: {mean:?} for {grazing}");
        }
    }
}
