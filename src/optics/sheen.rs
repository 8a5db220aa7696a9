use super::Normals;
use super::albedo::{cosine_weighted, gauss, lerp, place};
use super::rough::{Rough, turning_normal};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

/// Fibres that stand up, as of velvet: the distribution of Estevez & Kulla 2017 ("Charlie") with their fit of shadowing, as the
/// glTF extension KHR_materials_sheen has it.
///
/// That fit makes more light than came where α is below 0.07 and light grazes. There, all is divided by the most that any
/// direction would reflect, which leaves the lobe reciprocal. An α below 0.01 is taken for 0.01: nothing is seen of it but at
/// the very rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// Scale of what is reflected, linear RGB, each in [0, 1].
    pub colour: Vec3,
    /// Width of the distribution in [0.01, 1], the square of a material's sheen roughness.
    pub alpha: f32,
    /// True: the back reflects as the front does. False: the back absorbs.
    pub two_sided: bool,
}

impl Sheen {
    /// What one of colour 1 reflects of light that comes at cosine `mu` in [0, 1].
    pub fn albedo(mu: f32, alpha: f32) -> f32 {
        TABLE.albedo(mu, alpha)
    }

    /// An estimate of what is passed on of light from `from`; never zero, as the fit of shadowing is not.
    pub(super) fn share(&self, normals: &Normals, from: Vec3) -> Vec3 {
        let mu = from.dot(turning_normal(normals, from)).clamp(0.0, 1.0);
        Self::albedo(mu, self.alpha) * self.colour
    }

    /// What one of colour 1 reflects of light from all directions alike.
    pub fn average(alpha: f32) -> f32 {
        cosine_weighted(|mu| Self::albedo(mu, alpha))
    }
}

impl Rough for Sheen {
    fn tangent(&self) -> Vec3 {
        Vec3::ZERO
    }

    fn responds(&self, front: bool) -> bool {
        self.two_sided || front
    }

    fn scatter(&self, wo: DVec3, wi: DVec3, _: bool) -> (Vec3, f32) {
        if wi.z <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let alpha = self.alpha.max(NARROWEST);
        let value = value(wo, wi, f64::from(alpha)) as f32 / TABLE.most(alpha);
        (value * self.colour, 1.0 / TAU as f32)
    }

    /// Evenly over the hemisphere: most of it is at grazing angles.
    fn draw(&self, _: DVec3, u: [f32; 3], _: bool) -> DVec3 {
        let (z, (sin, cos)) = (1.0 - f64::from(u[0]), (TAU * f64::from(u[1])).sin_cos());
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}

/// The BSDF of one of colour 1 as it was published; both z > 0.
fn value(wo: DVec3, wi: DVec3, alpha: f64) -> f64 {
    let half = wo + wi;
    let sin2 = (half.x * half.x + half.y * half.y) / half.length_squared();
    let density = (2.0 + 1.0 / alpha) * sin2.powf(0.5 / alpha) / TAU;
    density / (4.0 * wo.z * wi.z * (1.0 + (shadow(wo.z, alpha) + shadow(wi.z, alpha))))
}

/// Λ at cosine `cos`: Estevez & Kulla 2017, §3.
fn shadow(cos: f64, alpha: f64) -> f64 {
    let smooth = (1.0 - alpha) * (1.0 - alpha);
    let mix = |rough: f64, fine: f64| rough + (fine - rough) * smooth;
    let [a, b] = [mix(21.5473, 25.3245), mix(3.829_87, 3.324_35)];
    let [c, d, e] = [mix(0.198_23, 0.168_01), mix(-1.9776, -1.273_93), mix(-4.320_54, -4.859_67)];
    let fit = |x: f64| a / (1.0 + b * x.powf(c)) + d * x + e;
    if cos < 0.5 { fit(cos).exp() } else { (2.0 * fit(0.5) - fit(1.0 - cos)).exp() }
}

/// Directional albedos by √α and √μ, and the largest of each row if it is above one.
struct Table {
    by_cosine: [[f32; COSINES]; WIDTHS],
    most: [f32; WIDTHS],
}

const COSINES: usize = 32;
const WIDTHS: usize = 24;
/// α of the first row.
const NARROWEST: f32 = 0.01;
/// More than the largest albedo of a row may be between its nodes.
const MARGIN: f32 = 1.015;
/// The cosine of the first column: below it the fit of shadowing means nothing.
const LOWEST: f64 = 1e-4;

static TABLE: LazyLock<Table> = LazyLock::new(Table::build);

impl Table {
    fn build() -> Self {
        let mut table = Self { by_cosine: [[0.0; COSINES]; WIDTHS], most: [1.0; WIDTHS] };
        let narrowest = NARROWEST.sqrt();
        for (i, row) in table.by_cosine.iter_mut().enumerate() {
            let root = narrowest + (1.0 - narrowest) * i as f32 / (WIDTHS - 1) as f32;
            let alpha = f64::from(root * root);
            for (j, entry) in row.iter_mut().enumerate() {
                let mu = (j as f64 / (COSINES - 1) as f64).powi(2).max(LOWEST);
                *entry = integrate(mu, alpha) as f32;
                table.most[i] = table.most[i].max(MARGIN * *entry);
            }
        }
        table
    }

    fn row(alpha: f32) -> (usize, f32) {
        let narrowest = NARROWEST.sqrt();
        place((alpha.sqrt() - narrowest) / (1.0 - narrowest), WIDTHS)
    }

    fn most(&self, alpha: f32) -> f32 {
        let (i, s) = Self::row(alpha);
        lerp(self.most[i], self.most[i + 1], s)
    }

    fn albedo(&self, mu: f32, alpha: f32) -> f32 {
        let (i, s) = Self::row(alpha);
        let (j, t) = place(mu.sqrt(), COSINES);
        let [a, b] = [i, i + 1].map(|i| lerp(self.by_cosine[i][j], self.by_cosine[i][j + 1], t));
        lerp(a, b, s) / self.most(alpha)
    }
}

/// What comes at cosine `mu` is reflected: half a turn, and cosines denser near the horizon.
fn integrate(mu: f64, alpha: f64) -> f64 {
    let wo = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
    let turns = 12;
    let mut sum = 0.0;
    for turn in 0..turns {
        let (sin, cos) = (PI * (f64::from(turn) + 0.5) / f64::from(turns)).sin_cos();
        for (node, weight) in gauss(3) {
            let z = node * node;
            let r = (1.0 - z * z).sqrt();
            sum += weight * 2.0 * node * z * value(wo, DVec3::new(r * cos, r * sin, z), alpha);
        }
    }
    TAU * sum / f64::from(turns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_what_is_reflected() {
        let n = 400;
        let mut worst = 0.0_f64;
        let mut most = 0.0_f64;
        for alpha in [0.01, 0.02, 0.05, 0.09, 0.3, 0.6, 1.0_f64] {
            for k in 1..20 {
                let mu = (f64::from(k) / 20.0).powi(2) + 3e-4;
                let wo = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
                let mut sum = 0.0;
                for i in 0..n * n {
                    let z = ((f64::from(i / n) + 0.5) / f64::from(n)).powi(2);
                    let (sin, cos) = (PI * (f64::from(i % n) + 0.5) / f64::from(n)).sin_cos();
                    let r = (1.0 - z * z).sqrt();
                    sum += 2.0 * z.sqrt() * z * value(wo, DVec3::new(r * cos, r * sin, z), alpha);
                }
                let fine = TAU * sum / f64::from(n * n) / f64::from(TABLE.most(alpha as f32));
                let off = (f64::from(Sheen::albedo(mu as f32, alpha as f32)) - fine).abs();

                worst = worst.max(off);
                most = most.max(fine);
            }
        }
        assert!(worst < 0.012 && most < 1.0, "{worst}, {most}");
    }
}
