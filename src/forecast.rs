//! What a render will take, and what each omission saves: a small pass on a clock.
//!
//! Times are processor time over all threads: what else the machine is doing hardly matters to them. Nothing that decides
//! a picture comes from here.

use crate::film::{Film, Layer};
use crate::gather::{Connections, Maps, Pixel, gather};
use crate::light::{Invisible, Light, Power};
use crate::plan::{Method, Plan, Settings};
use crate::render::render_pass;
use crate::scene::Scene;
use crate::shoot::{Photon, shoot};
use cpu_time::ProcessTime;
use glam::Vec3;

/// Bytes that a render holds, good to a third.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Triangles, vertices, normals.
    pub scene: usize,
    /// The index of triangles, that of shadow casters, and the rims of surfaces.
    pub index: usize,
    /// Sums over passes.
    pub film: usize,
    /// The photons of one pass, while their map is built.
    pub photons: usize,
    /// The pixels of one pass.
    pub pass: usize,
    /// What loading and indexing hold besides, before the first pass.
    pub planning: usize,
}

/// The program itself, its threads and the files it writes: measured, a render of one pixel.
const PROGRAM: usize = 12_000_000;
/// For each triangle while a scene is read and its index is built: measured on half a million triangles.
const PER_TRIANGLE: usize = 400;

impl Memory {
    /// The most that is held at the same time.
    pub fn total(self) -> usize {
        let Self { scene, index, film, photons, pass, planning } = self;
        PROGRAM + scene + film + planning.max(index + photons + pass)
    }
}

/// Processor seconds, all threads together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stages {
    /// Shooting photons.
    pub shoot: f64,
    /// Making maps of them.
    pub maps: f64,
    /// Camera paths.
    pub gather: f64,
}

impl Stages {
    /// All of them.
    pub fn total(self) -> f64 {
        self.shoot + self.maps + self.gather
    }

    fn scaled(self, factor: f64) -> Self {
        Self { shoot: factor * self.shoot, maps: factor * self.maps, gather: factor * self.gather }
    }
}

/// What a render will take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Bytes.
    pub memory: Memory,
    /// Processor seconds that planning took, once.
    pub planning: f64,
    /// Of one pass.
    pub pass: Stages,
}

/// What leaving one thing out saves; below zero, what it costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saving {
    /// The name of the omission.
    pub name: &'static str,
    /// The processor time of a pass with it, as a share more than without: 1 is twice the time.
    pub pass: f64,
    /// Processor seconds of planning.
    pub planning: f64,
    /// Bytes.
    pub bytes: i64,
}

/// Camera paths and photon paths of the small pass, at the most.
const PILOT: f64 = 16_384.0;
/// It is timed so often, and the fastest counts: others were disturbed.
const TIMES: usize = 3;

impl Forecast {
    /// Plans, timed, and looks ahead.
    pub fn make(scene: Scene, settings: Settings, layers: &[Layer]) -> (Plan, Self) {
        let (planning, mut plan) = timed(|| Plan::new(scene, settings));
        let forecast = Self::of(&mut plan, planning, layers);
        (plan, forecast)
    }

    fn of(plan: &mut Plan, planning: f64, layers: &[Layer]) -> Self {
        // Where there is no image a pass would not end.
        if plan.existence.is_refuted() && plan.settings.max_reflections.is_none() {
            return Self { memory: Memory::of(plan, 0.0, layers), planning, pass: Stages::default() };
        }
        let (asked, photons) = (plan.settings.clone(), plan.photons.clone());
        let share = shrink(plan);
        let (mut pass, stored) = time(plan);
        for _ in 1..TIMES {
            let (again, _) = time(plan);
            if again.total() < pass.total() {
                pass = again;
            }
        }
        (plan.settings, plan.photons) = (asked, photons);
        let memory = Memory::of(plan, stored as f64 / share, layers);
        Self { memory, planning, pass: pass.scaled(1.0 / share) }
    }
}

/// What each omission of a plan saves: the same plan once more with that thing in it.
pub fn savings(scene: &Scene, plan: &Plan, without: &Forecast, layers: &[Layer]) -> Vec<Saving> {
    let saving = |name: &'static str| {
        let keep = name.parse().expect("an omission's name");
        let mut settings = plan.settings.clone();
        settings.keep.push(keep);
        let (_, with) = Forecast::make(scene.clone(), settings, layers);
        Saving {
            name,
            pass: with.pass.total() / without.pass.total() - 1.0,
            planning: with.planning - without.planning,
            bytes: with.memory.total() as i64 - without.memory.total() as i64,
        }
    };
    plan.omissions.iter().map(|omission| saving(omission.name)).collect()
}

impl Memory {
    fn of(plan: &Plan, stored: f64, layers: &[Layer]) -> Self {
        let Settings { width, height, invisible, .. } = plan.settings;
        let pixels = width as usize * height as usize;
        let both = plan.photons.as_ref().is_some_and(|photons| photons.both_halves);
        let photon = if both { size_of::<Photon<Light>>() } else { size_of::<Photon<Invisible>>() };
        // Twice while they are put in order, with a sort key, a position and a place in the tree.
        let photons = stored * (2 * photon + 16 + 12 + 16) as f64;
        let pixel = if invisible { size_of::<Pixel<2>>() } else { size_of::<Pixel<1>>() };
        let planes = layers.len().max(1) + 1;
        Self {
            scene: plan.scene.mesh.bytes(),
            index: plan.index_bytes(),
            film: Film::bytes(width, height, layers),
            photons: photons as usize,
            pass: pixels * (pixel + planes * size_of::<Vec3>()),
            planning: PER_TRIANGLE * plan.scene.mesh.triangles.len(),
        }
    }
}

/// Makes the pass smaller, pixels and photons alike, and says by how much. Queries meet as many photons as before.
fn shrink(plan: &mut Plan) -> f64 {
    let Settings { width, height, .. } = plan.settings;
    let pixels = f64::from(width) * f64::from(height);
    let paths = plan.photons.as_ref().map_or(0.0, |photons| f64::from(photons.paths));
    let share = (PILOT / pixels.max(paths)).min(1.0);
    let side = |side: u32| ((share.sqrt() * f64::from(side)).round() as u32).max(1);
    (plan.settings.width, plan.settings.height) = (side(width), side(height));
    if let Some(photons) = &mut plan.photons {
        photons.paths = ((share * paths).round() as u32).max(1);
    }
    let Settings { width, height, .. } = plan.settings;
    f64::from(width) * f64::from(height) / pixels
}

/// The stages of a pass, and how many photons it stored.
fn time(plan: &Plan) -> (Stages, usize) {
    let both = plan.photons.as_ref().is_some_and(|photons| photons.both_halves);
    match (plan.settings.method, both, plan.settings.invisible) {
        (Method::Path | Method::PathPlain, ..) => {
            let connections = Connections::new(plan);
            let (gather, _) = timed(|| render_pass(plan, &connections, u32::MAX, &[Layer::Visible]));
            (Stages { gather, ..Stages::default() }, 0)
        }
        (Method::Photon, false, false) => stages::<Invisible, 1>(plan),
        (Method::Photon, false, true) => stages::<Invisible, 2>(plan),
        (Method::Photon, true, false) => stages::<Light, 1>(plan),
        (Method::Photon, true, true) => stages::<Light, 2>(plan),
    }
}

fn stages<P: Power, const R: usize>(plan: &Plan) -> (Stages, usize) {
    let connections = Connections::new(plan);
    let shot =
        || plan.photons.as_ref().map_or_else(crate::render::no_photons, |p| shoot::<P>(plan, p, u32::MAX));
    let (shoot, photons) = timed(shot);
    let stored = photons.by_class.iter().map(Vec::len).sum();
    let (maps, built) = timed(|| Maps::build(photons, plan, 0));
    let (gather, _) = timed(|| gather::<P, R>(plan, &connections, &built, u32::MAX));
    (Stages { shoot, maps, gather }, stored)
}

/// Processor seconds that `work` takes, and what it makes.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let begin = ProcessTime::now();
    let made = work();
    (begin.elapsed().as_secs_f64(), made)
}
