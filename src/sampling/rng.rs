use rand_core::Rng as _;
use rand_pcg::Pcg32;

/// Which consumer a random number belongs to; consumers never share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Photon paths.
    Shoot = 1,
    /// Camera paths of the final gather.
    Gather = 2,
    /// The gathering tracer.
    Path = 3,
    /// Measurements made before rendering (pilots, multiplication factor).
    Measure = 4,
    /// Tests.
    Test = 5,
    /// Camera paths through pixels that deserve several.
    Again = 6,
}

/// A generator for one path of one pass: equal arguments give equal numbers on every machine and thread.
#[derive(Clone, Debug)]
pub struct Rng(Pcg32);

impl Rng {
    /// The generator of `path` in `pass`.
    pub fn new(seed: u64, stream: Stream, pass: u32, path: u64) -> Self {
        let key = hash(hash(hash(seed) ^ stream as u64) ^ u64::from(pass));
        Self(Pcg32::new(hash(key ^ path), hash(key.rotate_left(32) ^ !path)))
    }

    /// Uniform in [0, 1), 24 bits.
    pub fn f32(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Two of them.
    pub fn f32x2(&mut self) -> [f32; 2] {
        [self.f32(), self.f32()]
    }

    /// Three of them.
    pub fn f32x3(&mut self) -> [f32; 3] {
        [self.f32(), self.f32(), self.f32()]
    }

    /// 64 random bits.
    pub fn u64(&mut self) -> u64 {
        u64::from(self.u32()) << 32 | u64::from(self.u32())
    }

    /// 32 random bits.
    pub fn u32(&mut self) -> u32 {
        self.0.next_u32()
    }
}

/// A bijective 64-bit mix: the finaliser of `SplitMix64` (Steele, Lea, Flood 2014).
pub fn hash(x: u64) -> u64 {
    let x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_depend_on_each_index_and_on_nothing_else() {
        let first = |seed, stream, pass, path| Rng::new(seed, stream, pass, path).u32();
        let a = first(1, Stream::Shoot, 2, 3);
        assert_eq!(a, first(1, Stream::Shoot, 2, 3));
        for other in [
            first(2, Stream::Shoot, 2, 3),
            first(1, Stream::Gather, 2, 3),
            first(1, Stream::Shoot, 3, 3),
            first(1, Stream::Shoot, 2, 4),
        ] {
            assert_ne!(a, other);
        }
    }

    #[test]
    fn neighbouring_paths_are_uncorrelated() {
        let n = 40_000;
        let draw = |path| f64::from(Rng::new(0, Stream::Test, 0, path).f32()) - 0.5;
        let covariance: f64 = (0..n).map(|i| draw(i) * draw(i + 1)).sum::<f64>() / n as f64;
        let sigma = (1.0 / 12.0) / (n as f64).sqrt();
        assert!(covariance.abs() < 3.5 * sigma, "covariance {covariance}, sigma {sigma}");
    }
}
