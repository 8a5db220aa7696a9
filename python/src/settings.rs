//! How a scene is rendered and when a render ends, from keyword arguments: the words of the command line.

use crate::errors::usage;
use crate::options::{Options, illumination};
use halflight::film::denoise::FEATURES;
use halflight::film::{Layer, Schedule};
use halflight::plan::{Direct, Method, Omittable, Settings, film_size, memory_left};
use halflight::scene::{Illumination, Scene};
use pyo3::prelude::*;
use std::time::Duration;

/// The largest side of a film, in pixels.
const LONGEST_SIDE: u32 = 65_536;

/// What is asked for, before the scene is known.
pub struct Wanted {
    /// None: as the scene says.
    pub illumination: Option<Illumination>,
    size: Option<(u32, u32)>,
    settings: Settings,
    layers: Vec<Layer>,
    /// Whether a denoised layer is made too.
    pub denoise: bool,
    radii: [Option<f32>; 2],
}

impl Wanted {
    /// All of it.
    pub fn of(more: &Options<'_>) -> PyResult<Self> {
        let Self { illumination, size, settings: Settings { max_reflections, .. }, .. } = Self::common(more)?;
        let mut own = Self::own(more)?;
        own.settings.seed = more.get("seed", "a whole number of 0 or more")?.unwrap_or(0);
        own.settings.max_reflections = max_reflections;
        Ok(Self { illumination, size, ..own })
    }

    /// What all have in common that are compared.
    pub fn common(more: &Options<'_>) -> PyResult<Self> {
        let illumination = more.read("illumination", illumination)?;
        let size = more.get::<(u32, u32)>("size", "(width, height) in pixels")?;
        if let Some((width, height)) =
            size.filter(|(w, h)| ![w, h].iter().all(|s| (1..=LONGEST_SIDE).contains(*s)))
        {
            return Err(usage(format!("size=({width}, {height}): each side has 1 to {LONGEST_SIDE} pixels")));
        }
        let max_reflections = more.get("max_reflections", "a whole number of 0 or more")?;
        let settings = Settings { max_reflections, ..Settings::default() };
        let layers = vec![Layer::Visible];
        Ok(Self { illumination, size, settings, layers, denoise: false, radii: [None; 2] })
    }

    /// What each may have of its own.
    pub fn own(more: &Options<'_>) -> PyResult<Self> {
        let method = method(more, "method")?.unwrap_or(Method::Photon);
        let layers = layers(more, method)?;
        let denoise = denoise(more, method)?;
        let samples = count(more, "samples")?;
        if let (Some(samples), true) = (samples, method.shoots()) {
            return Err(usage(format!(
                "samples={samples}: photons take one camera sample per pixel and pass; add method=\"path\", or more passes"
            )));
        }
        let radii = [radius(more, "indirect_radius")?, radius(more, "caustic_radius")?];
        let (nearest, cone) = nearest(more, method, radii)?;
        let usual = Settings::default();
        let settings = Settings {
            paths: count(more, "photons")?,
            direct: direct(more)?,
            method,
            samples: samples.unwrap_or(usual.samples),
            invisible: layers.contains(&Layer::Invisible),
            nearest: nearest.unwrap_or(usual.nearest),
            cone: cone.unwrap_or(usual.cone),
            even_starts: more.get("even_starts", "True or False")?.unwrap_or(false),
            one_path: more.get("one_path", "True or False")?.unwrap_or(false),
            keep_everything: more.get("keep_everything", "True or False")?.unwrap_or(false),
            keep: keep(more)?,
            memory: memory_left(),
            ..usual
        };
        settings.check_nearest().map_err(crate::errors::raised)?;
        Ok(Self { illumination: None, size: None, settings, layers, denoise, radii })
    }

    /// The settings that are its own, on the film of `base` and with the series that `base` has.
    pub fn over(self, base: &Settings) -> Settings {
        let [indirect, caustic] = self.radii;
        let usual = match self.settings.paths {
            Some(paths) => Settings::for_film(base.width, base.height).with_paths(paths),
            None => base.clone(),
        };
        Settings {
            width: base.width,
            height: base.height,
            max_reflections: base.max_reflections,
            indirect_radius: indirect.unwrap_or(usual.indirect_radius),
            caustic_radius: caustic.unwrap_or(base.caustic_radius),
            ..self.settings
        }
    }

    /// The layers that were asked for, where a denoised one is to stand beside them.
    pub fn denoising(&self) -> Option<Vec<Layer>> {
        self.denoise.then(|| self.layers.clone())
    }

    /// The settings for a scene, and the layers of the film: those asked for, and what the denoiser looks at.
    pub fn on(self, scene: &Scene) -> (Settings, Vec<Layer>) {
        let (width, height) = self.size.unwrap_or_else(|| film_size(scene.camera.aspect));
        let of_film = Settings::for_film(width, height);
        let usual = match self.settings.paths {
            Some(paths) => of_film.with_paths(paths),
            None => of_film,
        };
        let [indirect, caustic] = self.radii;
        let settings = Settings {
            width,
            height,
            indirect_radius: indirect.unwrap_or(usual.indirect_radius),
            caustic_radius: caustic.unwrap_or(usual.caustic_radius),
            ..self.settings
        };
        let mut layers = self.layers;
        let features = FEATURES.into_iter().filter(|_| self.denoise);
        layers.extend(features.filter(|layer| !layers.contains(layer)).collect::<Vec<_>>());
        (settings, layers)
    }
}

/// A method by the name that an argument gives.
pub fn method(more: &Options<'_>, argument: &'static str) -> PyResult<Option<Method>> {
    let Some(name) = more.get::<String>(argument, "a name")? else { return Ok(None) };
    let found = Method::ALL.into_iter().find(|method| method.name() == name);
    found.map(Some).ok_or_else(|| {
        let known = Method::ALL.map(Method::name).join(", ");
        usage(format!("{argument}: there is no '{name}'; the methods are {known}"))
    })
}

fn direct(more: &Options<'_>) -> PyResult<Direct> {
    match more.get::<String>("direct", "a name")?.as_deref() {
        None | Some("auto") => Ok(Direct::Auto),
        Some("connection") => Ok(Direct::Connection),
        Some("photons") => Ok(Direct::Photons),
        Some(other) => Err(usage(format!("direct: there is no '{other}'; give auto, connection or photons"))),
    }
}

/// Those named; else all that cost nothing.
fn layers(more: &Options<'_>, method: Method) -> PyResult<Vec<Layer>> {
    let Some(names) = more.get::<Vec<String>>("layers", "a list of names")? else {
        let bias = (method == Method::Photon).then_some(Layer::Bias);
        return Ok([Layer::Visible, Layer::Error].into_iter().chain(bias).collect());
    };
    let mut layers = vec![Layer::Visible];
    for name in names {
        let named = match name.as_str() {
            "all" => Layer::ALL.to_vec(),
            _ => vec![name.parse::<Layer>().map_err(crate::errors::raised)?],
        };
        layers.extend(named.into_iter().filter(|layer| !layers.contains(layer)).collect::<Vec<_>>());
    }
    Ok(layers)
}

fn denoise(more: &Options<'_>, method: Method) -> PyResult<bool> {
    let denoise = more.get("denoise", "True or False")?.unwrap_or(false);
    if denoise && !method.shoots() {
        return Err(usage(format!(
            "denoise=True looks at albedo and normals, which method=\"{}\" does not tell; use method=\"photon\", or leave it out",
            method.name()
        )));
    }
    Ok(denoise)
}

/// How many of the nearest photons are read and by which cone they weigh; what the method does not ask for is refused.
fn nearest(
    more: &Options<'_>,
    method: Method,
    radii: [Option<f32>; 2],
) -> PyResult<(Option<u32>, Option<f32>)> {
    let (nearest, cone) =
        (count(more, "nearest")?, more.get::<f32>("cone", "a number of 1 or more, or inf")?);
    let [indirect, caustic] = radii.map(|radius| radius.is_some());
    let (foreign, whose) = match method {
        Method::Nearest => ([("indirect_radius", indirect), ("caustic_radius", caustic)], Method::Photon),
        _ => ([("nearest", nearest.is_some()), ("cone", cone.is_some())], Method::Nearest),
    };
    match foreign.iter().find(|(_, given)| *given) {
        Some((argument, _)) => Err(usage(format!(
            "{argument} is of method=\"{}\"; with method=\"{}\" leave it out",
            whose.name(),
            method.name()
        ))),
        None => Ok((nearest, cone)),
    }
}

fn keep(more: &Options<'_>) -> PyResult<Vec<Omittable>> {
    let names = more.get::<Vec<String>>("keep", "a list of names")?.unwrap_or_default();
    let named = |name: &String| name.parse().map_err(|why| usage(format!("keep: {name}: {why}")));
    names.iter().map(named).collect()
}

fn count(more: &Options<'_>, name: &'static str) -> PyResult<Option<u32>> {
    let value = more.get::<u32>(name, "a whole number above zero")?;
    if value == Some(0) { Err(usage(format!("{name}=0: not a whole number above zero"))) } else { Ok(value) }
}

fn radius(more: &Options<'_>, name: &'static str) -> PyResult<Option<f32>> {
    let value = more.get::<f32>(name, "a number of pixels above zero")?;
    match value {
        Some(wrong) if !(wrong > 0.0 && wrong.is_finite()) => {
            Err(usage(format!("{name}={wrong}: not a number of pixels above zero")))
        }
        fits => Ok(fits),
    }
}

/// The passes of one share of a render: of n shares the kth, numbered from 1.
pub fn shard(more: &Options<'_>) -> PyResult<Option<Schedule>> {
    let what = "(k, n): of n shards the kth, numbered from 1";
    match more.get::<(u32, u32)>("shard", what)? {
        Some((which, of)) if !(1..=of).contains(&which) => {
            Err(usage(format!("shard=({which}, {of}): not {what}")))
        }
        shard => Ok(shard.map(|(which, of)| Schedule { first: which - 1, end: None, step: of })),
    }
}

/// What ends a render: the first of these that is reached.
pub struct Limits {
    /// So many passes in the picture.
    pub passes: Option<u32>,
    /// So much time.
    pub time: Option<Duration>,
    /// Relative error below this.
    pub error: Option<f64>,
}

/// Passes of a render that was given no limit, as on the command line.
const DEFAULT_PASSES: u32 = 64;

impl Limits {
    /// Reads them.
    pub fn of(more: &Options<'_>) -> PyResult<Self> {
        let (passes, error) = (count(more, "passes")?, more.get::<f64>("error", "a fraction above zero")?);
        let seconds = more.get::<f64>("seconds", "a number above zero")?;
        let above = |name: &str, value: Option<f64>| match value {
            Some(wrong) if !(wrong > 0.0 && wrong.is_finite()) => {
                Err(usage(format!("{name}={wrong}: not a finite number above zero")))
            }
            _ => Ok(()),
        };
        above("seconds", seconds)?;
        above("error", error)?;
        let time = seconds.map(Duration::try_from_secs_f64).transpose();
        let time = time.map_err(|_| usage("seconds: too long a time"))?;
        let none = passes.is_none() && time.is_none() && error.is_none();
        Ok(Self { passes: if none { Some(DEFAULT_PASSES) } else { passes }, time, error })
    }
}
