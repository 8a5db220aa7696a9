use glam::{Mat3, Vec3};
use std::f32::consts::{PI, TAU};

/// A thin film on a surface, where light of some wavelengths adds up and of others cancels: Belcour & Barla 2017 in the form
/// of the glTF extension KHR_materials_iridescence, in air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Index of the film, above 0.
    pub ior: f32,
    /// Thickness in nanometres, ≥ 0.
    pub thickness: f32,
    /// The share in [0, 1] of the surface's reflectance that the film changes.
    pub factor: f32,
}

impl Film {
    /// Reflectance, linear RGB in [0, 1], at cosine `cos` in [0, 1] of a surface that without the film reflects `f0` at normal
    /// incidence.
    ///
    /// Interference up to the second order. Where a colour's sum leaves [0, 1], which only the three broad bands of red,
    /// green and blue make it do, it is taken for the nearer end.
    pub fn reflectance(&self, f0: Vec3, cos: f32) -> Vec3 {
        let sin2 = (1.0 - cos * cos) / (self.ior * self.ior);
        if sin2 >= 1.0 {
            return Vec3::ONE;
        }
        let below = (1.0 - sin2).sqrt();
        let first = schlick(normal_incidence(1.0, self.ior), cos);
        // No index gives a reflectance of one.
        let base = f0.map(|f0| {
            let root = f0.min(MOST).sqrt();
            (1.0 + root) / (1.0 - root)
        });
        let second = base.map(|ior| schlick(normal_incidence(self.ior, ior), below));
        let passes = 1.0 - first;
        let both = first * second;
        let series = passes * passes * second / (1.0 - both);
        // Half a wavelength is lost where light meets a lower index from within or a higher one from without.
        let turn = if self.ior < 1.0 { 0.0 } else { PI };
        let shift = base.map(|ior| turn + if ior < self.ior { PI } else { 0.0 });
        let path = 2.0 * self.ior * self.thickness * below;
        let mut sum = first + series;
        let mut amplitude = series - passes;
        for order in [1.0, 2.0] {
            amplitude *= both.map(f32::sqrt);
            sum += amplitude * 2.0 * seen(order * path, order * shift);
        }
        sum.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// The largest reflectance at normal incidence that is given an index.
const MOST: f32 = 0.9999;

fn schlick(f0: f32, cos: f32) -> f32 {
    f0 + (1.0 - f0) * (1.0 - cos).powi(5)
}

fn normal_incidence(from: f32, to: f32) -> f32 {
    ((to - from) / (to + from)).powi(2)
}

/// What red, green and blue see of a wave that a path of so many nanometres and a phase delay: the observer's sensitivity
/// curves as Gaussians, in the frequency domain. Belcour & Barla 2017, §4.
fn seen(path: f32, shift: Vec3) -> Vec3 {
    let phase = TAU * path * 1e-9;
    let wave = |height: f32, middle: f32, variance: f32, shift: f32| {
        height * (TAU * variance).sqrt() * (middle * phase + shift).cos() * (-phase * phase * variance).exp()
    };
    let x = wave(5.4856e-13, 1.6810e6, 4.3278e9, shift.x) + wave(9.7470e-14, 2.2399e6, 4.5282e9, shift.x);
    let y = wave(4.4201e-13, 1.7953e6, 9.3046e9, shift.y);
    let z = wave(5.2481e-13, 2.2084e6, 6.6121e9, shift.z);
    // CIE XYZ to the primaries of Rec. 709.
    let rgb = Mat3::from_cols(
        Vec3::new(3.240_454_2, -0.969_266, 0.055_643_4),
        Vec3::new(-1.537_138_5, 1.876_010_8, -0.204_025_9),
        Vec3::new(-0.498_531_4, 0.041_556, 1.057_225_2),
    );
    rgb * Vec3::new(x, y, z) / 1.0685e-7
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_of_the_surfaces_own_matter_changes_nothing() {
        // No second interface, whatever the thickness; but Schlick's law says that one of equal indices reflects at grazing
        // angles.
        let film = Film { ior: 1.5, thickness: 400.0, factor: 1.0 };
        for (cos, most) in [(1.0, 1e-6), (0.8, 2e-3), (0.5, 0.02)] {
            let off = (film.reflectance(Vec3::splat(0.04), cos) - schlick(0.04, cos)).abs().max_element();
            assert!(off < most, "{cos}: {off}");
        }
    }

    #[test]
    fn a_thick_film_has_no_colour() {
        let film = Film { ior: 1.3, thickness: 20_000.0, factor: 1.0 };
        let here = film.reflectance(Vec3::splat(0.5), 0.8);
        assert!(here.max_element() - here.min_element() < 1e-4, "{here}");
        // Both interfaces, each light once: R₁ + T₁² R₂ / (1 − R₁ R₂).
        let n = (1.0 + 0.5_f32.sqrt()) / (1.0 - 0.5_f32.sqrt());
        let below = (1.0 - 0.36 / 1.69_f32).sqrt();
        let (a, b) = (schlick(normal_incidence(1.0, 1.3), 0.8), schlick(normal_incidence(1.3, n), below));
        assert!((here.x - (a + (1.0 - a).powi(2) * b / (1.0 - a * b))).abs() < 1e-5);
    }

    #[test]
    fn soap_is_dark_where_it_is_thin_and_of_an_octave_of_colours_where_it_is_not() {
        // A quarter of green's wavelength of a film between air and air: green adds up. Half of it: green cancels.
        let film = |path: f32| Film { ior: 1.33, thickness: path / 1.33, factor: 1.0 };
        let air = Vec3::splat(1e-6);
        let [quarter, half] = [550.0 / 4.0, 550.0 / 2.0].map(|path| film(path).reflectance(air, 1.0));
        assert!(quarter.y > 0.07, "{quarter}");
        assert!(half.y < 0.01 && half.x > half.y && half.z > half.y, "{half}");
    }
}
