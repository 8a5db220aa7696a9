//! Which triangles are touched by triangles of other solids, by their bounding boxes.

use crate::scene::gamma;
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

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

/// For each box whether that of another solid meets it; O(n log n).
///
/// Where boxes lie so thick that they are hard to tell apart some are taken to be touched that are not: what is touched
/// is asked again wherever light meets it, which costs time and nothing else.
pub(super) fn touching(bounds: &[Bounds], solid: &[u32]) -> Vec<bool> {
    let tree = Tree::of(bounds, solid);
    (0..bounds.len()).into_par_iter().map(|i| tree.is_touched(i).0).collect()
}

/// So few are compared one by one.
const FEW: usize = 4;

/// After so many nodes a box is taken to be touched. Lathes, whose boxes lie side by side, ask a tenth of it.
const MOST_NODES: u32 = 512;

/// Boxes, halved again and again by the places of their middles: each part is half as large as the whole, wherever they lie.
struct Tree<'a> {
    bounds: &'a [Bounds],
    solid: &'a [u32],
    /// Of boxes, those of a node next to each other.
    order: Vec<u32>,
    nodes: Vec<Node>,
}

struct Node {
    bounds: Bounds,
    /// The solid of all its boxes; None where there are several.
    only: Option<u32>,
    /// Its boxes, as places in the order.
    range: Range<usize>,
    /// Its second half; the first follows it. Zero in leaves.
    second: usize,
}

impl<'a> Tree<'a> {
    fn of(bounds: &'a [Bounds], solid: &'a [u32]) -> Self {
        let order = (0..bounds.len() as u32).collect();
        let mut tree = Self { bounds, solid, order, nodes: Vec::new() };
        tree.add(0..bounds.len());
        tree
    }

    fn add(&mut self, range: Range<usize>) {
        let (bounds, solid, members) = (self.bounds, self.solid, &mut self.order[range.clone()]);
        let whole = members.iter().fold(Bounds::EMPTY, |whole, &i| whole.with(bounds[i as usize]));
        let first = members.first().map(|&i| solid[i as usize]);
        let only = first.filter(|first| members.iter().all(|&i| solid[i as usize] == *first));
        let (node, middle) = (self.nodes.len(), range.start + range.len() / 2);
        self.nodes.push(Node { bounds: whole, only, range: range.clone(), second: 0 });
        if range.len() <= FEW {
            return;
        }
        let axis = (whole.max - whole.min).max_position();
        let place = |i: &u32| bounds[*i as usize].min[axis] + bounds[*i as usize].max[axis];
        members.select_nth_unstable_by(range.len() / 2, |a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
        self.add(range.start..middle);
        self.nodes[node].second = self.nodes.len();
        self.add(middle..range.end);
    }

    /// Whether a box is met by that of another solid, and how many nodes were asked.
    fn is_touched(&self, i: usize) -> (bool, u32) {
        let (own, bounds) = (self.solid[i], &self.bounds[i]);
        let mut open = vec![0];
        let mut asked = 0;
        while let Some(index) = open.pop() {
            let node = &self.nodes[index];
            asked += 1;
            if asked == MOST_NODES {
                return (true, asked);
            }
            if node.only == Some(own) || !node.bounds.meets(bounds) {
                continue;
            }
            if node.second != 0 {
                open.extend([index + 1, node.second]);
                continue;
            }
            let members = self.order[node.range.clone()].iter().map(|&j| j as usize);
            if members.into_iter().any(|j| self.solid[j] != own && self.bounds[j].meets(bounds)) {
                return (true, asked);
            }
        }
        (false, asked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream};
    use std::f32::consts::TAU;

    /// The boxes of a lathe of so many segments about y: a profile of (radius, height), turned.
    fn lathe(profile: &[[f32; 2]], segments: u32) -> Vec<Bounds> {
        let at = |[r, y]: [f32; 2], i: u32| {
            let (sin, cos) = (TAU * (i % segments) as f32 / segments as f32).sin_cos();
            Vec3::new(r * cos, y, r * sin)
        };
        let quads = profile.windows(2).flat_map(|ends| (0..segments).map(move |i| (ends[0], ends[1], i)));
        quads
            .flat_map(|(a, b, i)| {
                let [p, q, r, s] = [at(a, i), at(a, i + 1), at(b, i + 1), at(b, i)];
                [Bounds::of([p, q, r]), Bounds::of([p, r, s])]
            })
            .collect()
    }

    /// A tumbler with an outer and an inner wall, and wine in it that reaches into the wall by `into`.
    fn glass_and_wine(segments: u32, wine_segments: u32, into: f32) -> (Vec<Bounds>, Vec<u32>) {
        let glass = [[0.0, 0.0], [0.03, 0.0], [0.04, 0.1], [0.038, 0.1], [0.028, 0.01], [0.0, 0.01]];
        let wine = [[0.0, 0.01], [0.028 + into, 0.01], [0.033 + into, 0.055], [0.0, 0.055]];
        let (mut bounds, liquid) = (lathe(&glass, segments), lathe(&wine, wine_segments));
        let solid = (0..bounds.len()).map(|_| 0).chain(liquid.iter().map(|_| 1)).collect();
        bounds.extend(liquid);
        (bounds, solid)
    }

    fn by_comparing_all(bounds: &[Bounds], solid: &[u32]) -> Vec<bool> {
        let touched =
            |i: usize| (0..bounds.len()).any(|j| solid[i] != solid[j] && bounds[i].meets(&bounds[j]));
        (0..bounds.len()).map(touched).collect()
    }

    /// Nodes asked for a box, on average.
    fn work(bounds: &[Bounds], solid: &[u32]) -> f64 {
        let tree = Tree::of(bounds, solid);
        assert!(tree.nodes.len() <= 2 * bounds.len());
        (0..bounds.len()).map(|i| f64::from(tree.is_touched(i).1)).sum::<f64>() / bounds.len() as f64
    }

    #[test]
    fn lathes_of_any_number_of_segments_are_told_apart_with_little_work() {
        for segments in [3, 24, 48, 49, 100, 256] {
            for into in [-1e-4, 0.0, 2e-4] {
                for wine_segments in [segments, segments / 2 + 7] {
                    let (bounds, solid) = glass_and_wine(segments, wine_segments, into);
                    assert_eq!(
                        touching(&bounds, &solid),
                        by_comparing_all(&bounds, &solid),
                        "{segments} {into}"
                    );
                    let work = work(&bounds, &solid);
                    assert!(work < 60.0, "{segments} {into}: {work} nodes a box");
                }
            }
        }
    }

    #[test]
    fn no_heap_of_boxes_takes_more_than_its_share() {
        let mut rng = Rng::new(5, Stream::Test, 0, 0);
        let n = 20_000;
        let same = vec![Bounds { min: Vec3::ZERO, max: Vec3::ONE }; n];
        let nested: Vec<Bounds> =
            (1..=n).map(|i| Bounds { min: Vec3::splat(-(i as f32)), max: Vec3::splat(i as f32) }).collect();
        // Needles along all axes that fill one place, each of them as long as the whole.
        let needle = |i: usize| {
            let at = rng.f32x3();
            let mut box_ = Bounds { min: Vec3::from(at), max: Vec3::from(at) };
            (box_.min[i % 3], box_.max[i % 3]) = (0.0, 1.0);
            box_
        };
        let needles: Vec<Bounds> = (0..n).map(needle).collect();
        for bounds in [same, nested, needles] {
            for solid in [vec![0; n], (0..n as u32).map(|i| i % 2).collect(), (0..n as u32).collect()] {
                assert!(work(&bounds, &solid) <= f64::from(MOST_NODES));
                let (known, exact) = (
                    touching(&bounds[..2000], &solid[..2000]),
                    by_comparing_all(&bounds[..2000], &solid[..2000]),
                );
                assert!(
                    known.iter().zip(&exact).all(|(known, exact)| *known || !exact),
                    "none is overlooked"
                );
            }
        }
    }

    #[test]
    fn nothing_touches_nothing() {
        assert!(touching(&[], &[]).is_empty());
        assert_eq!(touching(&[Bounds::EMPTY; 9], &[0, 1, 2, 3, 4, 5, 6, 7, 8]), [false; 9]);
    }
}
