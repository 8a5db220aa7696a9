//! From measurements to what people read: tables, curves, one page.

mod csv;
pub mod data;
pub mod evaluate;
mod look;
mod page;
mod pictures;
mod square;
pub mod stats;
mod svg;
mod template;

pub use csv::csv;
pub use data::{Comparison, SceneReport};
pub use page::page;
pub use square::{SquarePage, square_page};
#[cfg(feature = "cli")]
pub(crate) use svg::escape;
pub use svg::svg;
#[cfg(feature = "cli")]
pub(crate) use template::fill;

/// The whole comparison as JSON: every run, and every number that the page shows.
pub fn json(comparison: &Comparison) -> String {
    let mut text = serde_json::to_string_pretty(comparison).expect("plain data");
    text.push('\n');
    text
}
