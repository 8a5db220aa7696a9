use super::{Layers, Normals, Pdf, Sample, Transport};
use crate::sampling::warp;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Lambert's reflector, paper eq. 6 with k_d = albedo / π: one-sided unless `two_sided`.
///
/// Light counts by its cosine to the shading normal ns, as far as it comes from above both normals. What of that cosine
/// lobe lies below the real surface is made up for in the rest, by one over the share (1 + ns·ng) / 2 that lies above it:
/// in a room that glows alike a white surface is as bright as the room, whatever its normals are. From which side of ns it
/// is seen does not matter. Light that is shot is thus scattered about the geometric normal, with the adjoint factor
/// |wi·ns| / |wi·ng| of where it came from.
///
/// Under [`Layers`] it is f = albedo / π · T(wo) T(wi) / T̄, and T(wi) is all that depends on where light arrives from: what
/// has [arrived](Self::arrival) is seen as by Lambert.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Directional-hemispherical reflectance, linear RGB, each in [0, 1] for matter that creates no energy.
    pub albedo: Vec3,
    /// True: the back reflects as the front does. False: the back absorbs.
    pub two_sided: bool,
    /// What lies above it. None: Lambert's reflector itself.
    pub under: Option<Layers>,
}

impl Diffuse {
    /// BSDF value in sr⁻¹ seen from `wo`, cosine not included: the same for all light that [counts](Normals::counts)
    /// there, but for the share of it that [arrives](Self::arrival).
    #[inline(always)]
    pub fn towards(&self, normals: &Normals, wo: Vec3) -> Vec3 {
        if !self.reflects(normals, wo) {
            return Vec3::ZERO;
        }
        let bare = self.albedo * (FRAC_1_PI / normals.share_above());
        match &self.under {
            None => bare,
            Some(layers) => layers.leaving(wo.dot(normals.shading).abs()) * bare,
        }
    }

    /// The share of light from `wi` that arrives below the layers, in [0, 1]: one where there are none.
    #[inline(always)]
    pub fn arrival(&self, normals: &Normals, wi: Vec3) -> f32 {
        self.under.as_ref().map_or(1.0, |layers| layers.transmission(wi.dot(normals.shading).abs()))
    }

    /// BSDF value in sr⁻¹ of light from `to` that is seen from `from`, cosine not included.
    #[inline(always)]
    pub fn eval(&self, normals: &Normals, from: Vec3, to: Vec3) -> Vec3 {
        if !normals.counts(from, to) {
            return Vec3::ZERO;
        }
        let seen = self.towards(normals, from);
        if self.under.is_some() { self.arrival(normals, to) * seen } else { seen }
    }

    /// What it passes on of light from `from` in all directions, for flat normals.
    pub(super) fn share(&self, normals: &Normals, from: Vec3) -> Vec3 {
        self.arrival(normals, from) * self.albedo
    }

    /// Density in solid angle of [`sample`](Self::sample) where light is gathered.
    pub fn pdf(&self, normals: &Normals, from: Vec3, to: Vec3) -> f32 {
        if normals.counts(from, to) && self.reflects(normals, from) {
            to.dot(normals.shading).abs() * (FRAC_1_PI / normals.share_above())
        } else {
            0.0
        }
    }

    /// A direction in proportion to what it carries but for layers above. None: nothing is reflected there.
    #[inline(always)]
    pub fn sample(&self, normals: &Normals, from: Vec3, transport: Transport, u: [f32; 3]) -> Option<Sample> {
        let bare = self.sample_bare(normals, from, transport, u)?;
        let Some(layers) = &self.under else { return Some(bare) };
        // The same whichever way light goes.
        let passed = layers.leaving(from.dot(normals.shading).abs()) * self.arrival(normals, bare.to);
        Some(Sample { weight: passed * bare.weight, ..bare })
    }

    #[inline(always)]
    fn sample_bare(
        &self,
        normals: &Normals,
        from: Vec3,
        transport: Transport,
        u: [f32; 3],
    ) -> Option<Sample> {
        if !self.reflects(normals, from) {
            return None;
        }
        let side = if normals.is_front(from) { 1.0 } else { -1.0 };
        let local = warp::cosine_hemisphere([u[0], u[1]]);
        if normals.shading == normals.geometric {
            let up = side * normals.shading;
            let to = warp::to_world(up, local);
            return normals.same_side(from, to).then(|| self.chosen(to, 1.0, to.dot(up) * FRAC_1_PI));
        }
        let (up, shading) = (side * normals.geometric, side * normals.shading);
        match transport {
            Transport::Shooting => {
                if !normals.same_side(from, from) {
                    return None;
                }
                let to = warp::to_world(up, local);
                let weight = normals.arrival(from) / normals.share_above();
                (to.dot(up) > 0.0).then(|| self.chosen(to, weight, to.dot(up) * FRAC_1_PI))
            }
            Transport::Gathering => {
                let to = above(shading, up, local);
                normals.counts(from, to).then(|| self.chosen(to, 1.0, self.pdf(normals, from, to)))
            }
        }
    }

    fn chosen(&self, to: Vec3, factor: f32, pdf: f32) -> Sample {
        Sample { to, weight: factor * self.albedo, pdf: Pdf::SolidAngle(pdf), geometric: false }
    }

    #[inline(always)]
    fn reflects(&self, normals: &Normals, from: Vec3) -> bool {
        self.two_sided || normals.is_front(from)
    }
}

/// `local`, cosine-distributed about z, as a direction cosine-distributed about `shading` among those above `geometric`.
///
/// Seen along `shading` these fill half of the unit disk and half of an ellipse of half the height cos θ, with θ between the
/// normals: each chord of the disk is shortened by the same factor (1 + cos θ) / 2.
fn above(shading: Vec3, geometric: Vec3, local: Vec3) -> Vec3 {
    let cos = shading.dot(geometric);
    let across = shading.cross(geometric);
    let Some(y) = across.try_normalize() else { return warp::to_world(shading, local) };
    let x = y.cross(shading);
    let half = (1.0 - local.y * local.y).max(0.0).sqrt();
    let along = (local.x + half) * (0.5 + 0.5 * cos) - half * cos;
    let height = (1.0 - along * along - local.y * local.y).max(0.0).sqrt();
    (along * x + local.y * y + height * shading).normalize()
}
