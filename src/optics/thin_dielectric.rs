use super::mirror::reflect;
use super::{Normals, Sample, Transport, fresnel_dielectric};
use glam::Vec3;

/// A thin pane: two parallel interfaces with nothing between them that bends light for good. A delta lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    /// Index of the pane over that of what surrounds it, > 0.
    pub ior: f32,
    /// Filter of transmitted light, linear RGB in [0, 1].
    pub tint: Vec3,
}

impl ThinDielectric {
    /// Reflectance of the pane with all reflections between its interfaces, R + T²R/(1−R²) = 2R/(1+R).
    pub fn reflectance(&self, cos_from: f32) -> f32 {
        let r = fresnel_dielectric(cos_from, self.ior);
        2.0 * r / (1.0 + r)
    }

    /// One branch, chosen by `u` in [0, 1). None: the normals disagree about the side that is left to.
    pub fn sample(&self, normals: &Normals, from: Vec3, transport: Transport, u: f32) -> Option<Sample> {
        let normal = if normals.is_front(from) { normals.shading } else { -normals.shading };
        let cos_from = from.dot(normal);
        if cos_from <= 0.0 {
            return None;
        }
        let reflectance = self.reflectance(cos_from);
        let (to, weight, probability) = if u < reflectance {
            (reflect(from, normal), Vec3::ONE, reflectance)
        } else {
            (-from, self.tint, 1.0 - reflectance)
        };
        let reflected = u < reflectance;
        let consistent =
            if reflected { normals.same_side(from, to) } else { normals.opposite_sides(from, to) };
        if !consistent {
            return None;
        }
        let adjoint = match transport {
            Transport::Shooting => normals.adjoint(from, to),
            Transport::Gathering => 1.0,
        };
        Some(Sample { to, weight: weight * adjoint, pdf_solid_angle: probability })
    }
}
