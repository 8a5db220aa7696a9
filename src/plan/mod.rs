//! Scene + Settings → a smaller scene, what a pass has to do, and what was left out and why that is exact.
//!
//! Everything that can be decided once is decided here. Kernels have no mode flags, only smaller data. A [`Plan`] is not
//! changed once it is made; what pilots learn, and what may vary from pass to pass, is a [`Frame`].

mod components;
mod describe;
mod flow;
mod frame;
mod glints;
mod lines;
mod omission;
mod photons;
mod settings;
mod shrink;
#[cfg(test)]
mod tests;

pub use crate::existence::{Existence, Multiplication};
pub use crate::machine::{MemoryLimit, memory as memory_left};
pub use describe::Technique;
pub use frame::Frame;
pub use glints::{Glints, reads as reads_glints};
pub use lines::Visibility;
pub use omission::{Omission, Omittable};
pub(crate) use photons::{DEFAULT_PATHS, MAX_DEPOSITS};
pub use photons::{PerPath, PhotonClasses, PhotonPlan};
pub use settings::{Direct, LEVELS, Method, NEAREST, Settings, film_size};

use crate::clearance::Clearance;
use crate::connect::{Connections, Lobes};
use crate::rays::{Hit, Rays};
use crate::rims::Rims;
use crate::scene::{Luminaire, MatterAt, Scene};
use flow::Flow;
use lines::Through;
use photons::crowd;

/// What will be done, and what not: a function of scene and settings alone. How a pass of it is rendered is a [`Frame`].
pub struct Plan {
    /// The scene that is rendered: what was given, less what nothing uses.
    pub scene: Scene,
    /// Its triangles, indexed.
    pub rays: Rays,
    /// Where the surfaces end that take photons.
    pub rims: Rims,
    /// How wide gather disks may be.
    pub clearance: Clearance,
    /// What was asked for.
    pub settings: Settings,
    /// Which photons are of use, before any is shot. None: no photons and no map.
    pub photons: Option<PhotonPlan>,
    /// How connections see.
    pub visibility: Visibility,
    /// The luminaires as camera hits see them.
    pub connections: Connections,
    /// Whether there is an image.
    pub existence: Existence,
    /// What was left out.
    pub omissions: Vec<Omission>,
    /// Who serves direct light, as far as logic tells: never [`Direct::Auto`].
    pub direct: Direct,
    /// Why.
    pub direct_because: &'static str,
    /// [`Scene::hash`] of the scene that was given.
    pub scene_hash: u64,
    /// The triangles that cast shadows, where they are not all.
    casters: Option<Rays>,
    through: Through,
}

impl Plan {
    /// Looks at the scene once and decides.
    ///
    /// Where [`Direct::Auto`] is asked for it takes connections, of which a pilot may think otherwise; photons where connections
    /// would miss a luminaire.
    pub fn new(scene: Scene, settings: Settings) -> Self {
        Self::with_existence(scene, settings, None)
    }

    /// The same, where it is known already whether there is an image.
    pub fn with_existence(mut scene: Scene, asked: Settings, known: Option<Existence>) -> Self {
        let scene_hash = scene.hash();
        let (direct, direct_because) = who_serves_direct(&scene, &asked);
        let settings = Settings { direct, ..asked.clone() };
        let mut omissions = Vec::new();
        if settings.method.shoots() {
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
        // The opponent is left alone.
        let whole = Self {
            scene,
            rays,
            rims: Rims::none(),
            clearance: Clearance::none(),
            settings: asked,
            photons: None,
            visibility: Visibility::Transmittance,
            connections: Connections::none(),
            existence,
            omissions,
            direct,
            direct_because,
            scene_hash,
            casters: None,
            through: Through::ALL,
        };
        if settings.method.shoots() { whole.less(&settings) } else { whole }
    }

    /// Without what photons and a gather do not need.
    fn less(self, settings: &Settings) -> Self {
        let Self { mut scene, rays, existence, mut omissions, .. } = self;
        let flow = Flow::of(&scene, settings.invisible, Glints::may_be(&scene, settings));
        let classes = PhotonClasses::of(&flow, settings);
        // Camera paths go on by diffuse lobes where light that was scattered cannot be read from photons.
        let flow = if classes.indirect { flow.followed(&scene) } else { flow };
        let needs_photons = !classes.is_empty();
        shrink::drop_unread(&mut scene, &flow, needs_photons, settings, &mut omissions);
        let (rays, through) = lines::first_hits(&scene, rays, &flow, settings, &mut omissions);
        let (visibility, casters) = lines::visibility(&scene, &flow, settings, &mut omissions);
        let closed_form = lines::closed_form(&scene, settings, visibility, &mut omissions);
        let photons = photons::photon_plan(&scene, &flow, settings, &mut omissions)
            .map(|photons| PhotonPlan { growth: existence.growth(), crowd: crowd(&existence), ..photons });
        // Of disks, which the textbook does not have.
        let on_disks = photons.as_ref().filter(|_| settings.method == Method::Photon);
        let mut rims = on_disks.map_or_else(Rims::none, |photons| Rims::of(&scene, &photons.kept()));
        let clearance = match on_disks {
            Some(_) => Clearance::of(&scene, rims.take_sheets()),
            None => Clearance::none(),
        };
        let terms = || scene.materials.iter().flat_map(|material| &material.bsdf.terms);
        let all_lambert = terms().all(|term| term.lobe.is_delta() || term.lobe.is_lambert());
        let lobes = if all_lambert { Lobes::Lambert } else { Lobes::Any };
        let connections = Connections::new(&scene, &closed_form, visibility == Visibility::Everywhere, lobes);
        Self {
            scene,
            rays,
            rims,
            clearance,
            photons,
            visibility,
            connections,
            existence,
            omissions,
            casters,
            through,
            ..self
        }
    }

    /// True where a series without end is asked for that has no sum: a pass would mean nothing.
    pub fn is_endless(&self) -> bool {
        self.existence.is_refuted() && self.settings.max_reflections.is_none()
    }

    /// What a line meets, as it is on average over `footprint`: the side (m) of what looks, on a surface that faces it; 0: a point.
    pub fn matter_at(&self, hit: &Hit, footprint: f32) -> MatterAt<'_> {
        self.scene.matter_at(hit.triangle, hit.u, hit.v, footprint)
    }
}

/// Who serves direct light and why, as far as logic tells.
fn who_serves_direct(scene: &Scene, settings: &Settings) -> (Direct, &'static str) {
    match settings.direct {
        Direct::Auto if scene.luminaires.iter().any(Luminaire::is_needle) => {
            (Direct::Photons, "a spot lights less than a pixel, which connections hardly ever meet")
        }
        Direct::Auto => (Direct::Connection, "few luminaires"),
        asked => (asked, "asked for"),
    }
}
