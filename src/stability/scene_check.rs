//! The checks that any scene of a user can be put through.

use super::{Check, Outcome};
use crate::error::Result;
use crate::existence::Existence;
use crate::film::Layer;
use crate::light::{Invisible, Light};
use crate::measure::mean_and_error;
use crate::path_trace::{Arrival, arriving_power};
use crate::photon::Photon;
use crate::plan::{Frame, Method, PhotonClasses, PhotonPlan, Plan, Settings};
use crate::render::Render;
use crate::scene::{Luminaire, Material, Scene};
use crate::shoot::shoot;
use std::time::Instant;

/// Film of the checks: small enough for seconds, large enough for a picture.
const SIDE: u32 = 48;
const PASSES: u32 = 32;

/// Checks one scene: its image exists, pixels are finite, as much power arrives as is
/// gathered, both methods agree, threads do not matter. `found` hears of each outcome when it is there.
///
/// # Errors
/// What [`Render::new`] refuses but for a missing image, which is a row of the table.
pub fn check_scene(scene: &Scene, mut found: impl FnMut(&Outcome)) -> Result<Vec<Outcome>> {
    let settings = Settings { width: SIDE, height: SIDE, paths: Some(30_000), ..Settings::default() };
    let begin = Instant::now();
    let mut outcomes = Vec::new();
    let mut add = |outcome: Outcome| {
        found(&outcome);
        outcomes.push(outcome);
    };
    let mut render = match Render::new(scene.clone(), settings.clone(), &[Layer::Visible]) {
        Ok(render) => render,
        Err(crate::error::Error::NoImage { reason, .. }) => {
            let checks = vec![Check::fact("multiplication factor", "an image exists", reason)];
            add(outcome("existence", "k is below one", checks, begin));
            return Ok(outcomes);
        }
        Err(other) => return Err(other),
    };
    let existence = &render.plan().existence;
    let k = existence.factor();
    let words = format!("k {}", existence.describe());
    let certain = matches!(existence, Existence::Certain { .. });
    let expected = if certain || k < 1.0 { words.clone() } else { "k below one".into() };
    add(outcome(
        "existence",
        "k is below one",
        vec![Check::fact("multiplication factor", expected, words)],
        begin,
    ));

    let begin = Instant::now();
    (0..PASSES).for_each(|_| render.pass());
    add(outcome("pixels", "every pixel is finite and not negative", vec![pixels(&render)], begin));

    let begin = Instant::now();
    add(outcome(
        "energy",
        "power arrives on surfaces by shooting as by gathering, and all of it is absorbed or escapes",
        energy(scene, &settings, &render),
        begin,
    ));

    let begin = Instant::now();
    add(outcome("methods", "photons and paths agree", vec![methods(scene, &settings, &render)?], begin));

    let begin = Instant::now();
    add(outcome(
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

/// Lights without extent are found by no walk from the camera that leaves a mirror or glass for them.
fn hidden_from_paths(scene: &Scene) -> bool {
    let delta = scene.materials.iter().any(|material| material.bsdf.has_delta_lobe());
    delta && scene.luminaires.iter().any(Luminaire::is_delta)
}

const NOT_COMPARED: &str =
    "not compared: walks from the camera find no lights without extent through mirrors and glass";

/// Estimates of the power that arrives, each of so many passes.
const ESTIMATES: u32 = 16;
/// Places that one of them is gathered at.
const PLACES: u32 = 16_384;

/// Power on all surfaces, of both halves and on both sides: photons that are counted, and radiance that is gathered
/// from places on the surfaces. Geometric normals serve, since interpolated ones keep no energy.
fn energy(scene: &Scene, settings: &Settings, render: &Render) -> Vec<Check> {
    let Some(photons) = &render.frame().photons else {
        return vec![Check::fact("photons", "none needed", "none needed")];
    };
    let mut flat = scene.clone();
    flat.surfaces.iter_mut().for_each(|surface| surface.smooth = false);
    let classes = PhotonClasses { direct: true, caustic: true, indirect: true };
    let photons =
        PhotonPlan { classes, deposits: vec![true; flat.materials.len()], keep: 1.0, ..photons.clone() };
    let plan = Plan::new(flat, settings.clone());
    let frame = Frame { photons: Some(photons), ..Frame::asked(&plan) };
    let shot = |pass: u32| {
        let power =
            |photons: &[Photon<Light>]| photons.iter().map(|p| f64::from(p.power.total())).sum::<f64>();
        let [direct, caustic, indirect] = shoot::<Light>(&plan, &frame, pass).by_class;
        Arrival { direct: power(&direct), reflected: power(&caustic) + power(&indirect) }
    };
    let gathered = |pass: u32| arriving_power(&plan.scene, &plan.rays, settings.seed, pass, PLACES);
    let (shot, gathered): (Vec<_>, Vec<_>) = (0..ESTIMATES).map(|pass| (shot(pass), gathered(pass))).unzip();
    let compare = |what: &str, of: fn(&Arrival) -> f64| {
        let [(a, a_error), (b, b_error)] =
            [&shot, &gathered].map(|all| mean_and_error(&all.iter().map(of).collect::<Vec<_>>()));
        Check::number(what, b, (a, a_error.hypot(b_error)), 1e-3)
    };
    let direct = compare("direct, W", |arrival| arrival.direct);
    let reflected = if hidden_from_paths(scene) {
        Check::fact("reflected", NOT_COMPARED, NOT_COMPARED)
    } else {
        compare("reflected, W", |arrival| arrival.reflected)
    };
    let books = keeps_energy(&plan.scene).then(|| books(&plan, &frame));
    books.into_iter().chain([direct, reflected]).collect()
}

/// True where no matrix sends on more invisible light than arrives, and power falls with distance as light's does.
fn keeps_energy(scene: &Scene) -> bool {
    let most = |material: &Material| {
        let terms = material.bsdf.terms.iter();
        let reflected = terms.map(|term| term.coefficient.inv_inv * term.lobe.bound().max_element());
        material.bsdf.straight.inv_inv + reflected.sum::<f32>()
    };
    scene.materials.iter().all(|material| most(material) <= 1.0)
        && !scene.luminaires.iter().any(|luminaire| matches!(luminaire, Luminaire::Warn { .. }))
}

/// The invisible power of all luminaires in closed form, and what is absorbed or escapes of their photons.
fn books(plan: &Plan, frame: &Frame) -> Check {
    let (_, radius) = plan.scene.bounding_sphere();
    let powers = plan.scene.luminaires.iter().map(|luminaire| luminaire.power(radius).invisible);
    let emitted = powers.map(|power| power.as_dvec3().element_sum()).sum();
    let kept = |pass: u32| {
        let ledger = shoot::<Invisible>(plan, frame, pass).ledger;
        // The scatter of choosing among lobes is in both `absorbed` and `created`.
        ledger.absorbed - ledger.created + ledger.escaped
    };
    let kept: Vec<f64> = (0..ESTIMATES).map(kept).collect();
    Check::number("absorbed or escaped, W", emitted, mean_and_error(&kept), 1e-3)
}

fn methods(scene: &Scene, settings: &Settings, photon: &Render) -> Result<Check> {
    if hidden_from_paths(scene) {
        return Ok(Check::fact("mean colour", NOT_COMPARED, NOT_COMPARED));
    }
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
