//! Randomness as a function of (seed, stream, pass, path, dimension), never of a thread, and the warps that turn
//! it into directions and points.

mod rng;
mod sobol;
pub mod warp;

pub use rng::{Rng, Stream, hash};
pub use sobol::{SOBOL_DIMENSIONS, Sobol};

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
