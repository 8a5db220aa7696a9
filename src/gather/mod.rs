//! Camera hits + maps → image: the final gather.
//!
//! A camera ray carries rows (one for each picture that is made: the visible one, and the invisible one on request) and
//! multiplies matrices onto them from the right. It goes straight on where the row does, is passed on by delta lobes, and
//! ends at finite lobes. There direct light is connected, and all other light is read from the maps. `Walk` is that walk,
//! for whoever wants to know what it finds: a `Tally`. That of a picture adds up what pixels show; that of the atlas keeps
//! light apart by its powers of s and t.

mod again;
mod branches;
mod density;
mod direct;
mod estimate;
mod features;
mod past;
mod plain;
mod shared;
mod walk;

pub use density::{Density, NearestMaps};
pub use estimate::{ALPHA, Irradiance, Maps, Nearby, radius_factor};
pub(crate) use estimate::{Tier, is_read};
pub use features::Features;
pub(crate) use walk::{Here, Tally, Walk, reflected};

use crate::photon::PathClass;
use crate::plan::{Frame, Plan};
use crate::sampling::{Rng, Stream};
use glam::Vec3;
use plain::Plain;
use rayon::prelude::*;

/// What a pass shows in each pixel, row-major from the top left, linear RGB.
///
/// `R` pictures are made at once: the visible one, and the invisible one where asked for.
pub struct Gathered<const R: usize> {
    /// One per pixel.
    pub pixels: Vec<Pixel<R>>,
}

/// One pixel of one pass.
#[derive(Clone, Copy, Debug)]
pub struct Pixel<const R: usize> {
    /// Radiance (W m⁻² sr⁻¹) by who served it, for each picture.
    pub parts: [Parts; R],
    /// Distance along the camera ray to the first surface, m; infinity where there is none.
    pub depth: f32,
    /// Shading normal of the first surface, towards the camera.
    pub normal: Vec3,
    /// Reflectance of the first surface, lobes summed, re-radiation aside.
    pub albedo: Vec3,
    /// What is seen in mirrors and through glass.
    pub features: Features,
    /// Estimated bias of the finite gather radius in the visible picture.
    pub bias: Vec3,
    /// What one photon more of each class than came would have added to the visible picture, in the channel that it adds most to.
    pub one_more: f32,
}

/// The radiance of a pixel by class of light path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parts {
    /// Luminaires seen.
    pub emitted: Vec3,
    /// Straight from luminaires to the surface that is seen.
    pub direct: Vec3,
    /// Through delta lobes only.
    pub caustic: Vec3,
    /// Through at least one finite lobe.
    pub indirect: Vec3,
    /// The part of all of these that some surface re-radiated.
    pub fluorescent: Vec3,
}

impl Parts {
    /// Nothing is seen.
    pub(crate) const DARK: Self = Self {
        emitted: Vec3::ZERO,
        direct: Vec3::ZERO,
        caustic: Vec3::ZERO,
        indirect: Vec3::ZERO,
        fluorescent: Vec3::ZERO,
    };

    /// Adds what light of a class brings; `reradiated`: some surface re-radiated it.
    pub(crate) fn add(&mut self, class: PathClass, value: Vec3, reradiated: bool) {
        match class {
            PathClass::Direct => self.direct += value,
            PathClass::Caustic => self.caustic += value,
            PathClass::Indirect => self.indirect += value,
        }
        if reradiated {
            self.fluorescent += value;
        }
    }

    /// Adds a luminaire that is seen, or that lights a surface which a path was `scattered` by.
    pub(crate) fn add_emitted(&mut self, value: Vec3, scattered: bool, reradiated: bool) {
        if scattered {
            self.add(PathClass::Indirect, value, reradiated);
        } else {
            self.emitted += value;
        }
    }

    /// All of it.
    pub fn total(&self) -> Vec3 {
        self.emitted + self.direct + self.caustic + self.indirect
    }
}

/// Rows of a tile, and of the band of tiles that one task gathers.
pub(crate) const TILE: usize = 8;
/// Its columns.
pub(crate) const TILE_WIDTH: usize = 32;

/// Gathers one pass: one camera path through a random point of each pixel. That of a frame that was told to
/// [stop](Frame::stop) is incomplete.
pub fn gather<D: Density, const R: usize>(plan: &Plan, frame: &Frame, maps: &D, pass: u32) -> Gathered<R> {
    let width = frame.width as usize;
    let mut pixels = vec![Pixel::<R>::EMPTY; frame.pixels()];
    pixels.par_chunks_mut(width * TILE).enumerate().for_each(|(band, rows)| {
        let mut walk = Walk::new(plan, frame, Plain::new(plan, frame, maps));
        let mut tile = Vec::with_capacity(TILE * TILE_WIDTH);
        for left in (0..width).step_by(TILE_WIDTH) {
            if frame.stop.asked() {
                return;
            }
            let right = (left + TILE_WIDTH).min(width);
            tile.clear();
            for y in band * TILE..band * TILE + rows.len() / width {
                for x in left..right {
                    let rng = Rng::new(plan.settings.seed, Stream::Gather, pass, (y * width + x) as u64);
                    walk.tally.begin(tile.len());
                    tile.push(walk.pixel([x, y], rng));
                }
            }
            walk.tally.look_around(&tile, right - left);
            walk.look_again(&mut tile, [left, band * TILE], right - left, pass);
            walk.tally.connect_more(&mut tile);
            for (row, done) in rows.chunks_mut(width).zip(tile.chunks(right - left)) {
                row[left..right].copy_from_slice(done);
            }
        }
    });
    Gathered { pixels }
}

impl<const R: usize> Pixel<R> {
    /// Nothing is seen.
    pub(crate) const EMPTY: Self = Self {
        parts: [Parts::DARK; R],
        depth: f32::INFINITY,
        normal: Vec3::ZERO,
        albedo: Vec3::ZERO,
        features: Features::EMPTY,
        bias: Vec3::ZERO,
        one_more: 0.0,
    };
}
