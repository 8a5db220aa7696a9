use super::line::Line;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

/// Children per node.
pub(super) const WIDTH: usize = 8;

/// Marks a child reference that is an index into the leaves; the others are indices into the nodes.
pub(super) const LEAF: u32 = 1 << 31;

/// Up to eight boxes, and what is in them.
#[repr(C, align(64))]
#[derive(Clone)]
pub(super) struct Node {
    /// x min, x max, y min, … of each child, padded. Empty places are inside out: no ray meets them.
    pub planes: [[f32; WIDTH]; 6],
    /// Node index, or leaf index | [`LEAF`].
    pub child: [u32; WIDTH],
    /// A bit for each place in use: without it, a ray with a NaN would enter empty places and never end.
    pub used: u32,
}

impl Node {
    /// A node without children.
    pub const EMPTY: Self = {
        const MIN: [f32; WIDTH] = [f32::INFINITY; WIDTH];
        const MAX: [f32; WIDTH] = [f32::NEG_INFINITY; WIDTH];
        Self { planes: [MIN, MAX, MIN, MAX, MIN, MAX], child: [0; WIDTH], used: 0 }
    };

    /// Which boxes the line meets before `limit` (a bit each), and at what distance it enters them.
    #[inline(always)]
    pub fn enter<S: Simd>(&self, simd: S, line: &Line, limit: f32) -> (u32, [f32; WIDTH]) {
        let (near_x, far_x) = self.slab(simd, line, 0);
        let (near_y, far_y) = self.slab(simd, line, 1);
        let (near_z, far_z) = self.slab(simd, line, 2);
        let enter = near_x.max(near_y).max(near_z.max(f32x8::simd_from(simd, 0.0)));
        let leave = far_x.min(far_y).min(far_z.min(f32x8::simd_from(simd, limit)));
        (enter.simd_le(leave).to_bitmask() as u32 & self.used, enter.to_array())
    }

    /// At what distances the line passes the planes of one axis.
    #[inline(always)]
    fn slab<S: Simd>(&self, simd: S, line: &Line, axis: usize) -> (f32x8<S>, f32x8<S>) {
        let side = line.side[axis];
        let inverse = f32x8::simd_from(simd, line.inverse[axis]);
        let near = f32x8::load_array_ref(simd, &self.planes[side]);
        let far = f32x8::load_array_ref(simd, &self.planes[side ^ 1]);
        (
            near.mul_sub(inverse, f32x8::simd_from(simd, line.near[axis])),
            far.mul_sub(inverse, f32x8::simd_from(simd, line.far[axis])),
        )
    }
}
