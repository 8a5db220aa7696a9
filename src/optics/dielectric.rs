use super::mirror::reflect;
use super::{Normals, Sample, Transport, fresnel_dielectric, refract};
use glam::Vec3;

/// A smooth interface between the outside (front) and a medium of refractive index `ior` (back): a delta lobe
/// with two branches, reflection and refraction, chosen in proportion to Fresnel's reflectance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index behind over that in front, > 0: as a material has it, that of its solid against air.
    pub ior: f32,
    /// Filter of refracted light at each crossing, linear RGB in [0, 1].
    pub tint: Vec3,
}

impl Dielectric {
    /// One branch, chosen by `u` in [0, 1). None: the normals disagree about the side that is left to.
    pub fn sample(&self, normals: &Normals, from: Vec3, transport: Transport, u: f32) -> Option<Sample> {
        if self.ior == 1.0 {
            // Nothing is there that could bend light or reflect it, whatever the normals are.
            return Some(Sample { to: -from, weight: self.tint, pdf_solid_angle: 1.0 });
        }
        let front = normals.is_front(from);
        let (normal, eta) =
            if front { (normals.shading, self.ior) } else { (-normals.shading, 1.0 / self.ior) };
        let cos_from = from.dot(normal);
        if cos_from <= 0.0 {
            return None;
        }
        let reflectance = fresnel_dielectric(cos_from, eta);
        let (to, tint, probability, scale) = if u < reflectance {
            let to = reflect(from, normal);
            if !normals.same_side(from, to) {
                return None;
            }
            (to, Vec3::ONE, reflectance, 1.0)
        } else {
            let to = refract(from, normal, eta)?;
            if !normals.opposite_sides(from, to) {
                return None;
            }
            // L / η² is what refraction keeps: L_from = L_to (η_from / η_to)². Veach 1997, eq. 5.2.
            (to, self.tint, 1.0 - reflectance, 1.0 / (eta * eta))
        };
        let factor = match transport {
            Transport::Shooting => normals.adjoint(from, to),
            Transport::Gathering => scale,
        };
        Some(Sample { to, weight: tint * factor, pdf_solid_angle: probability })
    }
}
