use super::ThinDielectric;
use super::albedo;
use super::glossy::{draw_grazing, grazing};
use super::microfacet::{Ggx, mirror};
use super::rough::Rough;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// A thin pane with rough faces: GGX facets that reflect as the [pane](ThinDielectric) does, and let the rest through as the
/// same lobe mirrored to the other side. Light that meets several facets is shared out in the same way on the average, with
/// the second term of [`Glossy`](super::Glossy), so that a clear one is invisible in a white room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughThin {
    /// Index of the pane over that of what surrounds it, > 0.
    pub ior: f32,
    /// GGX roughness in [10⁻⁶, 1], the square of a material's.
    pub alpha: f32,
    /// Filter of transmitted light, linear RGB in [0, 1].
    pub tint: Vec3,
}

impl RoughThin {
    fn facets(&self) -> Ggx {
        Ggx::new([self.alpha; 2])
    }

    fn reflectance(&self, cos: f64) -> f32 {
        ThinDielectric { ior: self.ior, tint: self.tint }.reflectance(cos as f32)
    }

    /// Of light from all directions, nearly: at the cosine of Schlick's mean.
    fn average(&self) -> f32 {
        self.reflectance(MEAN_COSINE)
    }
}

/// 1 − 21^(−1/5): where Schlick's law reflects what it does on the average.
pub(super) const MEAN_COSINE: f64 = 0.4561;

impl Rough for RoughThin {
    fn tangent(&self) -> Vec3 {
        Vec3::ZERO
    }

    fn responds(&self, _: bool) -> bool {
        true
    }

    fn scatter(&self, wo: DVec3, wi: DVec3, _: bool) -> (Vec3, f32) {
        let (facets, above) = (self.facets(), wi.with_z(wi.z.abs()));
        let half = wo + above;
        let [missing, entering] = [wo, above].map(|w| albedo::albedo(w.z as f32, self.alpha).missing);
        let side = |reflectance: f32| if wi.z > 0.0 { reflectance } else { 1.0 - reflectance };
        let (once, more) = (side(self.reflectance(0.5 * half.length())), side(self.average()));
        let density = (1.0 - missing) * once * facets.mirrored(wo, half) as f32
            + missing * more * grazing(above.z, self.alpha);
        let mean = albedo::mean(self.alpha).missing;
        let value = once * (facets.density(half) * facets.visibility(wo, above)) as f32
            + more * missing * entering / (PI as f32 * mean);
        (if wi.z > 0.0 { Vec3::splat(value) } else { value * self.tint }, density)
    }

    fn draw(&self, wo: DVec3, u: [f32; 3], _: bool) -> DVec3 {
        let numbers = [f64::from(u[0]), f64::from(u[1])];
        let missing = albedo::albedo(wo.z as f32, self.alpha).missing;
        let (above, reflectance, rest) = if u[2] < missing {
            (draw_grazing(self.alpha, numbers), self.average(), u[2] / missing)
        } else {
            let half = self.facets().facet(wo, numbers);
            (mirror(wo, half), self.reflectance(wo.dot(half)), (u[2] - missing) / (1.0 - missing))
        };
        // What a facet mirrors below the horizon is lost on either side.
        if above.z <= 0.0 {
            return DVec3::X;
        }
        above.with_z(if rest < reflectance { above.z } else { -above.z })
    }
}
