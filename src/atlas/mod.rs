//! The atlas: every picture of the illumination square from one run.
//!
//! Light that was reflected n times in the invisible half and went straight on m times before its last reflection has
//! weight sⁿ tᵐ. One run over the scene at (1, 1), where nothing is lost, with light kept apart by (n, m), therefore holds
//! the picture of every point of the square: `L(s, t) = Σ sⁿ tᵐ L[n][m]`.
//!
//! ```
//! # fn main() -> halflight::error::Result<()> {
//! use halflight::film::Layer;
//! use halflight::plan::Settings;
//! use halflight::render::Render;
//! use halflight::scene::Scene;
//!
//! let scene = Scene::load("builtin:cornell-spheres")?;
//! let settings = Settings { width: 16, height: 16, paths: Some(2_000), atlas: true, ..Settings::default() };
//! let mut render = Render::new(scene, settings, &[Layer::Visible])?;
//! (0..4).for_each(|_| render.pass());
//! let atlas = render.atlas().expect("asked for");
//! let half_way = atlas.mix(0.5, 0.25)?;
//! assert_eq!(half_way.visible.len(), 16 * 16);
//! # Ok(())
//! # }
//! ```
//!
//! Only matrices that follow the scene's point count: a material with an illumination or matrices of its own stays as it
//! is in every picture. [`Nodes`] says which powers are stored and how the others are shared out among them.

mod by_order;
mod errors;
mod file;
mod frontier;
mod nodes;
mod places;
mod run;
mod state;
mod sums;
mod tally;

pub use errors::{GRID, POINTS};
pub use frontier::{Frontier, REACH, Sample};
pub use nodes::Nodes;
pub use places::MostOrders;
pub use run::{AtlasRun, check, forecast, plan};
pub use sums::AtlasSums;

use crate::error::{Error, Result};
use crate::measure::Estimate;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Pixels that are mixed at once: their sums stay in the nearest cache while planes stream by.
const AT_ONCE: usize = 1 << 11;

/// Every picture of the square.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Passes behind it.
    pub passes: u32,
    /// Groups of them, each of which is one sample of the error bar.
    pub groups: u32,
    /// The powers of s that are stored.
    pub n: Nodes,
    /// The powers of t that are stored; more crossings than the last count as so many.
    pub m: Nodes,
    /// True: light with more reflections than the last power of s is left out. False: it counts as if it had so many.
    pub cut: bool,
    /// Where images exist.
    pub frontier: Frontier,
    /// Mean radiance of each pair of stored powers, at `n * m.len() + m` by index, row-major from top left. Empty
    /// where there is no light.
    pub planes: Vec<Vec<Vec3>>,
    /// The error bar. None below two groups.
    pub errors: Option<AtlasErrors>,
}

/// Standard errors of the mean at the points of [`GRID`], t by t.
#[derive(Clone, Debug, PartialEq)]
pub struct AtlasErrors {
    /// Of each pixel.
    pub planes: Vec<Vec<Vec3>>,
    /// Of the average colour.
    pub colour: [DVec3; POINTS],
}

/// One picture of the square.
#[derive(Clone, Debug, PartialEq)]
pub struct Mixed {
    /// Linear RGB radiance, row-major from top left.
    pub visible: Vec<Vec3>,
    /// Its standard error; infinite where there was one pass only.
    pub error: Vec<Vec3>,
    /// The standard error of its average colour.
    pub colour_error: Option<DVec3>,
    /// About which share of the whole light the atlas leaves out here: zero where it was not cut.
    pub left_out: f64,
}

impl Atlas {
    /// The picture at (s, t).
    ///
    /// # Errors
    /// A point outside the square; a point that has no image.
    pub fn mix(&self, s: f64, t: f64) -> Result<Mixed> {
        self.check_point(s, t)?;
        let visible = self.sum(&self.planes, self.weights(s, t).into_iter().enumerate());
        let around = errors::around(&self.frontier, s, t);
        let error = self
            .errors
            .as_ref()
            .map_or_else(|| vec![Vec3::INFINITY; self.pixels()], |errors| self.sum(&errors.planes, around));
        let colour_error = self
            .errors
            .as_ref()
            .map(|errors| around.iter().map(|(point, weight)| *weight * errors.colour[*point]).sum());
        Ok(Mixed { visible, error, colour_error, left_out: self.left_out(s, t) })
    }

    /// sⁿ tᵐ of each of [`planes`](Self::planes).
    pub fn weights(&self, s: f64, t: f64) -> Vec<f64> {
        let across = self.m.weights(t);
        self.n.weights(s).into_iter().flat_map(|a| across.iter().map(move |b| a * b)).collect()
    }

    /// Refuses points outside the square, and points that have no image.
    ///
    /// # Errors
    /// Those.
    pub fn check_point(&self, s: f64, t: f64) -> Result<()> {
        if !((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)) {
            return Err(Error::Usage(format!(
                "--at {s},{t}: outside the square; both numbers go from 0 to 1"
            )));
        }
        let k = s * self.frontier.kappa(t);
        self.frontier.refusal(s, t).map_or(Ok(()), |reason| Err(Error::NoImage { reason, k }))
    }

    /// About which share of the light at (s, t) has more than the N reflections that the atlas holds: r^(N+1), where r = s κ(t)
    /// is the factor from one reflection to the next, as if light multiplied by it from the first on.
    pub fn left_out(&self, s: f64, t: f64) -> f64 {
        if self.cut { (s * self.frontier.kappa(t)).powi(i32::from(self.n.last()) + 1) } else { 0.0 }
    }

    /// A mixed picture with what [`agreement`](crate::measure::agreement) needs. None below two passes.
    pub fn estimate(&self, mixed: Mixed) -> Option<Estimate> {
        let n = mixed.visible.len().max(1) as f64;
        let colour = mixed.visible.iter().map(|v| v.as_dvec3()).sum::<DVec3>() / n;
        Some(Estimate {
            mean: mixed.visible,
            standard_error: mixed.error,
            passes: Some(self.groups),
            colour: Some((colour, mixed.colour_error?)),
        })
    }

    /// Σ weight · plane over planes by their index, in that order; empty planes are dark.
    fn sum(&self, planes: &[Vec<Vec3>], weights: impl IntoIterator<Item = (usize, f64)>) -> Vec<Vec3> {
        let parts: Vec<(&[Vec3], f32)> = weights
            .into_iter()
            .map(|(index, weight)| (planes[index].as_slice(), weight as f32))
            .filter(|(plane, weight)| !plane.is_empty() && *weight != 0.0)
            .collect();
        let mut sum = vec![Vec3::ZERO; self.pixels()];
        sum.par_chunks_mut(AT_ONCE).enumerate().for_each(|(chunk, sum)| {
            for (plane, weight) in &parts {
                let plane = &plane[chunk * AT_ONCE..][..sum.len()];
                sum.iter_mut().zip(plane).for_each(|(sum, value)| *sum += *weight * *value);
            }
        });
        sum
    }

    fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}
