//! What the stratification of emission is worth: the spread over passes of the power that reaches a glass ball.

use halflight::light::{Invisible, Power};
use halflight::plan::{Plan, Settings};
use halflight::rays::Ray;
use halflight::sampling::{Rng, Sobol, Stream};
use halflight::scene::Scene;
use halflight::shoot::{EMISSION_DIMENSIONS, Emitters};

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
