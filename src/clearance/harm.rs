//! Whether one triangle makes a disk another than it seems.

use crate::rims::{PLANE_SHARE, SAME_SIDE_COSINE, Tangent};
use glam::{Vec2, Vec3};

/// How far the disk's own sheet may leave its plane, as a share of the radius: at a bend of 36° photons miss then a hundredth of what
/// they should find.
const BEND: f32 = 0.15;
/// What stands no higher than this share of the radius above the plane is taken to lie in it.
const LEVEL: f32 = 0.004;

/// What must be clear about a disk.
#[derive(Clone, Copy)]
pub(super) struct Ball {
    /// m.
    pub radius: f32,
    /// Heights (m) of what lies in the plane, and of where photons count.
    pub level: f32,
    pub slab: f32,
    /// How far its own sheet may leave the plane, m.
    pub bend: f32,
    /// Own surface that faces the same way within this cosine does not bend.
    pub straight: f32,
}

impl Ball {
    pub fn new(radius: f32) -> Self {
        Self {
            radius,
            level: LEVEL * radius,
            slab: PLANE_SHARE * radius,
            bend: BEND * radius,
            // The cosine of a bend that even the whole radius cannot make too high.
            straight: 0.9889,
        }
    }

    /// For all disks up to `radius` in a ball of `reach`, whose sheet must be so straight.
    pub fn of_many(reach: f32, radius: f32, straight: f32) -> Self {
        Self { radius: reach, level: 0.0, slab: PLANE_SHARE * radius + LEVEL * reach, bend: 0.0, straight }
    }
}

/// A triangle beside a disk.
pub(super) struct Other {
    /// Seen from the disk.
    corners: [Vec3; 3],
    /// Between its normal and that of the disk.
    cos: f32,
    own: bool,
    two_sided: bool,
}

impl Other {
    pub fn new(disk: &Tangent, corners: &[Vec3; 3], normal: Vec3, sheet: u32, two_sided: bool) -> Self {
        let own = sheet == disk.sheet;
        Self {
            corners: corners.map(|corner| disk.flat(corner)),
            cos: normal.dot(disk.normal),
            own,
            two_sided,
        }
    }

    /// The way (in the disk's plane, m) to what of it makes the disk within the ball another than it seems. None: nothing does.
    pub fn harms(&self, ball: &Ball) -> Option<Vec2> {
        if self.own && self.cos.abs() <= SAME_SIDE_COSINE {
            // Where a sheet bends so far it ends for the disk, without a rim that would say so.
            return self.nearest(ball, f32::NEG_INFINITY);
        }
        if self.own && self.cos > 0.0 {
            return if self.keeps_to_plane(ball) { None } else { self.nearest(ball, f32::NEG_INFINITY) };
        }
        let counts = if self.two_sided { self.cos.abs() } else { self.cos } > SAME_SIDE_COSINE;
        let from = if counts { -ball.slab } else { ball.level };
        self.nearest(ball, from)
    }

    /// It goes on as the disk's plane does.
    fn keeps_to_plane(&self, ball: &Ball) -> bool {
        if self.cos >= ball.straight {
            return true;
        }
        let heights = self.corners.map(|corner| corner.z.abs());
        if heights.into_iter().fold(0.0, f32::max) <= ball.bend {
            return true;
        }
        let nearest = nearest(&self.corners);
        let left = ball.radius - nearest.length();
        let slope = (1.0 - self.cos * self.cos).max(0.0).sqrt();
        left <= 0.0 || nearest.z.abs() + slope * left <= ball.bend
    }

    /// The way to the nearest of what lies above this height, if that is within the ball.
    fn nearest(&self, ball: &Ball, height: f32) -> Option<Vec2> {
        let part = if self.corners.iter().all(|corner| corner.z >= height) {
            nearest(&self.corners)
        } else {
            let (above, n) = above(&self.corners, height);
            match n {
                3 => nearest(&[above[0], above[1], above[2]]),
                4 => {
                    let halves = [[above[0], above[1], above[2]], [above[0], above[2], above[3]]];
                    let [a, b] = halves.map(|half| nearest(&half));
                    if a.length_squared() < b.length_squared() { a } else { b }
                }
                _ => return None,
            }
        };
        (part.length_squared() < ball.radius * ball.radius).then(|| part.truncate())
    }
}

/// The part of a triangle above a height: its corners, and how many.
fn above(corners: &[Vec3; 3], height: f32) -> ([Vec3; 4], usize) {
    let (mut part, mut n) = ([Vec3::ZERO; 4], 0);
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        if a.z >= height {
            part[n] = a;
            n += 1;
        }
        if (a.z >= height) != (b.z >= height) {
            part[n] = a + (b - a) * ((height - a.z) / (b.z - a.z));
            n += 1;
        }
    }
    (part, n)
}

/// The point of a triangle that is nearest to zero (C. Ericson 2004, *Real-Time Collision Detection*, §5.1.5).
fn nearest(&[a, b, c]: &[Vec3; 3]) -> Vec3 {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (-ab.dot(a), -ac.dot(a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (-ab.dot(b), -ac.dot(b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let (d5, d6) = (-ab.dot(c), -ac.dot(c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    if sum == 0.0 { a } else { a + ab * (vb / sum) + ac * (vc / sum) }
}
