//! Linear pictures as PNG, small enough for a page and exact enough for exposure and error maps.

use base64::Engine;
use glam::Vec3;
use std::io;

/// A picture for the page: PNG of twice its height. Above, the mantissas m of red, green and blue; below, in red the
/// common exponent e (after Ward 1991), in green 255 where the pixel is left out of error figures. A value is
/// m / 256 · 2^(e − 128); e = 255 marks a pixel that is not finite.
pub fn encoded(width: u32, height: u32, picture: &[Vec3], left_out: &[bool]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::with_capacity(6 * picture.len());
    let pairs: Vec<([u8; 3], u8)> = picture.iter().map(|v| shared_exponent(*v)).collect();
    bytes.extend(pairs.iter().flat_map(|pair| pair.0));
    bytes.extend(pairs.iter().zip(left_out).flat_map(|(pair, out)| [pair.1, 255 * u8::from(*out), 0]));
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, 2 * height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(file)
}

/// As text for a page.
pub fn base64(bytes: &[u8]) -> String {
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

fn shared_exponent(v: Vec3) -> ([u8; 3], u8) {
    if !v.is_finite() {
        return ([255; 3], 255);
    }
    let largest = v.max_element();
    // 2^exponent ≥ largest, with room for the rounding of a mantissa of 255.5 and more.
    let exponent = (largest * (256.0 / 255.5)).log2().floor() + 1.0;
    if largest <= 0.0 || exponent < -127.0 {
        return ([0; 3], 0);
    }
    let scale = 256.0 * (-exponent).exp2();
    ((scale * v).to_array().map(|c| (c + 0.5) as u8), (exponent.min(126.0) + 128.0) as u8)
}

/// Half the size, by means over 2×2 pixels (fewer at the border); a pixel is left out where any of them is.
pub fn halved(
    width: u32,
    height: u32,
    picture: &[Vec3],
    left_out: &[bool],
) -> (u32, u32, Vec<Vec3>, Vec<bool>) {
    let (w, h) = (width.div_ceil(2), height.div_ceil(2));
    let mut smaller = (Vec::new(), Vec::new());
    for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
        let cells = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| (2 * x + dx, 2 * y + dy));
        let inside = cells.into_iter().filter(|(x, y)| *x < width && *y < height);
        let inside: Vec<usize> = inside.map(|(x, y)| (y * width + x) as usize).collect();
        smaller.0.push(inside.iter().map(|&i| picture[i]).sum::<Vec3>() / inside.len() as f32);
        smaller.1.push(inside.iter().any(|&i| left_out[i]));
    }
    (w, h, smaller.0, smaller.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_within_half_a_step_of_the_largest_channel() {
        for v in [
            Vec3::new(1.0, 0.5, 0.25),
            Vec3::new(0.999, 0.0, 0.1),
            Vec3::splat(3e-7),
            Vec3::new(4e9, 1.0, 2e8),
            Vec3::splat(0.9985),
        ] {
            let (m, e) = shared_exponent(v);
            let back = Vec3::from_array(m.map(f32::from)) / 256.0 * (f32::from(e) - 128.0).exp2();
            let off = (back - v).abs().max_element() / v.max_element();
            assert!(off <= 0.5 / 127.0, "{v} came back as {back}");
        }
        assert_eq!(shared_exponent(Vec3::ZERO).1, 0);
        assert_eq!(shared_exponent(Vec3::NAN).1, 255);
    }

    #[test]
    fn halving_keeps_the_mean_and_spreads_the_mask() {
        let picture: Vec<Vec3> = (0..12).map(|i| Vec3::splat(i as f32)).collect();
        let mut mask = vec![false; 12];
        mask[5] = true; // column 1, row 1
        let (w, h, smaller, out) = halved(4, 3, &picture, &mask);
        assert_eq!((w, h), (2, 2));
        assert_eq!(smaller.iter().map(|v| v.x).collect::<Vec<_>>(), [2.5, 4.5, 8.5, 10.5]);
        assert_eq!(out, [true, false, false, false]);
    }
}
