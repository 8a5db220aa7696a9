//! Mrays/s on one core, ours and Embree's single rays in turns, medians: the table of `docs/performance.md`.

mod embree;
#[path = "../../ray_scene.rs"]
mod ray_scene;

use halflight::light::Matrix;
use halflight::rays::{Ray, Rays};
use std::hint::black_box;
use std::time::Instant;

/// Turns.
const TURNS: usize = 15;

fn main() {
    let scene = ray_scene::scene(Matrix::ZERO);
    let ours = Rays::build(&scene);
    let sets = ray_scene::sets(&scene, &ours);
    let theirs = embree::Scene::new(&scene.mesh);
    let differ = sets.diffuse.iter().filter(|ray| {
        let (a, b) = (ours.closest(ray).map(|hit| hit.t), theirs.closest(ray));
        (a.unwrap_or(f32::INFINITY) - b).abs() > 1e-3 * b
    });
    println!("{} of {} diffuse rays meet something else\n", differ.count(), ray_scene::COUNT);
    println!("| rays | ours | Embree | ratio |\n|---|---|---|---|");
    let closest = |ray: &Ray| black_box(ours.closest(ray)).is_some();
    let their_closest = |ray: &Ray| black_box(theirs.closest(ray)) < f32::INFINITY;
    row("closest hit, camera", &sets.primary, closest, their_closest);
    row("closest hit, after a diffuse reflection", &sets.diffuse, closest, their_closest);
    row("any hit, to a lamp", &sets.shadow, |ray| ours.occluded(ray), |ray| theirs.occluded(ray));
}

fn row(name: &str, rays: &[Ray], ours: impl Fn(&Ray) -> bool, theirs: impl Fn(&Ray) -> bool) {
    let speed = |query: &dyn Fn(&Ray) -> bool| {
        let begin = Instant::now();
        black_box(rays.iter().filter(|ray| query(ray)).count());
        rays.len() as f64 / 1e6 / begin.elapsed().as_secs_f64()
    };
    let turns: Vec<[f64; 2]> = (0..TURNS).map(|_| [speed(&ours), speed(&theirs)]).collect();
    let median = |value: &dyn Fn(&[f64; 2]) -> f64| {
        let mut values: Vec<f64> = turns.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values[TURNS / 2]
    };
    println!(
        "| {name} | {:.1} | {:.1} | {:.2} |",
        median(&|turn| turn[0]),
        median(&|turn| turn[1]),
        median(&|turn| turn[0] / turn[1])
    );
}
