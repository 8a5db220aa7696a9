//! Pictures on the sides of a cube, made into a panorama.

use super::Panorama;
use glam::{Mat3, Vec2, Vec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// What is seen from the middle of a cube: six square pictures of one size on +x, −x, +y, −y, +z and −z, as one sees them from
/// within. The upper edge of that on +y lies on −z, of that on −y on +z, of the others on +y.
pub(crate) struct Cube {
    /// Texels of a row.
    side: u32,
    /// Linear RGB radiance, row by row from the upper left, finite and not negative; with a border of one texel, which shows what
    /// lies beyond the edge.
    faces: [Vec<[f32; 3]>; 6],
}

/// Where faces lie and where their upper edges do.
const FACES: [(Vec3, Vec3); 6] = [
    (Vec3::X, Vec3::Y),
    (Vec3::NEG_X, Vec3::Y),
    (Vec3::Y, Vec3::NEG_Z),
    (Vec3::NEG_Y, Vec3::Z),
    (Vec3::Z, Vec3::Y),
    (Vec3::NEG_Z, Vec3::Y),
];

/// Rows of a panorama: as many as show how coarse faces go over into one another.
const FEWEST_ROWS: u32 = 256;
/// As many as are made in seconds: 8 million texels.
const MOST_ROWS: u32 = 2048;
/// Places across and down a texel of a panorama of so many rows at which a cube is looked up: so many that a single bright texel
/// keeps its power.
fn split(side: u32, rows: u32) -> u32 {
    (8 * side / rows).clamp(2, 4)
}

impl Cube {
    /// Of faces of `side` × `side` texels, which are finite and not negative.
    pub fn new(side: u32, faces: &[Vec<[f32; 3]>; 6]) -> Self {
        let count = side as usize * side as usize;
        assert!(side > 0 && faces.iter().all(|face| face.len() == count), "six faces of {side} × {side}");
        Self { side, faces: std::array::from_fn(|face| bordered(side, faces, face)) }
    }

    /// The same light as a panorama, as fine as the cube is on average.
    pub fn panorama(&self) -> Panorama {
        let height = (2 * self.side).clamp(FEWEST_ROWS, MOST_ROWS);
        let width = 2 * height;
        let split = split(self.side, height);
        let turns: Vec<Vec2> = (0..width * split)
            .map(|i| TAU * ((f64::from(i) + 0.5) / f64::from(width * split) - 0.5))
            .map(|turn| Vec2::new(turn.cos() as f32, turn.sin() as f32))
            .collect();
        let row = |y: u32| {
            let heights = heights(y, height, split);
            let columns: Vec<Vec3> =
                turns.chunks_exact(split as usize).map(|turns| self.mean(turns, &heights)).collect();
            columns
        };
        Panorama::of_texels(width, height, (0..height).into_par_iter().flat_map_iter(row).collect())
    }

    /// The mean over places, by the cosine and sine of their turn and by their height on the unit sphere.
    fn mean(&self, turns: &[Vec2], heights: &[f32]) -> Vec3 {
        let to = |turn: &Vec2, up: f32| {
            let flat = ((1.0 - up) * (1.0 + up)).sqrt() * *turn;
            Vec3::new(flat.x, up, flat.y)
        };
        let seen = heights.iter().flat_map(|up| turns.iter().map(|turn| self.seen(to(turn, *up))));
        seen.sum::<Vec3>() / (turns.len() * heights.len()) as f32
    }

    /// What is seen in a direction of any length.
    fn seen(&self, to: Vec3) -> Vec3 {
        let (face, place) = locate(to);
        self.at(face, place)
    }

    /// Bilinear between the middles of texels, across edges too.
    fn at(&self, face: usize, place: [f32; 2]) -> Vec3 {
        let [(left, across), (above, down)] = place.map(|place| {
            let x = place * self.side as f32 + 0.5;
            let low = (x as u32).min(self.side);
            (low, x - low as f32)
        });
        let texel = |x: u32, y: u32| {
            Vec3::from_array(self.faces[face][y as usize * (self.side as usize + 2) + x as usize])
        };
        let row = |y: u32| texel(left, y).lerp(texel(left + 1, y), across);
        row(above).lerp(row(above + 1), down)
    }
}

/// The face that a direction of any length meets, and the place on it from its upper left, 0 to 1.
fn locate(to: Vec3) -> (usize, [f32; 2]) {
    let size = to.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let face = 2 * axis + usize::from(to[axis] < 0.0);
    let place = axes(face).transpose() * to / size[axis];
    (face, [0.5 + 0.5 * place.x, 0.5 - 0.5 * place.y])
}

/// To the right, up and ahead of who looks at a face.
fn axes(face: usize) -> Mat3 {
    let (ahead, up) = FACES[face];
    Mat3::from_cols(ahead.cross(up), up, ahead)
}

/// A face with the texels of its neighbours around it; at a corner the mean of the three that meet there.
fn bordered(side: u32, faces: &[Vec<[f32; 3]>; 6], face: usize) -> Vec<[f32; 3]> {
    let last = side - 1;
    let texel = |face: usize, x: u32, y: u32| Vec3::from_array(faces[face][(y * side + x) as usize]);
    // From −1 to `side`: what lies straight ahead there.
    let beyond = |x: i64, y: i64| {
        let share = |i: i64| (2.0 * i as f32 + 1.0) / side as f32 - 1.0;
        let (face, place) = locate(axes(face) * Vec3::new(share(x), -share(y), 1.0));
        let [x, y] = place.map(|place| ((place * side as f32) as u32).min(last));
        texel(face, x, y)
    };
    let all = -1..=i64::from(side);
    let inside = |i: i64| i.clamp(0, i64::from(last));
    let at = |(x, y): (i64, i64)| {
        let (near_x, near_y) = (inside(x), inside(y));
        let own = || texel(face, near_x as u32, near_y as u32);
        match (x == near_x, y == near_y) {
            (true, true) => own(),
            (false, false) => (own() + beyond(x, near_y) + beyond(near_x, y)) / 3.0,
            _ => beyond(x, y),
        }
        .to_array()
    };
    all.clone().flat_map(|y| all.clone().map(move |x| (x, y))).map(at).collect()
}

/// Heights on the unit sphere in the middles of `split` parts of row `y` that have the same solid angle.
fn heights(y: u32, rows: u32, split: u32) -> Vec<f32> {
    let edge = |y: u32| (PI * f64::from(y) / f64::from(rows)).cos();
    let (top, bottom) = (edge(y), edge(y + 1));
    let share = |i: u32| (f64::from(i) + 0.5) / f64::from(split);
    (0..split).map(|i| (top + share(i) * (bottom - top)) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::environment::distribution::integral;

    /// Solid angle from the middle of a face to the corner (x, y) of a rectangle on it, the face being at distance 1.
    fn corner(x: f64, y: f64) -> f64 {
        (x * y).atan2((x * x + y * y + 1.0).sqrt())
    }

    /// Of a texel of a face.
    fn solid_angle(side: u32, [x, y]: [u32; 2]) -> f64 {
        let edge = |i: u32| 2.0 * f64::from(i) / f64::from(side) - 1.0;
        let [a, b, c, d] = [edge(x), edge(x + 1), edge(y), edge(y + 1)];
        corner(b, d) - corner(a, d) - corner(b, c) + corner(a, c)
    }

    fn dark(side: u32) -> [Vec<[f32; 3]>; 6] {
        std::array::from_fn(|_| vec![[0.0; 3]; side as usize * side as usize])
    }

    #[test]
    fn a_panorama_has_the_power_of_each_texel_of_its_cube() {
        for (side, face, texel) in [
            (128, 0, [64, 64]),
            (128, 1, [0, 64]),
            (128, 2, [3, 90]),
            (128, 3, [127, 127]),
            (128, 2, [0, 127]),
            (128, 5, [127, 1]),
            (64, 4, [63, 0]),
            (16, 5, [3, 2]),
        ] {
            let mut faces = dark(side);
            faces[face][texel[1] as usize * side as usize + texel[0] as usize] = [1.0, 2.0, 1e4];
            let found = integral(&Cube::new(side, &faces).panorama());
            let expected = solid_angle(side, texel);
            let off = |over: f64| {
                let each = [1.0, 2.0, 1e4].map(|light| over * expected * light);
                each.iter().zip(found.to_array()).any(|(e, f)| (f64::from(f) / e - 1.0).abs() > 0.008)
            };
            assert!(!off(1.0), "{face}, {texel:?}: {found} for {expected}");
            assert!(off(1.02) && off(0.98));
        }
    }

    #[test]
    fn solid_angles_of_texels_fill_a_sphere() {
        let sum: f64 = (0..64).map(|i| solid_angle(8, [i % 8, i / 8])).sum();
        assert!((6.0 * sum / (2.0 * TAU) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn edges_and_corners_show_the_mean_of_the_faces_that_meet_there() {
        let faces: [Vec<[f32; 3]>; 6] = std::array::from_fn(|face| vec![[face as f32; 3]; 16]);
        let cube = Cube::new(4, &faces);
        let near = |to: Vec3| cube.seen(to).x;
        for (to, expected) in [
            (Vec3::X, 0.0),
            (Vec3::new(-1.0, 1.0, 0.3), 1.5),
            (Vec3::new(0.2, -1.0, -1.0), 4.0),
            (Vec3::new(1.0, 1.0, 1.0), 2.0),
            (Vec3::new(-1.0, -1.0, -1.0), 3.0),
        ] {
            for off in [Vec3::ZERO, 1e-6 * Vec3::X, 1e-6 * Vec3::Y, 1e-6 * Vec3::Z] {
                assert!((near(to + off) - expected).abs() < 1e-4, "{to}: {} for {expected}", near(to + off));
            }
        }
    }

    #[test]
    fn what_is_the_same_all_over_stays_so() {
        for side in [1, 3, 300] {
            let faces: [Vec<[f32; 3]>; 6] =
                std::array::from_fn(|_| vec![[0.3, 7.0, 255.0]; (side * side) as usize]);
            let panorama = Cube::new(side, &faces).panorama();
            assert_eq!(panorama.height(), (2 * side).max(256));
            for (x, y) in [(0, 0), (17, 200), (panorama.width() - 1, panorama.height() - 1)] {
                let off = panorama.at(x, y) / Vec3::new(0.3, 7.0, 255.0) - 1.0;
                assert!(off.abs().max_element() < 1e-6, "{off}");
            }
        }
    }
}
