//! Import of foreign flight logs: CSV, Parquet, MATLAB, ULog, dataflash, blackbox, MCAP and Crazyflie
//! micro-SD files become a [`FlightLog`] in NED, FRD, SI and radians by a TOML map. What kind a file
//! is, its first bytes say, and its extension where it is text. Logs of autopilots need no map:
//! [`import_without_map`]; ROS 2 bags make their own: [`map_of_bag`].
//!
//! `docs/guide/import.md` has every key of a map with an example. The map names, for each canonical
//! channel, the columns, their scale and offset, their frame, and how time is written:
//!
//! ```toml
//! keep = "pz > 0.4"                     # rows worth importing, as a condition on source columns
//! [[source]]
//! file = "imu.csv"                      # inside the flight folder; left out when PATH is the file itself
//! time = { column = "t", unit = "us", offset_s = 0.0 }
//! [source.channels]
//! "imu.omega_body_rad_s"          = { columns = ["gx", "gy", "gz"], body = "flu", scale = 0.0174532925 }
//! "attitude.q_ned_from_body_wxyz" = { columns = ["qx", "qy", "qz", "qw"], order = "xyzw", world = "nwu", body = "flu", direction = "world_from_body" }
//! "rotor.command"                 = { columns = ["m1", "m2", "m3", "m4"], rotors = [1, 3, 2, 4] }
//! "battery.voltage_v"             = { columns = ["vbat"], repeats = "forward_filled" }
//! "attitude.yaw_rad"              = { columns = ["yaw"], optional = true }
//! ```
//!
//! ULog files of PX4 (`.ulg`), MCAP files (`.mcap`: JSON, ROS 2's CDR, protobuf) and the micro-SD
//! logs of a Crazyflie have topics: a source reads one, its fields are the columns. `instance` counts the
//! publishers of a ULog topic from 0.
//!
//! ```toml
//! [[source]]
//! file = "log.ulg"
//! topic = "sensor_gyro"
//! instance = 1                          # 0 if left out
//! time = { column = "timestamp", unit = "us" }
//! channels = { "imu.omega_body_rad_s" = { columns = ["x", "y", "z"], body = "frd" } }
//! [[source]]
//! file = "bag.mcap"
//! topic = "/battery"
//! time = { column = "log_time", unit = "ns" }   # MCAP's own time of a message; or a field of it
//! channels = { "battery.voltage_v" = { columns = ["cells[0].voltage"] } }
//! [[source]]
//! file = "log00"
//! topic = "fixedFrequency"              # an event type of the micro-SD log
//! time = { column = "timestamp", unit = "us" }  # us in both versions of the format
//! channels = { "battery.voltage_v" = { columns = ["pm.vbatMV"], scale = 0.001 } }
//! ```
//!
//! - A number becomes `value * scale + offset` (each one number, or one a column) before frames are
//!   turned.
//! - `world` (`ned`, `enu`, `nwu`) belongs to channels with `_ned_` in their name, `body` (`frd`,
//!   `flu`) to those with `_body_`; an attitude needs both, and `order` and `direction`.
//!   `baro.altitude_m` is up.
//! - `imu.acceleration_ned_m_s2` is what an autopilot logs as acceleration in the world: the
//!   accelerometer turned there, less gravity. `attitude.yaw_rad`, `attitude.pitch_rad` and
//!   `attitude.roll_rad` are for logs that lack one of the angles.
//! - `rotors[i]` is the number, from 1, of the vehicle's rotor in column `i`; without it columns
//!   are in vehicle order.
//! - `forward_filled` drops rows that only repeat the last sample: a slow sensor written at a fast
//!   rate gets its own slow time axis. Channels of one log source (`battery.*`) share the axis; a
//!   row stays when any of them changes.
//! - `optional = true` imports a file that lacks a column of the channel, or has no number in it,
//!   without it; the report says so.
//! - `turned_by` takes a vector by an attitude of the log from the world into the body or back:
//!   `world` stands for a `_body_` channel then, and `body` for a `_ned_` one. `gravity_m_s2` makes
//!   a specific force of an acceleration, or the other way round.
//! - `times = "union"` lets channels of one log source have times of their own.
//! - `keep` may join parts with `and` that look at different files. A part drops rows of each file
//!   or topic that has its columns, and of all others, by time: their rows outside the spans in
//!   which it keeps consecutive rows of the first. One that has the columns itself, as topics have
//!   an `x` each, is no exception: its rows must hold by themselves, too.
//! - Empty cells, nulls and `nan` are NaN in the log and counted in the report.
//! - The earliest kept time over all files is time zero; metadata `time_zero_s` has it in the
//!   foreign clock.

mod ardupilot_file;
mod array_file;
mod autopilot;
mod blackbox_file;
mod blackbox_frames;
mod board;
mod build;
mod csv_file;
mod error;
mod files;
mod format;
mod frames;
mod hdf5_format;
mod map;
mod mask;
mod mat_format;
mod mcap;
mod meter;
mod names;
mod number;
mod parquet_file;
mod parquet_pages;
mod reading;
mod report;
mod rows;
mod table;
mod turn;
mod ulog_file;
mod ulog_format;
mod usd_file;
mod usd_format;
mod usd_known;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

pub use board::{BoardReport, import_board};
pub use error::ImportError;
pub use map::ImportMap;
pub use reading::Reading;
pub use report::{AbsentChannel, ChannelReport, FileReport, Gaps, ImportReport};

use crate::FlightLog;
use crate::check::TIME_MAX_S;
use map::SourceMap;
use mask::Condition;
use meter::Meter;
use names::nearest;
use table::{Table, TableFile};

/// Gyroscopes are logged at 8 to 32 kHz at most; a file in ms that is taken for one in us comes out
/// a thousand times as fast.
const RATE_MAX_HZ: f64 = 5e4;

/// Imports one flight.
///
/// `paths` is the flight's folder, or its file, or all of its files (matched to the map by file
/// name). The log has metadata `imported_from` (file names), `map` (the map's text) and
/// `time_zero_s`.
///
/// # Errors
/// The first thing wrong with the files, naming file, column, row and value; see [`ImportError`].
pub fn import(
    map: &ImportMap,
    paths: &[PathBuf],
) -> Result<(FlightLog, ImportReport), ImportError> {
    import_watched(map, paths, &|_, _| {})
}

/// The files that an import reads, one for each source of the map.
///
/// # Errors
/// A file that none or two of the paths offer, a path that does not exist or that nothing reads.
pub fn files_of(map: &ImportMap, paths: &[PathBuf]) -> Result<Vec<PathBuf>, ImportError> {
    files::find(map, paths)
}

/// The map of a ROS 2 bag (MCAP with CDR) by the types of its topics, and what was chosen, a line
/// each: `docs/guide/import.md` lists the types.
///
/// * `topics` - those that are taken where several say the same
///
/// # Errors
/// The file cannot be read, no topic has a known type, or several have the same one.
pub fn map_of_bag(path: &Path, topics: &[String]) -> Result<(ImportMap, Vec<String>), ImportError> {
    mcap::map_of_bag(path, topics, &mut mcap::Logs::default())
}

/// Imports the log of an autopilot, which says itself what its channels are: PX4's ULog, ArduPilot's
/// dataflash log, and the blackbox of Betaflight, INAV, Indiflight and the like.
///
/// The log has metadata `imported_from` (file name), `log_kind`, `parameters_json` (the autopilot's
/// parameters by name) and `time_zero_s`. Channels of one source that were logged at other times
/// each share an axis and are NaN at the times of the others.
///
/// * `watch` - as of [`import_watched`]
///
/// # Errors
/// A file that is none of these or contradicts its format; see [`ImportError`].
pub fn import_without_map(
    path: &Path,
    watch: &dyn Fn(u64, u64),
) -> Result<(FlightLog, ImportReport), ImportError> {
    let (firmware, bytes) = autopilot_log(path)?;
    let meter = Meter::new(bytes.len() as u64, watch);
    autopilot::import(firmware, path, &bytes, &meter)
}

/// The parameters that an autopilot's log has, by name: those of PX4 and ArduPilot as the log has
/// them last, of a blackbox log the numbers of its header (`motorOutput[0]` of a list).
///
/// # Errors
/// As [`import_without_map`].
pub fn parameters(path: &Path) -> Result<BTreeMap<String, f64>, ImportError> {
    let (firmware, bytes) = autopilot_log(path)?;
    autopilot::parameters(firmware, path, &bytes)
}

fn autopilot_log(path: &Path) -> Result<(autopilot::Firmware, Vec<u8>), ImportError> {
    let file = path.display().to_string();
    let read = |source| ImportError::Read { file: file.clone(), source };
    if path.metadata().map_err(read)?.is_dir() {
        return Err(ImportError::NeedsMap { file });
    }
    match format::format(path)?.firmware() {
        None => Err(ImportError::NeedsMap { file }),
        Some(firmware) => Ok((firmware, crate::files::read(path).map_err(read)?)),
    }
}

/// Imports one flight as [`import`] does, and says how far it is.
///
/// * `watch` - gets, about once a MiB, the bytes worked through and the bytes of all files
///
/// # Errors
/// As [`import`].
pub fn import_watched(
    map: &ImportMap,
    paths: &[PathBuf],
    watch: &dyn Fn(u64, u64),
) -> Result<(FlightLog, ImportReport), ImportError> {
    import_of(map, paths, watch, mcap::Logs::default())
}

/// * `logs` - MCAP files that were read before
fn import_of(
    map: &ImportMap,
    paths: &[PathBuf],
    watch: &dyn Fn(u64, u64),
    mut logs: mcap::Logs,
) -> Result<(FlightLog, ImportReport), ImportError> {
    let found = files::find(map, paths)?;
    // A file that two sources read is worked through twice.
    let total = found.iter().filter_map(|path| Some(path.metadata().ok()?.len())).sum();
    let meter = Meter::new(total, watch);
    let opened =
        (0..).zip(&found).map(|(index, path)| table::open(map, index, path, &mut logs, &meter));
    let opened = opened.collect::<Result<Vec<_>, _>>()?;
    check_mask_columns(map, &opened)?;
    let mut report = ImportReport::default();
    let present =
        map.sources.iter().zip(&opened).map(|(source, file)| present(source, &**file, &mut report));
    let sources: Vec<SourceMap> = present.collect();
    let tables = sources
        .iter()
        .zip(opened)
        .map(|(source, file)| read(source, &map.keep, file))
        .collect::<Result<Vec<_>, _>>()?;
    let times: Vec<Vec<f64>> = sources
        .iter()
        .zip(&tables)
        .map(|(s, table)| seconds(s, table))
        .collect::<Result<_, _>>()?;
    let kept = kept_rows(&map.keep, &tables, &times);
    for ((source, table), (rows, time_s)) in
        sources.iter().zip(&tables).zip(kept.iter().zip(&times))
    {
        check_order(source, table, rows, time_s)?;
    }
    // Times increase, so each file's first kept row is its earliest.
    let zero_s =
        kept.iter().zip(&times).map(|(rows, time_s)| time_s[rows[0]]).fold(f64::INFINITY, f64::min);

    let names = files::names(&found);
    let mut log = FlightLog::default();
    for (index, source) in sources.iter().enumerate() {
        let (table, rows) = (&tables[index], &kept[index]);
        report.files.push(FileReport {
            file: names[index].clone(),
            topic: source.topic.clone(),
            instance: source.instance,
            rows: table.len(),
            rows_masked: table.len() - rows.len(),
            bytes_cut: table.bytes_cut,
        });
        let time_s: Vec<f64> = times[index].iter().map(|t| t - zero_s).collect();
        check_end(source, table, rows, &time_s)?;
        let before = report.channels.len();
        build::add_source(&mut log, &mut report, map, source, table, &time_s, rows)?;
        let rates = report.channels[before..].iter();
        let too_fast = rates
            .filter_map(|channel| Some((&channel.channel, channel.rate_hz?)))
            .find(|(_, rate_hz)| *rate_hz > RATE_MAX_HZ);
        report.notes.extend(too_fast.map(|(channel, rate_hz)| {
            format!(
                "{channel}: at {rate_hz:.1e} Hz, faster than flights are logged: the map's time unit may be wrong"
            )
        }));
    }
    turn::turn(&mut log, &mut report, map, &sources)?;
    let mut imported_from = names;
    imported_from.dedup();
    log.metadata = BTreeMap::from([
        ("imported_from".to_owned(), imported_from.join(", ")),
        ("map".to_owned(), map.text.clone()),
        ("time_zero_s".to_owned(), zero_s.to_string()),
    ]);
    Ok((log, report))
}

/// A source without those of its optional channels that its file lacks.
fn present(source: &SourceMap, file: &dyn TableFile, report: &mut ImportReport) -> SourceMap {
    let mut own = source.clone();
    own.channels.retain(|channel| {
        let lacks = |column: &&String| !has_all(file, &[column.as_str()]);
        let absent = channel.columns.iter().find(lacks).filter(|_| channel.optional);
        report.absent.extend(
            absent.map(|column| AbsentChannel {
                channel: channel.name.clone(),
                column: column.clone(),
            }),
        );
        absent.is_none()
    });
    own
}

/// Every part of the mask needs one file that has all of its columns.
fn check_mask_columns(
    map: &ImportMap,
    files: &[Box<dyn TableFile + '_>],
) -> Result<(), ImportError> {
    for term in &map.keep {
        let columns = term.columns();
        if files.iter().any(|file| has_all(file.as_ref(), &columns)) {
            continue;
        }
        let nowhere = columns
            .iter()
            .find(|column| files.iter().all(|file| !has_all(file.as_ref(), &[column])));
        let problem = match nowhere {
            Some(column) => {
                let all = files.iter().flat_map(|file| file.columns()).map(String::as_str);
                format!("no file has a column `{column}`; nearest: {}", nearest(column, all))
            }
            None => {
                format!(
                    "no single file has all of {}: split the condition with `and`",
                    columns.join(", ")
                )
            }
        };
        return Err(ImportError::MapField {
            map: map.name.clone(),
            field: "keep".to_owned(),
            problem,
        });
    }
    Ok(())
}

fn has_all(file: &dyn TableFile, columns: &[&str]) -> bool {
    columns.iter().all(|column| file.columns().iter().any(|name| name == column))
}

/// Reads the columns of a source and those that the mask looks at.
fn read(
    source: &SourceMap,
    keep: &[Condition],
    file: Box<dyn TableFile + '_>,
) -> Result<Table, ImportError> {
    let of_channels =
        source.channels.iter().flat_map(|channel| &channel.columns).map(String::as_str);
    let of_mask = keep
        .iter()
        .map(Condition::columns)
        .filter(|columns| has_all(file.as_ref(), columns))
        .flatten();
    let mut wanted = vec![source.time.column.as_str()];
    for column in of_channels.chain(of_mask) {
        if !wanted.contains(&column) {
            wanted.push(column);
        }
    }
    file.read(&wanted)
}

fn seconds(source: &SourceMap, table: &Table) -> Result<Vec<f64>, ImportError> {
    let time = table.column(&source.time.column);
    match time.iter().position(|t| t.is_nan()) {
        None => Ok(time.iter().map(|&t| source.time.seconds(t)).collect()),
        Some(row) => Err(ImportError::Cell {
            file: table.name.clone(),
            column: source.time.column.clone(),
            row: table.rows[row],
            value: String::new(),
            problem: "is no time",
        }),
    }
}

/// Row numbers, from 0, that the mask keeps of each table.
fn kept_rows(keep: &[Condition], tables: &[Table], times: &[Vec<f64>]) -> Vec<Vec<usize>> {
    let mut kept: Vec<Vec<bool>> = tables.iter().map(|table| vec![true; table.len()]).collect();
    for term in keep {
        let columns = term.columns();
        let by_rows: Vec<Option<Vec<bool>>> =
            tables.iter().map(|table| table.has_all(&columns).then(|| term.rows(table))).collect();
        let spans: Vec<(&str, Vec<(f64, f64)>)> = tables
            .iter()
            .zip(&by_rows)
            .zip(times)
            .filter_map(|((table, rows), time_s)| {
                Some((table.name.as_str(), spans(rows.as_ref()?, time_s)))
            })
            .collect();
        for (((kept, rows), table), time_s) in kept.iter_mut().zip(by_rows).zip(tables).zip(times) {
            // Two sources may read one file: its rows are the same.
            let others = || spans.iter().filter(|(name, _)| *name != table.name);
            for (row, (kept, t)) in kept.iter_mut().zip(time_s).enumerate() {
                *kept &= rows.as_ref().is_none_or(|rows| rows[row]);
                *kept = *kept && others().all(|(_, spans)| inside(spans, *t));
            }
        }
    }
    kept.iter().map(|kept| (0..kept.len()).filter(|&row| kept[row]).collect()).collect()
}

/// First and last time of each run of kept rows.
fn spans(kept: &[bool], time_s: &[f64]) -> Vec<(f64, f64)> {
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for (row, &t) in time_s.iter().enumerate().filter(|(row, _)| kept[*row]) {
        match spans.last_mut() {
            Some(span) if row > 0 && kept[row - 1] => span.1 = t,
            _ => spans.push((t, t)),
        }
    }
    spans
}

fn inside(spans: &[(f64, f64)], t: f64) -> bool {
    spans.get(spans.partition_point(|span| span.1 < t)).is_some_and(|span| span.0 <= t)
}

/// The times of the log must be those that it can hold.
fn check_end(
    source: &SourceMap,
    table: &Table,
    rows: &[usize],
    time_s: &[f64],
) -> Result<(), ImportError> {
    match rows.iter().find(|row| !(time_s[**row] <= TIME_MAX_S)) {
        None => Ok(()),
        Some(&row) => Err(ImportError::Cell {
            file: table.name.clone(),
            column: source.time.column.clone(),
            row: table.rows[row],
            value: format!("{:e}", table.column(&source.time.column)[row]),
            problem: "is too long after the first time: a log holds 1.8e10 s",
        }),
    }
}

/// The kept rows must exist and their time must increase.
fn check_order(
    source: &SourceMap,
    table: &Table,
    rows: &[usize],
    time_s: &[f64],
) -> Result<(), ImportError> {
    if rows.is_empty() {
        return Err(ImportError::NothingKept { file: table.name.clone(), rows: table.len() });
    }
    let Some(pair) = rows.windows(2).find(|pair| time_s[pair[1]] <= time_s[pair[0]]) else {
        return Ok(());
    };
    let time = table.column(&source.time.column);
    let (previous, time) = (time[pair[0]], time[pair[1]]);
    Err(ImportError::TimeOrder {
        file: table.name.clone(),
        column: source.time.column.clone(),
        row: table.rows[pair[1]],
        problem: if time < previous { "runs backwards" } else { "repeats" },
        time,
        previous,
        previous_row: table.rows[pair[0]],
    })
}
