//! Which photons are shot, what of their light is carried, and where they are kept.

use super::flow::Flow;
use super::glints::Glints;
use super::omission::{Omission, Omittable};
use super::{Direct, Settings};
use crate::emission::{Guide, StartTree};
use crate::existence::Existence;
use crate::photon::PathClass;
use crate::scene::Scene;
use std::sync::Arc;

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

    /// True when photons of this class are of use.
    pub fn contains(self, class: PathClass) -> bool {
        match class {
            PathClass::Direct => self.direct,
            PathClass::Caustic => self.caustic,
            PathClass::Indirect => self.indirect,
        }
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
    /// Caustic photons that keep their directions. None: there are none.
    pub glints: Option<Arc<Glints>>,
    /// The share of deposits that is kept (at 1 / keep times their power) to bound memory.
    pub keep: f32,
    /// Factor by which the unit of Russian roulette changes with each reflection: above 1 where generations would
    /// multiply, 1 as a rule, slightly below where they hardly fade.
    pub growth: f32,
    /// The series is cut after this many reflections before a deposit (one less than with the reflection that is seen).
    pub max_reflections: u32,
    /// The same for reflections that are in proportion to the scene's s; see [`Orders::n`](crate::photon::Orders::n).
    pub most_orders: u8,
    /// True where a second column is read after emission: photons then carry both halves.
    pub both_halves: bool,
    /// Where paths start denser than their power asks for, because caustics begin there.
    pub guide: Option<Guide>,
    /// Where they start denser instead, where few of all are of use to the picture.
    pub starts: Option<Arc<StartTree>>,
    /// Lines of one path after which fewer and fewer are born: no path goes on for ever.
    pub crowd: u32,
    /// What a path comes to in the mean, as far as a pilot can tell.
    pub per_path: PerPath,
}

/// What a path comes to in the mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PerPath {
    /// Straight lines followed.
    pub lines: f64,
    /// Photons deposited, all of them.
    pub deposits: f64,
}

impl PhotonPlan {
    /// The same with another number of paths.
    pub(crate) fn with_paths(self, paths: u32) -> Self {
        let deposits = f64::from(paths) * self.per_path.deposits;
        Self { paths, keep: (MAX_DEPOSITS / deposits).min(1.0) as f32, ..self }
    }

    /// By material: whether any photon is kept there.
    pub fn kept(&self) -> Vec<bool> {
        match &self.glints {
            None => self.deposits.clone(),
            Some(glints) => {
                let either = |(i, deposits): (usize, &bool)| *deposits || glints.are_read_by(i as u32);
                self.deposits.iter().enumerate().map(either).collect()
            }
        }
    }

    /// Photons that a pass will store.
    pub fn stored(&self) -> f64 {
        f64::from(self.paths) * self.per_path.deposits * f64::from(self.keep)
    }
}

/// Paths per pass where nothing else speaks: one for each pixel of the default film.
pub(crate) const DEFAULT_PATHS: u32 = 262_144;
/// Deposits of one pass that are kept at the most; about 60 bytes each while the map is built.
pub(crate) const MAX_DEPOSITS: f64 = 4.0e6;
/// Lines of one path that a series of ordinary length never comes near to.
const CROWD: f64 = 65_536.0;
/// And of a long one, in units of its length: paths fade for six of them before chance ends them, as exp(−lengths).
const CROWD_LENGTHS: f64 = 64.0;

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
        glints: classes.caustic.then(|| Glints::of(scene, flow)).flatten().map(Arc::new),
        keep: 1.0,
        growth: 1.0,
        max_reflections: settings.max_reflections.map_or(u32::MAX, |most| most.saturating_sub(1)),
        most_orders: u8::MAX,
        both_halves,
        guide: None,
        starts: None,
        crowd: u32::MAX,
        per_path: PerPath::default(),
    })
}

/// By material: whether what arrives there can be seen by density estimation.
fn deposits(scene: &Scene, flow: &Flow, settings: &Settings, omissions: &mut Vec<Omission>) -> Vec<bool> {
    let (mut kept, mut dark) = (Vec::with_capacity(scene.materials.len()), Vec::new());
    for material in &scene.materials {
        let mut finite = material.bsdf.terms.iter().filter(|term| term.lobe.as_diffuse().is_some());
        let read = finite.any(|term| settings.keeps(Omittable::Deposits) || flow.reads(term));
        if !read {
            dark.push(material.name.as_str());
        }
        kept.push(read);
    }
    if !dark.is_empty() && !settings.keeps(Omittable::Deposits) {
        let dark = crate::scene::names::listed(dark);
        omissions.push(
            Omittable::Deposits
                .because(format!("what arrives on {dark} cannot be seen by density estimation")),
        );
    }
    kept
}

/// Lines of one path after which it is thinned.
pub(super) fn crowd(existence: &Existence) -> u32 {
    (CROWD_LENGTHS * existence.length()).max(CROWD) as u32
}
