use crate::sampling::{Rng, SOBOL_DIMENSIONS, Sobol, Stream};

/// The random numbers of one camera sample: stratified against the other samples of its pixel and pass while the
/// Sobol dimensions last (camera, first reflection), independent afterwards.
pub(super) struct Numbers<'a> {
    sobol: &'a Sobol,
    sample: u32,
    dimension: usize,
    rng: Rng,
}

/// The samples of one pixel in one pass.
pub(super) struct Samples {
    seed: u64,
    pass: u32,
    path: u64,
    count: u32,
    sobol: Sobol,
}

impl Samples {
    /// `count` samples of `pixel` in `pass`; other pixels and passes have nothing to do with them.
    pub fn of_pixel(seed: u64, pass: u32, pixel: u32, count: u32) -> Self {
        // Path 0 of the pixel scrambles its net, paths 1…count are its samples.
        let path = u64::from(pixel) << 32;
        let mut rng = Rng::new(seed, Stream::Path, pass, path);
        let key = rng.u64();
        Self { seed, pass, path, count, sobol: Sobol::new(key) }
    }

    /// The numbers of each sample.
    pub fn iter(&self) -> impl Iterator<Item = Numbers<'_>> {
        (0..self.count).map(|sample| Numbers {
            sobol: &self.sobol,
            sample,
            dimension: 0,
            rng: Rng::new(self.seed, Stream::Path, self.pass, self.path + 1 + u64::from(sample)),
        })
    }
}

impl Numbers<'_> {
    /// N numbers in [0, 1) that are stratified together.
    pub fn next<const N: usize>(&mut self) -> [f32; N] {
        let first = self.dimension;
        self.dimension += N;
        if self.dimension <= SOBOL_DIMENSIONS {
            self.sobol.point(self.sample, first)
        } else {
            std::array::from_fn(|_| self.rng.f32())
        }
    }

    /// One number in [0, 1).
    pub fn one(&mut self) -> f32 {
        let [u] = self.next();
        u
    }

    /// One number in [0, 1) of 53 bits: 24 would never choose one of a million small luminaires fairly.
    pub fn fine(&mut self) -> f64 {
        let coarse = f64::from(self.one());
        coarse + f64::from(self.rng.u32() >> 3) * (1.0 / (1_u64 << 53) as f64)
    }
}
