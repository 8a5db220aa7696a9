//! A picture with less noise: each pixel is averaged with neighbours that its error bar cannot tell from it.
//!
//! A joint bilateral filter by statistical tests, after Sakai et al. 2024 (*A Statistical Approach to Monte Carlo Denoising*) and
//! Rousselle, Knaus & Zwicker 2012 (*Adaptive rendering with non-local means filtering*). Radiance is divided by albedo, so that textures
//! stay sharp. A neighbour counts where albedo and normal agree, the errors of both are alike, and the patches of 3×3 pixels around both
//! differ by no more than these errors explain. That test holds however noise is spread over the picture: disks of photons, which neighbours share, make
//! near pixels alike, and those far away as different as their errors say. So the neighbours reach farther than a disk, and those that
//! share photons are spread thinner. As errors vanish so does all that the filter does.

mod bands;
mod planes;
mod taps;
#[cfg(test)]
mod tests;

use super::{Film, Header, Layer};
use glam::Vec3;
use planes::Planes;

/// What the filter looks at beside the picture and its error.
pub const FEATURES: [Layer; 2] = [Layer::DenoisingAlbedo, Layer::DenoisingNormal];
/// Passes from which their spread tells an error.
pub const FEWEST_PASSES: u32 = 3;
/// The name of the layer, and of the fact that tells how it was made.
pub const DENOISED: &str = "denoised";
/// How.
const METHOD: &str = "joint bilateral filter by tests of the error, albedo divided out";
/// That it was not.
const NOTHING: &str = "nothing: too few passes";

/// The radius in which neighbours are looked for, in heights of the picture: about twice the first disk of photons, which shrinks.
const RADIUS: f32 = 1.0 / 16.0;
/// In pixels, however small the picture is.
const LEAST_RADIUS: f32 = 4.0;

/// A picture, and what is known of it; each plane has `width · height` values, row-major from top left.
#[derive(Clone, Copy, Debug)]
pub struct Noisy<'a> {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear RGB radiance, a mean over passes.
    pub picture: &'a [Vec3],
    /// Its standard error, in its unit.
    pub error: &'a [Vec3],
    /// As [`Layer::DenoisingAlbedo`].
    pub albedo: &'a [Vec3],
    /// As [`Layer::DenoisingNormal`].
    pub normal: &'a [Vec3],
}

/// The picture with less noise, in its unit. Pixels of which a number is not finite stay as they are, and no other is averaged with them.
/// The same on any number of threads.
///
/// # Panics
/// When a plane has another size: that is a bug of the caller.
pub fn denoise(noisy: &Noisy<'_>) -> Vec<Vec3> {
    let pixels = noisy.width as usize * noisy.height as usize;
    let planes = [noisy.picture, noisy.error, noisy.albedo, noisy.normal];
    assert!(planes.iter().all(|plane| plane.len() == pixels), "a plane of another size");
    let planes = Planes::of(noisy);
    let taps = taps::taps((RADIUS * noisy.height as f32).max(LEAST_RADIUS));
    let changes = bands::changes(&planes, &taps);
    let changed = |(i, change): (usize, Vec3)| match planes.usable[i] {
        0.0 => noisy.picture[i],
        _ => noisy.picture[i] + planes.radiance(i, change),
    };
    changes.into_iter().enumerate().map(changed).collect()
}

/// What [`Film::denoised`] holds in memory while it is made, in bytes: the planes of the film, those of the filter, and sums of it.
pub fn bytes(width: u32, height: u32) -> usize {
    let pixel = 4 * size_of::<Vec3>() + 11 * size_of::<f32>() + 3 * size_of::<Vec3>();
    width as usize * height as usize * pixel
}

impl Film {
    /// The mean of `Visible` with less noise. None below [`FEWEST_PASSES`], where nothing is known of its error.
    ///
    /// # Panics
    /// When the film does not have the layers [`FEATURES`].
    pub fn denoised(&self) -> Option<Vec<Vec3>> {
        if self.passes() < FEWEST_PASSES {
            return None;
        }
        let [picture, albedo, normal] =
            [Layer::Visible, FEATURES[0], FEATURES[1]].map(|layer| self.mean(layer));
        let error = self.standard_error();
        let (width, height) = (self.width(), self.height());
        Some(denoise(&Noisy {
            width,
            height,
            picture: &picture,
            error: &error,
            albedo: &albedo,
            normal: &normal,
        }))
    }

    /// What files hold as the layer [`DENOISED`]: the picture itself where there are too few passes. `header` is told which.
    ///
    /// # Panics
    /// When the film does not have the layers [`FEATURES`].
    pub fn denoised_layer(&self, header: &mut Header) -> Vec<Vec3> {
        let denoised = self.denoised();
        header.set(DENOISED, if denoised.is_some() { METHOD } else { NOTHING });
        denoised.unwrap_or_else(|| self.mean(Layer::Visible))
    }
}
