//! Files that appear under their name only when they are whole, and which paths are one file.

use std::fs::OpenOptions;
use std::io::{Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};

/// Links to links that are followed; Linux gives up here, too.
const LINKS_MAX: usize = 40;

/// Where what is written under a path goes.
enum Place {
    /// A file, or none yet: no link any more.
    File(PathBuf),
    /// A device, a pipe, or what this process has open.
    Open(PathBuf),
    Stdout,
    Stderr,
}

/// Writes a file under a temporary name beside it, then renames: a reader never sees half of it. A
/// link stays, and the file that it leads to is written. A device or a pipe is written to, and so
/// is what is already open (`/dev/stdout`, `/dev/fd/3`), behind what is in it.
///
/// # Errors
/// What the disk says; nothing half-written stays behind.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<()> {
    let path = match place(path)? {
        Place::File(path) => path,
        Place::Open(path) => return OpenOptions::new().append(true).open(path)?.write_all(content),
        // Opened anew, a file behind them would be written from its begin, or over what is printed
        // later.
        Place::Stdout => {
            let mut stdout = std::io::stdout().lock();
            return stdout.write_all(content).and_then(|()| stdout.flush());
        }
        Place::Stderr => return std::io::stderr().write_all(content),
    };
    let partial = partial(&path)?;
    std::fs::write(&partial, content).and_then(|()| std::fs::rename(&partial, &path)).inspect_err(
        |_| {
            // That the removal may fail too adds nothing to the first error.
            let _ = std::fs::remove_file(&partial);
        },
    )
}

/// Whether [`write_whole`] could write there, to be asked before long work.
///
/// # Errors
/// What the disk says.
pub fn writable(path: &Path) -> Result<()> {
    let Place::File(path) = place(path)? else { return Ok(()) };
    let partial = partial(&path)?;
    std::fs::write(&partial, []).and_then(|()| std::fs::remove_file(&partial))
}

/// A file by what it is and not by its path: equal for all paths of one file, through links of both
/// kinds.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct FileId(Id);

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Id {
    /// Device and inode.
    #[cfg(unix)]
    Inode(u64, u64),
    /// Of a file that does not exist, or of any where there are no inodes: absolute, without links.
    Path(PathBuf),
}

impl FileId {
    /// The file that reading a path reads; `None` for a device or a pipe, which are nobody's own.
    pub fn read(path: &Path) -> Option<Self> {
        match std::fs::metadata(path) {
            Ok(there) if !there.is_file() && !there.is_dir() => None,
            #[cfg(unix)]
            Ok(there) => {
                use std::os::unix::fs::MetadataExt;
                Some(Self(Id::Inode(there.dev(), there.ino())))
            }
            _ => Some(Self(Id::Path(absolute(path)))),
        }
    }

    /// The files that [`write_whole`] changes or replaces: the one under the path, and the
    /// temporary one. None for what is written to.
    pub fn written(path: &Path) -> Vec<Self> {
        // Where the path leads nowhere, writing fails and changes nothing.
        let Ok(Place::File(path)) = place(path) else { return Vec::new() };
        [partial(&path).ok(), Some(path)]
            .iter()
            .flatten()
            .filter_map(|path| Self::read(path))
            .collect()
    }
}

/// Follows links, up to what this process has open: that is told by a link, too, which does not
/// always lead to a file.
fn place(path: &Path) -> Result<Place> {
    let mut path = path.to_owned();
    for _ in 0..LINKS_MAX {
        if let Some(open) = open(&path) {
            return Ok(open);
        }
        match std::fs::symlink_metadata(&path) {
            Ok(there) if there.is_symlink() => {
                path = path.parent().unwrap_or(&path).join(std::fs::read_link(&path)?);
            }
            Ok(there) if there.is_file() || there.is_dir() => return Ok(Place::File(path)),
            Ok(_) => return Ok(Place::Open(path)),
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Place::File(path)),
            Err(e) => return Err(e),
        }
    }
    Err(Error::new(ErrorKind::InvalidInput, "too many links, or links in a circle"))
}

/// What a process has open under a number: `/dev/fd/1`, `/proc/self/fd/1`.
fn open(path: &Path) -> Option<Place> {
    let number: u32 = path.file_name()?.to_str()?.parse().ok()?;
    let folder = path.parent()?.canonicalize().ok()?;
    let is_ours = ["/dev/fd", "/proc/self/fd"]
        .iter()
        .any(|own| Path::new(own).canonicalize().is_ok_and(|own| own == folder));
    let is_open = is_ours || (folder.starts_with("/proc") && folder.ends_with("fd"));
    match number {
        1 if is_ours => Some(Place::Stdout),
        2 if is_ours => Some(Place::Stderr),
        _ => is_open.then(|| Place::Open(path.to_owned())),
    }
}

/// A path from the root without links, as far as it exists.
fn absolute(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let there = path
        .ancestors()
        .find_map(|there| Some((there.canonicalize().ok()?, path.strip_prefix(there).ok()?)));
    there.map_or_else(|| path.clone(), |(there, rest)| there.join(rest))
}

/// The temporary name.
fn partial(path: &Path) -> Result<PathBuf> {
    let name =
        path.file_name().ok_or_else(|| Error::new(ErrorKind::InvalidInput, "not a file name"))?;
    let mut name = name.to_owned();
    name.push(".partial");
    Ok(path.with_file_name(name))
}
