//! Sums of single-precision numbers, and of their squares, without any rounding: it does not matter in which order, nor in how
//! many parts, they are added.
//!
//! A sum is a whole number and the power of two that it counts. Where the numbers of one sum are so far apart that its whole
//! number has no room for them (beyond a factor of a hundred million or so) it becomes a [`Wide`] one.

use super::wide::{self, Wide};
use std::collections::BTreeMap;

/// Whole numbers that sums are kept in.
pub trait Whole: Copy + Default + PartialEq + Send + Sync {
    /// None: it does not fit.
    fn of(wide: i128) -> Option<Self>;
    /// As the widest of them.
    fn widest(self) -> i128;
    /// Their sum. None: it does not fit.
    fn plus(self, other: Self) -> Option<Self>;
    /// Times 2^by. None: it does not fit.
    fn times_two_to(self, by: u32) -> Option<Self>;
}

/// Magnitudes are below 2 to this, also in the widest whole numbers.
pub const BITS: u32 = 126;

impl Whole for i64 {
    fn of(wide: i128) -> Option<Self> {
        wide.try_into().ok()
    }

    fn widest(self) -> i128 {
        self.into()
    }

    fn plus(self, other: Self) -> Option<Self> {
        self.checked_add(other)
    }

    fn times_two_to(self, by: u32) -> Option<Self> {
        let shifted = self.checked_shl(by)?;
        (shifted >> by == self).then_some(shifted)
    }
}

impl Whole for i128 {
    fn of(wide: i128) -> Option<Self> {
        (wide.unsigned_abs() >> BITS == 0).then_some(wide)
    }

    fn widest(self) -> i128 {
        self
    }

    fn plus(self, other: Self) -> Option<Self> {
        self.checked_add(other).and_then(Self::of)
    }

    fn times_two_to(self, by: u32) -> Option<Self> {
        let shifted = self.checked_shl(by)?;
        (shifted >> by == self).then_some(shifted)
    }
}

/// A number in double-double precision.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pair {
    /// The nearest double.
    pub high: f64,
    /// The nearest to the rest.
    pub low: f64,
}

impl Pair {
    /// whole · 2^exponent.
    pub fn of(whole: i128, exponent: i32) -> Self {
        let high = whole as f64;
        let low = (whole - high as i128) as f64;
        let scale = two_to(exponent);
        Self { high: high * scale, low: low * scale }
    }
}

/// 2^exponent, a normal number.
fn two_to(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// What is stored for an exponent is larger by this: all that are lower mean something else.
const SHIFT: i16 = 1024;
/// Nothing was added yet but zeros.
const NOTHING: i16 = 0;
/// The sum is among the wide ones.
const WIDE: i16 = 1;
/// The sum is no finite number.
const INFINITE: i16 = 2;
const MINUS_INFINITE: i16 = 3;
const NOT_A_NUMBER: i16 = 4;

/// A value that was added, or a sum.
#[derive(Clone, Debug, PartialEq)]
pub enum Number {
    /// As much as nothing.
    Zero,
    /// Magnitude, lowest byte first, times 2^exponent. The first bit of the first byte and the last byte are not zero, so that
    /// equal numbers look alike.
    Finite {
        /// Below zero.
        negative: bool,
        /// Of the first bit of the magnitude.
        exponent: i32,
        /// At least a byte.
        magnitude: Vec<u8>,
    },
    /// f32::INFINITY
    Infinite,
    /// f32::NEG_INFINITY
    MinusInfinite,
    /// f32::NAN
    Nan,
}

impl Number {
    /// Whether it is in reach of sums.
    pub fn is_held(&self) -> bool {
        match self {
            Self::Finite { exponent, magnitude, .. } => wide::holds(*exponent, 8 * magnitude.len()),
            _ => true,
        }
    }

    /// Without zeros at either end.
    fn tidy(negative: bool, magnitude: &[u8], exponent: i32) -> Self {
        let Some(first) = magnitude.iter().position(|byte| *byte != 0) else { return Self::Zero };
        let last = magnitude.iter().rposition(|byte| *byte != 0).unwrap_or(first);
        let zeros = magnitude[first].trailing_zeros();
        let kept = &magnitude[first..=last];
        let next = |k: usize| u16::from(kept.get(k + 1).copied().unwrap_or(0));
        let shifted = |(k, byte): (usize, &u8)| ((u16::from(*byte) | (next(k) << 8)) >> zeros) as u8;
        let mut magnitude: Vec<u8> = kept.iter().enumerate().map(shifted).collect();
        if magnitude.last() == Some(&0) {
            magnitude.pop();
        }
        Self::Finite { negative, exponent: exponent + 8 * first as i32 + zeros as i32, magnitude }
    }
}

/// Sums, some of them side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct Row<W> {
    whole: Vec<W>,
    exponents: Vec<i16>,
    wide: BTreeMap<usize, Box<Wide>>,
}

impl<W: Whole> Row<W> {
    /// So many sums of nothing.
    pub fn new(len: usize) -> Self {
        Self { whole: vec![W::default(); len], exponents: vec![NOTHING; len], wide: BTreeMap::new() }
    }

    /// Bytes of a sum, unless it is a wide one.
    pub const BYTES: usize = size_of::<W>() + size_of::<i16>();

    /// How many sums.
    pub fn len(&self) -> usize {
        self.whole.len()
    }

    /// Adds whole · 2^exponent to one of the sums.
    #[inline]
    pub fn add(&mut self, i: usize, whole: W, exponent: i32) {
        if whole == W::default() {
            return;
        }
        let (at, exponent) = (self.exponents[i], exponent as i16 + SHIFT);
        if at > NOT_A_NUMBER {
            match combined(self.whole[i], at, whole, exponent) {
                Some((sum, exponent)) => (self.whole[i], self.exponents[i]) = (sum, exponent),
                None => self.widened(i).add(whole.widest(), (exponent - SHIFT).into()),
            }
        } else if at == NOTHING {
            (self.whole[i], self.exponents[i]) = (whole, exponent);
        } else if at == WIDE {
            self.widened(i).add(whole.widest(), (exponent - SHIFT).into());
        }
    }

    /// The sum as a wide one, which it is from now on.
    #[cold]
    fn widened(&mut self, i: usize) -> &mut Wide {
        let (whole, at) =
            (std::mem::take(&mut self.whole[i]), std::mem::replace(&mut self.exponents[i], WIDE));
        let wide = self.wide.entry(i).or_default();
        if at > NOT_A_NUMBER {
            wide.add(whole.widest(), (at - SHIFT).into());
        }
        wide
    }

    /// Adds what is no finite number.
    #[cold]
    fn add_special(&mut self, i: usize, special: i16) {
        self.wide.remove(&i);
        self.whole[i] = W::default();
        let at = &mut self.exponents[i];
        let contradicts = (INFINITE..=NOT_A_NUMBER).contains(at) && *at != special;
        *at = if contradicts { NOT_A_NUMBER } else { special };
    }

    /// Adds a number that [is held](Number::is_held).
    pub fn add_number(&mut self, i: usize, number: &Number) {
        match number {
            Number::Zero => {}
            Number::Finite { negative, exponent, magnitude } => {
                for (k, bytes) in magnitude.chunks(4).enumerate() {
                    let piece = bytes.iter().rev().fold(0, |piece, byte| (piece << 8) | i128::from(*byte));
                    let piece = W::of(if *negative { -piece } else { piece }).expect("32 bits fit");
                    self.add(i, piece, exponent + 32 * k as i32);
                }
            }
            Number::Infinite => self.add_special(i, INFINITE),
            Number::MinusInfinite => self.add_special(i, MINUS_INFINITE),
            Number::Nan => self.add_special(i, NOT_A_NUMBER),
        }
    }

    /// Adds all sums of another row of as many.
    pub fn add_row(&mut self, other: &Self) {
        for (i, at) in other.exponents.iter().enumerate() {
            match *at {
                NOTHING => {}
                WIDE => self.widened_but_special(i, &other.wide[&i]),
                INFINITE..=NOT_A_NUMBER => self.add_special(i, *at),
                _ => self.add(i, other.whole[i], (at - SHIFT).into()),
            }
        }
    }

    fn widened_but_special(&mut self, i: usize, more: &Wide) {
        if !(INFINITE..=NOT_A_NUMBER).contains(&self.exponents[i]) {
            self.widened(i).add_all(more);
        }
    }

    /// One of the sums.
    pub fn number(&self, i: usize) -> Number {
        match self.exponents[i] {
            NOTHING => Number::Zero,
            INFINITE => Number::Infinite,
            MINUS_INFINITE => Number::MinusInfinite,
            NOT_A_NUMBER => Number::Nan,
            WIDE => {
                let (negative, bytes, exponent) = self.wide[&i].bytes();
                Number::tidy(negative, &bytes, exponent)
            }
            at => {
                let whole = self.whole[i].widest();
                Number::tidy(whole < 0, &whole.unsigned_abs().to_le_bytes(), (at - SHIFT).into())
            }
        }
    }

    /// One of the sums, to more than a hundred bits.
    pub fn pair(&self, i: usize) -> Pair {
        match self.exponents[i] {
            NOTHING => Pair::default(),
            INFINITE => Pair { high: f64::INFINITY, low: 0.0 },
            MINUS_INFINITE => Pair { high: f64::NEG_INFINITY, low: 0.0 },
            NOT_A_NUMBER => Pair { high: f64::NAN, low: 0.0 },
            WIDE => self.wide[&i].pair(),
            at => Pair::of(self.whole[i].widest(), (at - SHIFT).into()),
        }
    }

    /// One of the sums: the nearest double.
    pub fn value(&self, i: usize) -> f64 {
        match self.exponents[i] {
            at if at > NOT_A_NUMBER => self.whole[i].widest() as f64 * two_to((at - SHIFT).into()),
            _ => self.pair(i).high,
        }
    }
}

/// The sum of two numbers with the exponents of both. None: it has no room.
#[inline]
fn combined<W: Whole>(a: W, at: i16, b: W, exponent: i16) -> Option<(W, i16)> {
    if exponent >= at {
        Some((b.times_two_to((exponent - at) as u32)?.plus(a)?, at))
    } else {
        Some((a.times_two_to((at - exponent) as u32)?.plus(b)?, exponent))
    }
}

/// A number as whole · 2^exponent. None: it is not finite.
#[inline]
fn parts(x: f32) -> Option<(i64, i32)> {
    let bits = x.to_bits();
    let (exponent, fraction) = ((bits >> 23 & 0xff) as i32, i64::from(bits & 0x7f_ffff));
    let (whole, exponent) = match exponent {
        0xff => return None,
        0 => (fraction, -149),
        _ => (fraction | 1 << 23, exponent - 150),
    };
    Some((if x.is_sign_negative() { -whole } else { whole }, exponent))
}

/// What a number that is not finite is called in a row.
fn special(x: f64) -> i16 {
    match x {
        f64::INFINITY => INFINITE,
        f64::NEG_INFINITY => MINUS_INFINITE,
        _ => NOT_A_NUMBER,
    }
}

impl Row<i64> {
    /// Of each sum here and there together, the nearest double: the halves of one sum make the same numbers as the whole.
    pub fn value_of_both(&self, other: &Self) -> Vec<f64> {
        let mut both = self.clone();
        both.add_row(other);
        (0..both.len()).map(|i| both.value(i)).collect()
    }

    /// Adds a number to one of the sums.
    #[inline]
    pub fn add_f32(&mut self, i: usize, x: f32) {
        match parts(x) {
            Some((whole, exponent)) => self.add(i, whole, exponent),
            None => self.add_special(i, special(x.into())),
        }
    }
}

impl Row<i128> {
    /// Adds the square of a number to one of the sums.
    #[inline]
    pub fn add_square_of_f32(&mut self, i: usize, x: f32) {
        match parts(x) {
            Some((whole, exponent)) => self.add(i, i128::from(whole * whole), 2 * exponent),
            None => self.add_special(i, special(f64::from(x * x))),
        }
    }

    /// Adds an average of single-precision numbers to one of the sums, or the square of it.
    pub fn add_average(&mut self, i: usize, x: f64, squared: bool) {
        if !x.is_finite() {
            return self.add_special(i, special(if squared { x * x } else { x }));
        }
        if x == 0.0 {
            return;
        }
        // No average of fewer than 2⁶⁴ such numbers is below the normal ones.
        let (exponent, fraction) = ((x.to_bits() >> 52 & 0x7ff) as i32, x.to_bits() & ((1 << 52) - 1));
        let whole = i128::from(fraction | 1 << 52);
        match squared {
            true => self.add(i, whole * whole, 2 * (exponent - 1075)),
            false => self.add(i, if x < 0.0 { -whole } else { whole }, exponent - 1075),
        }
    }
}

/// Σ (x − mean)² of n numbers, from their sum and the sum of their squares. Exact to double precision, unless 2²⁹ or more are added.
///
/// n Σx² − (Σx)² is the sum of (xᵢ − xⱼ)² over all pairs. Single-precision numbers are equal or 2⁻²⁴ apart, so that it is no less
/// than 2⁻⁴⁸ n⁻² of either term: pairs of doubles have room for that.
pub fn spread(sum: Pair, squares: Pair, n: f64) -> f64 {
    if !squares.high.is_finite() {
        return squares.high;
    }
    let (a, b) = (n * squares.high, sum.high * sum.high);
    // So many digits are left that single precision sees no difference.
    if a - b > ENOUGH_LEFT * a {
        return (a - b) / n;
    }
    let (a, a_rest) = product(n, squares.high);
    let (b, b_rest) = product(sum.high, sum.high);
    let a_rest = a_rest + n * squares.low;
    let b_rest = b_rest + (2.0 * sum.high * sum.low + sum.low * sum.low);
    ((a - b) + (a_rest - b_rest)) / n
}

/// 2⁻¹⁶
const ENOUGH_LEFT: f64 = 1.0 / 65_536.0;

/// A product and what rounding took from it: T. J. Dekker 1971, A floating-point technique for extending the available precision.
fn product(x: f64, y: f64) -> (f64, f64) {
    let ((x1, x2), (y1, y2)) = (split(x), split(y));
    let all = x * y;
    (all, ((x1 * y1 - all) + x1 * y2 + x2 * y1) + x2 * y2)
}

/// Two halves of a number's digits.
fn split(x: f64) -> (f64, f64) {
    let scaled = 134_217_729.0 * x; // 2²⁷ + 1
    let high = scaled - (scaled - x);
    (high, x - high)
}

#[cfg(test)]
#[path = "exact_tests.rs"]
mod tests;
