//! A few paths that teach a [`Guide`] where on the luminaires caustics begin.

use super::Walk;
use crate::emission::{EMISSION_DIMENSIONS, Emitted, Emitters, Guide};
use crate::light::Light;
use crate::photon::{PathClass, Photon, Photons};
use crate::plan::{Frame, PhotonPlan, Plan};
use crate::sampling::{Rng, Sobol, Stream, hash};
use rayon::prelude::*;

/// Paths to learn from: four a cell.
const LESSONS: u32 = 4 * Guide::CELLS as u32;
/// Reflections that a lesson follows: caustics begin with few, and in bright rooms paths may be thousands long.
const LESSON_REFLECTIONS: u32 = 8;

/// Learns which starts end in caustics that are deposited. None: no path does, and there is nothing to guide.
pub fn learn_guide(plan: &Plan, frame: &Frame) -> Option<Guide> {
    let photons =
        frame.photons.as_ref().filter(|photons| photons.classes.caustic && plan.settings.learns())?;
    let emitters = Emitters::<Light>::new(&plan.scene)?;
    let start = |u| (emitters.emit(LESSONS, u), Guide::cell(&emitters, u));
    let led_to_caustics =
        caustics(plan, frame, photons, LESSONS, start, |cell, left| (!left.is_empty()).then_some(cell));
    let mut counts = vec![0.0; Guide::CELLS];
    led_to_caustics.into_iter().for_each(|cell| counts[cell] += 1.0);
    Guide::new(&counts)
}

/// What `told` makes of each of `paths` paths, in their order: of what `start` made of the numbers of its start, beside the start
/// itself, and of the caustic photons that it left behind.
pub(super) fn caustics<S, T: Send>(
    plan: &Plan,
    frame: &Frame,
    photons: &PhotonPlan,
    paths: u32,
    start: impl Fn([f32; EMISSION_DIMENSIONS]) -> (Emitted<Light>, S) + Sync,
    told: impl Fn(S, &[Photon<Light>]) -> Option<T> + Sync,
) -> Vec<T> {
    let most = photons.max_reflections.min(LESSON_REFLECTIONS);
    let photons = &PhotonPlan { max_reflections: most, ..photons.clone() };
    let seed = plan.settings.seed;
    let sobol = Sobol::new(hash(seed ^ hash(Stream::Measure as u64)));
    let one = |walk: &mut Walk<'_, Light>, path: u32| {
        let rng = Rng::new(seed, Stream::Shoot, u32::MAX, u64::from(path));
        let (emitted, started) = start(sobol.point(path, 0));
        // What one path leaves behind must not matter to the next.
        walk.forget();
        walk.follow(emitted, rng);
        let Photons { by_class, glints, .. } = &walk.photons;
        match &by_class[PathClass::Caustic as usize][..] {
            [] if !glints.is_empty() => {
                let photons: Vec<_> = glints.iter().map(Photon::without_direction).collect();
                told(started, &photons)
            }
            photons => told(started, photons),
        }
    };
    let each = (0..paths).into_par_iter().map_init(|| Walk::new(plan, frame, photons, paths), one);
    each.collect::<Vec<_>>().into_iter().flatten().collect()
}
