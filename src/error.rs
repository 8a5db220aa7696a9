//! What users can get wrong, as one enum. Each message names the thing and the way out. Bugs are assertions.

use std::path::PathBuf;

/// Everything that can fail for a reason outside the program. `Display` is one line: what, where, what to do.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be read.
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error("{}: cannot write: {reason}; nothing was changed there", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// What went wrong.
        reason: String,
    },
    /// A scene file is not what it should be.
    #[error("{file}: {reason}")]
    Scene {
        /// The file, or the name of a built-in scene.
        file: String,
        /// The thing in it that is wrong, and the way out.
        reason: String,
    },
    /// A picture file is not what it should be.
    #[error("{}: {reason}", path.display())]
    Image {
        /// Which file.
        path: PathBuf,
        /// The thing in it that is wrong, and the way out.
        reason: String,
    },
    /// What a command prints could not be printed.
    #[error("standard output: cannot write: {0}")]
    Print(std::io::Error),
    /// A command-line argument or setting cannot be followed.
    #[error("{0}")]
    Usage(String),
    /// The light-transport series diverges: there is no image (exit code 3).
    #[error("{reason}")]
    NoImage {
        /// Why, and the way out.
        reason: String,
        /// The multiplication factor: one or more, or so near to one that no path can be followed to its end.
        k: f64,
    },
}

impl Error {
    /// The process exit code: 3 when no image exists, else 2.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::NoImage { .. } => 3,
            _ => 2,
        }
    }

    /// A scene error.
    pub fn scene(file: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Scene { file: file.into(), reason: reason.into() }
    }
}

/// Result with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;
