//! Where a camera ray goes on from delta lobes: not into one branch chosen at random but, while they matter, into all. And from
//! glossy ones: into one direction of each. From diffuse ones where photons cannot tell what arrives.
//!
//! A glass surface both reflects and refracts. A camera path that tosses a coin shows one of two different pictures in each
//! pixel and pass; following both costs one more line and removes that noise.

use crate::light::Row;
use crate::optics::{Bsdf, Lobe, Sample, Term, Transport};
use crate::rays::Rays;
use crate::sampling::Rng;
use crate::scene::{Material, SurfacePoint};
use glam::Vec3;

/// Branches that carry at least this share of a pixel are followed for certain; fainter ones by roulette in proportion.
const CERTAIN_SHARE: f32 = 1.0 / 32.0;

/// A line that reaches a surface with delta lobes.
pub(super) struct Parent<const R: usize> {
    /// What it read where it began.
    pub rows: [Row; R],
    /// Delta reflections before it.
    pub delta_chain: u32,
    /// Of its pixel: the part that the branches it came through carry.
    pub share: f32,
}

/// The surface that it reaches.
pub(super) struct Surface<'a, const R: usize> {
    /// What is read there.
    pub rows: [Row; R],
    pub material: &'a Material,
    pub bsdf: &'a Bsdf,
    pub point: &'a SurfacePoint,
    pub wo: Vec3,
    /// In how many directions diffuse lobes are followed: none where light is read from photons.
    pub diffuse: u32,
}

/// A branch that is followed.
pub(super) struct Branch<const R: usize> {
    /// What it carries on.
    pub rows: [Row; R],
    /// The direction it leaves in, away from the surface.
    pub sample: Sample,
    /// Its share of the pixel; by roulette no less than [`CERTAIN_SHARE`] or that of the line it came from.
    pub share: f32,
    /// Density in solid angle (sr⁻¹) with which a glossy lobe chose its direction. None for others.
    pub density: Option<f32>,
    /// Which lobe it comes from.
    pub lobe: Lobe,
}

/// Calls `follow` with the branches of a line at one of the surfaces it crosses.
///
/// Light that goes on both straight and by reflection makes each line the parent of several. Their number is bounded by
/// what they carry: where a line of the pixel's faintest share sends on k times what it carries, k / `growth` lines
/// follow it on average.
pub(super) fn branches<const R: usize>(
    rays: &Rays,
    surface: &Surface<'_, R>,
    parent: &Parent<R>,
    growth: f32,
    rng: &mut Rng,
    mut follow: impl FnMut(Branch<R>),
) {
    let Surface { rows, material, bsdf, point, wo, diffuse } = *surface;
    let strength = |term: &Term| -> f32 {
        let read = term.lobe.as_diffuse().is_some() && diffuse == 0;
        if read || !term.lobe.responds(&point.normals, wo) {
            return 0.0;
        }
        rows.iter().map(|row| (term.before(*row) * term.lobe.share(&point.normals, wo)).total()).sum()
    };
    // What the camera looks at is followed however dark it is; behind it, in proportion to what it passes on.
    let whole: f32 = if parent.delta_chain == 0 {
        bsdf.terms.iter().map(strength).sum()
    } else {
        parent.rows.iter().map(|row| row.total()).sum()
    };
    let faintest = CERTAIN_SHARE.min(parent.share) * growth;
    for term in &bsdf.terms {
        let strength = strength(term);
        if strength == 0.0 {
            continue;
        }
        let carried = || rows.iter().map(|row| row.colours()).sum();
        let (lobe, filter) = rays.lobe_for(term.lobe, material, point, carried, || rng.f32());
        if lobe.as_diffuse().is_some() {
            let part = parent.share * (strength / whole) / diffuse as f32;
            for _ in 0..diffuse {
                let Some(survival) = survives(part / faintest, rng) else { continue };
                let Some(sample) = lobe.sample(&point.normals, wo, Transport::Gathering, rng.f32x3()) else {
                    continue;
                };
                let weight = sample.weight / (survival * diffuse as f32);
                let rows = rows.map(|row| term.before(row) * weight);
                follow(Branch { rows, sample, share: part / survival, density: None, lobe });
            }
            continue;
        }
        if lobe.is_glossy() {
            let part = parent.share * (strength / whole);
            let Some(survival) = survives(part / faintest, rng) else { continue };
            let Some(sample) = lobe.sample(&point.normals, wo, Transport::Gathering, rng.f32x3()) else {
                continue;
            };
            let weight = filter * sample.weight / survival;
            let rows = rows.map(|row| term.before(row) * weight);
            let density = sample.pdf.solid_angle();
            follow(Branch { rows, sample, share: part / survival, density, lobe });
            continue;
        }
        for sample in lobe.branches(&point.normals, wo, Transport::Gathering).into_iter().flatten() {
            let probability = sample.pdf.value();
            let part = parent.share * probability * (strength / whole);
            let Some(survival) = survives(part / faintest, rng) else { continue };
            // The sample's weight is that of a branch taken by chance.
            let weight = filter * sample.weight * (probability / survival);
            let rows = rows.map(|row| term.before(row) * weight);
            follow(Branch { rows, sample, share: part / survival, density: None, lobe });
        }
    }
}

/// Roulette: the probability, at most one, with which a branch was to live. None: it does not.
fn survives(wish: f32, rng: &mut Rng) -> Option<f32> {
    let survival = wish.min(1.0);
    (survival >= 1.0 || rng.f32() < survival).then_some(survival)
}
