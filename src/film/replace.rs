//! Writing a file so that the last good one survives anything.

use crate::error::{Error, Result};
use std::fs::{self, File, Permissions};
use std::io::{self, BufWriter, Cursor, Read, Seek, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Writes a file by way of a temporary one beside it: written whole, flushed to disk, then renamed. When anything
/// fails, or the process is killed, the old file is as it was. Permissions are those a plain create would give.
///
/// What exists and is not a regular file (`/dev/null`, a pipe) is written to as it is; a link is followed.
pub fn replace_file(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    replace_revised(path, |file| {
        let mut buffered = BufWriter::with_capacity(1 << 16, file);
        write(&mut buffered)?;
        buffered.flush()
    })
}

/// What can be gone back to while it is written.
pub trait Revised: Read + Write + Seek {}
impl<T: Read + Write + Seek> Revised for T {}

/// The same for what does not come from first to last, without a buffer. What is not a regular file gets it at the end.
pub fn replace_revised(path: &Path, write: impl FnOnce(&mut dyn Revised) -> io::Result<()>) -> Result<()> {
    match target(path)? {
        Target::Stream => {
            let mut bytes = Cursor::new(Vec::new());
            write(&mut bytes).map_err(|e| refused(path, &e))?;
            let mut file = File::options().write(true).open(path).map_err(|e| refused(path, &e))?;
            file.write_all(bytes.get_ref()).map_err(|e| refused(path, &e))
        }
        Target::Regular(target, permissions) => {
            let mut file = temporary(path, &target, permissions)?;
            write(&mut file).map_err(|e| refused(path, &e))?;
            file.as_file().sync_all().map_err(|e| refused(path, &e))?;
            file.persist(&target).map_err(|e| refused(path, &e.error))?;
            // The rename itself is not on disk before its folder is; some file systems refuse this, which harms nothing.
            if let Some(Ok(folder)) = target.parent().map(File::open) {
                folder.sync_all().ok();
            }
            Ok(())
        }
    }
}

/// Whether [`replace_file`] could write here; leaves no trace. To be asked before hours of rendering.
pub fn check_writable(path: &Path) -> Result<()> {
    match target(path)? {
        Target::Stream => Ok(()),
        Target::Regular(target, permissions) => temporary(path, &target, permissions).map(drop),
    }
}

enum Target {
    /// Not a regular file: cannot be renamed over.
    Stream,
    /// Where to rename to, and the permissions of what is there.
    Regular(PathBuf, Option<Permissions>),
}

fn target(path: &Path) -> Result<Target> {
    if path.file_name().is_none() {
        return Err(reason(path, "this names no file"));
    }
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => Err(reason(path, "this is a folder; give a file name in it")),
        Ok(there) if !there.is_file() => Ok(Target::Stream),
        Ok(there) if there.permissions().readonly() => Err(reason(path, "the file is read-only")),
        Ok(there) => {
            let target = fs::canonicalize(path).map_err(|e| refused(path, &e))?;
            Ok(Target::Regular(target, Some(there.permissions())))
        }
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(Target::Regular(path.into(), None)),
        Err(e) => Err(refused(path, &e)),
    }
}

fn temporary(path: &Path, target: &Path, permissions: Option<Permissions>) -> Result<NamedTempFile> {
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(reason(path, &format!("there is no folder {}", folder.display())));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".halflight-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Of these bits the system takes away the umask, as with any new file; tempfile's own default is 0600.
        builder.permissions(Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(|e| {
        // tempfile's message repeats the path of the temporary file, which means nothing to the user.
        reason(path, &format!("in folder {}: {}", folder.display(), kind(&e)))
    })?;
    if let Some(permissions) = permissions {
        file.as_file().set_permissions(permissions).map_err(|e| refused(path, &e))?;
    }
    Ok(file)
}

fn kind(e: &io::Error) -> String {
    e.kind().to_string()
}

fn refused(path: &Path, e: &io::Error) -> Error {
    reason(path, &e.to_string())
}

fn reason(path: &Path, reason: &str) -> Error {
    Error::Write { path: path.into(), reason: reason.into() }
}
