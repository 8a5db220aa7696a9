//! Photons → kd-tree; how much light arrives near a point?
//!
//! kiddo's immutable tree is built over positions that are turned by one fixed rotation: its split axes are cyclic, and on an axis-aligned wall every
//! third split would do nothing. Photons are sorted along a Morton curve first, which makes the build faster and
//! neighbours in space neighbours in memory.

use crate::light::Power;
use crate::rims::{PLANE_SHARE, SAME_SIDE_COSINE};
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

/// Power (W) that arrived near a point; divided by the area it fell on, irradiance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flux<P> {
    /// Within the radius.
    pub whole: P,
    /// Within half of it, which is part of the whole.
    pub inner: P,
}

impl<P: Power> Flux<P> {
    fn plus(self, other: Self) -> Self {
        Self { whole: self.whole + other.whole, inner: self.inner + other.inner }
    }
}

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

    /// The power of all photons within `radius` (m) of `position` that arrived on the side of `normal` after no more
    /// than `most_reflections`. Sums are taken in the order of the tree.
    pub fn flux(&self, position: Vec3, normal: Vec3, radius: f32, most_reflections: u16) -> Flux<P> {
        // Runs of 1024, then the sum of runs: a million equal powers added one by one in f32 are off by 1 %.
        let (mut sum, mut run, mut length) = (Flux::default(), Flux::default(), 0_u32);
        let quarter = 0.25 * radius * radius;
        self.near(position, normal, radius, |photon, distance_squared| {
            if photon.reflections <= most_reflections {
                run.whole += photon.power;
                if distance_squared <= quarter {
                    run.inner += photon.power;
                }
                length += 1;
                if length.is_multiple_of(1024) {
                    sum = sum.plus(run);
                    run = Flux::default();
                }
            }
        });
        sum.plus(run)
    }

    /// How many photons [`flux`](Self::flux) meets.
    pub fn count(&self, position: Vec3, normal: Vec3, radius: f32) -> usize {
        let mut count = 0;
        self.near(position, normal, radius, |_, _| count += 1);
        count
    }

    fn near(&self, position: Vec3, normal: Vec3, radius: f32, mut visit: impl FnMut(&Photon<P>, f32)) {
        let Some(tree) = &self.tree else { return };
        tree.query(&turn(position)).within::<SquaredEuclidean<f32>>(radius * radius).unsorted().visit(
            |near| {
                let photon = &self.photons[near.item as usize];
                if photon.cos_to(normal) > SAME_SIDE_COSINE
                    && (photon.position - position).dot(normal).abs() < PLANE_SHARE * radius
                {
                    visit(photon, near.distance);
                }
            },
        );
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
        // min and max drop NaN, so it is passed on by hand.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Invisible;
    use crate::sampling::{Rng, Stream};

    fn photon(position: Vec3, normal: Vec3) -> Photon<Invisible> {
        Photon::new(position, normal, Invisible(Vec3::ONE), 1)
    }

    /// Photons on a floor, on a wall that meets it, and many in one point.
    fn corner() -> Vec<Photon<Invisible>> {
        let mut rng = Rng::new(1, Stream::Test, 0, 0);
        let floor = (0..60_000).map(|_| rng.f32x2()).map(|[x, z]| photon(Vec3::new(x, 0.0, z), Vec3::Y));
        let floor: Vec<_> = floor.collect();
        let wall = (0..30_000).map(|_| rng.f32x2()).map(|[y, z]| photon(Vec3::new(0.0, y, z), Vec3::X));
        let pile = (0..5_000).map(|_| photon(Vec3::splat(0.5), Vec3::Z));
        floor.into_iter().chain(wall).chain(pile).collect()
    }

    #[test]
    fn queries_find_what_brute_force_finds() {
        let photons = corner();
        let map = PhotonMap::build(photons.clone());
        let mut rng = Rng::new(2, Stream::Test, 0, 0);
        for _ in 0..200 {
            let [x, z] = rng.f32x2();
            let (p, r) = (Vec3::new(x, 0.0, z), 0.01 + 0.1 * rng.f32());
            // The rotation rounds: photons within 1e-5 of the rim may fall on either side of it.
            let within = |r: f32| {
                photons.iter().filter(|q| q.cos_to(Vec3::Y) > 0.9 && q.position.distance(p) <= r).count()
            };
            let found = map.count(p, Vec3::Y, r);
            assert!(
                (within(r * 0.99999)..=within(r * 1.00001)).contains(&found),
                "{found} near {p}, radius {r}"
            );
        }
        assert_eq!(map.count(Vec3::splat(0.5), Vec3::Z, 1e-6), 5_000);
    }

    #[test]
    fn photons_of_another_side_or_plane_do_not_count() {
        let thin =
            [photon(Vec3::ZERO, Vec3::Y), photon(Vec3::ZERO, -Vec3::Y), photon(Vec3::Y * 0.05, Vec3::Y)];
        let map = PhotonMap::build(thin.to_vec());
        assert_eq!(map.count(Vec3::ZERO, Vec3::Y, 0.1), 1);
        assert_eq!(map.count(Vec3::ZERO, -Vec3::Y, 0.1), 1);
        assert_eq!(map.count(Vec3::ZERO, Vec3::X, 0.1), 0);
    }

    #[test]
    fn a_uniform_floor_has_uniform_flux() {
        let photons: Vec<_> = corner().into_iter().filter(|photon| photon.cos_to(Vec3::Y) > 0.9).collect();
        let map = PhotonMap::build(photons);
        let r = 0.05_f32;
        let n = 100;
        let sums: Vec<f32> = (0..n)
            .map(|i| {
                map.flux(
                    Vec3::new(0.1 + 0.8 * (i % 10) as f32 / 9.0, 0.0, 0.1 + 0.08 * (i / 10) as f32),
                    Vec3::Y,
                    r,
                    u16::MAX,
                )
                .whole
                .0
                .x
            })
            .collect();
        let mean = sums.iter().sum::<f32>() / n as f32;
        let expected = 60_000.0 * std::f32::consts::PI * r * r;
        assert!((mean / expected - 1.0).abs() < 0.01, "{mean} against {expected}");
    }

    #[test]
    fn no_photons_no_light() {
        let map = PhotonMap::<Invisible>::build(Vec::new());
        assert!(map.is_empty() && map.flux(Vec3::ZERO, Vec3::Y, 1.0, 9) == Flux::default());
    }

    #[test]
    #[should_panic(expected = "not finite")]
    fn a_photon_that_is_nowhere_is_a_bug_and_is_said() {
        // kiddo would build and lose other photons.
        PhotonMap::build(vec![photon(Vec3::ZERO, Vec3::Y), photon(Vec3::new(f32::NAN, 0.0, 0.0), Vec3::Y)]);
    }
}
