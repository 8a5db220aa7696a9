//! Randomness as a function of (seed, stream, pass, path, dimension), never of a thread, and the warps that turn it into
//! directions and points.

mod cumulative;
mod rng;
mod sobol;
pub mod steps;
pub mod warp;

pub use cumulative::Cumulative;
pub use rng::{Rng, Stream, hash};
pub use sobol::{SOBOL_DIMENSIONS, Sobol};

/// Probability with which a walk goes on that matter alone might never end, after so many `steps` of which the first `certain`
/// (> 1) are not in question: ((n−1)/n)².
///
/// The chance to get as far as n falls as (certain/n)², so that walks between perfect mirrors have a mean length; and their
/// weight grows as n², so that its variance is finite however rarely they find a way out. (A constant probability p lets
/// weights grow as p⁻ⁿ: where the way out is rarer than 1 − p their variance is infinite, and every mean of many too low.)
pub fn endurance(steps: u32, certain: u32) -> f32 {
    if steps < certain { 1.0 } else { (1.0 - 1.0 / steps as f32).powi(2) }
}

/// Weight of a way of density `own` > 0 beside another of density `other`: own² / (own² + other²), Veach 1997, eq. 9.13, written
/// so that no square overflows before its ratio does.
pub fn power_heuristic(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

/// One of `n` things, chosen by `u` in [0, 1) in proportion to its weight: its index and its probability. None where all
/// weights are zero.
pub fn choose(n: usize, weight: impl Fn(usize) -> f32, u: f32) -> Option<(usize, f32)> {
    let total: f32 = (0..n).map(&weight).sum();
    let mut rest = u * total;
    let mut chosen = None;
    for i in 0..n {
        let weight = weight(i);
        if weight > 0.0 {
            chosen = Some((i, weight / total));
            if rest < weight {
                break;
            }
            rest -= weight;
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_that_nothing_ends_have_a_mean_length_and_a_finite_variance() {
        let certain = 32;
        let (mut reached, mut length) = (1.0, 0.0);
        for n in 0..1_000_000 {
            length += reached;
            reached *= f64::from(endurance(n, certain));
            if n >= certain {
                let expected = (f64::from(certain - 1) / f64::from(n)).powi(2);
                assert!((reached / expected - 1.0).abs() < 0.1, "{n}: {reached} for {expected}");
            }
        }
        assert!((length - 2.0 * f64::from(certain)).abs() < 2.0, "{length}");
    }
}
