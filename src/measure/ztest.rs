//! Do two pictures agree? Tests that accept differences due to noise alone, and reject all others.

use crate::film::{Film, Image, Layer};
use crate::measure::distributions::{
    normal_quantile_two_sided, normal_two_sided, student_quantile_two_sided, student_two_sided,
};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// How many standard errors a mean lies from what was expected. Without spread: zero when equal, else infinite.
pub fn z(mean: f64, standard_error: f64, expected: f64) -> f64 {
    let away = mean - expected;
    if away == 0.0 { 0.0 } else { away / standard_error }
}

/// A picture with error bars.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Mean over passes, linear RGB, row-major.
    pub mean: Vec<Vec3>,
    /// Standard error of that mean, same shape and unit.
    pub standard_error: Vec<Vec3>,
    /// Independent passes (or groups of passes) behind its error; None where the picture is exact.
    pub passes: Option<u32>,
    /// Average colour and its standard error over passes. Without it pixels are taken to be independent, which
    /// overstates the z of a bias where they share photons.
    pub colour: Option<(DVec3, DVec3)>,
}

impl Estimate {
    /// The visible mean of a film. None below two passes: there is no error bar yet.
    pub fn from_film(film: &Film) -> Option<Self> {
        let colour_error = film.mean_colour_error()?;
        Some(Self {
            mean: film.mean(Layer::Visible),
            standard_error: film.standard_error(),
            passes: Some(film.passes()),
            colour: Some((film.mean_colour(), colour_error)),
        })
    }

    /// A picture from a file that has an `error` layer and says its `passes` (at least two), or from how many groups of them
    /// the error was measured (`error_samples`).
    pub fn from_image(image: &Image) -> Option<Self> {
        let count = |name: &str| u32::try_from(image.header.get(name)?.as_integer()?).ok();
        let samples = count("error_samples").or_else(|| count("passes")).filter(|&n| n >= 2)?;
        Some(Self {
            mean: image.layer(Layer::Visible.name())?.to_vec(),
            standard_error: image.layer(Layer::Error.name())?.to_vec(),
            passes: Some(samples),
            colour: None,
        })
    }

    /// A picture known from a closed form.
    pub fn exact(mean: Vec<Vec3>) -> Self {
        let colour = mean.iter().map(|v| v.as_dvec3()).sum::<DVec3>() / mean.len().max(1) as f64;
        let standard_error = vec![Vec3::ZERO; mean.len()];
        Self { mean, standard_error, passes: None, colour: Some((colour, DVec3::ZERO)) }
    }

    /// Degrees of freedom of the standard error.
    fn freedom(&self) -> f64 {
        self.passes.map_or(f64::INFINITY, |n| f64::from(n) - 1.0)
    }
}

/// How well two pictures agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Pixel-channels compared.
    pub compared: usize,
    /// Pixel-channels that are not finite in either picture; never accepted.
    pub not_finite: usize,
    /// Fraction that passes at the level with Šidák's correction for `compared` tests at once.
    pub corrected: f64,
    /// Fraction that passes at the level itself: close to 1 − level when error bars are right and noise is normal.
    pub uncorrected: f64,
    /// Mean over pixels and channels of a − b.
    pub bias: f64,
    /// `bias` over the mean of b (infinite where that is zero and a is not).
    pub relative_bias: f64,
    /// The z of the average colour's difference, in the channel where it is largest. From few passes it is the
    /// normal z of equal probability to Student's t.
    pub bias_z: f64,
}

impl Agreement {
    /// At least 99.75 % of pixel-channels pass, no bias beyond z = 3.5 in any channel, nothing lost.
    pub fn accepted(&self) -> bool {
        self.not_finite == 0 && self.corrected >= 0.9975 && self.bias_z.abs() < 3.5
    }
}

/// Significance level of the per-pixel test (Mitsuba 3's).
const LEVEL: f64 = 0.01;

/// A few units in the last place of f32: what two orders of the same sum may differ by. Without it two pictures
/// free of noise would have to be equal bit for bit.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// Tests per pixel and channel whether two estimates of the same picture differ by more than their noise (Welch's
/// t-test, Šidák's correction), and whether their average colours do. `left_out` marks pixels that are not to count.
///
/// # Panics
/// When lengths differ.
pub fn agreement(a: &Estimate, b: &Estimate, left_out: Option<&[bool]>) -> Agreement {
    let pixels = a.mean.len();
    assert!([b.mean.len(), a.standard_error.len(), b.standard_error.len()] == [pixels; 3], "sizes differ");
    let mut tests: Vec<(f64, f64)> = Vec::with_capacity(3 * pixels);
    let (mut not_finite, mut kept) = (0, 0_usize);
    let (mut sum_a, mut sum_b, mut var_a, mut var_b) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for i in (0..pixels).filter(|&i| left_out.is_none_or(|mask| !mask[i])) {
        let (x, y) = (a.mean[i].as_dvec3(), b.mean[i].as_dvec3());
        let (se_x, se_y) = (a.standard_error[i].as_dvec3(), b.standard_error[i].as_dvec3());
        for channel in 0..3 {
            let test =
                welch((x[channel], se_x[channel], a.freedom()), (y[channel], se_y[channel], b.freedom()));
            if test.0.is_nan() || test.1.is_nan() { not_finite += 1 } else { tests.push(test) }
        }
        kept += 1;
        (sum_a, sum_b) = (sum_a + x, sum_b + y);
        (var_a, var_b) = (var_a + se_x * se_x, var_b + se_y * se_y);
    }
    let n = kept.max(1) as f64;
    let whole = |e: &Estimate, sum: DVec3, var: DVec3| {
        let independent = (sum / n, DVec3::new(var.x.sqrt(), var.y.sqrt(), var.z.sqrt()) / n);
        e.colour.filter(|_| kept == pixels).unwrap_or(independent)
    };
    let ((colour_a, error_a), (colour_b, error_b)) = (whole(a, sum_a, var_a), whole(b, sum_b, var_b));
    let colour_z = [0, 1, 2].map(|c| {
        let t = welch((colour_a[c], error_a[c], a.freedom()), (colour_b[c], error_b[c], b.freedom()));
        equivalent_z(t.0, t.1)
    });
    let bias = (sum_a - sum_b).element_sum() / (3.0 * n);
    let reference = sum_b.element_sum() / (3.0 * n);
    Agreement {
        compared: tests.len(),
        not_finite,
        corrected: passing(&tests, 1.0 - (1.0 - LEVEL).powf(1.0 / tests.len().max(1) as f64)),
        uncorrected: passing(&tests, LEVEL),
        bias,
        relative_bias: if bias == 0.0 { 0.0 } else { bias / reference },
        // NaN must win here, or a lost picture would look unbiased.
        bias_z: colour_z.into_iter().fold(
            0.0,
            |worst: f64, z| {
                if z.is_nan() || z.abs() > worst.abs() { z } else { worst }
            },
        ),
    }
}

/// Welch's t and its degrees of freedom, from (mean, standard error, degrees of freedom) of two samples.
fn welch((x, se_x, free_x): (f64, f64, f64), (y, se_y, free_y): (f64, f64, f64)) -> (f64, f64) {
    let (var_x, var_y) = (se_x * se_x, se_y * se_y);
    let noise = var_x + var_y;
    let rounding = ROUNDING * x.abs().max(y.abs());
    let t = z(x, (noise + rounding * rounding).sqrt(), y);
    // As shares, because squares of tiny variances leave the range of f64.
    let share = if noise > 0.0 { var_x / noise } else { 0.0 };
    let spread = share * share / free_x + (1.0 - share) * (1.0 - share) / free_y;
    (t, if noise > 0.0 { 1.0 / spread } else { f64::INFINITY })
}

/// The fraction of tests with P(|T| > |t|) ≥ level.
fn passing(tests: &[(f64, f64)], level: f64) -> f64 {
    // One quantile serves all tests of nearly the same degrees of freedom; the lower end is the cautious one.
    let mut critical: HashMap<u64, f64> = HashMap::new();
    let passed = tests.iter().filter(|(t, freedom)| {
        let near = if *freedom < 64.0 {
            (16.0 * freedom).floor().max(1.0) / 16.0
        } else {
            64.0 * (0.01 * (100.0 * (freedom / 64.0).ln()).floor()).exp()
        };
        let bound = critical.entry(near.to_bits());
        t.abs() <= *bound.or_insert_with(|| student_quantile_two_sided(level, near))
    });
    passed.count() as f64 / tests.len().max(1) as f64
}

/// The normal z that is as improbable as Student's t.
fn equivalent_z(t: f64, freedom: f64) -> f64 {
    // Beyond 1e-300 both tails underflow; then it does not matter any more.
    let p = student_two_sided(t, freedom).max(1e-300);
    if t.is_nan() || p <= normal_two_sided(37.0) { t } else { normal_quantile_two_sided(p).copysign(t) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PassImage;
    use std::f64::consts::PI;

    struct Normal(u64);

    impl Normal {
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let x = (self.0 ^ (self.0 >> 29)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            ((x >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        }

        fn next(&mut self) -> f64 {
            (-2.0 * self.uniform().ln()).sqrt() * (2.0 * PI * self.uniform()).cos()
        }
    }

    const SIDE: u32 = 64;

    fn truth() -> Vec<Vec3> {
        (0..SIDE * SIDE).map(|i| Vec3::new(0.2, 1.0, 5.0) * (1.0 + (i % SIDE) as f32 / 64.0)).collect()
    }

    /// Noise of 20 % per pass, plus noise that all pixels of a pass share.
    fn render(seed: u64, passes: u32, shared: f64, factor: impl Fn(usize) -> f32) -> Estimate {
        let mut noise = Normal(seed);
        let mut film = Film::new(SIDE, SIDE, &[]);
        for _ in 0..passes {
            let all = 1.0 + shared * noise.next();
            let value = |(i, t): (usize, Vec3)| {
                let own = [0; 3].map(|_| (all + 0.2 * noise.next()) as f32);
                factor(i) * t * Vec3::from_array(own)
            };
            let plane = truth().into_iter().enumerate().map(value).collect();
            film.add(&PassImage {
                width: SIDE,
                height: SIDE,
                planes: vec![(Layer::Visible, plane)],
                asides: crate::film::Asides::default(),
            });
        }
        Estimate::from_film(&film).unwrap()
    }

    #[test]
    fn the_level_is_kept_from_two_passes_to_many() {
        let sd = (0.01_f64 * 0.99 / f64::from(3 * SIDE * SIDE)).sqrt();
        for passes in [2, 3, 5, 30] {
            let a = agreement(&render(1, passes, 0.0, |_| 1.0), &Estimate::exact(truth()), None);
            assert!(a.accepted(), "{passes} passes: {a:?}");
            assert!(((a.uncorrected - 0.99) / sd).abs() < 3.5, "{passes} passes: {a:?}");
        }
        // Welch's degrees of freedom are an approximation, on the cautious side when passes are few.
        let a = agreement(&render(2, 8, 0.0, |_| 1.0), &render(3, 20, 0.0, |_| 1.0), None);
        assert!(a.accepted() && a.uncorrected > 0.985 && a.uncorrected < 0.996, "{a:?}");
    }

    #[test]
    fn two_percent_too_bright_or_dark_is_rejected() {
        for wrong in [0.98, 1.02] {
            let a = agreement(&render(4, 16, 0.0, |_| wrong), &Estimate::exact(truth()), None);
            assert!(!a.accepted() && a.bias_z.abs() > 3.5, "{a:?}");
            assert!((a.relative_bias - (f64::from(wrong) - 1.0)).abs() < 2e-3, "{a:?}");
            let a = agreement(&render(5, 16, 0.0, |_| wrong), &render(6, 16, 0.0, |_| 1.0), None);
            assert!(!a.accepted(), "{a:?}");
        }
    }

    #[test]
    fn a_small_region_that_is_wrong_is_rejected_though_the_average_is_right() {
        let wrong = |i: usize| match i % 100 {
            0 => 2.0,
            50 => 0.0,
            _ => 1.0,
        };
        let a = agreement(&render(7, 64, 0.0, wrong), &Estimate::exact(truth()), None);
        assert!(!a.accepted() && a.corrected < 0.9975, "{a:?}");
    }

    #[test]
    fn noise_shared_by_the_pixels_of_a_pass_is_no_bias() {
        let estimates: Vec<Estimate> = (10..40).map(|seed| render(seed, 8, 0.1, |_| 1.0)).collect();
        let truth = Estimate::exact(truth());
        let worst = |colour: bool| {
            let z = estimates.iter().map(|e| {
                let e = Estimate { colour: e.colour.filter(|_| colour), ..e.clone() };
                agreement(&e, &truth, None).bias_z.abs()
            });
            z.fold(0.0, f64::max)
        };
        assert!(worst(true) < 3.5, "z = {}", worst(true));
        assert!(worst(false) > 3.5, "pixels taken to be independent should have looked biased");
    }

    #[test]
    fn pictures_without_noise_may_differ_by_rounding_only() {
        let exact = Estimate::exact(truth());
        let scaled = |factor: f32| Estimate::exact(truth().iter().map(|v| factor * *v).collect());
        assert!(agreement(&exact, &scaled(1.0 + 2.0 * f32::EPSILON), None).accepted());
        assert!(!agreement(&exact, &scaled(1.00001), None).accepted());
    }

    #[test]
    fn a_lost_pixel_is_never_accepted_unless_masked() {
        let mut a = render(8, 4, 0.0, |_| 1.0);
        a.mean[77].y = f32::NAN;
        a.colour = None;
        let truth = Estimate::exact(truth());
        let result = agreement(&a, &truth, None);
        assert!(!result.accepted() && result.not_finite == 1 && result.bias_z.is_nan());
        let mask: Vec<bool> = (0..a.mean.len()).map(|i| i == 77).collect();
        assert!(agreement(&a, &truth, Some(&mask)).accepted());
    }

    #[test]
    fn z_of_no_spread() {
        assert_eq!(z(1.0, 0.0, 1.0), 0.0);
        assert_eq!(z(2.0, 0.0, 1.0), f64::INFINITY);
        assert_eq!(z(1.0, 0.5, 2.0), -2.0);
    }
}
