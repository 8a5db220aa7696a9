//! Findings as lists of dicts, which pandas takes as they are.

use crate::errors::{raised, usage};
use crate::options::Options;
use crate::scene::Scene;
use crate::settings::Wanted;
use crate::wait::wait;
use halflight::plan::{Existence, Frame, Omittable, Plan, Settings};
use halflight::render::{Forecast, Saving, Stop, savings};
use halflight::stability::scene_check::check_scene;
use halflight::stability::{Check, Effort, Outcome, cases};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// A row of a plan.
#[derive(IntoPyObject)]
pub struct PlanRow {
    what: String,
    how: String,
    because: String,
    /// By how much longer a pass takes with it: 1 is twice the time.
    pass_share: Option<f64>,
    planning_seconds: Option<f64>,
    bytes: Option<i64>,
}

/// What is done, then what is left out.
pub fn plan_rows(plan: &Plan, frame: &Frame, savings: Option<&[Saving]>) -> Vec<PlanRow> {
    let done = frame.techniques(plan).into_iter().map(|technique| PlanRow {
        what: technique.paths.to_string(),
        how: technique.by.to_string(),
        because: technique.because.to_string(),
        pass_share: None,
        planning_seconds: None,
        bytes: None,
    });
    let left_out = plan.omissions.iter().enumerate().map(|(i, omission)| {
        let saving = savings.map(|all| &all[i]);
        PlanRow {
            what: omission.name.to_string(),
            how: "left out".to_string(),
            because: omission.reason.clone(),
            pass_share: saving.map(|saving| saving.pass),
            planning_seconds: saving.map(|saving| saving.planning),
            bytes: saving.map(|saving| saving.bytes),
        }
    });
    done.chain(left_out).collect()
}

/// What a render of `scene` does, and what it leaves out and why, as records; settings are those of `render`.
///
/// With `savings`, what each omission saves is measured: `pass_share` (1 is twice the time of a pass), `planning_seconds`, `bytes`.
#[pyfunction]
#[pyo3(
    signature = (scene, **more),
    text_signature = "(scene, *, savings=False, size=None, illumination=None, method='photon', seed=0, layers=None, denoise=False, photons=None, samples=4, direct='auto', max_reflections=None, indirect_radius=None, caustic_radius=2, nearest=100, cone=1, even_starts=False, one_path=False, keep_everything=False, keep=())"
)]
pub fn plan<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    more: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyList>> {
    let more = Options::of("plan()", more)?;
    let measured = more.get("savings", "True or False")?.unwrap_or(false);
    let wanted = Wanted::of(&more)?;
    more.finish()?;
    let scene = scene.get().ready(py, wanted.illumination)?;
    let (settings, layers) = wanted.on(&scene);
    let rows = wait(py, &Stop::default(), || {
        let (plan, frame, forecast) = Forecast::make(scene.clone(), settings, &layers);
        let saved = measured.then(|| savings(&scene, &plan, &frame, &forecast, &layers)).flatten();
        plan_rows(&plan, &frame, saved.as_deref())
    })?;
    PyList::new(py, rows)
}

/// The multiplication factor of a scene.
#[derive(IntoPyObject)]
struct Factor {
    k: f64,
    error: f64,
    image_exists: bool,
}

/// By how much reflected power is multiplied from one reflection to the next, measured: a record of `k`, its standard `error`, and
/// whether an `image_exists`.
#[pyfunction]
#[pyo3(
    signature = (scene, **more),
    text_signature = "(scene, *, illumination=None, seed=0)"
)]
pub fn multiplication_factor<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    more: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let more = Options::of("multiplication_factor()", more)?;
    let asked = more.read("illumination", crate::options::illumination)?;
    let seed = more.get("seed", "a whole number of 0 or more")?.unwrap_or(0);
    more.finish()?;
    let scene = scene.get().ready(py, asked)?;
    let settings = Settings { seed, keep: vec![Omittable::Existence], ..Settings::default() };
    let existence = wait(py, &Stop::default(), || Plan::new(scene, settings).existence)?;
    let (k, error) = match &existence {
        Existence::Measured(measured) => (measured.k, measured.error),
        // Light that is reflected once.
        Existence::Certain { at_most, .. } => (*at_most, 0.0),
    };
    Factor { k, error, image_exists: !existence.is_refuted() }.into_pyobject(py)
}

/// A row of a check.
#[derive(IntoPyObject)]
struct CheckRow {
    case: String,
    promise: String,
    what: String,
    expected: Option<f64>,
    got: Option<f64>,
    error: Option<f64>,
    expected_words: Option<String>,
    got_words: Option<String>,
    z: Option<f64>,
    relative_error: Option<f64>,
    seconds: f64,
    passes: bool,
}

/// Checks a scene, or (without one) the suite of stiff and extreme cases against closed forms, as records; `case` chooses by name, and
/// `quick` leaves out the settings that take longest.
#[pyfunction]
#[pyo3(signature = (scene=None, *, case=None, quick=true))]
pub fn check<'py>(
    py: Python<'py>,
    scene: Option<&Bound<'py, Scene>>,
    case: Option<&str>,
    quick: bool,
) -> PyResult<Bound<'py, PyList>> {
    let rows: Vec<CheckRow> = match scene {
        Some(scene) => {
            let scene = scene.get().ready(py, None)?;
            let outcomes = wait(py, &Stop::default(), || check_scene(&scene, |_| {}))?;
            outcomes.map_err(raised)?.iter().flat_map(check_rows).collect()
        }
        None => suite(py, case, if quick { Effort::Quick } else { Effort::Full })?,
    };
    PyList::new(py, rows)
}

/// Case by case, so that Ctrl-C is heard between them.
fn suite(py: Python<'_>, name: Option<&str>, effort: Effort) -> PyResult<Vec<CheckRow>> {
    let chosen: Vec<_> =
        cases().into_iter().filter(|case| name.is_none_or(|name| case.name.contains(name))).collect();
    if chosen.is_empty() {
        let known = cases().iter().map(|case| case.name).collect::<Vec<_>>().join(", ");
        return Err(usage(format!("case: there is none of that name; there are {known}")));
    }
    let mut rows = Vec::new();
    for case in chosen {
        let outcome = wait(py, &Stop::default(), || case.outcome(effort, |_| {}))?;
        rows.extend(check_rows(&outcome));
    }
    Ok(rows)
}

fn check_rows(outcome: &Outcome) -> Vec<CheckRow> {
    let row = |check: &Check| {
        let (numbers, words) = match check {
            Check::Number { expected, got, error, .. } => (Some((*expected, *got, *error)), None),
            Check::Fact { expected, got, .. } => (None, Some((expected.clone(), got.clone()))),
        };
        CheckRow {
            case: outcome.name.clone(),
            promise: outcome.promise.clone(),
            what: check.what().into(),
            expected: numbers.map(|numbers| numbers.0),
            got: numbers.map(|numbers| numbers.1),
            error: numbers.map(|numbers| numbers.2),
            expected_words: words.as_ref().map(|words| words.0.clone()),
            got_words: words.map(|words| words.1),
            z: check.z(),
            relative_error: check.relative_error(),
            seconds: outcome.seconds,
            passes: check.passes(),
        }
    };
    outcome.checks.iter().map(row).collect()
}
