use super::{Normals, Sample, Transport};
use glam::Vec3;

/// A perfectly smooth tinted mirror: a delta lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Reflectance, linear RGB, each in [0, 1] for matter that creates no energy.
    pub tint: Vec3,
    /// True: the back reflects as the front does. False: the back absorbs.
    pub two_sided: bool,
}

impl Mirror {
    /// The reflected direction. None: nothing is reflected there.
    pub fn sample(&self, normals: &Normals, from: Vec3, transport: Transport) -> Option<Sample> {
        if !self.two_sided && !normals.is_front(from) {
            return None;
        }
        let to = reflect(from, normals.shading);
        if !normals.same_side(from, to) {
            return None;
        }
        let adjoint = match transport {
            Transport::Shooting => normals.adjoint(from, to),
            Transport::Gathering => 1.0,
        };
        Some(Sample { to, weight: self.tint * adjoint, pdf_solid_angle: 1.0 })
    }
}

/// The mirror image of `from` about `normal`, both pointing away from the surface.
pub(super) fn reflect(from: Vec3, normal: Vec3) -> Vec3 {
    (2.0 * from.dot(normal) * normal - from).normalize()
}
