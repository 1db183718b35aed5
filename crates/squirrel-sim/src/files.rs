//! Files that appear under their name only when they are whole.

use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// Writes a file under a temporary name beside it, then renames: a reader never sees half of it. A device or a pipe is written to, never replaced.
///
/// # Errors
/// What the disk says; nothing half-written stays behind.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<()> {
    if is_device(path) {
        return std::fs::write(path, content);
    }
    let partial = partial(path)?;
    std::fs::write(&partial, content).and_then(|()| std::fs::rename(&partial, path)).inspect_err(|_| {
        // That the removal may fail too adds nothing to the first error.
        let _ = std::fs::remove_file(&partial);
    })
}

/// Whether [`write_whole`] could write there, to be asked before long work.
///
/// # Errors
/// What the disk says.
pub fn writable(path: &Path) -> Result<()> {
    if is_device(path) {
        return Ok(());
    }
    let partial = partial(path)?;
    std::fs::write(&partial, []).and_then(|()| std::fs::remove_file(&partial))
}

/// Something that is there and is no file, such as `/dev/null` or a pipe.
fn is_device(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir())
}

/// The temporary name.
fn partial(path: &Path) -> Result<PathBuf> {
    let name = path.file_name().ok_or_else(|| Error::new(ErrorKind::InvalidInput, "not a file name"))?;
    let mut name = name.to_owned();
    name.push(".partial");
    Ok(path.with_file_name(name))
}
