//! halflight.
pub mod error;
pub mod film;
pub mod light;
pub mod measure;
pub mod optics;
pub mod path_trace;
pub mod rays;
pub mod sampling;
pub mod scene;
