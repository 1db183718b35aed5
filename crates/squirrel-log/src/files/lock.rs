//! One program at a time in a folder.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// Name of the file that is locked.
const NAME: &str = ".squirrel.lock";
/// Times that the file may go away between its opening and its lock.
const TRIES: u32 = 100;

/// A folder that no other program that asks writes into. The lock goes with this, or with its
/// process however that ends; the file that it leaves behind then locks nothing.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    // Its lock ends when it is closed, after the file has gone.
    _file: File,
}

impl Lock {
    /// # Errors
    /// [`ErrorKind::WouldBlock`] where another program has it; what the disk says.
    pub fn folder(folder: &Path) -> Result<Self> {
        let path = folder.join(NAME);
        for _ in 0..TRIES {
            let file = open(&path)?;
            match file.try_lock() {
                Ok(()) => {}
                // A file system without locks: whoever shares it has to take care.
                Err(TryLockError::Error(e)) if e.kind() == ErrorKind::Unsupported => {}
                Err(TryLockError::WouldBlock) => {
                    return Err(Error::new(
                        ErrorKind::WouldBlock,
                        "another squirrel is writing into this folder; wait for it, or give \
                         another --out",
                    ));
                }
                Err(TryLockError::Error(e)) => return Err(e),
            }
            // Whoever had it may have removed it since it was opened.
            if is_there(&file, &path) {
                return Ok(Self { path, _file: file });
            }
        }
        Err(ErrorKind::WouldBlock.into())
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // While it is locked, so that nobody else's is removed.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// A planted link is not followed: what it leads to would be made.
fn open(path: &Path) -> Result<File> {
    let is_link = std::fs::symlink_metadata(path).is_ok_and(|there| !there.is_file());
    if is_link {
        return Err(Error::new(ErrorKind::InvalidInput, format!("{NAME} is no file of its own")));
    }
    OpenOptions::new().create(true).truncate(false).write(true).open(path)
}

#[cfg(unix)]
fn is_there(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let ids = |m: std::fs::Metadata| (m.dev(), m.ino());
    let named = std::fs::symlink_metadata(path).map(ids);
    file.metadata().map(ids).is_ok_and(|own| named.is_ok_and(|named| named == own))
}

/// What is open cannot be removed there.
#[cfg(not(unix))]
fn is_there(_: &File, path: &Path) -> bool {
    path.is_file()
}
