//! The film: sums over passes, their mean and standard error, layers; EXR and PNG.
//!
//! Sums are exact, so that a picture depends neither on the number of threads nor on how its passes came together. Every file is written
//! beside its target and renamed over it: a killed render leaves the last good file.

pub mod denoise;
mod exact;
pub mod header;
mod identity;
pub mod image;
mod judge;
pub mod layer;
mod ours;
mod passes;
mod peaks;
mod preview;
mod read_exr;
pub mod replace;
pub mod state;
pub mod sums;
mod trust;
mod wide;
mod write_exr;
mod write_linear;
mod write_png;

#[cfg(test)]
mod foreign_tests;
#[cfg(test)]
mod tests;

pub use ::exr::prelude::Compression;
pub use header::{Header, Value};
pub use identity::FileId;
pub use image::Image;
pub use judge::{Judgement, judge};
pub use layer::Layer;
pub use ours::is_ours;
pub use passes::{PassSet, Run, Schedule};
pub use preview::{Exposure, Preview, View};
pub use read_exr::read_exr;
pub use replace::{Place, check_writable, replace_file};
pub use state::{Annex, AnnexFile, AnnexRows, Key, StateFile, StateHead, write_state, write_state_with};
pub use sums::{Asides, Film, PassImage};
pub use trust::Doubt;
pub use write_exr::{Line, WrittenLayer, exr_bytes, line_of, write_exr, write_image_exr, write_layers_exr};
pub use write_linear::{write_hdr, write_pfm};
pub use write_png::{
    quick_png, rgb_bytes, rgb_png, srgb_encode, write_bytes_png, write_png, write_rgb_jpg, write_rgb_png,
};
