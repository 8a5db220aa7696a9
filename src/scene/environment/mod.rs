//! Light from infinity.

mod cube;
mod distribution;
mod light;
mod panorama;
mod read;
mod sky;
mod source;
mod studio;
mod sun;
mod surroundings;

pub(crate) use cube::Cube;
pub use light::{Background, Environment, upright};
pub use panorama::Panorama;
pub use read::Limits;
pub use sky::Sky;
pub use source::{AtInfinity, Source};
pub use studio::studio;
pub use sun::{SUN_RADIUS, Sun};
pub(crate) use surroundings::Shining;
pub use surroundings::{Around, Surroundings};
