//! Rays against the scene: closest hit, all hits in order, transmittance.

use crate::light::Matrix;
use crate::scene::Scene;
use glam::Vec3;

/// A half-line or segment: points `origin + t * direction` with 0 < t < `t_max`.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, scene space (m).
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Exclusive end, m; infinity for a half-line.
    pub t_max: f32,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, m, > 0.
    pub t: f32,
    /// Index into the mesh.
    pub triangle: u32,
    /// Barycentric weight of the second vertex.
    pub u: f32,
    /// Barycentric weight of the third vertex.
    pub v: f32,
}

/// The scene's triangles, indexed for rays.
pub struct Rays {}

impl Rays {
    /// Builds the index over all triangles of the scene; `O(n log n)`.
    pub fn build(_scene: &Scene) -> Self {
        Self {}
    }

    /// The first triangle that the ray meets.
    pub fn closest(&self, _ray: &Ray) -> Option<Hit> {
        None
    }

    /// All triangles along the ray in order of (t, triangle), up to and including the first that lets nothing straight through.
    pub fn crossings(&self, _ray: &Ray, hits: &mut Vec<Hit>) {
        hits.clear();
    }

    /// True when any triangle lies on the ray.
    pub fn occluded(&self, _ray: &Ray) -> bool {
        false
    }

    /// What light that travels the segment from its *far* end to its origin is multiplied by: the ordered product of the straight matrices.
    pub fn transmittance(&self, _ray: &Ray) -> Matrix {
        Matrix::IDENTITY
    }
}
