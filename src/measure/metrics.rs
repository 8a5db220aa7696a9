//! The error of a picture x against a reference r, as numbers.

use glam::{DVec3, Vec3};

/// Error figures of one picture (or any layer) against its reference, over the pixels that are compared.
///
/// "Displayed" values are linear radiance clamped to [0, 1], with neither tone mapping nor transfer function, as in
/// the paper.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct Metrics {
    /// Pixels compared.
    pub compared: usize,
    /// Pixels left out by the mask.
    pub masked: usize,
    /// Unmasked pixels with a component that is not finite in either picture; they are in no other figure.
    pub not_finite: usize,
    /// Those of `not_finite` that are not the same in both pictures (an infinite depth may be).
    pub not_finite_apart: usize,
    /// √(mean over pixels and channels of (x−r)²), in the unit of the picture.
    pub rmse: f64,
    /// Mean over pixels and channels of (x−r)² / (r² + 0.01²).
    pub relmse: f64,
    /// Mean over pixels and channels of x−r.
    pub bias: f64,
    /// `bias` over the mean of r; None where that is zero.
    pub relative_bias: Option<f64>,
    /// The paper's e_pixel = √(⅓(Δr²+Δg²+Δb²)) on displayed values, mean over pixels.
    pub e_pixel: f64,
    /// The largest e_pixel.
    pub e_pixel_max: f64,
    /// Largest over channels of |difference of the average colours| on displayed values.
    pub mean_colour: f64,
}

/// Compares a picture with a reference of the same size. `left_out` marks pixels that are not to count. With no
/// pixel to compare every figure is zero and `compared` says so.
///
/// # Panics
/// When lengths differ.
pub fn compare(picture: &[Vec3], reference: &[Vec3], left_out: Option<&[bool]>) -> Metrics {
    assert_eq!(picture.len(), reference.len(), "pictures of different size");
    assert!(left_out.is_none_or(|mask| mask.len() == picture.len()), "a mask of another size");
    let (mut compared, mut masked, mut not_finite, mut not_finite_apart) = (0_usize, 0, 0, 0);
    let (mut square, mut relative, mut difference, mut level) = (0.0, 0.0, 0.0, 0.0);
    let (mut e_sum, mut e_max, mut colour) = (0.0, 0.0_f64, DVec3::ZERO);
    for (i, (x, r)) in picture.iter().zip(reference).enumerate() {
        if left_out.is_some_and(|mask| mask[i]) {
            masked += 1;
        } else if !(x.is_finite() && r.is_finite()) {
            not_finite += 1;
            not_finite_apart += usize::from(!same(*x, *r));
        } else {
            compared += 1;
            let (x, r) = (x.as_dvec3(), r.as_dvec3());
            let d = x - r;
            square += d.length_squared();
            relative += (d * d / (r * r + DVec3::splat(1e-4))).element_sum();
            difference += d.element_sum();
            level += r.element_sum();
            let shown = displayed(x) - displayed(r);
            let e = (shown.length_squared() / 3.0).sqrt();
            e_sum += e;
            e_max = e_max.max(e);
            colour += shown;
        }
    }
    let pixels = compared.max(1) as f64;
    Metrics {
        compared,
        masked,
        not_finite,
        not_finite_apart,
        rmse: (square / (3.0 * pixels)).sqrt(),
        relmse: relative / (3.0 * pixels),
        bias: difference / (3.0 * pixels),
        relative_bias: (level != 0.0).then(|| difference / level),
        e_pixel: e_sum / pixels,
        e_pixel_max: e_max,
        mean_colour: (colour / pixels).abs().max_element(),
    }
}

/// Equal, where NaN equals NaN: a picture does not differ from itself.
fn same(x: Vec3, r: Vec3) -> bool {
    x.to_array().iter().zip(r.to_array()).all(|(x, r)| *x == r || (x.is_nan() && r.is_nan()))
}

fn displayed(linear: DVec3) -> DVec3 {
    linear.clamp(DVec3::ZERO, DVec3::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_by_hand() {
        // Differences (0.1, 0, 0) and (0, -0.2, 1); displayed: the last saturates, 2.5 and 1.5 are both white.
        let reference = [Vec3::new(0.5, 0.25, 0.0), Vec3::new(0.25, 0.5, 1.5)];
        let picture = [Vec3::new(0.6, 0.25, 0.0), Vec3::new(0.25, 0.3, 2.5)];
        let m = compare(&picture, &reference, None);
        let near = |got: f64, expected: f64| {
            assert!((got / expected - 1.0).abs() < 1e-6, "got {got}, expected {expected}");
        };
        near(m.rmse, (1.05_f64 / 6.0).sqrt());
        near(m.relmse, (0.01 / 0.2501 + 0.04 / 0.2501 + 1.0 / 2.2501) / 6.0);
        near(m.bias, 0.9 / 6.0);
        near(m.relative_bias.unwrap(), 0.9 / 3.0);
        near(m.e_pixel, (0.1 + 0.2) / (2.0 * 3.0_f64.sqrt()));
        near(m.e_pixel_max, 0.2 / 3.0_f64.sqrt());
        near(m.mean_colour, 0.1);
        assert_eq!((m.compared, m.masked, m.not_finite), (2, 0, 0));
    }

    #[test]
    fn the_mask_leaves_out_and_lost_pixels_are_counted() {
        let mut picture = [Vec3::ONE; 5];
        let mut reference = [Vec3::ONE; 5];
        picture[0] = Vec3::splat(7.0);
        picture[1].y = f32::NAN;
        picture[2] = Vec3::INFINITY;
        reference[2] = Vec3::INFINITY;
        assert_eq!(compare(&picture, &picture, None).not_finite_apart, 0);
        let m = compare(&picture, &reference, Some(&[true, false, false, false, false]));
        assert_eq!((m.compared, m.masked, m.not_finite, m.not_finite_apart), (2, 1, 2, 1));
        assert_eq!((m.rmse, m.relmse, m.e_pixel_max), (0.0, 0.0, 0.0));
    }

    #[test]
    fn two_percent_of_a_tiny_or_huge_power_is_two_percent() {
        for scale in [1e-12_f32, 1e12] {
            let m = compare(&[Vec3::splat(1.02 * scale); 9], &[Vec3::splat(scale); 9], None);
            assert!((m.relative_bias.unwrap() - 0.02).abs() < 1e-6);
            assert!((m.rmse / f64::from(scale) - 0.02).abs() < 1e-6);
        }
    }
}
