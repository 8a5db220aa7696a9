//! How a lamp without extent shines in each direction, as it was measured.

use super::lm63::{self, Photometry};
use super::web::Web;
use crate::error::Error;
use glam::{DMat3, Mat3, Vec3};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// Intensity by direction, of a lamp that hangs somewhere: what a [`Luminaire::Profile`](super::Luminaire::Profile) refers to.
#[derive(Clone, Debug)]
pub struct Profile {
    web: Arc<Web>,
    /// Where the web's turn begins, where it is 90°, and its pole: in the scene's space.
    axes: Mat3,
}

impl Profile {
    /// Bytes that a file may have: a million numbers.
    pub const MOST_BYTES: u64 = 1 << 24;

    /// Of an IES file, as [`parse`](Self::parse) reads it.
    ///
    /// # Errors
    /// It cannot be read, is larger than [`MOST_BYTES`](Self::MOST_BYTES), or is no such file.
    pub fn read(path: &Path) -> crate::error::Result<Self> {
        let unread = |source| Error::Read { path: path.into(), source };
        let wrong = |reason: &str| Error::Image { path: path.into(), reason: reason.into() };
        // Asked before it is opened: a pipe would wait for somebody to write.
        let there = path.metadata().map_err(unread)?;
        if !there.is_file() {
            return Err(wrong("is no file (a folder, a pipe or a device); name an IES file"));
        }
        let mut bytes = Vec::new();
        File::open(path)
            .and_then(|file| file.take(Self::MOST_BYTES + 1).read_to_end(&mut bytes))
            .map_err(unread)?;
        if bytes.len() as u64 > Self::MOST_BYTES {
            return Err(wrong("is longer than 16 MB, so it is no IES file; download it again"));
        }
        Self::parse(&bytes).map_err(|reason| wrong(&reason))
    }

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

    /// The same, hung so that what shone along −z shines along `direction`, and +y stands as near to `up` as can be. None: they are
    /// parallel, or one of them leads nowhere.
    pub fn aimed(&self, direction: Vec3, up: Vec3) -> Option<Self> {
        let back = -direction.as_dvec3().try_normalize()?;
        let right = up.as_dvec3().cross(back).try_normalize()?;
        Some(self.turned(DMat3::from_cols(right, back.cross(right), back).as_mat3()))
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
