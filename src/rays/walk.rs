use super::Hit;
use super::build::Tree;
use super::leaf::visit_leaf;
use super::line::Line;
use super::node::{LEAF, WIDTH};
use fearless_simd::Simd;
use std::ops::ControlFlow;

/// What a query does with the crossings it is shown.
pub(super) trait Visit {
    /// True: near boxes come first, so that [`limit`](Self::limit) soon shrinks.
    const ORDERED: bool;
    /// Crossings beyond this distance change nothing any more.
    fn limit(&self) -> f32;
    /// One crossing, and the class of its triangle. Crossings come in no particular order; break ends the query.
    fn hit(&mut self, hit: Hit, class: u32) -> ControlFlow<()>;
}

/// Shows `visit` all crossings of the line that its limit lets through.
///
/// `stack` has room for `tree.stack` entries. Where near boxes come first, an entry is a child: the bits of its entry
/// distance, which for numbers ≥ 0 order like the distance, above the reference. Else it is a node, above a bit for each
/// child yet to be visited.
#[inline(always)]
pub(super) fn walk<S: Simd, V: Visit>(simd: S, tree: &Tree, line: &Line, stack: &mut [u64], visit: &mut V) {
    let mut height = 0;
    let mut current = tree.root;
    loop {
        if current & LEAF != 0 {
            if visit_leaf(simd, &tree.blocks, (current & !LEAF) as usize, line, visit).is_break() {
                return;
            }
        } else {
            let node = &tree.nodes[current as usize];
            let (mut met, enter) = node.enter(simd, line, visit.limit());
            if met != 0 {
                if !V::ORDERED {
                    let rest = met & (met - 1);
                    stack[height] = u64::from(current) << 32 | u64::from(rest);
                    height += usize::from(rest != 0);
                    current = node.child[first(met)];
                    continue;
                }
                let mut nearest = entry(&enter, &node.child, met);
                met &= met - 1;
                let base = height;
                while met != 0 {
                    let other = entry(&enter, &node.child, met);
                    met &= met - 1;
                    stack[height] = nearest.max(other);
                    nearest = nearest.min(other);
                    height += 1;
                }
                if height - base > 1 {
                    sort_descending(&mut stack[base..height]);
                }
                current = nearest as u32;
                continue;
            }
        }
        loop {
            if height == 0 {
                return;
            }
            let entry = stack[height - 1];
            if !V::ORDERED {
                let (node, met) = (&tree.nodes[(entry >> 32) as usize], entry as u32);
                current = node.child[first(met)];
                stack[height - 1] = entry & (entry - 1);
                height -= usize::from(met & (met - 1) == 0);
                break;
            }
            height -= 1;
            if f32::from_bits((entry >> 32) as u32) <= visit.limit() {
                current = entry as u32;
                break;
            }
        }
    }
}

/// The first child that `met` has a bit for.
#[inline(always)]
fn first(met: u32) -> usize {
    met.trailing_zeros() as usize % WIDTH
}

/// The stack entry of the first child that `met` has a bit for.
#[inline(always)]
fn entry(enter: &[f32; WIDTH], child: &[u32; WIDTH], met: u32) -> u64 {
    let lane = first(met);
    u64::from(enter[lane].to_bits()) << 32 | u64::from(child[lane])
}

/// Insertion sort: there are at most seven.
#[inline(always)]
fn sort_descending(entries: &mut [u64]) {
    for i in 1..entries.len() {
        let mut j = i;
        while j > 0 && entries[j - 1] < entries[j] {
            entries.swap(j - 1, j);
            j -= 1;
        }
    }
}
