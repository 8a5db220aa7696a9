//! Trial connections that find out what is seen from where.

use crate::connect::{Sights, Trial};
use crate::plan::{Direct, Frame, Method, Plan};
use crate::sampling::{Sobol, hash};
use crate::shoot::{Place, seen_places};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Camera paths that find out whether connections see what they lead to, and that learn what they see; their numbers follow those
/// of paths that learn where photons should start.
const LOOKS: Range<u32> = 1 << 24..(1 << 24) + (1 << 12);
const LESSONS: Range<u32> = 1 << 25..(1 << 25) + (1 << 15);
/// Trials from each place where a path reads light.
const TRIALS: u32 = 8;
/// Where more than this share of what luminaires send arrives, connections are left as they are, unless squares of what they bring
/// would fall by such a factor.
const SEEN: f32 = 0.4;
const WORTH: f64 = 2.0;

/// What connections should know. None: they would be little better for it.
pub fn learn_sights(plan: &Plan, frame: &Frame) -> Option<Arc<Sights>> {
    let connects = plan.settings.method == Method::Photon && frame.direct == Direct::Connection;
    let asked =
        connects && plan.connections.are_sampled() && !plan.settings.atlas && !plan.settings.even_starts;
    let (even, sky) = plan.connections.choice(&plan.scene);
    if !asked || (even.len() < 2 && sky.is_none()) {
        return None;
    }
    let looked = trials(plan, frame, LOOKS);
    let sum = |weight: fn(&Tried) -> f32| looked.iter().map(weight).sum::<f32>();
    let (seen, sent) = (sum(|tried| tried.trial.weight), sum(|tried| tried.unhidden));
    let looked: Vec<Trial> = looked.into_iter().map(|tried| tried.trial).collect();
    if sent == 0.0 || (seen > SEEN * sent && gain(&looked, &even, sky) < WORTH) {
        return None;
    }
    let trials: Vec<Trial> = trials(plan, frame, LESSONS).into_iter().map(|tried| tried.trial).collect();
    Sights::new(&trials, &even, sky).map(Arc::new)
}

/// By what factor squares of what connections bring fall, if what half of the trials teach is asked for the others.
fn gain(trials: &[Trial], even: &[f32], sky: Option<u32>) -> f64 {
    let (lessons, exam) = trials.split_at(trials.len() / 2);
    let Some(sights) = Sights::new(lessons, even, sky) else { return 1.0 };
    let (before, after) = exam.iter().fold((0.0, 0.0), |(before, after), trial| {
        let square = f64::from(trial.weight).powi(2);
        (before + square, after + square / f64::from(sights.density(trial, even, sky)))
    });
    if after > 0.0 { before / after } else { 1.0 }
}

/// What a trial brought, and what it would have brought had nothing been in its way.
struct Tried {
    trial: Trial,
    unhidden: f32,
}

fn trials(plan: &Plan, frame: &Frame, paths: Range<u32>) -> Vec<Tried> {
    let sobol = Sobol::new(hash(plan.settings.seed ^ u64::from(paths.start)));
    let places = seen_places(plan, frame, paths);
    let numbers = |i: usize| (0..TRIALS).map(move |k| i as u32 * TRIALS + k);
    let each = places.par_iter().enumerate().map(|(i, place)| {
        numbers(i).filter_map(|number| tried(plan, place, sobol.point(number, 0))).collect::<Vec<_>>()
    });
    each.collect::<Vec<_>>().into_iter().flatten().collect()
}

fn tried(plan: &Plan, place: &Place<'_>, u: [f32; 3]) -> Option<Tried> {
    let Place { met, wo, row } = place;
    let point = &met.point;
    let (chosen, connection) = plan.connections.try_one(&plan.scene, point, u)?;
    let cos = connection.wi.dot(point.normals.shading).abs();
    let (through, left) = plan.visibility_along(&connection.segment, Vec3::ZERO);
    let mut sums = [0.0; 2];
    for term in met.bsdf.terms.iter().filter(|term| !term.lobe.is_delta()) {
        let lobe = plan.rays.lobe_at(term.lobe, point);
        let f = cos * lobe.eval(&point.normals, *wo, connection.wi);
        let row = term.before(*row);
        sums[0] += (row * ((f * left) * (through * connection.light))).element_sum();
        sums[1] += (row * (f * connection.light)).element_sum();
    }
    let trial = Trial { position: point.position, chosen, place: [u[1], u[2]], weight: sums[0] };
    (sums[1] > 0.0).then_some(Tried { trial, unhidden: sums[1] })
}
