//! The plane that a disk lies in.

use glam::Vec3;

/// A place on a surface that light is asked for, seen from one side.
pub struct Tangent {
    /// Of the middle of the disk.
    pub position: Vec3,
    /// Unit, on the side that is asked about.
    pub normal: Vec3,
    /// The [connected surface](super::Rims::take_sheets) that it lies on.
    pub sheet: u32,
    right: Vec3,
    up: Vec3,
}

impl Tangent {
    /// At a place of a sheet, seen from the side of the unit vector `normal`.
    pub fn new(position: Vec3, normal: Vec3, sheet: u32) -> Self {
        let (right, up) = normal.any_orthonormal_pair();
        Self { position, normal, sheet, right, up }
    }

    /// A point as it lies from the middle: in the plane, and above it (m).
    pub fn flat(&self, p: Vec3) -> Vec3 {
        let way = p - self.position;
        Vec3::new(way.dot(self.right), way.dot(self.up), way.dot(self.normal))
    }
}
