//! Logs of autopilots, whose channels need no map: PX4, ArduPilot and the blackbox of Betaflight
//! and its kin.

mod ardupilot;
mod blackbox;
mod collect;
mod px4;
mod rates;

use std::collections::BTreeMap;
use std::path::Path;

use super::ardupilot_file::BinLog;
use super::blackbox_file::BlackboxLog;
use super::error::ImportError;
use super::meter::Meter;
use super::report::{FileReport, ImportReport};
use super::rows::Rows;
use super::ulog_file::UlogLog;
use crate::FlightLog;
use collect::Collected;

/// Whose log it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Firmware {
    Px4,
    ArduPilot,
    Blackbox,
}

/// Imports a log: its channels, and its parameters as metadata `parameters_json`.
///
/// # Errors
/// A file that contradicts its format, or has none of the channels.
pub(super) fn import(
    firmware: Firmware,
    path: &Path,
    bytes: &[u8],
    meter: &Meter,
) -> Result<(FlightLog, ImportReport), ImportError> {
    let file = path.display().to_string();
    let damaged = |problem: String| ImportError::Damaged { file: file.clone(), problem };
    let (mut collected, mut notes) = (Collected::default(), Vec::new());
    let (kind, parameters, rows, bytes_cut);
    match firmware {
        Firmware::Px4 => {
            let log = UlogLog::scan(bytes, None).map_err(damaged)?;
            px4::collect(bytes, &log, &mut collected, &mut notes);
            (kind, rows, bytes_cut) = ("PX4 ULog".to_owned(), log.message_count(), log.bytes_cut);
            parameters = log.parameters;
        }
        Firmware::ArduPilot => {
            let log = BinLog::scan(bytes).map_err(damaged)?;
            parameters = log.parameters(bytes);
            let own = ardupilot::Log { bytes, messages: &log, parameters: &parameters };
            ardupilot::collect(&own, &mut collected, &mut notes);
            if log.bytes_lost > 0 {
                notes.push(skipped(log.bytes_lost, bytes.len()));
            }
            (kind, rows) = ("ArduPilot dataflash".to_owned(), log.message_count());
            bytes_cut = log.bytes_cut;
        }
        Firmware::Blackbox => {
            let log = BlackboxLog::open(bytes).map_err(damaged)?;
            let frames = blackbox::read(&log);
            blackbox::collect(&log, &frames, &mut collected, &mut notes);
            if frames.walked.bytes_lost > 0 {
                notes.push(skipped(frames.walked.bytes_lost, bytes.len()));
            }
            let firmware = log.header.get("Firmware revision").map_or("", |text| text);
            (kind, rows) = (format!("blackbox, {firmware}"), frames.len());
            (parameters, bytes_cut) = (log.parameters(), 0);
        }
    }
    meter.add(bytes.len());
    let (mut log, channels, zero_us) = collected.finish();
    if channels.is_empty() {
        return Err(damaged(format!("{kind}: no channel that import knows in {rows} messages")));
    }
    notes.extend(rates::notes(firmware, &channels));
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let json = serde_json::to_string(&parameters).map_err(|e| damaged(e.to_string()))?;
    log.metadata = BTreeMap::from([
        ("imported_from".to_owned(), name.clone()),
        ("log_kind".to_owned(), kind.clone()),
        ("parameters_json".to_owned(), json),
        ("time_zero_s".to_owned(), (zero_us / 1e6).to_string()),
    ]);
    let bytes_cut = bytes_cut as u64;
    let report = FileReport {
        file: format!("{name} ({kind})"),
        topic: None,
        instance: None,
        rows,
        rows_masked: 0,
        bytes_cut,
    };
    Ok((log, ImportReport { files: vec![report], channels, notes, ..ImportReport::default() }))
}

fn skipped(lost: usize, all: usize) -> String {
    format!("{lost} of {all} bytes are no whole message and were skipped")
}

/// The parameters of a log by name: of PX4 and ArduPilot as they were last, of a blackbox log the
/// numbers of its header.
///
/// # Errors
/// A file that contradicts its format.
pub(super) fn parameters(
    firmware: Firmware,
    path: &Path,
    bytes: &[u8],
) -> Result<BTreeMap<String, f64>, ImportError> {
    match firmware {
        Firmware::Px4 => UlogLog::scan(bytes, Some("")).map(|log| log.parameters),
        Firmware::ArduPilot => BinLog::scan(bytes).map(|log| log.parameters(bytes)),
        Firmware::Blackbox => BlackboxLog::open(bytes).map(|log| log.parameters()),
    }
    .map_err(|problem| ImportError::Damaged { file: path.display().to_string(), problem })
}
