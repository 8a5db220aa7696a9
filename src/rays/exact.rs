//! Does the line cross the triangle? Decided without error, so that neighbours agree.
//!
//! Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection", with f64 in place of f32: corners are moved
//! into ray space (a function of ray and corner alone), and their edge functions are decided exactly. A line that meets an
//! edge or a corner is, symbolically, moved by (ε, ε²) in the projection plane (Edelsbrunner, Mücke 1990). It then crosses
//! exactly one triangle of a fan, as with a rasteriser's fill rule, whichever way the triangles are wound.

use super::line::Line;
use glam::{DVec3, Vec3};

/// Where a line crosses a triangle.
pub(super) struct Crossing {
    /// Distance along the ray, > 0 and < its `t_max`.
    pub t: f64,
    /// Barycentric weight of the second corner.
    pub u: f64,
    /// Barycentric weight of the third corner.
    pub v: f64,
    /// The line enters by the triangle's back.
    pub back: bool,
}

/// A corner relative to the ray's origin, and where the line sees it: the ray is the z axis.
#[derive(Clone, Copy)]
struct Corner {
    offset: DVec3,
    x: f64,
    y: f64,
}

impl Corner {
    #[inline(always)]
    fn new(line: &Line, position: Vec3) -> Self {
        let offset = position.as_dvec3() - line.origin64;
        let [shear_x, shear_y] = line.shear;
        Self { offset, x: offset.x - shear_x * offset.z, y: offset.y - shear_y * offset.z }
    }
}

/// The corners are in the axis order of ray space.
#[inline(always)]
pub(super) fn cross(line: &Line, [a, b, c]: [Vec3; 3]) -> Option<Crossing> {
    let (a, b, c) = (Corner::new(line, a), Corner::new(line, b), Corner::new(line, c));
    let (weight_a, side_a) = edge(b, c)?;
    let (weight_b, side_b) = edge(c, a)?;
    let (weight_c, side_c) = edge(a, b)?;
    if side_a != side_b || side_b != side_c {
        return None;
    }
    // All weights have one sign and not all are zero, so the sum is not zero.
    let sum = weight_a + weight_b + weight_c;
    // On which side of the plane the origin lies must not depend on the direction, or a grazing ray would meet the
    // surface it starts on. So not the weighted mean of the corners' z, which says the same if not for rounding.
    let normal = (b.offset - a.offset).cross(c.offset - a.offset);
    let height = a.offset.dot(normal);
    // The sum says the same, but less well for small triangles far away; of the sign it is surer.
    let slope = (normal.x * line.shear[0] + normal.y * line.shear[1] + normal.z).abs().copysign(sum);
    let (a, b, c) = (a.offset.z * line.depth, b.offset.z * line.depth, c.offset.z * line.depth);
    // A triangle seen all but edge-on: not outside its corners.
    let t = (height / slope * line.depth).max(a.min(b).min(c)).min(a.max(b).max(c));
    (t > 0.0 && t < line.t_max).then(|| Crossing {
        t,
        u: weight_b / sum,
        v: weight_c / sum,
        // The sum is twice the signed area in the projection plane: normal · direction, up to the sign of depth.
        back: (sum > 0.0) == (line.depth > 0.0),
    })
}

/// Twice the area of (origin, p, q), of the right sign; and on which side of p → q the moved origin lies.
/// None for an edge without length.
#[inline(always)]
fn edge(p: Corner, q: Corner) -> Option<(f64, bool)> {
    let (left, right) = (p.x * q.y, p.y * q.x);
    // Rounding is monotonic: products that differ after rounding have the order of the exact ones.
    if left != right { Some((left - right, left > right)) } else { edge_at_origin(p.x, p.y, q.x, q.y) }
}

/// The same where the two products round to one number.
#[cold]
#[inline(never)]
fn edge_at_origin(px: f64, py: f64, qx: f64, qy: f64) -> Option<(f64, bool)> {
    // What rounding took from each product, exactly.
    let left = px.mul_add(qy, -(px * qy));
    let right = py.mul_add(qx, -(py * qx));
    if left != right {
        return Some((left - right, left > right));
    }
    // On the line itself: the coefficient of ε, then that of ε², in the edge function of the moved origin.
    if py != qy {
        Some((0.0, py > qy))
    } else if px != qx {
        Some((0.0, qx > px))
    } else {
        None
    }
}
