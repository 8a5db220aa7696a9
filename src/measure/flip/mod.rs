//! FLIP, the perceived difference of two pictures: 0 where none can be seen, at most 1.
//!
//! After P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild 2020: FLIP: a difference
//! evaluator for alternating images, and P. Andersson, J. Nilsson, P. Shirley, T. Akenine-Möller 2021: Visualizing errors in
//! rendered high dynamic range images. Constants are the papers'; tests compare the results with those of NVIDIA's own tool.

mod colour;
mod filters;
#[cfg(test)]
mod nvidia;

use crate::film::srgb_encode;
use colour::Redistribution;
use filters::Eye;
use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::FRAC_1_SQRT_2;

/// FLIP per pixel of two pictures as displayed: linear RGB clamped to [0, 1], sRGB-encoded in eight bits, since that
/// is what files for displays hold, which NVIDIA's tool reads. Pixels that are not to count, or are not finite, are
/// black in both, so that they do not bleed into their neighbours.
///
/// # Panics
/// When lengths differ, or are not that of the size.
pub fn flip(
    width: u32,
    height: u32,
    picture: &[Vec3],
    reference: &[Vec3],
    left_out: Option<&[bool]>,
) -> Vec<f32> {
    let (picture, reference) = kept(width, height, picture, reference, left_out);
    let decode: Vec<f32> = (0..=255).map(srgb_decode).collect();
    let shown = |v: &Vec3| Vec3::from(v.to_array().map(|linear| decode[usize::from(srgb_encode(linear))]));
    Comparison::new(width).errors(&picture, &reference, shown)
}

/// HDR-FLIP per pixel (Andersson et al. 2021): the largest FLIP over a range of exposures, tone-mapped (ACES), from
/// the one that shows the brightest pixel of the reference to the one that shows its median. Exposures are a stop
/// apart or a little less. Nothing is rounded to eight bits: what is tone-mapped is compared and not stored.
///
/// The median is that of the pixels that are not black, since no exposure shows a black one. NVIDIA's tool counts
/// those too, and has no exposure to end at where they are the most, as around a masked scene.
///
/// # Panics
/// When lengths differ, or are not that of the size.
pub fn hdr_flip(
    width: u32,
    height: u32,
    picture: &[Vec3],
    reference: &[Vec3],
    left_out: Option<&[bool]>,
) -> Vec<f32> {
    let (picture, reference) = kept(width, height, picture, reference, left_out);
    let mut worst = vec![0.0_f32; picture.len()];
    let Some((start, stop)) = exposures(&reference) else { return worst };
    let comparison = Comparison::new(width);
    let count = ((stop - start).ceil() as usize).max(2);
    for step in 0..count {
        let exposure = start + (stop - start) * step as f32 / (count - 1) as f32;
        let scale = exposure.exp2();
        let errors = comparison.errors(&picture, &reference, |v| aces(scale * *v));
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
    }
    worst
}

/// Both pictures, black where either is not to count.
fn kept(
    width: u32,
    height: u32,
    picture: &[Vec3],
    reference: &[Vec3],
    left_out: Option<&[bool]>,
) -> (Vec<Vec3>, Vec<Vec3>) {
    assert_eq!(picture.len(), reference.len(), "pictures of different size");
    assert_eq!(picture.len(), width as usize * height as usize, "pictures of another size");
    let pairs = picture.iter().zip(reference).enumerate();
    pairs
        .map(|(i, (x, r))| {
            let counts = left_out.is_none_or(|mask| !mask[i]) && x.is_finite() && r.is_finite();
            if counts { (*x, *r) } else { (Vec3::ZERO, Vec3::ZERO) }
        })
        .unzip()
}

/// An sRGB byte as a linear value, by the transfer function of IEC 61966-2-1.
fn srgb_decode(byte: u8) -> f32 {
    let encoded = f32::from(byte) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// FLIP of pictures of a width.
struct Comparison {
    width: usize,
    eye: Eye,
    redistribution: Redistribution,
}

impl Comparison {
    fn new(width: u32) -> Self {
        Self { width: width as usize, eye: Eye::new(), redistribution: Redistribution::new() }
    }

    /// Of two pictures as `shown`, which is linear and in [0, 1].
    fn errors(&self, picture: &[Vec3], reference: &[Vec3], shown: impl Fn(&Vec3) -> Vec3 + Sync) -> Vec<f32> {
        if picture.is_empty() {
            return Vec::new();
        }
        let [x, r] = [picture, reference].map(|plane| {
            let shown: Vec<Vec3> = plane.par_iter().map(&shown).collect();
            self.eye.sees(self.width, &shown)
        });
        let error = |i: usize| {
            let colour = self.redistribution.error(x.colours[i], r.colours[i]);
            // Either kind of feature that is in one picture only, q_f = 1/2.
            let feature = (x.features[i] - r.features[i]).abs().max_element() * FRAC_1_SQRT_2;
            colour.powf(1.0 - feature.sqrt())
        };
        (0..picture.len()).into_par_iter().map(error).collect()
    }
}

/// The ACES curve (x²a + xb) / (x²c + xd + e) of HDR-FLIP, with its pre-exposure of 0.6 in the constants.
const ACES: [f32; 5] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];

fn aces(v: Vec3) -> Vec3 {
    let [a, b, c, d, e] = ACES;
    // Above 12.1 the curve is above one, which is white; squares far above would not be finite.
    let v = v.clamp(Vec3::ZERO, Vec3::splat(16.0));
    ((v * v * a + v * b) / (v * v * c + v * d + Vec3::splat(e))).min(Vec3::ONE)
}

/// The exposures, in stops, at which the brightest and the median luminance reach 85 % of white. None for black, as
/// which counts what is too faint for an exposure that f32 can hold.
fn exposures(reference: &[Vec3]) -> Option<(f32, f32)> {
    let weights = Vec3::new(0.2126, 0.7152, 0.0722);
    let luminances = reference.iter().map(|v| v.dot(weights));
    let mut luminances: Vec<f32> = luminances.filter(|&y| y >= f32::MIN_POSITIVE).collect();
    luminances.sort_by(f32::total_cmp);
    let (brightest, median) = (*luminances.last()?, luminances[luminances.len() / 2]);
    let [a, b, c, d, e] = ACES;
    let (a, b, c) = (a - 0.85 * c, b - 0.85 * d, -0.85 * e);
    let half = -b / (2.0 * a);
    let bright = half + (half * half - c / a).sqrt();
    Some(((bright / brightest).log2(), (bright / median).log2()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(scale: f32) -> Vec<Vec3> {
        (0..32 * 32).map(|i| scale * Vec3::new((i % 32) as f32, (i / 32) as f32, 16.0) / 32.0).collect()
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        let picture = ramp(3.0);
        assert!(flip(32, 32, &picture, &picture, None).iter().all(|&e| e == 0.0));
        assert!(hdr_flip(32, 32, &picture, &picture, None).iter().all(|&e| e == 0.0));
        assert!(hdr_flip(32, 32, &vec![Vec3::ZERO; 1024], &vec![Vec3::ZERO; 1024], None).len() == 1024);
    }

    #[test]
    fn black_against_white_is_nearly_one_and_small_errors_are_small() {
        let (black, white) = (vec![Vec3::ZERO; 1024], vec![Vec3::ONE; 1024]);
        let e = flip(32, 32, &black, &white, None);
        assert!(e.iter().all(|&e| e > 0.9), "{}", e[512]);
        let e = flip(32, 32, &ramp(1.02), &ramp(1.0), None);
        let mean = e.iter().sum::<f32>() / 1024.0;
        assert!(mean > 0.001 && mean < 0.1, "{mean}");
    }

    #[test]
    fn what_saturates_on_a_display_is_seen_only_by_the_hdr_kind() {
        let (a, b) = (vec![Vec3::splat(2.0); 1024], vec![Vec3::splat(4.0); 1024]);
        assert!(flip(32, 32, &a, &b, None).iter().all(|&e| e == 0.0));
        assert!(hdr_flip(32, 32, &a, &b, None).iter().all(|&e| e > 0.05));
    }

    #[test]
    fn masked_and_lost_pixels_do_not_bleed() {
        let mut picture = ramp(1.0);
        let mut mask = vec![false; 1024];
        picture[500] = Vec3::splat(50.0);
        mask[500] = true;
        picture[501].x = f32::NAN;
        assert!(flip(32, 32, &picture, &ramp(1.0), Some(&mask)).iter().all(|&e| e == 0.0));
    }

    #[test]
    fn eighty_five_percent_of_white_is_where_the_curve_says() {
        let (start, stop) = exposures(&[Vec3::splat(2.0); 3]).unwrap();
        assert_eq!(start, stop);
        assert!((aces(Vec3::splat(2.0 * start.exp2())).x - 0.85).abs() < 1e-5);
    }

    #[test]
    fn bytes_of_srgb_come_back() {
        assert!((0..=255).all(|byte| srgb_encode(srgb_decode(byte)) == byte));
    }

    #[test]
    fn no_range_that_floats_hold_is_too_high() {
        for (bright, dark) in [(3e38, 1.0), (1.0, 2e-38), (1.0, 1e-42), (3e38, 2e-38), (1e-42, 1e-44)] {
            let reference: Vec<Vec3> =
                (0..64).map(|i| Vec3::splat(if i == 0 { bright } else { dark })).collect();
            let picture: Vec<Vec3> = reference.iter().rev().copied().collect();
            let errors = hdr_flip(8, 8, &picture, &reference, None);
            assert!(errors.iter().all(|e| (0.0..=1.0).contains(e)), "{bright} {dark}: {errors:?}");
        }
        assert!(flip(0, 0, &[], &[], None).is_empty() && hdr_flip(0, 3, &[], &[], None).is_empty());
    }
}
