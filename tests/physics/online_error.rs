//! The error that a render shows is the error that it has.

use crate::agreement::{cornell, mixed};
use halflight::film::Layer;
use halflight::measure::distributions::student_quantile_two_sided;
use halflight::plan::{Direct, Method, Settings};
use halflight::render::{ErrorEstimate, Render};
use halflight::scene::{Illumination, Scene};

const SIDE: u32 = 24;
const PASSES: u32 = 48;

fn render(scene: &Scene, settings: Settings, passes: u32) -> Render {
    let settings = Settings { width: SIDE, height: SIDE, ..settings };
    let mut render = Render::new(scene.clone(), settings, &[Layer::Visible]).expect("a render");
    (0..passes).for_each(|_| render.pass());
    render
}

/// The 90 % interval of each pixel and channel must hold the truth in 85 to 95 % of them, and the error shown for the
/// whole picture must be the error it has.
#[track_caller]
fn must_be_honest(name: &str, scene: &Scene, shown: impl Fn(ErrorEstimate) -> f64) {
    let path = Settings { method: Method::Path, samples: 64, seed: 1, ..Settings::default() };
    let truth = render(scene, path, 250);
    let shot = Settings {
        paths: Some(30_000),
        caustic_radius: 0.7,
        indirect_radius: 0.7,
        seed: 2,
        ..Settings::default()
    };
    let shot = render(scene, shot, PASSES);
    // P(|T| > t) = 0.1
    let t = student_quantile_two_sided(0.1, f64::from(PASSES - 1)) as f32;
    let (mean, error) = (shot.film().mean(Layer::Visible), shot.film().standard_error());
    let (true_mean, true_error) = (truth.film().mean(Layer::Visible), truth.film().standard_error());
    let (mut held, mut lit, mut squared) = (0.0, 0.0, 0.0);
    for i in 0..mean.len() {
        for c in 0..3 {
            let away = (mean[i][c] - true_mean[i][c]).abs();
            squared += f64::from(away * away / (true_mean[i][c].powi(2) + 1e-4));
            // Pixels that no light reaches have no error at all.
            if true_mean[i][c] > 0.0 && error[i][c] > 0.0 {
                lit += 1.0;
                held += f64::from(u8::from(away <= t * error[i][c].hypot(true_error[i][c])));
            }
        }
    }
    let coverage: f64 = held / lit;
    assert!((0.85..=0.95).contains(&coverage), "{name}: the 90 % interval holds the truth in {coverage:.3}");
    let shown = shown(shot.error().expect("passes"));
    let real = (squared / (3.0 * mean.len() as f64)).sqrt();
    assert!((0.8..=1.25).contains(&(shown / real)), "{name}: shows {shown:.4}, is {real:.4}");
}

#[test]
fn of_diffuse_global_illumination() {
    must_be_honest("global", &cornell(Illumination::GLOBAL), ErrorEstimate::total);
}

#[test]
fn of_local_illumination() {
    must_be_honest("local", &cornell(Illumination::LOCAL), ErrorEstimate::total);
}

#[test]
fn inside_the_square() {
    must_be_honest("0.5,0.25", &cornell(Illumination::Square { s: 0.5, t: 0.25 }), ErrorEstimate::total);
}

#[test]
fn of_caustics() {
    // Behind mirrors and glass few photons lie in disks so small, and the estimate of their bias is but noise: products of two halves
    // of the passes, above zero or below by chance. Noise alone must account for the error.
    must_be_honest("mirror and glass", &mixed(true, true).finish(), |error| error.noise);
}

#[test]
fn bias_is_seen_where_the_radius_is_large() {
    // Radii of ten pixels on a film of 24 blur every shadow; the estimate must say so, within a factor of two. Inter-reflection would
    // not do: where disks are so wide, paths go on.
    let scene = cornell(Illumination::GLOBAL);
    let wide = |radius, seed| {
        let direct = Direct::Photons;
        let settings =
            Settings { paths: Some(60_000), direct, indirect_radius: radius, seed, ..Settings::default() };
        render(&scene, settings, 12)
    };
    let (blurred, sharp) = (wide(10.0, 1), wide(0.5, 2));
    let (mean, reference) = (blurred.film().mean(Layer::Visible), sharp.film().mean(Layer::Visible));
    let noise = sharp.film().standard_error();
    let real: f64 = mean
        .iter()
        .zip(&reference)
        .zip(&noise)
        .map(|((mean, reference), noise)| {
            let away = (*mean - *reference).as_dvec3();
            let noise = noise.as_dvec3();
            ((away * away - noise * noise) / (mean.as_dvec3().powf(2.0) + 1e-4)).element_sum()
        })
        .sum::<f64>()
        / (3.0 * mean.len() as f64);
    let (shown, real) = (blurred.error().expect("passes").bias.expect("told"), real.max(0.0).sqrt());
    assert!(real > 0.02, "the example has no bias: {real}");
    assert!((0.5..=2.0).contains(&(shown / real)), "shows {shown:.4}, is {real:.4}");
}

#[test]
fn where_no_photon_came_the_truth_is_within_the_bar() {
    let scene = cornell(Illumination::GLOBAL);
    let settings =
        |paths| Settings { paths: Some(paths), direct: Direct::Photons, seed: 7, ..Settings::default() };
    let few = render(&scene, Settings { indirect_radius: 0.7, ..settings(400) }, 4);
    let truth = render(&scene, Settings { indirect_radius: 0.7, ..settings(200_000) }, 16);
    let (mean, error) = (few.film().mean(Layer::Visible), few.film().standard_error());
    let truth = truth.film().mean(Layer::Visible);
    let dark = |factor: f32| {
        let empty = (0..mean.len()).filter(|i| mean[*i] == glam::Vec3::ZERO && truth[*i].max_element() > 0.0);
        let within = |i: &usize| truth[*i].max_element() <= factor * 3.0 * error[*i].max_element();
        let (all, within) =
            empty.fold((0_u32, 0_u32), |(all, held), i| (all + 1, held + u32::from(within(&i))));
        (all, f64::from(within) / f64::from(all.max(1)))
    };
    // Nothing comes where three are expected once in twenty times.
    let (empty, held) = dark(1.0);
    assert!(empty > 20 && held > 0.95, "{held} of {empty}");
    // And the bar is not so wide that it says nothing.
    assert!(dark(0.03).1 < 0.5, "{:?}", dark(0.03));
}

#[test]
fn an_error_that_rests_on_rare_bright_paths_says_so() {
    // Paths that know nothing of its lamp come upon it seldom.
    let scene = Scene::load("builtin:caustic-box").expect("built in");
    let plain = Settings { method: Method::PathPlain, samples: 1, seed: 4, ..Settings::default() };
    let error = render(&scene, plain, 16).error().expect("passes");
    assert!(error.doubt.single > error.total() && !error.is_trusted(), "{error:?}");
    assert!(error.warning().is_some_and(|warning| warning.contains("came in single passes")), "{error:?}");
}
