use super::{Inputs, texture::Texture};
use crate::optics::Normals;
use glam::{Mat2, Vec2, Vec3, Vec4, Vec4Swizzles};
use std::ops::{Add, Mul};

/// Triangles in scene space (m). Counter-clockwise is the front.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals, as many as positions; read only for surfaces that are `smooth`.
    pub normals: Vec<Vec3>,
    /// Three vertex indices per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The surface each triangle belongs to.
    pub surface: Vec<u32>,
    /// Two sets of texture coordinates, (0, 0) where the upper left corner of an image is; each as many as positions, or none
    /// where no surface has them.
    pub uvs: [Vec<Vec2>; 2],
    /// Colours with alpha, linear, in [0, 1]; as many as positions, or none.
    pub colours: Vec<Vec4>,
    /// Where the right of a normal map is; w: 1 where its up is normal × tangent, −1 where that is its down, 0 where nothing is
    /// known. As many as positions, or none.
    pub tangents: Vec<Vec4>,
}

/// What a run of triangles has in common: one glTF primitive under one node.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Node name, for messages.
    pub name: String,
    /// Index into [`Scene::materials`](super::Scene::materials).
    pub material: u32,
    /// True: vertex normals are interpolated. False: triangles are flat.
    pub smooth: bool,
    /// True when the triangles enclose a volume: every edge is shared by two triangles that agree about its front.
    pub closed: bool,
}

/// A point on a triangle, with what rays and lobes need there.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position in scene space.
    pub position: Vec3,
    /// Bound of the rounding error of each coordinate of `position`.
    pub error: Vec3,
    /// Geometric and shading normal, on the front side.
    pub normals: Normals,
    /// The triangle.
    pub triangle: u32,
    /// Weight of its second corner.
    pub u: f32,
    /// Weight of its third corner.
    pub v: f32,
}

impl Mesh {
    /// What it takes in memory.
    pub fn bytes(&self) -> usize {
        let Self { positions, normals, triangles, surface, uvs: [first, second], colours, tangents } = self;
        size_of_val(&positions[..])
            + size_of_val(&first[..])
            + size_of_val(&second[..])
            + size_of_val(&colours[..])
            + size_of_val(&tangents[..])
            + size_of_val(&normals[..])
            + size_of_val(&triangles[..])
            + size_of_val(&surface[..])
    }

    /// Corners of a triangle.
    #[inline(always)]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }

    /// Area of a triangle, m².
    pub fn area(&self, triangle: u32) -> f32 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Unit geometric normal of a triangle, out of its front.
    pub fn normal(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize()
    }

    /// Smallest and largest coordinates; zeros where there are no triangles.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        if self.positions.is_empty() {
            return (Vec3::ZERO, Vec3::ZERO);
        }
        self.positions
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), p| (min.min(*p), max.max(*p)))
    }

    /// The point of `triangle` with barycentric weights (1 − u − v, u, v).
    ///
    /// `smooth`: interpolate vertex normals. The error bound follows pbrt 4th ed., eq. 6.30: three products and two
    /// sums, γ(7) relative to the sum of their absolute values.
    #[inline(always)]
    pub fn point(&self, triangle: u32, u: f32, v: f32, smooth: bool) -> SurfacePoint {
        let corners = self.corners(triangle);
        let weights = [1.0 - u - v, u, v];
        let mut position = Vec3::ZERO;
        let mut magnitude = Vec3::ZERO;
        for (corner, weight) in corners.into_iter().zip(weights) {
            position += weight * corner;
            magnitude += (weight * corner).abs();
        }
        let geometric = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let normals = if smooth {
            let [a, b, c] = self.triangles[triangle as usize].map(|i| self.normals[i as usize]);
            let shading = (weights[0] * a + weights[1] * b + weights[2] * c).normalize_or(geometric);
            Normals::new(geometric, shading)
        } else {
            Normals::flat(geometric)
        };
        SurfacePoint { position, error: gamma(7) * magnitude, normals, triangle, u, v }
    }
}

impl Mesh {
    /// What textures are looked up by at a point, seen over `footprint` (m), the side of what looks on a surface that faces it.
    pub fn inputs(&self, point: &SurfacePoint, footprint: f32) -> Inputs {
        let mut inputs = Inputs::default();
        for (set, uvs) in self.uvs.iter().enumerate().filter(|(_, uvs)| !uvs.is_empty()) {
            inputs.uvs[set] = self.between(point, uvs);
            if footprint > 0.0 {
                inputs.widths[set] = footprint * self.stretch(point.triangle, set);
            }
        }
        if !self.colours.is_empty() {
            inputs.colour = self.between(point, &self.colours);
        }
        inputs
    }

    /// Texture coordinates of a set per metre: the root of the ratio of areas.
    pub(super) fn stretch(&self, triangle: u32, set: usize) -> f32 {
        let uvs = &self.uvs[set];
        if uvs.is_empty() {
            return 0.0;
        }
        let [a, b, c] = self.corners(triangle);
        let [ta, tb, tc] = self.triangles[triangle as usize].map(|i| uvs[i as usize]);
        ((tb - ta).perp_dot(tc - ta).abs() / (b - a).cross(c - a).length()).sqrt()
    }

    /// What vertices have, at a point between them.
    #[inline]
    fn between<T: Copy + Add<Output = T> + Mul<f32, Output = T>>(
        &self,
        point: &SurfacePoint,
        values: &[T],
    ) -> T {
        let [a, b, c] = self.triangles[point.triangle as usize].map(|i| values[i as usize]);
        a * (1.0 - point.u - point.v) + b * point.u + c * point.v
    }

    /// Where the right of `texture` is at a point (any length), and 1 where its up is normal × right, else −1. Without tangents
    /// that of the triangle as it is laid out (without a texture by the first set of coordinates). None: it is not laid out at all.
    pub fn tangent(&self, point: &SurfacePoint, texture: Option<&Texture>) -> Option<(Vec3, f32)> {
        if !self.tangents.is_empty() {
            let corners = self.triangles[point.triangle as usize].map(|i| self.tangents[i as usize]);
            if corners.iter().all(|tangent| tangent.w != 0.0) {
                let up = corners[0].w.signum();
                return Some((self.between(point, &self.tangents).xyz(), up));
            }
        }
        let uvs = &self.uvs[texture.map_or(0, |texture| usize::from(texture.set & 1))];
        if uvs.is_empty() {
            return None;
        }
        let [a, b, c] = self.corners(point.triangle);
        let [ta, tb, tc] = self.triangles[point.triangle as usize].map(|i| uvs[i as usize]);
        let turn = texture.map_or(Mat2::IDENTITY, |texture| texture.transform.matrix2);
        let [first, second] = [tb - ta, tc - ta].map(|step| turn * step);
        // The image's second coordinate runs down.
        let turned = first.perp_dot(second);
        let right = (second.y * (b - a) - first.y * (c - a)) * turned.signum();
        (turned != 0.0 && turned.is_finite()).then_some((right, -turned.signum()))
    }

    /// How the interpolated normal of `triangle` changes with a small `step` (m) in its plane from barycentric (1 − u − v, u, v), m⁻¹
    /// times m.
    pub fn bend(&self, triangle: u32, u: f32, v: f32, step: Vec3) -> Vec3 {
        let [na, nb, nc] = self.triangles[triangle as usize].map(|i| self.normals[i as usize]);
        let [du, dv] = self.barycentric_step(triangle, step);
        let sum = (1.0 - u - v) * na + u * nb + v * nc;
        let length = sum.length();
        let (normal, change) = (sum / length, du * (nb - na) + dv * (nc - na));
        (change - normal * normal.dot(change)) / length
    }
}

impl Mesh {
    /// By how much the weights of the second and third corner change with a `step` (m) in the plane of a triangle.
    pub(super) fn barycentric_step(&self, triangle: u32, step: Vec3) -> [f32; 2] {
        let [a, b, c] = self.corners(triangle);
        let (right, up) = (b - a, c - a);
        let across = right.cross(up);
        let scale = across / across.length_squared();
        [step.cross(up).dot(scale), right.cross(step).dot(scale)]
    }
}

impl SurfacePoint {
    /// Where a ray that leaves in `direction` starts: off the surface by no more than the rounding error of the
    /// position demands, on the side it leaves to (pbrt 4th ed., §6.8.6). No constant in world units.
    #[inline(always)]
    pub fn origin_towards(&self, direction: Vec3) -> Vec3 {
        let n = self.normals.geometric;
        let distance = self.error.dot(n.abs());
        let offset = if n.dot(direction) < 0.0 { -distance * n } else { distance * n };
        let moved = self.position + offset;
        // Round away from the surface, so that adding a tiny offset to a large coordinate is not lost.
        let away = |p: f32, o: f32| match o {
            o if o > 0.0 => p.next_up(),
            o if o < 0.0 => p.next_down(),
            _ => p,
        };
        Vec3::new(away(moved.x, offset.x), away(moved.y, offset.y), away(moved.z, offset.z))
    }
}

/// The bound nε/(1 − nε) of n roundings in f32 (Higham 2002), with ε = 2⁻²⁴.
pub const fn gamma(n: u32) -> f32 {
    let ne = n as f32 * (f32::EPSILON * 0.5);
    ne / (1.0 - ne)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_bend_as_steps_along_the_triangle_show() {
        let mesh = Mesh {
            positions: vec![Vec3::new(0.1, 0.0, 0.2), Vec3::new(1.3, 0.2, 0.0), Vec3::new(0.2, 0.9, 0.4)],
            normals: [Vec3::new(-0.3, 0.1, 1.0), Vec3::new(0.5, -0.2, 1.0), Vec3::new(0.1, 0.6, 0.9)]
                .map(Vec3::normalize)
                .to_vec(),
            triangles: vec![[0, 1, 2]],
            surface: vec![0],
            ..Mesh::default()
        };
        let [a, b, c] = mesh.corners(0);
        let at = |u, v| mesh.point(0, u, v, true).normals.shading;
        for (u, v) in [(0.2, 0.3), (0.6, 0.1), (0.1, 0.8)] {
            for (du, dv) in [(1e-2, 0.0), (0.0, 1e-2), (-7e-3, 4e-3)] {
                let step = 2.0 * (du * (b - a) + dv * (c - a));
                let expected = at(u + du, v + dv) - at(u - du, v - dv);
                let bend = mesh.bend(0, u, v, step);
                assert!(bend.distance(expected) < 2e-3 * expected.length(), "{bend} for {expected}");
            }
        }
    }
}
