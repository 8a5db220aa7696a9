//! How an atlas is rendered: what is refused, how far powers are counted, and its passes.

use super::Atlas;
use super::frontier::Frontier;
use super::places::MostOrders;
use super::sums::AtlasSums;
use crate::error::{Error, Result};
use crate::film::{AnnexFile, Layer};
use crate::gather::{Gathered, Maps};
use crate::light::{Invisible, Matrix};
use crate::memory::Memory;
use crate::pilot::{counted, learn_photons};
use crate::plan::{Frame, Method, Omittable, PhotonPlan, Plan, Settings};
use crate::scene::{Material, Scene};
use crate::shoot::shoot;
use glam::Vec3;
use std::ops::Range;

/// An atlas being rendered. Its plan's scene stands at (1, 1).
pub struct AtlasRun {
    sums: AtlasSums,
    memory: Memory,
}

/// Below this a series is followed to its end; else it is cut.
const CERTAIN_TO_END: f64 = 0.97;
/// Light of the last stored n is this share of all, or less, where the series is followed to its end.
const LEAST_KEPT: f64 = 2e-3;
/// Photons of a cut series: their number falls by this from one reflection to the next while their power rises.
const FADING: f32 = 0.97;
/// Stored powers of t reach so far that this share of the photons' power has crossed more often.
const CROSSED_MORE: f64 = 5e-4;
/// Where no number is large enough.
const MOST_POWER: u8 = 92;
/// Crossings are counted no farther.
const MOST_CROSSINGS: u8 = 42;
/// So many passes are rendered together, or fewer: each has photon maps of its own.
const MOST_TOGETHER: u32 = 4;
/// The first passes of which two, and [`MOST_TOGETHER`], are rendered together.
const BY_TWO: u32 = 8;
const BY_MOST: u32 = 16;
/// Paths that are shot to see how often light crosses surfaces.
const PILOT_PATHS: u32 = 8_192;

/// Refuses scenes and settings that have no atlas.
///
/// # Errors
/// One line that names the thing and the way out.
pub fn check(scene: &Scene, settings: &Settings) -> Result<()> {
    let usage = |reason: String| Err(Error::Usage(format!("--atlas: {reason}")));
    if settings.method != Method::Photon {
        return usage(format!("--method {} makes no atlas; leave it at photon", settings.method.name()));
    }
    if settings.keep_everything {
        return usage("keeps the invisible half alone; leave --keep-everything out".into());
    }
    if settings.invisible {
        return usage("the invisible layer has no atlas; leave it out of --layers".into());
    }
    if scene.point().is_none() {
        return usage(format!(
            "no material of {} follows the scene's point of the square; give --illumination S,T and fewer --set",
            scene.name
        ));
    }
    for material in &scene.materials {
        if material.covered < 1.0 || material.has_holes() {
            return usage(format!(
                "`{}` is there in part (alpha), and light that passes beside it has no single power of t; make it opaque, or \
                 render single points of the square",
                material.name
            ));
        }
        let lobes = material.bsdf.terms.iter().filter(|_| material.follows.s.is_none());
        let delta = lobes.clone().filter(|term| term.lobe.is_delta()).map(|term| term.coefficient);
        let straight = material.follows.t.is_none().then_some(material.bsdf.straight);
        let mixes = |matrix: Matrix| matrix.rows().iter().any(|[a, b]| *a != 0.0 && *b != 0.0);
        let keeps = |matrix: Matrix| matrix.vis_vis != 0.0 || matrix.inv_vis != 0.0;
        if delta.clone().chain(straight).any(mixes)
            || lobes.filter(|term| !term.lobe.is_delta()).any(|term| keeps(term.coefficient))
            || straight.is_some_and(keeps)
            || delta.clone().any(|matrix| matrix.inv_vis != 0.0)
        {
            return usage(format!(
                "`{}` ({}) reads visible light on its way or mixes the halves, so its light has no single power of s; \
                 give it a point of the square, or whitted if it is a mirror or glass",
                material.name, material.resolved
            ));
        }
    }
    Ok(())
}

impl AtlasRun {
    /// For `plan`, made for a scene at (1, 1): measures where images exist, and decides how far to count and how passes are
    /// rendered. The film is read at the point `at`.
    ///
    /// # Errors
    /// No image at `at`, or matter that does not follow s and multiplies light without end; too little memory.
    pub fn new(plan: &Plan, at: (f32, f32), layers: &[Layer]) -> Result<(Self, Frame)> {
        let Prepared { frame, most, frontier, stored } = prepare(plan, at)?;
        let memory = memory(plan, &frame, (most, stored), layers);
        memory.check(plan.settings.memory)?;
        let sums = AtlasSums::new((frame.width, frame.height), most, at, frontier);
        Ok((Self { sums, memory }, frame))
    }

    /// What it will hold in memory, the render around it included.
    pub fn memory(&self) -> Memory {
        self.memory
    }

    /// How many passes are best rendered next, together: it costs less to sort their sum into the atlas than each of them, but
    /// they are one sample of the error bar. So the first come one by one, and none are more than a quarter of those before. Groups
    /// end at the same passes in every render, so that one that was stopped between two of them goes on as if it had not been.
    pub fn together(&self) -> u32 {
        left_of_group(self.sums.passes())
    }

    /// Renders passes: what each looks like at the film's point, and how many photons it stored. Nothing where the frame is told
    /// to [stop](Frame::stop) before the first of them is added.
    pub fn passes(&mut self, plan: &Plan, frame: &Frame, passes: Range<u32>) -> Vec<(Gathered<1>, u64)> {
        let shot = passes.clone().map(|pass| {
            let photons = shoot::<Invisible>(plan, frame, pass);
            let stored = photons.count() as u64;
            (Maps::build(photons, plan, frame, pass), stored)
        });
        let (maps, stored): (Vec<_>, Vec<u64>) = shot.unzip();
        if frame.stop.asked() {
            return Vec::new();
        }
        self.sums.add_passes(plan, frame, maps, passes.start).into_iter().zip(stored).collect()
    }

    /// How far it counts and what it takes, in one line.
    pub fn describe(&self) -> String {
        self.sums.describe()
    }

    /// The sums so far.
    pub fn sums(&self) -> &AtlasSums {
        &self.sums
    }

    /// Goes on from a state whose film was read: before the first pass.
    ///
    /// # Errors
    /// One line: it is damaged, or of another atlas.
    pub fn resume(&mut self, file: AnnexFile) -> Result<()> {
        self.sums.go_on(file)
    }

    /// The atlas so far.
    pub fn atlas(&self) -> Atlas {
        self.sums.atlas()
    }
}

/// Passes after `done` that are of one group.
fn left_of_group(done: u32) -> u32 {
    let group = match done {
        0..BY_TWO => 1,
        BY_TWO..BY_MOST => 2,
        _ => MOST_TOGETHER,
    };
    group - done % group
}

/// What is known before the first pass.
struct Prepared {
    /// How passes are rendered.
    frame: Frame,
    /// How far is counted.
    most: MostOrders,
    /// Where images exist.
    frontier: Frontier,
    /// Photons that a pass stores.
    stored: f64,
}

fn prepare(plan: &Plan, at: (f32, f32)) -> Result<Prepared> {
    let settings = &plan.settings;
    let truncated = settings.max_reflections.map(|most| u8::try_from(most).unwrap_or(u8::MAX));
    let frontier = match truncated {
        Some(_) => Frontier::none(),
        None => Frontier::measure(&plan.scene, &plan.existence, settings.seed),
    };
    let kappa = frontier.kappa(1.0);
    if kappa.is_infinite() {
        let reason = plan
            .existence
            .refusal(&plan.scene)
            .unwrap_or_else(|| "no image exists: light that does not follow s multiplies without end".into());
        return Err(Error::NoImage { reason, k: plan.existence.factor() });
    }
    let (s, t) = (f64::from(at.0), f64::from(at.1));
    if let Some(reason) = frontier.refusal(s, t) {
        return Err(Error::NoImage { reason, k: s * frontier.kappa(t) });
    }
    let cut = truncated.is_none() && kappa >= CERTAIN_TO_END;
    let n = match truncated {
        Some(most) => most,
        None if cut => MOST_POWER,
        None => orders_kept(kappa, most_turned(&plan.scene)),
    };
    let n = super::Nodes::up_to(n).last();
    let mut frame = learn_photons(plan);
    if cut {
        let growth = (plan.existence.growth() / FADING).max(1.0);
        let photons = frame.photons.map(|photons| PhotonPlan { most_orders: n, growth, ..photons });
        frame = counted(plan, Frame { photons, ..frame });
    }
    let (m, stored) = most_crossings(plan, &frame);
    Ok(Prepared { frame, most: MostOrders { n, m, cut }, frontier, stored })
}

/// Reflections after which less than [`LEAST_KEPT`] of light is left that multiplies by `kappa` with each. Of these two may besides turn
/// the share `turned` of one colour into another, as red, green and blue have no longer way; where it is a circle, `kappa` knows it.
fn orders_kept(kappa: f64, turned: f64) -> u8 {
    let kappa = kappa.max(1e-9);
    let once = turned / kappa;
    let left = |n: u8| {
        let n = f64::from(n);
        kappa.powf(n) * (1.0 + n * once + 0.5 * n * (n - 1.0) * once * once)
    };
    (1..MOST_POWER).find(|&n| left(n) <= LEAST_KEPT).unwrap_or(MOST_POWER)
}

/// The most that re-radiation makes of light of one colour as others, all materials looked at.
fn most_turned(scene: &Scene) -> f64 {
    let of = |material: &Material| {
        let turned = material.bsdf.terms.iter().filter(|term| term.turn.colours() > 0);
        let sent = turned.map(|term| {
            let [[ii, iv], [vi, vv]] = term.coefficient.rows();
            ii.max(iv).max(vi).max(vv) * term.lobe.bound()
        });
        f64::from(sent.sum::<Vec3>().max_element())
    };
    scene.materials.iter().map(of).fold(0.0, f64::max)
}

/// What making an atlas will hold in memory.
fn memory(plan: &Plan, frame: &Frame, (most, stored): (MostOrders, f64), layers: &[Layer]) -> Memory {
    let size = (frame.width, frame.height);
    Memory::of_stored(plan, frame, layers, stored).with_atlas(
        AtlasSums::bytes(size, most),
        MOST_TOGETHER,
        size,
    )
}

/// The plan of an atlas of `scene`, which need not stand at (1, 1), and the point at which it stands.
///
/// # Errors
/// What [`check`] refuses.
pub fn plan(scene: &Scene, settings: Settings) -> Result<(Plan, (f32, f32))> {
    check(scene, &settings)?;
    let at = scene.point().expect("some material follows the square");
    // Crossings are counted along every connection, also of matter that does nothing at (1, 1).
    let counted = [Omittable::Matter, Omittable::Visibility, Omittable::Casters];
    let keep = settings.keep.iter().copied().chain(counted).collect();
    Ok((Plan::new(scene.at(1.0, 1.0), Settings { keep, ..settings }), at))
}

/// What making an atlas of `scene` will hold in memory.
///
/// # Errors
/// As for [`AtlasRun::new`], but for want of memory.
pub fn forecast(scene: &Scene, settings: Settings, layers: &[Layer]) -> Result<Memory> {
    let (plan, at) = plan(scene, settings)?;
    let Prepared { frame, most, stored, .. } = prepare(&plan, at)?;
    Ok(memory(&plan, &frame, (most, stored), layers))
}

/// How often light crosses surfaces, all but a small share of it; and how many photons a pass stores. They are counted as passes shoot them,
/// with the invisible half alone: roulette lets light of both halves live longer, nearly twice as long where both are as bright.
fn most_crossings(plan: &Plan, frame: &Frame) -> (u8, f64) {
    let Some(photons) = &frame.photons else { return (2 * MOST_CROSSINGS / 3, 0.0) };
    let (paths, keep) = (f64::from(photons.paths), f64::from(photons.keep));
    let pilot = PhotonPlan { paths: photons.paths.min(PILOT_PATHS), keep: 1.0, ..photons.clone() };
    let each = paths * keep / f64::from(pilot.paths);
    let photons = shoot::<Invisible>(plan, &Frame { photons: Some(pilot), ..frame.clone() }, u32::MAX - 1);
    let stored = photons.count() as f64 * each;
    let mut power = [0.0; 256];
    for photon in photons.by_class.iter().flatten() {
        power[usize::from(photon.orders.m)] += f64::from(photon.power.0.element_sum());
    }
    let all: f64 = power.iter().sum();
    let mut beyond = all;
    let most = power.iter().position(|here| {
        beyond -= here;
        beyond <= CROSSED_MORE * all
    });
    (most.map_or(MOST_CROSSINGS, |m| (m as u8).clamp(1, MOST_CROSSINGS)), stored)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_end_at_the_same_passes_wherever_a_render_goes_on() {
        let ends: Vec<u32> = std::iter::successors(Some(0), |done| Some(done + left_of_group(*done)))
            .take_while(|done| *done < 30)
            .collect();
        assert_eq!(ends, [0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28]);
        for done in 0..100 {
            let (next, end) =
                (done + left_of_group(done), |done: u32| ends.contains(&done) || done.is_multiple_of(4));
            assert!(end(next) && (done + 1..next).all(|between| !end(between)), "{done}");
            assert!(left_of_group(done) <= (done / 4).max(1), "{done}");
        }
    }
}
