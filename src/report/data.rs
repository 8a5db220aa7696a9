//! The results of a comparison, as files hold them. `method` is the name of what ran: a method, or a variant of the command.

use crate::compare::OwnError;
use crate::measure::Metrics;
use glam::Vec3;
use serde::Serialize;

/// Methods or variants × budgets × seeds on some scenes.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
#[cfg_attr(test, serde(bound(deserialize = "'de: 'static")))]
pub struct Comparison {
    /// Name and version.
    pub program: String,
    /// The command that made it.
    pub command: String,
    /// Threads that rendered.
    pub threads: usize,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// In the order of the command.
    pub methods: Vec<String>,
    /// One run of each method for each.
    pub seeds: Vec<u64>,
    /// Seconds.
    pub budgets: Vec<f64>,
    /// How the figures are defined.
    pub definitions: Vec<&'static str>,
    /// In the order of the command.
    pub scenes: Vec<SceneReport>,
}

/// One scene in one light.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
#[cfg_attr(test, serde(bound(deserialize = "'de: 'static")))]
pub struct SceneReport {
    /// File name or `builtin:…`.
    pub scene: String,
    /// Of everything that decides the picture.
    pub scene_hash: String,
    /// In words.
    pub illumination: String,
    /// What was measured against.
    pub reference: ReferenceFacts,
    /// What was left out.
    pub mask: MaskFacts,
    /// One curve for each method.
    pub curves: Vec<Curve>,
    /// One method against each other.
    pub pairs: Vec<Pair>,
    /// Every run at every budget, raw.
    pub runs: Vec<Row>,
    /// What the page shows: the reference, then one picture for each method.
    #[serde(skip)]
    pub pictures: Vec<Shown>,
    /// Pixels left out.
    #[serde(skip)]
    pub left_out: Vec<bool>,
}

/// A picture of the page.
#[derive(Clone, Debug)]
pub struct Shown {
    /// `reference` or a method.
    pub name: String,
    /// One line below it.
    pub caption: String,
    /// Linear RGB.
    pub picture: Vec<Vec3>,
}

/// The reference and its own error.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct ReferenceFacts {
    /// Its file.
    pub file: String,
    /// Where it came from and why, one line.
    pub origin: String,
    /// Who made it.
    pub method: String,
    /// Passes in it.
    pub passes: u32,
    /// Seconds of rendering in it.
    pub seconds: f64,
    /// As relMSE, in the pixels that count.
    pub own_error: OwnError,
    /// What its noise has added to every relMSE measured, and was taken off.
    pub noise_taken_off: f64,
    /// The smallest median error measured over the total of its own.
    pub margin: f64,
    /// Rows (method and budget) whose error is less than ten times the reference's own.
    pub too_noisy_for: Vec<String>,
    /// True when more than one row is: then ratios and curves mean nothing and are not made.
    pub refused: bool,
}

/// Pixels that see a luminaire.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct MaskFacts {
    /// Which, in words.
    pub rule: String,
    /// Their share of all pixels.
    pub share: f64,
}

/// One run when it passed one budget.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct Row {
    /// Who transported light.
    pub method: String,
    /// From which all randomness follows.
    pub seed: u64,
    /// Seconds asked for.
    pub budget: f64,
    /// Seconds used.
    pub seconds: f64,
    /// Those of them for loading and planning.
    pub setup_seconds: f64,
    /// Passes in the picture.
    pub passes: u32,
    /// Photon paths in the picture.
    pub photon_paths: u64,
    /// Camera samples in the picture: photons have one a pixel and pass; what edges are given beyond is not counted.
    pub camera_samples: u64,
    /// relMSE against the reference as it is, noise and all.
    pub relmse_measured: f64,
    /// Error figures; relMSE and RMSE less what the reference's noise adds.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Mean FLIP.
    pub flip: f64,
    /// Less than ten times the reference's own error (the median over seeds is).
    pub reference_too_noisy: bool,
}

/// A figure with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct Interval {
    /// The figure.
    pub value: f64,
    /// 2.5 % quantile of the bootstrap over seeds.
    pub low: f64,
    /// 97.5 % quantile.
    pub high: f64,
}

/// relMSE of one method over time.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct Curve {
    /// Who transported light.
    pub method: String,
    /// Median over seeds.
    pub setup_seconds: f64,
    /// One for each budget.
    pub points: Vec<Point>,
    /// Slope of log relMSE over log rendering time; None below two different times.
    pub slope: Option<Interval>,
}

/// Median and 80 % band over seeds.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct Point {
    /// Seconds asked for.
    pub budget: f64,
    /// Median of the seconds used.
    pub seconds: f64,
    /// Median of the passes.
    pub passes: f64,
    /// Median.
    pub relmse: f64,
    /// 10 % quantile of relMSE.
    pub low: f64,
    /// 90 % quantile of relMSE.
    pub high: f64,
    /// Median.
    pub flip: f64,
    /// Median of the bias relative to the mean of the reference; None against black.
    pub relative_bias: Option<f64>,
    /// Less than ten times the reference's own error.
    pub reference_too_noisy: bool,
}

/// Method `a` against method `b`; above 1, `a` is ahead.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct Pair {
    /// The first.
    pub a: String,
    /// The other.
    pub b: String,
    /// The latest time that both have reached, in seconds.
    pub seconds: f64,
    /// relMSE of `b` over that of `a` at that time.
    pub error_ratio: Interval,
    /// The smallest relMSE that both have reached.
    pub relmse: f64,
    /// Time of `b` over that of `a` to that error, set-up included.
    pub time_ratio: Interval,
    /// `=`, or a bound where one was below that error at its first budget: `≥` (a was) or `≤` (b was).
    pub time_relation: &'static str,
}

/// What the figures mean, for every output.
pub const DEFINITIONS: [&str; 8] = [
    "seconds: wall time of loading, planning (pilot and ray index), shooting, maps, gathering and adding to the film; \
     writing files and measuring errors are not counted. setup_seconds: the share of loading and planning.",
    "The run that has used the least time renders the next pass, over all methods and seeds; a picture is kept at the \
     end of the pass in which a budget is passed.",
    "relmse: mean over pixels and channels of (x-r)^2 / (r^2 + 0.01^2), less the same of the reference's variance, which is \
     what its noise adds in the mean (relmse_measured has it still). rmse, also less it, and bias: of x-r. e_pixel: root mean square \
     over channels of the difference of displayed values, mean over pixels. mean_colour: largest channel of the \
     difference of displayed mean colours. flip: mean FLIP.",
    "Curves: median over seeds, band from the 10 % to the 90 % quantile (interpolated between seeds).",
    "slope: least squares of log median relMSE over log median rendering time (set-up not in it).",
    "Equal time and equal error: on the curves of medians, log-log between budgets, set-up included, never beyond the \
     last budget.",
    "Intervals: 95 %, percentile bootstrap over seeds (2000 resamples, the seeds of each method drawn on their own).",
    "A reference is too noisy for errors (as relMSE) that are less than ten times what may be left of it: its bias, and a twentieth of \
     its noise plus 2/N of it after N passes. Its noise is \
     the spread of its passes (over r^2 + 0.01^2, with no r above the median of its 3x3 neighbours, so that rare bright \
     samples do not hide behind their own brightness); where photons made it, its bias is bounded by the change that doubling the radius makes. \
     In the time it is given it takes no fewer samples of a pixel than the longest run: what is seen rarely is not in the spread of few.",
];
