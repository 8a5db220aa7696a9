use super::Ray;
use crate::scene::{Mesh, SurfacePoint};
use glam::{DVec3, Vec3};

/// What a connection looks along: the points `origin + t * way` with 0 < t < `end`.
///
/// The way is kept in f64. As a unit vector in f32 it would end off its target by the rounding of the *whole* way, and a
/// target that is itself known far better than that, such as a lamp near the scene's centre, would lie before or behind
/// its own surface by chance.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Start, scene space (m).
    pub origin: Vec3,
    /// To the target, m; of any length.
    pub way: DVec3,
    /// Exclusive end, as a part of the way; infinity for a half-line.
    pub end: f64,
}

/// Roundings in f64 between the corners of a triangle and where a line is found to cross its plane: eight in the normal and its
/// product with a corner, four in the slope, and the last quotient; 16 is the next power of two.
const CROSSING: f64 = 16.0 * f64::EPSILON;

impl Segment {
    /// From `point`, off its surface, to `target`. None where they coincide.
    pub fn between(point: &SurfacePoint, target: Vec3) -> Option<Self> {
        let origin = point.origin_towards(target - point.position);
        let way = target.as_dvec3() - origin.as_dvec3();
        (way != DVec3::ZERO).then_some(Self { origin, way, end: 1.0 })
    }

    /// From `point` to `target`, a point of a triangle of `mesh`: where a line that starts there would start. Neither the target's
    /// triangle nor what lies in its plane is met. None where the points coincide.
    pub fn to_surface(mesh: &Mesh, point: &SurfacePoint, target: &SurfacePoint) -> Option<Self> {
        let segment = Self::between(point, target.origin_towards(point.position - target.position))?;
        Some(Self { end: 1.0 - segment.unsure(mesh.corners(target.triangle)), ..segment })
    }

    /// The half-line from `point` in a unit direction.
    pub fn from_towards(point: &SurfacePoint, direction: Vec3) -> Self {
        Self { origin: point.origin_towards(direction), way: direction.as_dvec3(), end: f64::INFINITY }
    }

    /// Its length, m.
    pub fn length(&self) -> f64 {
        self.way.length()
    }

    /// Unit, along it.
    pub fn direction(&self) -> Vec3 {
        self.way.normalize().as_vec3()
    }

    /// By how much `t` of a crossing with the plane of these corners may be wrong.
    fn unsure(&self, corners: [Vec3; 3]) -> f64 {
        let [a, b, c] = corners.map(|corner| corner.as_dvec3() - self.origin.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        CROSSING * a.length() * e1.length() * e2.length() / e1.cross(e2).dot(self.way).abs()
    }
}

impl From<&Ray> for Segment {
    fn from(ray: &Ray) -> Self {
        Self { origin: ray.origin, way: ray.direction.as_dvec3(), end: f64::from(ray.t_max) }
    }
}

impl From<&Segment> for Segment {
    fn from(segment: &Segment) -> Self {
        *segment
    }
}
