//! Maxima over passes of every pixel, to three digits, which is as much as tests of an error bar need.

use half::bf16;
use half::slice::HalfFloatSliceExt;

/// One row of the picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Peaks {
    /// The length of the brightest `Visible`.
    brightest: Vec<bf16>,
    /// Of [`one_more`](super::PassImage::one_more).
    one_more: Vec<bf16>,
}

impl Peaks {
    /// Bytes of a pixel.
    pub const BYTES: usize = 2 * size_of::<bf16>();

    /// Of so many pixels, all zero.
    pub fn new(len: usize) -> Self {
        Self { brightest: vec![bf16::ZERO; len], one_more: vec![bf16::ZERO; len] }
    }

    /// Of a pixel's brightest pass.
    pub fn brightest(&self, i: usize) -> f64 {
        self.brightest[i].to_f64()
    }

    /// Of a pixel, the most that one photon more would have added in any pass.
    pub fn one_more(&self, i: usize) -> f64 {
        self.one_more[i].to_f64()
    }

    /// Takes in the brightness of a pixel in a pass.
    pub fn meet(&mut self, i: usize, brightness: f32) {
        raise(&mut self.brightest[i], bf16::from_f32(brightness));
    }

    /// Takes in what one photon more would have added, pixel by pixel.
    pub fn meet_one_more(&mut self, one_more: &[f32]) {
        self.one_more.iter_mut().zip(one_more).for_each(|(to, from)| raise(to, bf16::from_f32(*from)));
    }

    /// Takes in those of other passes.
    pub fn join(&mut self, other: &Self) {
        let raise_all = |to: &mut [bf16], from: &[bf16]| {
            to.iter_mut().zip(from).for_each(|(to, from)| raise(to, *from));
        };
        raise_all(&mut self.brightest, &other.brightest);
        raise_all(&mut self.one_more, &other.one_more);
    }

    /// As a file holds them: 16 bits each, those of [`brightest`](Self::brightest) first.
    pub fn bits(&self) -> impl Iterator<Item = u16> + '_ {
        let all = self.brightest.reinterpret_cast().iter().chain(self.one_more.reinterpret_cast());
        all.copied()
    }

    /// Takes in those that a file holds, of as many pixels. False: one is no maximum of what is not below zero.
    pub fn join_bits(&mut self, bits: &[u16]) -> bool {
        let to = self.brightest.iter_mut().chain(&mut self.one_more);
        to.zip(bits).all(|(to, bits)| {
            let from = bf16::from_bits(*bits);
            raise(to, from);
            !from.is_nan() && !from.is_sign_negative()
        })
    }
}

/// What is no number is passed over: the sums keep it.
fn raise(to: &mut bf16, from: bf16) {
    if from > *to {
        *to = from;
    }
}
