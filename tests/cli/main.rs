//! The program as a user meets it: messages, exit codes, files.

mod atlas;
mod browser;
mod check;
mod choice;
mod compare;
mod denoise;
mod ends;
mod environment;
mod files;
mod info;
mod live;
mod page;
mod pages;
mod render;
mod state;
mod support;
mod window;
mod wrong;

use std::path::Path;
use std::process::{Command, Output};

/// Runs `halflight` in `folder` with arguments separated by blanks.
fn halflight(folder: &Path, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_halflight"));
    command.current_dir(folder).args(arguments.split_whitespace()).output().expect("the program starts")
}

/// What it said on standard error.
fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
