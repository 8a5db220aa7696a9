use super::Ray;

/// A ray with all that its walk through the tree needs, computed once.
pub(super) struct Line {
    /// Origin for the planes where the ray enters boxes: moved back, so that boxes are larger by the pad.
    pub near: [f32; 3],
    /// Origin for the planes where it leaves them.
    pub far: [f32; 3],
    /// Inverse direction, finite and never zero.
    pub inverse: [f32; 3],
    /// For each axis the index of the entry plane in a node; the exit plane's is that ^ 1.
    pub side: [usize; 3],
    /// The coordinate axes in the order x, y, z of ray space: z is where the direction is largest.
    pub axes: [usize; 3],
    /// Origin, in ray space order.
    pub origin: [f32; 3],
    /// Direction x/z and y/z; the f32 values are these, rounded.
    pub shear: [f64; 2],
    /// Direction z.
    pub depth: f64,
    /// No coordinate of the scene is farther from the origin than this.
    pub reach: f32,
    /// Exclusive end.
    pub t_max: f64,
}

/// Boxes grow by this × (largest coordinate of scene + of ray origin). In units of 2⁻²⁴ of that sum, a slab
/// distance is wrong by 3 (difference, inverse, product), the moved origin by 1, and the t that prunes by 1
/// (it was rounded to f32): 5, and 8 is the next power of two.
const PAD: f32 = 8.0 * ROUNDING;

/// Relative error of one f32 operation.
pub(super) const ROUNDING: f32 = 0.5 * f32::EPSILON;

/// Directions are not flatter than this against an axis. Within a scene such a ray strays by far less than
/// [`PAD`], and the slab distances stay finite: no 0 × ∞.
const FLATTEST: f32 = 1.0 / (1u64 << 40) as f32;

impl Line {
    /// `magnitude`: the largest absolute coordinate of the scene.
    #[inline(always)]
    pub fn new(ray: &Ray, magnitude: f32) -> Self {
        let origin = ray.origin.to_array();
        let direction = ray.direction.to_array();
        let steepness = ray.direction.abs();
        let z = steepness.max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let reach = magnitude + ray.origin.abs().max_element();
        let pad = PAD * reach;
        let flattest = FLATTEST * steepness.max_element();
        let mut line = Self {
            near: [0.0; 3],
            far: [0.0; 3],
            inverse: [0.0; 3],
            side: [0; 3],
            axes,
            origin: axes.map(|axis| origin[axis]),
            shear: [axes[0], axes[1]].map(|axis| f64::from(direction[axis]) / f64::from(direction[z])),
            depth: f64::from(direction[z]),
            reach,
            t_max: f64::from(ray.t_max),
        };
        for axis in 0..3 {
            // −0.0 counts as positive: only the pair (side, sign of the inverse) must agree.
            let backwards = direction[axis] < 0.0;
            let slope = direction[axis].abs().max(flattest);
            let (slope, pad) = if backwards { (-slope, -pad) } else { (slope, pad) };
            line.near[axis] = origin[axis] + pad;
            line.far[axis] = origin[axis] - pad;
            line.inverse[axis] = 1.0 / slope;
            line.side[axis] = 2 * axis + usize::from(backwards);
        }
        line
    }
}
