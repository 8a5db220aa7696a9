//! Scene + Settings → a smaller scene, what to do in a pass, and what was left out and why that is exact.
//!
//! Everything that can be decided once is decided here; kernels below have no mode flags, only smaller data.

use crate::light::Matrix;
use crate::measure::Existence;
use crate::optics::Term;
use crate::rays::Rays;
use crate::rims::Rims;
use crate::scene::Scene;

/// What the user asked for, resolved.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Film width in pixels.
    pub width: u32,
    /// Film height in pixels.
    pub height: u32,
    /// Photon paths emitted per pass; None: the plan chooses.
    pub paths: Option<u32>,
    /// Everything random follows from it.
    pub seed: u64,
    /// Who transports light.
    pub method: Method,
    /// Camera samples per pixel and pass of the path tracers; photons take one.
    pub samples: u32,
    /// Who serves direct light when photons transport the rest.
    pub direct: Direct,
    /// Also render the invisible half of every pixel.
    pub invisible: bool,
    /// Truncates the series: no light that was reflected more often than this, the reflection towards the camera and
    /// delta lobes included. None: the whole series.
    pub max_reflections: Option<u32>,
    /// First gather radius of caustics in pixel footprints.
    pub caustic_radius: f32,
    /// First gather radius of inter-reflection (and of `--direct photons`) in pixel footprints.
    pub indirect_radius: f32,
    /// Leave nothing out.
    pub keep_everything: bool,
}

/// Who transports light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Photons, photon maps and a final gather.
    Photon,
    /// The gathering path tracer with next-event estimation.
    Path,
    /// The gathering path tracer that finds luminaires by chance, as the paper's.
    PathPlain,
}

impl Method {
    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Photon => "photon",
            Self::Path => "path",
            Self::PathPlain => "path-plain",
        }
    }
}

/// Who serves light that comes straight from a luminaire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direct {
    /// Connections from camera hits to points on luminaires.
    Connection,
    /// Photons, like all other light: the paper's plan at its purest.
    Photons,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 512,
            height: 512,
            paths: None,
            seed: 0,
            method: Method::Photon,
            samples: 1,
            direct: Direct::Connection,
            invisible: false,
            max_reflections: None,
            caustic_radius: 3.5,
            indirect_radius: 7.0,
            keep_everything: false,
        }
    }
}

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
    /// True where a second column is read after emission: photons then carry both halves.
    pub both_halves: bool,
}

/// Whether the visibility of direct light must be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// Every surface lets through all that is read: nothing to ask.
    Everywhere,
    /// The product of the straight matrices along the connection.
    Transmittance,
}

/// One thing left out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Omission {
    /// Short name.
    pub name: &'static str,
    /// Why the picture is exactly the same without it.
    pub reason: String,
}

/// What will be done, and what not.
pub struct Plan {
    /// The scene that is rendered.
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
    /// Whether there is an image.
    pub existence: Existence,
    /// What was left out.
    pub omissions: Vec<Omission>,
}

/// A set of halves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Halves {
    invisible: bool,
    visible: bool,
}

impl Halves {
    const NONE: Self = Self { invisible: false, visible: false };

    fn or(self, other: Self) -> Self {
        Self { invisible: self.invisible || other.invisible, visible: self.visible || other.visible }
    }

    fn and(self, other: Self) -> Self {
        Self { invisible: self.invisible && other.invisible, visible: self.visible && other.visible }
    }

    fn any(self) -> bool {
        self != Self::NONE
    }

    /// The incoming halves that `matrix` turns into one of these outgoing halves.
    fn before(self, matrix: Matrix) -> Self {
        let [[ii, iv], [vi, vv]] = matrix.rows().map(|row| row.map(|entry| entry != 0.0));
        Self {
            invisible: (self.invisible && ii) || (self.visible && vi),
            visible: (self.invisible && iv) || (self.visible && vv),
        }
    }

    /// The outgoing halves that `matrix` makes of these incoming ones.
    fn after(self, matrix: Matrix) -> Self {
        let [[ii, iv], [vi, vv]] = matrix.rows().map(|row| row.map(|entry| entry != 0.0));
        Self {
            invisible: (ii && self.invisible) || (iv && self.visible),
            visible: (vi && self.invisible) || (vv && self.visible),
        }
    }
}

/// What the coefficient matrices alone say about which half can come from where, iterated to a fixed point.
struct Flow {
    /// Halves of light leaving surfaces that camera rays read.
    seen: Halves,
    /// Halves that finite lobes read in arriving light, where camera rays end.
    gathered: Halves,
    /// Halves of light on the way that may still be gathered.
    useful: Halves,
    /// Halves in which light is on the way at all.
    present: Halves,
}

impl Flow {
    fn of(scene: &Scene, invisible_layer: bool) -> Self {
        let bsdfs = || scene.materials.iter().map(|material| &material.bsdf);
        let terms = || bsdfs().flat_map(|bsdf| &bsdf.terms);
        let straights = || bsdfs().map(|bsdf| bsdf.straight);
        let delta = || terms().filter(|term| term.lobe.is_delta());
        let finite = || terms().filter(|term| !term.lobe.is_delta());

        let seen = fixed_point(Halves { invisible: invisible_layer, visible: true }, |seen| {
            let through_delta = delta().fold(seen, |halves, term| halves.or(seen.before(term.coefficient)));
            straights().fold(through_delta, |halves, straight| halves.or(seen.before(straight)))
        });
        let gathered = finite().fold(Halves::NONE, |halves, term| halves.or(seen.before(term.coefficient)));
        let useful = fixed_point(gathered, |useful| {
            let through_terms =
                terms().fold(useful, |halves, term| halves.or(useful.before(term.coefficient)));
            straights().fold(through_terms, |halves, straight| halves.or(useful.before(straight)))
        });
        let emitted = scene.luminaires.iter().fold(Halves::NONE, |halves, luminaire| {
            let power = luminaire.power(1.0);
            halves.or(Halves {
                invisible: power.invisible.max_element() > 0.0,
                visible: power.visible.max_element() > 0.0,
            })
        });
        let present = fixed_point(emitted, |present| {
            let after_terms =
                terms().fold(present, |halves, term| halves.or(present.after(term.coefficient)));
            straights().fold(after_terms, |halves, straight| halves.or(present.after(straight)))
        });
        Self { seen, gathered, useful, present }
    }

    /// True when `term` turns light that is there into light that is of use on the way.
    fn feeds(&self, term: &Term) -> bool {
        self.present.after(term.coefficient).and(self.useful).any()
            && self.useful.before(term.coefficient).and(self.present).any()
    }
}

fn fixed_point(mut halves: Halves, step: impl Fn(Halves) -> Halves) -> Halves {
    loop {
        let next = step(halves);
        if next == halves {
            return halves;
        }
        halves = next;
    }
}

/// Paths per pass where nothing else speaks: one for each pixel of the default film.
const DEFAULT_PATHS: u32 = 262_144;
/// Deposits of one pass that are kept at the most; about 60 bytes each while the map is built.
const MAX_DEPOSITS: f64 = 4.0e6;
/// Paths of the pilot that counts deposits per path.
const PILOT_PATHS: u32 = 8_192;

impl Plan {
    /// Looks at the scene once and decides.
    pub fn new(scene: Scene, settings: Settings) -> Self {
        let mut omissions = Vec::new();
        let rays = Rays::build(&scene);
        let existence = Existence::of(&scene, &rays, settings.seed, settings.keep_everything);
        if let Existence::Certain { reason, .. } = &existence {
            omissions.push(Omission { name: "existence", reason: reason.clone() });
        }
        if settings.method != Method::Photon {
            return Self {
                scene,
                rays,
                rims: Rims::none(),
                settings,
                photons: None,
                visibility: Visibility::Transmittance,
                existence,
                omissions,
            };
        }
        let flow = Flow::of(&scene, settings.invisible);
        let visibility = visibility(&scene, &flow, &settings, &mut omissions);
        let photons = photon_plan(&scene, &flow, &settings, &mut omissions)
            .map(|photons| PhotonPlan { growth: existence.growth(), ..photons });
        let endless = existence.is_refuted() && settings.max_reflections.is_none();
        let rims = photons.as_ref().map_or_else(Rims::none, |photons| Rims::of(&scene, &photons.deposits));
        let mut plan = Self { scene, rays, rims, settings, photons: None, visibility, existence, omissions };
        // Where there is no image a pilot would not end.
        plan.photons = photons.map(|photons| if endless { photons } else { plan.with_pilot(photons) });
        plan
    }

    /// The material of a triangle, as an index.
    pub fn material_index(&self, triangle: u32) -> usize {
        self.scene.surfaces[self.scene.mesh.surface[triangle as usize] as usize].material as usize
    }

    /// True where vertex normals are interpolated.
    pub fn is_smooth(&self, triangle: u32) -> bool {
        self.scene.surfaces[self.scene.mesh.surface[triangle as usize] as usize].smooth
    }

    /// Counts the deposits of a few paths, and from them sets the paths per pass and the share of deposits kept.
    fn with_pilot(&self, mut photons: PhotonPlan) -> PhotonPlan {
        let wanted = self.settings.paths.unwrap_or(DEFAULT_PATHS);
        photons.paths = wanted.min(PILOT_PATHS);
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

fn visibility(scene: &Scene, flow: &Flow, settings: &Settings, omissions: &mut Vec<Omission>) -> Visibility {
    if settings.keep_everything {
        return Visibility::Transmittance;
    }
    let passes = |straight: Matrix| {
        let [[ii, iv], [vi, vv]] = straight.rows();
        (!flow.gathered.invisible || (ii == 1.0 && iv == 0.0))
            && (!flow.gathered.visible || (vv == 1.0 && vi == 0.0))
    };
    if scene.materials.iter().all(|material| passes(material.bsdf.straight)) {
        omissions.push(Omission {
            name: "visibility",
            reason: "every surface lets straight through all of the light that is read behind it, so no surface can \
                     shadow another"
                .into(),
        });
        Visibility::Everywhere
    } else {
        Visibility::Transmittance
    }
}

fn photon_plan(
    scene: &Scene,
    flow: &Flow,
    settings: &Settings,
    omissions: &mut Vec<Omission>,
) -> Option<PhotonPlan> {
    let feeding = |delta: bool| {
        let terms = scene.materials.iter().flat_map(|material| &material.bsdf.terms);
        settings.keep_everything
            || terms.filter(|term| term.lobe.is_delta() == delta).any(|term| flow.feeds(term))
    };
    let classes = PhotonClasses {
        direct: settings.direct == Direct::Photons && flow.gathered.any(),
        caustic: feeding(true) && settings.max_reflections.is_none_or(|most| most > 1),
        indirect: feeding(false) && settings.max_reflections.is_none_or(|most| most > 1),
    };
    if classes.is_empty() {
        omissions.push(Omission {
            name: "photons",
            reason:
                "nothing that light passes on its way reflects it into a half that is read later, so direct \
                     light is all there is"
                    .into(),
        });
        return None;
    }
    if !classes.caustic {
        omissions.push(Omission {
            name: "caustic-photons",
            reason: "no mirror or glass sends on light that is read later".into(),
        });
    }
    let both_halves = settings.keep_everything || (flow.useful.visible && flow.present.visible);
    if !both_halves {
        omissions.push(Omission {
            name: "visible-half",
            reason:
                "no matrix reads the visible half of light that is on its way: every second column is zero"
                    .into(),
        });
    }
    let deposits: Vec<bool> = scene
        .materials
        .iter()
        .map(|material| {
            let finite = || material.bsdf.terms.iter().filter(|term| !term.lobe.is_delta());
            let read = |term: &Term| {
                term.lobe.albedo().max_element() > 0.0
                    && flow.seen.before(term.coefficient).and(flow.present).any()
            };
            if settings.keep_everything { finite().next().is_some() } else { finite().any(read) }
        })
        .collect();
    let dark: Vec<_> = scene
        .materials
        .iter()
        .zip(&deposits)
        .filter(|(_, kept)| !**kept)
        .map(|(m, _)| m.name.as_str())
        .collect();
    if !dark.is_empty() {
        omissions.push(Omission {
            name: "deposits",
            reason: format!("what arrives on {} cannot be seen by density estimation", dark.join(", ")),
        });
    }
    Some(PhotonPlan {
        paths: settings.paths.unwrap_or(DEFAULT_PATHS),
        classes,
        deposits,
        keep: 1.0,
        growth: 1.0,
        max_reflections: settings.max_reflections.map_or(u32::MAX, |most| most.saturating_sub(1)),
        both_halves,
    })
}

impl Plan {
    /// What is done and what is left out, in one line.
    pub fn one_line(&self) -> String {
        let Settings { width, height, .. } = self.settings;
        let photons = match (&self.photons, self.settings.method) {
            (Some(photons), _) => format!("{} photon paths a pass", photons.paths),
            (None, Method::Photon) => "no photons".into(),
            (None, method) => {
                format!("{}, {} samples a pixel and pass", method.name(), self.settings.samples)
            }
        };
        let names: Vec<_> = self.omissions.iter().map(|omission| omission.name).collect();
        let omitted =
            if names.is_empty() { String::new() } else { format!("; left out: {}", names.join(", ")) };
        format!(
            "{}: {} triangles, {}; {width}x{height}, {photons}{omitted}",
            self.scene.name,
            self.scene.mesh.triangles.len(),
            self.scene.describe_illumination(),
        )
    }

    /// The same at length, with the reasons.
    pub fn describe(&self) -> String {
        let mut text = format!("{}\n", self.one_line());
        text.push_str(&format!("multiplication factor: {}\n", self.existence.describe()));
        text.extend(self.existence.refusal(&self.scene).map(|refusal| format!("{refusal}\n")));
        text.extend(self.existence.warning().map(|warning| format!("warning: {warning}\n")));
        for omission in &self.omissions {
            text.push_str(&format!("left out {}: {}\n", omission.name, omission.reason));
        }
        text
    }
}
