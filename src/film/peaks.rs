//! Maxima and minima over passes of every pixel, coarsely, which is as much as tests of an error bar need.

use super::state::{BitReader, BitWriter, width_of};

/// One row of the picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Peaks {
    /// Of the brightness of what was scattered, rounded down to an eighth: what stands out does so by far.
    scattered: Vec<u16>,
    /// The least of [`one_more`](super::Asides::one_more), rounded up to a quarter; zero: there was none.
    one_more: Vec<u16>,
}

/// Bits that are kept of a single-precision number that is not below zero: its exponent, and so many of its fraction.
const SCATTERED: u32 = 8 + 3;
const ONE_MORE: u32 = 8 + 2;
/// As all bits of the exponent are set: infinite.
const fn infinite(bits: u32) -> u16 {
    0xff << (bits - 8)
}

/// The largest number of so many bits that is not above `x`; of what is no number, zero: the sums keep it.
fn below(x: f32, bits: u32) -> u16 {
    if x > 0.0 { (x.to_bits() >> (31 - bits)) as u16 } else { 0 }
}

/// The least number of so many bits that is not below `x`.
fn above(x: f32, bits: u32) -> u16 {
    let down = below(x, bits);
    if x > 0.0 && value(down, bits) < f64::from(x) { down + 1 } else { down }
}

fn value(number: u16, bits: u32) -> f64 {
    f32::from_bits(u32::from(number) << (31 - bits)).into()
}

impl Peaks {
    /// Bytes of a pixel in memory.
    pub const BYTES: usize = 2 * size_of::<u16>();

    /// Of so many pixels, all zero.
    pub fn new(len: usize) -> Self {
        Self { scattered: vec![0; len], one_more: vec![0; len] }
    }

    /// Of a pixel, the brightest that was scattered to it in any pass.
    pub fn scattered(&self, i: usize) -> f64 {
        value(self.scattered[i], SCATTERED)
    }

    /// Of a pixel, the least that one photon more would have added in any pass: in that of the widest disk, where it would have come
    /// soonest.
    pub fn one_more(&self, i: usize) -> f64 {
        value(self.one_more[i], ONE_MORE)
    }

    /// Takes in what was scattered in a pass, pixel by pixel.
    pub fn meet_scattered(&mut self, lengths: &[f32]) {
        raise(&mut self.scattered, lengths.iter().map(|x| below(*x, SCATTERED)));
    }

    /// Takes in what one photon more would have added, pixel by pixel.
    pub fn meet_one_more(&mut self, one_more: &[f32]) {
        lower(&mut self.one_more, one_more.iter().map(|x| above(*x, ONE_MORE)));
    }

    /// Takes in those of other passes.
    pub fn join(&mut self, other: &Self) {
        raise(&mut self.scattered, other.scattered.iter().copied());
        lower(&mut self.one_more, other.one_more.iter().copied());
    }

    /// As a file holds them, what was scattered first.
    pub fn write(&self, bits: &mut BitWriter<'_>) {
        write(&self.scattered, SCATTERED, bits);
        write(&self.one_more, ONE_MORE, bits);
    }

    /// Takes in those that a file holds, of as many pixels. None: it ends early, or one is no number.
    pub fn join_written(&mut self, bits: &mut BitReader<'_>) -> Option<()> {
        let len = self.scattered.len();
        let (scattered, one_more) = (read(len, SCATTERED, bits)?, read(len, ONE_MORE, bits)?);
        raise(&mut self.scattered, scattered.into_iter());
        lower(&mut self.one_more, one_more.into_iter());
        Some(())
    }

    /// The most bytes that a file has for so many pixels.
    pub const fn longest(len: usize) -> usize {
        (2 * (EXPONENT + WIDTH) as usize + len * (2 + SCATTERED + ONE_MORE) as usize).div_ceil(8)
    }
}

/// Bits of an exponent, and of the width of what is stored of it.
const EXPONENT: u32 = 8;
const WIDTH: u32 = 4;

/// The lowest exponent and a width; then of each number its exponent, less the lowest and plus one, in so many bits, and its fraction.
/// Zero alone, in as many bits, is zero.
fn write(numbers: &[u16], bits_of_each: u32, bits: &mut BitWriter<'_>) {
    let fraction = bits_of_each - EXPONENT;
    let exponents = || numbers.iter().filter(|x| **x > 0).map(|x| u32::from(*x) >> fraction);
    let lowest = exponents().min().unwrap_or(0);
    let width = width_of(exponents().max().map_or(0, |highest| highest - lowest + 1));
    bits.put(lowest, EXPONENT);
    bits.put(width, WIDTH);
    for x in numbers.iter().map(|x| u32::from(*x)) {
        if x == 0 {
            bits.put(0, width);
        } else {
            bits.put((x >> fraction) - lowest + 1, width);
            bits.put(x & ((1 << fraction) - 1), fraction);
        }
    }
}

/// So many of the same. None: they end early, or one is no number.
fn read(len: usize, bits_of_each: u32, bits: &mut BitReader<'_>) -> Option<Vec<u16>> {
    let fraction = bits_of_each - EXPONENT;
    let (lowest, width) = (bits.take(EXPONENT)?, bits.take(WIDTH)?);
    let number = |_| match bits.take(width)? {
        0 => Some(0),
        above => {
            let x = (lowest + above - 1) << fraction | bits.take(fraction)?;
            // Its first bits may not be those of zero.
            u16::try_from(x).ok().filter(|x| (1..=infinite(bits_of_each)).contains(x))
        }
    };
    (0..len).map(number).collect()
}

fn raise(to: &mut [u16], from: impl Iterator<Item = u16>) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = from.max(*to));
}

/// Zero is none.
fn lower(to: &mut [u16], from: impl Iterator<Item = u16>) {
    let known = to.iter_mut().zip(from).filter(|(_, from)| *from > 0);
    known.for_each(|(to, from)| *to = if *to == 0 { from } else { from.min(*to) });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_numbers_are_on_their_side_and_near() {
        for x in [0.0, 1e-45, 1e-38, 0.1, 1.0, 1.0001, 1.99, 7.3, 1e30, f32::MAX, f32::INFINITY] {
            let (down, up) = (value(below(x, SCATTERED), SCATTERED), value(above(x, ONE_MORE), ONE_MORE));
            let x = f64::from(x);
            assert!(down <= x && up >= x, "{down} {x} {up}");
            let is_ordinary = (1e-37..1e38).contains(&x);
            assert!(!is_ordinary || (down > 0.88 * x && up < 1.26 * x), "{down} {x} {up}");
        }
        assert_eq!((below(f32::NAN, SCATTERED), above(-1.0, ONE_MORE)), (0, 0));
    }

    #[test]
    fn what_a_file_holds_comes_back() {
        let all = [0.0, 1e-45, 1e-38, 0.25, 1.0, 1e30, f32::MAX, f32::INFINITY];
        for lengths in [&all[..], &all[3..5], &[0.0; 3], &[0.0, 3.0], &[7.0; 4]] {
            let mut row = Peaks::new(lengths.len());
            row.meet_scattered(lengths);
            row.meet_one_more(lengths);
            let mut bytes = Vec::new();
            let mut bits = BitWriter::new(&mut bytes);
            row.write(&mut bits);
            bits.finish();
            assert!(bytes.len() <= Peaks::longest(lengths.len()));
            let mut back = Peaks::new(lengths.len());
            let mut bits = BitReader::new(&bytes);
            assert_eq!(back.join_written(&mut bits), Some(()));
            assert!(back == row && bits.finish() == Some(&[]), "{lengths:?}");
        }
        // A number beyond infinity, and one that is there though it is zero.
        for (lowest, above, fraction) in [(255, 1, 1), (255, 2, 0), (0, 1, 0)] {
            let mut bytes = Vec::new();
            let mut bits = BitWriter::new(&mut bytes);
            bits.put(lowest, EXPONENT);
            bits.put(2, WIDTH);
            bits.put(above, 2);
            bits.put(fraction, SCATTERED - EXPONENT);
            bits.finish();
            assert_eq!(read(1, SCATTERED, &mut BitReader::new(&bytes)), None, "{lowest} {above} {fraction}");
        }
    }
}
