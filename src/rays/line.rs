use super::Segment;
use glam::{DVec3, Vec3, Vec3A};

/// A ray with all that its walk through the tree needs, computed once.
pub(super) struct Line {
    /// Origin × inverse direction for the planes where the ray enters boxes: moved back, so that boxes are larger
    /// by the pad.
    pub near: [f32; 3],
    /// The same for the planes where it leaves them.
    pub far: [f32; 3],
    /// Inverse direction, finite and never zero.
    pub inverse: [f32; 3],
    /// For each axis the index of the entry plane in a node; the exit plane's is that ^ 1.
    pub side: [usize; 3],
    /// The coordinate axes in the order x, y, z of ray space: z is where the direction is largest.
    pub axes: [usize; 3],
    /// Origin, in ray space order.
    pub origin: [f32; 3],
    /// The same.
    pub origin64: DVec3,
    /// Direction x/z and y/z; the f32 values are these, rounded.
    pub shear: [f64; 2],
    /// 1 / direction z.
    pub depth: f64,
    /// Largest absolute coordinate of the origin.
    pub reach: f32,
    /// Exclusive end.
    pub t_max: f64,
}

/// Boxes grow by this × (largest coordinate of the box + of the line's origin). In units of 2⁻²⁴ of that sum, a plane is off
/// by 3 in `plane * inverse - origin * inverse` (two products, one inverse) and by 1 more in their difference, the
/// moved origin by 1, the moved plane by 1, the t that prunes by 1 and a segment's way by 1 (both were rounded to f32): 8,
/// and 16 is the next power of two.
///
/// It is the largest coordinate of any axis, for lines that are all but parallel to a plane; but of this box, not of the scene: a
/// triangle far away makes the others no larger.
pub(super) const PAD: f32 = 16.0 * ROUNDING;

/// Relative error of one f32 operation.
pub(super) const ROUNDING: f32 = 0.5 * f32::EPSILON;

/// Directions are not flatter than this against an axis. Within a scene such a ray strays by far less than
/// [`PAD`], and the slab distances stay finite: no 0 × ∞.
const FLATTEST: f32 = 1.0 / (1u64 << 40) as f32;

impl Line {
    /// A segment as the tree is walked along it.
    #[inline(always)]
    pub fn new(segment: &Segment) -> Self {
        let (origin, direction) = (Vec3A::from(segment.origin), segment.way.as_vec3a());
        let steepness = direction.abs();
        let z = steepness.max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let reach = origin.abs().max_element();
        // −0.0 counts as positive: only the pair (side, sign of the inverse) must agree.
        let backwards = direction.cmplt(Vec3A::ZERO);
        let sign = Vec3A::select(backwards, Vec3A::NEG_ONE, Vec3A::ONE);
        let inverse = sign / steepness.max(Vec3A::splat(FLATTEST * steepness.max_element()));
        let pad = sign * (PAD * reach);
        let moved = axes.map(|axis| origin[axis]);
        let depth = 1.0 / segment.way[z];
        Self {
            near: ((origin + pad) * inverse).to_array(),
            far: ((origin - pad) * inverse).to_array(),
            inverse: inverse.to_array(),
            side: [0, 1, 2].map(|axis| 2 * axis + usize::from(backwards.test(axis))),
            axes,
            origin: moved,
            origin64: Vec3::from(moved).as_dvec3(),
            shear: [axes[0], axes[1]].map(|axis| segment.way[axis] * depth),
            depth,
            reach,
            t_max: segment.end,
        }
    }
}
