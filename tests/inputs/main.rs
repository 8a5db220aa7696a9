//! What goes in: real files, built-in scenes and everything that can be wrong with a file.

mod builtin;
mod noise;
mod right;
mod shared;
mod small;
mod wrong;
