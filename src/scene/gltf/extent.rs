//! The forms of lamps with an extent, as triangles.

use super::Reason;
use super::extras::{AREA, DISK, Extras, SPHERE, numbers};
use glam::{DAffine3, DVec3};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Corners of a disk.
const CORNERS: u32 = 64;

/// How often the edges of an icosahedron are halved: in any direction the sphere then sends as much as a round one to 0.3 %.
const HALVINGS: u32 = 2;

/// What there is instead of a point, in the space of the node, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Extent {
    /// Width along x and height along y of a rectangle about zero that shines along −Z.
    Area([f32; 2]),
    /// Radius of a disk about zero that shines along −Z.
    Disk(f32),
    /// Radius of a sphere about zero.
    Sphere(f32),
}

/// Triangles, and the points they connect.
pub(super) type Triangles = (Vec<DVec3>, Vec<[u32; 3]>);

impl Extent {
    /// What extras say of it. None: nothing.
    pub fn of(extras: &Extras) -> Result<Option<Self>, Reason> {
        let above = |x: &f32| *x > 0.0;
        let sides =
            |value: &_| numbers(value).filter(|sides: &[f32; 2]| sides.iter().all(|side| *side > 0.0));
        let found = [
            extras.read(AREA, "[width, height] in m, both above 0", sides)?.map(Self::Area),
            extras.number(DISK, "its radius in m, above 0", above)?.map(Self::Disk),
            extras.number(SPHERE, "its radius in m, above 0", above)?.map(Self::Sphere),
        ];
        let mut found = found.into_iter().flatten();
        match (found.next(), found.next()) {
            (Some(one), Some(other)) => Err(extras.wrong(&format!(
                "`{}` and `{}` both say what form it has; leave one out",
                one.key(),
                other.key()
            ))),
            (found, _) => Ok(found),
        }
    }

    /// Its key in extras.
    pub fn key(self) -> &'static str {
        match self {
            Self::Area(_) => AREA,
            Self::Disk(_) => DISK,
            Self::Sphere(_) => SPHERE,
        }
    }

    /// True where it shines to all sides.
    pub fn is_round(self) -> bool {
        matches!(self, Self::Sphere(_))
    }

    /// Numbers of triangles and of vertices.
    pub fn size(self) -> [u64; 2] {
        match self {
            Self::Area(_) => [2, 4],
            Self::Disk(_) => [u64::from(CORNERS), u64::from(CORNERS) + 1],
            Self::Sphere(_) => [20 << (2 * HALVINGS), 2 + (10 << (2 * HALVINGS))],
        }
    }

    /// In the world, counter-clockwise about what shines.
    pub fn placed(self, to_world: DAffine3) -> Triangles {
        let (mut corners, mut triangles) = self.triangles();
        corners.iter_mut().for_each(|corner| *corner = to_world.transform_point3(*corner));
        if to_world.matrix3.determinant() < 0.0 {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        (corners, triangles)
    }

    /// Of exactly the area of what it stands for.
    fn triangles(self) -> Triangles {
        match self {
            Self::Area(sides) => {
                let [x, y] = sides.map(|side| 0.5 * f64::from(side));
                let corners = [[-x, -y], [-x, y], [x, y], [x, -y]].map(|[x, y]| DVec3::new(x, y, 0.0));
                (corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
            }
            Self::Disk(radius) => {
                let corner = |i| {
                    let (sin, cos) = (TAU * f64::from(i) / f64::from(CORNERS)).sin_cos();
                    DVec3::new(cos, -sin, 0.0)
                };
                let corners = (0..CORNERS).map(corner).chain([DVec3::ZERO]).collect();
                let triangles = (0..CORNERS).map(|i| [CORNERS, i, (i + 1) % CORNERS]).collect();
                scaled((corners, triangles), PI * f64::from(radius).powi(2))
            }
            Self::Sphere(radius) => {
                let ball = (0..HALVINGS).fold(icosahedron(), |ball, _| halved(&ball));
                scaled(ball, 4.0 * PI * f64::from(radius).powi(2))
            }
        }
    }
}

/// Of all together, m².
pub(super) fn area(corners: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    triangles.iter().map(area).sum()
}

/// With so much area.
fn scaled((mut corners, triangles): Triangles, wanted: f64) -> Triangles {
    let scale = (wanted / area(&corners, &triangles)).sqrt();
    corners.iter_mut().for_each(|corner| *corner *= scale);
    (corners, triangles)
}

/// Its corners at unit distance from zero: those of three golden rectangles, each across the next.
fn icosahedron() -> Triangles {
    let (short, long) = (1.0, 0.5 * (1.0 + 5.0_f64.sqrt()));
    let corners = [[short, long], [-short, long], [short, -long], [-short, -long]];
    let corners = [0, 1, 2].into_iter().flat_map(|turn| {
        corners.map(|[a, b]| {
            let mut corner = [0.0, a, b];
            corner.rotate_left(turn);
            DVec3::from_array(corner).normalize()
        })
    });
    let triangles = [
        [0, 1, 8],
        [0, 10, 1],
        [0, 4, 5],
        [0, 8, 4],
        [0, 5, 10],
        [1, 7, 6],
        [1, 6, 8],
        [1, 10, 7],
        [2, 9, 3],
        [2, 3, 11],
        [2, 5, 4],
        [2, 4, 9],
        [2, 11, 5],
        [3, 6, 7],
        [3, 9, 6],
        [3, 7, 11],
        [4, 8, 9],
        [5, 11, 10],
        [6, 9, 8],
        [7, 10, 11],
    ];
    (corners.collect(), triangles.to_vec())
}

/// Four triangles for each, all corners at unit distance from zero.
fn halved((corners, triangles): &Triangles) -> Triangles {
    let mut corners = corners.clone();
    let mut middles = HashMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            corners.push((corners[a as usize] + corners[b as usize]).normalize());
            corners.len() as u32 - 1
        })
    };
    let quarters = |&[a, b, c]: &[u32; 3]| {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    };
    let triangles = triangles.iter().flat_map(quarters).collect();
    (corners, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::assembly::Closure;

    const ALL: [(Extent, f64); 3] =
        [(Extent::Area([0.5, 3.0]), 1.5), (Extent::Disk(0.5), 0.25 * PI), (Extent::Sphere(0.5), PI)];

    #[test]
    fn lamps_have_the_area_and_the_size_that_is_told() {
        for (extent, expected) in ALL {
            let (corners, triangles) = extent.triangles();
            let found = area(&corners, &triangles);
            assert!((found / expected - 1.0).abs() < 1e-12, "{extent:?}: {found} m² for {expected}");
            assert_eq!(extent.size(), [triangles.len() as u64, corners.len() as u64], "{extent:?}");
        }
    }

    #[test]
    fn flat_lamps_shine_along_the_axis_of_their_node_and_spheres_outward() {
        let mirrored = DAffine3::from_scale(DVec3::new(-1.0, 2.0, 1.0));
        for ((extent, _), to_world) in ALL.into_iter().flat_map(|e| [(e, DAffine3::IDENTITY), (e, mirrored)])
        {
            let (corners, triangles) = extent.placed(to_world);
            for triangle in &triangles {
                let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
                let ahead = if extent.is_round() { a + b + c } else { DVec3::NEG_Z };
                assert!((b - a).cross(c - a).dot(ahead) > 0.0, "{extent:?}: {triangle:?}");
            }
            assert_eq!(Closure::of(&corners, &triangles).closed, extent.is_round());
        }
    }

    #[test]
    fn a_sphere_shows_the_disk_it_stands_for_to_all_sides() {
        let (corners, triangles) = Extent::Sphere(1.0).triangles();
        let shown = |towards: DVec3| {
            let across = triangles.iter().map(|triangle| {
                let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
                0.5 * (b - a).cross(c - a).dot(towards)
            });
            across.filter(|across| *across > 0.0).sum::<f64>()
        };
        for i in 0..200 {
            let (sin, cos) = (2.4 * f64::from(i)).sin_cos();
            let z = (f64::from(i) + 0.5) / 100.0 - 1.0;
            let found = shown(DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z));
            assert!((found / PI - 1.0).abs() < 0.003, "{found} at {i}");
        }
    }
}
