//! Several ways to render one scene, each with several seeds, side by side, timed as a user would time them.
//!
//! The run that has used the least time renders the next pass. So all of them advance together, and whatever disturbs the
//! machine affects all of them alike.

use crate::error::{Error, Result};
use crate::film::Layer;
use crate::film::denoise::FEATURES;
use crate::machine::{self, MemoryLimit};
use crate::memory::{Memory, words};
use crate::plan::{Method, Settings};
use crate::render::Render;
use crate::scene::Scene;
use glam::Vec3;
use std::time::Instant;

/// What is run.
#[derive(Clone, Debug)]
pub struct Course {
    /// Who takes part.
    pub variants: Vec<Variant>,
    /// One run of each variant for each of these.
    pub seeds: Vec<u64>,
    /// Times in seconds at which pictures are kept, ascending.
    pub budgets: Vec<f64>,
    /// What loading the scene took, in seconds: a user waits for it in every run.
    pub load_seconds: f64,
}

/// A way to render.
#[derive(Clone, Debug)]
pub struct Variant {
    /// What it is called; no two are called alike.
    pub name: String,
    /// How; the seed is set for each run.
    pub settings: Settings,
    /// Whether the denoised picture is measured, and not the picture itself.
    pub denoise: bool,
}

impl Variant {
    /// One that is called by its method.
    pub fn of(method: Method, settings: &Settings) -> Self {
        Self { name: method.name().into(), settings: Settings { method, ..settings.clone() }, denoise: false }
    }

    /// The layers of its film.
    fn layers(&self) -> Vec<Layer> {
        let features = if self.denoise { &FEATURES[..] } else { &[] };
        [&[Layer::Visible], features].concat()
    }

    /// What it holds in memory for each pixel.
    fn memory(&self) -> Memory {
        let memory = Memory::of_pixels(&self.settings, &self.layers());
        let size = (self.settings.width, self.settings.height);
        if self.denoise { memory.with_denoising(size) } else { memory }
    }
}

/// One variant with one seed.
#[derive(Clone, Debug)]
pub struct Run {
    /// The name of the variant.
    pub variant: String,
    /// From which all randomness follows.
    pub seed: u64,
    /// Seconds for loading and planning (the pilot and the ray index included); part of every snapshot's time.
    pub setup_seconds: f64,
    /// Photon paths shot in a pass.
    pub paths_per_pass: u64,
    /// Camera samples taken in a pass.
    pub samples_per_pass: u64,
    /// One for each budget, in order.
    pub snapshots: Vec<Snapshot>,
}

/// The picture at the end of the pass in which a budget was passed.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The budget, in seconds.
    pub budget: f64,
    /// The time really used: set-up and all passes with their adding to the film. Neither writing files nor measuring
    /// errors is counted; denoising is, which is done once.
    pub seconds: f64,
    /// Passes in the picture.
    pub passes: u32,
    /// The visible layer, or the denoised one.
    pub picture: Vec<Vec3>,
}

struct Runner {
    render: Render,
    denoise: bool,
    seconds: f64,
    run: Run,
}

/// Runs all variants and seeds until each has passed the last budget; `progress` is told the seconds that the slowest
/// run has used. Pictures depend on the seed alone, times on the machine.
///
/// # Errors
/// A variant that cannot render the scene; more memory for films and pictures than the machine has.
pub fn race(scene: &Scene, course: &Course, mut progress: impl FnMut(f64)) -> Result<Vec<Run>> {
    check_memory(course, machine::memory())?;
    let last = course.budgets.last().copied().unwrap_or(0.0);
    let mut runners = Vec::new();
    for &seed in &course.seeds {
        for variant in &course.variants {
            runners.push(start(scene, course, variant, seed)?);
        }
    }
    loop {
        let waiting = runners.iter_mut().filter(|runner| runner.run.snapshots.len() < course.budgets.len());
        let Some(next) = waiting.min_by(|a, b| a.seconds.total_cmp(&b.seconds)) else { break };
        progress(next.seconds.min(last));
        next.pass(&course.budgets);
    }
    Ok(runners.into_iter().map(|runner| runner.run).collect())
}

/// Films of all runs stand side by side, each with a picture for every budget, while one renders a pass.
fn check_memory(course: &Course, limit: Option<MemoryLimit>) -> Result<()> {
    let Some(MemoryLimit { bytes, of }) = limit else { return Ok(()) };
    let parts: Vec<_> = course.variants.iter().map(Variant::memory).collect();
    let pictures = |settings: &Settings| settings.pixels() * course.budgets.len() * size_of::<Vec3>();
    let kept: usize = course.variants.iter().map(|variant| pictures(&variant.settings)).sum();
    let films: usize = parts.iter().map(|memory| memory.film).sum();
    let pass = parts.iter().map(|memory| memory.pass.max(memory.writing)).max().unwrap_or(0);
    let total = course.seeds.len() * (films + kept) + pass;
    if total as u64 <= bytes {
        return Ok(());
    }
    let runs = course.seeds.len() * course.variants.len();
    let (total, bytes) = (words(total as f64), words(bytes as f64));
    Err(Error::Usage(format!(
        "{runs} runs side by side take about {total} of memory and {of} {bytes}: compare a smaller picture, or fewer seeds or budgets"
    )))
}

fn start(scene: &Scene, course: &Course, variant: &Variant, seed: u64) -> Result<Runner> {
    let method = variant.settings.method;
    let (scene, settings) = (scene.clone(), Settings { seed, ..variant.settings.clone() });
    let begin = Instant::now();
    let render = Render::new(scene, settings, &variant.layers())?;
    let seconds = course.load_seconds + begin.elapsed().as_secs_f64();
    let run = Run {
        variant: variant.name.clone(),
        seed,
        setup_seconds: seconds,
        paths_per_pass: render.frame().photons.as_ref().map_or(0, |photons| photons.paths.into()),
        samples_per_pass: render.frame().camera_samples(method),
        snapshots: Vec::new(),
    };
    Ok(Runner { render, denoise: variant.denoise, seconds, run })
}

impl Runner {
    fn pass(&mut self, budgets: &[f64]) {
        let begin = Instant::now();
        self.render.pass();
        self.seconds += begin.elapsed().as_secs_f64();
        let passed = budgets[self.run.snapshots.len()..].iter().take_while(|&&budget| self.seconds >= budget);
        for &budget in passed {
            let film = self.render.film();
            let begin = Instant::now();
            let denoised = if self.denoise { film.denoised() } else { None };
            let denoising = begin.elapsed().as_secs_f64();
            let picture = denoised.unwrap_or_else(|| film.mean(Layer::Visible));
            let seconds = self.seconds + if self.denoise { denoising } else { 0.0 };
            let snapshot = Snapshot { budget, seconds, passes: film.passes(), picture };
            self.run.snapshots.push(snapshot);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_pass_every_budget_and_pictures_are_those_of_a_render() {
        let scene = Scene::load("builtin:cornell-spheres").unwrap();
        let settings = Settings { width: 16, height: 16, paths: Some(2000), ..Settings::default() };
        let [photon, path] = [Method::Photon, Method::Path].map(|method| Variant::of(method, &settings));
        let denoised = Variant { name: "denoised".into(), denoise: true, ..photon.clone() };
        let variants = [photon, path, denoised];
        let course = Course {
            variants: variants.to_vec(),
            seeds: vec![3, 4],
            budgets: vec![0.02, 0.05],
            load_seconds: 0.001,
        };
        let runs = race(&scene, &course, |_| {}).unwrap();
        assert_eq!(runs.len(), 6);
        for run in &runs {
            assert!(run.setup_seconds > 0.001 && run.snapshots.len() == 2);
            let snapshot = &run.snapshots[1];
            assert!(snapshot.seconds >= 0.05 && snapshot.passes >= run.snapshots[0].passes);
            let variant = variants.iter().find(|variant| variant.name == run.variant).expect("it ran");
            let again = Settings { seed: run.seed, ..variant.settings.clone() };
            let mut render =
                Render::new(scene.clone(), again, &FEATURES[..if variant.denoise { 2 } else { 0 }]).unwrap();
            (0..snapshot.passes).for_each(|_| render.pass());
            let (film, denoised) =
                (render.film(), variant.denoise.then(|| render.film().denoised()).flatten());
            assert_eq!(denoised.unwrap_or_else(|| film.mean(Layer::Visible)), snapshot.picture);
        }
    }
}
