//! The annex of a state from its file, block by block.

use super::StateHead;
use super::read::{MISFIT, block, ended, wrong};
use crate::error::{Error, Result};
use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

/// A state whose film was read, and whose annex is next.
pub struct AnnexFile {
    path: PathBuf,
    head: StateHead,
    rest: BufReader<File>,
    bytes: Vec<u8>,
}

impl AnnexFile {
    pub(super) fn new(path: PathBuf, head: StateHead, rest: BufReader<File>) -> Self {
        Self { path, head, rest, bytes: Vec::new() }
    }

    /// What the state says of itself.
    pub fn head(&self) -> &StateHead {
        &self.head
    }

    /// The facts, to be taken first.
    ///
    /// # Errors
    /// One line: they are damaged.
    pub fn facts(&mut self) -> Result<&[u8]> {
        self.next(self.head.annex.as_ref().map_or(0, |annex| annex.facts))
    }

    /// The next row, from the top: as many bytes as the head says.
    ///
    /// # Errors
    /// One line: it is damaged.
    pub fn row(&mut self) -> Result<&[u8]> {
        self.next(self.head.annex.as_ref().map_or(0, |annex| annex.row))
    }

    /// To be called behind the last row.
    ///
    /// # Errors
    /// One line: the file goes on.
    pub fn end(mut self) -> Result<()> {
        ended(&mut self.rest).map_err(|reason| wrong(&self.path, reason))
    }

    /// What is said of a state that is not what its reader needs.
    pub fn refused(&self, reason: &str) -> Error {
        wrong(&self.path, reason.into())
    }

    fn next(&mut self, length: u32) -> Result<&[u8]> {
        let length = length as usize;
        let whole = block(&mut self.rest, &mut self.bytes, length)
            .and_then(|()| if self.bytes.len() == length { Ok(()) } else { Err(MISFIT.into()) });
        whole.map_err(|reason| wrong(&self.path, reason))?;
        Ok(&self.bytes)
    }
}
