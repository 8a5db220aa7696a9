//! `halflight diff`: how far one picture is from another.

use crate::cli::diff_text::number;
use crate::cli::output::{Overwrite, claim, ending};
use crate::error::{Error, Result};
use crate::film::{Header, Image, Layer, read_exr, write_bytes_png, write_image_exr};
use crate::measure::error_picture::{heat_map, signed_relative_error};
use crate::measure::mask::{brighter_than, dilated};
use crate::measure::{Metrics, compare, flip, hdr_flip};
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Compare a picture with a reference.
///
/// Prints, for each layer that both files have: RMSE; relMSE, the mean over pixels and channels of
/// (a-b)^2 / (b^2 + 0.01^2); bias, the mean of a-b, also in percent of b; e_pixel, the root mean square over channels
/// of the difference of displayed values, as mean and maximum over pixels; the largest difference of the average
/// colour's channels, displayed; and FLIP, the perceived difference. Displayed values are linear, clamped to [0, 1].
#[derive(clap::Args, Clone, Debug, Default)]
pub struct DiffArgs {
    /// The picture to judge (EXR)
    pub picture: PathBuf,
    /// The reference: what the picture should be (EXR of the same size)
    pub reference: PathBuf,
    /// Compare this layer only (repeatable) [default: every layer both files have]
    #[arg(long, value_name = "NAME")]
    pub layer: Vec<String>,
    /// Write a picture of the relative error of the first layer compared
    ///
    /// .exr: (a-b)/sqrt(b^2+0.01^2), signed, and the plain difference as layer `difference`. .png: its size in colour
    /// on a logarithmic scale: black 0.001 or less, purple 0.01, salmon 0.1, pale yellow 1 or more; pixels left out
    /// grey, those that are not finite green.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Whether the file of `output` may be another program's
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// Leave out pixels where the reference's visible layer has a channel above X
    #[arg(long, value_name = "X")]
    pub mask_above: Option<f32>,
    /// Leave out pixels that see a luminaire: where the layer `emitted` of the reference (else of the picture) is not 0
    #[arg(long)]
    pub mask_emitted: bool,
    /// Grow what is left out by N pixels on every side
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub dilate: u32,
    /// Exit with code 1 when METRIC is above X (repeatable)
    ///
    /// METRIC is rmse, relmse, bias, relative-bias, e-pixel, e-pixel-max, mean-colour, flip, hdr-flip or not-finite;
    /// a bias counts by its size. Applies to the layers given with --layer, else to `visible`. Pixels that are not
    /// finite, and not the same in both files, exceed any limit.
    #[arg(long, value_name = "METRIC=X")]
    pub fail_above: Vec<String>,
    /// Also HDR-FLIP: the largest FLIP over a range of exposures (slow)
    #[arg(long)]
    pub hdr_flip: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// Whether the limits were kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// No limit was set, or none exceeded.
    Within,
    /// A limit of `--fail-above` was exceeded, and the report says which.
    Exceeded,
}

impl Verdict {
    /// The process exit code: 0 or 1.
    pub fn exit_code(self) -> u8 {
        u8::from(self == Self::Exceeded)
    }
}

/// Compares, prints to standard output, and writes the error picture.
pub fn run(args: &DiffArgs) -> Result<Verdict> {
    let report = measure(args)?;
    let text = if args.json { report.json() } else { report.text() };
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        // The reader of a pipe may have seen enough.
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            return Err(Error::Write { path: "standard output".into(), reason: e.to_string() });
        }
        _ => {}
    }
    Ok(if report.exceeded.is_empty() { Verdict::Within } else { Verdict::Exceeded })
}

/// What `diff` found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The file judged.
    pub picture: PathBuf,
    /// The file it was judged by.
    pub reference: PathBuf,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Which pixels are left out, in words; None when all count.
    pub mask: Option<String>,
    /// Figures of each layer compared.
    pub layers: Vec<LayerReport>,
    /// One line for each limit exceeded.
    pub exceeded: Vec<String>,
}

/// The figures of one layer.
#[derive(Clone, Debug, Serialize)]
pub struct LayerReport {
    /// Its name.
    pub layer: String,
    /// Its error figures.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Mean FLIP over the pixels that count; None where the layer is no picture (depth, normal, error).
    pub flip: Option<f64>,
    /// Mean HDR-FLIP, when asked for.
    pub hdr_flip: Option<f64>,
}

/// Compares two files and writes the error picture, but prints nothing.
pub fn measure(args: &DiffArgs) -> Result<Report> {
    let limits = args.fail_above.iter().map(|text| Limit::parse(text)).collect::<Result<Vec<_>>>()?;
    if let Some(path) = &args.output {
        picture_kind(path)?;
        claim(path, &[args.picture.clone(), args.reference.clone()], args.overwrite)?;
    }
    let (a, b) = (read_exr(&args.picture)?, read_exr(&args.reference)?);
    if (a.width, a.height) != (b.width, b.height) {
        let reason = format!(
            "{} x {} pixels, but {} is {} x {}; render both at one size",
            a.width,
            a.height,
            args.reference.display(),
            b.width,
            b.height
        );
        return Err(Error::Image { path: args.picture.clone(), reason });
    }
    let names = layers_to_compare(args, &a, &b)?;
    let (left_out, mask) = mask(args, &a, &b)?;
    if left_out.iter().all(|&out| out) {
        return Err(Error::Usage(
            "the mask leaves no pixel to compare; raise --mask-above or lower --dilate".into(),
        ));
    }
    let wants_hdr = args.hdr_flip || limits.iter().any(|limit| limit.metric == "hdr-flip");
    let layers: Vec<LayerReport> =
        names.par_iter().map(|name| layer_report(name, &a, &b, &left_out, wants_hdr)).collect();
    let judged: Vec<&LayerReport> = match layers.iter().find(|l| l.layer == Layer::Visible.name()) {
        Some(visible) if args.layer.is_empty() => vec![visible],
        _ => layers.iter().collect(),
    };
    let exceeded = exceeded(&limits, &judged)?;
    if let Some(path) = &args.output {
        write_error_picture(path, &names[0], &a, &b, &left_out)?;
    }
    let (picture, reference) = (args.picture.clone(), args.reference.clone());
    Ok(Report { picture, reference, width: a.width, height: a.height, mask, layers, exceeded })
}

fn layers_to_compare(args: &DiffArgs, a: &Image, b: &Image) -> Result<Vec<String>> {
    for name in &args.layer {
        for (path, image) in [(&args.picture, a), (&args.reference, b)] {
            if image.layer(name).is_none() {
                let (path, has) = (path.display(), image.layer_names());
                return Err(Error::Usage(format!("{path} has no layer '{name}'; it has {has}")));
            }
        }
    }
    if !args.layer.is_empty() {
        return Ok(args.layer.clone());
    }
    let both: Vec<String> =
        a.layers.iter().map(|(name, _)| name.clone()).filter(|name| b.layer(name).is_some()).collect();
    if both.is_empty() {
        let (reference, ours, theirs) = (args.reference.display(), a.layer_names(), b.layer_names());
        let reason = format!("no layer in common with {reference}: here {ours}, there {theirs}");
        return Err(Error::Image { path: args.picture.clone(), reason });
    }
    Ok(both)
}

/// The pixels to leave out, and the mask in words.
fn mask(args: &DiffArgs, a: &Image, b: &Image) -> Result<(Vec<bool>, Option<String>)> {
    let mut mask = vec![false; a.width as usize * a.height as usize];
    let mut words = Vec::new();
    let mut add = |plane: &[Vec3], limit: f32| {
        for (out, bright) in mask.iter_mut().zip(brighter_than(plane, limit)) {
            *out |= bright;
        }
    };
    let missing = |image: &Path, layer: &str, option: &str| Error::Image {
        path: image.into(),
        reason: format!("{option} needs its layer '{layer}', which it does not have"),
    };
    if let Some(limit) = args.mask_above {
        let visible = Layer::Visible.name();
        add(b.layer(visible).ok_or_else(|| missing(&args.reference, visible, "--mask-above"))?, limit);
        words.push(format!("reference above {limit}"));
    }
    if args.mask_emitted {
        let emitted = Layer::Emitted.name();
        let plane = b.layer(emitted).or_else(|| a.layer(emitted));
        add(plane.ok_or_else(|| missing(&args.reference, emitted, "--mask-emitted"))?, 0.0);
        words.push("luminaire seen".into());
    }
    if words.is_empty() {
        return Ok((mask, None));
    }
    let mut words = words.join(" or ");
    if args.dilate > 0 {
        mask = dilated(&mask, a.width, args.dilate);
        words += &format!(", grown by {} pixels", args.dilate);
    }
    Ok((mask, Some(words)))
}

fn layer_report(name: &str, a: &Image, b: &Image, left_out: &[bool], wants_hdr: bool) -> LayerReport {
    let (x, r) = (plane(a, name), plane(b, name));
    let metrics = compare(&x, &r, Some(left_out));
    let mean = |map: Vec<f32>| {
        let counts = |i: usize| !left_out[i] && x[i].is_finite() && r[i].is_finite();
        let sum: f64 = map.iter().enumerate().filter(|(i, _)| counts(*i)).map(|(_, e)| f64::from(*e)).sum();
        sum / metrics.compared.max(1) as f64
    };
    let shown = is_picture(name);
    LayerReport {
        layer: name.into(),
        metrics,
        flip: shown.then(|| mean(flip(a.width, a.height, &x, &r, Some(left_out)))),
        hdr_flip: (shown && wants_hdr).then(|| mean(hdr_flip(a.width, a.height, &x, &r, Some(left_out)))),
    }
}

/// A layer's values; a depth is one number, which counts as three equal ones rather than one and two zeros.
fn plane(image: &Image, name: &str) -> Vec<Vec3> {
    let values = image.layer(name).unwrap_or_default();
    let depth = last(name) == Layer::Depth.name();
    values.iter().map(|v| if depth { Vec3::splat(v.x) } else { *v }).collect()
}

fn is_picture(name: &str) -> bool {
    !["depth", "normal", "vector", "error"].contains(&last(name))
}

fn last(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

fn picture_kind(path: &Path) -> Result<&'static str> {
    match ending(path).as_str() {
        "exr" => Ok("exr"),
        "png" => Ok("png"),
        _ => Err(Error::Usage(format!("{}: an error picture is .exr or .png", path.display()))),
    }
}

fn write_error_picture(path: &Path, name: &str, a: &Image, b: &Image, left_out: &[bool]) -> Result<()> {
    let (x, r) = (plane(a, name), plane(b, name));
    let signed = signed_relative_error(&x, &r, left_out);
    if picture_kind(path)? == "png" {
        return write_bytes_png(path, a.width, a.height, &heat_map(&signed, left_out));
    }
    let difference = x.iter().zip(&r).map(|(x, r)| *x - *r).collect();
    let layers = vec![(Layer::Visible.name().into(), signed), ("difference".into(), difference)];
    let header = Header::new().with("content", format!("relative error of layer {name}"));
    write_image_exr(path, &Image { width: a.width, height: a.height, layers, header })
}

/// One `--fail-above`.
struct Limit {
    metric: &'static str,
    above: f64,
}

const METRICS: [&str; 10] = [
    "rmse",
    "relmse",
    "bias",
    "relative-bias",
    "e-pixel",
    "e-pixel-max",
    "mean-colour",
    "flip",
    "hdr-flip",
    "not-finite",
];

impl Limit {
    fn parse(text: &str) -> Result<Self> {
        let wrong = |why: String| Error::Usage(format!("--fail-above {text}: {why}"));
        let (name, above) =
            text.split_once('=').ok_or_else(|| wrong("write METRIC=X, for example relmse=0.01".into()))?;
        let metric = METRICS.into_iter().find(|metric| *metric == name).ok_or_else(|| {
            wrong(format!("there is no metric '{name}'; the metrics are {}", METRICS.join(", ")))
        })?;
        match above.parse::<f64>() {
            Ok(above) if above >= 0.0 => Ok(Self { metric, above }),
            _ => Err(wrong(format!("'{above}' is not a number from 0 up"))),
        }
    }

    /// The figure this limits; None where the layer does not have it.
    fn figure(&self, layer: &LayerReport) -> Option<f64> {
        let m = &layer.metrics;
        match self.metric {
            "rmse" => Some(m.rmse),
            "relmse" => Some(m.relmse),
            "bias" => Some(m.bias.abs()),
            // Against a black reference any bias is beyond all bounds.
            "relative-bias" => {
                Some(m.relative_bias.map_or(if m.bias == 0.0 { 0.0 } else { f64::INFINITY }, f64::abs))
            }
            "e-pixel" => Some(m.e_pixel),
            "e-pixel-max" => Some(m.e_pixel_max),
            "mean-colour" => Some(m.mean_colour),
            "flip" => layer.flip,
            "hdr-flip" => layer.hdr_flip,
            _ => Some(m.not_finite as f64),
        }
    }
}

fn exceeded(limits: &[Limit], layers: &[&LayerReport]) -> Result<Vec<String>> {
    let mut lines = Vec::new();
    for layer in layers {
        let (name, apart) = (&layer.layer, layer.metrics.not_finite_apart);
        for limit in limits {
            let metric = limit.metric;
            let figure = limit.figure(layer).ok_or_else(|| {
                Error::Usage(format!("layer {name} is no picture and has no {metric}; give another --layer"))
            })?;
            if figure > limit.above {
                lines.push(format!("{name}: {metric} {} is above {}", number(figure), limit.above));
            }
        }
        if apart > 0 && !limits.is_empty() {
            lines.push(format!("{name}: pixels not finite and not the same in both: {apart}"));
        }
    }
    Ok(lines)
}
