//! Where a path leads, and which paths are one file.

use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// Links to links that are followed; Linux gives up here, too.
const LINKS_MAX: usize = 40;

/// Where what is written under a path goes.
#[derive(Debug)]
pub(super) enum Place {
    /// A file, or none yet: no link any more.
    File(PathBuf),
    /// A device, a pipe, or what this process has open.
    Open(PathBuf),
    Stdout,
    Stderr,
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

    /// The file that [`write_whole`](super::write_whole) replaces; `None` for what is written to.
    pub fn written(path: &Path) -> Option<Self> {
        // Where the path leads nowhere, writing fails and changes nothing.
        let Ok(Place::File(path)) = place(path) else { return None };
        Self::read(&path)
    }
}

/// Follows links, up to what this process has open: that is told by a link, too, which does not
/// always lead to a file.
pub(super) fn place(path: &Path) -> Result<Place> {
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
