use super::{Normals, Sample, Transport};
use crate::sampling::warp;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Lambert's reflector, paper eq. 6 with k_d = albedo / π: one-sided unless `two_sided`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Directional-hemispherical reflectance, linear RGB, each in [0, 1] for matter that creates no energy.
    pub albedo: Vec3,
    /// True: the back reflects as the front does. False: the back absorbs.
    pub two_sided: bool,
}

impl Diffuse {
    /// BSDF value in sr⁻¹, cosine not included.
    #[inline(always)]
    pub fn eval(&self, normals: &Normals, from: Vec3, to: Vec3) -> Vec3 {
        if normals.same_side(from, to) && self.reflects(normals, from) {
            self.albedo * FRAC_1_PI
        } else {
            Vec3::ZERO
        }
    }

    /// Density of [`sample`](Self::sample) in solid angle.
    pub fn pdf(&self, normals: &Normals, from: Vec3, to: Vec3) -> f32 {
        if normals.same_side(from, to) && self.reflects(normals, from) {
            to.dot(normals.shading).abs() * FRAC_1_PI
        } else {
            0.0
        }
    }

    /// A cosine-distributed direction about the shading normal. None: nothing is reflected there.
    #[inline(always)]
    pub fn sample(&self, normals: &Normals, from: Vec3, transport: Transport, u: [f32; 3]) -> Option<Sample> {
        if !self.reflects(normals, from) {
            return None;
        }
        let up = if normals.is_front(from) { normals.shading } else { -normals.shading };
        let to = warp::to_world(up, warp::cosine_hemisphere([u[0], u[1]]));
        if !normals.same_side(from, to) {
            return None;
        }
        let adjoint = match transport {
            Transport::Shooting => normals.adjoint(from, to),
            Transport::Gathering => 1.0,
        };
        Some(Sample { to, weight: self.albedo * adjoint, pdf_solid_angle: to.dot(up) * FRAC_1_PI })
    }

    #[inline(always)]
    fn reflects(&self, normals: &Normals, from: Vec3) -> bool {
        self.two_sided || normals.is_front(from)
    }
}
