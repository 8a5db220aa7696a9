//! Where a camera ray goes on from delta lobes: not into one branch by chance but, while they matter, into all.
//!
//! A glass surface both reflects and refracts. A camera path that tosses a coin shows one of two different pictures in
//! each pixel and pass; following both costs a line more and leaves that noise out.

use crate::light::Row;
use crate::optics::{Sample, Term, Transport};
use crate::rays::Rays;
use crate::sampling::Rng;

use super::Here;

/// Branches that carry at least this share of a pixel are followed for certain; fainter ones by roulette in proportion, so that
/// a pixel takes no more lines per generation than the inverse of it.
const CERTAIN_SHARE: f32 = 1.0 / 32.0;

/// A branch that is followed.
pub(super) struct Branch<const R: usize> {
    /// What it carries on.
    pub rows: [Row; R],
    /// The direction it leaves in, away from the surface.
    pub sample: Sample,
    /// Its share of the pixel, at least [`CERTAIN_SHARE`] or that of the line it came from.
    pub share: f32,
}

/// Calls `follow` with the branches of a line that carries `share` of its pixel.
pub(super) fn branches<const R: usize>(
    rays: &Rays,
    here: &Here<'_, '_, R>,
    share: f32,
    rng: &mut Rng,
    mut follow: impl FnMut(Branch<R>),
) {
    let Here { rows, bsdf, point, wo, .. } = *here;
    let strength = |term: &Term| -> f32 {
        if !term.lobe.is_delta() || !term.lobe.responds(&point.normals, wo) {
            return 0.0;
        }
        rows.iter().map(|row| (*row * term.coefficient * term.lobe.albedo()).total()).sum()
    };
    let total: f32 = bsdf.terms.iter().map(strength).sum();
    for term in &bsdf.terms {
        let strength = strength(term);
        if strength == 0.0 {
            continue;
        }
        let lobe = rays.lobe_at(term.lobe, point);
        for sample in lobe.branches(&point.normals, wo, Transport::Gathering).into_iter().flatten() {
            let probability = sample.pdf_solid_angle;
            let part = share * probability * (strength / total);
            let survival = (part / CERTAIN_SHARE.min(share)).min(1.0);
            if survival < 1.0 && rng.f32() >= survival {
                continue;
            }
            // The sample's weight is that of a branch taken by chance.
            let weight = sample.weight * (probability / survival);
            let rows = rows.map(|row| row * term.coefficient * weight);
            follow(Branch { rows, sample, share: part / survival });
        }
    }
}
