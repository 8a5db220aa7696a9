//! The gathering path tracer: the opponent that shooting is measured against. They share no estimator.
//!
//! A walk starts at the camera with the row `[0 1]` (paper eq. 8) and multiplies matrices **from the right**. At each
//! surface along a line the row reads what the surface radiates, a scattered branch may be born with
//! `row * coefficient * lobe`, and the line itself goes on with `row * straight` until the row reads nothing more.
//! [`Strength::Plain`] is the paper's Monte Carlo path tracer with Russian roulette (§3); [`Strength::NextEvent`] adds
//! a connection to a luminaire at every scattering, weighted against the chance of finding it (Veach 1997, §9.2).

mod arrival;
mod luminaires;
mod numbers;
mod population;
mod reads;
#[cfg(test)]
mod tests;
mod walk;

pub use arrival::{Arrival, arriving_power};

use crate::rays::Rays;
use crate::scene::Scene;
use crate::stop::Stop;
use glam::Vec3;
use luminaires::Luminaires;
use numbers::Samples;
use rayon::prelude::*;
use reads::Reads;
use walk::{Looker, Reading, Scratch, Walk};

/// How luminaires are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strength {
    /// By chance only, as in the paper; luminaires without extent are never found ([`unreachable_luminaires`]).
    Plain,
    /// By chance and by connection, combined by multiple importance sampling.
    NextEvent,
}

/// Which rows each pixel reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rows {
    /// `[0 1]`: the picture.
    Visible,
    /// `[0 1]` and `[1 0]`, along the same walks.
    VisibleAndInvisible,
}

/// What to trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Camera samples per pixel and pass, stratified against each other; > 0.
    pub samples_per_pixel: u32,
    /// Seed of the whole render; passes differ by their number.
    pub seed: u64,
    /// How luminaires are found.
    pub strength: Strength,
    /// Which rows are read.
    pub rows: Rows,
    /// Ends walks after so many reflections, the visible one and those of delta lobes included; None: no end.
    pub max_reflections: Option<u32>,
}

/// One pass: a mean over the samples of each pixel, row-major from the top left, linear RGB radiance (W m⁻² sr⁻¹).
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// `[0 1] L`.
    pub visible: Vec<Vec3>,
    /// `[1 0] L`, where asked for.
    pub invisible: Option<Vec<Vec3>>,
    /// The part of `visible` that luminaires sent straight into the camera, without any reflection.
    pub emitted: Vec<Vec3>,
    /// Straight lines that were followed, connections not counted: a measure of work.
    pub lines: u64,
}

/// Traces one pass. Passes are independent; equal arguments give equal bits for any number of threads.
///
/// Pixels are boxes. In matter whose series diverges (k ≥ 1, docs/architecture.md) the pass still ends, but its numbers mean
/// nothing unless `max_reflections` is set.
pub fn trace_pass(scene: &Scene, rays: &Rays, settings: &PathSettings, pass: u32) -> Picture {
    trace_pass_until(scene, rays, settings, pass, &Stop::default())
}

/// The same, unless it is told to stop: then the picture is incomplete.
pub fn trace_pass_until(
    scene: &Scene,
    rays: &Rays,
    settings: &PathSettings,
    pass: u32,
    stop: &Stop,
) -> Picture {
    let luminaires = match settings.strength {
        Strength::Plain => Luminaires::default(),
        Strength::NextEvent => Luminaires::new(scene),
    };
    let view = scene.camera.view(settings.width as f32 / settings.height as f32);
    let walk = Walk::new(scene, rays, &luminaires, settings.max_reflections).through(view, settings.height);
    match settings.rows {
        Rows::Visible => {
            let pixels = trace_pixels(&walk, Reads::visible(), settings, pass, stop);
            picture(&pixels, None)
        }
        Rows::VisibleAndInvisible => {
            let pixels = trace_pixels(&walk, Reads::visible_and_invisible(), settings, pass, stop);
            picture(&pixels, Some(1))
        }
    }
}

/// Indices of luminaires that [`Strength::Plain`] can never find because no line meets them.
pub fn unreachable_luminaires(scene: &Scene) -> Vec<usize> {
    let punctual = scene.luminaires.iter().enumerate().filter(|(_, luminaire)| luminaire.is_delta());
    punctual.map(|(index, _)| index).collect()
}

/// The mean reading of every pixel, in order.
fn trace_pixels<const N: usize>(
    walk: &Walk<'_>,
    start: Reads<N>,
    settings: &PathSettings,
    pass: u32,
    stop: &Stop,
) -> Vec<Reading<N>> {
    let PathSettings { width, height, samples_per_pixel, seed, .. } = *settings;
    let view = walk.scene.camera.view(width as f32 / height as f32);
    let pixel_reading = |scratch: &mut Scratch<N>, pixel: u32| {
        let (column, row) = ((pixel % width) as f32, (pixel / width) as f32);
        let mut sum = Reading::ZERO;
        let samples = Samples::of_pixel(seed, pass, pixel, samples_per_pixel);
        for mut numbers in samples.iter() {
            if stop.asked() {
                break;
            }
            let [dx, dy] = numbers.next();
            let (x, y) = ((column + dx) / width as f32, (row + dy) / height as f32);
            let (origin, direction) =
                if view.has_lens() { view.ray_through(x, y, numbers.next()) } else { view.ray(x, y) };
            sum += walk.gather(Looker::Camera, start, origin, direction, &mut numbers, scratch);
        }
        sum.over(samples_per_pixel)
    };
    // Walks differ in length; runs of 16 pixels balance threads well and cost nothing to hand out.
    let pixels = (0..width * height).into_par_iter().with_min_len(16);
    pixels.map_init(Scratch::default, pixel_reading).collect()
}

fn picture<const N: usize>(pixels: &[Reading<N>], invisible: Option<usize>) -> Picture {
    Picture {
        visible: pixels.iter().map(|pixel| pixel.radiance[0]).collect(),
        invisible: invisible.map(|row| pixels.iter().map(|pixel| pixel.radiance[row]).collect()),
        emitted: pixels.iter().map(|pixel| pixel.emitted[0]).collect(),
        lines: pixels.iter().map(|pixel| pixel.lines).sum(),
    }
}
