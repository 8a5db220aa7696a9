//! What every command that renders, or says what rendering would take, asks about the render.

use crate::error::{Error, Result};
use crate::film::Layer;
use crate::plan::{Direct, Method, Omittable, Settings};
use clap::{Args, ValueEnum};

/// How a scene is rendered.
#[derive(Args, Clone, Debug)]
pub struct SettingsArgs {
    /// Film size in pixels.
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "512x512", value_parser = size)]
    pub size: (u32, u32),

    /// Photon paths per pass. Default: chosen by the plan.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub photons: Option<u32>,

    /// Who serves light that comes straight from luminaires: connections from camera hits, or photons too. `auto` takes
    /// connections, unless there are many luminaires and a pilot finds photons better at equal work.
    #[arg(long, value_enum, default_value_t = DirectArg::Auto)]
    pub direct: DirectArg,

    /// Everything random follows from it.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Layers of the EXR file, comma-separated: visible, invisible, error, bias, emitted, direct, caustic, indirect, depth,
    /// normal, albedo; or `all`.
    #[arg(long, value_name = "LAYER,…", value_delimiter = ',', default_value = "visible,error")]
    pub layers: Vec<String>,

    /// Cut the series: no light that was reflected more than N times, the reflection towards the camera and mirrors
    /// and glass included. 0 shows luminaires alone.
    #[arg(long, value_name = "N")]
    pub max_reflections: Option<u32>,

    /// Who transports light: photons with a final gather; path, a gathering path tracer with connections to luminaires;
    /// path-plain, one that finds them by chance, as the paper's.
    #[arg(long, value_enum, default_value_t = MethodArg::Photon)]
    pub method: MethodArg,

    /// Camera samples per pixel and pass of the path tracers, stratified against each other.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..))]
    pub samples: u32,

    /// Leave nothing out, needed or not.
    #[arg(long)]
    pub keep_everything: bool,

    /// Do not leave this out, needed or not; may be repeated. `halflight plan` tells the names.
    #[arg(long, value_name = "NAME")]
    pub keep: Vec<String>,
}

/// Who transports light.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum MethodArg {
    Photon,
    Path,
    PathPlain,
}

/// Who serves direct light.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum DirectArg {
    /// Connections, or photons where a pilot finds them better.
    Auto,
    /// From camera hits to points on luminaires.
    Connection,
    /// By density estimation, like all other light.
    Photons,
}

impl SettingsArgs {
    /// The settings asked for, those that follow from the layers included.
    pub fn resolve(&self) -> Result<(Settings, Vec<Layer>)> {
        let layers = self.layers()?;
        let settings = Settings {
            paths: self.photons,
            seed: self.seed,
            direct: match self.direct {
                DirectArg::Auto => Direct::Auto,
                DirectArg::Connection => Direct::Connection,
                DirectArg::Photons => Direct::Photons,
            },
            method: match self.method {
                MethodArg::Photon => Method::Photon,
                MethodArg::Path => Method::Path,
                MethodArg::PathPlain => Method::PathPlain,
            },
            samples: self.samples,
            invisible: layers.contains(&Layer::Invisible),
            max_reflections: self.max_reflections,
            keep_everything: self.keep_everything,
            keep: self.keep()?,
            ..Settings::for_film(self.size.0, self.size.1)
        };
        Ok((settings, layers))
    }

    fn keep(&self) -> Result<Vec<Omittable>> {
        let named = |name: &String| {
            name.parse::<Omittable>().map_err(|why| Error::Usage(format!("--keep {name}: {why}")))
        };
        self.keep.iter().map(named).collect()
    }

    fn layers(&self) -> Result<Vec<Layer>> {
        let mut layers = Vec::new();
        for name in &self.layers {
            let named = if name == "all" { Layer::ALL.to_vec() } else { vec![name.parse::<Layer>()?] };
            layers.extend(named.into_iter().filter(|layer| !layers.contains(layer)).collect::<Vec<_>>());
        }
        Ok(layers)
    }
}

pub(super) fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let wrong = || format!("`{text}` is no size; write WIDTHxHEIGHT in pixels, as in 512x512");
    let (width, height) = text.split_once('x').ok_or_else(wrong)?;
    let side =
        |text: &str| text.parse::<u32>().ok().filter(|side| (1..=65_536).contains(side)).ok_or_else(wrong);
    Ok((side(width)?, side(height)?))
}
