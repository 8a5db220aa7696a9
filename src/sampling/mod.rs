//! Randomness as a function of (seed, stream, pass, path, dimension), never of a thread, and the warps that turn
//! it into directions and points.

mod rng;
mod sobol;
pub mod warp;

pub use rng::{Rng, Stream, hash};
pub use sobol::{SOBOL_DIMENSIONS, Sobol};
