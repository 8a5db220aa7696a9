//! What goes in: real files, built-in scenes and everything that can be wrong with a file.

mod bounds;
mod builtin;
mod damage;
mod files;
mod images;
mod loose;
mod noise;
mod right;
mod small;
mod unlit;
mod wrong;
