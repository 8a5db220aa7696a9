//! Sixteen photons side by side: which of them lie within a disk, and what they bring, without a branch for each photon.

use crate::photon::Photon;
use crate::rims::{PLANE_SHARE, SAME_SIDE_COSINE};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use glam::Vec3;

/// Photons per block.
pub const LANES: usize = 16;
pub(super) type Lanes<S> = f32x16<S>;

/// The place of "all the same" in [`Block::normals`].
const SAME: u32 = u32::MAX;
/// The place of normals that differ and are not kept yet.
const DIFFERENT: u32 = SAME - 1;

/// Up to sixteen photons; their powers are kept elsewhere.
#[repr(C, align(64))]
#[derive(Clone)]
pub(super) struct Block {
    /// By axis; NaN where there is no photon.
    position: [[f32; LANES]; 3],
    /// Of all of them where `normals` is [`SAME`], as on a flat wall.
    normal: [i8; 3],
    /// Where their normals are.
    normals: u32,
}

/// Normals of a block whose photons do not agree, by axis, in 127ths.
pub(super) type Normals = [[f32; LANES]; 3];

/// What is asked of photons.
pub(super) struct Disk {
    pub position: [f32; 3],
    pub normal: [f32; 3],
    pub radius_squared: f32,
    /// Greatest distance from the tangent plane.
    pub height: f32,
}

impl Disk {
    /// The disk of `radius` (m) about `position` on a surface that looks along `normal`.
    pub fn new(position: Vec3, normal: Vec3, radius: f32) -> Self {
        let (position, normal) = (position.to_array(), normal.to_array());
        Self { position, normal, radius_squared: radius * radius, height: PLANE_SHARE * radius }
    }
}

/// Whether photons of the normal that was asked about last count: most blocks ask what the one before did.
#[derive(Default)]
pub(super) struct Facing {
    normal: [i8; 3],
    counts: bool,
}

impl Facing {
    /// True where photons that came along `normal`, in 127ths, count on `disk`.
    #[inline(always)]
    fn counts(&mut self, normal: [i8; 3], disk: &Disk) -> bool {
        if normal != self.normal {
            let cos = Vec3::from_array(normal.map(f32::from)).dot(Vec3::from_array(disk.normal));
            *self = Self { normal, counts: cos > 127.0 * SAME_SIDE_COSINE };
        }
        self.counts
    }
}

impl Block {
    /// From at most [`LANES`] photons; normals that differ are yet to be [kept](Self::keep_normals).
    pub fn new<P, D>(photons: &[Photon<P, D>]) -> Self {
        let normal = photons[0].normal;
        let same = photons.iter().all(|photon| photon.normal == normal);
        let normals = if same { SAME } else { DIFFERENT };
        let mut block = Self { position: [[f32::NAN; LANES]; 3], normal, normals };
        for (lane, photon) in photons.iter().enumerate() {
            for (axis, x) in block.position.iter_mut().zip(photon.position.to_array()) {
                axis[lane] = x;
            }
        }
        block
    }

    /// Adds the normals of the block's photons to `normals` where they differ.
    pub fn keep_normals<P, D>(&mut self, photons: &[Photon<P, D>], normals: &mut Vec<Normals>) {
        if self.normals == SAME {
            return;
        }
        let mut each = [[0.0; LANES]; 3];
        for (lane, photon) in photons.iter().enumerate() {
            for (axis, x) in each.iter_mut().zip(photon.normal) {
                axis[lane] = f32::from(x);
            }
        }
        self.normals = normals.len() as u32;
        normals.push(each);
    }

    /// Squared distances from the centre of the disk, and which photons count there. None: none of them.
    #[inline(always)]
    pub fn within<S: Simd>(
        &self,
        simd: S,
        disk: &Disk,
        facing: &mut Facing,
        normals: &[Normals],
    ) -> Option<(Lanes<S>, mask32x16<S>)> {
        let all = |x: f32| Lanes::simd_from(simd, x);
        let dot = |v: [Lanes<S>; 3], n: [f32; 3]| v[0] * all(n[0]) + v[1] * all(n[1]) + v[2] * all(n[2]);
        let from = |axis: usize| Lanes::load_array_ref(simd, &self.position[axis]) - all(disk.position[axis]);
        let way = [from(0), from(1), from(2)];
        let squared = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
        let mut inside = squared.simd_le(all(disk.radius_squared));
        inside &= dot(way, disk.normal).abs().simd_lt(all(disk.height));
        if self.normals == SAME {
            if !facing.counts(self.normal, disk) {
                return None;
            }
        } else {
            let each = &normals[self.normals as usize];
            let normal = [0, 1, 2].map(|axis| Lanes::load_array_ref(simd, &each[axis]));
            inside &= dot(normal, disk.normal).simd_gt(all(127.0 * SAME_SIDE_COSINE));
        }
        inside.any_true().then_some((squared, inside))
    }
}
