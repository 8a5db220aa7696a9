//! The settings of every command that renders, or that says what rendering would take.

use crate::error::{Error, Result};
use crate::film::Layer;
use crate::plan::{Direct, Method, Omittable, Settings, film_size};
use crate::scene::{NO_CAMERA, Scene};
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};

/// How a scene is rendered.
#[derive(Args, Clone, Debug)]
pub struct SettingsArgs {
    /// Film size in pixels. Of another shape than the camera's picture it shows all of that and more beside it, or above
    /// and below. Default: 512 on the longer side, in the shape of the camera's picture; square where it has none.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    pub size: Option<(u32, u32)>,

    /// Photon paths per pass. Default: chosen by the plan.
    #[arg(long, value_name = "N", value_parser = whole::<u32>)]
    pub photons: Option<u32>,

    /// Who serves light that comes straight from luminaires: connections from camera hits, or photons too. `auto` takes
    /// connections, unless there are many luminaires and a pilot finds photons better at equal work.
    #[arg(long, value_enum, default_value_t = DirectArg::Auto)]
    pub direct: DirectArg,

    /// Everything random follows from it.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Layers of the EXR file, comma-separated: visible, invisible, error, bias, emitted, direct, caustic, indirect, depth,
    /// normal, albedo, denoising-normal, denoising-albedo; or `all`.
    #[arg(long, value_name = "LAYER,…", value_delimiter = ',', default_values = DEFAULT_LAYERS)]
    pub layers: Vec<String>,

    /// Cut the series: no light that was reflected more than N times, the reflection towards the camera and mirrors
    /// and glass included. 0 shows luminaires alone.
    #[arg(long, value_name = "N")]
    pub max_reflections: Option<u32>,

    /// Who transports light: photons with a final gather; path, a gathering path tracer with connections to luminaires;
    /// path-plain, one that finds them by chance, as the paper's; nearest, the photon map of the textbooks, which reads
    /// light from the nearest photons and does not know its bias.
    #[arg(long, value_enum, default_value_t = Method::Photon)]
    pub method: Method,

    /// Camera samples per pixel and pass of the path tracers, stratified against each other. Default: 4.
    #[arg(long, value_name = "N", value_parser = whole::<u32>)]
    pub samples: Option<u32>,

    /// First gather radius of inter-reflection in pixels: wider is smoother and more biased. Default: a 28th of the height
    /// of the film, but 4 at least, and less where --photons is more.
    #[arg(long, value_name = "PIXELS", value_parser = radius)]
    pub indirect_radius: Option<f32>,

    /// First gather radius of caustics where they are sharpest, in pixels. Default: 2.
    #[arg(long, value_name = "PIXELS", value_parser = radius)]
    pub caustic_radius: Option<f32>,

    /// Photons from which --method nearest reads light at a point: more of them are smoother and reach farther. Default: 100.
    #[arg(long, value_name = "K", value_parser = whole::<u32>)]
    pub nearest: Option<u32>,

    /// The nearest photons weigh by a cone that reaches zero at C times the distance of the farthest: 1 or more, `inf`: all
    /// weigh the same. Default: 1.
    #[arg(long, value_name = "C")]
    pub cone: Option<f32>,

    /// Start photons, and lead connections, in proportion to the power of luminaires, whatever comes of it: for measurements of
    /// what it brings to learn where light is of use.
    #[arg(long)]
    pub even_starts: bool,

    /// Give every pixel one camera path a pass, also at edges: for measurements of what more of them bring there.
    #[arg(long)]
    pub one_path: bool,

    /// Leave nothing out, needed or not.
    #[arg(long)]
    pub keep_everything: bool,

    /// Do not leave this out, needed or not; may be repeated. `halflight plan` tells the names.
    #[arg(long, value_name = "NAME")]
    pub keep: Vec<String>,
}

/// Layers of the EXR file.
pub(super) const DEFAULT_LAYERS: [&str; 2] = ["visible", "error"];
/// Camera samples per pixel and pass of the path tracers.
pub(super) const DEFAULT_SAMPLES: u32 = 4;

impl ValueEnum for Method {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()))
    }
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
    /// The settings asked for, those that follow from the layers included; the film is that of [`film`](Self::film).
    pub fn resolve(&self) -> Result<(Settings, Vec<Layer>)> {
        let layers = self.layers()?;
        self.check_method()?;
        if let (Some(samples), true) = (self.samples, self.method.shoots()) {
            return Err(Error::Usage(format!(
                "--samples {samples}: photons take one camera sample per pixel and pass; add --method path, or give more passes"
            )));
        }
        let usual = Settings::default();
        let settings = Settings {
            paths: self.photons,
            seed: self.seed,
            direct: match self.direct {
                DirectArg::Auto => Direct::Auto,
                DirectArg::Connection => Direct::Connection,
                DirectArg::Photons => Direct::Photons,
            },
            method: self.method,
            samples: self.samples.unwrap_or(DEFAULT_SAMPLES),
            invisible: layers.contains(&Layer::Invisible),
            max_reflections: self.max_reflections,
            even_starts: self.even_starts,
            one_path: self.one_path,
            keep_everything: self.keep_everything,
            keep: self.keep()?,
            caustic_radius: self.caustic_radius.unwrap_or(usual.caustic_radius),
            nearest: self.nearest.unwrap_or(usual.nearest),
            cone: self.cone.unwrap_or(usual.cone),
            ..usual
        };
        settings.check_nearest()?;
        Ok((settings, layers))
    }

    /// Options that the method does not ask for.
    fn check_method(&self) -> Result<()> {
        if self.one_path && !self.method.shoots() {
            return Err(Error::Usage(format!(
                "--one-path is of --method photon and nearest; with --method {} leave it out",
                self.method.name()
            )));
        }
        let of_nearest = [("--nearest", self.nearest.is_some()), ("--cone", self.cone.is_some())];
        let of_disks = [
            ("--indirect-radius", self.indirect_radius.is_some()),
            ("--caustic-radius", self.caustic_radius.is_some()),
        ];
        let (foreign, whose) = match self.method {
            Method::Nearest => (of_disks, Method::Photon),
            _ => (of_nearest, Method::Nearest),
        };
        match foreign.iter().find(|(_, given)| *given) {
            Some((option, _)) => Err(Error::Usage(format!(
                "{option} is of --method {}; with --method {} leave it out",
                whose.name(),
                self.method.name()
            ))),
            None => Ok(()),
        }
    }

    /// The settings on the film asked for, else on one of the camera's shape. A film that shows more than the camera's
    /// picture is noted.
    pub fn film(&self, settings: Settings, scene: &mut Scene) -> Settings {
        let aspect = scene.camera.aspect;
        let (width, height) = self.size.unwrap_or_else(|| film_size(aspect));
        let framed = scene.notes.iter().any(|note| note == NO_CAMERA);
        scene.notes.extend(aspect.filter(|_| !framed).and_then(|aspect| beside(aspect, width, height)));
        let of_film = Settings::for_film(width, height);
        let usual = match self.photons {
            Some(paths) => of_film.with_paths(paths),
            None => of_film,
        };
        let indirect_radius = self.indirect_radius.unwrap_or(usual.indirect_radius);
        Settings { width, height, indirect_radius, ..settings }
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

/// What a film shows that a picture of the given width / height does not. None where a pixel makes the difference.
fn beside(aspect: f32, width: u32, height: u32) -> Option<String> {
    let surplus = width as f32 - aspect * height as f32;
    let place = if surplus > 0.0 { "on the left and right" } else { "above and below" };
    (surplus.abs() >= aspect.max(1.0)).then(|| {
        let (width_of_1, fitting) = (format!("{aspect:.4}"), film_size(Some(aspect)));
        let width_of_1 = width_of_1.trim_end_matches('0').trim_end_matches('.');
        format!(
            "the camera's picture is {width_of_1}:1, the film {width}x{height}: it also shows what lies {place} (--size {}x{} \
             shows the picture alone)",
            fitting.0, fitting.1
        )
    })
}

/// The largest side of a film, in pixels.
const LONGEST_SIDE: u32 = 65_536;

pub(super) fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let wrong = || format!("`{text}` is no size; write WIDTHxHEIGHT in pixels, as in 512x512");
    let (width, height) = text.split_once(['x', 'X', '×']).ok_or_else(wrong)?;
    let side = |text: &str| {
        let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        let side = text.parse::<u32>().ok().filter(|side| (1..=LONGEST_SIDE).contains(side));
        side.ok_or_else(|| if digits { format!("each side has 1 to {LONGEST_SIDE} pixels") } else { wrong() })
    };
    Ok((side(width)?, side(height)?))
}

fn radius(text: &str) -> std::result::Result<f32, String> {
    let number = text.parse().ok().filter(|x: &f32| *x > 0.0 && x.is_finite());
    number.ok_or_else(|| format!("`{text}` is no radius; write a number of pixels above zero"))
}

/// A whole number from one up, also as in 1e6, 20k, 1.5M.
pub(super) fn whole<T: TryFrom<u64>>(text: &str) -> std::result::Result<T, String> {
    let wrong = || {
        format!("`{text}` is no number of things; write a whole number above zero, as in 20000, 2e4 or 20k")
    };
    let (digits, scale) = match text.strip_suffix(['k', 'M']) {
        Some(digits) => (digits, if text.ends_with('k') { 1e3 } else { 1e6 }),
        None => (text, 1.0),
    };
    // Below 2^53 a float holds whole numbers exactly.
    let float = || {
        digits.parse::<f64>().map(|x| scale * x).ok().filter(|x| x.fract() == 0.0 && *x > 0.0 && *x < 9e15)
    };
    let number = text.parse::<u64>().ok().or_else(|| float().map(|x| x as u64)).filter(|n| *n > 0);
    let number = number.ok_or_else(wrong)?;
    T::try_from(number).map_err(|_| format!("`{text}` is too large a number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_film_shows_beside_the_cameras_picture_is_told() {
        for aspect in [1.0, 16.0 / 9.0, 4.0 / 3.0, 1.85, 0.37] {
            let (width, height) = film_size(Some(aspect));
            assert_eq!(beside(aspect, width, height), None);
        }
        assert!(beside(16.0 / 9.0, 512, 512).is_some_and(|note| note.contains("above and below")));
        assert!(beside(1.0, 640, 480).is_some_and(|note| note.contains("left and right")));
    }

    #[test]
    fn numbers_may_be_written_with_an_exponent() {
        assert_eq!(whole::<u32>("1e6"), Ok(1_000_000));
        assert_eq!(whole::<u32>("2.5e3"), Ok(2_500));
        assert_eq!((whole::<u32>("20k"), whole::<u32>("1.5M")), (Ok(20_000), Ok(1_500_000)));
        assert_eq!(whole::<u32>("4294967295"), Ok(u32::MAX));
        for wrong in [
            "0",
            "-1",
            "1.5",
            "1e-3",
            "nan",
            "inf",
            "",
            "1e",
            "4294967296",
            "1e16",
            "k",
            "1.5",
            "0k",
            "1m",
            "0.1k k",
        ] {
            assert!(whole::<u32>(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_say_their_limit() {
        assert_eq!(size("512x384"), Ok((512, 384)));
        for wrong in ["0x0", "100000x100000", "12x65537", "99999999999x1"] {
            assert!(size(wrong).is_err_and(|e| e.contains("1 to 65536 pixels")), "{wrong}");
        }
        for wrong in ["512", "axb", "x", "-1x5", "5x 5"] {
            assert!(size(wrong).is_err_and(|e| e.contains("WIDTHxHEIGHT")), "{wrong}");
        }
    }
}
