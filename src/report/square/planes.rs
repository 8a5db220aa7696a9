//! Pictures for the page, as PNG: whole numbers with one exponent for each pixel.

use glam::Vec3;
use std::io;

/// Components of one atlas as whole numbers: value = number · 2^exponent of the pixel.
pub struct Quantised {
    pub width: u32,
    pub height: u32,
    /// One for each pixel, common to all components.
    pub exponents: Vec<i8>,
    /// Red, green and blue of each pixel, for each component.
    pub components: Vec<Vec<[i16; 3]>>,
}

/// A component is kept to this share (2^-n) of the brightest that its pixel gets.
const BITS: f32 = 12.0;

impl Quantised {
    /// `components` as they are multiplied by no more than one.
    pub fn of((width, height): (u32, u32), components: &[Vec<Vec3>]) -> Self {
        let pixels = width as usize * height as usize;
        let largest =
            |i: usize| components.iter().map(|plane| plane[i].abs().max_element()).fold(0.0, f32::max);
        // 2^exponent ≤ largest / 2^BITS; the largest then has up to BITS + 1 bits and a sign.
        let exponent = |i: usize| (largest(i).max(1e-30).log2() - BITS).floor().clamp(-120.0, 120.0) as i8;
        let exponents: Vec<i8> = (0..pixels).map(exponent).collect();
        let components = components
            .iter()
            .map(|plane| {
                let pixels = plane.iter().zip(&exponents);
                pixels
                    .map(|(v, e)| (*v * (-f32::from(*e)).exp2()).round().to_array().map(|x| x as i16))
                    .collect()
            })
            .collect();
        Self { width, height, exponents, components }
    }

    /// A component as radiance again.
    pub fn radiance(&self, component: usize) -> Vec<Vec3> {
        let pixels = self.components[component].iter().zip(&self.exponents);
        pixels.map(|(v, e)| Vec3::from_array(v.map(f32::from)) * f32::from(*e).exp2()).collect()
    }

    /// PNG of twice the height: low bytes above, high bytes below.
    pub fn component_png(&self, component: usize) -> io::Result<Vec<u8>> {
        let numbers = &self.components[component];
        let low = numbers.iter().flatten().map(|x| x.to_le_bytes()[0]);
        let high = numbers.iter().flatten().map(|x| x.to_le_bytes()[1]);
        encoded(self.width, 2 * self.height, &low.chain(high).collect::<Vec<u8>>(), png::ColorType::Rgb)
    }

    /// The exponents plus 128, grey.
    pub fn exponents_png(&self) -> io::Result<Vec<u8>> {
        let bytes: Vec<u8> = self.exponents.iter().map(|e| (i16::from(*e) + 128) as u8).collect();
        encoded(self.width, self.height, &bytes, png::ColorType::Grayscale)
    }
}

/// Errors are pooled over cells of so many pixels on each side.
pub const CELL: u32 = 8;
/// Steps of an error in an octave; 128 stands for 1.
const PER_OCTAVE: f32 = 8.0;

/// Errors at several points as one picture, below each other: root mean square over cells, 128 + 8 log₂; 0 for none.
pub fn errors_png((width, height): (u32, u32), planes: &[Vec<Vec3>]) -> io::Result<Vec<u8>> {
    let (across, down) = (width.div_ceil(CELL), height.div_ceil(CELL));
    let mut bytes = Vec::new();
    for plane in planes {
        for (v, u) in (0..down).flat_map(|v| (0..across).map(move |u| (v, u))) {
            let rows = (v * CELL)..((v + 1) * CELL).min(height);
            let columns = (u * CELL)..((u + 1) * CELL).min(width);
            let squares = rows.flat_map(|y| columns.clone().map(move |x| plane[(y * width + x) as usize]));
            let (sum, n) = squares.fold((Vec3::ZERO, 0.0), |(sum, n), e| (sum + e * e, n + 1.0));
            bytes.extend((sum / n).to_array().map(|square| {
                if square == 0.0 {
                    0
                } else {
                    (128.0 + PER_OCTAVE * 0.5 * square.log2()).round().clamp(1.0, 255.0) as u8
                }
            }));
        }
    }
    encoded(across, down * planes.len() as u32, &bytes, png::ColorType::Rgb)
}

fn encoded(width: u32, height: u32, bytes: &[u8], colour: png::ColorType) -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_to_a_share_of_the_brightest() {
        let bright = vec![Vec3::new(150.0, 0.25, 3.0), Vec3::splat(2e-6), Vec3::ZERO, Vec3::splat(4095.9)];
        let faint: Vec<Vec3> = bright.iter().map(|v| -0.013 * *v).collect();
        let quantised = Quantised::of((2, 2), &[bright.clone(), faint.clone()]);
        for (component, plane) in [bright.clone(), faint].iter().enumerate() {
            for ((back, v), most) in quantised.radiance(component).iter().zip(plane).zip(&bright) {
                assert!(
                    (*back - *v).abs().max_element() <= most.max_element() * 2_f32.powi(-13),
                    "{v}: {back}"
                );
            }
        }
    }
}
