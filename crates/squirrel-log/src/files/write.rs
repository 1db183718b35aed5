//! Files that appear under their name only when they are whole.

use super::place::{Place, place};
use std::collections::hash_map::RandomState;
use std::fs::{File, OpenOptions};
use std::hash::BuildHasher;
use std::io::{BufWriter, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};

/// Names that are tried before giving up: the first is free but for an attacker who guesses it.
const NAMES_TRIED: u32 = 16;

/// Writes a file under a temporary name beside it, then renames: a reader never sees half of it, and
/// of several who write it one wins whole. A link stays, and the file that it leads to is written;
/// a file that is there keeps its mode. A device or a pipe is written to, and so is what is already
/// open (`/dev/stdout`, `/dev/fd/3`), behind what is in it.
///
/// # Errors
/// What the disk says; nothing half-written stays behind.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<()> {
    match place(path)? {
        Place::File(path) => {
            let mut partial = Partial::beside(&path)?;
            partial.file.write_all(content)?;
            partial.becomes(&path)
        }
        open => write_open(open, content),
    }
}

/// What has no name to take: content goes behind what is there.
fn write_open(place: Place, content: &[u8]) -> Result<()> {
    match place {
        Place::File(path) | Place::Open(path) => {
            OpenOptions::new().append(true).open(path)?.write_all(content)
        }
        // Opened anew, a file behind them would be written from its begin, or over what is printed
        // later.
        Place::Stdout => {
            let mut stdout = std::io::stdout().lock();
            stdout.write_all(content).and_then(|()| stdout.flush())
        }
        Place::Stderr => std::io::stderr().write_all(content),
    }
}

/// A file that is written piece by piece, and has its name when all of it is there, as
/// [`write_whole`] gives it. Dropped before, it leaves nothing behind.
#[derive(Debug)]
pub struct Growing(To);

#[derive(Debug)]
enum To {
    File(BufWriter<Partial>, PathBuf),
    /// It gets all at the end: what is in a pipe cannot be taken back.
    Open(Vec<u8>, Place),
}

impl Growing {
    /// With nothing in it yet.
    ///
    /// # Errors
    /// What the disk says.
    pub fn at(path: &Path) -> Result<Self> {
        Ok(Self(match place(path)? {
            Place::File(path) => To::File(BufWriter::new(Partial::beside(&path)?), path),
            open => To::Open(Vec::new(), open),
        }))
    }

    /// All of it is there: it takes its name.
    ///
    /// # Errors
    /// What the disk says.
    pub fn becomes_whole(self) -> Result<()> {
        match self.0 {
            To::File(file, path) => {
                file.into_inner().map_err(std::io::IntoInnerError::into_error)?.becomes(&path)
            }
            To::Open(content, place) => write_open(place, &content),
        }
    }
}

impl Write for Growing {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        match &mut self.0 {
            To::File(file, _) => file.write(bytes),
            To::Open(content, _) => content.write(bytes),
        }
    }

    fn flush(&mut self) -> Result<()> {
        match &mut self.0 {
            To::File(file, _) => file.flush(),
            To::Open(..) => Ok(()),
        }
    }
}

/// Whether [`write_whole`] could write there, to be asked before long work.
///
/// # Errors
/// What the disk says.
pub fn writable(path: &Path) -> Result<()> {
    let Place::File(path) = place(path)? else { return Ok(()) };
    Partial::beside(&path).map(drop)
}

/// Opens a file to be written behind what is in it, cut to a length before; it is made where there
/// is none.
///
/// # Errors
/// What the disk says.
pub fn append(path: &Path, length: u64) -> Result<File> {
    let file = OpenOptions::new().create(true).append(true).open(path)?;
    file.set_len(length)?;
    Ok(file)
}

/// Makes a folder, and those that it is in.
///
/// # Errors
/// What the disk says.
pub fn folder(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path)
}

/// A file under a temporary name, which is gone with this unless it got its own.
#[derive(Debug)]
struct Partial {
    file: File,
    path: PathBuf,
    is_left: bool,
}

impl Partial {
    /// In the folder of another, under a name that nobody foresees, and made here: whatever has that
    /// name already, a user's file or a planted link, is left alone.
    fn beside(path: &Path) -> Result<Self> {
        // What has no name cannot be replaced: `..`, `/`.
        path.file_name().ok_or(ErrorKind::InvalidInput)?;
        let before = std::fs::metadata(path).ok();
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        if before.is_some() {
            // Nobody reads it before it has the mode of the other.
            std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        }
        let mut tried = 0;
        loop {
            let path = path.with_file_name(format!(".squirrel-{:016x}.partial", unforeseen(tried)));
            match options.open(&path) {
                Ok(file) => {
                    let partial = Self { file, path, is_left: true };
                    before.as_ref().map_or(Ok(()), |before| partial.take_mode(before))?;
                    return Ok(partial);
                }
                Err(e) if e.kind() == ErrorKind::AlreadyExists && tried < NAMES_TRIED => tried += 1,
                Err(e) => return Err(e),
            }
        }
    }

    #[cfg(unix)]
    fn take_mode(&self, before: &std::fs::Metadata) -> Result<()> {
        use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
        // Only who owns it or may do anything can give a file away; to others it is theirs.
        let _ = fchown(&self.file, Some(before.uid()), Some(before.gid()));
        let mode = before.permissions().mode() & 0o777;
        self.file.set_permissions(std::fs::Permissions::from_mode(mode))
    }

    #[cfg(not(unix))]
    fn take_mode(&self, before: &std::fs::Metadata) -> Result<()> {
        self.file.set_permissions(before.permissions())
    }

    /// Takes a name, once all of it is on the disk: after a power cut, too, a name is that of the old
    /// file or of the new one.
    fn becomes(mut self, path: &Path) -> Result<()> {
        self.file.sync_all()?;
        std::fs::rename(&self.path, path)?;
        self.is_left = false;
        // The folder, where a system can do that; the file is whole without.
        if let Some(folder) = path.parent() {
            let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            let _ = File::open(folder).and_then(|folder| folder.sync_all());
        }
        Ok(())
    }
}

impl Write for Partial {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.file.flush()
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if self.is_left {
            // That the removal may fail too adds nothing to the first error.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// A number from the keys that the system gives each process, another one at each call.
fn unforeseen(tried: u32) -> u64 {
    RandomState::new().hash_one((std::process::id(), tried))
}
