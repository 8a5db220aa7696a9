//! What is said to a user, and what is printed for whoever asked.

use crate::error::{Error, Result};
use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

/// A line for the log. A log that breaks ends no work.
pub fn say(line: impl Display) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// What a command was asked for, on standard output.
///
/// # Errors
/// Where it cannot be written; a pipe that was closed is none: whoever closed it has read enough.
pub fn print(text: &str) -> Result<()> {
    told(io::stdout().write_all(text.as_bytes()))
}

/// The same of what was written before.
pub fn told(written: io::Result<()>) -> Result<()> {
    match written.and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Error::Print(error)),
        _ => Ok(()),
    }
}
