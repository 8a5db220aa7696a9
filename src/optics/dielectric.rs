use super::smooth::Smooth;
use super::{fresnel_dielectric, refract};
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
    /// Index of the far side over that of the near one.
    fn eta(&self, front: bool) -> f32 {
        if front { self.ior } else { 1.0 / self.ior }
    }
}

impl Smooth for Dielectric {
    fn reflectance(&self, cos_from: f32, front: bool) -> f32 {
        fresnel_dielectric(cos_from, self.eta(front))
    }

    fn through(&self, from: Vec3, normal: Vec3, front: bool) -> Option<Vec3> {
        refract(from, normal, self.eta(front))
    }

    fn is_total(&self, cos_from: f32, front: bool) -> bool {
        self.reflectance(cos_from, front) >= 1.0
    }

    fn filters(&self, _: f32) -> [Vec3; 2] {
        [Vec3::ONE, self.tint]
    }

    /// L / η² is what refraction keeps: L_from = L_to (η_from / η_to)². Veach 1997, eq. 5.2.
    fn compression(&self, front: bool) -> f32 {
        let eta = self.eta(front);
        1.0 / (eta * eta)
    }
}
