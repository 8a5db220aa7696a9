//! Where a picture differs from its reference.

use super::magma::magma;
use glam::Vec3;

/// (x − r) / √(r² + 0.01²) per pixel and channel: signed, and its mean square is relMSE. Pixels left out are 0.
pub fn signed_relative_error(picture: &[Vec3], reference: &[Vec3], left_out: &[bool]) -> Vec<Vec3> {
    let pixels = picture.iter().zip(reference).zip(left_out);
    let error = |x: Vec3, r: Vec3| {
        let (x, r) = (x.as_dvec3(), r.as_dvec3());
        let scale = r * r + glam::DVec3::splat(1e-4);
        ((x - r) / glam::DVec3::new(scale.x.sqrt(), scale.y.sqrt(), scale.z.sqrt())).as_vec3()
    };
    pixels.map(|((x, r), masked)| if *masked { Vec3::ZERO } else { error(*x, *r) }).collect()
}

/// The root mean square over channels of [`signed_relative_error`] in colour (magma), on a logarithmic scale: black
/// 0.001 or less, purple 0.01, salmon 0.1, pale yellow 1 or more. Pixels left out are grey, those that are not
/// finite green. Three sRGB bytes a pixel.
pub fn heat_map(signed: &[Vec3], left_out: &[bool]) -> Vec<u8> {
    let colour = |(error, masked): (&Vec3, &bool)| {
        if *masked {
            return [96, 96, 96];
        }
        if !error.is_finite() {
            return [0, 255, 0];
        }
        let size = (error.as_dvec3().length_squared() / 3.0).sqrt();
        let place = ((size.log10() + 3.0) / 3.0).clamp(0.0, 1.0);
        magma((255.0 * place).round() as u8)
    };
    signed.iter().zip(left_out).flat_map(colour).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_is_as_the_legend_says() {
        let reference = [Vec3::ONE; 4];
        let picture = [Vec3::ONE, Vec3::splat(2.5), Vec3::splat(f32::NAN), Vec3::ZERO];
        let mask = [false, false, false, true];
        let signed = signed_relative_error(&picture, &reference, &mask);
        assert!((signed[1].x - 1.5).abs() < 1e-4 && signed[3] == Vec3::ZERO);
        let map = heat_map(&signed, &mask);
        assert!(map[0] < 4 && map[3] > 240 && map[4] > 240, "{map:?}");
        assert_eq!(map[6..], [0, 255, 0, 96, 96, 96]);
    }
}
