//! The irradiance of a uniformly bright triangle or quadrilateral that nothing hides: Lambert's closed form.
//!
//! E / L = ½ Σ γᵢ (n · mᵢ) over the edges of the part of the polygon above the horizon, where γᵢ is the angle that edge i
//! subtends and mᵢ the unit normal of the plane through it and the eye (J. H. Lambert 1760; J. Arvo 1995,
//! *Analytic methods for simulated light transport*, eq. 4.14).

use crate::optics::Normals;
use crate::scene::{Emission, Luminaire, Scene, SurfacePoint};
use glam::{DVec3, Vec3};

/// Corners of a quadrilateral that two planes may have cut.
const CORNERS: usize = 6;

/// Four corners lie in a plane if none is farther from it than this share of the distances between them.
const FLAT: f32 = 1e-6;

/// A convex flat piece of a luminaire.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    /// Counter-clockwise as its front sees them.
    corners: [Vec3; 4],
    /// How many of them there are, three or four.
    count: usize,
    /// Unit normal of its front.
    front: Vec3,
    plane: Plane,
    /// What it radiates.
    pub emission: Emission,
}

impl Facet {
    /// The triangles among `luminaires`, by index; pairs that make a convex quadrilateral are one facet, which has four
    /// edges for six.
    pub fn of(scene: &Scene, luminaires: &[u32]) -> Vec<Self> {
        let mut facets: Vec<Self> = Vec::new();
        for &i in luminaires {
            let Luminaire::Triangle { triangle, part: None, emission, .. } = scene.luminaires[i as usize]
            else {
                continue;
            };
            let [a, b, c] = scene.mesh.corners(triangle);
            let facet = Self {
                corners: [a, b, c, c],
                count: 3,
                front: scene.mesh.normal(triangle),
                plane: Plane::through([a, b, c]),
                emission,
            };
            match facets.iter_mut().find_map(|other| other.joined(&facet).map(|whole| (other, whole))) {
                Some((half, whole)) => *half = whole,
                None => facets.push(facet),
            }
        }
        facets
    }

    /// This triangle and `other` as one quadrilateral. None where they do not make a convex one of one brightness.
    fn joined(&self, other: &Self) -> Option<Self> {
        if self.count != 3 || other.count != 3 || self.emission != other.emission {
            return None;
        }
        let (i, j) = (0..9).map(|k| (k / 3, k % 3)).find(|(i, j)| {
            self.edge(*i) == {
                let [a, b] = other.edge(*j);
                [b, a]
            }
        })?;
        let [a, b] = self.edge(i);
        let (own, far) = (self.corners[(i + 2) % 3], other.corners[(j + 2) % 3]);
        let mut quad = Self { corners: [a, far, b, own], count: 4, ..self.clone() };
        let longest = quad.corners.iter().map(|corner| corner.distance(own)).fold(0.0, f32::max);
        let flat = (far - a).dot(self.front).abs() <= FLAT * longest;
        let convex = (0..4).all(|k| {
            let ([p, q], [_, r]) = (quad.edge(k), quad.edge((k + 1) % 4));
            (q - p).cross(r - q).dot(self.front) > 0.0
        });
        quad.plane = Plane::through([a, far, b]);
        quad.plane.uneven = quad.plane.height(own).abs();
        (flat && convex).then_some(quad)
    }

    /// From corner `i` to the next.
    fn edge(&self, i: usize) -> [Vec3; 2] {
        [self.corners[i], self.corners[(i + 1) % self.count]]
    }

    /// True when its light reaches `point`.
    pub fn shines_on(&self, point: &SurfacePoint) -> bool {
        self.plane.lights(point, self.emission.two_sided)
    }

    /// ∫ |w·ns| dw over the directions w (unit vectors, sr) from `eye` that meet the facet on the side of `up`: what its
    /// radiance is multiplied by for irradiance. As in [`Normals::counts`], both normals must agree on the side.
    pub fn projected_solid_angle(&self, eye: Vec3, normals: &Normals, front: bool) -> f32 {
        let side = if front { 1.0 } else { -1.0 };
        let (geometric, shading) = (side * normals.geometric.as_dvec3(), side * normals.shading.as_dvec3());
        let mut polygon = Polygon { corners: [DVec3::ZERO; CORNERS], count: self.count };
        for (to, corner) in polygon.corners.iter_mut().zip(&self.corners[..self.count]) {
            *to = (*corner - eye).as_dvec3();
        }
        polygon.cut(geometric);
        if normals.shading != normals.geometric {
            polygon.cut(shading);
        }
        (0.5 * polygon.edges(|a, b| vector_angle(a, b).dot(shading)).abs()) as f32
    }
}

/// The plane of a flat luminaire.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    place: DVec3,
    /// Unit, of the front.
    normal: DVec3,
    /// Of the normal, without signs: what an error box reaches along it.
    across: Vec3,
    /// No corner of what lies in it is farther from it, m.
    uneven: f64,
}

impl Plane {
    /// Through a triangle, counter-clockwise as its front sees it.
    pub fn through(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a).normalize();
        Self { place: a, normal, across: normal.abs().as_vec3(), uneven: 0.0 }
    }

    /// How high `place` lies above the front, m.
    fn height(&self, place: Vec3) -> f64 {
        self.normal.dot(place.as_dvec3() - self.place)
    }

    /// True where a luminaire in it can light `point`: that it lies before the plane, and not only by the rounding of its own
    /// place. A lamp would light itself, seen from within its plane as half of all there is.
    pub fn lights(&self, point: &SurfacePoint, two_sided: bool) -> bool {
        let height = self.height(point.position);
        let unsure = self.uneven + f64::from(point.error.dot(self.across));
        if two_sided { height.abs() > unsure } else { height > unsure }
    }
}

/// The angle between two vectors, rad, along the unit normal of their plane. Zero where they are parallel.
fn vector_angle(a: DVec3, b: DVec3) -> DVec3 {
    let across = a.cross(b);
    let sine = across.length();
    if sine == 0.0 { DVec3::ZERO } else { across * (sine.atan2(a.dot(b)) / sine) }
}

/// A convex polygon, seen from the origin.
struct Polygon {
    corners: [DVec3; CORNERS],
    count: usize,
}

impl Polygon {
    /// Keeps what lies on the side of `normal` of the plane through the origin.
    fn cut(&mut self, normal: DVec3) {
        let heights = self.corners.map(|corner| corner.dot(normal));
        if heights[..self.count].iter().all(|height| *height >= 0.0) {
            return;
        }
        let (whole, count) = (self.corners, self.count);
        self.count = 0;
        for i in 0..count {
            let j = (i + 1) % count;
            let (a, b) = (heights[i], heights[j]);
            if a >= 0.0 {
                self.push(whole[i]);
            }
            if (a >= 0.0) != (b >= 0.0) {
                self.push((whole[i] * b - whole[j] * a) / (b - a));
            }
        }
    }

    fn push(&mut self, corner: DVec3) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    fn edges(&self, value: impl Fn(DVec3, DVec3) -> f64) -> f64 {
        (0..self.count).map(|i| value(self.corners[i], self.corners[(i + 1) % self.count])).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Light;
    use crate::sampling::{Rng, Stream, warp};

    /// Form factor × π of a parallel rectangle a × b with a corner straight above, at height h (Lambert).
    fn rectangle(a: f64, b: f64, h: f64) -> f64 {
        let (x, y) = (a / h, b / h);
        let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        0.5 * (x / p * (y / p).atan() + y / q * (x / q).atan())
    }

    fn triangle([a, b, c]: [Vec3; 3]) -> Facet {
        let emission = Emission { radiance: Light::ZERO, two_sided: false };
        Facet {
            corners: [a, b, c, c],
            count: 3,
            front: (b - a).cross(c - a).normalize(),
            plane: Plane::through([a, b, c]),
            emission,
        }
    }

    fn seen(corners: [Vec3; 3], normals: &Normals, front: bool) -> f32 {
        triangle(corners).projected_solid_angle(Vec3::ZERO, normals, front)
    }

    /// A parallelogram, as two triangles and as one facet: the same.
    fn two(corner: Vec3, a: Vec3, b: Vec3, normals: &Normals) -> f64 {
        let triangles = [[corner, corner + a, corner + a + b], [corner, corner + a + b, corner + b]];
        let apart: f64 = triangles.iter().map(|corners| f64::from(seen(*corners, normals, true))).sum();
        let whole = triangle(triangles[0]).joined(&triangle(triangles[1])).expect("a parallelogram");
        let whole = f64::from(whole.projected_solid_angle(Vec3::ZERO, normals, true));
        assert!((whole - apart).abs() <= 1e-6 * apart, "{whole} as one, {apart} as two");
        whole
    }

    #[test]
    fn only_triangles_that_make_a_convex_quadrilateral_are_joined() {
        let [o, x, y] = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let base = triangle([o, x, y]);
        let joins = |corners| base.joined(&triangle(corners)).is_some();
        assert!(joins([x, x + y, y]) && joins([x + y, y, x]), "a square, whichever corner comes first");
        assert!(!joins([o, -y, x]), "its corners lie in a line");
        assert!(!joins([o, Vec3::new(2.5, -1.0, 0.0), x]), "it is not convex");
        assert!(!joins([x, Vec3::new(1.0, 1.0, 1e-4), y]), "it is bent");
        assert!(!joins([y, x + y, x]), "one of them looks the other way");
        assert!(!joins([x + y, y + y, y]), "they share a corner only");
        let bright = Facet {
            emission: Emission { radiance: Light::ZERO, two_sided: true },
            ..triangle([x, x + y, y])
        };
        assert!(base.joined(&bright).is_none());
    }

    #[test]
    fn of_a_rectangle_overhead() {
        let up = Normals::flat(Vec3::Z);
        for (a, b, h) in
            [(1.0_f32, 1.0_f32, 1.0_f32), (0.01, 0.02, 3.0), (50.0, 20.0, 0.1), (1e-4, 1e-4, 1.0)]
        {
            let got = two(Vec3::new(0.0, 0.0, h), a * Vec3::X, b * Vec3::Y, &up);
            let expected = rectangle(a.into(), b.into(), h.into());
            assert!((got / expected - 1.0).abs() < 1e-6, "{a} x {b} at {h}: {got} for {expected}");
            assert!((got / (1.02 * expected) - 1.0).abs() > 0.01);
        }
    }

    #[test]
    fn a_wall_that_reaches_below_the_horizon_counts_above_it() {
        // A wall from −1 to 1 of height is as bright as its upper half.
        let up = Normals::flat(Vec3::Z);
        let wall = |z: f32| two(Vec3::new(2.0, -1.0, z), Vec3::new(0.0, 0.0, 1.0 - z), 2.0 * Vec3::Y, &up);
        assert!((wall(-1.0) / wall(0.0) - 1.0).abs() < 1e-6, "{} {}", wall(-1.0), wall(0.0));
        assert!(wall(0.0) > 0.0 && (wall(0.02) / wall(0.0) - 1.0).abs() > 1e-4);
    }

    #[test]
    fn nothing_from_below_and_all_of_the_sky_from_a_huge_triangle() {
        let up = Normals::flat(Vec3::Z);
        let below = [Vec3::new(-1.0, -1.0, -1.0), Vec3::new(1.0, -1.0, -1.0), Vec3::new(0.0, 1.0, -1.0)];
        assert_eq!(seen(below, &up, true), 0.0);
        let seen_from_behind = seen(below, &up, false);
        assert!(seen_from_behind > 0.1);
        let far = 1e4_f32;
        let sky = [Vec3::new(-far, -far, 1.0), Vec3::new(far, -far, 1.0), Vec3::new(0.0, far, 1.0)];
        let all = seen(sky, &up, true);
        assert!((all / std::f32::consts::PI - 1.0).abs() < 1e-3, "{all}");
    }

    #[test]
    fn random_triangles_and_bent_normals_agree_with_counting_directions() {
        let mut rng = Rng::new(11, Stream::Test, 0, 0);
        for _ in 0..12 {
            let mut place = || Vec3::from(rng.f32x3()) * 3.0 - 1.5;
            let corners = [place(), place(), place()];
            let bent = Normals::new(Vec3::Z, (Vec3::Z + 0.4 * place()).normalize());
            let n = 400_000;
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..n {
                let to = warp::sphere(rng.f32x2());
                let [a, b, c] = corners;
                let inside = |x: Vec3, y: Vec3| x.cross(y).dot(to);
                let (p, q, r) = (inside(a, b), inside(b, c), inside(c, a));
                let all = (p >= 0.0 && q >= 0.0 && r >= 0.0) || (p <= 0.0 && q <= 0.0 && r <= 0.0);
                let across = (b - a).cross(c - a);
                let meets = all && across.dot(a) * across.dot(to) > 0.0;
                if meets && to.dot(bent.geometric) > 0.0 && to.dot(bent.shading) > 0.0 {
                    let value = f64::from(4.0 * std::f32::consts::PI * to.dot(bent.shading));
                    sum += value;
                    squares += value * value;
                }
            }
            let n = f64::from(n);
            let (mean, error) = (sum / n, ((squares / n - (sum / n).powi(2)) / n).sqrt());
            let got = f64::from(seen(corners, &bent, true));
            assert!((got - mean).abs() <= 4.0 * error + 1e-6, "{got} for {mean} ± {error}");
        }
    }
}
