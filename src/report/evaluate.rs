//! From runs and a reference to rows, curves and ratios.

use super::data::{Curve, Interval, MaskFacts, Pair, Point, ReferenceFacts, Row, SceneReport, Shown};
use super::stats::{at, bootstrap, log_slope, median, quantile, reached};
use crate::compare::Run;
use crate::compare::{NoiseShare, OwnError, Reference};
use crate::measure::mask::{brighter_than, dilated};
use crate::measure::{compare, flip};
use crate::plan::Method;
use crate::scene::Scene;
use glam::Vec3;
use rayon::prelude::*;

/// How far what may be left of the reference's own relMSE must lie below the errors measured.
pub const MARGIN: f64 = 10.0;

/// Which pixels are left out.
#[derive(Clone, Copy, Debug)]
pub struct MaskRule {
    /// Those where a channel of the reference is above this.
    pub above: f32,
    /// Those and the ones that see a luminaire are grown by so many pixels.
    pub dilate: u32,
}

impl MaskRule {
    /// The pixels that see a luminaire.
    pub fn left_out(&self, reference: &Reference) -> Vec<bool> {
        let mut mask = brighter_than(&reference.visible, self.above);
        if let Some(emitted) = &reference.emitted {
            for (out, sees) in mask.iter_mut().zip(brighter_than(emitted, 0.0)) {
                *out |= sees;
            }
        }
        dilated(&mask, reference.width, self.dilate)
    }

    fn words(&self, reference: &Reference) -> String {
        let sees = if reference.emitted.is_some() { "luminaire seen or " } else { "" };
        format!("{sees}reference above {}, grown by {} pixels", self.above, self.dilate)
    }
}

/// Median relMSE of each variant at each budget, less the reference's noise.
pub fn medians<'a>(runs: &'a [Run], reference: &Reference, left_out: &[bool]) -> Vec<(&'a str, f64, f64)> {
    let noise = reference.noise_share(left_out);
    let relmse =
        |picture: &Vec<Vec3>| noise.taken_off(compare(picture, &reference.visible, Some(left_out))).relmse;
    let errors: Vec<Vec<f64>> = runs
        .par_iter()
        .map(|run| {
            let pictures = run.snapshots.iter().map(|snapshot| &snapshot.picture);
            pictures.map(relmse).collect()
        })
        .collect();
    let mut all = Vec::new();
    for method in methods(runs) {
        let first = runs.iter().find(|run| run.variant == method).map_or(&[][..], |run| &run.snapshots);
        for (i, snapshot) in first.iter().enumerate() {
            let of_seeds: Vec<f64> = runs
                .iter()
                .zip(&errors)
                .filter(|(run, _)| run.variant == method)
                .map(|(_, errors)| errors[i])
                .collect();
            all.push((method, snapshot.budget, median(&of_seeds)));
        }
    }
    all
}

/// True when the reference is good enough for every row.
pub fn good_enough(medians: &[(&str, f64, f64)], own: &OwnError) -> bool {
    medians.iter().all(|(.., relmse)| *relmse >= MARGIN * own.total)
}

/// The names of what ran, in its order.
fn methods(runs: &[Run]) -> Vec<&str> {
    let mut methods = Vec::new();
    for run in runs {
        if !methods.contains(&run.variant.as_str()) {
            methods.push(run.variant.as_str());
        }
    }
    methods
}

/// Measures every run and condenses: all that is said about one scene. `file` and `origin` say where the reference
/// lies and how it came to be.
pub fn evaluate(
    scene: &Scene,
    runs: &[Run],
    reference: &Reference,
    rule: &MaskRule,
    (file, origin): (String, String),
) -> SceneReport {
    let left_out = rule.left_out(reference);
    let own_error = reference.own_error(&left_out);
    let medians = medians(runs, reference, &left_out);
    let too_noisy =
        |relmse: f64| relmse.is_nan() || relmse < MARGIN * own_error.total || own_error.total.is_nan();
    let noisy: Vec<_> = medians.iter().filter(|(.., relmse)| too_noisy(*relmse)).collect();
    let is_noisy = |method: &str, budget: f64| noisy.iter().any(|n| n.0 == method && n.1 == budget);
    let noise = reference.noise_share(&left_out);
    let rows = |run| rows(run, reference, &noise, &left_out);
    let mut rows: Vec<Row> = runs.par_iter().flat_map_iter(rows).collect();
    for row in &mut rows {
        row.reference_too_noisy = noisy.iter().any(|n| n.0 == row.method && n.1 == row.budget);
    }
    let smallest = medians.iter().map(|m| m.2).fold(f64::INFINITY, f64::min);
    let refused = noisy.len() > 1;
    let all = methods(runs);
    let by_method: Vec<Vec<Vec<&Row>>> = all.iter().map(|method| series(&rows, method)).collect();
    let curves: Vec<Curve> = all
        .iter()
        .zip(&by_method)
        .map(|(method, series)| curve(method, series, |budget| is_noisy(method, budget)))
        .collect();
    let first = all.iter().position(|method| *method == Method::Photon.name()).unwrap_or(0);
    let others = (0..all.len()).filter(|i| *i != first && !refused);
    let pairs =
        others.filter_map(|i| pair((all[first], &by_method[first]), (all[i], &by_method[i]))).collect();
    let masked = left_out.iter().filter(|out| **out).count();
    SceneReport {
        scene: scene.name.clone(),
        scene_hash: format!("{:016x}", scene.hash()),
        illumination: scene.describe_illumination(),
        reference: ReferenceFacts {
            file,
            origin,
            method: reference.method.clone(),
            passes: reference.passes,
            seconds: reference.seconds,
            own_error,
            noise_taken_off: noise.relmse,
            margin: smallest / own_error.total,
            too_noisy_for: noisy
                .iter()
                .map(|(method, budget, _)| format!("{method} at {budget} s"))
                .collect(),
            refused,
        },
        mask: MaskFacts { rule: rule.words(reference), share: masked as f64 / left_out.len().max(1) as f64 },
        pictures: shown(runs, &rows, reference),
        curves,
        pairs,
        runs: rows,
        left_out,
    }
}

fn rows(run: &Run, reference: &Reference, noise: &NoiseShare, left_out: &[bool]) -> Vec<Row> {
    let (width, height) = (reference.width, reference.height);
    let row = |snapshot: &crate::compare::Snapshot| {
        let metrics = compare(&snapshot.picture, &reference.visible, Some(left_out));
        let map = flip(width, height, &snapshot.picture, &reference.visible, Some(left_out));
        let counted = map.iter().zip(left_out).filter(|(_, out)| !**out);
        let flip = counted.map(|(e, _)| f64::from(*e)).sum::<f64>() / metrics.compared.max(1) as f64;
        Row {
            method: run.variant.clone(),
            seed: run.seed,
            budget: snapshot.budget,
            seconds: snapshot.seconds,
            setup_seconds: run.setup_seconds,
            passes: snapshot.passes,
            photon_paths: run.paths_per_pass * u64::from(snapshot.passes),
            camera_samples: run.samples_per_pass * u64::from(snapshot.passes),
            relmse_measured: metrics.relmse,
            metrics: noise.taken_off(metrics),
            flip,
            reference_too_noisy: false,
        }
    };
    run.snapshots.iter().map(row).collect()
}

/// The rows of a method by seed, then by budget.
fn series<'a>(rows: &'a [Row], method: &str) -> Vec<Vec<&'a Row>> {
    let mut by_seed: Vec<Vec<&'a Row>> = Vec::new();
    for row in rows.iter().filter(|row| row.method == method) {
        match by_seed.iter_mut().find(|seed| seed[0].seed == row.seed) {
            Some(seed) => seed.push(row),
            None => by_seed.push(vec![row]),
        }
    }
    by_seed
}

fn column(series: &[Vec<&Row>], seeds: &[usize], budget: usize, value: impl Fn(&Row) -> f64) -> Vec<f64> {
    seeds.iter().map(|&seed| value(series[seed][budget])).collect()
}

/// Median time (less `setup`) and median relMSE at each budget, for these seeds; a pass that was longer than a budget
/// is one point.
fn median_curve(series: &[Vec<&Row>], seeds: &[usize], setup: f64) -> Vec<(f64, f64)> {
    let budgets = series.first().map_or(0, Vec::len);
    let point = |budget| {
        let seconds = median(&column(series, seeds, budget, |row| row.seconds));
        (seconds - setup, median(&column(series, seeds, budget, |row| row.metrics.relmse)))
    };
    let mut points: Vec<(f64, f64)> = (0..budgets).map(point).collect();
    points.dedup_by(|a, b| a.0 == b.0);
    points
}

fn curve(method: &str, series: &[Vec<&Row>], too_noisy: impl Fn(f64) -> bool) -> Curve {
    let seeds: Vec<usize> = (0..series.len()).collect();
    let budgets = series.first().map_or(0, Vec::len);
    let setup = median(&column(series, &seeds, 0, |row| row.setup_seconds));
    let point = |i: usize| {
        let of = |value: fn(&Row) -> f64| column(series, &seeds, i, value);
        let relmse = of(|row| row.metrics.relmse);
        let bias = median(&of(|row| row.metrics.relative_bias.unwrap_or(f64::NAN)));
        let budget = series[0][i].budget;
        Point {
            budget,
            seconds: median(&of(|row| row.seconds)),
            passes: median(&of(|row| f64::from(row.passes))),
            relmse: median(&relmse),
            low: quantile(&relmse, 0.1),
            high: quantile(&relmse, 0.9),
            flip: median(&of(|row| row.flip)),
            relative_bias: bias.is_finite().then_some(bias),
            reference_too_noisy: too_noisy(budget),
        }
    };
    let slope = |seeds: &[usize]| log_slope(&median_curve(series, seeds, setup));
    Curve {
        method: method.to_owned(),
        setup_seconds: setup,
        points: (0..budgets).map(point).collect(),
        slope: slope(&seeds).map(|value| bootstrap(value, 1, seeds.len(), |drawn| slope(&drawn[0]))),
    }
}

type Series<'a> = (&'a str, &'a [Vec<&'a Row>]);

fn pair<'a>(
    (a, of_a): (&'a str, &'a Vec<Vec<&'a Row>>),
    (b, of_b): (&'a str, &'a Vec<Vec<&'a Row>>),
) -> Option<Pair> {
    let (a, b): (Series<'_>, Series<'_>) = ((a, of_a), (b, of_b));
    let all: Vec<usize> = (0..a.1.len()).collect();
    let value = ratios(a.1, b.1, &all, &all)?;
    let interval = |value: f64, figure: fn(&Ratios) -> f64| -> Interval {
        bootstrap(value, 2, all.len(), |drawn| ratios(a.1, b.1, &drawn[0], &drawn[1]).map(|r| figure(&r)))
    };
    Some(Pair {
        a: a.0.to_owned(),
        b: b.0.to_owned(),
        seconds: value.seconds,
        error_ratio: interval(value.error_ratio, |r| r.error_ratio),
        relmse: value.relmse,
        time_ratio: interval(value.time_ratio, |r| r.time_ratio),
        time_relation: value.relation,
    })
}

struct Ratios {
    seconds: f64,
    error_ratio: f64,
    relmse: f64,
    time_ratio: f64,
    relation: &'static str,
}

fn ratios(a: &[Vec<&Row>], b: &[Vec<&Row>], seeds_a: &[usize], seeds_b: &[usize]) -> Option<Ratios> {
    let (a, b) = (median_curve(a, seeds_a, 0.0), median_curve(b, seeds_b, 0.0));
    let seconds = a.last()?.0.min(b.last()?.0);
    let lowest = |curve: &[(f64, f64)]| curve.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    let relmse = lowest(&a).max(lowest(&b));
    let ((time_a, bound_a), (time_b, bound_b)) = (reached(&a, relmse)?, reached(&b, relmse)?);
    Some(Ratios {
        seconds,
        error_ratio: at(&b, seconds) / at(&a, seconds),
        relmse,
        time_ratio: time_b / time_a,
        relation: match (bound_a, bound_b) {
            (true, false) => "≥",
            (false, true) => "≤",
            _ => "=",
        },
    })
}

/// The reference, and of each method the run of median error at the last budget.
fn shown(runs: &[Run], rows: &[Row], reference: &Reference) -> Vec<Shown> {
    let caption = format!("{}, {} passes", reference.method, reference.passes);
    let mut all = vec![Shown { name: "reference".into(), caption, picture: reference.visible.clone() }];
    for method in methods(runs) {
        let mut last: Vec<&Row> =
            series(rows, method).iter().filter_map(|seed| seed.last().copied()).collect();
        last.sort_by(|a, b| a.metrics.relmse.total_cmp(&b.metrics.relmse));
        let Some(row) = last.get((last.len().max(1) - 1) / 2) else { continue };
        let run = runs.iter().find(|run| run.variant == method && run.seed == row.seed);
        let Some(snapshot) = run.and_then(|run| run.snapshots.last()) else { continue };
        let caption = format!(
            "{:.1} s, {} passes, seed {}, relMSE {:.2e}, FLIP {:.3}",
            row.seconds, row.passes, row.seed, row.metrics.relmse, row.flip
        );
        all.push(Shown { name: method.into(), caption, picture: snapshot.picture.clone() });
    }
    all
}
