use super::Normals;
use super::albedo::SCHLICK_MEAN;
use super::smooth::Smooth;
use glam::Vec3;

/// A perfectly smooth mirror: a delta lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Reflectance at normal incidence, linear RGB, each in [0, 1] for matter that creates no energy.
    pub tint: Vec3,
    /// Reflectance at grazing incidence, likewise. In between: Schlick 1994.
    pub grazing: Vec3,
    /// True: the back reflects as the front does. False: the back absorbs.
    pub two_sided: bool,
}

impl Mirror {
    /// A mirror that keeps its colour at all angles.
    pub const fn plain(tint: Vec3, two_sided: bool) -> Self {
        Self { tint, grazing: tint, two_sided }
    }

    /// Metal: white at grazing incidence, as [`Glossy`](super::Glossy) is at any roughness.
    pub const fn metal(base: Vec3, two_sided: bool) -> Self {
        Self { tint: base, grazing: Vec3::ONE, two_sided }
    }

    /// What is reflected of light from `from`, or more where it is not known which of two normals turns it.
    pub fn share(&self, normals: &Normals, from: Vec3) -> Vec3 {
        let cosines = [normals.geometric, normals.shading].map(|normal| normal.dot(from).abs());
        let [about_one, about_other] = cosines.map(|cos| self.at(cos));
        about_one.max(about_other)
    }

    /// The reflectance averaged over all directions, cosine-weighted.
    pub fn average(&self) -> Vec3 {
        self.tint.lerp(self.grazing, SCHLICK_MEAN)
    }

    /// An upper bound of the reflectance from any direction.
    pub(super) fn bound(&self) -> Vec3 {
        self.tint.max(self.grazing)
    }

    fn at(&self, cos: f32) -> Vec3 {
        // A mirror of one colour is that to the last bit.
        if self.tint == self.grazing {
            return self.tint;
        }
        self.tint.lerp(self.grazing, (1.0 - cos.min(1.0)).powi(5))
    }
}

impl Smooth for Mirror {
    fn reflectance(&self, _: f32, _: bool) -> f32 {
        1.0
    }

    fn through(&self, _: Vec3, _: Vec3, _: bool) -> Option<Vec3> {
        None
    }

    fn filters(&self, cos_from: f32) -> [Vec3; 2] {
        [self.at(cos_from), Vec3::ZERO]
    }
}
