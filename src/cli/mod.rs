//! One file per command; what the user asked for becomes settings here, once.

pub mod diff;
#[cfg(test)]
mod diff_tests;
mod diff_text;
