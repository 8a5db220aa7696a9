use super::albedo::{self, Albedo};
use super::microfacet::{Frame, Ggx, mirror, turning_normal};
use super::{Layers, Normals, Pdf, Sample, Transport};
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
    /// What lies above it, if anything does.
    pub under: Option<Layers>,
}

/// A lobe as `wo` sees it.
struct Seen<'a> {
    lobe: &'a Glossy,
    facets: Ggx,
    wo: DVec3,
    /// One roughness for both directions.
    alpha: f32,
    albedo: Albedo,
}

impl Glossy {
    /// With nothing above it.
    pub fn new(f0: Vec3, f90: Vec3, alpha: [f32; 2], tangent: Vec3, two_sided: bool) -> Self {
        Self { f0, f90, alpha, tangent, two_sided, under: None }
    }

    /// BSDF value in sr⁻¹ of light from `to` that is seen from `from`, cosine not included.
    pub fn eval(&self, normals: &Normals, from: Vec3, to: Vec3) -> Vec3 {
        if !self.reflects(normals, from) || !normals.counts(from, to) {
            return Vec3::ZERO;
        }
        let up = turning_normal(normals, from);
        self.about(up, from, to, |seen, wi| seen.value(wi)).unwrap_or(Vec3::ZERO) * off(normals, up, to)
    }

    /// Density in solid angle of [`sample`](Self::sample) where light is gathered.
    pub fn pdf(&self, normals: &Normals, from: Vec3, to: Vec3) -> f32 {
        if !self.reflects(normals, from) || !normals.counts(from, to) {
            return 0.0;
        }
        let up = turning_normal(normals, from);
        self.about(up, from, to, |seen, wi| seen.density(wi)).unwrap_or(0.0)
    }

    /// A direction nearly in proportion to what it carries. None: absorbed.
    pub fn sample(&self, normals: &Normals, from: Vec3, transport: Transport, u: [f32; 3]) -> Option<Sample> {
        if !self.reflects(normals, from) {
            return None;
        }
        if transport == Transport::Shooting && normals.shading != normals.geometric {
            return self.shot(normals, from, u);
        }
        let up = turning_normal(normals, from);
        let to = self.drawn(up, from, u)?;
        if !normals.counts(from, to) {
            return None;
        }
        let pdf = self.pdf(normals, from, to);
        let weight = self.eval(normals, from, to) * (to.dot(normals.shading).abs() / pdf);
        Some(Sample {
            to,
            weight,
            pdf: Pdf::SolidAngle(pdf),
            geometric: up != normals.shading && up != -normals.shading,
        })
    }

    /// Light goes where it would be gathered from: about either normal, for which of them is seen there depends on where it is
    /// seen from.
    fn shot(&self, normals: &Normals, from: Vec3, u: [f32; 3]) -> Option<Sample> {
        if !normals.same_side(from, from) {
            return None;
        }
        let side = if normals.is_front(from) { 1.0 } else { -1.0 };
        let ups = [side * normals.shading, side * normals.geometric];
        // What is rare is still tried.
        let likely = ups.map(|up| {
            let mirrored = 2.0 * from.dot(up) * up - from;
            let gathered = normals.same_side(from, mirrored) && turning_normal(normals, mirrored) == up;
            if gathered { 1.0 } else { 0.1 }
        });
        let first = likely[0] / (likely[0] + likely[1]);
        let (up, u2) =
            if u[2] < first { (ups[0], u[2] / first) } else { (ups[1], (u[2] - first) / (1.0 - first)) };
        let to = self.drawn(up, from, [u[0], u[1], u2])?;
        if !normals.counts(to, from) {
            return None;
        }
        let density = |up| self.about(up, from, to, |seen, wi| seen.density(wi)).unwrap_or(0.0);
        let pdf = first * density(ups[0]) + (1.0 - first) * density(ups[1]);
        let cosine = to.dot(normals.geometric).abs() / pdf;
        let weight = self.eval(normals, to, from) * (normals.arrival(from) * cosine);
        Some(Sample { to, weight, pdf: Pdf::SolidAngle(pdf), geometric: up == ups[1] })
    }

    /// An estimate of what is passed on of light from `from`: its directional albedo, layers above included.
    pub fn share(&self, normals: &Normals, from: Vec3) -> Vec3 {
        let mu = from.dot(turning_normal(normals, from)).clamp(0.0, 1.0);
        self.passed(mu) * self.directional(mu)
    }

    /// The albedo averaged over all directions, layers above not counted.
    pub fn average(&self) -> Vec3 {
        let mean = albedo::mean(self.mean_alpha());
        let once = (1.0 - mean.missing) * self.f0 + mean.grazing * (self.f90 - self.f0);
        once + mean.missing * self.again(mean.missing)
    }

    fn directional(&self, mu: f32) -> Vec3 {
        let alpha = self.mean_alpha();
        let here = albedo::albedo(mu, alpha);
        let once = (1.0 - here.missing) * self.f0.lerp(self.f90, here.grazing);
        once + here.missing * self.again(albedo::mean(alpha).missing)
    }

    /// What comes back of light that does not leave by one facet, `missing` of it on the average.
    fn again(&self, missing: f32) -> Vec3 {
        let channel = |k: usize| albedo::again(self.f0[k], self.f90[k], missing);
        Vec3::new(channel(0), channel(1), channel(2))
    }

    /// What passes the layers above.
    fn passed(&self, mu: f32) -> f32 {
        self.under.map_or(1.0, |layers| layers.transmission(mu))
    }

    fn mean_alpha(&self) -> f32 {
        (self.alpha[0] * self.alpha[1]).sqrt()
    }

    fn reflects(&self, normals: &Normals, from: Vec3) -> bool {
        self.two_sided || normals.is_front(from)
    }

    /// `f` of the lobe seen from `from`, and of `to`, about `up`. None where either is not above.
    fn about<T>(&self, up: Vec3, from: Vec3, to: Vec3, f: impl Fn(&Seen<'_>, DVec3) -> T) -> Option<T> {
        let frame = Frame::new(up, self.tangent);
        let (wo, wi) = (frame.local(from), frame.local(to));
        (wo.z > 0.0 && wi.z > 0.0).then(|| f(&Seen::new(self, wo), wi))
    }

    fn drawn(&self, up: Vec3, from: Vec3, u: [f32; 3]) -> Option<Vec3> {
        let frame = Frame::new(up, self.tangent);
        let wo = frame.local(from);
        if wo.z <= 0.0 {
            return None;
        }
        let wi = Seen::new(self, wo).draw(u);
        (wi.z > 0.0).then(|| frame.world(wi))
    }
}

/// By what a cosine about `up` is more than one about the shading normal.
fn off(normals: &Normals, up: Vec3, to: Vec3) -> f32 {
    if up == normals.shading || up == -normals.shading {
        return 1.0;
    }
    (to.dot(up) / to.dot(normals.shading)).abs()
}

impl<'a> Seen<'a> {
    fn new(lobe: &'a Glossy, wo: DVec3) -> Self {
        let alpha = lobe.mean_alpha();
        Self { lobe, facets: Ggx::new(lobe.alpha), wo, alpha, albedo: albedo::albedo(wo.z as f32, alpha) }
    }

    fn value(&self, wi: DVec3) -> Vec3 {
        let half = self.wo + wi;
        let once = self.facets.density(half) * self.facets.visibility(self.wo, wi);
        let missing = albedo::mean(self.alpha).missing;
        let here = albedo::albedo(wi.z as f32, self.alpha).missing;
        // Kulla & Conty 2017, with both ends' M over its average.
        let more = self.albedo.missing * here / (PI as f32 * missing);
        let cos = 0.5 * half.length();
        let schlick = self.lobe.f0.lerp(self.lobe.f90, (1.0 - cos).powi(5) as f32);
        let passed = self.lobe.under.map_or(1.0, |layers| {
            (layers.transmission(self.wo.z as f32) * layers.transmission(wi.z as f32)).sqrt()
        });
        passed * (once as f32 * schlick + more * self.lobe.again(missing))
    }

    fn density(&self, wi: DVec3) -> f32 {
        let p = self.albedo.missing;
        let once = self.facets.mirrored(self.wo, self.wo + wi) as f32;
        (1.0 - p) * once + p * grazing(wi.z, self.alpha)
    }

    fn draw(&self, u: [f32; 3]) -> DVec3 {
        let numbers = [f64::from(u[0]), f64::from(u[1])];
        if u[2] < self.albedo.missing {
            return draw_grazing(self.alpha, numbers);
        }
        mirror(self.wo, self.facets.facet(self.wo, numbers))
    }
}

/// Density of light that several facets have turned: cos θ / π, more of it within grazing angles that facets shade.
fn grazing(cos: f64, alpha: f32) -> f32 {
    let a2 = f64::from(alpha) * f64::from(alpha);
    (cos / (PI * (cos * cos + a2) * (1.0 / a2).ln_1p())) as f32
}

fn draw_grazing(alpha: f32, u: [f64; 2]) -> DVec3 {
    let a2 = f64::from(alpha) * f64::from(alpha);
    let cos2 = (a2 * (u[1] * (1.0 / a2).ln_1p()).exp_m1()).min(1.0);
    let (sin, cos) = (2.0 * PI * u[0]).sin_cos();
    let r = (1.0 - cos2).sqrt();
    DVec3::new(r * cos, r * sin, cos2.sqrt())
}
