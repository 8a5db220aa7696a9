use glam::Vec3;

/// The two normals at a point of a surface, both on its front side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normals {
    /// Of the triangle, unit length, out of its front (counter-clockwise) side. Decides sides.
    pub geometric: Vec3,
    /// Interpolated from the vertices, unit length, in the same half-space as `geometric`. Decides cosines.
    pub shading: Vec3,
}

impl Normals {
    /// Both normals the same.
    #[inline(always)]
    pub fn flat(normal: Vec3) -> Self {
        Self { geometric: normal, shading: normal }
    }

    /// A shading normal that looks away from the geometric one cannot be meant; the geometric one stands in.
    #[inline(always)]
    pub fn new(geometric: Vec3, shading: Vec3) -> Self {
        let shading = if shading.dot(geometric) > 0.0 { shading } else { geometric };
        Self { geometric, shading }
    }

    /// True when `direction` leaves on the front side.
    #[inline(always)]
    pub fn is_front(&self, direction: Vec3) -> bool {
        self.geometric.dot(direction) > 0.0
    }

    /// The shading normal on the side that is seen from `wo`.
    pub fn facing(&self, wo: Vec3) -> Vec3 {
        if self.is_front(wo) { self.shading } else { -self.shading }
    }

    /// True when both directions leave on the same side, by the geometric and by the shading normal alike.
    #[inline(always)]
    pub fn same_side(&self, a: Vec3, b: Vec3) -> bool {
        self.counts(a, b) && self.counts(b, a)
    }

    /// True when light from `wi` counts where the surface is seen from `wo`: it arrives on the same side of the geometric
    /// normal, and the shading normal says that too.
    #[inline(always)]
    pub fn counts(&self, wo: Vec3, wi: Vec3) -> bool {
        let (og, ig) = (self.geometric.dot(wo), self.geometric.dot(wi));
        og * ig > 0.0 && self.shading.dot(wi) * ig > 0.0
    }

    /// The share of a cosine lobe about the shading normal that lies above the surface, (1 + ns·ng) / 2: seen along the
    /// shading normal, half a disk and half an ellipse.
    #[inline(always)]
    pub fn share_above(&self) -> f32 {
        if self.shading == self.geometric {
            return 1.0;
        }
        0.5 + 0.5 * self.shading.dot(self.geometric)
    }

    /// What power that arrives from `wi` counts for, against what the true cosine says: |wi·ns| / |wi·ng|.
    /// One half of the adjoint factor; a photon that is deposited has it already. Veach 1997, eq. 5.17.
    #[inline(always)]
    pub fn arrival(&self, wi: Vec3) -> f32 {
        if self.shading == self.geometric {
            return 1.0;
        }
        (wi.dot(self.shading) / wi.dot(self.geometric)).abs()
    }

    /// The adjoint factor of shading normals when light is shot, |wi·ns| |wo·ng| / (|wi·ng| |wo·ns|).
    /// Veach 1997, eq. 5.19. One where the two normals are the same.
    #[inline(always)]
    pub fn adjoint(&self, wi: Vec3, wo: Vec3) -> f32 {
        self.arrival(wi) / self.arrival(wo)
    }
}
