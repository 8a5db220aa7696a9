//! Where in the square images exist: s κ(t) < 1.
//!
//! κ(t) is the factor by which light multiplies from one reflection that follows s to the next; where all matter follows
//! s, it is the multiplication factor k at s = 1. By Kingman's theorem the logarithm of the largest s that has an image is
//! a concave function of ln t. So straight lines between samples in (ln t, ln κ) lie above κ, and a point that is said to
//! have an image has one.

use crate::existence::{Existence, Multiplication};
use crate::rays::Rays;
use crate::scene::Scene;

/// κ at one t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Shadowlessness.
    pub t: f64,
    /// κ there, no less than it is but for `error`.
    pub kappa: f64,
    /// Its standard error; zero where it is a bound.
    pub error: f64,
}

/// κ as a function of t.
#[derive(Clone, Debug, PartialEq)]
pub struct Frontier {
    samples: Vec<Sample>,
}

/// Where κ(1) is below this it is taken for all t: the whole square has images.
const FAR_FROM_ONE: f64 = 0.9;
/// Else it is measured at these, and at 1.
const SAMPLES: [f64; 6] = [0.0, 0.03, 0.1, 0.25, 0.5, 0.75];
/// Photons are followed no nearer to the frontier than this share of the way.
pub const REACH: f64 = 0.995;
/// Steps by which the s with k = 1 is looked for where some matter does not follow s.
const MOST_STEPS: u32 = 6;

impl Frontier {
    /// Measures; `at_one` is what is known at (1, 1).
    pub fn measure(scene: &Scene, at_one: &Existence, seed: u64) -> Self {
        let known = |t: f64, existence: &Existence| match existence {
            // Up to one: light that glass keeps for ever is never seen.
            Existence::Certain { at_most, .. } => Sample { t, kappa: at_most.min(REACH), error: 0.0 },
            Existence::Measured(Multiplication { k, error, .. }) => Sample { t, kappa: *k, error: *error },
        };
        let last = known(1.0, at_one);
        if last.kappa + 3.0 * last.error < FAR_FROM_ONE {
            return Self { samples: vec![last] };
        }
        let all_follow = scene
            .materials
            .iter()
            .all(|material| material.follows.s.is_some() || material.bsdf.terms.is_empty());
        let k = |s: f64, t: f64| {
            let there = scene.at(s as f32, t as f32);
            known(t, &Existence::of(&there, &Rays::build(&there), seed, false))
        };
        let kappa = |sample: Sample| {
            if all_follow || sample.kappa < 1.0 { sample } else { beyond(sample, |s| k(s, sample.t).kappa) }
        };
        let mut samples: Vec<Sample> = SAMPLES.iter().map(|t| kappa(k(1.0, *t))).collect();
        samples.push(kappa(last));
        Self { samples }
    }

    /// Of a truncated series, which always has a sum.
    pub fn none() -> Self {
        Self { samples: vec![Sample { t: 1.0, kappa: 0.0, error: 0.0 }] }
    }

    /// From samples as a file has them: t rising from 0 or more to 1. None where they are not.
    pub fn from_samples(samples: Vec<Sample>) -> Option<Self> {
        let rising = samples.windows(2).all(|pair| pair[0].t < pair[1].t);
        let sane = samples.iter().all(|s| s.t >= 0.0 && s.kappa >= 0.0 && s.error >= 0.0);
        (rising && sane && samples.last().is_some_and(|last| last.t == 1.0)).then_some(Self { samples })
    }

    /// What was measured.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// κ(t), or somewhat more.
    pub fn kappa(&self, t: f64) -> f64 {
        let above = self.samples.partition_point(|sample| sample.t < t).min(self.samples.len() - 1);
        let b = self.samples[above];
        let Some(a) = above.checked_sub(1).map(|below| self.samples[below]) else { return b.kappa };
        if t >= b.t || a.t == 0.0 || a.kappa == 0.0 {
            return b.kappa; // κ does not fall with t
        }
        let way = (t / a.t).ln() / (b.t / a.t).ln();
        (a.kappa.ln() + way * (b.kappa / a.kappa).ln()).exp()
    }

    /// The largest s that is served at t: where images end, or 1.
    pub fn largest_s(&self, t: f64) -> f64 {
        (REACH / self.kappa(t)).min(1.0)
    }

    /// The largest t that is served at s. None where not even 0 is.
    pub fn largest_t(&self, s: f64) -> Option<f64> {
        if s > self.largest_s(0.0) {
            return None;
        }
        if s <= self.largest_s(1.0) {
            return Some(1.0);
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            *(if s <= self.largest_s(middle) { &mut low } else { &mut high }) = middle;
        }
        Some(low)
    }

    /// Why there is no image at (s, t), and where there are some; None where there is one.
    pub fn refusal(&self, s: f64, t: f64) -> Option<String> {
        let most_s = self.largest_s(t);
        if s <= most_s {
            return None;
        }
        let hundredths = |x: f64| (100.0 * x).floor() / 100.0;
        let along_t = self
            .largest_t(s)
            .map_or_else(|| "for no t".to_owned(), |most_t| format!("up to t = {:.2}", hundredths(most_t)));
        Some(format!(
            "no image exists at s = {s}, t = {t}: light multiplies by {:.3} s from one reflection to the next; at t = {t} \
             there are images up to s = {:.2}, at s = {s} {along_t}",
            self.kappa(t),
            hundredths(most_s),
        ))
    }
}

/// κ = 1/s where k(s) = 1: ln k is convex in ln s, so chords lie above it and the s where one crosses zero has an image.
fn beyond(at_one: Sample, k: impl Fn(f64) -> f64) -> Sample {
    let (mut high_s, mut high_k): (f64, f64) = (1.0, at_one.kappa);
    for _ in 0..MOST_STEPS {
        let s = high_s / (high_k * high_k);
        let found = k(s);
        if found < 1.0 {
            let way = high_k.ln() / (high_k / found).ln();
            let crossing = (high_s.ln() + way * (s / high_s).ln()).exp();
            return Sample { kappa: 1.0 / crossing, ..at_one };
        }
        (high_s, high_k) = (s, found.max(1.0 + 1e-3));
    }
    // Light that does not follow s multiplies on its own: no s has an image.
    Sample { kappa: f64::INFINITY, ..at_one }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(t: f64, kappa: f64) -> Sample {
        Sample { t, kappa, error: 0.0 }
    }

    #[test]
    fn between_samples_kappa_is_no_less_than_it_is() {
        // κ(t) = 0.8 + 0.5 t² is log-convex in ln t.
        let truth = |t: f64| 0.8 + 0.5 * t * t;
        let samples = [0.0, 0.03, 0.1, 0.25, 0.5, 0.75, 1.0].map(|t| sample(t, truth(t)));
        let frontier = Frontier::from_samples(samples.to_vec()).expect("rising");
        for i in 0..=100 {
            let t = f64::from(i) / 100.0;
            assert!(frontier.kappa(t) >= truth(t) - 1e-12 && frontier.kappa(t) < truth(t) + 0.02, "{t}");
        }
        let t = frontier.largest_t(1.0).expect("global exists");
        assert!((0.55..=0.63).contains(&t), "{t}");
        assert_eq!(frontier.largest_t(0.7), Some(1.0));
        assert!((frontier.largest_s(1.0) - REACH / 1.3).abs() < 1e-12);
    }

    #[test]
    fn the_s_where_k_is_one_is_approached_from_below() {
        // Half of the reflection follows s: k = 0.5 + 0.8 s is one at s = 0.625.
        let found = beyond(sample(1.0, 1.3), |s| 0.5 + 0.8 * s);
        assert!(found.kappa >= 1.6 && found.kappa < 1.68, "{found:?}");
        assert!(beyond(sample(1.0, 1.5), |_| 1.2).kappa.is_infinite());
    }

    #[test]
    fn samples_that_do_not_rise_are_none() {
        assert_eq!(Frontier::from_samples(vec![sample(0.5, 0.5), sample(0.25, 0.4)]), None);
        assert_eq!(Frontier::from_samples(vec![]), None);
        assert_eq!(Frontier::from_samples(vec![sample(1.0, f64::NAN)]), None);
    }
}
