//! A few paths that teach a [`Guide`] where on the luminaires caustics begin.

use super::Walk;
use crate::emission::{Emitters, Guide};
use crate::light::Light;
use crate::photon::PathClass;
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
        frame.photons.as_ref().filter(|photons| photons.classes.caustic && !plan.settings.even_starts)?;
    let most = photons.max_reflections.min(LESSON_REFLECTIONS);
    let photons = &PhotonPlan { max_reflections: most, ..photons.clone() };
    let emitters = Emitters::<Light>::new(&plan.scene)?;
    let seed = plan.settings.seed;
    let sobol = Sobol::new(hash(seed ^ hash(Stream::Measure as u64)));
    let led_to_caustics: Vec<Option<usize>> = (0..LESSONS)
        .into_par_iter()
        .map_init(
            || Walk::<Light>::new(plan, frame, photons, LESSONS),
            |walk, path| {
                let rng = Rng::new(seed, Stream::Shoot, u32::MAX, u64::from(path));
                let u = sobol.point(path, 0);
                // What one path leaves behind must not matter to the next.
                walk.forget();
                walk.follow(emitters.emit(LESSONS, u), rng);
                let caustic = &walk.photons.by_class[PathClass::Caustic as usize];
                (!caustic.is_empty()).then(|| Guide::cell(&emitters, u))
            },
        )
        .collect();
    let mut counts = vec![0.0; Guide::CELLS];
    led_to_caustics.into_iter().flatten().for_each(|cell| counts[cell] += 1.0);
    Guide::new(&counts)
}
