//! Scene + Settings → a smaller scene, what to do in a pass, and what was left out and why that is exact.
//!
//! Everything that can be decided once is decided here; kernels below have no mode flags, only smaller data.

mod components;
mod describe;
mod flow;
mod lines;
mod omission;
mod photons;
mod settings;
mod shrink;
#[cfg(test)]
mod tests;

pub use describe::Technique;
pub use lines::Visibility;
pub(crate) use lines::summed_and_others;
pub use omission::{Omission, Omittable};
pub(crate) use photons::MAX_DEPOSITS;
pub use photons::{PerPath, PhotonClasses, PhotonPlan};
pub use settings::{Direct, LEVELS, Method, Settings};

use crate::measure::Existence;
use crate::rays::Rays;
use crate::rims::Rims;
use crate::scene::{Luminaire, Scene};
use crate::stop::Stop;
use flow::Flow;
use lines::Through;
use photons::crowd;

/// What will be done, and what not.
pub struct Plan {
    /// The scene that is rendered: what was given, less what nothing uses.
    pub scene: Scene,
    /// Its triangles, indexed.
    pub rays: Rays,
    /// Where the surfaces end that take photons.
    pub rims: Rims,
    /// What was asked for.
    pub settings: Settings,
    /// None: no photons and no map.
    pub photons: Option<PhotonPlan>,
    /// How connections see.
    pub visibility: Visibility,
    /// Luminaires, by index, whose irradiance is known wherever nothing hides them.
    pub closed_form: Vec<u32>,
    /// Whether there is an image.
    pub existence: Existence,
    /// What was left out.
    pub omissions: Vec<Omission>,
    /// Why direct light is served by whom `settings` says: never [`Direct::Auto`] any more.
    pub direct_because: String,
    /// [`Scene::hash`] of the scene that was given.
    pub scene_hash: u64,
    /// Looked at within a pass.
    pub stop: Stop,
    /// The triangles that cast shadows, where they are not all.
    casters: Option<Rays>,
    through: Through,
}

impl Plan {
    /// Looks at the scene once and decides.
    ///
    /// Where [`Direct::Auto`] is asked for it takes connections, which a pilot may change; photons where connections would miss a
    /// luminaire.
    pub fn new(scene: Scene, settings: Settings) -> Self {
        Self::with_existence(scene, settings, None)
    }

    /// The same, where it is known already whether there is an image.
    pub fn with_existence(mut scene: Scene, mut settings: Settings, known: Option<Existence>) -> Self {
        let scene_hash = scene.hash();
        let (direct, direct_because) = match settings.direct {
            Direct::Auto if scene.luminaires.iter().any(Luminaire::is_needle) => {
                (Direct::Photons, "a spot lights less than a pixel, which connections hardly ever meet")
            }
            Direct::Auto => (Direct::Connection, "few luminaires"),
            asked => (asked, "asked for"),
        };
        settings.direct = direct;
        let mut omissions = Vec::new();
        if settings.method == Method::Photon {
            shrink::drop_unused(&mut scene, &settings, &mut omissions);
        }
        let rays = shrink::media(Rays::build(&scene), &scene, &settings, &mut omissions);
        let always = settings.keeps(Omittable::Existence);
        let existence = known.unwrap_or_else(|| Existence::of(&scene, &rays, settings.seed, always));
        if let Existence::Certain { reason, .. } = &existence
            && !always
        {
            omissions.push(Omittable::Existence.because(reason.clone()));
        }
        if settings.method != Method::Photon {
            // The opponent is left alone.
            return Self {
                scene,
                rays,
                rims: Rims::none(),
                settings,
                photons: None,
                visibility: Visibility::Transmittance,
                closed_form: Vec::new(),
                existence,
                omissions,
                direct_because: direct_because.into(),
                scene_hash,
                stop: Stop::default(),
                casters: None,
                through: Through::ALL,
            };
        }
        let flow = Flow::of(&scene, settings.invisible);
        let needs_photons = !PhotonClasses::of(&flow, &settings).is_empty();
        shrink::drop_unread(&mut scene, &flow, needs_photons, &settings, &mut omissions);
        let (rays, through) = lines::first_hits(&scene, rays, &flow, &settings, &mut omissions);
        let (visibility, casters) = lines::visibility(&scene, &flow, &settings, &mut omissions);
        let closed_form = lines::closed_form(&scene, &settings, visibility, &mut omissions);
        let photons = photons::photon_plan(&scene, &flow, &settings, &mut omissions)
            .map(|photons| PhotonPlan { growth: existence.growth(), crowd: crowd(&existence), ..photons });
        let endless = existence.is_refuted() && settings.max_reflections.is_none();
        let rims = photons.as_ref().map_or_else(Rims::none, |photons| Rims::of(&scene, &photons.deposits));
        let mut plan = Self {
            scene,
            rays,
            rims,
            settings,
            photons: None,
            visibility,
            closed_form,
            existence,
            omissions,
            direct_because: direct_because.into(),
            scene_hash,
            stop: Stop::default(),
            casters,
            through,
        };
        // Where there is no image a pilot would not end.
        plan.photons = photons.map(|photons| if endless { photons } else { plan.with_pilot(photons) });
        plan
    }

    /// The material of a triangle, as an index.
    pub fn material_index(&self, triangle: u32) -> usize {
        self.scene.surface_of(triangle).material as usize
    }

    /// True where vertex normals are interpolated.
    pub fn is_smooth(&self, triangle: u32) -> bool {
        self.scene.surface_of(triangle).smooth
    }
}
