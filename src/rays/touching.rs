//! Which triangles are touched by triangles of other solids, by their bounding boxes.

use crate::scene::gamma;
use glam::Vec3;

/// A box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

impl Bounds {
    /// Nothing.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// About some points, wider by what rounding of their coordinates may have moved them.
    pub fn of(points: [Vec3; 3]) -> Self {
        let about = |point: Vec3| {
            let error = gamma(7) * point.abs();
            Self { min: point - error, max: point + error }
        };
        points.into_iter().map(about).fold(Self::EMPTY, Self::with)
    }

    fn with(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Grows to hold another.
    pub fn add(&mut self, other: Self) {
        *self = self.with(other);
    }

    /// True where the two have a point in common.
    pub fn meets(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        (self.max - self.min).as_dvec3().element_product()
    }
}

/// So few are compared with each other, each with each.
const FEW: usize = 512;

/// For each triangle whether the box of one of another solid meets its box.
pub(super) fn touching(bounds: &[Bounds], solid: &[u32]) -> Vec<bool> {
    let mut touched = vec![false; bounds.len()];
    let mut open = vec![(0..bounds.len()).collect::<Vec<usize>>()];
    while let Some(some) = open.pop() {
        if some.iter().all(|&i| solid[i] == solid[some[0]]) {
            continue;
        }
        if some.len() <= FEW {
            for &i in &some {
                touched[i] |= some.iter().any(|&j| solid[j] != solid[i] && bounds[j].meets(&bounds[i]));
            }
            continue;
        }
        let whole = some.iter().fold(Bounds::EMPTY, |whole, &i| whole.with(bounds[i]));
        let axis = (whole.max - whole.min).max_position();
        let middle = 0.5 * (whole.min[axis] + whole.max[axis]);
        let low: Vec<usize> = some.iter().copied().filter(|&i| bounds[i].min[axis] <= middle).collect();
        let high: Vec<usize> = some.iter().copied().filter(|&i| bounds[i].max[axis] >= middle).collect();
        if 2 * (low.len() + high.len()) > 3 * some.len() {
            // Too many lie on both sides to be told apart. To take them as touched costs time and nothing else.
            some.iter().for_each(|&i| touched[i] = true);
        } else {
            open.extend([low, high]);
        }
    }
    touched
}
