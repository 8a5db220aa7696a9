//! Does the line cross the triangle? Decided without error, so that neighbours agree.
//!
//! Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection", with f64 in place of f32: corners are moved
//! into ray space (a function of ray and corner alone), and edge functions of those are decided exactly. A line
//! that meets an edge or a corner is, symbolically, moved by (ε, ε²) in the projection plane (Edelsbrunner,
//! Mücke 1990): it then crosses exactly one triangle of a fan, as in a rasteriser's fill rule, whichever way the
//! triangles are wound.

use super::line::Line;

/// Where a line crosses a triangle.
pub(super) struct Crossing {
    /// Distance along the ray, > 0 and < its `t_max`.
    pub t: f64,
    /// Barycentric weight of the second corner.
    pub u: f64,
    /// Barycentric weight of the third corner.
    pub v: f64,
}

/// A corner in ray space: the ray is the z axis.
#[derive(Clone, Copy)]
struct Corner {
    x: f64,
    y: f64,
    z: f64,
}

/// Corners are given in the axis order of ray space: `corners[axis][corner]`.
#[inline(always)]
pub(super) fn cross(line: &Line, corners: [[f32; 3]; 3]) -> Option<Crossing> {
    let place = |i: usize| {
        let [x, y, z] = [0, 1, 2].map(|axis| f64::from(corners[axis][i]) - f64::from(line.origin[axis]));
        Corner { x: x - line.shear[0] * z, y: y - line.shear[1] * z, z }
    };
    let [a, b, c] = [place(0), place(1), place(2)];
    let (weight_a, side_a) = edge(b, c)?;
    let (weight_b, side_b) = edge(c, a)?;
    let (weight_c, side_c) = edge(a, b)?;
    if side_a != side_b || side_b != side_c {
        return None;
    }
    // All weights have one sign and not all are zero, so the sum is not zero, and t lies between the corners'.
    let sum = weight_a + weight_b + weight_c;
    let t = (weight_a * a.z + weight_b * b.z + weight_c * c.z) / (sum * line.depth);
    (t > 0.0 && t < line.t_max).then(|| Crossing { t, u: weight_b / sum, v: weight_c / sum })
}

/// Twice the area of (origin, p, q), of the right sign; and on which side of p → q the moved origin lies.
/// None for an edge without length.
#[inline(always)]
fn edge(p: Corner, q: Corner) -> Option<(f64, bool)> {
    let (left, right) = (p.x * q.y, p.y * q.x);
    // Rounding is monotonic: products that differ after rounding have the order of the exact ones.
    if left != right { Some((left - right, left > right)) } else { edge_at_origin(p, q) }
}

/// The same where the two products round to one number.
#[cold]
#[inline(never)]
fn edge_at_origin(p: Corner, q: Corner) -> Option<(f64, bool)> {
    // What rounding took from each product, exactly.
    let left = p.x.mul_add(q.y, -(p.x * q.y));
    let right = p.y.mul_add(q.x, -(p.y * q.x));
    if left != right {
        return Some((left - right, left > right));
    }
    // On the line itself: the coefficient of ε, then that of ε², in the edge function of the moved origin.
    if p.y != q.y {
        Some((0.0, p.y > q.y))
    } else if p.x != q.x {
        Some((0.0, q.x > p.x))
    } else {
        None
    }
}
