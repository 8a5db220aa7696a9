use super::fresnel_dielectric;
use super::microfacet::{Ggx, mirror};
use super::rough::Rough;
use glam::{DVec3, Vec3};

/// A rough interface between the outside (front) and a medium of refractive index `ior` (back): GGX facets that reflect and
/// refract (Walter et al. 2007), each by Fresnel's law. Light that would meet a second facet is absorbed: how much that is
/// stands in docs/lobes.md. With an index of one nothing is there, and it is a delta lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    /// Index behind over that in front, > 0.
    pub ior: f32,
    /// GGX roughness in [10⁻⁶, 1], the square of a material's.
    pub alpha: f32,
    /// Filter of refracted light at each crossing, linear RGB in [0, 1].
    pub tint: Vec3,
}

impl RoughDielectric {
    /// True where nothing is there that could bend light or reflect it.
    pub fn is_nothing(&self) -> bool {
        self.ior == 1.0
    }

    /// Index of the far side over that of the near one.
    fn eta(&self, front: bool) -> f64 {
        if front { f64::from(self.ior) } else { 1.0 / f64::from(self.ior) }
    }

    fn facets(&self) -> Ggx {
        Ggx::new([self.alpha; 2])
    }
}

impl Rough for RoughDielectric {
    fn tangent(&self) -> Vec3 {
        Vec3::ZERO
    }

    fn responds(&self, _: bool) -> bool {
        true
    }

    fn scatter(&self, wo: DVec3, wi: DVec3, front: bool) -> (Vec3, f32) {
        let (facets, eta) = (self.facets(), self.eta(front));
        let reflected = wi.z > 0.0;
        let half = if reflected { wo + wi } else { (1.0 - eta).signum() * (wo + eta * wi) };
        let half = half.normalize_or_zero();
        let (cos_o, cos_i) = (wo.dot(half), wi.dot(half));
        // Facets that look down, or that light would have to meet from behind.
        if half.z <= 0.0 || cos_o <= 0.0 || (cos_i > 0.0) != reflected {
            return (Vec3::ZERO, 0.0);
        }
        let fresnel = f64::from(fresnel_dielectric(cos_o as f32, eta as f32));
        let shading = 4.0 * facets.visibility(wo, wi.with_z(wi.z.abs())) * facets.density(half);
        if reflected {
            let density = fresnel * facets.mirrored(wo, half);
            return (Vec3::splat((0.25 * fresnel * shading) as f32), density as f32);
        }
        // Solid angle of facets for one of directions, over η²: Walter et al. 2007, eq. 17.
        let spread = -cos_i / (cos_o + eta * cos_i).powi(2);
        let value = (1.0 - fresnel) * shading * cos_o * spread;
        let density = (1.0 - fresnel) * facets.seen(wo, half) * eta * eta * spread;
        (value as f32 * self.tint, density as f32)
    }

    fn squared_index(&self, front: bool) -> f32 {
        (self.eta(front) * self.eta(front)) as f32
    }

    fn draw(&self, wo: DVec3, u: [f32; 3], front: bool) -> DVec3 {
        let eta = self.eta(front);
        let half = self.facets().facet(wo, [f64::from(u[0]), f64::from(u[1])]);
        let cos = wo.dot(half);
        let reflected = u[2] < fresnel_dielectric(cos as f32, eta as f32);
        let to = if reflected {
            mirror(wo, half)
        } else {
            let cos_to = (1.0 - (1.0 - cos * cos).max(0.0) / (eta * eta)).max(0.0).sqrt();
            (cos / eta - cos_to) * half - wo / eta
        };
        // A steep facet may mirror light down, or refract it up: that meets another.
        if (to.z > 0.0) == reflected { to } else { DVec3::X }
    }
}
