//! A log in pieces: written while it is flown, and read in the order in which it was written, so
//! that of a long flight a few seconds are in memory.

use std::collections::BTreeMap;
use std::path::Path;

use mcap::MAGIC;
use mcap::records::op;

use super::envelope::{self, Walk};
use super::read::{RECORD_MAX_BYTES, Reader};
use super::write::{Encoder, HEAD_S};
use super::{FlightLog, LogError, check};
use crate::files::{self, Budget, Growing};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

/// How long a sample waits for those of other sources that are stamped before it but come later, s:
/// clocks go wrong by seconds. What is later still is written where it comes.
const WAIT_S: f64 = 10.0;

/// How many samples of a source are before a piece, and the time of the last of them, s.
#[derive(Default)]
struct Before(BTreeMap<String, (usize, f64)>);

impl Before {
    /// The rules of a log, kept across its pieces.
    fn check(&mut self, file: &str, piece: &FlightLog) -> Result<(), LogError> {
        check::check_piece(file, piece, |name| self.0.get(name).copied())?;
        for (name, source) in &piece.sources {
            let Some(last_s) = source.time_s.last() else { continue };
            let before = self.0.entry(name.clone()).or_default();
            *before = (before.0 + source.time_s.len(), *last_s);
        }
        Ok(())
    }
}

/// A flight log on its way into a file while it is flown. The bytes are those that
/// [`FlightLog::write`] gives the whole log. Dropped before its end, it leaves nothing behind.
pub struct LogWriter {
    file: String,
    encoder: Encoder<Growing>,
    /// What waits.
    log: FlightLog,
    before: Before,
    /// Of the first sample, s.
    start_s: Option<f64>,
    /// Whether what the head needs has been there.
    has_head: bool,
}

impl std::fmt::Debug for LogWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LogWriter").field("file", &self.file).finish_non_exhaustive()
    }
}

impl LogWriter {
    /// Begins a file.
    ///
    /// # Errors
    /// [`LogError`] as [`FlightLog::write`].
    pub fn at(path: &Path, metadata: &BTreeMap<String, String>) -> Result<Self, LogError> {
        let file = path.display().to_string();
        let encoder = Encoder::at(path, &file, metadata)?;
        let (log, before) = (FlightLog::default(), Before::default());
        Ok(Self { file, encoder, log, before, start_s: None, has_head: false })
    }

    /// Takes the samples that follow those before.
    ///
    /// * `now_s` - time of the flight: what is stamped much earlier has come
    ///
    /// # Errors
    /// [`LogError`] as [`FlightLog::write`].
    pub fn push(&mut self, piece: FlightLog, now_s: f64) -> Result<(), LogError> {
        self.before.check(&self.file, &piece)?;
        self.log.append(piece);
        let times = self.log.sources.values().filter_map(|source| source.time_s.first().copied());
        let first_s = times.min_by(f64::total_cmp);
        let Some(start_s) = self.start_s.or(first_s) else { return Ok(()) };
        self.start_s = Some(start_s);
        let settled_s = now_s - WAIT_S;
        self.has_head |= settled_s >= start_s + HEAD_S;
        if !self.has_head {
            return Ok(());
        }
        let at = |error| LogError::Io { file: self.file.clone(), error };
        self.encoder.put(&self.log, settled_s).map_err(at)?;
        drop(self.log.split_before(settled_s));
        Ok(())
    }

    /// Ends the file, which takes its name.
    ///
    /// # Errors
    /// [`LogError`] as [`FlightLog::write`].
    pub fn finish(mut self) -> Result<(), LogError> {
        self.encoder
            .put(&self.log, f64::INFINITY)
            .and_then(|()| self.encoder.finish())
            .map_err(|error| LogError::Io { file: self.file, error })
    }
}

/// A flight log read piece by piece.
pub struct LogReader {
    file: String,
    walk: Walk<BufReader<File>>,
    reader: Reader<'static>,
    before: Before,
    metadata: BTreeMap<String, String>,
    body: Vec<u8>,
}

impl std::fmt::Debug for LogReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LogReader").field("file", &self.file).finish_non_exhaustive()
    }
}

impl LogReader {
    /// Opens a log whose bytes are those that were written, and reads its metadata; `None` for what
    /// cannot be read so: a pipe, a log that was cut, or one of another program that has its metadata
    /// behind its samples. [`FlightLog::read`] takes that, or says what is wrong.
    ///
    /// # Errors
    /// [`LogError`] as [`FlightLog::read`].
    pub fn open(path: &Path) -> Result<Option<Self>, LogError> {
        let name = path.display().to_string();
        let at = |error| LogError::Io { file: name.clone(), error };
        let mut file = files::open(path).map_err(at)?;
        let about = file.metadata().map_err(at)?;
        if !about.is_file() {
            return Ok(None);
        }
        let bytes = about.len();
        let mut begin = [0; MAGIC.len()];
        if bytes < begin.len() as u64 || file.read_exact(&mut begin).is_err() || begin != *MAGIC {
            return Ok(None);
        }
        file.seek(SeekFrom::Start(0)).map_err(at)?;
        if envelope::check(&mut BufReader::new(&file), bytes).is_err() {
            return Ok(None);
        }
        let walk = Walk::new(BufReader::new(file), bytes);
        // What comes out of the file is bounded by its size, as where all of it is held.
        let reader = Reader::new(&name, &|_| true, Budget::by_size(bytes));
        let (body, metadata) = (Vec::new(), BTreeMap::new());
        let before = Before::default();
        let mut log = Self { file: name, walk, reader, before, metadata, body };
        log.next_frame(false)?;
        let Some(metadata) = log.reader.metadata()? else { return Ok(None) };
        log.metadata = metadata;
        Ok(Some(log))
    }

    /// What is said of the flight.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.metadata
    }

    /// The samples that come next; `None` at the end.
    ///
    /// # Errors
    /// [`LogError`] as [`FlightLog::read`].
    pub fn next_piece(&mut self) -> Result<Option<FlightLog>, LogError> {
        let mut is_more = true;
        while is_more {
            is_more = self.next_frame(true)?;
            let piece = self.reader.take();
            if !piece.sources.is_empty() {
                self.before.check(&self.file, &piece)?;
                return Ok(Some(piece));
            }
        }
        match self.reader.metadata()? {
            Some(metadata) if metadata == self.metadata => Ok(None),
            _ => Err(LogError::Corrupt {
                file: self.file.clone(),
                what: "metadata behind the samples".to_owned(),
            }),
        }
    }

    /// Reads up to a chunk, or up to its end; `false` at the end of the file.
    fn next_frame(&mut self, with_chunk: bool) -> Result<bool, LogError> {
        let file = self.file.clone();
        let at = |error| LogError::Io { file: file.clone(), error };
        while let Some(head) = self.walk.head().map_err(at)? {
            let is_chunk = head.opcode == op::CHUNK;
            if is_chunk && !with_chunk {
                return Ok(true);
            }
            if !Reader::READS.contains(&head.opcode) && !is_chunk {
                self.walk.skip(head);
                continue;
            }
            if head.body_bytes > RECORD_MAX_BYTES as u64 {
                let what = format!("the record at byte {} is too long", head.start);
                return Err(LogError::Corrupt { file: self.file.clone(), what });
            }
            self.walk.record(head, &mut self.body).map_err(at)?;
            self.reader.frame(head.frame(&self.body))?;
            if is_chunk {
                return Ok(true);
            }
        }
        Ok(false)
    }
}
