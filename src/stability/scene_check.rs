//! The checks that any scene of a user's can be put to.

use super::{Check, Outcome};
use crate::error::Result;
use crate::film::Layer;
use crate::light::Light;
use crate::measure::Existence;
use crate::plan::{Method, Settings};
use crate::render::Render;
use crate::scene::Scene;
use crate::shoot::shoot;
use std::time::Instant;

/// Film of the checks: small enough for seconds, large enough for a picture.
const SIDE: u32 = 48;
const PASSES: u32 = 32;

/// Checks one scene: its image exists, pixels are finite, books balance, both methods agree, threads do not matter.
///
/// # Errors
/// What [`Render::new`] refuses but for a missing image, which is a row of the table.
pub fn check_scene(scene: &Scene) -> Result<Vec<Outcome>> {
    let settings = Settings { width: SIDE, height: SIDE, paths: Some(30_000), ..Settings::default() };
    let begin = Instant::now();
    let mut outcomes = Vec::new();
    let mut render = match Render::new(scene.clone(), settings.clone(), &[Layer::Visible]) {
        Ok(render) => render,
        Err(crate::error::Error::NoImage(why)) => {
            let checks = vec![Check::fact("multiplication factor", "an image exists", why)];
            return Ok(vec![outcome("existence", "k is below one", checks, begin)]);
        }
        Err(other) => return Err(other),
    };
    let existence = &render.plan().existence;
    let k = match existence {
        Existence::Certain { at_most, .. } => *at_most,
        Existence::Measured(m) => m.k,
    };
    let words = format!("k {}", existence.describe());
    let certain = matches!(existence, Existence::Certain { .. });
    let expected = if certain || k < 1.0 { words.clone() } else { "k below one".into() };
    outcomes.push(outcome(
        "existence",
        "k is below one",
        vec![Check::fact("multiplication factor", expected, words)],
        begin,
    ));

    let begin = Instant::now();
    (0..PASSES).for_each(|_| render.pass());
    outcomes.push(outcome("pixels", "every pixel is finite and not negative", vec![pixels(&render)], begin));

    let begin = Instant::now();
    let books = render.plan().photons.as_ref().map(|photons| {
        let ledger = shoot::<Light>(render.plan(), photons, 0).ledger;
        let income = ledger.emitted + ledger.roulette + ledger.created;
        // Every line rounds a few times in f32.
        Check::number("absorbed and escaped", income, (ledger.absorbed + ledger.escaped, 0.0), 1e-4)
    });
    let none = || Check::fact("photons", "none needed", "none needed");
    outcomes.push(outcome(
        "energy",
        "what is emitted is absorbed or escapes",
        vec![books.unwrap_or_else(none)],
        begin,
    ));

    let begin = Instant::now();
    outcomes.push(outcome(
        "methods",
        "photons and paths agree",
        vec![methods(scene, &settings, &render)?],
        begin,
    ));

    let begin = Instant::now();
    outcomes.push(outcome(
        "threads",
        "the same bits for any number of threads",
        vec![threads(scene, &settings)?],
        begin,
    ));
    Ok(outcomes)
}

fn outcome(name: &str, promise: &str, checks: Vec<Check>, begin: Instant) -> Outcome {
    Outcome { name: name.into(), promise: promise.into(), checks, seconds: begin.elapsed().as_secs_f64() }
}

fn pixels(render: &Render) -> Check {
    let picture = render.film().mean(Layer::Visible);
    let wrong = picture.iter().filter(|rgb| !rgb.is_finite() || rgb.min_element() < 0.0).count();
    Check::fact("wrong pixels", "0", wrong.to_string())
}

fn methods(scene: &Scene, settings: &Settings, photon: &Render) -> Result<Check> {
    let settings = Settings { method: Method::Path, samples: 8, ..settings.clone() };
    let mut path = Render::new(scene.clone(), settings, &[Layer::Visible])?;
    (0..PASSES).for_each(|_| path.pass());
    let (a, b) = (photon.film(), path.film());
    // Averages: single pixels of the photon method are smoothed over its radius, on purpose.
    let (Some(a_error), Some(b_error)) = (a.mean_colour_error(), b.mean_colour_error()) else {
        return Ok(Check::fact("mean colour", "an error bar", "none"));
    };
    let (a, b) = (a.mean_colour().element_sum(), b.mean_colour().element_sum());
    let error = (a_error * a_error + b_error * b_error).element_sum().sqrt() * 3.0_f64.sqrt();
    Ok(Check::number("mean colour", b, (a, error), 2e-3))
}

fn threads(scene: &Scene, settings: &Settings) -> Result<Check> {
    let picture = |threads: usize| -> Result<Option<Vec<glam::Vec3>>> {
        let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else { return Ok(None) };
        pool.install(|| {
            let mut render = Render::new(scene.clone(), settings.clone(), &[Layer::Visible])?;
            render.pass();
            Ok(Some(render.film().mean(Layer::Visible)))
        })
    };
    let bits = |picture: Option<Vec<glam::Vec3>>| -> Vec<[u32; 3]> {
        picture.unwrap_or_default().iter().map(|rgb| rgb.to_array().map(f32::to_bits)).collect()
    };
    let (one, three) = (bits(picture(1)?), bits(picture(3)?));
    let differing = one.iter().zip(&three).filter(|(a, b)| a != b).count() + one.len().abs_diff(three.len());
    Ok(Check::fact("differing pixels", "0", differing.to_string()))
}
