//! `halflight compare`: error against run time.

pub use super::compare_args::CompareArgs;
use super::compare_variants::{method, variants};
use super::out::say;
use super::output::{Overwrite, claim, refuse_input};
use super::scene_args::SceneArgs;
use super::threads::start_threads;
use crate::compare::{Course, Reference, ReferenceMaker, Run, Variant, can_refer, candidates, race};
use crate::error::{Error, Result};
use crate::film::{is_ours, replace_file};
use crate::plan::{Method, Settings};
use crate::report::evaluate::{MARGIN, MaskRule, evaluate, good_enough, medians};
use crate::report::{Comparison, SceneReport, csv, data, json, page, svg};
use crate::scene::{Loaded, Scene};
use std::path::{Path, PathBuf};
use std::time::Instant;

const FILES: [&str; 4] = ["compare.csv", "compare.json", "compare.svg", "compare.html"];

/// Measures, writes the files, and prints who is ahead.
pub fn run(args: &CompareArgs) -> Result<()> {
    let variants = variants(args)?;
    let reference_method = args.reference_method.as_deref();
    let reference_method = reference_method.map(|name| method("--reference-method", name)).transpose()?;
    reference_method.map_or(Ok(()), can_refer)?;
    let scenes = args.scene_args();
    scenes.iter().try_for_each(|scene| scene.illuminations().map(drop))?;
    if args.reference.is_some() && scenes.len() > 1 {
        return Err(Error::Usage("--reference is of one scene in one light; compare one at a time".into()));
    }
    let given = args.reference.as_deref().map(Reference::read).transpose()?;
    let cache = args.cache.clone().unwrap_or_else(|| args.output.join("cache"));
    for folder in [&args.output, &cache] {
        if folder.exists() && !folder.is_dir() {
            let reason = "this is no folder; give another name, or the name of a folder".into();
            return Err(Error::Write { path: folder.clone(), reason });
        }
        std::fs::create_dir_all(folder).map_err(|e| cannot_write(folder, &e))?;
    }
    claim_files(args)?;
    if let Some(threads) = args.threads {
        start_threads(threads, args.quiet)?;
    }
    let plan = Comparing { args, variants, reference_method, given, cache };
    let mut reports = Vec::new();
    for scene in &scenes {
        reports.push(plan.one(scene)?);
    }
    let comparison = plan.comparison(reports);
    plan.write(&comparison)
}

/// The four files are one another's: where the JSON is ours, so are the table and the curves, which cannot say so themselves.
fn claim_files(args: &CompareArgs) -> Result<()> {
    let inputs: Vec<PathBuf> = args.reference.iter().chain(&args.scenes).cloned().collect();
    let ours = is_ours(&args.output.join("compare.json")).unwrap_or(false);
    let overwrite = Overwrite { overwrite: args.overwrite.overwrite || ours };
    FILES.iter().try_for_each(|name| claim(&args.output.join(name), &inputs, overwrite).map(drop))
}

/// What was asked for, resolved.
struct Comparing<'a> {
    args: &'a CompareArgs,
    variants: Vec<Variant>,
    reference_method: Option<Method>,
    given: Option<Reference>,
    cache: PathBuf,
}

impl Comparing<'_> {
    fn say(&self, line: &str) {
        if !self.args.quiet {
            say(format_args!("{line}"));
        }
    }

    fn rule(&self) -> MaskRule {
        MaskRule { above: self.args.mask_above, dilate: self.args.dilate }
    }

    fn one(&self, scene_args: &SceneArgs) -> Result<SceneReport> {
        let begin = Instant::now();
        let Loaded { scene, files, .. } = scene_args.load_with_files()?;
        FILES.iter().try_for_each(|name| refuse_input(&self.args.output.join(name), &files))?;
        let load_seconds = begin.elapsed().as_secs_f64();
        if let Some(given) = &self.given {
            self.check(given, &scene)?;
        }
        self.say(&format!("{}, {}", scene.name, scene.describe_illumination()));
        let course = Course {
            variants: self.variants.clone(),
            seeds: (1..=self.args.seeds).collect(),
            budgets: self.args.budgets(),
            load_seconds,
        };
        let total = course.budgets.last().copied().unwrap_or(0.0);
        let mut next = 0.1;
        let runs = race(&scene, &course, |seconds| {
            if seconds >= next * total {
                self.say(&format!("  racing: {seconds:.1} of {total} s"));
                next = seconds / total + 0.2;
            }
        })?;
        let (reference, file, origin) = match &self.given {
            Some(given) => {
                let file = self.args.reference.as_deref().unwrap_or(Path::new(""));
                (given.clone(), file.display().to_string(), "given".into())
            }
            None => self.make_reference(&scene, &self.args.settings(), &runs)?,
        };
        if self.rule().left_out(&reference).iter().all(|out| *out) {
            return Err(Error::Usage(
                "the mask leaves no pixel to compare; raise --mask-above or lower --dilate".into(),
            ));
        }
        Ok(evaluate(&scene, &runs, &reference, &self.rule(), (file, origin)))
    }

    /// A reference that cannot be of these runs.
    fn check(&self, given: &Reference, scene: &Scene) -> Result<()> {
        let path = self.args.reference.clone().unwrap_or_default();
        let wrong = |reason: String| Error::Image { path, reason };
        let (width, height) = self.args.size;
        if (given.width, given.height) != (width, height) {
            let (w, h) = (given.width, given.height);
            return Err(wrong(format!(
                "{w} x {h} pixels, but --size is {width} x {height}; give --size {w}x{h}"
            )));
        }
        let hash = format!("{:016x}", scene.hash());
        if given.scene_hash.as_ref().is_some_and(|of| *of != hash) {
            return Err(wrong(format!(
                "it shows another scene or light than {}; render it again",
                scene.name
            )));
        }
        Ok(())
    }

    /// Takes up or makes a reference, and goes on until it is good enough or the time is over.
    fn make_reference(
        &self,
        scene: &Scene,
        settings: &Settings,
        runs: &[Run],
    ) -> Result<(Reference, String, String)> {
        let (mut maker, why) = self.choose_reference(scene, settings)?;
        let (method, limit) = (maker.method(), self.args.reference_time.as_secs_f64());
        let from = if maker.from_cache { "taken up from" } else { "kept in" };
        self.say(&format!("  reference by {} ({why}), {from} {}", method.name(), maker.file().display()));
        // What the camera sees by chance, such as a lamp's mirror image in a facet, is left out or measured against only where the
        // reference has met it too, and its spread does not tell of it before.
        let longest = runs
            .iter()
            .filter_map(|run| run.snapshots.last().map(|last| u64::from(last.passes) * run.samples_per_pass));
        let looks = longest.max().unwrap_or(0);
        loop {
            let reference = maker.reference();
            let left_out = self.rule().left_out(&reference);
            let own = reference.own_error(&left_out);
            let medians = medians(runs, &reference, &left_out);
            let smallest = medians.iter().map(|m| m.2).fold(f64::INFINITY, f64::min);
            self.say(&format!(
                "  reference: {:.1} s, {} passes, noise {:.2e}, bias {:.2e}: what may be left is {:.1} times below {smallest:.2e}",
                reference.seconds,
                reference.passes,
                own.noise,
                own.bias.unwrap_or(0.0),
                smallest / own.total
            ));
            let done = good_enough(&medians, &own) && maker.camera_samples() >= looks;
            if done || maker.seconds() >= limit {
                let origin = format!("made by {} ({why})", method.name());
                return Ok((reference, maker.file().display().to_string(), origin));
            }
            // In steps of half as much again, so that little is done in vain.
            maker.extend_to((1.5 * maker.seconds()).min(limit))?;
        }
    }

    /// The one asked for; else of those that fit the scene the one whose error after a first thirtieth of the time
    /// promises to be the smallest in the end.
    fn choose_reference(&self, scene: &Scene, settings: &Settings) -> Result<(ReferenceMaker, String)> {
        let fitting = match self.reference_method {
            Some(method) => vec![method],
            None => candidates(scene, settings),
        };
        let limit = self.args.reference_time.as_secs_f64();
        let mut tried = Vec::new();
        for &method in &fitting {
            let mut maker = ReferenceMaker::new(scene, settings, method, &self.cache)?;
            if !maker.from_cache {
                maker.extend_to(limit / 30.0)?;
            }
            let reference = maker.reference();
            let own = reference.own_error(&self.rule().left_out(&reference));
            let promise = own.after(method, limit.max(maker.seconds()) / maker.seconds());
            tried.push((promise, maker));
        }
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        let why = match (&tried[..], self.reference_method) {
            (_, Some(_)) => "asked for".to_owned(),
            ([(best, _), (second, other)], _) => {
                let other = other.method().name();
                format!("promises an error of {best:.1e} in the time given, {other} {second:.1e}")
            }
            _ => "no light reaches a surface through mirrors or glass, so it converges, without bias"
                .to_owned(),
        };
        Ok((tried.swap_remove(0).1, why))
    }

    fn comparison(&self, scenes: Vec<SceneReport>) -> Comparison {
        let command: Vec<String> = std::env::args().skip(1).collect();
        Comparison {
            program: concat!("halflight ", env!("CARGO_PKG_VERSION")).into(),
            command: format!("halflight {}", command.join(" ")),
            threads: rayon::current_num_threads(),
            width: self.args.size.0,
            height: self.args.size.1,
            methods: self.variants.iter().map(|variant| variant.name.clone()).collect(),
            seeds: (1..=self.args.seeds).collect(),
            budgets: self.args.budgets(),
            definitions: data::DEFINITIONS.to_vec(),
            scenes,
        }
    }

    /// Raw runs in any case; curves and page only where references bear them.
    fn write(&self, comparison: &Comparison) -> Result<()> {
        let file = |name: &str| self.args.output.join(name);
        let put = |name: &str, text: String| replace_file(&file(name), |out| out.write_all(text.as_bytes()));
        put("compare.csv", csv(comparison))?;
        put("compare.json", json(comparison))?;
        if let Some(scene) = comparison.scenes.iter().find(|scene| scene.reference.refused) {
            return Err(Error::Usage(refusal(scene, self.given.is_some())));
        }
        put("compare.svg", svg(comparison))?;
        put("compare.html", page(comparison).map_err(|e| cannot_write(&file("compare.html"), &e))?)?;
        for scene in &comparison.scenes {
            for pair in &scene.pairs {
                let (error, time) = (&pair.error_ratio, &pair.time_ratio);
                self.say(&format!(
                    "{}, {}: relMSE of {} over that of {} at {:.1} s: {:.3} [{:.3}, {:.3}]; time to {:.2e}: {} {:.3} [{:.3}, {:.3}]",
                    scene.scene,
                    scene.illumination,
                    pair.b,
                    pair.a,
                    pair.seconds,
                    error.value,
                    error.low,
                    error.high,
                    pair.relmse,
                    pair.time_relation,
                    time.value,
                    time.low,
                    time.high
                ));
            }
        }
        self.say(&format!("wrote {}", FILES.map(|name| file(name).display().to_string()).join(", ")));
        Ok(())
    }
}

fn refusal(scene: &SceneReport, given: bool) -> String {
    let reference = &scene.reference;
    let way_out = if given {
        "render it with more passes".to_owned()
    } else {
        // The error falls about as 1/time, or more slowly where photons make it.
        let factor = MARGIN / reference.margin;
        let wanted = reference.seconds * if reference.method == "photon" { factor.powf(1.5) } else { factor };
        format!("give about --reference-time {:.0}s, it goes on from where it is", 1.2 * wanted)
    };
    format!(
        "{}: the reference's own error (bias and what may be left of its noise: relMSE {:.1e}) is only {:.1} times below the smallest \
         error measured, and must be {MARGIN} times below; {way_out}; too noisy for {}; compare.csv and compare.json have the raw runs",
        scene.scene,
        reference.own_error.total,
        reference.margin,
        reference.too_noisy_for.join(", ")
    )
}

fn cannot_write(path: &Path, e: &std::io::Error) -> Error {
    Error::Write { path: path.into(), reason: e.to_string() }
}
