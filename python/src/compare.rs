//! Ways to render against each other and against a reference, over time.

use crate::errors::{raised, usage};
use crate::options::Options;
use crate::picture::Picture;
use crate::scene::Scene;
use crate::settings::{Wanted, method};
use crate::wait::wait;
use halflight::compare::{Course, Reference, ReferenceMaker, Run, Variant, can_refer, race};
use halflight::error::Result;
use halflight::plan::{Method, Settings};
use halflight::render::Stop;
use halflight::report::evaluate::{MaskRule, evaluate};
use halflight::scene::Scene as Ready;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::time::Instant;

/// What is asked for.
struct Comparing {
    course: Course,
    base: Settings,
    given: Option<Reference>,
    method: Method,
    seconds: f64,
}

/// Renders `scene` by each of `variants` and measures the error at each of `budgets` (seconds), as records with relmse, flip, bias, ….
///
/// A variant is a dict of a `name` and of arguments of `render` (without size and illumination, which are those of all). `seeds` is
/// how many runs each makes. They are held against `reference`, a Picture with its error, else one by `reference_method` that is
/// rendered for `reference_seconds`; rows for which it is too noisy say so. Whichever run has used the least time renders next.
#[pyfunction]
#[pyo3(
    signature = (scene, variants, **more),
    text_signature = "(scene, variants, *, budgets=(1, 2, 4), seeds=3, size=None, illumination=None, max_reflections=None, reference=None, reference_seconds=30, reference_method='path')"
)]
pub fn compare<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    variants: Vec<Bound<'py, PyDict>>,
    more: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let begin = Instant::now();
    let more = Options::of("compare()", more)?;
    let (ready, mut comparing) = asked(py, scene, &more)?;
    more.finish()?;
    for variant in &variants {
        comparing.course.variants.push(of(variant, &comparing.base)?);
    }
    let names: Vec<_> = comparing.course.variants.iter().map(|variant| variant.name.as_str()).collect();
    if let Some((i, twice)) = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)) {
        return Err(usage(format!(
            "compare(): variant {i} is called {twice} like one before it; give it another name"
        )));
    }
    comparing.course.load_seconds = begin.elapsed().as_secs_f64();
    let rows = wait(py, &Stop::default(), || comparing.rows(&ready))?.map_err(raised)?;
    py.import("json")?.call_method1("loads", (PyString::new(py, &rows),))
}

fn asked(py: Python<'_>, scene: &Bound<'_, Scene>, more: &Options<'_>) -> PyResult<(Ready, Comparing)> {
    let mut budgets =
        more.get::<Vec<f64>>("budgets", "numbers of seconds")?.unwrap_or_else(|| vec![1.0, 2.0, 4.0]);
    budgets.sort_by(f64::total_cmp);
    if budgets.is_empty() || !budgets.iter().all(|seconds| *seconds > 0.0 && seconds.is_finite()) {
        return Err(usage("budgets: give at least one number of seconds above zero"));
    }
    let seeds = more.get::<u64>("seeds", "a whole number")?.unwrap_or(3);
    if !(1..=1000).contains(&seeds) {
        return Err(usage(format!("seeds={seeds}: give 1 to 1000 runs")));
    }
    let reference = more.get::<Bound<'_, Picture>>("reference", "a Picture")?;
    let given = reference.map(|picture| Reference::of(picture.get().image()));
    let given = given.transpose().map_err(|why| usage(format!("reference: {why}")))?;
    let seconds = more.get::<f64>("reference_seconds", "a number of seconds")?.unwrap_or(30.0);
    if !(seconds > 0.0 && seconds.is_finite()) {
        return Err(usage(format!("reference_seconds={seconds}: not a finite number above zero")));
    }
    let by = method(more, "reference_method")?.unwrap_or(Method::Path);
    can_refer(by).map_err(raised)?;
    let wanted = Wanted::common(more)?;
    let ready = scene.get().ready(py, wanted.illumination)?;
    let (base, _) = wanted.on(&ready);
    if let Some(given) =
        given.as_ref().filter(|given| (given.width, given.height) != (base.width, base.height))
    {
        let (width, height) = (given.width, given.height);
        return Err(usage(format!(
            "reference: it has {width}x{height} pixels; give size=({width}, {height})"
        )));
    }
    let course = Course { variants: Vec::new(), seeds: (1..=seeds).collect(), budgets, load_seconds: 0.0 };
    Ok((ready, Comparing { course, base, given, method: by, seconds }))
}

/// A variant: its name, and the settings that are its own.
fn of(variant: &Bound<'_, PyDict>, base: &Settings) -> PyResult<Variant> {
    let more = Options::of("compare(): a variant", Some(variant))?;
    let name =
        more.get::<String>("name", "a name")?.ok_or_else(|| usage("compare(): give each variant a name"))?;
    let own = Wanted::own(&more)?;
    more.finish()?;
    let denoise = own.denoise;
    Ok(Variant { name, settings: own.over(base), denoise })
}

impl Comparing {
    /// Every run at every budget, as JSON.
    fn rows(&self, scene: &Ready) -> Result<String> {
        let runs = race(scene, &self.course, |_| {})?;
        let rule = MaskRule { above: 3.0, dilate: 3 };
        let reference = match &self.given {
            Some(given) => given.clone(),
            None => self.reference(scene, &runs)?,
        };
        let report = evaluate(scene, &runs, &reference, &rule, (String::new(), String::new()));
        Ok(serde_json::to_string(&report.runs).expect("plain data"))
    }

    /// Rendered for its time, and until it has as many samples as the longest run.
    fn reference(&self, scene: &Ready, runs: &[Run]) -> Result<Reference> {
        let folder = tempfile::tempdir()
            .map_err(|source| halflight::error::Error::Read { path: std::env::temp_dir(), source })?;
        let mut maker = ReferenceMaker::new(scene, &self.base, self.method, folder.path())?;
        let samples =
            |run: &Run| run.snapshots.last().map_or(0, |last| u64::from(last.passes) * run.samples_per_pass);
        let looks = runs.iter().map(samples).max().unwrap_or(0);
        maker.extend_to(self.seconds)?;
        while maker.camera_samples() < looks {
            maker.extend_to(1.5 * maker.seconds())?;
        }
        Ok(maker.reference())
    }
}
