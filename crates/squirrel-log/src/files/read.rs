//! Files are opened here, and no more of one is read than is meant to be.

use super::budget::{RAISED_BY, TEXT_MAX_BYTES, content_max_bytes, megabytes};
use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Opens a file, or whatever else a path leads to, for reading.
///
/// # Errors
/// What the disk says, and of a file that is not there where it was looked for; a folder.
pub fn open(path: &Path) -> Result<File> {
    let file = File::open(path).map_err(|error| told_where(path, error))?;
    if file.metadata()?.is_dir() {
        return Err(Error::new(ErrorKind::IsADirectory, "is a folder, must be a file"));
    }
    Ok(file)
}

/// A name without a folder does not say where the program looks for it, and one with folders not
/// which of them is missing.
fn told_where(path: &Path, error: Error) -> Error {
    if error.kind() != ErrorKind::NotFound || path.is_symlink() {
        return error;
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        Some(_) => std::env::current_dir().unwrap_or_default(),
        None => return error,
    };
    let missing = folder.ancestors().take_while(|folder| !folder.as_os_str().is_empty());
    let reason = match missing.take_while(|folder| !folder.exists()).last() {
        Some(missing) => format!("No such file: there is no folder {}", missing.display()),
        None => format!("No such file in {}", folder.display()),
    };
    Error::new(ErrorKind::NotFound, reason)
}

/// All of a file: a log, weights, a journal.
///
/// # Errors
/// What the disk says; a file larger than what a content may be ([`Budget`](super::Budget)).
pub fn read(path: &Path) -> Result<Vec<u8>> {
    up_to(path, content_max_bytes(), RAISED_BY)
}

/// A text that people write: a vehicle, a scenario, an import map.
///
/// # Errors
/// What the disk says; a file larger than any text that somebody wrote, or that is no text.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(up_to(path, TEXT_MAX_BYTES, "")?)
        .map_err(|_| Error::new(ErrorKind::InvalidData, "stream did not contain valid UTF-8"))
}

/// The first bytes of a file, by which its kind is told.
///
/// # Errors
/// What the disk says.
pub fn begin(path: &Path, bytes: u64) -> Result<Vec<u8>> {
    let mut begin = Vec::new();
    open(path)?.take(bytes).read_to_end(&mut begin)?;
    Ok(begin)
}

/// * `raised_by` - what is said of how to read more
fn up_to(path: &Path, most: u64, raised_by: &str) -> Result<Vec<u8>> {
    let file = open(path)?;
    let too_large = || {
        let most = megabytes(most);
        let problem = format!("is larger than {most}, the most that is read{raised_by}");
        Error::new(ErrorKind::FileTooLarge, problem)
    };
    let length = file.metadata()?.len();
    if length > most {
        return Err(too_large());
    }
    let mut content = Vec::new();
    content.try_reserve_exact(usize::try_from(length).map_err(|_| too_large())?)?;
    // A pipe or a device has no length before its end.
    file.take(most + 1).read_to_end(&mut content)?;
    if content.len() as u64 > most {
        return Err(too_large());
    }
    Ok(content)
}
