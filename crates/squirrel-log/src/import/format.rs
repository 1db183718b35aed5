//! What kind of log a file is: by its first bytes, whatever it is called.

use std::io;
use std::path::Path;

use super::ardupilot_file::is_bin;
use super::autopilot::Firmware;
use super::blackbox_file::is_blackbox;
use super::error::ImportError;
use super::ulog_file::is_ulog;
use super::usd_format::is_usd;
use crate::files;

/// Bytes that tell every kind.
const START_BYTES: u64 = 64;
const PARQUET: &[u8] = b"PAR1";
/// By itself, and behind the text that MATLAB puts before it.
const HDF5: [&[u8]; 2] = [b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3 MAT-file"];

/// What a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Csv,
    Parquet,
    /// MATLAB up to v7.
    Mat,
    /// HDF5, MATLAB's v7.3 among it.
    Hdf5,
    Ulog,
    Mcap,
    /// Micro-SD log of a Crazyflie.
    Usd,
    /// Dataflash log.
    ArduPilot,
    /// Betaflight and its kin.
    Blackbox,
}

impl Format {
    /// Whose channels need no map.
    pub(super) fn firmware(self) -> Option<Firmware> {
        Some(match self {
            Self::Ulog => Firmware::Px4,
            Self::ArduPilot => Firmware::ArduPilot,
            Self::Blackbox => Firmware::Blackbox,
            Self::Csv | Self::Parquet | Self::Mat | Self::Hdf5 | Self::Mcap | Self::Usd => {
                return None;
            }
        })
    }
}

/// The format of a file: by its first bytes, or, where these say nothing, as text has none and as
/// a damaged file does, by its extension.
///
/// # Errors
/// Neither says it, or the file cannot be read or is empty.
pub(super) fn format(path: &Path) -> Result<Format, ImportError> {
    check_known(path)?;
    let file = path.display().to_string();
    let start = match start(path) {
        Ok(start) => start,
        Err(source) => return Err(ImportError::Read { file, source }),
    };
    let by_content = match start.as_slice() {
        start if is_ulog(start) => Some(Format::Ulog),
        start if is_bin(start) => Some(Format::ArduPilot),
        start if is_blackbox(start) => Some(Format::Blackbox),
        start if start.starts_with(mcap::MAGIC) => Some(Format::Mcap),
        start if start.starts_with(PARQUET) => Some(Format::Parquet),
        start if HDF5.iter().any(|magic| start.starts_with(magic)) => Some(Format::Hdf5),
        [first, ..] if is_usd(*first) => Some(Format::Usd),
        _ => None,
    };
    if let Some(format) = by_content {
        return Ok(format);
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "csv" if is_utf16(&start) => {
            let problem = "is UTF-16 text; import reads UTF-8: `iconv -f UTF-16 -t UTF-8`";
            Err(ImportError::Damaged { file, problem: problem.to_owned() })
        }
        "csv" => Ok(Format::Csv),
        "parquet" => Ok(Format::Parquet),
        "mat" => Ok(Format::Mat),
        "h5" | "hdf5" => Ok(Format::Hdf5),
        "ulg" => Ok(Format::Ulog),
        "mcap" => Ok(Format::Mcap),
        _ if start.is_empty() => Err(ImportError::Empty { file }),
        "bin" => Ok(Format::ArduPilot),
        "bbl" | "bfl" => Ok(Format::Blackbox),
        _ => Err(ImportError::UnknownFormat { file }),
    }
}

/// Whether a text has two bytes a letter: by its mark, or as every other byte is zero.
fn is_utf16(start: &[u8]) -> bool {
    let is_letter = |byte: u8| (b' '..=b'~').contains(&byte);
    match *start {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => true,
        [a, 0, b, 0, ..] | [0, a, 0, b, ..] => is_letter(a) && is_letter(b),
        _ => false,
    }
}

/// Refuses files that another program makes readable, by name.
///
/// # Errors
/// [`ImportError::Damaged`] with what to do, [`ImportError::Read`].
pub(super) fn check_known(path: &Path) -> Result<(), ImportError> {
    let file = path.display().to_string();
    let first = start(path).map_err(|source| ImportError::Read { file: file.clone(), source })?;
    match CONVERTIBLE.iter().find(|(magic, _)| first.starts_with(magic)) {
        Some((_, problem)) => Err(ImportError::Damaged { file, problem: (*problem).to_owned() }),
        None => Ok(()),
    }
}

/// Whether a file begins with these bytes, 16 at most.
///
/// # Errors
/// [`ImportError::Read`].
pub(super) fn starts_with(path: &Path, magic: &[u8]) -> Result<bool, ImportError> {
    match start(path) {
        Ok(first) => Ok(first.starts_with(magic)),
        Err(source) => Err(ImportError::Read { file: path.display().to_string(), source }),
    }
}

/// How a file begins that import does not read, and what makes one of it that it does.
const CONVERTIBLE: [(&[u8], &str); 2] = [
    (
        b"#ROSBAG V",
        "a ROS 1 bag; import reads ROS 2's MCAP: `pip install rosbags`, then \
         `rosbags-convert --src FLIGHT.bag --dst FOLDER --dst-storage mcap`",
    ),
    (
        b"SQLite format 3",
        "a ROS 2 bag in SQLite; import reads MCAP: `pip install rosbags`, then \
         `rosbags-convert --src FOLDER --dst OTHER --dst-storage mcap`",
    ),
];

fn start(path: &Path) -> io::Result<Vec<u8>> {
    files::begin(path, START_BYTES)
}
