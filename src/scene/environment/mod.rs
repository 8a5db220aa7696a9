//! Light from infinity.

mod panorama;
mod read;
mod sky;
mod source;
mod studio;
mod sun;

pub use panorama::Panorama;
pub use read::Limits;
pub use sky::Sky;
pub use source::{AtInfinity, Source};
pub use studio::studio;
pub use sun::{SUN_RADIUS, Sun};
