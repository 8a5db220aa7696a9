//! How much memory a render will hold, and whether the machine has that much.

use crate::error::{Error, Result};
use crate::film::{Film, Layer, denoise};
use crate::gather::Pixel;
use crate::light::{Invisible, Light};
pub use crate::machine::MemoryLimit;
use crate::mattes::Mattes;
use crate::photon::Photon;
use crate::plan::{Frame, Method, PhotonPlan, Plan, Settings};
use glam::Vec3;

/// Bytes that a render holds; `examples/memory.rs` compares the total with what is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Triangles, vertices, normals.
    pub scene: usize,
    /// The images of textures, with their smaller versions, and of an environment.
    pub textures: usize,
    /// The index of triangles, that of shadow casters, the rims of surfaces, and where light is of use.
    pub index: usize,
    /// Sums over passes.
    pub film: usize,
    /// Sums of the atlas, where one is made.
    pub atlas: usize,
    /// Mattes of objects and materials, where they are made.
    pub mattes: usize,
    /// The photons of one pass, while their map is built.
    pub photons: usize,
    /// The pixels of one pass.
    pub pass: usize,
    /// What is made of the sums when a picture is written: after a pass, when that holds nothing any more.
    pub writing: usize,
    /// What loading and indexing hold besides, before the first pass.
    pub planning: usize,
}

/// The program itself, its threads and the files it writes: measured, a render of one pixel.
const PROGRAM: usize = 12_000_000;
/// What a path tracer reads of a pixel: the light that arrives, that of luminaires, and lines followed.
const READING: usize = 2 * size_of::<Vec3>() + size_of::<u64>();
/// For each triangle while a scene is read and its index is built: measured on half a million triangles.
const PER_TRIANGLE: usize = 400;
/// While an environment is read there are so many times the bytes of its picture besides: its file, and what is decoded of it. Measured
/// on a Radiance picture of eight million texels.
const WHILE_READ: usize = 2;

impl Memory {
    /// Of a planned render without an atlas.
    pub fn of(plan: &Plan, frame: &Frame, layers: &[Layer]) -> Self {
        Self::of_stored(plan, frame, layers, frame.photons.as_ref().map_or(0.0, PhotonPlan::stored))
    }

    /// The same where it is known how many photons a pass stores.
    pub fn of_stored(plan: &Plan, frame: &Frame, layers: &[Layer], stored: f64) -> Self {
        let both = frame.photons.as_ref().is_some_and(|photons| photons.both_halves);
        let photon = if both { size_of::<Photon<Light>>() } else { size_of::<Photon<Invisible>>() };
        // Twice while they are put in order, with a sort key, a position and a place in the tree.
        let photons = stored * (2 * photon + 16 + 12 + 16) as f64;
        let sky = plan.scene.environment.as_ref().map_or(0, |sky| sky.picture_bytes());
        Self {
            scene: plan.scene.mesh.bytes(),
            textures: plan.scene.image_bytes(),
            index: plan.index_bytes() + frame.learned_bytes(),
            photons: photons as usize,
            planning: PER_TRIANGLE * plan.scene.mesh.triangles.len() + WHILE_READ * sky,
            ..Self::of_pixels(&plan.settings, layers)
        }
    }

    /// The part that is known before there is a plan.
    pub fn of_pixels(settings: &Settings, layers: &[Layer]) -> Self {
        let Settings { width, height, invisible, .. } = *settings;
        let pixels = settings.pixels();
        let planes = layers.len().max(1);
        let pass = match (settings.method, invisible) {
            (Method::Photon, false) => size_of::<Pixel<1>>() + (planes + 1) * size_of::<Vec3>(),
            (Method::Photon, true) => size_of::<Pixel<2>>() + (planes + 1) * size_of::<Vec3>(),
            (_, false) => READING + 2 * size_of::<Vec3>(),
            (_, true) => 2 * READING + 3 * size_of::<Vec3>(),
        };
        Self {
            film: Film::bytes(width, height, layers),
            pass: pixels * pass,
            // One plane more as it is shown, and one while it grows.
            writing: pixels * (planes + 2) * size_of::<Vec3>(),
            ..Self::default()
        }
    }

    /// With an atlas of so many bytes, of a film of this size in pixels, `together` of whose passes are made at once.
    pub fn with_atlas(self, bytes: usize, together: u32, (width, height): (u32, u32)) -> Self {
        let [gathered, passes, photons] =
            [width as usize * height as usize * size_of::<Pixel<1>>(), self.pass, self.photons]
                .map(|one| together as usize * one);
        // Their pictures are made when their photons are gone.
        Self { atlas: bytes, photons, pass: gathered.max(passes.saturating_sub(photons)), ..self }
    }

    /// With mattes of a film of this size in pixels.
    pub fn with_mattes(self, size: (u32, u32)) -> Self {
        Self { mattes: Mattes::bytes(size), ..self }
    }

    /// With a denoised layer of a film of this size in pixels.
    pub fn with_denoising(self, (width, height): (u32, u32)) -> Self {
        Self { writing: self.writing + denoise::bytes(width, height), ..self }
    }

    /// The most that is held at the same time.
    pub fn total(self) -> usize {
        let Self { scene, textures, index, film, atlas, mattes, photons, pass, writing, planning } = self;
        let rendering = index + atlas + mattes + (photons + pass).max(writing);
        PROGRAM + scene + textures + film + planning.max(rendering)
    }

    /// Why there is not enough, in one line; None where there is, or no limit is known.
    pub fn refusal(self, limit: Option<MemoryLimit>) -> Option<String> {
        let MemoryLimit { bytes, of } = limit?;
        let total = self.total();
        let atlas = if self.atlas > 0 { ", leave --atlas out" } else { "" };
        (total as u64 > bytes).then(|| {
            format!(
                "this render takes about {} of memory and {of} {}: lower --size, ask for fewer --layers or \
                 --photons{atlas}",
                words(total as f64),
                words(bytes as f64)
            )
        })
    }

    /// # Errors
    /// A line with both figures where there is not enough.
    pub fn check(self, limit: Option<MemoryLimit>) -> Result<()> {
        self.refusal(limit).map_or(Ok(()), |why| Err(Error::Usage(why)))
    }
}

/// As people write bytes: 12 kB, 3.4 MB, 5.67 GB.
pub fn words(bytes: f64) -> String {
    match bytes {
        b if b < 1e4 => format!("{b:.0} B"),
        b if b < 1e6 => format!("{:.0} kB", b / 1e3),
        b if b < 1e9 => format!("{:.1} MB", b / 1e6),
        b => format!("{:.2} GB", b / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mattes_are_counted_with_what_a_render_takes() {
        let settings = Settings::for_film(100, 50);
        let without = Memory::of_pixels(&settings, &[Layer::Visible]);
        let with = without.with_mattes((100, 50));
        // Six names and shares of each of two kinds.
        assert_eq!(with.mattes, 100 * 50 * 96);
        assert_eq!(with.total(), without.total() + with.mattes);
    }

    #[test]
    fn what_does_not_fit_is_told_with_both_figures() {
        let memory = Memory::of_pixels(&Settings::for_film(65_536, 65_536), &[Layer::Visible]);
        // Sums of a pixel are 24 bytes each, at least four of them.
        assert!(memory.film >= 65_536 * 65_536 * 96, "{memory:?}");
        let limit = MemoryLimit { bytes: 8_000_000_000, of: "this machine has" };
        let told = memory.refusal(Some(limit)).expect("too much");
        assert!(told.contains("GB of memory and this machine has 8.00 GB: lower --size"), "{told}");
        assert_eq!(memory.refusal(None), None);
        let small = Memory::of_pixels(&Settings::for_film(64, 64), &[Layer::Visible]);
        assert_eq!(small.refusal(Some(limit)), None);
        assert!(small.refusal(Some(MemoryLimit { bytes: small.total() as u64 - 1, ..limit })).is_some());
    }
}
