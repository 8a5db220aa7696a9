//! Which file a path leads to, whatever it is called.

use std::path::Path;

/// One file: two paths that lead to it, by links of either kind, have equal identities.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct FileId(#[cfg(unix)] (u64, u64), #[cfg(not(unix))] std::path::PathBuf);

impl FileId {
    /// None: nothing is there, or it cannot be seen.
    #[cfg(unix)]
    pub fn of(path: &Path) -> Option<Self> {
        use std::os::unix::fs::MetadataExt;
        let there = std::fs::metadata(path).ok()?;
        Some(Self((there.dev(), there.ino())))
    }

    /// None: nothing is there, or it cannot be seen.
    #[cfg(not(unix))]
    pub fn of(path: &Path) -> Option<Self> {
        std::fs::canonicalize(path).ok().map(Self)
    }
}
