//! Writes a file so that the last good one survives anything.
//!
//! The temporary file is locked while it is written, so that the next run can recognise what a killed one left behind.

use crate::error::{Error, Result};
use std::fs::{self, File, Metadata, Permissions, TryLockError};
use std::io::{self, BufWriter, Cursor, Read, Seek, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Writes a file by way of a temporary one beside it: written whole, flushed to disk, then renamed. When anything
/// fails, or the process is killed, the old file is as it was. Permissions are those a plain create would give.
///
/// A device such as `/dev/null` is written to as it is, a link is followed, also to where nothing is yet. Pipes, sockets
/// and disks are refused: nobody may read at the other end.
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

/// The same for what does not come from first to last, without a buffer. A device gets it at the end.
pub fn replace_revised(path: &Path, write: impl FnOnce(&mut dyn Revised) -> io::Result<()>) -> Result<()> {
    match target(path)? {
        Target::Device => {
            let mut bytes = Cursor::new(Vec::new());
            write(&mut bytes).map_err(|e| refused(path, &e))?;
            let mut file = File::options().write(true).open(path).map_err(|e| refused(path, &e))?;
            file.write_all(bytes.get_ref()).map_err(|e| refused(path, &e))
        }
        Target::Regular(target, permissions) => {
            let mut file = temporary(path, &target, permissions)?;
            // The file itself, as what wraps it tells the name of the temporary one, which means nothing to the user.
            write(file.as_file_mut()).map_err(|e| refused(path, &e))?;
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

/// Where a path leads when it is written to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A file, to be made or replaced.
    File,
    /// The path is a link; this is the file that is made or replaced.
    Link(PathBuf),
    /// Not a file: written to as it is, once.
    Device,
}

/// Whether [`replace_file`] could write here; leaves no trace. To be asked before hours of rendering. Removes what killed
/// runs left in the same folder.
pub fn check_writable(path: &Path) -> Result<Place> {
    match target(path)? {
        Target::Device => Ok(Place::Device),
        Target::Regular(target, permissions) => {
            sweep(folder_of(&target));
            drop(temporary(path, &target, permissions)?);
            let linked = fs::symlink_metadata(path).is_ok_and(|there| there.is_symlink());
            Ok(if linked { Place::Link(target) } else { Place::File })
        }
    }
}

enum Target {
    /// Cannot be renamed over.
    Device,
    /// Where to rename to, and the permissions of what is there.
    Regular(PathBuf, Option<Permissions>),
}

fn target(path: &Path) -> Result<Target> {
    if path.file_name().is_none() {
        return Err(reason(path, "this names no file"));
    }
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => Err(reason(path, "this is a folder; give a file name in it")),
        Ok(there) if is_device(&there) => Ok(Target::Device),
        Ok(there) if !there.is_file() => {
            Err(reason(path, "this is a pipe, a socket or a disk; give the name of a file"))
        }
        Ok(there) if there.permissions().readonly() => Err(reason(path, "the file is read-only")),
        Ok(there) => {
            let target = fs::canonicalize(path).map_err(|e| refused(path, &e))?;
            Ok(Target::Regular(target, Some(there.permissions())))
        }
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(Target::Regular(end_of_links(path), None)),
        Err(e) => Err(refused(path, &e)),
    }
}

#[cfg(unix)]
fn is_device(there: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    there.file_type().is_char_device()
}

#[cfg(not(unix))]
fn is_device(_: &Metadata) -> bool {
    false
}

/// Where links lead that end at nothing.
fn end_of_links(path: &Path) -> PathBuf {
    let mut end = path.to_path_buf();
    // That they are no circle the system has said: nothing is there, rather than too many links.
    while let Ok(next) = fs::read_link(&end) {
        end = folder_of(&end).join(next);
    }
    end
}

fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

const PREFIX: &str = ".halflight-";
const SUFFIX: &str = ".part";

/// Removes temporary files whose writer is dead: those that nobody holds a lock on.
fn sweep(folder: &Path) {
    let ours = |name: &str| name.starts_with(PREFIX) && name.ends_with(SUFFIX);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let left =
            entry.file_name().to_str().is_some_and(ours) && entry.file_type().is_ok_and(|t| t.is_file());
        if left
            && let Ok(file) = File::options().read(true).write(true).open(entry.path())
            && file.try_lock().is_ok()
        {
            // What cannot be removed harms nobody.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A new temporary file with a lock on it, where the file system has locks.
fn locked(builder: &tempfile::Builder<'_, '_>, folder: &Path) -> io::Result<NamedTempFile> {
    loop {
        let file = builder.tempfile_in(folder)?;
        match file.as_file().try_lock() {
            Err(TryLockError::Error(_)) => return Ok(file),
            Ok(()) if fs::symlink_metadata(file.path()).is_ok() => return Ok(file),
            // Another run swept it away before the lock was on it.
            Ok(()) | Err(TryLockError::WouldBlock) => {}
        }
    }
}

fn temporary(path: &Path, target: &Path, permissions: Option<Permissions>) -> Result<NamedTempFile> {
    let folder = folder_of(target);
    if !folder.is_dir() {
        return Err(reason(path, &format!("there is no folder {}", folder.display())));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Of these bits the system takes away the umask, as with any new file; tempfile's own default is 0600.
        builder.permissions(Permissions::from_mode(0o666));
    }
    let file = locked(&builder, folder).map_err(|e| {
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
