use crate::scene::texture::to_linear;
use glam::Vec3;
use half::f16;
use rayon::prelude::*;
use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

/// A picture of light from all directions: equirectangular, row 0 at the zenith; linear RGB radiance, W m⁻² sr⁻¹, finite and
/// not negative.
///
/// As glTF's space has them (y up, and a viewer looks along −z), the middle of the picture is +x, a quarter from the left −z, and
/// three quarters +z. That is how three.js lays it out, and Blender's World after export to glTF.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    width: u32,
    height: u32,
    texels: Texels,
}

/// Texels as their file has them, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Texels {
    /// Single precision.
    Float(Vec<[f32; 3]>),
    /// Half precision.
    Half(Vec<[f16; 3]>),
    /// Mantissas and a common exponent, as of Radiance, and what all are to be multiplied by.
    Shared(Vec<[u8; 4]>, Vec3),
    /// sRGB, 255 for 1.
    Srgb(Vec<[u8; 3]>),
    /// sRGB, 65535 for 1.
    DeepSrgb(Vec<[u16; 3]>),
}

/// What an exponent stands for: 2^(exponent − 128), of which a mantissa is so many 256ths. Zero is for black.
static EXPONENTS: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|e| if e == 0 { 0.0 } else { (e as f64 - 136.0).exp2() as f32 }));

static SRGB: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|stored| to_linear(stored as f64 / 255.0) as f32));

static DEEP_SRGB: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..=u16::MAX).map(|stored| to_linear(f64::from(stored) / 65535.0) as f32).collect());

impl Texels {
    fn len(&self) -> usize {
        match self {
            Self::Float(texels) => texels.len(),
            Self::Half(texels) => texels.len(),
            Self::Shared(texels, _) => texels.len(),
            Self::Srgb(texels) => texels.len(),
            Self::DeepSrgb(texels) => texels.len(),
        }
    }

    fn bytes_each(&self) -> usize {
        match self {
            Self::Float(_) => 12,
            Self::Half(_) | Self::DeepSrgb(_) => 6,
            Self::Shared(..) => 4,
            Self::Srgb(_) => 3,
        }
    }

    #[inline]
    fn at(&self, index: usize) -> Vec3 {
        match self {
            Self::Float(texels) => Vec3::from_array(texels[index]),
            Self::Half(texels) => Vec3::from_array(texels[index].map(f16::to_f32)),
            Self::Shared(texels, scale) => {
                let [r, g, b, exponent] = texels[index];
                EXPONENTS[usize::from(exponent)] * *scale * Vec3::from_array([r, g, b].map(f32::from))
            }
            Self::Srgb(texels) => Vec3::from_array(texels[index].map(|stored| SRGB[usize::from(stored)])),
            Self::DeepSrgb(texels) => {
                Vec3::from_array(texels[index].map(|stored| DEEP_SRGB[usize::from(stored)]))
            }
        }
    }
}

impl Panorama {
    /// Of `width` × `height` texels, row by row from the top left. Err: what is wrong with them.
    pub fn new(width: u32, height: u32, texels: Vec<Vec3>) -> Result<Self, String> {
        Self::of(width, height, Texels::Float(texels.into_iter().map(|texel| texel.to_array()).collect()))
    }

    /// The same of texels that are known to be right.
    pub(crate) fn of_texels(width: u32, height: u32, texels: Vec<Vec3>) -> Self {
        Self::new(width, height, texels).expect("radiance for every texel")
    }

    /// The same from everywhere; `radiance` is finite and not negative.
    pub fn constant(radiance: Vec3) -> Self {
        Self::of_texels(1, 1, vec![radiance])
    }

    pub(super) fn of(width: u32, height: u32, texels: Texels) -> Result<Self, String> {
        if width == 0 || height == 0 || texels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(format!("{} texels are not {width} × {height}", texels.len()));
        }
        let panorama = Self { width, height, texels };
        panorama.wrong_texel().map_or(Ok(panorama), Err)
    }

    /// The first texel that is no light, in words.
    fn wrong_texel(&self) -> Option<String> {
        let wrong = |texel: &Vec3| !(texel.is_finite() && texel.min_element() >= 0.0);
        let (x, y) = (0..self.height)
            .into_par_iter()
            .find_map_first(|y| (0..self.width).find(|x| wrong(&self.at(*x, y))).map(|x| (x, y)))?;
        let [r, g, b] = self.at(x, y).to_array();
        Some(format!(
            "its texel in column {x}, row {y} (from 0 at the upper left) is ({r}, {g}, {b}); light is finite and not below zero: \
             mend it in an image editor"
        ))
    }

    /// Texels of a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Radiance of the texel in column `x` and row `y`, W m⁻² sr⁻¹.
    #[inline]
    pub fn at(&self, x: u32, y: u32) -> Vec3 {
        assert!(x < self.width);
        self.texels.at(y as usize * self.width as usize + x as usize)
    }

    /// What it takes in memory.
    pub fn bytes(&self) -> usize {
        self.texels.len() * self.texels.bytes_each()
    }

    /// The unit vector of a place: u from the left, v from the top, both in [0, 1].
    pub fn direction([u, v]: [f32; 2]) -> Vec3 {
        let (sin_turn, cos_turn) = (TAU * (u - 0.5)).sin_cos();
        // From the nearer pole, where single precision tells small angles apart.
        let (sine, cosine) = (PI * v.min(1.0 - v)).sin_cos();
        let up = if v > 0.5 { -cosine } else { cosine };
        Vec3::new(sine * cos_turn, up, sine * sin_turn)
    }

    /// The place of a direction of any length: u in [0, 1), v in [0, 1].
    pub fn place(direction: Vec3) -> [f32; 2] {
        let Vec3 { x, y, z } = direction;
        let u = z.atan2(x) / TAU + 0.5;
        let v = x.hypot(z).atan2(y) / PI;
        [if u < 1.0 { u } else { 0.0 }, v]
    }

    /// Solid angle of each texel of a row, sr.
    pub fn solid_angle(&self, row: u32) -> f64 {
        let edge = |row: u32| (std::f64::consts::PI * f64::from(row) / f64::from(self.height)).cos();
        std::f64::consts::TAU / f64::from(self.width) * (edge(row) - edge(row + 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_and_its_direction_are_one() {
        let edges = [0.0, 1e-4, 0.01, 0.25, 0.4999, 0.5, 0.5001, 0.75, 0.99, 0.9999];
        for u in edges {
            for v in edges.into_iter().skip(1) {
                let direction = Panorama::direction([u, v]);
                assert!((direction.length() - 1.0).abs() < 1e-6);
                let [a, b] = Panorama::place(direction);
                let round = (a - u).abs().min(1.0 - (a - u).abs());
                assert!(round < 2e-7 && (b - v).abs() < 2e-7, "({u}, {v}) comes back as ({a}, {b})");
                assert!(Panorama::direction([a, b]).distance(direction) < 1e-6);
            }
        }
    }

    #[test]
    fn the_axes_stand_where_viewers_have_them() {
        for (direction, place) in [
            (Vec3::X, [0.5, 0.5]),
            (Vec3::NEG_Z, [0.25, 0.5]),
            (Vec3::Z, [0.75, 0.5]),
            (Vec3::new(-1.0, 0.0, 1e-30), [0.0, 0.5]),
            (Vec3::NEG_X, [0.0, 0.5]),
            (Vec3::new(-1.0, 0.0, -1e-30), [0.0, 0.5]),
            (Vec3::new(2.0, 2.0, 0.0), [0.5, 0.25]),
        ] {
            assert_eq!(Panorama::place(direction), place, "{direction}");
        }
        assert_eq!(Panorama::place(Vec3::Y)[1], 0.0);
        assert_eq!(Panorama::place(Vec3::NEG_Y)[1], 1.0);
    }

    #[test]
    fn single_precision_tells_directions_at_both_poles_apart() {
        for away in [1e-5_f32, 1e-7] {
            let up = Panorama::place(Vec3::new(away, 1.0, 0.0));
            assert!((up[1] * PI / away - 1.0).abs() < 1e-5);
            assert!((Panorama::direction(up).x / away - 1.0).abs() < 1e-5);
        }
        assert_eq!(Panorama::direction([0.3, 1.0]), Vec3::NEG_Y);
        assert_eq!(Panorama::direction([0.3, 0.0]), Vec3::Y);
    }

    #[test]
    fn a_texel_that_is_no_light_is_named() {
        for (wrong, word) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (-0.25, "-0.25")] {
            let mut texels = vec![Vec3::ONE; 8 * 4];
            texels[2 * 8 + 5].y = wrong;
            let why = Panorama::new(8, 4, texels).expect_err(word);
            assert!(why.contains("column 5, row 2") && why.contains(word), "{why}");
        }
        assert!(Panorama::new(0, 0, Vec::new()).is_err());
        assert!(Panorama::new(2, 2, vec![Vec3::ONE; 3]).is_err_and(|why| why.contains("3 texels")));
        assert!(Panorama::new(1, 1, vec![Vec3::new(0.0, -0.0, 1e-45)]).is_ok());
    }

    #[test]
    fn solid_angles_fill_the_sphere() {
        let panorama = Panorama::of_texels(6, 5, vec![Vec3::ZERO; 30]);
        let all: f64 = (0..5).map(|row| 6.0 * panorama.solid_angle(row)).sum();
        assert!((all / (2.0 * std::f64::consts::TAU) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn every_way_to_keep_texels_means_the_same() {
        let bits = |texels: Texels| Panorama::of(1, 1, texels).expect("a texel").at(0, 0).to_array();
        assert_eq!(
            bits(Texels::Shared(vec![[128, 64, 255, 137]], Vec3::new(1.0, 2.0, 1.0))),
            [256.0, 256.0, 510.0]
        );
        assert_eq!(bits(Texels::Shared(vec![[128, 64, 255, 0]], Vec3::ONE)), [0.0; 3]);
        assert_eq!(
            bits(Texels::Half(vec![[0.5, 1000.0, 65504.0].map(f16::from_f32)])),
            [0.5, 1000.0, 65504.0]
        );
        let eight = bits(Texels::Srgb(vec![[0, 188, 255]]));
        assert_eq!([eight[0], eight[2]], [0.0, 1.0]);
        assert!((eight[1] - 0.502_886).abs() < 1e-6, "{eight:?}");
        assert_eq!(bits(Texels::DeepSrgb(vec![[0, 188 * 257, 65535]])), eight);
        assert!(Panorama::of(1, 1, Texels::Half(vec![[f16::INFINITY; 3]])).is_err());
    }
}
