//! PFM and Radiance HDR: linear light in one plane, for programs that read no OpenEXR.

use crate::error::Result;
use crate::film::ours::{PFM_SCALE, SIGNATURE};
use crate::film::replace::replace_file;
use glam::Vec3;
use std::path::Path;

/// Writes a plane of linear RGB as a portable float map: single precision, bit for bit, row by row from the bottom.
pub fn write_pfm(path: &Path, width: u32, height: u32, plane: &[Vec3]) -> Result<()> {
    assert_eq!(plane.len(), width as usize * height as usize, "a plane of another size");
    replace_file(path, |file| {
        // A scale below zero: the least significant byte comes first.
        file.write_all(format!("PF\n{width} {height}\n{PFM_SCALE}\n").as_bytes())?;
        for row in plane.chunks(width.max(1) as usize).rev() {
            let bytes: Vec<u8> = row.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect();
            file.write_all(&bytes)?;
        }
        Ok(())
    })
}

/// Writes a plane of linear RGB as a Radiance picture (Ward 1991): eight bits a channel and an exponent that they share, to 0.4 % of
/// the largest. What it cannot hold is magenta (above 1.7e38, or not finite) or 0 (negative).
pub fn write_hdr(path: &Path, width: u32, height: u32, plane: &[Vec3]) -> Result<()> {
    assert_eq!(plane.len(), width as usize * height as usize, "a plane of another size");
    replace_file(path, |file| {
        let facts = format!("FORMAT=32-bit_rle_rgbe\nSOFTWARE={SIGNATURE}\n");
        file.write_all(format!("#?RADIANCE\n{facts}\n-Y {height} +X {width}\n").as_bytes())?;
        for row in plane.chunks(width.max(1) as usize) {
            // Pixels as they are: none that is normalised begins a packed row.
            let bytes: Vec<u8> = row.iter().flat_map(|pixel| rgbe(*pixel)).collect();
            file.write_all(&bytes)?;
        }
        Ok(())
    })
}

/// Magenta, as in a preview.
const LOST: [u8; 4] = [128, 0, 128, 129];

/// Mantissas and exponent of a pixel: each channel is m 2^(e − 136), to half a step of the largest.
fn rgbe(pixel: Vec3) -> [u8; 4] {
    if !pixel.is_finite() {
        return LOST;
    }
    let pixel = pixel.max(Vec3::ZERO).as_dvec3();
    let largest = pixel.max_element();
    let scale = |exponent: i32| f64::from(8 - exponent).exp2();
    // largest = f 2^exponent with f in [1/2, 1), which is rounded to 8 bits.
    let below = largest.max(f64::MIN_POSITIVE).log2().floor() as i32 + 1;
    let exponent = if (scale(below) * largest).round() > 255.0 { below + 1 } else { below };
    match exponent {
        ..-127 => [0; 4],
        128.. => LOST,
        _ => {
            let [r, g, b] = (scale(exponent) * pixel).to_array().map(|x| x.round() as u8);
            [r, g, b, (exponent + 128) as u8]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::is_ours;
    use crate::scene::environment::{Limits, Panorama};

    fn plane() -> Vec<Vec3> {
        (0..6_u8).map(|i| Vec3::new(0.001 * f32::from(i), 3.7 * f32::from(i), 1e5)).collect()
    }

    #[test]
    fn a_float_map_is_read_back_bit_for_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.pfm");
        let mut plane = plane();
        plane[1] = Vec3::new(f32::INFINITY, -0.0, f32::NAN);
        write_pfm(&path, 3, 2, &plane).expect("written");
        let bytes = std::fs::read(&path).expect("read");
        let mut lines = bytes.splitn(4, |byte| *byte == b'\n');
        assert_eq!((lines.next(), lines.next()), (Some(&b"PF"[..]), Some(&b"3 2"[..])));
        let scale: f32 =
            std::str::from_utf8(lines.next().expect("a scale")).expect("text").parse().expect("-1");
        assert_eq!(scale, -1.0);
        let floats: Vec<u32> =
            lines.next().expect("pixels").as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
        let upside_down = plane[3..].iter().chain(&plane[..3]);
        let expected: Vec<u32> = upside_down.flat_map(|pixel| pixel.to_array().map(f32::to_bits)).collect();
        assert_eq!(floats, expected);
        assert!(is_ours(&path).expect("read"));
        std::fs::write(&path, b"PF\n1 1\n-1.0\n123456789012").expect("written");
        assert!(!is_ours(&path).expect("read"));
    }

    #[test]
    fn a_radiance_picture_is_read_back_to_half_a_percent_of_its_largest_channel() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.hdr");
        let plane = plane();
        write_hdr(&path, 3, 2, &plane).expect("written");
        let read = Panorama::read(&path, Limits::default()).expect("a panorama");
        for (i, pixel) in plane.iter().enumerate() {
            let found = read.at(i as u32 % 3, i as u32 / 3);
            let off = (found - *pixel).abs().max_element() / pixel.max_element();
            assert!(off < 0.005, "{found} for {pixel}");
        }
        assert!(is_ours(&path).expect("read"));
    }

    #[test]
    fn every_exponent_has_its_mantissa() {
        let value = |[r, _, _, e]: [u8; 4]| f64::from(r) * f64::from(i32::from(e) - 136).exp2();
        for exponent in -126..126 {
            for x in [1.0, 1.3, 1.999_999] {
                let x = x * f64::from(exponent).exp2();
                let bytes = rgbe(Vec3::X * x as f32);
                assert!(bytes[0] >= 128 && (value(bytes) / x - 1.0).abs() < 0.004, "{x}: {bytes:?}");
            }
        }
        assert_eq!([rgbe(Vec3::ZERO), rgbe(-Vec3::ONE), rgbe(Vec3::splat(1e-40))], [[0; 4]; 3]);
        assert_eq!([rgbe(Vec3::NAN), rgbe(Vec3::splat(3e38)), rgbe(Vec3::new(1.0, 0.0, 1.0))], [LOST; 3]);
    }
}
