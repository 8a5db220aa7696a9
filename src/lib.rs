//! halflight.
pub mod cli;
pub mod error;
pub mod film;
pub mod gather;
pub mod light;
pub mod measure;
pub mod optics;
pub mod photon_map;
pub mod plan;
pub mod rays;
pub mod render;
pub mod sampling;
pub mod scene;
pub mod shoot;
