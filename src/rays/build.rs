use super::leaf::{Block, LANES};
use super::line::PAD;
use super::node::{LEAF, Node};
use super::widen::{Widening, primitives};
use crate::scene::Mesh;
use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;
use std::time::Duration;

/// The tree that rays walk: eight boxes per node, triangles in blocks.
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    pub blocks: Vec<Block>,
    /// Reference to the top: a node, or a leaf where there is only one.
    pub root: u32,
    /// No walk has more to remember.
    pub stack: usize,
}

impl Tree {
    /// `class`: of each triangle, kept in the blocks.
    pub fn build(mesh: &Mesh, class: impl Fn(u32) -> u32) -> Self {
        let groups = Groups::new(mesh);
        let mut tree = Self { nodes: Vec::new(), blocks: Vec::new(), root: 0, stack: 0 };
        if groups.boxes.is_empty() {
            tree.nodes.push(Node::EMPTY);
            return tree;
        }
        // Leaves are formed by the widening, which knows what our blocks cost.
        let preset = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
        let binary = build_bvh2(&groups.boxes, preset, &mut Duration::default());
        let widening = Widening::new(&binary, |group| groups.members(group).len() as u32);
        let leaf = |tree: &mut Self, node: usize| {
            let mut triangles = Vec::new();
            for node in widening.below(node).filter(|node| binary.nodes[*node].is_leaf()) {
                for &group in primitives(&binary, node) {
                    let members = groups.members(group).iter();
                    triangles
                        .extend(members.map(|&triangle| (triangle, class(triangle), mesh.corners(triangle))));
                }
            }
            tree.push_leaf(&triangles)
        };
        if widening.is_leaf(0) {
            tree.root = leaf(&mut tree, 0);
            return tree;
        }
        // Parents before children, near relatives near each other. A list, not recursion: trees can be deep.
        tree.nodes.push(Node::EMPTY);
        let mut open = vec![(0, 0)];
        while let Some((from, to)) = open.pop() {
            for (lane, &child) in widening.children(from).iter().enumerate() {
                let bounds = binary.nodes[child].aabb();
                let pad = PAD * bounds.min.abs().max(bounds.max.abs()).max_element();
                tree.nodes[to].used |= 1 << lane;
                for axis in 0..3 {
                    tree.nodes[to].planes[2 * axis][lane] = bounds.min[axis] - pad;
                    tree.nodes[to].planes[2 * axis + 1][lane] = bounds.max[axis] + pad;
                }
                tree.nodes[to].child[lane] = if widening.is_leaf(child) {
                    leaf(&mut tree, child)
                } else {
                    open.push((child, tree.nodes.len()));
                    tree.nodes.push(Node::EMPTY);
                    tree.nodes.len() as u32 - 1
                };
            }
        }
        tree.stack = tree.deepest_stack();
        tree
    }

    /// Siblings wait on every level. Children come after their parents, so this goes from the bottom up.
    fn deepest_stack(&self) -> usize {
        let mut need = vec![0; self.nodes.len()];
        for (i, node) in self.nodes.iter().enumerate().rev() {
            let count = node.used.count_ones() as usize;
            let inner = node.child[..count].iter().filter(|child| **child & LEAF == 0);
            need[i] = count - 1 + inner.map(|&child| need[child as usize]).max().unwrap_or(0);
        }
        // The walk writes one place ahead.
        need[0] + 1
    }

    fn push_leaf(&mut self, triangles: &[(u32, u32, [Vec3; 3])]) -> u32 {
        let first = self.blocks.len() as u32;
        assert!(first < LEAF, "a scene has less than 2^31 triangles");
        let mut rest = triangles;
        while !rest.is_empty() {
            let (block, after) = rest.split_at(rest.len().min(LANES));
            self.blocks.push(Block::new(block, after.is_empty()));
            rest = after;
        }
        first | LEAF
    }
}

/// Triangles by bounding box, each distinct box once.
///
/// obvhs' builder takes O(n²) for n equal boxes, and the two halves of an upright rectangle have equal boxes anyhow.
struct Groups {
    boxes: Vec<Aabb>,
    /// Triangle indices, group after group.
    triangles: Vec<u32>,
    /// Where each group starts in `triangles`, and the end.
    starts: Vec<u32>,
}

impl Groups {
    fn new(mesh: &Mesh) -> Self {
        let bounds = |triangle: u32| {
            let [a, b, c] = mesh.corners(triangle);
            assert!(
                a.is_finite() && b.is_finite() && c.is_finite(),
                "triangle {triangle} is not finite; the loader drops such"
            );
            // + 0 turns −0 into +0: one box, one key.
            let (min, max) = (a.min(b).min(c) + Vec3::ZERO, a.max(b).max(c) + Vec3::ZERO);
            let collapsed = a == b || b == c || c == a;
            (!collapsed).then_some((min, max))
        };
        let mut keyed: Vec<_> = (0..mesh.triangles.len() as u32)
            .into_par_iter()
            .filter_map(|triangle| {
                let (min, max) = bounds(triangle)?;
                Some(([min, max].map(|corner| corner.to_array().map(f32::to_bits)), triangle))
            })
            .collect();
        keyed.par_sort_unstable();
        let (mut boxes, mut starts) = (Vec::new(), vec![0]);
        for group in keyed.chunk_by(|a, b| a.0 == b.0) {
            let [min, max] = group[0].0.map(|corner| Vec3::from(corner.map(f32::from_bits)));
            boxes.push(Aabb::new(min.into(), max.into()));
            starts.push(starts[starts.len() - 1] + group.len() as u32);
        }
        let triangles = keyed.into_iter().map(|(_, triangle)| triangle).collect();
        Self { boxes, triangles, starts }
    }

    fn members(&self, group: u32) -> &[u32] {
        let [start, end] = [0, 1].map(|i| self.starts[group as usize + i] as usize);
        &self.triangles[start..end]
    }
}
