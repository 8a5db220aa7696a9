//! Which photons are shot, what of them is carried, and where they are kept.

use super::flow::Flow;
use super::omission::{Omission, Omittable};
use super::{Direct, Plan, Settings};
use crate::scene::Scene;
use crate::shoot::{Guide, PathClass};

/// Which classes of photons are deposited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PhotonClasses {
    /// Straight from the luminaire.
    pub direct: bool,
    /// Through delta lobes only.
    pub caustic: bool,
    /// Through at least one finite lobe.
    pub indirect: bool,
}

impl PhotonClasses {
    /// True when no class is of use.
    pub fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// The classes that arrive where they are read; `kept`: those that are asked for, needed or not, are among them.
    pub(super) fn of(flow: &Flow, settings: &Settings) -> Self {
        let reflected = settings.max_reflections.is_none_or(|most| most > 1);
        let kept = |what: Omittable| settings.keeps(what) || settings.keeps(Omittable::Photons);
        let needed = |class: PathClass, what: Omittable| reflected && (kept(what) || flow.arrives(class));
        let direct = settings.direct == Direct::Photons && settings.max_reflections != Some(0);
        Self {
            direct: direct && (settings.keeps(Omittable::Photons) || flow.arrives(PathClass::Direct)),
            caustic: needed(PathClass::Caustic, Omittable::CausticPhotons),
            indirect: needed(PathClass::Indirect, Omittable::IndirectPhotons),
        }
    }
}

/// How photons are shot.
#[derive(Clone, Debug)]
pub struct PhotonPlan {
    /// Paths emitted per pass.
    pub paths: u32,
    /// Classes that are deposited.
    pub classes: PhotonClasses,
    /// By material: whether what arrives there can be seen.
    pub deposits: Vec<bool>,
    /// The share of deposits that is kept (at 1 / keep times their power) to bound memory.
    pub keep: f32,
    /// Factor by which the unit of Russian roulette changes with each reflection: above 1 where generations would
    /// multiply, 1 as a rule, slightly below where they hardly fade.
    pub growth: f32,
    /// The series is cut after this many reflections before a deposit (one less than with the reflection that is seen).
    pub max_reflections: u32,
    /// The same for reflections that are in proportion to the scene's s; see [`Orders::n`](crate::shoot::Orders::n).
    pub most_orders: u8,
    /// True where a second column is read after emission: photons then carry both halves.
    pub both_halves: bool,
    /// Where paths start denser than their power asks for, because caustics begin there.
    pub guide: Option<Guide>,
}

/// Paths per pass where nothing else speaks: one for each pixel of the default film.
const DEFAULT_PATHS: u32 = 262_144;
/// Deposits of one pass that are kept at the most; about 60 bytes each while the map is built.
const MAX_DEPOSITS: f64 = 4.0e6;
/// Paths of the pilot that counts deposits per path: the most, fewer where paths are long, the fewest.
const PILOT_PATHS: [u32; 2] = [16, 8_192];
/// Reflections of the pilot, about.
const PILOT_REFLECTIONS: f64 = 1.0e5;

/// None: no photons at all.
pub(super) fn photon_plan(
    scene: &Scene,
    flow: &Flow,
    settings: &Settings,
    omissions: &mut Vec<Omission>,
) -> Option<PhotonPlan> {
    let classes = PhotonClasses::of(flow, settings);
    if classes.is_empty() {
        omissions.push(Omittable::Photons.because(match settings.max_reflections {
            Some(..=1) => "no light that was reflected before is asked for, so direct light is all there is",
            _ => {
                "nothing that light passes on its way reflects it into a half that is read later, so direct light is \
                 all there is"
            }
        }));
        return None;
    }
    if !classes.caustic {
        omissions.push(
            Omittable::CausticPhotons.because("no mirror or glass alone sends on light that is read later"),
        );
    }
    if !classes.indirect {
        omissions.push(
            Omittable::IndirectPhotons
                .because("nothing but mirrors and glass sends on light that is read later"),
        );
    }
    let both_halves =
        settings.keeps(Omittable::VisibleHalf) || flow.useful.and(flow.present_at_all()).visible();
    if !both_halves {
        omissions.push(Omittable::VisibleHalf.because(
            "no matrix reads the visible half of light that is on its way: every second column is zero",
        ));
    }
    Some(PhotonPlan {
        paths: settings.paths.unwrap_or(DEFAULT_PATHS),
        classes,
        deposits: deposits(scene, flow, settings, omissions),
        keep: 1.0,
        growth: 1.0,
        max_reflections: settings.max_reflections.map_or(u32::MAX, |most| most.saturating_sub(1)),
        most_orders: u8::MAX,
        both_halves,
        guide: None,
    })
}

/// By material: whether what arrives there can be seen by density estimation.
fn deposits(scene: &Scene, flow: &Flow, settings: &Settings, omissions: &mut Vec<Omission>) -> Vec<bool> {
    let (mut kept, mut dark) = (Vec::with_capacity(scene.materials.len()), Vec::new());
    for material in &scene.materials {
        let mut finite = material.bsdf.terms.iter().filter(|term| !term.lobe.is_delta());
        let read = finite.any(|term| settings.keeps(Omittable::Deposits) || flow.reads(term));
        if !read {
            dark.push(material.name.as_str());
        }
        kept.push(read);
    }
    if !dark.is_empty() && !settings.keeps(Omittable::Deposits) {
        omissions.push(
            Omittable::Deposits
                .because(format!("what arrives on {} cannot be seen by density estimation", dark.join(", "))),
        );
    }
    kept
}

impl Plan {
    /// Counts the deposits of a few paths, and from them sets the paths per pass and the share of deposits kept.
    pub(crate) fn with_pilot(&self, mut photons: PhotonPlan) -> PhotonPlan {
        photons.guide = Guide::learn(self, &photons);
        let wanted = self.settings.paths.unwrap_or(DEFAULT_PATHS);
        let [fewest, most] = PILOT_PATHS;
        let pilot = (PILOT_REFLECTIONS / self.existence.length()) as u32;
        photons.paths = wanted.min(pilot.clamp(fewest, most));
        let pilot = crate::shoot::shoot::<crate::light::Light>(self, &photons, u32::MAX);
        let deposits: usize = pilot.by_class.iter().map(Vec::len).sum();
        let per_path = deposits as f64 / f64::from(photons.paths.max(1));
        let affordable = MAX_DEPOSITS / per_path.max(1e-9);
        photons.paths = wanted;
        if f64::from(wanted) > affordable {
            match self.settings.paths {
                // The user's number of paths stands; some of their deposits are thinned.
                Some(_) => photons.keep = (affordable / f64::from(wanted)) as f32,
                None => photons.paths = (affordable as u32).max(1),
            }
        }
        photons
    }
}
