use super::microfacet::{Frame, Ggx, mirror};
use super::rough::{Rough, turning_normal};
use super::{Film, Layers, Normals};
use super::{albedo, anisotropic};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// A rough mirror: GGX facets (Walter et al. 2007) with Smith's height-correlated shadowing (Heitz 2014), and the light that
/// meets several of them, as a second reciprocal term (Kulla & Conty 2017): a white one is white in a white room.
///
/// Seen from `wo` it mirrors about the shading normal, but about the geometric one where the smooth mirror does so too.
/// What of the lobe then lies behind the real surface, or where the shading normal says it is dark, is absorbed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glossy {
    /// Reflectance at normal incidence, linear RGB, each in [0, 1].
    pub f0: Vec3,
    /// Reflectance at grazing incidence, linear RGB, each in [0, 1]. In between: Schlick 1994.
    pub f90: Vec3,
    /// GGX roughness along the tangent and across it, each in [10⁻⁶, 1]: squares of a material's roughness.
    pub alpha: [f32; 2],
    /// Direction in the world along which `alpha[0]` is meant; what of it stands along the normal does not matter, and where
    /// both roughnesses are the same, none of it does.
    pub tangent: Vec3,
    /// True: the back reflects as the front does. False: the back absorbs.
    pub two_sided: bool,
    /// A film on it, which replaces the reflectances above as far as its factor says.
    pub film: Option<Film>,
    /// What lies above it, if anything does.
    pub under: Option<Layers>,
}

impl Glossy {
    /// With nothing on it and nothing above.
    pub fn new(f0: Vec3, f90: Vec3, alpha: [f32; 2], tangent: Vec3, two_sided: bool) -> Self {
        Self { f0, f90, alpha, tangent, two_sided, film: None, under: None }
    }

    /// An estimate of what is passed on of light from `from`: its directional albedo, layers above included.
    pub fn share(&self, normals: &Normals, from: Vec3) -> Vec3 {
        let wo = Frame::new(turning_normal(normals, from), self.tangent).local(from);
        let mu = wo.z.max(0.0) as f32;
        let missing = self.missing(wo.with_z(f64::from(mu)));
        let once = (1.0 - missing) * self.fresnel(albedo::albedo(mu, self.mean_alpha()).grazing);
        self.passed(mu) * (once + missing * self.again(self.mean_missing()))
    }

    /// The albedo averaged over all directions, layers above not counted.
    pub fn average(&self) -> Vec3 {
        let mean = albedo::mean(self.mean_alpha());
        let missing = self.mean_missing();
        (1.0 - missing) * self.fresnel(mean.grazing / (1.0 - mean.missing)) + missing * self.again(missing)
    }

    /// An upper bound of the reflectance from any direction.
    pub(super) fn bound(&self) -> Vec3 {
        let bare = self.f0.max(self.f90);
        self.film.map_or(bare, |film| bare.lerp(Vec3::ONE, film.factor))
    }

    /// M for light from `w`: what does not leave by one facet.
    fn missing(&self, w: DVec3) -> f32 {
        if self.alpha[0] == self.alpha[1] {
            albedo::albedo(w.z as f32, self.alpha[0]).missing
        } else {
            anisotropic::missing(w, self.alpha)
        }
    }

    /// Its cosine-weighted average.
    fn mean_missing(&self) -> f32 {
        if self.alpha[0] == self.alpha[1] {
            albedo::mean(self.alpha[0]).missing
        } else {
            anisotropic::mean(self.alpha)
        }
    }

    /// What comes back of light that does not leave by one facet, `missing` of it on the average.
    fn again(&self, missing: f32) -> Vec3 {
        self.fresnel(albedo::SCHLICK_MEAN).map(|mean| albedo::again(mean, missing))
    }

    /// Reflectance of a facet at the cosine for which (1 − cos)⁵ is `grazing`, in [0, 1].
    fn fresnel(&self, grazing: f32) -> Vec3 {
        let bare = self.f0.lerp(self.f90, grazing);
        let Some(film) = self.film else { return bare };
        let cos = 1.0 - grazing.powf(0.2);
        bare.lerp(film.reflectance(self.f0, cos), film.factor)
    }

    /// What passes the layers above.
    fn passed(&self, mu: f32) -> f32 {
        self.under.map_or(1.0, |layers| layers.transmission(mu))
    }

    fn mean_alpha(&self) -> f32 {
        (self.alpha[0] * self.alpha[1]).sqrt()
    }
}

impl Rough for Glossy {
    fn tangent(&self) -> Vec3 {
        self.tangent
    }

    fn responds(&self, front: bool) -> bool {
        self.two_sided || front
    }

    fn scatter(&self, wo: DVec3, wi: DVec3, _: bool) -> (Vec3, f32) {
        if wi.z <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (facets, half) = (Ggx::new(self.alpha), wo + wi);
        let alpha = self.mean_alpha();
        let [missing, entering] = [wo, wi].map(|w| self.missing(w));
        let density = (1.0 - missing) * facets.mirrored(wo, half) as f32 + missing * grazing(wi.z, alpha);
        let facing = (1.0 - 0.5 * half.length()).max(0.0).powi(5) as f32;
        let once = (facets.density(half) * facets.visibility(wo, wi)) as f32 * self.fresnel(facing);
        let mean = self.mean_missing();
        let more = missing * entering / (PI as f32 * mean) * self.again(mean);
        let passed = self
            .under
            .map_or(1.0, |layers| layers.transmission(wo.z as f32).min(layers.transmission(wi.z as f32)));
        (passed * (once + more), density)
    }

    fn draw(&self, wo: DVec3, u: [f32; 3], _: bool) -> DVec3 {
        let numbers = [f64::from(u[0]), f64::from(u[1])];
        if u[2] < self.missing(wo) {
            return draw_grazing(self.mean_alpha(), numbers);
        }
        mirror(wo, Ggx::new(self.alpha).facet(wo, numbers))
    }
}

/// Density of light that several facets have turned: cos θ / π, more of it within grazing angles that facets shade.
pub(super) fn grazing(cos: f64, alpha: f32) -> f32 {
    let a2 = f64::from(alpha) * f64::from(alpha);
    (cos / (PI * (cos * cos + a2) * (1.0 / a2).ln_1p())) as f32
}

/// A direction of that density.
pub(super) fn draw_grazing(alpha: f32, u: [f64; 2]) -> DVec3 {
    let a2 = f64::from(alpha) * f64::from(alpha);
    let cos2 = (a2 * (u[1] * (1.0 / a2).ln_1p()).exp_m1()).min(1.0);
    let (sin, cos) = (2.0 * PI * u[0]).sin_cos();
    let r = (1.0 - cos2).sqrt();
    DVec3::new(r * cos, r * sin, cos2.sqrt())
}
