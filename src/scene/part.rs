//! Parts of triangles that do not shine alike all over.

use std::collections::HashMap;

/// A part of a triangle: all of it, or one of the four that halves of its edges make, or one of the four of such a part, and so on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Part {
    /// Two bits a level, from the top: 0 to 2 at that corner, 3 in the middle. The rest are zero.
    path: u32,
    /// Levels.
    depth: u8,
}

/// What to do with weights of a triangle's second and third corner.
type Weights = [f32; 2];

impl Part {
    /// All of a triangle.
    pub const WHOLE: Self = Self { path: 0, depth: 0 };
    /// Parts have no parts beyond so many levels.
    pub const DEEPEST: u32 = u32::BITS / 2;

    /// How often edges were halved.
    pub fn depth(self) -> u32 {
        u32::from(self.depth)
    }

    /// The bits of its path, and their number.
    pub(super) fn bits(self) -> (u32, u32) {
        (self.path, self.depth())
    }

    /// Its parts. None: it is one of the smallest.
    pub fn quarters(self) -> Option<[Self; 4]> {
        let shift = u32::BITS.checked_sub(2 * (self.depth() + 1))?;
        Some([0, 1, 2, 3].map(|quarter| Self { path: self.path | quarter << shift, depth: self.depth + 1 }))
    }

    /// Its share of the triangle's area.
    pub fn share(self) -> f32 {
        0.25_f32.powi(i32::from(self.depth))
    }

    /// Its corners, in the triangle's weights.
    pub fn corners(self) -> [Weights; 3] {
        let mut corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        for level in 0..self.depth() {
            let [a, b, c] = corners;
            let half = |p: Weights, q: Weights| [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
            let (ab, bc, ca) = (half(a, b), half(b, c), half(c, a));
            corners = match self.path >> (u32::BITS - 2 * (level + 1)) & 3 {
                0 => [a, ab, ca],
                1 => [ab, b, bc],
                2 => [ca, bc, c],
                _ => [bc, ca, ab],
            };
        }
        corners
    }

    /// From weights of its own corners to those of the triangle's.
    pub fn place(self, [u, v]: Weights) -> Weights {
        let [a, b, c] = self.corners();
        [0, 1].map(|i| a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]))
    }

    /// The last path that leads into it.
    fn last(self) -> u32 {
        self.path | u32::MAX.checked_shr(2 * self.depth()).unwrap_or(0)
    }
}

/// The path to the smallest part at a place of a triangle.
fn path_to([mut u, mut v]: Weights) -> u32 {
    let mut path = 0;
    for _ in 0..Part::DEEPEST {
        let quarter;
        (quarter, u, v) = if u >= 0.5 {
            (1, 2.0 * u - 1.0, 2.0 * v)
        } else if v >= 0.5 {
            (2, 2.0 * u, 2.0 * v - 1.0)
        } else if u + v <= 0.5 {
            (0, 2.0 * u, 2.0 * v)
        } else {
            (3, 1.0 - 2.0 * u, 1.0 - 2.0 * v)
        };
        path = path << 2 | quarter;
    }
    path
}

/// What is known of parts of triangles, no two of which overlap.
#[derive(Clone, Debug, Default)]
pub(crate) struct Parts<T>(HashMap<u32, Vec<(Part, T)>>);

impl<T: Copy> Parts<T> {
    /// Of these parts of triangles.
    pub fn new(all: impl IntoIterator<Item = (u32, Part, T)>) -> Self {
        let mut parts: HashMap<u32, Vec<(Part, T)>> = HashMap::new();
        for (triangle, part, known) in all {
            parts.entry(triangle).or_default().push((part, known));
        }
        parts.values_mut().for_each(|parts| parts.sort_by_key(|(part, _)| *part));
        Self(parts)
    }

    /// What is known of the part of `triangle` at a place. None: nothing is.
    pub fn at(&self, triangle: u32, place: Weights) -> Option<T> {
        if self.0.is_empty() {
            return None;
        }
        let parts = self.0.get(&triangle)?;
        let path = path_to(place);
        let (part, known) = parts[..parts.partition_point(|(part, _)| part.path <= path)].last()?;
        (path <= part.last()).then_some(*known)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sobol, warp};

    #[test]
    fn places_are_found_in_the_part_they_are_of() {
        let quarters = |part: Part| part.quarters().expect("not the smallest");
        // One that is kept as it is, one whose parts are kept, one that is left out.
        let [first, second, _, middle] = quarters(Part::WHOLE);
        let mut all: Vec<Part> = quarters(second).into_iter().chain([middle]).collect();
        all.extend(quarters(quarters(first)[3]));
        let parts = Parts::new(all.iter().enumerate().rev().map(|(i, part)| (7, *part, i)));
        let sobol = Sobol::new(3);
        for (i, part) in all.iter().enumerate() {
            for n in 0..200 {
                let place = part.place(warp::triangle(sobol.point(n, 0)));
                assert_eq!(parts.at(7, place), Some(i), "{place:?}");
                assert_eq!(parts.at(8, place), None);
            }
        }
        for n in 0..200 {
            let nowhere = quarters(Part::WHOLE)[2].place(warp::triangle(sobol.point(n, 0)));
            assert_eq!(parts.at(7, nowhere), None, "{nowhere:?}");
        }
    }

    #[test]
    fn quarters_make_up_their_part_to_the_smallest() {
        let area = |part: Part| {
            let [[ax, ay], [bx, by], [cx, cy]] = part.corners();
            (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        };
        let mut part = Part::WHOLE;
        for level in 0..Part::DEEPEST {
            assert!(area(part) == part.share() && part.depth() == level);
            part = part.quarters().expect("not the smallest")[level as usize % 4];
            let [u, v] = part.place([0.3, 0.3]);
            assert_eq!(Parts::new([(0, part, ())]).at(0, [u, v]), Some(()));
        }
        assert!(part.quarters().is_none());
        assert!(Parts::new([(0, Part::WHOLE, ())]).at(0, [0.2, 0.7]).is_some());
    }
}
