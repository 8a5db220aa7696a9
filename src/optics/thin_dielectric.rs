use super::fresnel_dielectric;
use super::smooth::Smooth;
use glam::Vec3;

/// A thin pane: two parallel interfaces with nothing between them that bends light for good. A delta lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    /// Index of the pane over that of what surrounds it, > 0.
    pub ior: f32,
    /// Filter of transmitted light, linear RGB in [0, 1].
    pub tint: Vec3,
}

impl ThinDielectric {
    /// Reflectance of the pane with all reflections between its interfaces, R + T²R/(1−R²) = 2R/(1+R).
    pub fn reflectance(&self, cos_from: f32) -> f32 {
        let r = fresnel_dielectric(cos_from, self.ior);
        2.0 * r / (1.0 + r)
    }
}

impl Smooth for ThinDielectric {
    fn reflectance(&self, cos_from: f32, _: bool) -> f32 {
        ThinDielectric::reflectance(self, cos_from)
    }

    fn through(&self, from: Vec3, _: Vec3, _: bool) -> Option<Vec3> {
        Some(-from)
    }

    fn filters(&self, _: f32) -> [Vec3; 2] {
        [Vec3::ONE, self.tint]
    }
}
