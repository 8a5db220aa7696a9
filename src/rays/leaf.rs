use super::Hit;
use super::exact::cross;
use super::line::{Line, ROUNDING};
use super::walk::Visit;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use glam::Vec3;
use std::ops::ControlFlow;

/// Triangles per block.
pub(super) const LANES: usize = 8;
type Lanes<S> = f32x8<S>;

/// A block of triangles. A leaf is a run of blocks.
#[repr(C, align(64))]
#[derive(Clone)]
pub(super) struct Block {
    /// `corners[axis][corner][lane]`
    corners: [[[f32; LANES]; 3]; 3],
    /// Index into the mesh.
    triangle: [u32; LANES],
    /// Index into the scene's straight matrices, and what backs are.
    class: [u32; LANES],
    /// No edge of these triangles is longer along any axis.
    extent: f32,
    /// Their largest absolute coordinate.
    reach: f32,
    /// A bit for each lane in use.
    used: u32,
    /// The last block of its leaf.
    last: bool,
}

impl Block {
    /// From at most [`LANES`] triangles: index, class, corners.
    pub fn new(triangles: &[(u32, u32, [Vec3; 3])], last: bool) -> Self {
        let mut block = Self {
            corners: [[[0.0; LANES]; 3]; 3],
            triangle: [0; LANES],
            class: [0; LANES],
            extent: 0.0,
            reach: 0.0,
            used: (1 << triangles.len()) - 1,
            last,
        };
        for (lane, &(triangle, class, corners)) in triangles.iter().enumerate() {
            for (axis, of_axis) in block.corners.iter_mut().enumerate() {
                for (of_corner, corner) in of_axis.iter_mut().zip(corners) {
                    of_corner[lane] = corner[axis];
                }
            }
            let [a, b, c] = corners;
            let edges = (a - b).abs().max((b - c).abs()).max((c - a).abs());
            block.extent = block.extent.max(edges.max_element());
            block.reach = block.reach.max(a.abs().max(b.abs()).max(c.abs()).max_element());
            block.triangle[lane] = triangle;
            block.class[lane] = class;
        }
        block
    }

    /// Triangles that the line may cross: all that it does cross, and some that it misses by rounding.
    ///
    /// Woop's test in f32. Let R be `extent`, D `reach` + `line.reach` and ε [`ROUNDING`]. Where the line does cross, sheared
    /// coordinates are at most 2R and wrong by δ ≤ 4ε(R + D) (two differences, one quotient, one product), so an
    /// edge function, two products of such, is wrong by at most 8Rδ + 2δ² + 16εR² ≤ 64 g (R + g), g = ε(R + D).
    #[inline(always)]
    fn candidates<S: Simd>(&self, simd: S, line: &Line) -> u32 {
        let (ax, ay) = self.place(simd, line, 0);
        let (bx, by) = self.place(simd, line, 1);
        let (cx, cy) = self.place(simd, line, 2);
        let (a, b, c) = (bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx);
        let g = ROUNDING * (self.extent + self.reach + line.reach);
        let slack = 64.0 * g * (self.extent + g);
        let negative = a.min(b).min(c).simd_lt(Lanes::simd_from(simd, -slack));
        let positive = a.max(b).max(c).simd_gt(Lanes::simd_from(simd, slack));
        // Asked this way round, an overflow (NaN) stays a candidate.
        !(negative & positive).to_bitmask() as u32 & self.used
    }

    /// A corner of all triangles in ray space: x and y, the ray being the z axis.
    #[inline(always)]
    fn place<S: Simd>(&self, simd: S, line: &Line, corner: usize) -> (Lanes<S>, Lanes<S>) {
        let [x, y, z] = line.axes;
        let x =
            Lanes::load_array_ref(simd, &self.corners[x][corner]) - Lanes::simd_from(simd, line.origin[0]);
        let y =
            Lanes::load_array_ref(simd, &self.corners[y][corner]) - Lanes::simd_from(simd, line.origin[1]);
        let z =
            Lanes::load_array_ref(simd, &self.corners[z][corner]) - Lanes::simd_from(simd, line.origin[2]);
        let shear_x = Lanes::simd_from(simd, line.shear[0] as f32);
        let shear_y = Lanes::simd_from(simd, line.shear[1] as f32);
        (x - shear_x * z, y - shear_y * z)
    }

    /// The corners of one triangle, in the axis order of ray space.
    #[inline(always)]
    fn lane(&self, line: &Line, lane: usize) -> [Vec3; 3] {
        let lane = lane % LANES;
        let [x, y, z] = line.axes.map(|axis| &self.corners[axis]);
        [0, 1, 2].map(|corner| Vec3::new(x[corner][lane], y[corner][lane], z[corner][lane]))
    }
}

/// Shows `visit` all crossings of the leaf that starts at `first`.
#[inline(always)]
pub(super) fn visit_leaf<S: Simd, V: Visit>(
    simd: S,
    blocks: &[Block],
    first: usize,
    line: &Line,
    visit: &mut V,
) -> ControlFlow<()> {
    for block in &blocks[first..] {
        let mut candidates = block.candidates(simd, line);
        while candidates != 0 {
            let lane = candidates.trailing_zeros() as usize % LANES;
            candidates &= candidates - 1;
            if let Some(crossing) = cross(line, block.lane(line, lane)) {
                let (t, u, v) = (crossing.t as f32, crossing.u as f32, crossing.v as f32);
                visit.hit(
                    Hit { t, triangle: block.triangle[lane], u, v, back: crossing.back },
                    block.class[lane],
                )?;
            }
        }
        if block.last {
            break;
        }
    }
    ControlFlow::Continue(())
}
