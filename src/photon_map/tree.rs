//! The kd-tree: photons are halved along the widest axis until sixteen are left, and found again eight boxes at a time.

use super::block::LANES;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use glam::{Vec3, Vec4};
use std::cmp::Ordering;

/// Children per node: three halvings.
pub(super) const WIDTH: usize = 8;

/// Marks a child that is a block of photons; the others are nodes.
pub(super) const LEAF: u32 = 1 << 31;

/// Entries that a walk may have to keep: seven for each level, and 8¹¹ blocks are more than 2³¹.
pub(super) const STACK: usize = 7 * 11 + 1;

/// A photon on its way to its place: its position, and in the bits of a fourth number where it was before, so that four
/// numbers are compared at once.
#[derive(Clone, Copy)]
pub(super) struct Item(Vec4);

impl Item {
    pub fn new(position: Vec3, index: u32) -> Self {
        Self(position.extend(f32::from_bits(index)))
    }

    /// Where it was before.
    pub fn index(self) -> usize {
        self.0.w.to_bits() as usize
    }
}

/// Up to eight boxes of photons.
#[repr(C, align(32))]
#[derive(Clone)]
pub(super) struct Node {
    /// By axis, then child. Empty places are at infinity.
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
    /// Node index, or block index | [`LEAF`].
    pub child: [u32; WIDTH],
}

#[derive(Clone, Copy)]
struct Child {
    min: Vec3,
    max: Vec3,
    place: u32,
}

impl Child {
    const NONE: Self = Self { min: Vec3::INFINITY, max: Vec3::INFINITY, place: 0 };
}

impl Node {
    const EMPTY: Self =
        Self { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::INFINITY; WIDTH]; 3], child: [0; WIDTH] };

    /// True where the children are blocks of photons: they are all of one kind.
    pub fn has_leaves(&self) -> bool {
        self.child[0] & LEAF != 0
    }

    /// Puts boxes in rows of eight, one after the other.
    pub fn append(rows: &mut Vec<Self>, count: usize, (from, child): (&Self, usize)) {
        let place = count % WIDTH;
        if place == 0 {
            rows.push(Self::EMPTY);
        }
        let row = rows.last_mut().expect("one was pushed");
        for axis in 0..3 {
            row.min[axis][place] = from.min[axis][child];
            row.max[axis][place] = from.max[axis][child];
        }
        row.child[place] = from.child[child];
    }

    /// Which boxes come within the root of `radius_squared` of `centre`, a bit each.
    #[inline(always)]
    pub fn near<S: Simd>(&self, simd: S, centre: [f32; 3], radius_squared: f32) -> u32 {
        let mut sum = f32x8::simd_from(simd, 0.0);
        for ((min, max), centre) in self.min.iter().zip(&self.max).zip(centre) {
            let at = f32x8::simd_from(simd, centre);
            let below = f32x8::load_array_ref(simd, min) - at;
            let above = at - f32x8::load_array_ref(simd, max);
            let away = below.max(above).max(f32x8::simd_from(simd, 0.0));
            sum += away * away;
        }
        sum.simd_le(f32x8::simd_from(simd, radius_squared)).to_bitmask() as u32
    }
}

/// Puts the items in tree order, [`LANES`] to a block but for the last, and returns the nodes; the first is the root.
pub(super) fn build(items: &mut [Item]) -> Vec<Node> {
    let mut nodes = vec![Node::EMPTY; nodes_over(blocks(items.len()))];
    fill_node(items, &mut nodes, 0, 0);
    nodes
}

fn blocks(items: usize) -> usize {
    items.div_ceil(LANES)
}

/// Blocks below each child but the last of a node over so many: a power of [`WIDTH`], so that nodes are full.
fn unit(blocks: usize) -> usize {
    let mut unit = 1;
    while unit * WIDTH < blocks {
        unit *= WIDTH;
    }
    unit
}

fn nodes_over(blocks: usize) -> usize {
    let unit = unit(blocks);
    if unit == 1 {
        return 1;
    }
    let rest = blocks % unit;
    1 + (blocks / unit) * nodes_over(unit) + if rest > 0 { nodes_over(rest) } else { 0 }
}

/// Fills `nodes`, whose first has index `at`, from items whose first is that of `block`; returns their box.
fn fill_node(items: &mut [Item], nodes: &mut [Node], at: u32, block: u32) -> (Vec3, Vec3) {
    let unit = unit(blocks(items.len()));
    let count = blocks(items.len()).div_ceil(unit);
    let (node, below) = nodes.split_first_mut().expect("a node for each");
    let mut children = [Child::NONE; WIDTH];
    fill_children(items, below, at + 1, block, unit, &mut children[..count]);
    for (i, child) in children.iter().enumerate() {
        for axis in 0..3 {
            node.min[axis][i] = child.min[axis];
            node.max[axis][i] = child.max[axis];
        }
        node.child[i] = child.place;
    }
    let children = &children[..count];
    (
        children.iter().fold(Vec3::INFINITY, |min, child| min.min(child.min)),
        children.iter().fold(Vec3::NEG_INFINITY, |max, child| max.max(child.max)),
    )
}

/// Items that are halved by one thread.
const ALONE: usize = 8192;

fn fill_children(
    items: &mut [Item],
    nodes: &mut [Node],
    at: u32,
    block: u32,
    unit: usize,
    out: &mut [Child],
) {
    let (min, max) = bounds(items);
    if let [child] = out {
        *child = if unit == 1 {
            Child { min, max, place: block | LEAF }
        } else {
            fill_node(items, nodes, at, block);
            Child { min, max, place: at }
        };
        return;
    }
    let left = out.len() / 2;
    let middle = left * unit * LANES;
    let extent = max - min;
    let axis = if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    let parallel = items.len() > ALONE;
    // Each axis has code of its own: one that looks the axis up for each comparison takes twice the time.
    match axis {
        0 => halve(items, middle, |item| item.0.x),
        1 => halve(items, middle, |item| item.0.y),
        _ => halve(items, middle, |item| item.0.z),
    }
    let nodes_left = if unit == 1 { 0 } else { left * nodes_over(unit) };
    let (items, more_items) = items.split_at_mut(middle);
    let (nodes, more_nodes) = nodes.split_at_mut(nodes_left);
    let (out, more_out) = out.split_at_mut(left);
    let (more_at, more_block) = (at + nodes_left as u32, block + (left * unit) as u32);
    let first = || fill_children(items, nodes, at, block, unit, out);
    let second = || fill_children(more_items, more_nodes, more_at, more_block, unit, more_out);
    if parallel {
        rayon::join(first, second);
    } else {
        let (mut first, mut second) = (first, second);
        first();
        second();
    }
}

/// Puts the items with less of a finite number before `middle`.
fn halve(items: &mut [Item], middle: usize, number: impl Fn(&Item) -> f32) {
    items.select_nth_unstable_by(middle, |a, b| {
        let (a, b) = (number(a), number(b));
        if a < b {
            Ordering::Less
        } else if a > b {
            Ordering::Greater
        } else {
            Ordering::Equal
        }
    });
}

fn bounds(items: &[Item]) -> (Vec3, Vec3) {
    let (min, max) = items
        .iter()
        .fold((Vec4::INFINITY, Vec4::NEG_INFINITY), |(min, max), item| (min.min(item.0), max.max(item.0)));
    (min.truncate(), max.truncate())
}
