use super::smooth::Smooth;
use glam::Vec3;

/// A perfectly smooth tinted mirror: a delta lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Reflectance, linear RGB, each in [0, 1] for matter that creates no energy.
    pub tint: Vec3,
    /// True: the back reflects as the front does. False: the back absorbs.
    pub two_sided: bool,
}

impl Smooth for Mirror {
    fn reflectance(&self, _: f32, _: bool) -> f32 {
        1.0
    }

    fn through(&self, _: Vec3, _: Vec3, _: bool) -> Option<Vec3> {
        None
    }

    fn filters(&self) -> [Vec3; 2] {
        [self.tint, Vec3::ZERO]
    }
}
