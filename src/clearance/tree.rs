//! The index: boxes of triangles that know how their normals lie and whether they are of one sheet, so that a thousand triangles of a
//! smooth surface are passed over at once.

use super::harm::{Ball, Other};
use crate::rims::{Rims, SAME_SIDE_COSINE, Tangent};
use crate::scene::Scene;
use glam::{Vec2, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;
use std::time::Duration;

/// Triangles of several sheets.
const MIXED: u32 = u32::MAX - 1;

pub(super) struct Tree {
    tree: Option<Bvh2>,
    /// Of each node.
    facts: Vec<Facts>,
}

/// What holds for all triangles of a node.
#[derive(Clone, Copy)]
struct Facts {
    sheet: u32,
    /// Some of them take photons on their backs.
    two_sided: bool,
    /// Their normals lie within an angle of this one.
    axis: Vec3,
    /// Of that angle.
    cos: f32,
    sin: f32,
}

impl Facts {
    fn of(sheet: u32, axis: Vec3, two_sided: bool) -> Self {
        Self { sheet, two_sided, axis, cos: 1.0, sin: 0.0 }
    }

    /// Of both.
    fn and(&self, other: &Self) -> Self {
        let sheet = if self.sheet == other.sheet { self.sheet } else { MIXED };
        let two_sided = self.two_sided || other.two_sided;
        if self.axis == other.axis && self.sin == 0.0 && other.sin == 0.0 && self.cos == other.cos {
            return Self { sheet, two_sided, ..*self };
        }
        let axis = (self.axis + other.axis).normalize_or_zero();
        let wide = |facts: &Self| {
            let away = axis.dot(facts.axis).clamp(-1.0, 1.0).acos();
            // A little more, for rounding.
            away + facts.sin.atan2(facts.cos) + 1e-3
        };
        let angle = wide(self).max(wide(other));
        if axis == Vec3::ZERO || angle >= std::f32::consts::PI {
            return Self { sheet, two_sided, axis: Vec3::X, cos: -1.0, sin: 0.0 };
        }
        Self { sheet, two_sided, axis, cos: angle.cos(), sin: angle.sin() }
    }

    /// The least cosine between `normal` and one of the normals.
    fn least_cosine(&self, normal: Vec3) -> f32 {
        let cos = self.axis.dot(normal).clamp(-1.0, 1.0);
        let sin = (1.0 - cos * cos).sqrt();
        // Beyond 180° there is one that points the other way.
        if sin * self.cos + cos * self.sin < 0.0 || self.cos <= -1.0 {
            -1.0
        } else {
            cos * self.cos - sin * self.sin
        }
    }

    /// The greatest.
    fn greatest_cosine(&self, normal: Vec3) -> f32 {
        -self.least_cosine(-normal)
    }
}

fn is_two_sided(scene: &Scene, triangle: u32) -> bool {
    scene.material_of(triangle).bsdf.terms.iter().any(|term| term.lobe.is_two_sided())
}

impl Tree {
    pub fn none() -> Self {
        Self { tree: None, facts: Vec::new() }
    }

    /// Of all triangles that are something.
    pub fn of(scene: &Scene, sheets: &[u32]) -> Self {
        let mesh = &scene.mesh;
        let solid = |t: &u32| !scene.material_of(*t).is_nothing() && mesh.normal(*t).is_finite();
        let solids: Vec<u32> = (0..mesh.triangles.len() as u32).into_par_iter().filter(solid).collect();
        if solids.is_empty() {
            return Self::none();
        }
        let boxed = |t: &u32| {
            let [a, b, c] = mesh.corners(*t);
            Aabb::new(a.min(b).min(c).into(), a.max(b).max(c).into())
        };
        let boxes: Vec<Aabb> = solids.par_iter().map(boxed).collect();
        let mut tree = build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut Duration::default());
        tree.primitive_indices.iter_mut().for_each(|index| *index = solids[*index as usize]);
        let mut facts = vec![Facts::of(MIXED, Vec3::X, false); tree.nodes.len()];
        // Children may stand anywhere: first seen, last done.
        let (mut order, mut next) = (Vec::with_capacity(tree.nodes.len()), vec![0_u32]);
        while let Some(node) = next.pop() {
            order.push(node);
            let node = &tree.nodes[node as usize];
            if node.prim_count == 0 {
                next.extend([node.first_index, node.first_index + 1]);
            }
        }
        for index in order.into_iter().rev() {
            let node = &tree.nodes[index as usize];
            let first = node.first_index as usize;
            facts[index as usize] = if node.prim_count == 0 {
                facts[first].and(&facts[first + 1])
            } else {
                let each = &tree.primitive_indices[first..first + node.prim_count as usize];
                let of = |t: &u32| Facts::of(sheets[*t as usize], mesh.normal(*t), is_two_sided(scene, *t));
                each.iter().map(of).reduce(|a, b| a.and(&b)).expect("no leaf is empty")
            };
        }
        Self { tree: Some(tree), facts }
    }

    pub fn bytes(&self) -> usize {
        let tree = |tree: &Bvh2| size_of_val(&tree.nodes[..]) + size_of_val(&tree.primitive_indices[..]);
        self.tree.as_ref().map_or(0, tree) + size_of_val(&self.facts[..])
    }

    /// The first of some balls, which shrink, within which nothing harms the disk. `beyond` says whether a triangle lies beyond an edge
    /// of the disk's own sheet that the way to it crosses. None: all are harmed.
    pub fn first_unharmed(
        &self,
        scene: &Scene,
        sheets: &[u32],
        disk: &Tangent,
        balls: &[Ball],
        beyond: impl Fn(Vec3, &[Vec3; 3], f32) -> bool,
    ) -> Option<usize> {
        let Some(tree) = &self.tree else { return Some(0) };
        let (mut first, mut stack) = (0, [0_u32; 128]);
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let index = stack[height] as usize;
            let node = &tree.nodes[index];
            let (min, max) = (Vec3::from(node.aabb().min), Vec3::from(node.aabb().max));
            let apart = (min - disk.position).max(disk.position - max).max(Vec3::ZERO).length_squared();
            if apart >= balls[first].radius * balls[first].radius {
                continue;
            }
            if self.facts[index].never_harms(disk, [min, max], &balls[first..], apart) {
                continue;
            }
            let begin = node.first_index as usize;
            if node.prim_count == 0 {
                stack[height] = begin as u32;
                stack[height + 1] = begin as u32 + 1;
                height += 2;
                assert!(height + 2 <= stack.len(), "a tree that is deeper than any");
                continue;
            }
            for &triangle in &tree.primitive_indices[begin..begin + node.prim_count as usize] {
                let corners = scene.mesh.corners(triangle);
                let (normal, sheet) = (scene.mesh.normal(triangle), sheets[triangle as usize]);
                let other = Other::new(disk, &corners, normal, sheet, is_two_sided(scene, triangle));
                let harms = |ball: &Ball| {
                    let way: Option<Vec2> = other.harms(ball);
                    way.is_some_and(|way| !beyond(way.extend(0.0), &corners, 1e-3 * ball.radius))
                };
                while harms(&balls[first]) {
                    first += 1;
                    if first == balls.len() {
                        return None;
                    }
                }
            }
        }
        Some(first)
    }
}

impl Facts {
    /// True where no triangle of a box can harm the disk within any of these balls.
    fn never_harms(&self, disk: &Tangent, [min, max]: [Vec3; 2], balls: &[Ball], apart: f32) -> bool {
        let (middle, half) = (0.5 * (min + max) - disk.position, 0.5 * (max - min));
        let (height, reach) = (middle.dot(disk.normal), half.dot(disk.normal.abs()));
        // Widest first.
        let (widest, smallest) = (&balls[0], &balls[balls.len() - 1]);
        if height + reach < -widest.slab {
            return true;
        }
        // Below, and facing away: nothing that counts comes there, unless it is where the disk's own sheet bends away.
        if height + reach <= smallest.level {
            let most = self.greatest_cosine(disk.normal);
            let own = self.sheet == disk.sheet || self.sheet == MIXED;
            let back = self.two_sided && self.least_cosine(disk.normal) < -SAME_SIDE_COSINE;
            if most <= if own { -SAME_SIDE_COSINE } else { SAME_SIDE_COSINE } && !back {
                return true;
            }
        }
        if self.sheet != disk.sheet || disk.sheet == Rims::NO_SHEET {
            return false;
        }
        let least = self.least_cosine(disk.normal);
        // The smallest ball that comes as far asks most.
        let met = balls.iter().rev().find(|ball| ball.radius * ball.radius > apart).unwrap_or(smallest);
        least >= widest.straight || (least > SAME_SIDE_COSINE && height.abs() + reach <= met.bend)
    }
}
