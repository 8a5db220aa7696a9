//! How far a picture is from the truth: error metrics, FLIP, and tests that accept or reject.

mod arrivals;
mod chain;
pub mod distributions;
pub mod error_picture;
mod existence;
pub mod flip;
mod magma;
pub mod mask;
pub mod metrics;
pub mod moments;
mod multiplication;
pub mod race;
pub mod reference;
pub mod ztest;

pub use existence::{Existence, with_error};
pub use flip::{flip, hdr_flip};
pub use metrics::{Metrics, compare};
pub use moments::Moments;
pub use multiplication::Multiplication;
pub use ztest::{Agreement, Estimate, agreement, z};
