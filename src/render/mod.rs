//! A render: one plan, the frame that pilots learn, passes that are independent of each other, one film.

mod forecast;
mod pace;
mod state;

pub use crate::memory::Memory;
pub use crate::pass::render_pass;
pub use crate::pilot::{learn, learn_photons};
pub use crate::stop::Stop;
pub use forecast::{Forecast, Saving, Stages, savings};
pub use pace::Pace;
pub use state::{ESTIMATORS, another_picture, film_for, key};

use crate::atlas::{self, Atlas, AtlasRun};
use crate::error::{Error, Result};
use crate::existence::{Existence, Multiplication};
use crate::film::{Doubt, Film, Header, Key, Layer, Schedule};
use crate::pass::pass_image;
use crate::path_trace::unreachable_luminaires;
use crate::plan::{Frame, Method, Plan, Settings};
use crate::scene::Scene;

/// A render in progress.
///
/// ```no_run
/// # fn main() -> halflight::error::Result<()> {
/// use halflight::{film::{Layer, write_exr, write_png}, plan::Settings, render::Render, scene::Scene};
/// let scene = Scene::load("builtin:caustic-box")?;
/// let mut render = Render::new(scene, Settings::default(), &[Layer::Visible, Layer::Error])?;
/// while render.film().passes() < 16 {
///     render.pass();
/// }
/// write_exr("box.exr".as_ref(), render.film(), &render.header())?;
/// # Ok(())
/// # }
/// ```
pub struct Render {
    plan: Plan,
    frame: Frame,
    film: Film,
    schedule: Schedule,
    /// Of the scene and the settings.
    key: Key,
    atlas: Option<AtlasRun>,
    memory: Memory,
    /// The scene's illumination in words.
    illumination: String,
    /// Photons stored over all passes.
    stored: u64,
    seconds: f64,
}

impl Render {
    /// Plans the render; `layers` are those of the film ([`Layer::Visible`] is always among them).
    ///
    /// # Errors
    /// A layer that the method does not make; luminaires that the method can never find; no image, where the whole
    /// series is asked for; more memory than [`Settings::memory`].
    pub fn new(scene: Scene, settings: Settings, layers: &[Layer]) -> Result<Self> {
        check(&scene, &settings, layers)?;
        let begin = std::time::Instant::now();
        let mut layers = layers.to_vec();
        if !layers.contains(&Layer::Visible) {
            layers.insert(0, Layer::Visible);
        }
        let settings = Settings { invisible: layers.contains(&Layer::Invisible), ..settings };
        Memory::of_pixels(&settings, &layers).check(settings.memory)?;
        let illumination = scene.describe_illumination();
        let asked = settings.clone();
        // The plan of an atlas is of the scene at another point.
        let (planned, hash) = if settings.atlas {
            (plan_atlas(&scene, settings, &layers)?, Some(scene.hash()))
        } else {
            (plan_picture(scene, settings)?, None)
        };
        let (plan, frame, atlas) = planned;
        let memory = atlas.as_ref().map_or_else(|| Memory::of(&plan, &frame, &layers), AtlasRun::memory);
        memory.check(plan.settings.memory)?;
        let film = Film::new(frame.width, frame.height, &layers);
        let key = key(hash.unwrap_or(plan.scene_hash), &asked);
        let seconds = begin.elapsed().as_secs_f64();
        let schedule = Schedule::ALL;
        Ok(Self { plan, frame, film, schedule, key, atlas, memory, illumination, stored: 0, seconds })
    }

    /// Passes look at `stop` and are dropped when it is asked; [`passes`](Self::passes) then returns 0.
    pub fn stop_at(&mut self, stop: Stop) {
        self.frame.stop = stop;
    }

    /// Makes passes to come smaller or larger: photon paths of a pass, or camera samples of a pixel where paths are traced.
    pub fn set_pass_size(&mut self, size: u32) {
        match self.frame.photons.take() {
            Some(photons) => self.frame.photons = Some(photons.with_paths(size.max(1))),
            None => self.frame.samples = size.max(1),
        }
    }

    /// What [`set_pass_size`](Self::set_pass_size) sets.
    pub fn pass_size(&self) -> u32 {
        self.frame.photons.as_ref().map_or(self.frame.samples, |photons| photons.paths)
    }

    /// Seconds that a pass will take on this machine, by a small one on the clock.
    pub fn seconds_of_a_pass(&self) -> Stages {
        forecast::seconds_of_a_pass(&self.plan, &self.frame)
    }

    /// What is done and what is left out.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// How passes are rendered.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The sums so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// The atlas as it is made. None where [`Settings::atlas`] was not asked for.
    pub fn atlas_run(&self) -> Option<&AtlasRun> {
        self.atlas.as_ref()
    }

    /// What it will hold in memory.
    pub fn memory(&self) -> Memory {
        self.memory
    }

    /// Every picture of the square so far. None where [`Settings::atlas`] was not asked for.
    pub fn atlas(&self) -> Option<Atlas> {
        self.atlas.as_ref().map(AtlasRun::atlas)
    }

    /// How far the picture is from the truth, as far as it can tell. None below two passes.
    pub fn error(&self) -> Option<ErrorEstimate> {
        ErrorEstimate::of(&self.film, self.plan.settings.method != Method::Nearest)
    }

    /// Renders the next pass and adds it to the film.
    pub fn pass(&mut self) {
        self.passes(1);
    }

    /// Renders the next passes and adds them to the film: one, or as many as an [`AtlasRun`] likes to render together, but no
    /// more than `most`. Returns how many: none, when they were told to stop, or when none is left.
    pub fn passes(&mut self, most: u32) -> u32 {
        let begin = std::time::Instant::now();
        let Some(first) = self.schedule.next(self.film.pass_set()) else { return 0 };
        let tells_bias = self.frame.photons.is_some() && self.plan.settings.method == Method::Photon;
        let biased = tells_bias.then_some(Layer::Bias);
        let planes: Vec<Layer> = self.film.accumulated().chain(biased).collect();
        let images = match &mut self.atlas {
            None => {
                let image = render_pass(&self.plan, &self.frame, first, &planes);
                // It may have been given up on the way.
                if self.frame.stop.asked() { Vec::new() } else { vec![image] }
            }
            Some(atlas) => {
                let passes = first..first + atlas.together().min(most).max(1);
                let gathered = atlas.passes(&self.plan, &self.frame, passes);
                let image = |(gathered, stored)| (pass_image(&self.frame, &gathered, &planes), stored);
                gathered.into_iter().map(image).collect()
            }
        };
        for (pass, (image, stored)) in (first..).zip(&images) {
            self.stored += stored;
            self.film.add_pass(pass, image);
        }
        self.seconds += begin.elapsed().as_secs_f64();
        images.len() as u32
    }

    /// Facts about the picture for its file.
    pub fn header(&self) -> Header {
        let Plan { scene, settings, omissions, existence, scene_hash, .. } = &self.plan;
        let photons = &self.frame.photons;
        let omitted: Vec<_> = omissions.iter().map(|omission| omission.name).collect();
        let mut header = Header::new()
            .with("version", env!("CARGO_PKG_VERSION"))
            .with("method", settings.method.name())
            .with("scene", scene.name.clone())
            .with("scene_hash", format!("{scene_hash:016x}"))
            .with("illumination", self.illumination.clone())
            .with("seed", settings.seed.to_string())
            .with("passes", self.film.passes())
            .with("paths_per_pass", photons.as_ref().map_or(0, |photons| photons.paths))
            .with("photons", self.stored.to_string())
            .with("omitted", omitted.join(" "))
            .with("plan", self.frame.one_line(&self.plan))
            .with("seconds", self.seconds);
        match existence {
            _ if self.atlas.is_some() => {} // that of the whole square is in the atlas
            Existence::Certain { at_most, .. } => header.set("k_at_most", *at_most),
            Existence::Measured(Multiplication { k, error, .. }) => {
                header.set("k", *k);
                header.set("k_error", *error);
            }
        }
        if let Some(most) = settings.max_reflections {
            header.set("max_reflections", most);
        }
        if settings.method == Method::Nearest {
            header.set("nearest", settings.nearest);
            header.set("cone", f64::from(settings.cone));
            header.set(BIAS, "not told");
        }
        tell_error(&mut header, &self.film);
        header
    }
}

/// The error of a picture as the render itself sees it: roots of means over pixels and channels, relative to
/// √(mean² + 0.01²), so that `total²` estimates relMSE.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Standard error of the mean over passes.
    pub noise: f64,
    /// Bias of the finite gather radius; zero for the path tracers, and where noise hides it. None: not told, though there is one.
    pub bias: Option<f64>,
    /// How far these rest upon few events.
    pub doubt: Doubt,
}

impl ErrorEstimate {
    /// Of the passes of a film, with its bias if that is to be told. None below two, or as long as all are of one half.
    pub fn of(film: &Film, tells_bias: bool) -> Option<Self> {
        let ((noise, doubt), bias) = (film.noise_and_doubt()?, film.relative_bias()?);
        Some(Self { noise, bias: tells_bias.then_some(bias), doubt })
    }

    /// Whether the error can be trusted; where not, what is known to exist came too seldom to be judged.
    pub fn is_trusted(self) -> bool {
        self.doubt.reasons(self.total()).is_empty()
    }

    /// Whether `passes` bring an error of `limit`, that can be trusted; or one that is no number, and never will be.
    pub fn reaches(self, limit: f64, passes: u32) -> bool {
        let is_below = self.total() <= limit && self.is_trusted();
        passes >= FEWEST_PASSES && (is_below || !self.total().is_finite())
    }

    /// What to tell whoever looks at an error that cannot be trusted. None: it can.
    pub fn warning(self) -> Option<String> {
        let reasons = self.doubt.reasons(self.total()).join("; ");
        (self.total().is_finite() && !reasons.is_empty()).then(|| {
            format!("the error cannot be trusted yet, as it rests upon few bright paths: {reasons}; more passes will show")
        })
    }

    /// Both together, as far as they are told.
    pub fn total(self) -> f64 {
        self.noise.hypot(self.bias.unwrap_or(0.0))
    }
}

/// The spread of fewer passes is not yet a measure of error.
const FEWEST_PASSES: u32 = 8;

/// The fact that bias is not told.
const BIAS: &str = "bias";

/// Facts that follow from the passes of a film: how far the picture is from the truth, and whether that can be trusted.
pub fn tell_error(header: &mut Header, film: &Film) {
    let tells_bias = !header.entries.iter().any(|(name, _)| name == BIAS);
    let Some(error) = ErrorEstimate::of(film, tells_bias) else { return };
    let yes = |is: bool| if is { "yes" } else { "no" };
    header.set("relative_error", error.total());
    if let Some(bias) = error.bias {
        header.set("relative_bias", bias);
    }
    header.set("error_is_trusted", yes(error.is_trusted()));
    header.set("error_variance_of_variance", error.doubt.variance_of_variance);
    header.set("light_of_single_passes", error.doubt.single);
    header.set("noise_by_other_passes", error.doubt.noise);
}

type Planned = (Plan, Frame, Option<AtlasRun>);

fn plan_atlas(scene: &Scene, settings: Settings, layers: &[Layer]) -> Result<Planned> {
    let (plan, at) = atlas::plan(scene, settings)?;
    let (atlas, frame) = AtlasRun::new(&plan, at, layers)?;
    Ok((plan, frame, Some(atlas)))
}

fn plan_picture(scene: Scene, settings: Settings) -> Result<Planned> {
    let plan = Plan::new(scene, settings);
    if plan.is_endless()
        && let Some(reason) = plan.existence.refusal(&plan.scene)
    {
        return Err(Error::NoImage { reason, k: plan.existence.factor() });
    }
    let frame = learn(&plan);
    Ok((plan, frame, None))
}

/// What the method cannot do.
fn check(scene: &Scene, settings: &Settings, layers: &[Layer]) -> Result<()> {
    if settings.method == Method::Photon {
        return Ok(());
    }
    if settings.method == Method::Nearest {
        return check_nearest(settings, layers);
    }
    let makes =
        |layer: &Layer| matches!(layer, Layer::Visible | Layer::Invisible | Layer::Emitted | Layer::Error);
    if let Some(layer) = layers.iter().find(|layer| !makes(layer)) {
        return Err(Error::Usage(format!(
            "--layers {layer}: the path tracers make visible, invisible, emitted and error; use --method photon"
        )));
    }
    let unreachable = unreachable_luminaires(scene).len();
    if settings.method == Method::PathPlain && unreachable == scene.luminaires.len() {
        return Err(Error::Usage(format!(
            "--method path-plain: {} has only lights without extent, which it can never find; use --method path",
            scene.name
        )));
    }
    Ok(())
}

fn check_nearest(settings: &Settings, layers: &[Layer]) -> Result<()> {
    if layers.contains(&Layer::Bias) {
        return Err(Error::Usage(
            "--layers bias: nobody knows the bias of --method nearest; leave the layer out, or use --method photon".into(),
        ));
    }
    if layers.contains(&Layer::Fluorescent) {
        return Err(Error::Usage(
            "--layers fluorescent: --method nearest does not keep apart what was re-radiated; leave the layer out, or use --method photon"
                .into(),
        ));
    }
    settings.check_nearest()
}
