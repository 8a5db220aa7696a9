//! The photon map of the textbooks: irradiance from the photons that lie nearest to a point (Jensen 2001, §7).
//!
//! Queries are kiddo's. Its tree splits x, y and z in turn, which on a wall along two of them wastes one split in three; turned by
//! some rotation a wall lies along none of them, and distances stay what they are.

use super::tree::{self, Item};
use crate::light::Power;
use crate::photon::Photon;
use crate::rims::SAME_SIDE_COSINE;
use glam::{Mat3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::num::NonZeroUsize;

/// Photons of one class, indexed for "which are nearest?".
pub struct NearestMap<P> {
    tree: ImmutableKdTree<f32, 3>,
    turn: Mat3,
    /// By their numbers in the tree.
    photons: Vec<Photon<P>>,
    count: NonZeroUsize,
    cone: f64,
}

impl<P: Power> NearestMap<P> {
    /// Light is read from `count` photons, at least two, weighted by a cone that reaches zero at `cone` times the distance of the
    /// farthest: 1 or more; infinity weighs all alike.
    ///
    /// # Panics
    /// On a photon whose position is not finite, with which the tree would lose others silently; on no photons to read from.
    pub fn build(photons: Vec<Photon<P>>, count: u32, cone: f32) -> Self {
        assert!(
            photons.iter().all(|photon| photon.position.is_finite()),
            "a photon's position is not finite"
        );
        let count = NonZeroUsize::new(count as usize).expect("photons to read from");
        let mut items: Vec<Item> =
            photons.iter().zip(0..).map(|(photon, i)| Item::new(photon.position, i)).collect();
        if !items.is_empty() {
            tree::build(&mut items);
        }
        // Neighbours in space near each other in memory: the tree is built faster, and so are queries.
        let photons: Vec<Photon<P>> = items.par_iter().map(|item| photons[item.index()]).collect();
        let turn = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 1.0);
        let turned: Vec<[f32; 3]> =
            photons.par_iter().map(|photon| (turn * photon.position).to_array()).collect();
        let tree = ImmutableKdTree::new_from_slice(&turned).expect("finite positions");
        Self { tree, turn, photons, count, cone: f64::from(cone) }
    }

    /// Irradiance (W m⁻²) at `position` by photons that arrived on the side of `normal` after no more than `most_reflections`.
    ///
    /// The farthest photon only says how wide to look. Counted among those within it would make even light k / (k − 1) times too bright;
    /// the cone of 1, which the textbook has, gives it no weight anyway.
    pub fn irradiance(&self, position: Vec3, normal: Vec3, most_reflections: u16) -> P {
        let place = (self.turn * position).to_array();
        let nearest = self.tree.query(&place).nearest_n::<SquaredEuclidean<f32>>(self.count).unsorted();
        let mut nearest: Vec<(u32, f32)> =
            nearest.execute().iter().map(|near| (near.item, near.distance)).collect();
        let widest = nearest.iter().map(|(_, squared)| *squared).fold(0.0, f32::max);
        nearest.retain(|(_, squared)| *squared < widest);
        if nearest.is_empty() {
            return P::default();
        }
        // In an order of their own: sums must not depend on that of the query.
        nearest.sort_unstable_by_key(|(item, _)| *item);
        let widest = f64::from(widest);
        let mut sum = [0.0_f64; 6];
        for (item, squared) in nearest {
            let photon = &self.photons[item as usize];
            if photon.reflections <= most_reflections && photon.cos_to(normal) > SAME_SIDE_COSINE {
                let weight = 1.0 - (f64::from(squared) / widest).sqrt() / self.cone;
                for (component, sum) in sum.iter_mut().enumerate().take(P::COMPONENTS) {
                    *sum += weight * f64::from(photon.power.component(component));
                }
            }
        }
        // The mean weight over the disk: Jensen 2001, §7.
        let mean = 1.0 - 2.0 / (3.0 * self.cone);
        let over = 1.0 / (mean * PI * widest);
        P::from_components(|component| (over * sum[component]) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Invisible;
    use crate::sampling::{Rng, Stream};

    fn photon(position: Vec3, normal: Vec3) -> Photon<Invisible> {
        Photon::new(position, normal, Invisible(Vec3::ONE), 1)
    }

    /// Photons of 1 W by chance on a square of 1 m², `number` in all.
    fn floor(number: u32, seed: u32) -> Vec<Photon<Invisible>> {
        let mut rng = Rng::new(1, Stream::Test, seed, 0);
        (0..number).map(|_| rng.f32x2()).map(|[x, z]| photon(Vec3::new(x, 0.3, z), Vec3::Y)).collect()
    }

    /// Mean and standard error of the irradiance in the middle of floors of their own.
    fn measured(photons: u32, count: u32, cone: f32) -> (f64, f64) {
        let n = 20_000;
        let at = |seed| {
            let map = NearestMap::build(floor(photons, seed), count, cone);
            f64::from(map.irradiance(Vec3::new(0.5, 0.3, 0.5), Vec3::Y, 9).0.x)
        };
        let all: Vec<f64> = (0..n).into_par_iter().map(at).collect();
        let mean = all.iter().sum::<f64>() / f64::from(n);
        let squares: f64 = all.iter().map(|x| (x - mean).powi(2)).sum();
        (mean, (squares / f64::from(n - 1) / f64::from(n)).sqrt())
    }

    #[test]
    fn even_light_is_as_bright_as_it_is_however_few_photons_are_asked() {
        for (count, cone) in [(8, 1.0), (8, 1.1), (8, f32::INFINITY), (30, 1.0), (30, 3.0)] {
            let (mean, error) = measured(300, count, cone);
            let z = |expected: f64| ((mean - expected) / error).abs();
            // Of so many photons a floor has in all, not in the mean.
            assert!(z(300.0) < 3.5, "{count}, {cone}: {mean} ± {error}");
            assert!(z(294.0) > 3.5 && z(306.0) > 3.5, "{count}, {cone}: {mean} ± {error} tells nothing");
            // Nor is the last photon counted.
            assert!(z(300.0 * f64::from(count) / f64::from(count - 1)) > 3.5);
        }
    }

    #[test]
    fn the_nearest_are_those_that_brute_force_finds() {
        let mut rng = Rng::new(2, Stream::Test, 0, 0);
        let wall = (0..4000).map(|_| rng.f32x2()).map(|[y, z]| photon(Vec3::new(0.0, y, z), Vec3::X));
        let photons: Vec<_> = wall.collect::<Vec<_>>().into_iter().chain(floor(8000, 3)).collect();
        let map = NearestMap::build(photons.clone(), 60, 1.25);
        let mut both = 0;
        for _ in 0..300 {
            let [x, z] = rng.f32x2();
            let place = Vec3::new(0.2 * x, 0.3, z);
            let mut all: Vec<(f64, bool)> = photons
                .iter()
                .map(|p| (p.position.as_dvec3().distance(place.as_dvec3()), p.cos_to(Vec3::Y) > 0.9))
                .collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            let radius = all[59].0;
            let counted = all[..59].iter().filter(|(_, counts)| *counts);
            both += counted.clone().count();
            let sum: f64 = counted.map(|(distance, _)| 1.0 - distance / radius / 1.25).sum();
            let expected = sum / (1.0 - 2.0 / 3.75) / (PI * radius * radius);
            let found = f64::from(map.irradiance(place, Vec3::Y, 1).0.y);
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} instead of {expected} at {place}");
        }
        assert!((5_000..17_000).contains(&both), "{both}: some lie on the wall");
    }

    #[test]
    fn photons_of_another_side_or_of_more_reflections_make_the_place_wide_and_bring_nothing() {
        let at = |x: f32, normal, reflections| {
            let position = Vec3::new(x, 0.0, 0.0);
            Photon { reflections, ..photon(position, normal) }
        };
        let photons =
            vec![at(0.1, Vec3::Y, 3), at(0.2, -Vec3::Y, 1), at(0.3, Vec3::Y, 1), at(0.5, Vec3::Y, 1)];
        let map = NearestMap::build(photons, 4, f32::INFINITY);
        let counted =
            |normal, most| map.irradiance(Vec3::ZERO, normal, most).0.x * std::f32::consts::PI * 0.25;
        for (normal, most, expected) in
            [(Vec3::Y, 3, 2.0), (Vec3::Y, 2, 1.0), (-Vec3::Y, 3, 1.0), (Vec3::X, 3, 0.0)]
        {
            assert!((counted(normal, most) - expected).abs() < 1e-5, "{normal}, {most}");
        }
    }

    #[test]
    fn few_photons_and_many_in_one_point_are_no_trouble() {
        for number in [0, 1] {
            let map = NearestMap::build(floor(number, 1), 50, 1.0);
            assert_eq!(map.irradiance(Vec3::ZERO, Vec3::Y, 9), Invisible(Vec3::ZERO));
        }
        // Three of fifty: the farthest says how wide.
        let map = NearestMap::build(floor(3, 1), 50, f32::INFINITY);
        assert!(map.irradiance(Vec3::ZERO, Vec3::Y, 9).0.x > 0.0);
        let pile = vec![photon(Vec3::ONE, Vec3::Y); 1000];
        let map = NearestMap::build(pile, 50, 1.0);
        for place in [Vec3::ONE, Vec3::ZERO] {
            assert_eq!(map.irradiance(place, Vec3::Y, 9), Invisible(Vec3::ZERO));
        }
    }

    #[test]
    fn the_order_of_photons_does_not_matter() {
        let photons = floor(3000, 7);
        let back: Vec<_> = photons.iter().rev().copied().collect();
        let maps = [photons, back].map(|photons| NearestMap::build(photons, 40, 1.1));
        for i in 0..50 {
            let place = Vec3::new(0.02 * i as f32, 0.3, 0.4);
            let [a, b] = maps.each_ref().map(|map| map.irradiance(place, Vec3::Y, 9).0.x);
            assert!((a / b - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    #[should_panic(expected = "not finite")]
    fn a_photon_that_is_nowhere_is_a_bug_and_is_said() {
        NearestMap::build(
            vec![photon(Vec3::ZERO, Vec3::Y), photon(Vec3::new(f32::NAN, 0.0, 0.0), Vec3::Y)],
            9,
            1.0,
        );
    }
}
