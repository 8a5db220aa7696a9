//! What is said to the user (standard error), and what is printed as a result (standard output).

use super::escape;
use crate::error::{Error, Result};
use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

/// A line for the log, escaped for a terminal. A log that breaks ends no work.
pub fn say(line: impl Display) {
    let _ = writeln!(io::stderr(), "{}", escape::line(&line.to_string()));
}

/// What a command was asked for, on standard output, its lines escaped for a terminal.
///
/// # Errors
/// Where it cannot be written; a pipe that was closed is none: whoever closed it has read enough.
pub fn print(text: &str) -> Result<()> {
    told(io::stdout().write_all(escape::lines(text).as_bytes()))
}

/// A number of things: 1 case, 2 cases.
pub fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// The same of what was written before.
pub fn told(written: io::Result<()>) -> Result<()> {
    match written.and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Error::Print(error)),
        _ => Ok(()),
    }
}
