//! FLIP, the perceived difference of two pictures: 0 where none can be seen, at most 1.
//!
//! The filter is NVIDIA's own (Andersson et al. 2020), at its default of 67 pixels per degree; it takes 8-bit sRGB.

use crate::film::srgb_encode;
use glam::Vec3;

/// FLIP per pixel of two pictures as displayed: linear RGB clamped to [0, 1] and sRGB-encoded. Pixels that are not
/// to count, or are not finite, are black in both, so that they do not bleed into their neighbours.
///
/// # Panics
/// When lengths differ.
pub fn flip(
    width: u32,
    height: u32,
    picture: &[Vec3],
    reference: &[Vec3],
    left_out: Option<&[bool]>,
) -> Vec<f32> {
    let (picture, reference) = kept(picture, reference, left_out);
    ldr(width, height, &picture, &reference, |v| v)
}

/// HDR-FLIP per pixel (Andersson et al. 2021): the largest FLIP over a range of exposures, tone-mapped (ACES), from
/// the one that shows the brightest pixel of the reference to the one that shows its median. Exposures are a stop
/// apart or a little less.
///
/// # Panics
/// When lengths differ.
pub fn hdr_flip(
    width: u32,
    height: u32,
    picture: &[Vec3],
    reference: &[Vec3],
    left_out: Option<&[bool]>,
) -> Vec<f32> {
    let (picture, reference) = kept(picture, reference, left_out);
    let mut worst = vec![0.0_f32; picture.len()];
    let Some((start, stop)) = exposures(&reference) else { return worst };
    let count = ((stop - start).ceil() as usize).max(2);
    for step in 0..count {
        let exposure = start + (stop - start) * step as f32 / (count - 1) as f32;
        let scale = exposure.exp2();
        let shown = ldr(width, height, &picture, &reference, |v| aces(scale * v));
        for (worst, shown) in worst.iter_mut().zip(shown) {
            *worst = worst.max(shown);
        }
    }
    worst
}

/// Both pictures, black where either is not to count.
fn kept(picture: &[Vec3], reference: &[Vec3], left_out: Option<&[bool]>) -> (Vec<Vec3>, Vec<Vec3>) {
    assert_eq!(picture.len(), reference.len(), "pictures of different size");
    let pairs = picture.iter().zip(reference).enumerate();
    pairs
        .map(|(i, (x, r))| {
            let counts = left_out.is_none_or(|mask| !mask[i]) && x.is_finite() && r.is_finite();
            if counts { (*x, *r) } else { (Vec3::ZERO, Vec3::ZERO) }
        })
        .unzip()
}

fn ldr(
    width: u32,
    height: u32,
    picture: &[Vec3],
    reference: &[Vec3],
    shown: impl Fn(Vec3) -> Vec3,
) -> Vec<f32> {
    let encode = |plane: &[Vec3]| {
        let bytes: Vec<u8> = plane.iter().flat_map(|v| shown(*v).to_array().map(srgb_encode)).collect();
        nv_flip::FlipImageRgb8::with_data(width, height, &bytes)
    };
    nv_flip::flip(encode(reference), encode(picture), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec()
}

/// The ACES curve (x²a + xb) / (x²c + xd + e) of HDR-FLIP, with its pre-exposure of 0.6 in the constants.
const ACES: [f32; 5] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];

fn aces(v: Vec3) -> Vec3 {
    let [a, b, c, d, e] = ACES;
    let v = v.max(Vec3::ZERO);
    (v * v * a + v * b) / (v * v * c + v * d + Vec3::splat(e))
}

/// The exposures, in stops, at which the brightest and the median luminance reach 85 % of white. None for black.
fn exposures(reference: &[Vec3]) -> Option<(f32, f32)> {
    let weights = Vec3::new(0.212_655_8, 0.715_158_8, 0.072_185_6);
    let mut luminances: Vec<f32> = reference.iter().map(|v| v.dot(weights)).filter(|&y| y > 0.0).collect();
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
}
