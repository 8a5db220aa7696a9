//! One pass: shoot photons, build the maps, gather. [`render_pass`] is a function of (plan, frame, pass).
//!
//! The kernels are generic over what photons carry (one half of light or both) and how many pictures the camera makes (one
//! or two); which of them serve is decided once, outside all loops.

use crate::film::{Asides, Layer, PassImage};
use crate::gather::{Gathered, Maps, NearestMaps, Parts, Pixel, gather};
use crate::light::{Invisible, Light, Power};
use crate::path_trace::{PathSettings, Rows, Strength, trace_pass_until};
use crate::plan::{Frame, Method, Plan, Settings};
use crate::shoot::shoot;
use glam::Vec3;

/// One pass on its own: its planes, and how many photons it stored. A function of (plan, frame, pass), whatever the threads.
pub fn render_pass(plan: &Plan, frame: &Frame, pass: u32, planes: &[Layer]) -> (PassImage, u64) {
    match plan.settings.method {
        Method::Photon | Method::Nearest => {}
        Method::Path => return (path_pass(plan, frame, Strength::NextEvent, pass, planes), 0),
        Method::PathPlain => return (path_pass(plan, frame, Strength::Plain, pass, planes), 0),
    }
    match Kernel::of(plan, frame) {
        Kernel { both_halves: false, invisible: false } => {
            pass_with::<Invisible, 1>(plan, frame, pass, planes)
        }
        Kernel { both_halves: false, invisible: true } => {
            pass_with::<Invisible, 2>(plan, frame, pass, planes)
        }
        Kernel { both_halves: true, invisible: false } => pass_with::<Light, 1>(plan, frame, pass, planes),
        Kernel { both_halves: true, invisible: true } => pass_with::<Light, 2>(plan, frame, pass, planes),
    }
}

/// Which kernels serve.
pub(crate) struct Kernel {
    /// Photons carry both halves of light.
    pub both_halves: bool,
    /// The invisible picture is made too.
    pub invisible: bool,
}

impl Kernel {
    pub fn of(plan: &Plan, frame: &Frame) -> Self {
        let both_halves = frame.photons.as_ref().is_some_and(|photons| photons.both_halves);
        Self { both_halves, invisible: plan.settings.invisible }
    }
}

/// Shoots, builds the maps and gathers, with the gather radii of pass `radii`: what is seen, and how many photons were stored.
pub(crate) fn look<P: Power, const R: usize>(
    plan: &Plan,
    frame: &Frame,
    pass: u32,
    radii: u32,
) -> (Gathered<R>, u64) {
    let photons = shoot::<P>(plan, frame, pass);
    let stored = photons.count() as u64;
    let maps = Maps::build(photons, plan, frame, radii);
    (gather::<_, R>(plan, frame, &maps, pass), stored)
}

/// The same by the maps of the textbook.
fn look_nearest<P: Power, const R: usize>(plan: &Plan, frame: &Frame, pass: u32) -> (Gathered<R>, u64) {
    let photons = shoot::<P>(plan, frame, pass);
    let stored = photons.count() as u64;
    let maps = NearestMaps::build(photons, &plan.settings);
    (gather::<_, R>(plan, frame, &maps, pass), stored)
}

fn pass_with<P: Power, const R: usize>(
    plan: &Plan,
    frame: &Frame,
    pass: u32,
    planes: &[Layer],
) -> (PassImage, u64) {
    let (gathered, stored) = match plan.settings.method {
        Method::Nearest => look_nearest::<P, R>(plan, frame, pass),
        _ => look::<P, R>(plan, frame, pass, pass),
    };
    (pass_image(frame, &gathered, planes), stored)
}

/// The planes of a picture.
pub(crate) fn pass_image<const R: usize>(
    frame: &Frame,
    gathered: &Gathered<R>,
    planes: &[Layer],
) -> PassImage {
    let planes = planes.iter().map(|&layer| (layer, plane(gathered, layer))).collect();
    let each = |value: fn(&Pixel<R>) -> f32| Some(gathered.pixels.iter().map(value).collect());
    let asides = Asides {
        one_more: each(|pixel| pixel.one_more),
        scattered: each(|pixel| (pixel.parts[0].total() - pixel.parts[0].emitted).as_dvec3().length() as f32),
    };
    PassImage { width: frame.width, height: frame.height, planes, asides }
}

fn path_pass(plan: &Plan, frame: &Frame, strength: Strength, pass: u32, planes: &[Layer]) -> PassImage {
    let Settings { seed, invisible, max_reflections, .. } = plan.settings;
    let Frame { width, height, samples, .. } = *frame;
    let rows = if invisible { Rows::VisibleAndInvisible } else { Rows::Visible };
    let settings =
        PathSettings { width, height, samples_per_pixel: samples, seed, strength, rows, max_reflections };
    let picture = trace_pass_until(&plan.scene, &plan.rays, &settings, pass, &frame.stop);
    let plane = |layer: Layer| match layer {
        Layer::Visible => picture.visible.clone(),
        Layer::Invisible => picture.invisible.clone().expect("traced when it is among the layers"),
        Layer::Emitted => picture.emitted.clone(),
        _ => unreachable!("layers were checked"),
    };
    let planes = planes.iter().map(|&layer| (layer, plane(layer))).collect();
    let scattered = |(all, emitted): (&Vec3, &Vec3)| (*all - *emitted).as_dvec3().length() as f32;
    let scattered = picture.visible.iter().zip(&picture.emitted).map(scattered).collect();
    PassImage { width, height, planes, asides: Asides { one_more: None, scattered: Some(scattered) } }
}

fn plane<const R: usize>(gathered: &Gathered<R>, layer: Layer) -> Vec<Vec3> {
    let each = |value: fn(&Pixel<R>) -> Vec3| gathered.pixels.iter().map(value).collect();
    match layer {
        Layer::Visible => each(|pixel| pixel.parts[0].total()),
        Layer::Invisible => each(|pixel| pixel.parts.get(1).map_or(Vec3::ZERO, Parts::total)),
        Layer::Emitted => each(|pixel| pixel.parts[0].emitted),
        Layer::Direct => each(|pixel| pixel.parts[0].direct),
        Layer::Caustic => each(|pixel| pixel.parts[0].caustic),
        Layer::Indirect => each(|pixel| pixel.parts[0].indirect),
        Layer::Fluorescent => each(|pixel| pixel.parts[0].fluorescent),
        Layer::Depth => each(|pixel| Vec3::new(pixel.depth, 0.0, 0.0)),
        Layer::Normal => each(|pixel| pixel.normal),
        Layer::Albedo => each(|pixel| pixel.albedo),
        Layer::DenoisingNormal => each(|pixel| pixel.features.normal()),
        Layer::DenoisingAlbedo => each(|pixel| pixel.features.albedo),
        Layer::Bias => each(|pixel| pixel.bias),
        Layer::Error => unreachable!("the error is derived from the passes"),
    }
}
