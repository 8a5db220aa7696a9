//! Photons → kd-tree; how much light arrives near a point?
//!
//! kiddo's immutable tree is built over positions that are turned by one fixed rotation: its split axes are cyclic, and on an axis-aligned wall every
//! third split would do nothing. Photons are sorted along a Morton curve first, which makes the build faster and
//! neighbours in space neighbours in memory.

use crate::light::Power;
use crate::shoot::Photon;
use glam::{Mat3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

/// Photons of one class, indexed for "what is near?".
pub struct PhotonMap<P> {
    tree: Option<ImmutableKdTree<f32, 3>>,
    /// In the order of the tree's items.
    photons: Vec<Photon<P>>,
}

/// A photon counts on its own side of a surface only: where its normal is within about 60° of that of the point.
/// Any cosine in (0, 1) gives the same limit as the radius shrinks; this one keeps curved surfaces whole and tells the
/// two walls of a corner apart.
const SAME_SIDE_COSINE: f32 = 0.5;
/// And near the tangent plane only: within this share of the radius. A surface of curvature radius R leaves it at
/// gather radii above R / 2; the limit, again, does not depend on it.
const PLANE_SHARE: f32 = 0.25;

impl<P: Power> PhotonMap<P> {
    /// Builds the map. Positions must be finite: shooting guarantees it.
    ///
    /// # Panics
    /// On a photon whose position is not finite, which would make the tree lose others silently.
    pub fn build(photons: Vec<Photon<P>>) -> Self {
        if photons.is_empty() {
            return Self { tree: None, photons };
        }
        let (min, max) = bounds(&photons);
        assert!(
            min.is_finite() && max.is_finite(),
            "a photon's position is not finite: bounds {min} to {max}"
        );
        let scale = 2_097_151.0 / (max - min).max_element().max(f32::MIN_POSITIVE);
        let mut order: Vec<(u64, u32)> = photons
            .par_iter()
            .enumerate()
            .map(|(i, photon)| (morton((photon.position - min) * scale), i as u32))
            .collect();
        order.par_sort_unstable();
        let photons: Vec<Photon<P>> = order.par_iter().map(|&(_, i)| photons[i as usize]).collect();
        let turned: Vec<[f32; 3]> = photons.par_iter().map(|photon| turn(photon.position)).collect();
        let tree = ImmutableKdTree::<f32, 3>::builder()
            .with_parallel_construction_threshold(65_536)
            .build_from_slice(&turned)
            .expect("finite positions always build");
        Self { tree: Some(tree), photons }
    }

    /// How many photons.
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// True when there is none.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// The power (W) of all photons within `radius` (m) of `position` that arrived on the side of `normal`; divided
    /// by π radius² this is irradiance. Sums are taken in the order of the tree.
    pub fn flux(&self, position: Vec3, normal: Vec3, radius: f32) -> P {
        let mut sum = P::default();
        let Some(tree) = &self.tree else { return sum };
        tree.query(&turn(position)).within::<SquaredEuclidean<f32>>(radius * radius).unsorted().visit(
            |near| {
                let photon = &self.photons[near.item as usize];
                if photon.normal.dot(normal) > SAME_SIDE_COSINE
                    && (photon.position - position).dot(normal).abs() < PLANE_SHARE * radius
                {
                    sum += photon.power;
                }
            },
        );
        sum
    }
}

/// A rotation by 1 rad about (1, 2, 3): generic, so that no wall of a scene stays parallel to an axis.
fn turn(p: Vec3) -> [f32; 3] {
    const ROTATION: Mat3 = Mat3::from_cols(
        Vec3::new(0.573_138, 0.740_349, -0.351_279),
        Vec3::new(-0.609_007, 0.671_645, 0.421_906),
        Vec3::new(0.548_292, -0.027_879, 0.835_822),
    );
    (ROTATION * p).to_array()
}

fn bounds<P: Power>(photons: &[Photon<P>]) -> (Vec3, Vec3) {
    photons
        .par_iter()
        .map(|photon| (photon.position, photon.position))
        // NaN is passed on by comparing with `!(a < b)`-free min and max: check finiteness of every position here.
        .reduce(
            || (Vec3::INFINITY, Vec3::NEG_INFINITY),
            |a, b| {
                if a.0.is_nan() || b.0.is_nan() {
                    (Vec3::NAN, Vec3::NAN)
                } else {
                    (a.0.min(b.0), a.1.max(b.1))
                }
            },
        )
}

/// Interleaves the 21 low bits of three coordinates.
fn morton(p: Vec3) -> u64 {
    let spread = |x: f32| {
        let mut x = u64::from(x as u32) & 0x1f_ffff;
        x = (x | (x << 32)) & 0x001f_0000_0000_ffff;
        x = (x | (x << 16)) & 0x001f_0000_ff00_00ff;
        x = (x | (x << 8)) & 0x100f_00f0_0f00_f00f;
        x = (x | (x << 4)) & 0x10c3_0c30_c30c_30c3;
        (x | (x << 2)) & 0x1249_2492_4924_9249
    };
    spread(p.x) | (spread(p.y) << 1) | (spread(p.z) << 2)
}
