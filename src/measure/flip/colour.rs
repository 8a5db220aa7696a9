//! The two colour spaces of FLIP: one in which the eye blurs, and one in which distances are perceived differences.

use glam::{Mat3, Vec3};

/// Linear sRGB to XYZ over the XYZ of white: of the primaries of sRGB about the white point (0.31271, 0.32902).
const XYZ: Mat3 = Mat3::from_cols(
    Vec3::new(0.433_895_38, 0.212_636_83, 0.017_752_424),
    Vec3::new(0.376_242_37, 0.715_182_96, 0.109_465_63),
    Vec3::new(0.189_862_24, 0.072_180_2, 0.872_781_93),
);

/// The inverse of [`XYZ`].
const RGB: Mat3 = Mat3::from_cols(
    Vec3::new(3.080_342, -0.921_178_4, 0.052_881_293),
    Vec3::new(-1.537_398_9, 1.875_93, -0.204_011_2),
    Vec3::new(-0.542_943, 0.045_248_41, 1.151_13),
);

/// Linear sRGB as luminance in [0, 1], red against green, and yellow against blue. It is YCxCz but for factors and
/// a constant, which a filter whose weights sum to one passes as they are.
pub fn opponent(rgb: Vec3) -> Vec3 {
    let Vec3 { x, y, z } = XYZ * rgb;
    Vec3::new(y, x - y, y - z)
}

/// Linear sRGB of an [`opponent`] colour, within the gamut.
fn displayed(opponent: Vec3) -> Vec3 {
    let Vec3 { x: y, y: red, z: yellow } = opponent;
    (RGB * Vec3::new(y + red, y, y - yellow)).clamp(Vec3::ZERO, Vec3::ONE)
}

/// L*a*b* of an [`opponent`] colour, with Hunt's adjustment: the darker, the less colourful.
pub fn perceived(opponent: Vec3) -> Vec3 {
    hunt_lab(displayed(opponent))
}

fn hunt_lab(rgb: Vec3) -> Vec3 {
    let [x, y, z] = (XYZ * rgb).to_array().map(lightness);
    let lightness = 116.0 * y - 16.0;
    let colourfulness = 0.01 * lightness;
    Vec3::new(lightness, colourfulness * 500.0 * (x - y), colourfulness * 200.0 * (y - z))
}

/// CIE 15: a cube root that goes on as its own tangent below (6/29)³.
fn lightness(t: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

/// HyAB, for distances that are large: city blocks between lightness and colour, Euclid within colour.
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// How the distance of two [`perceived`] colours becomes an error in [0, 1].
pub struct Redistribution {
    largest: f32,
}

/// The paper's q_c, by the power of which distances are compressed.
const COMPRESSION: f32 = 0.7;
/// The paper's p_c and p_t: distances below this part of the largest fill the errors below that.
const PART: f32 = 0.4;
const ERROR: f32 = 0.95;

impl Redistribution {
    /// By the largest distance on a display, which is that of green and blue.
    pub fn new() -> Self {
        let (green, blue) = (hunt_lab(Vec3::Y), hunt_lab(Vec3::Z));
        Self { largest: hyab(green, blue).powf(COMPRESSION) }
    }

    /// The error of two [`perceived`] colours.
    pub fn error(&self, a: Vec3, b: Vec3) -> f32 {
        let part = hyab(a, b).powf(COMPRESSION) / self.largest;
        if part < PART { part * ERROR / PART } else { ERROR + (part - PART) / (1.0 - PART) * (1.0 - ERROR) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    #[test]
    fn matrices_are_those_of_the_primaries() {
        let xyz = |x: f64, y: f64| DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
        let primaries = DMat3::from_cols(xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06));
        let white = xyz(0.31271, 0.32902);
        let amounts = primaries.inverse() * white;
        let matrix = DMat3::from_diagonal(white).inverse() * primaries * DMat3::from_diagonal(amounts);
        assert!(matrix.abs_diff_eq(XYZ.as_dmat3(), 1e-7), "{matrix}");
        assert!(matrix.inverse().abs_diff_eq(RGB.as_dmat3(), 1e-6), "{}", matrix.inverse());
    }

    #[test]
    fn colours_come_back_and_white_is_the_lightest() {
        let colour = Vec3::new(0.1, 0.7, 0.3);
        assert!(displayed(opponent(colour)).abs_diff_eq(colour, 1e-6));
        assert!(perceived(opponent(Vec3::ONE)).abs_diff_eq(Vec3::new(100.0, 0.0, 0.0), 1e-4));
        assert!(perceived(opponent(Vec3::ZERO)).abs_diff_eq(Vec3::ZERO, 1e-4));
    }

    #[test]
    fn no_two_corners_of_the_gamut_are_further_apart_than_green_and_blue() {
        let redistribution = Redistribution::new();
        let corner = |i: u32| hunt_lab(Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32));
        let errors = (0..64).map(|i| redistribution.error(corner(i & 7), corner(i >> 3)));
        assert_eq!(errors.fold(0.0, f32::max), 1.0);
        assert_eq!(redistribution.error(Vec3::ONE, Vec3::ONE), 0.0);
    }
}
