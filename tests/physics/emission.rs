//! What the stratification of emission is worth: the spread over passes of the power that reaches a glass ball.

use crate::support::Measured;
use halflight::emission::{EMISSION_DIMENSIONS, Emitters};
use halflight::light::{Invisible, Light, Power};
use halflight::plan::{Plan, Settings};
use halflight::rays::Ray;
use halflight::render::learn;
use halflight::sampling::{Rng, Sobol, Stream};
use halflight::scene::Scene;

const PATHS: u32 = 8_192;
const PASSES: u32 = 64;

#[test]
fn sobol_points_make_power_on_a_target_calmer_than_random_ones() {
    let plan = Plan::new(Scene::load("builtin:caustic-box").expect("built in"), Settings::default());
    let emitters = Emitters::<Invisible>::new(&plan.scene).expect("a lamp");
    let on_glass = |numbers: &mut dyn FnMut(u32) -> [f32; EMISSION_DIMENSIONS]| -> f64 {
        let hits = (0..PATHS).filter_map(|path| {
            let emitted = emitters.emit(PATHS, numbers(path));
            let ray = Ray { origin: emitted.origin, direction: emitted.direction, t_max: f32::INFINITY };
            let hit = plan.rays.closest(&ray)?;
            let name = &plan.scene.material_of(hit.triangle).name;
            (name == "Glass").then(|| f64::from(emitted.power.total()))
        });
        hits.sum()
    };
    let spread = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (mean, values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64)
    };
    let stratified: Vec<f64> = (0..PASSES)
        .map(|pass| {
            let sobol = Sobol::new(u64::from(pass));
            on_glass(&mut |path| sobol.point(path, 0))
        })
        .collect();
    let random: Vec<f64> = (0..PASSES)
        .map(|pass| {
            let mut rng = Rng::new(7, Stream::Test, pass, 0);
            on_glass(&mut |_| std::array::from_fn(|_| rng.f32()))
        })
        .collect();
    let ((mean, calm), (random_mean, wild)) = (spread(&stratified), spread(&random));
    println!("variance over passes: random / stratified = {:.1}", wild / calm);
    assert!(
        (mean - random_mean).abs() < 3.5 * ((calm + wild) / f64::from(PASSES)).sqrt(),
        "{mean}, {random_mean}"
    );
    assert!(wild > 4.0 * calm, "random {wild:e}, stratified {calm:e}");
}

#[test]
fn a_guide_brings_the_same_power_to_glass_and_mirror_with_more_paths() {
    let plan = Plan::new(Scene::load("builtin:caustic-box").expect("built in"), Settings::default());
    let guide = learn(&plan).photons.and_then(|photons| photons.guide).expect("caustics to guide to");
    let emitters = Emitters::<Invisible>::new(&plan.scene).expect("a lamp");
    // Power and number of paths that meet glass or mirror first; power of all paths.
    let aimed = |guided: bool, pass: u32| -> [f64; 3] {
        let sobol = Sobol::new(u64::from(pass) + if guided { 1_000 } else { 2_000 });
        let mut sums = [0.0; 3];
        for path in 0..PATHS {
            let u = sobol.point(path, 0);
            let emitted =
                if guided { emitters.emit_guided(PATHS, u, &guide) } else { emitters.emit(PATHS, u) };
            let power = f64::from(emitted.power.total());
            sums[2] += power;
            let ray = Ray { origin: emitted.origin, direction: emitted.direction, t_max: f32::INFINITY };
            let Some(hit) = plan.rays.closest(&ray) else { continue };
            if plan.scene.material_of(hit.triangle).bsdf().has_delta_lobe() {
                sums[0] += power;
                sums[1] += 1.0;
            }
        }
        sums
    };
    let measured = |guided: bool, what: usize| {
        let values: Vec<f64> = (0..PASSES).map(|pass| aimed(guided, pass)[what]).collect();
        Measured::of(&values)
    };
    let (with, without) = (measured(true, 0), measured(false, 0));
    let error = with.error.hypot(without.error);
    Measured { error, ..with }.must_be(without.mean, 0.0);
    let all = measured(true, 2);
    all.must_be(
        f64::from(
            Invisible::of(plan.scene.luminaires.iter().fold(Light::ZERO, |sum, l| sum + l.power(1.0)))
                .total(),
        ),
        1e-4,
    );
    let (more, paths) = (measured(true, 1).mean, measured(false, 1).mean);
    assert!(more > 1.5 * paths, "{more} paths instead of {paths}");
}
