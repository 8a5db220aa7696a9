//! What a render will take, and what each omission saves: a small pass, timed.
//!
//! Times are processor time over all threads, so that other work on the machine hardly matters. Nothing that decides a picture
//! comes from here.

use crate::existence::Existence;
use crate::film::Layer;
use crate::gather::{Density, Maps, NearestMaps, gather};
use crate::light::{Invisible, Light, Power};
use crate::memory::Memory;
use crate::pass::{Kernel, render_pass};
use crate::pilot::learn;
use crate::plan::{Frame, Method, Omittable, Plan, Settings};
use crate::scene::Scene;
use crate::shoot::shoot;
use cpu_time::ProcessTime;
use std::time::Instant;

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
    /// Processor seconds that the small pass took.
    took: f64,
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
/// Of the one by which a render finds its pace.
const PACED: f64 = 32_768.0;
/// Lines of its photons, at the most, as far as a path can be made no shorter.
const PILOT_LINES: f64 = 2.0e5;
/// It is timed so often, and the fastest counts: others were disturbed.
const TIMES: usize = 3;
/// But only once where it takes longer than this, and savings are not looked for: processor seconds.
const LONG: f64 = 1.0;
/// A small pass on the wall's clock is tried again where it takes less than this: seconds.
const QUICK: f64 = 0.1;

impl Forecast {
    /// Plans, timed, and looks ahead.
    pub fn make(scene: Scene, settings: Settings, layers: &[Layer]) -> (Plan, Frame, Self) {
        Self::knowing(scene, settings, layers, None)
    }

    fn knowing(
        scene: Scene,
        settings: Settings,
        layers: &[Layer],
        known: Option<Existence>,
    ) -> (Plan, Frame, Self) {
        let (planning, (plan, frame)) = timed(&processor, || planned(scene, settings, known));
        let forecast = Self::of(&plan, &frame, planning, layers);
        (plan, frame, forecast)
    }

    fn of(plan: &Plan, frame: &Frame, planning: f64, layers: &[Layer]) -> Self {
        let memory = Memory::of(plan, frame, layers);
        if plan.is_endless() {
            return Self { memory, planning, pass: Stages::default(), took: 0.0 };
        }
        let (small, share) = shrunk(frame, PILOT);
        let mut pass = time(plan, &small, &processor);
        let took = pass.total();
        for _ in 1..TIMES {
            let again = if took < LONG { time(plan, &small, &processor) } else { break };
            if again.total() < pass.total() {
                pass = again;
            }
        }
        Self { memory, planning, pass: pass.scaled(1.0 / share), took }
    }
}

fn planned(scene: Scene, settings: Settings, known: Option<Existence>) -> (Plan, Frame) {
    let plan = Plan::with_existence(scene, settings, known);
    let frame = learn(&plan);
    (plan, frame)
}

/// Seconds of a pass on the clock on the wall, all threads at work.
pub(super) fn seconds_of_a_pass(plan: &Plan, frame: &Frame) -> Stages {
    let (small, share) = shrunk(frame, PACED);
    let begin = Instant::now();
    let clock = || begin.elapsed().as_secs_f64();
    let mut pass = time(plan, &small, &clock);
    // The first touches everything for the first time.
    if pass.total() < QUICK {
        pass = time(plan, &small, &clock);
    }
    pass.scaled(1.0 / share)
}

/// What each omission of a plan saves: the same plan once more with that thing in it. None: a pass takes too long to try.
pub fn savings(
    scene: &Scene,
    plan: &Plan,
    frame: &Frame,
    without: &Forecast,
    layers: &[Layer],
) -> Option<Vec<Saving>> {
    if without.took > LONG {
        return None;
    }
    // Whether there is an image is found out once; it is the same for all but its own omission.
    let known = Some(plan.existence.clone());
    // So is who serves direct light.
    let asked = Settings { direct: frame.direct, ..plan.settings.clone() };
    let (planning, _) = timed(&processor, || planned(scene.clone(), asked.clone(), known.clone()));
    let saving = |name: &'static str| {
        let keep: Omittable = name.parse().expect("an omission's name");
        let mut settings = asked.clone();
        settings.keep.push(keep);
        let known = if keep == Omittable::Existence { None } else { known.clone() };
        let (.., with) = Forecast::knowing(scene.clone(), settings, layers, known);
        Saving {
            name,
            pass: with.pass.total() / without.pass.total() - 1.0,
            planning: with.planning - planning,
            bytes: with.memory.total() as i64 - without.memory.total() as i64,
        }
    };
    Some(plan.omissions.iter().map(|omission| saving(omission.name)).collect())
}

/// A smaller pass, pixels and photons alike, `most` of either, and how much of the whole it is. Queries meet as many photons as before.
fn shrunk(frame: &Frame, most: f64) -> (Frame, f64) {
    let Frame { width, height, .. } = *frame;
    let pixels = f64::from(width) * f64::from(height);
    let paths = frame.photons.as_ref().map_or(0.0, |photons| f64::from(photons.paths));
    let lines = frame.photons.as_ref().map_or(0.0, |photons| paths * photons.per_path.lines);
    let share = (most / pixels.max(paths)).min(PILOT_LINES / lines).min(1.0);
    let side = |side: u32| ((share.sqrt() * f64::from(side)).round() as u32).max(1);
    let mut small = Frame { width: side(width), height: side(height), ..frame.clone() };
    let Some(photons) = &mut small.photons else {
        let share = small.pixels() as f64 / pixels;
        return (small, share);
    };
    photons.paths = ((share * paths).round() as u32).max(1);
    let share = f64::from(photons.paths) / paths;
    (small, share)
}

/// The stages of a pass.
fn time(plan: &Plan, frame: &Frame, clock: &dyn Fn() -> f64) -> Stages {
    if !plan.settings.method.shoots() {
        let (gather, _) = timed(clock, || render_pass(plan, frame, u32::MAX, &[Layer::Visible]));
        return Stages { gather, ..Stages::default() };
    }
    match Kernel::of(plan, frame) {
        Kernel { both_halves: false, invisible: false } => stages::<Invisible, 1>(plan, frame, clock),
        Kernel { both_halves: false, invisible: true } => stages::<Invisible, 2>(plan, frame, clock),
        Kernel { both_halves: true, invisible: false } => stages::<Light, 1>(plan, frame, clock),
        Kernel { both_halves: true, invisible: true } => stages::<Light, 2>(plan, frame, clock),
    }
}

fn stages<P: Power, const R: usize>(plan: &Plan, frame: &Frame, clock: &dyn Fn() -> f64) -> Stages {
    let (shoot, photons) = timed(clock, || shoot::<P>(plan, frame, u32::MAX));
    let [maps, gather] = match plan.settings.method {
        Method::Nearest => read::<_, R>(plan, frame, clock, || NearestMaps::build(photons, &plan.settings)),
        _ => read::<_, R>(plan, frame, clock, || Maps::build(photons, plan, frame, 0)),
    };
    Stages { shoot, maps, gather }
}

/// What making maps takes, and what reading them.
fn read<D: Density, const R: usize>(
    plan: &Plan,
    frame: &Frame,
    clock: &dyn Fn() -> f64,
    build: impl FnOnce() -> D,
) -> [f64; 2] {
    let (maps, built) = timed(clock, build);
    let (gather, _) = timed(clock, || gather::<_, R>(plan, frame, &built, u32::MAX));
    [maps, gather]
}

/// What `work` takes by `clock`, and what it makes.
fn timed<T>(clock: &dyn Fn() -> f64, work: impl FnOnce() -> T) -> (f64, T) {
    let begin = clock();
    let made = work();
    (clock() - begin, made)
}

/// Seconds of all threads together.
fn processor() -> f64 {
    ProcessTime::now().as_duration().as_secs_f64()
}
