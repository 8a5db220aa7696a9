//! How far a picture is from the truth: error metrics, FLIP, and tests that accept or reject.

pub mod distributions;
pub mod error_picture;
pub mod flip;
mod magma;
pub mod mask;
pub mod metrics;
pub mod moments;
pub mod ztest;

pub use flip::{flip, hdr_flip};
pub use metrics::{Metrics, compare};
pub use moments::{Moments, mean_and_error};
pub use ztest::{Agreement, Estimate, agreement, z};
