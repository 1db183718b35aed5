//! What a board wrote down its serial line: the setup and the frames of its flight code, flown
//! again by the host.
//!
//! A board sends its inputs alone, each frame with the hash of all outputs so far
//! (`docs/embedding.md`). The flight code is a function of them, so the host computes every term of
//! every step, and the hash proves that it is what flew. From the first frame that was lost on the
//! line this no longer holds: from there on the log has inputs alone.

use super::ImportError;
use crate::FlightLog;
use crate::files;
use crate::flight_code::{FORMAT, Inputs, record_output};
use serde::Serialize;
use squirrel_core::estimate::navigator::Filter;
use squirrel_core::stack::wire::{HASH_START, Reader, Record, Wire, hash, written};
use squirrel_core::stack::{Stack, StackState};
use std::path::Path;

/// What was found in a board's log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoardReport {
    /// File name.
    pub file: String,
    /// Frames of the flight.
    pub frames: usize,
    /// First and last time of the board's clock, s.
    pub time_s: [f64; 2],
    /// Time up to which the outputs are the board's to the bit, s; `None` where not even the first
    /// is.
    pub outputs_until_s: Option<f64>,
    /// Records of the file that are damaged or belong to no setup.
    pub lost_records: usize,
}

/// One flight: a setup, and the frames up to the next.
struct Recorded {
    stack: Stack,
    frames: Vec<(squirrel_core::stack::SensorFrame, u64)>,
}

/// Flies what a board recorded again, as a flight log with inputs and, as far as they are proved,
/// outputs.
///
/// # Errors
/// The file cannot be read, has no flight, or more than one.
pub fn import_board(path: &Path) -> Result<(FlightLog, BoardReport), ImportError> {
    let file = path.display().to_string();
    let bytes =
        files::read(path).map_err(|source| ImportError::Read { file: file.clone(), source })?;
    let (flights, lost_records) = flights(&bytes);
    let board = |problem: String| ImportError::Board { file: file.clone(), problem };
    let [flight] = flights.as_slice() else {
        return Err(board(match flights.len() {
            0 => format!(
                "no frame behind a setup in {} bytes; {lost_records} records are damaged or belong to no setup",
                bytes.len()
            ),
            n => format!(
                "{n} flights; a log has one, so cut the file where the board was armed again"
            ),
        }));
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut log = FlightLog::default();
    for (key, value) in [("format", FORMAT), ("imported_from", name.as_str())] {
        log.metadata.insert(key.to_owned(), value.to_owned());
    }
    let rotors = flight.stack.vehicle().rotors().len();
    let estimates = flight.stack.parameters().navigation.filter != Filter::External;
    let (mut state, mut inputs) = (StackState::default(), Inputs::new(estimates));
    let (mut outputs, mut proved, mut outputs_until_s) = (HASH_START, true, None);
    let mut last_us = None;
    for (frame, expected) in &flight.frames {
        if last_us.is_some_and(|last| frame.time_us <= last) {
            return Err(board(format!(
                "time_us = {}: not after the frame before it",
                frame.time_us
            )));
        }
        last_us = Some(frame.time_us);
        let t = frame.time_us as f64 * 1e-6;
        inputs.record(&mut log, t, frame);
        if proved {
            let output = flight.stack.step(&mut state, frame);
            outputs = written(&output, |bytes| hash(outputs, bytes)).unwrap_or(outputs);
            proved = outputs == *expected;
            if proved {
                record_output(&mut log, t, t, &output, rotors, None);
                outputs_until_s = Some(t);
            }
        }
    }
    let time_s = [flight.frames.first(), flight.frames.last()]
        .map(|frame| frame.map_or(f64::NAN, |(frame, _)| frame.time_us as f64 * 1e-6));
    let report = BoardReport {
        file: name,
        frames: flight.frames.len(),
        time_s,
        outputs_until_s,
        lost_records,
    };
    Ok((log, report))
}

/// Flights that have frames, and the number of records that are damaged or belong to no setup.
fn flights(bytes: &[u8]) -> (Vec<Recorded>, usize) {
    let (mut all, mut lost): (Vec<Recorded>, usize) = (Vec::new(), 0);
    // Zeros end records and are nowhere else; behind the last there is the begin of one that was
    // cut off, or nothing.
    for framed in bytes.split(|byte| *byte == 0).filter(|framed| !framed.is_empty()) {
        let record = cobs::decode_vec(framed).ok().and_then(|record| {
            let mut reader = Reader::new(&record);
            Record::take(&mut reader).filter(|_| reader.is_empty())
        });
        match (record, all.last_mut()) {
            (Some(Record::Setup(stack)), _) => all.push(Recorded { stack, frames: Vec::new() }),
            (Some(Record::Frame(frame, outputs)), Some(flight)) => {
                flight.frames.push((frame, outputs));
            }
            (Some(Record::Frame(..)) | None, _) => lost += 1,
        }
    }
    all.retain(|flight| !flight.frames.is_empty());
    (all, lost)
}

impl std::fmt::Display for BoardReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [from_s, to_s] = self.time_s;
        write!(f, "{}: {} frames, {from_s:.3} to {to_s:.3} s; ", self.file, self.frames)?;
        f.write_str(&match self.outputs_until_s {
            Some(t) if t == to_s => "every output is the board's to the bit".to_owned(),
            Some(t) => {
                format!("outputs are the board's to the bit up to {t:.3} s and left out from there")
            }
            None => "no output is the board's; they are left out".to_owned(),
        })?;
        if self.lost_records > 0 {
            write!(f, "; {} records lost", self.lost_records)?;
        }
        Ok(())
    }
}
