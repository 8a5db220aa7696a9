use super::leaf::{Block, LANES};
use super::node::{LEAF, Node, WIDTH};
use crate::scene::Mesh;
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use std::collections::HashMap;
use std::time::Duration;

/// The tree that rays walk: eight boxes per node, triangles in blocks.
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    pub blocks: Vec<Block>,
    /// Reference to the top: a node, or a leaf where there is only one.
    pub root: u32,
    /// Largest absolute coordinate.
    pub magnitude: f32,
}

impl Tree {
    /// `class`: of each triangle, kept in the blocks.
    pub fn build(mesh: &Mesh, class: impl Fn(u32) -> u32) -> Self {
        let groups = Groups::new(mesh);
        let mut tree = Self { nodes: Vec::new(), blocks: Vec::new(), root: 0, magnitude: groups.magnitude };
        if groups.boxes.is_empty() {
            tree.nodes.push(Node::EMPTY);
            return tree;
        }
        let binary = build_bvh2(&groups.boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let leaf = |tree: &mut Self, index: usize| {
            let node = &binary.nodes[index];
            let slots = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            let triangles: Vec<_> = binary.primitive_indices[slots]
                .iter()
                .flat_map(|&group| groups.members(group))
                .map(|&triangle| (triangle, class(triangle), mesh.corners(triangle)))
                .collect();
            tree.push_leaf(&triangles)
        };
        if binary.nodes[0].is_leaf() {
            tree.root = leaf(&mut tree, 0);
            return tree;
        }
        // Parents before children, near relatives near each other. A list, not recursion: trees can be deep.
        tree.nodes.push(Node::EMPTY);
        let mut open = vec![(0, 0)];
        while let Some((from, to)) = open.pop() {
            for (lane, &child) in widen(&binary, from).iter().enumerate() {
                let bounds = binary.nodes[child].aabb();
                tree.nodes[to].used |= 1 << lane;
                for axis in 0..3 {
                    tree.nodes[to].planes[2 * axis][lane] = bounds.min[axis];
                    tree.nodes[to].planes[2 * axis + 1][lane] = bounds.max[axis];
                }
                tree.nodes[to].child[lane] = if binary.nodes[child].is_leaf() {
                    leaf(&mut tree, child)
                } else {
                    open.push((child, tree.nodes.len()));
                    tree.nodes.push(Node::EMPTY);
                    tree.nodes.len() as u32 - 1
                };
            }
        }
        tree
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

/// The up to eight nodes below `node` that stand in for its two children: while there is room, the inner node with
/// the largest surface is replaced by its own children.
fn widen(binary: &Bvh2, node: usize) -> Vec<usize> {
    let pair = |node: usize| {
        let first = binary.nodes[node].first_index as usize;
        [first, first + 1]
    };
    let mut children = Vec::with_capacity(WIDTH);
    children.extend(pair(node));
    while children.len() < WIDTH {
        let surface = |&place: &usize| binary.nodes[children[place]].aabb().half_area();
        let inner = (0..children.len()).filter(|&place| !binary.nodes[children[place]].is_leaf());
        let Some(largest) = inner.max_by(|a, b| surface(a).total_cmp(&surface(b))) else { break };
        let [left, right] = pair(children[largest]);
        children[largest] = left;
        children.insert(largest + 1, right);
    }
    children
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
    magnitude: f32,
}

impl Groups {
    fn new(mesh: &Mesh) -> Self {
        let mut boxes = Vec::new();
        let mut known = HashMap::with_capacity(mesh.triangles.len());
        let mut magnitude = Vec3::ZERO;
        let mut group_of = Vec::with_capacity(mesh.triangles.len());
        for triangle in 0..mesh.triangles.len() as u32 {
            let [a, b, c] = mesh.corners(triangle);
            assert!(
                a.is_finite() && b.is_finite() && c.is_finite(),
                "triangle {triangle} is not finite; the loader drops such"
            );
            if a == b || b == c || c == a {
                continue;
            }
            // + 0 turns −0 into +0: one box, one key.
            let (min, max) = (a.min(b).min(c) + Vec3::ZERO, a.max(b).max(c) + Vec3::ZERO);
            magnitude = magnitude.max(min.abs()).max(max.abs());
            let key = [min.to_array(), max.to_array()].map(|corner| corner.map(f32::to_bits));
            let group = *known.entry(key).or_insert_with(|| {
                boxes.push(Aabb::new(Vec3A::from(min), Vec3A::from(max)));
                boxes.len() as u32 - 1
            });
            group_of.push((group, triangle));
        }
        group_of.sort_unstable();
        let mut starts = vec![0; boxes.len() + 1];
        for &(group, _) in &group_of {
            starts[group as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let triangles = group_of.into_iter().map(|(_, triangle)| triangle).collect();
        Self { boxes, triangles, starts, magnitude: magnitude.max_element() }
    }

    fn members(&self, group: u32) -> &[u32] {
        let [start, end] = [0, 1].map(|i| self.starts[group as usize + i] as usize);
        &self.triangles[start..end]
    }
}
