//! The picture that others are measured against, with what is known about its own error.
//!
//! A reference is a long render by one method, with a seed of its own. Its noise is the spread of its passes; what that
//! adds to errors measured against it is known in the mean, and is subtracted. Where photons make the reference, the finite
//! radius adds a bias. In every fourth pass the same photons are also gathered with twice the radius, and the mean
//! difference D bounds the bias: a bias that grows at least in proportion to the radius is no larger than what doubling the
//! radius adds to it.

use crate::error::{Error, Result};
use crate::film::{Image, Layer, Value, read_exr};
use crate::measure::Metrics;
use crate::plan::Method;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::path::Path;

/// Layers beside those of a render: the mean difference D that doubling the radius makes, and its standard error.
pub(super) const WIDE: &str = "radius_doubled";
pub(super) const WIDE_ERROR: &str = "radius_doubled_error";

/// A picture to measure against.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The visible layer.
    pub visible: Vec<Vec3>,
    /// Its standard error.
    pub error: Vec<Vec3>,
    /// What luminaires send straight into the camera, where known.
    pub emitted: Option<Vec<Vec3>>,
    /// D and its standard error, where photons made the reference here.
    pub doubled: Option<(Vec<Vec3>, Vec<Vec3>)>,
    /// Who made it, as far as known.
    pub method: String,
    /// Passes in it, as far as known.
    pub passes: u32,
    /// Seconds that rendering took, as far as known.
    pub seconds: f64,
    /// Hash of its scene, as far as known.
    pub scene_hash: Option<String>,
}

/// The reference's own error as relMSE, in the pixels that count.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct OwnError {
    /// Mean over pixels and channels of its squared standard error / (r² + 0.01²), with no r above the median of its
    /// neighbours.
    pub noise: f64,
    /// The same of D², less the noise of D itself: an upper bound of the squared bias. None where nothing is known of it;
    /// 0 where there is none.
    pub bias: Option<f64>,
    /// What may be left of both in an error that is measured [less the noise](NoiseShare): the bias, and a twentieth of the
    /// noise (and 2/N of it after N passes).
    pub total: f64,
}

/// The share of the reference's noise that is taken to be left when it is subtracted: one twentieth and, because the spread of N
/// passes is itself known to √(2/N) in each pixel, 2/N. Rare bright samples that have not come yet make errors seem larger
/// than they are, whoever made them.
fn noise_left(passes: u32) -> f64 {
    0.05 + 2.0 / f64::from(passes.max(1))
}

/// What the noise of the reference adds to errors measured against it, in the mean.
///
/// Runs and reference have seeds of their own, so E (x−r)² = (x−E r)² + Var r: the error against the reference
/// without its noise is what is measured less the variance of its mean, which the spread of its passes tells.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct NoiseShare {
    /// Of relMSE.
    pub relmse: f64,
    /// Of the mean square of x−r.
    pub mse: f64,
}

impl NoiseShare {
    /// Figures against the reference without its noise. Not below zero: an error that small drowns in the noise.
    pub fn taken_off(&self, metrics: Metrics) -> Metrics {
        Metrics {
            relmse: (metrics.relmse - self.relmse).max(0.0),
            rmse: (metrics.rmse * metrics.rmse - self.mse).max(0.0).sqrt(),
            ..metrics
        }
    }
}

impl OwnError {
    /// What `total` of a reference by `method` will be after `factor` times the time. The noise of paths falls as 1/time, that
    /// of photons as its power of -2/3 (Knaus & Zwicker 2011, α = 2/3). Their bias is greatest in strips as wide as
    /// the radius, along edges of surfaces and shadows, where it does not fall: in the mean it falls as the radius.
    pub fn after(&self, method: Method, factor: f64) -> f64 {
        let noise = noise_left(u32::MAX) * self.noise;
        if method == Method::Photon {
            noise * factor.powf(-2.0 / 3.0) + self.bias.unwrap_or(0.0) * factor.powf(-1.0 / 6.0)
        } else {
            noise / factor
        }
    }
}

impl Reference {
    /// Reads a reference from a file.
    ///
    /// # Errors
    /// One without its own error: a picture of unknown error proves nothing.
    pub fn read(path: &Path) -> Result<Self> {
        Self::of(&read_exr(path)?).map_err(|reason| Error::Image { path: path.into(), reason })
    }

    /// The reference that a picture is.
    ///
    /// # Errors
    /// A picture without its own error; in words.
    pub fn of(image: &Image) -> std::result::Result<Self, String> {
        let take = |name: &str| image.layer(name).map(<[Vec3]>::to_vec);
        let missing = |name: &str| {
            format!(
                "no layer `{name}`, so its own error is not known; render it with --layers visible,error,emitted"
            )
        };
        let fact = |name: &str| image.header.get(name);
        Ok(Self {
            width: image.width,
            height: image.height,
            visible: take(Layer::Visible.name()).ok_or_else(|| missing("visible"))?,
            error: take(Layer::Error.name()).ok_or_else(|| missing("error"))?,
            emitted: take(Layer::Emitted.name()),
            doubled: take(WIDE).zip(take(WIDE_ERROR)),
            method: fact("method").map_or("unknown".into(), ToString::to_string),
            passes: fact("passes").and_then(Value::as_integer).and_then(|n| n.try_into().ok()).unwrap_or(0),
            seconds: fact("seconds").and_then(Value::as_real).unwrap_or(0.0),
            scene_hash: fact("scene_hash").map(ToString::to_string),
        })
    }

    /// Its own error over the pixels that are not `left_out`.
    pub fn own_error(&self, left_out: &[bool]) -> OwnError {
        let calm = self.calm();
        let square = |plane: &[Vec3]| relative_square(plane, &calm, left_out);
        let noise = square(&self.error);
        let bias = match &self.doubled {
            Some((d, error)) => Some((square(d) - square(error)).max(0.0)),
            None if self.method.starts_with("path") => Some(0.0),
            None => None,
        };
        let total = noise_left(self.passes) * noise + bias.unwrap_or(0.0);
        OwnError { noise, bias, total }
    }

    /// What its noise adds to the figures of [`compare`](crate::measure::compare), which has the same weights.
    pub fn noise_share(&self, left_out: &[bool]) -> NoiseShare {
        let counted = self.error.iter().zip(left_out).filter(|(_, out)| !**out).map(|(error, _)| error);
        let (sum, count) = counted
            .fold((0.0, 0.0), |(sum, count), error| (sum + error.as_dvec3().length_squared(), count + 3.0));
        NoiseShare {
            relmse: relative_square(&self.error, &self.visible, left_out),
            mse: sum / f64::max(count, 1.0),
        }
    }

    /// The picture with each channel no greater than the median of its 3×3 neighbourhood: a pixel that one rare bright
    /// sample has spoiled has a large error and is itself as large, and would otherwise count as one of 100 % at the most,
    /// where it is thousands.
    fn calm(&self) -> Vec<Vec3> {
        let (width, height) = (self.width as usize, self.height as usize);
        let near = |i: usize, end: usize| i.saturating_sub(1)..=(i + 1).min(end - 1);
        let median = |x: usize, y: usize, channel: usize| {
            let around = near(y, height).flat_map(|y| near(x, width).map(move |x| y * width + x));
            let mut values: Vec<f32> = around.map(|i| self.visible[i][channel]).collect();
            values.sort_by(f32::total_cmp);
            values[values.len() / 2]
        };
        let pixel = |i: usize| {
            let (x, y) = (i % width, i / width);
            Vec3::from_array([0, 1, 2].map(|channel| median(x, y, channel))).min(self.visible[i])
        };
        (0..self.visible.len()).into_par_iter().map(pixel).collect()
    }
}

/// Mean over pixels that are not `left_out` and channels of v²/(r² + 0.01²), as relMSE.
fn relative_square(plane: &[Vec3], against: &[Vec3], left_out: &[bool]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for ((v, r), _) in plane.iter().zip(against).zip(left_out).filter(|(_, out)| !**out) {
        let (v, r) = (v.as_dvec3(), r.as_dvec3());
        sum += (v * v / (r * r + DVec3::splat(1e-4))).element_sum();
        count += 3;
    }
    sum / count.max(1) as f64
}

#[cfg(test)]
#[path = "reference_tests.rs"]
mod tests;
