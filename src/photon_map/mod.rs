//! Photons → kd-tree; how much light arrives near a point?
//!
//! The tree halves the photons along the widest axis of their box, so that a whole floor at y = 0, or thousands of photons
//! in one point, need no special case. It ends in blocks of sixteen, which are examined together.

mod block;
mod nearest;
mod tree;

use crate::light::Power;
use crate::photon::Photon;
pub use block::LANES;
use block::{Block, Disk, Facing, Lanes, Normals};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, mask32x16};
use glam::Vec3;
pub use nearest::NearestMap;
use rayon::prelude::*;
use std::marker::PhantomData;
use tree::{Item, LEAF, Node, STACK};

/// Photons of one class, indexed for "what is near?".
pub struct PhotonMap<P, D = ()> {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// Of the blocks whose photons do not face the same way.
    normals: Vec<Normals>,
    /// By block, then component.
    powers: Vec<[f32; LANES]>,
    /// In the order of the blocks.
    photons: Vec<Photon<P, D>>,
    level: Level,
}

/// The blocks of a map about a place, in its order: found once for many questions from near there.
#[derive(Default)]
pub struct Neighbourhood {
    /// Boxes of blocks, eight to a row.
    rows: Vec<Node>,
}

impl Neighbourhood {
    /// True when there is nothing to be found.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

/// Power (W) that arrived near a point; divided by the area it fell on, irradiance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flux<P> {
    /// Within the radius.
    pub whole: P,
    /// Within half of it, which is part of the whole.
    pub inner: P,
}

impl<P: Power, D: Copy + Send + Sync> PhotonMap<P, D> {
    /// Builds the map. Positions must be finite: shooting guarantees it.
    ///
    /// # Panics
    /// On a photon whose position is not finite, which would make the tree lose others silently.
    pub fn build(photons: Vec<Photon<P, D>>) -> Self {
        let level = Level::new();
        if photons.is_empty() {
            let (nodes, blocks, normals, powers) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
            return Self { nodes, blocks, normals, powers, photons, level };
        }
        assert!(
            photons.par_iter().all(|photon| photon.position.is_finite()),
            "a photon's position is not finite"
        );
        let mut items: Vec<Item> =
            photons.par_iter().enumerate().map(|(i, photon)| Item::new(photon.position, i as u32)).collect();
        let nodes = tree::build(&mut items);
        let photons: Vec<Photon<P, D>> = items.par_iter().map(|item| photons[item.index()]).collect();
        let mut powers = vec![[0.0; LANES]; photons.len().div_ceil(LANES) * P::COMPONENTS];
        let mut blocks: Vec<Block> = powers
            .par_chunks_mut(P::COMPONENTS)
            .zip(photons.par_chunks(LANES))
            .map(|(planes, photons)| {
                for (component, plane) in planes.iter_mut().enumerate() {
                    for (power, photon) in plane.iter_mut().zip(photons) {
                        *power = photon.power.component(component);
                    }
                }
                Block::new(photons)
            })
            .collect();
        let mut normals = Vec::new();
        for (block, photons) in blocks.iter_mut().zip(photons.chunks(LANES)) {
            block.keep_normals(photons, &mut normals);
        }
        Self { nodes, blocks, normals, powers, photons, level }
    }

    /// How many photons.
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// All photons, neighbours in space near each other.
    pub fn photons(&self) -> &[Photon<P, D>] {
        &self.photons
    }

    /// True when there is none.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// The power of all photons within `radius` (m) of `position` that arrived on the side of `normal` after no more
    /// than `most_reflections`. Sums are taken in the order of the tree.
    pub fn flux(&self, position: Vec3, normal: Vec3, radius: f32, most_reflections: u16) -> Flux<P> {
        let disk = Disk::new(position, normal, radius);
        dispatch!(self.level, simd => self.sum(simd, self, &disk, most_reflections, |_, _| {}))
    }

    /// The same, from a [`neighbourhood`](Self::neighbourhood) that the disk lies within.
    pub fn flux_near(
        &self,
        near: &Neighbourhood,
        [position, normal]: [Vec3; 2],
        radius: f32,
        most_reflections: u16,
    ) -> Flux<P> {
        if near.is_empty() {
            return Flux::default();
        }
        let disk = Disk::new(position, normal, radius);
        dispatch!(self.level, simd => self.sum(simd, near, &disk, most_reflections, |_, _| {}))
    }

    /// Finds the blocks that come within `radius` (m) of `centre`.
    pub fn neighbourhood(&self, centre: Vec3, radius: f32, near: &mut Neighbourhood) {
        near.rows.clear();
        let mut count = 0;
        dispatch!(self.level, simd => {
            self.each(simd, centre.to_array(), radius * radius, |node, child| {
                Node::append(&mut near.rows, count, (node, child));
                count += 1;
            });
        });
    }

    /// Shows `met` each block that has photons which count, and those.
    #[inline(always)]
    fn sum<S: Simd>(
        &self,
        simd: S,
        among: &impl Boxes,
        disk: &Disk,
        most_reflections: u16,
        mut met: impl FnMut(usize, mask32x16<S>),
    ) -> Flux<P> {
        let (mut whole, mut inner) = (Sums::zero(simd), Sums::zero(simd));
        self.each_block(simd, among, disk, most_reflections, |block, inside, near| {
            let powers = &self.powers[P::COMPONENTS * block..][..P::COMPONENTS];
            whole.add(powers, inside);
            inner.add(powers, near);
            met(block, inside);
        });
        Flux { whole: whole.total(), inner: inner.total() }
    }

    /// Calls `visit` with each block that has photons which count: those, and those within half the radius.
    #[inline(always)]
    fn each_block<S: Simd>(
        &self,
        simd: S,
        among: &impl Boxes,
        disk: &Disk,
        most_reflections: u16,
        mut visit: impl FnMut(usize, mask32x16<S>, mask32x16<S>),
    ) {
        let quarter = Lanes::simd_from(simd, 0.25 * disk.radius_squared);
        let mut facing = Facing::default();
        among.each(simd, disk.position, disk.radius_squared, |node, child| {
            let block = (node.child[child] & !LEAF) as usize;
            let Some((squared, mut inside)) =
                self.blocks[block].within(simd, disk, &mut facing, &self.normals)
            else {
                return;
            };
            if most_reflections < u16::MAX {
                let photons = &self.photons[LANES * block..];
                let bits = photons.iter().take(LANES).enumerate().fold(0_u64, |bits, (lane, photon)| {
                    bits | u64::from(photon.reflections <= most_reflections) << lane
                });
                inside &= mask32x16::from_bitmask(simd, bits);
            }
            visit(block, inside, inside & squared.simd_le(quarter));
        });
    }

    /// How many photons [`flux`](Self::flux) meets.
    pub fn count(&self, position: Vec3, normal: Vec3, radius: f32) -> usize {
        let (disk, mut count) = (Disk::new(position, normal, radius), 0);
        dispatch!(self.level, simd => {
            self.each_block(simd, self, &disk, u16::MAX, |_, inside, _| {
                count += inside.to_bitmask().count_ones() as usize;
            });
        });
        count
    }

    /// What [`flux_near`](Self::flux_near) returns; and finds the photons that it adds up.
    pub fn find(
        &self,
        near: &Neighbourhood,
        [position, normal]: [Vec3; 2],
        radius: f32,
        most_reflections: u16,
        found: &mut Found,
    ) -> Flux<P> {
        found.places.resize(found.places.len().max(near.rows.len() * tree::WIDTH * LANES), 0);
        let Found { places, count } = found;
        let places = &mut places[..];
        let disk = Disk::new(position, normal, radius);
        let (flux, met) = dispatch!(self.level, simd => {
            // Counted here: a number elsewhere could, for all that the compiler knows, be changed by what is stored in the list.
            let mut met = 0;
            let flux = self.sum(
                simd,
                near,
                &disk,
                most_reflections,
                #[inline(always)]
                |block, inside| met = append(places, met, (LANES * block) as u32, inside.to_bitmask()),
            );
            (flux, met)
        });
        *count = met;
        flux
    }

    /// Multiplies what queries add up by a number for each photon; the photons themselves stay as they are.
    pub fn weigh(&mut self, weight: impl Fn(&Photon<P, D>) -> f32 + Sync) {
        let blocks = self.powers.par_chunks_mut(P::COMPONENTS).zip(self.photons.par_chunks(LANES));
        blocks.for_each(|(planes, photons)| {
            for (lane, photon) in photons.iter().enumerate() {
                let weight = weight(photon);
                planes.iter_mut().for_each(|plane| plane[lane] *= weight);
            }
        });
    }
}

/// The photons that a query [finds](PhotonMap::find), in the order of the tree.
#[derive(Default)]
pub struct Found {
    /// Those behind `count` mean nothing.
    places: Vec<u32>,
    count: usize,
}

impl Found {
    /// Where they stand among [all](PhotonMap::photons).
    pub fn places(&self) -> &[u32] {
        &self.places[..self.count]
    }
}

/// Writes `first` + i behind the `count` places for each bit i of the lowest [`LANES`] that is set, and returns how many places there
/// are then. Without a branch for each: nobody could guess it.
#[inline(always)]
fn append(places: &mut [u32], mut count: usize, first: u32, bits: u64) -> usize {
    for (byte, first) in [(bits & 255, first), (bits >> 8 & 255, first + 8)] {
        let places = &mut places[count..][..8];
        for (place, bit) in places.iter_mut().zip(&BITS[byte as usize]) {
            *place = first + bit;
        }
        count += byte.count_ones() as usize;
    }
    count
}

/// Which bits of a byte are set: so many, and zeros.
const BITS: [[u32; 8]; 256] = {
    let mut all = [[0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut count) = (0, 0);
        while bit < 8 {
            if byte >> bit & 1 == 1 {
                all[byte][count] = bit as u32;
                count += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    all
};

/// Where blocks of photons are looked for.
trait Boxes {
    /// Calls `visit` with nodes whose children are blocks and a bit for each child that comes within a distance, in the order
    /// of the blocks.
    fn each_node<S: Simd>(
        &self,
        simd: S,
        centre: [f32; 3],
        radius_squared: f32,
        visit: impl FnMut(&Node, u32),
    );

    /// Calls `visit` with each of those children and its node.
    #[inline(always)]
    fn each<S: Simd>(
        &self,
        simd: S,
        centre: [f32; 3],
        radius_squared: f32,
        mut visit: impl FnMut(&Node, usize),
    ) {
        self.each_node(
            simd,
            centre,
            radius_squared,
            #[inline(always)]
            |node, mut met| {
                while met != 0 {
                    visit(node, met.trailing_zeros() as usize % tree::WIDTH);
                    met &= met - 1;
                }
            },
        );
    }
}

impl<P, D> Boxes for PhotonMap<P, D> {
    #[inline(always)]
    fn each_node<S: Simd>(
        &self,
        simd: S,
        centre: [f32; 3],
        radius_squared: f32,
        mut visit: impl FnMut(&Node, u32),
    ) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = [0_u32; STACK];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = &self.nodes[stack[height] as usize];
            let mut met = node.near(simd, centre, radius_squared);
            if node.has_leaves() {
                visit(node, met);
                continue;
            }
            // The first is to be taken off the stack first.
            while met != 0 {
                let child = met.ilog2() as usize % tree::WIDTH;
                met &= !(1 << child);
                stack[height] = node.child[child];
                height += 1;
            }
        }
    }
}

impl Boxes for Neighbourhood {
    #[inline(always)]
    fn each_node<S: Simd>(
        &self,
        simd: S,
        centre: [f32; 3],
        radius_squared: f32,
        mut visit: impl FnMut(&Node, u32),
    ) {
        for row in &self.rows {
            visit(row, row.near(simd, centre, radius_squared));
        }
    }
}

/// So many blocks are added up before their sum is added to that of others: a million equal powers added one by one in f32
/// are off by 1 %.
const RUN: u32 = 64;

/// Powers by component, still lane by lane.
struct Sums<S: Simd, P> {
    all: [Lanes<S>; 6],
    run: [Lanes<S>; 6],
    length: u32,
    carried: PhantomData<P>,
}

impl<S: Simd, P: Power> Sums<S, P> {
    #[inline(always)]
    fn zero(simd: S) -> Self {
        let zero = [Lanes::simd_from(simd, 0.0); 6];
        Self { all: zero, run: zero, length: 0, carried: PhantomData }
    }

    #[inline(always)]
    fn add(&mut self, powers: &[[f32; LANES]], counted: mask32x16<S>) {
        for (sum, power) in self.run.iter_mut().zip(powers) {
            let simd = sum.simd;
            *sum += counted.select(Lanes::load_array_ref(simd, power), Lanes::simd_from(simd, 0.0));
        }
        self.length += 1;
        if self.length.is_multiple_of(RUN) {
            for (all, run) in self.all.iter_mut().zip(&mut self.run) {
                *all += *run;
                *run = Lanes::simd_from(run.simd, 0.0);
            }
        }
    }

    #[inline(always)]
    fn total(&self) -> P {
        let mut sums = [0.0; 6];
        for ((sum, all), run) in sums.iter_mut().zip(self.all).zip(self.run).take(P::COMPONENTS) {
            let (low, high) = (all + run).split();
            let (low, high) = (low + high).split();
            let [a, b, c, d] = (low + high).to_array();
            *sum = (a + c) + (b + d);
        }
        P::from_components(|c| sums[c])
    }
}

#[cfg(test)]
mod tests;
