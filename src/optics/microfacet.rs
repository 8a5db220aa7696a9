//! Microfacets of the GGX distribution (Walter et al. 2007; Heitz 2014), in a frame whose z is the normal that turns light.
//!
//! Everything is in double precision and written in tangents, so that roughnesses down to 10⁻⁶ are right to the last bit of
//! the directions given: slopes of 10⁻⁶ are told by what two unit vectors have left when they almost cancel.

use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Three orthonormal axes at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    x: DVec3,
    y: DVec3,
    z: DVec3,
}

impl Frame {
    /// z is `up`; x is what `tangent` has across it, or any direction where it has nothing.
    pub(super) fn new(up: Vec3, tangent: Vec3) -> Self {
        let z = up.as_dvec3().normalize();
        let across = tangent.as_dvec3() - tangent.as_dvec3().dot(z) * z;
        let x = across.try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
        Self { x, y: z.cross(x), z }
    }

    /// A unit vector of the world in this frame.
    pub(super) fn local(&self, world: Vec3) -> DVec3 {
        let w = world.as_dvec3();
        DVec3::new(w.dot(self.x), w.dot(self.y), w.dot(self.z)).normalize()
    }

    /// And back.
    pub(super) fn world(&self, local: DVec3) -> Vec3 {
        (local.x * self.x + local.y * self.y + local.z * self.z).as_vec3()
    }
}

/// Facets of the GGX distribution: slopes as of an ellipsoid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ggx {
    /// Roughness along x and y, > 0.
    pub(super) alpha: [f64; 2],
}

impl Ggx {
    pub(super) fn new(alpha: [f32; 2]) -> Self {
        Self { alpha: alpha.map(f64::from) }
    }

    /// How the facets look towards `w`: √(z² + αx² x² + αy² y²), which is (1 + 2Λ) |cos θ|.
    pub(super) fn stretch(&self, w: DVec3) -> f64 {
        let [ax, ay] = self.alpha;
        DVec3::new(ax * w.x, ay * w.y, w.z).length()
    }

    /// Density of facets' normals over the solid angle, per area of the surface, sr⁻¹; `half` need not be a unit vector.
    pub(super) fn density(&self, half: DVec3) -> f64 {
        let [ax, ay] = self.alpha;
        let q = DVec3::new(half.x / ax, half.y / ay, half.z).length_squared() / half.length_squared();
        1.0 / (PI * ax * ay * q * q)
    }

    /// Smith's height-correlated masking and shadowing over 4 cos θo cos θi, which is what stays finite; both z > 0.
    pub(super) fn visibility(&self, wo: DVec3, wi: DVec3) -> f64 {
        0.5 / (self.stretch(wo) * wi.z + self.stretch(wi) * wo.z)
    }

    /// Density over directions of what `wo`, z > 0, sees mirrored by facets that it sees, sr⁻¹.
    pub(super) fn mirrored(&self, wo: DVec3, half: DVec3) -> f64 {
        self.density(half) / (2.0 * (wo.z + self.stretch(wo)))
    }

    /// Density over the normals of the facets that `wo`, z > 0, sees, sr⁻¹.
    pub(super) fn seen(&self, wo: DVec3, half: DVec3) -> f64 {
        2.0 * wo.dot(half).max(0.0) * self.density(half) / (wo.z + self.stretch(wo))
    }

    /// The normal of a facet that `wo`, z > 0, sees. Dupuy & Benyoub 2023: a hemisphere seen from one side mirrors a cap.
    pub(super) fn facet(&self, wo: DVec3, u: [f64; 2]) -> DVec3 {
        let round = self.round(wo);
        let (sin, cos) = (TAU * u[0]).sin_cos();
        let z = (1.0 - u[1]) * (1.0 + round.z) - round.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        self.of_cap(round, DVec3::new(r * cos, r * sin, z))
    }

    /// `w` where facets are a hemisphere.
    pub(super) fn round(&self, w: DVec3) -> DVec3 {
        let [ax, ay] = self.alpha;
        DVec3::new(ax * w.x, ay * w.y, w.z).normalize()
    }

    /// The facet that mirrors `round` to a point `cap` of the sphere that is above −`round`, where facets are a hemisphere.
    pub(super) fn of_cap(&self, round: DVec3, cap: DVec3) -> DVec3 {
        let [ax, ay] = self.alpha;
        let half = cap + round;
        DVec3::new(ax * half.x, ay * half.y, half.z).normalize()
    }
}

/// `w` mirrored about `half`, both away from the surface.
pub(super) fn mirror(w: DVec3, half: DVec3) -> DVec3 {
    2.0 * w.dot(half) * half - w
}
