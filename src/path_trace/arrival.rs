//! The power that arrives on surfaces, gathered: an account that shot photons can be checked against.

use super::luminaires::Luminaires;
use super::numbers::Samples;
use super::reads::Reads;
use super::walk::{Looker, Scratch, Walk};
use crate::rays::Rays;
use crate::sampling::{Cumulative, warp};
use crate::scene::Scene;
use glam::Vec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Light that arrives on all surfaces of a scene, on both sides of each; W, both halves and all channels together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Arrival {
    /// Straight from luminaires, found by connection.
    pub direct: f64,
    /// Reflected at least once; without what lights without extent send through mirrors and glass.
    pub reflected: f64,
}

/// Places on surfaces that one task looks from; results do not depend on it.
const PLACES_PER_TASK: u32 = 64;

/// One estimate from `places` places on surfaces, uniform over area, in cosine-distributed directions.
///
/// Equal arguments give equal bits for any number of threads.
pub fn arriving_power(scene: &Scene, rays: &Rays, seed: u64, pass: u32, places: u32) -> Arrival {
    let luminaires = Luminaires::new(scene);
    let walk = Walk::new(scene, rays, &luminaires, None);
    let triangles = 0..scene.mesh.triangles.len() as u32;
    let choice = Cumulative::new(triangles.map(|triangle| f64::from(scene.mesh.area(triangle))));
    let area = choice.total();
    if choice.is_empty() {
        return Arrival::default();
    }
    let tasks: Vec<Arrival> = (0..places.div_ceil(PLACES_PER_TASK))
        .into_par_iter()
        .map(|task| {
            let mut scratch = Scratch::default();
            let mut sum = Arrival::default();
            let samples = Samples::of_pixel(seed, pass, task, PLACES_PER_TASK);
            for mut numbers in samples.iter() {
                let triangle = choice.index(numbers.fine() * area);
                let [b1, b2] = warp::triangle(numbers.next());
                let point = scene.mesh.point(triangle as u32, b1, b2, false);
                let total = |halves: [Vec3; 2]| f64::from((halves[0] + halves[1]).element_sum());
                let normal = point.normals.geometric;
                if let Some(connection) = luminaires.connect(scene, &point, &mut numbers) {
                    let light = rays.transmittance(connection.segment) * connection.light;
                    let cos = f64::from(connection.to.dot(normal).abs());
                    sum.direct += cos * total([light.invisible, light.visible]);
                }
                let up = if numbers.one() < 0.5 { normal } else { -normal };
                let direction = warp::to_world(up, warp::cosine_hemisphere(numbers.next()));
                let origin = point.origin_towards(direction);
                // Two sides, on each of which cosines integrate to π.
                let start = Reads::visible_and_invisible();
                let reading =
                    walk.gather(Looker::Surface, start, origin, direction, &mut numbers, &mut scratch);
                sum.reflected += 2.0 * PI * (total(reading.radiance) - total(reading.emitted));
            }
            sum
        })
        .collect();
    let scale = area / f64::from(tasks.len() as u32 * PLACES_PER_TASK);
    tasks.iter().fold(Arrival::default(), |sum, task| Arrival {
        direct: sum.direct + scale * task.direct,
        reflected: sum.reflected + scale * task.reflected,
    })
}
