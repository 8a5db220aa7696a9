//! Images on surfaces: decoded once, looked up at a point, and as coarse as what looks.

mod image;
mod mips;
mod sampler;
#[cfg(test)]
mod tests;

pub(super) use image::to_linear;
pub use image::{Encoding, Image};
pub use sampler::{Sampler, Wrap};

use glam::{Affine2, Vec2, Vec3, Vec4};
use std::sync::Arc;

/// An image as a material shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// What is shown; materials share it.
    pub image: Arc<Image>,
    /// How it goes on beyond its edges and between its texels.
    pub sampler: Sampler,
    /// Which of a vertex's two texture coordinates it is laid out by: 0 or 1.
    pub set: u8,
    /// From those coordinates to where the image is looked up (KHR_texture_transform).
    pub transform: Affine2,
}

/// What a point of a surface has that textures are looked up by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs {
    /// Both sets of texture coordinates, (0, 0) where the upper left corner of the image is.
    pub uvs: [Vec2; 2],
    /// In each of them the side of what looks; 0: a point.
    pub widths: [f32; 2],
    /// The colour of the vertices there, linear, with alpha; white where they have none.
    pub colour: Vec4,
    /// Where the right of the material's grain is (any length), and its up; None: there is no grain, or nothing lays it out.
    pub tangent: Option<(Vec3, Vec3)>,
}

impl Default for Inputs {
    fn default() -> Self {
        Self { uvs: [Vec2::ZERO; 2], widths: [0.0; 2], colour: Vec4::ONE, tangent: None }
    }
}

impl Texture {
    /// An image that repeats, as the first set of texture coordinates lays it out.
    pub fn new(image: Arc<Image>) -> Self {
        Self { image, sampler: Sampler::default(), set: 0, transform: Affine2::IDENTITY }
    }

    /// Red, green, blue (linear) and alpha at `uv`, as the mean over a square of side `width` there, both in texture coordinates
    /// before `transform`.
    pub fn at(&self, uv: Vec2, width: f32) -> Vec4 {
        let place = self.transform.transform_point2(uv);
        if width > 0.0 {
            let scale = self.transform.matrix2.determinant().abs().sqrt();
            self.image.filtered(&self.sampler, place, scale * width)
        } else {
            self.image.finest(&self.sampler, place)
        }
    }

    /// The same at a point.
    pub fn of(&self, inputs: &Inputs) -> Vec4 {
        let set = usize::from(self.set & 1);
        self.at(inputs.uvs[set], inputs.widths[set])
    }

    /// True where `fits` holds for every texel that is seen somewhere between `corners` in texture coordinates before `transform`.
    /// Where it says false, it may do so all the same.
    pub(in crate::scene) fn every(&self, corners: [Vec2; 3], fits: &dyn Fn(Vec4) -> bool) -> bool {
        let [a, b, c] = corners.map(|corner| self.transform.transform_point2(corner));
        self.image.every(&self.sampler, [a.min(b).min(c), a.max(b).max(c)], fits)
    }

    /// The side of a texel in texture coordinates before `transform`.
    pub(in crate::scene) fn texel_width(&self) -> f32 {
        let [width, height] = self.image.size().map(|side| side as f32);
        let scale = self.transform.matrix2.determinant().abs().sqrt();
        1.0 / (scale * (width * height).sqrt())
    }
}
