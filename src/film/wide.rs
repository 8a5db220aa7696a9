//! A sum that holds any number a film meets, bit for bit: for pixels whose values are too far apart for less.

use super::exact::{BITS, Pair};

/// 32 bits each.
const DIGITS: usize = 28;
/// The place of the lowest bit is 2 to this: squares of averages of the smallest numbers lie above it.
const LOWEST: i32 = -576;
/// No bit of what is added may stand at 2 to this or above: 2³² squares of the largest number are below it.
pub const HIGHEST: i32 = LOWEST + 32 * DIGITS as i32 - 32;

/// A fixed-point number in two's complement, its lowest digit first; but for the last, digits are 0 … 2³² − 1.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wide([i64; DIGITS]);

/// Whether `bits` bits from 2 to the `exponent` on fit.
pub fn holds(exponent: i32, bits: usize) -> bool {
    exponent >= LOWEST && i64::from(exponent) + bits as i64 <= HIGHEST.into()
}

impl Wide {
    /// Adds whole · 2^exponent, which it must [hold](holds).
    pub fn add(&mut self, whole: i128, exponent: i32) {
        let place = (exponent - LOWEST) as u32;
        let (first, shift) = ((place / 32) as usize, place % 32);
        let (sign, magnitude) = (whole.signum() as i64, whole.unsigned_abs());
        for k in 0..4 {
            let piece = u64::from((magnitude >> (32 * k)) as u32) << shift;
            if piece != 0 {
                self.0[first + k] += sign * i64::from(piece as u32);
                self.0[first + k + 1] += sign * (piece >> 32) as i64;
            }
        }
        self.carry();
    }

    /// Adds all of another one.
    pub fn add_all(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(to, from)| *to += from);
        self.carry();
    }

    fn carry(&mut self) {
        let mut over = 0;
        let (last, digits) = self.0.split_last_mut().expect("digits");
        for digit in digits {
            *digit += over;
            over = *digit >> 32;
            *digit &= 0xffff_ffff;
        }
        *last += over;
    }

    /// Whether it is below zero, and its magnitude, lowest digit first.
    fn magnitude(&self) -> (bool, [u32; DIGITS]) {
        let negative = self.0[DIGITS - 1] < 0;
        let mut positive = self.clone();
        if negative {
            positive.0.iter_mut().for_each(|digit| *digit = -*digit);
            positive.carry();
        }
        (negative, positive.0.map(|digit| digit as u32))
    }

    /// Whether it is below zero, its magnitude as bytes, lowest first, and the exponent of the first bit of them.
    pub fn bytes(&self) -> (bool, Vec<u8>, i32) {
        let (negative, digits) = self.magnitude();
        (negative, digits.iter().flat_map(|digit| digit.to_le_bytes()).collect(), LOWEST)
    }

    /// As two numbers: the nearest one, and the nearest to what is left.
    pub fn pair(&self) -> Pair {
        let (negative, digits) = self.magnitude();
        let Some(top) = digits.iter().rposition(|digit| *digit != 0) else { return Pair::default() };
        // So many bits as the narrow sums have, so that both round alike; of those below it matters only whether there are any.
        let bits = 32 * top as u32 + 32 - digits[top].leading_zeros();
        let drop = bits.saturating_sub(BITS);
        let (low, shift) = ((drop / 32) as usize, drop % 32);
        let digit = |k: usize| u128::from(digits.get(low + k).copied().unwrap_or(0));
        let taken = (1..=4).fold(digit(0) >> shift, |taken, k| {
            taken | digit(k).checked_shl(32 * k as u32 - shift).unwrap_or(0)
        });
        let below = digits[..low].iter().any(|digit| *digit != 0) || digit(0) & ((1 << shift) - 1) != 0;
        let kept = (taken | u128::from(below)) as i128;
        Pair::of(if negative { -kept } else { kept }, LOWEST + drop as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_away_again_leaves_no_trace() {
        let numbers = [(1, -298), (-7, 250), (i128::from(u64::MAX), 100), (3, -576), (-(1 << 100), -31)];
        let mut sum = Wide::default();
        numbers.iter().for_each(|(whole, exponent)| sum.add(*whole, *exponent));
        let mut other = Wide::default();
        numbers.iter().rev().for_each(|(whole, exponent)| other.add(*whole, *exponent));
        assert_eq!(sum, other);
        let mut twice = sum.clone();
        twice.add_all(&other);
        numbers.iter().chain(&numbers).for_each(|(whole, exponent)| twice.add(-whole, *exponent));
        assert_eq!(twice, Wide::default());
    }

    #[test]
    fn its_two_numbers_are_the_nearest_ones() {
        for (whole, exponent) in
            [(5_i128, 7), (-5, -100), ((1 << 53) + 1, 0), ((1 << 100) + 1, -32), (-(3 << 90) - 1, 9)]
        {
            let mut wide = Wide::default();
            wide.add(whole, exponent);
            assert_eq!(wide.pair(), Pair::of(whole, exponent), "{whole} {exponent}");
        }
        // Halfway but for a bit far below.
        let mut wide = Wide::default();
        wide.add((1 << 53) + 1, 200);
        assert_eq!(wide.pair().high, 2.0_f64.powi(253));
        wide.add(1, -500);
        assert_eq!(wide.pair().high, 2.0_f64.powi(253) + 2.0_f64.powi(201));
    }
}
