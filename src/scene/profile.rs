//! How a lamp without extent shines in each direction, as it was measured.

use super::lm63::{self, Photometry};
use super::web::Web;
use glam::{Mat3, Vec3};
use std::sync::Arc;

/// Intensity by direction, of a lamp that hangs somewhere: what a [`Luminaire::Profile`](super::Luminaire::Profile) refers to.
#[derive(Clone, Debug)]
pub struct Profile {
    web: Arc<Web>,
    /// Where the web's turn begins, where it is 90°, and its pole: in the scene's space.
    axes: Mat3,
}

impl Profile {
    /// Of the bytes of an IES file (LM-63 of 1986 to 2019, photometry of types B and C), of a lamp that shines along −z; its
    /// vertical angles go to x, and the horizontal ones of type C go on from there to y. Err: what is wrong with the file.
    pub fn parse(ies: &[u8]) -> Result<Self, String> {
        lm63::parse(ies).map(|Photometry { web, axes }| Self { web: Arc::new(web), axes })
    }

    /// The same after a turn, or a mirror: axes of length 1, square to each other.
    #[must_use]
    pub fn turned(&self, by: Mat3) -> Self {
        Self { axes: by * self.axes, web: Arc::clone(&self.web) }
    }

    /// The mean of its intensity over all directions, in the unit of its file, cd.
    pub fn mean_intensity(&self) -> f64 {
        self.web.mean()
    }

    /// Intensity in the direction of the unit vector `out`, over the mean of all directions.
    pub fn at(&self, out: Vec3) -> f32 {
        self.web.at(self.local(out)) as f32
    }

    /// A direction, and its density (sr⁻¹), from numbers in [0, 1): about in proportion to intensity.
    pub fn sample(&self, numbers: [f32; 2]) -> (Vec3, f32) {
        let local = self.web.sample(numbers);
        let out = self.axes * Vec3::from_array(local.map(|x| x as f32));
        (out.normalize(), self.web.density(local) as f32)
    }

    /// The numbers that [`sample`](Self::sample) makes a direction of. None: it never does.
    pub fn numbers(&self, out: Vec3) -> Option<[f32; 2]> {
        self.web.numbers(self.local(out))
    }

    /// What its table takes in memory.
    pub fn bytes(&self) -> usize {
        self.web.bytes()
    }

    /// Everything that decides what shines: for a hash.
    pub(crate) fn parts(&self) -> (u64, Mat3) {
        (self.web.digest(), self.axes)
    }

    /// True for axes that can be.
    pub(super) fn is_upright(&self) -> bool {
        let off = self.axes.transpose() * self.axes - Mat3::IDENTITY;
        off.to_cols_array().iter().all(|x| x.abs() < 1e-4)
    }

    fn local(&self, out: Vec3) -> [f64; 3] {
        (self.axes.transpose() * out).to_array().map(f64::from)
    }
}
