//! What goes in: real files, built-in scenes and everything that can be wrong with a file.

mod area;
mod around;
mod bounds;
mod builtin;
mod damage;
mod field;
mod files;
mod ies;
mod image_light;
mod images;
mod loose;
mod noise;
mod orientation;
#[cfg(all(feature = "draco", feature = "meshopt"))]
mod packed;
mod posed;
mod right;
mod small;
mod sun;
mod unlit;
mod wrong;
