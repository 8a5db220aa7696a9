use super::glossy::{draw_grazing, grazing};
use super::microfacet::{Ggx, mirror};
use super::rough::Rough;
use super::rough_thin::MEAN_COSINE;
use super::{fresnel_dielectric, interface};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// A rough interface between the outside (front) and a medium of refractive index `ior` (back): GGX facets that reflect and
/// refract (Walter et al. 2007), each by Fresnel's law. Light that meets several facets leaves on both sides, as a second
/// reciprocal term after Kulla & Conty 2017: a clear one is invisible in a white room. With an index of one nothing is there,
/// and it is a delta lobe.
///
/// Of light that one facet does not send on, M(μ) from one side and M'(μ') from the other, with averages m and m', the share
/// τ = T min(m, m') / m goes through, where T is what a smooth interface lets through of light from everywhere. T times
/// the square of the own index is the same from both sides, and so is τ m times it. (A walk over such facets, Heitz et al. 2016, lets through 0.94 of
/// it from outside and 0.11 from inside at an α of 0.36 and an index of 1.5; this 0.90 and 0.09.)
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

    /// What goes through a smooth one of light from everywhere, nearly: at the cosine of Schlick's mean.
    fn passes(eta: f64) -> f64 {
        let into = |eta: f64| 1.0 - f64::from(fresnel_dielectric(MEAN_COSINE as f32, eta as f32));
        if eta >= 1.0 { into(eta) } else { eta * eta * into(1.0 / eta) }
    }

    /// m, and the share of what is missing that goes through.
    fn missing(&self, eta: f64) -> Missing {
        let [own, other] = [eta, 1.0 / eta].map(|eta| f64::from(interface::mean(self.alpha, eta)));
        Missing { own, other, through: Self::passes(eta) * (own.min(other) / own) }
    }

    fn facets(&self) -> Ggx {
        Ggx::new([self.alpha; 2])
    }
}

/// Of light that one facet does not send on.
struct Missing {
    /// Its average on this side and on the other.
    own: f64,
    other: f64,
    /// What of it goes through from this side.
    through: f64,
}

impl RoughDielectric {
    /// Value and density for one facet.
    fn once(&self, wo: DVec3, wi: DVec3, eta: f64) -> [f64; 2] {
        let facets = self.facets();
        let reflected = wi.z > 0.0;
        let half = if reflected { wo + wi } else { (1.0 - eta).signum() * (wo + eta * wi) };
        let half = half.normalize_or_zero();
        let (cos_o, cos_i) = (wo.dot(half), wi.dot(half));
        // Facets that look down, or that light would have to meet from behind.
        if half.z <= 0.0 || cos_o <= 0.0 || (cos_i > 0.0) != reflected {
            return [0.0; 2];
        }
        let fresnel = f64::from(fresnel_dielectric(cos_o as f32, eta as f32));
        let shading = 4.0 * facets.visibility(wo, wi.with_z(wi.z.abs())) * facets.density(half);
        if reflected {
            return [0.25 * fresnel * shading, fresnel * facets.mirrored(wo, half)];
        }
        // Solid angle of facets for one of directions, over η²: Walter et al. 2007, eq. 17.
        let spread = -cos_i / (cos_o + eta * cos_i).powi(2);
        let through = (1.0 - fresnel) * spread;
        [through * shading * cos_o, through * facets.seen(wo, half) * eta * eta]
    }

    /// Value and density for several, where `missing` of light from `wo` meets a second.
    fn more(&self, wi: DVec3, eta: f64, missing: f64) -> [f64; 2] {
        let Missing { own, other, through } = self.missing(eta);
        let reflected = wi.z > 0.0;
        let back = if reflected { eta } else { 1.0 / eta };
        let entering = f64::from(interface::missing(wi.z.abs() as f32, self.alpha, back));
        let (share, mean, scale) =
            if reflected { (1.0 - through, own, 1.0) } else { (through, other, 1.0 / (eta * eta)) };
        let value = share * missing * entering * scale / (PI * mean);
        [value, missing * share * broad(wi.z.abs(), self.alpha)]
    }
}

/// Density of light that several facets have turned: half of it follows the cosine, half is nearer to grazing angles.
fn broad(cos: f64, alpha: f32) -> f64 {
    0.5 * (cos / PI + f64::from(grazing(cos, alpha)))
}

/// A direction of that density.
fn draw_broad(alpha: f32, [a, b]: [f64; 2]) -> DVec3 {
    if b < 0.5 {
        let (sin, cos) = (2.0 * PI * a).sin_cos();
        let r = (2.0 * b).sqrt();
        return DVec3::new(r * cos, r * sin, (1.0 - r * r).sqrt());
    }
    draw_grazing(alpha, [a, 2.0 * b - 1.0])
}

impl Rough for RoughDielectric {
    fn tangent(&self) -> Vec3 {
        Vec3::ZERO
    }

    fn responds(&self, _: bool) -> bool {
        true
    }

    fn scatter(&self, wo: DVec3, wi: DVec3, front: bool) -> (Vec3, f32) {
        let eta = self.eta(front);
        let missing = f64::from(interface::missing(wo.z as f32, self.alpha, eta));
        let ([once, density], [more, broadly]) = (self.once(wo, wi, eta), self.more(wi, eta, missing));
        let value = (once + more) as f32;
        let density = ((1.0 - missing) * density + broadly) as f32;
        (if wi.z > 0.0 { Vec3::splat(value) } else { value * self.tint }, density)
    }

    fn squared_index(&self, front: bool) -> f32 {
        (self.eta(front) * self.eta(front)) as f32
    }

    fn draw(&self, wo: DVec3, u: [f32; 3], front: bool) -> DVec3 {
        let (eta, numbers) = (self.eta(front), [f64::from(u[0]), f64::from(u[1])]);
        let missing = interface::missing(wo.z as f32, self.alpha, eta);
        if u[2] < missing {
            let above = draw_broad(self.alpha, numbers);
            let through = f64::from(u[2] / missing) < self.missing(eta).through;
            return above.with_z(if through { -above.z } else { above.z });
        }
        let half = self.facets().facet(wo, numbers);
        let fresnel = fresnel_dielectric(wo.dot(half) as f32, eta as f32);
        let reflected = (u[2] - missing) / (1.0 - missing) < fresnel;
        let to = if reflected { Some(mirror(wo, half)) } else { interface::refracted(wo, half, eta) };
        // A steep facet may mirror light down, or refract it up: that meets another.
        to.filter(|to| (to.z > 0.0) == reflected).unwrap_or(DVec3::X)
    }
}
