//! What can be wrong with an import map or a foreign log: one line each, naming file, field, row
//! and value.
//!
//! Rows are line numbers of a CSV file as an editor shows them (the header is row 1); in other
//! files they are counted from
//! 1. The file of a topic is named with it: ``log.ulg, topic `sensor_gyro` ``.

use crate::files::TooLarge;
use std::io;

/// Why an import failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A file could not be opened or read.
    #[error("{file}: {source}")]
    Read {
        /// Path as given.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// What comes out of a file is larger than may be.
    #[error("{file}: {source}")]
    TooLarge {
        /// Path as given.
        file: String,
        /// What it may be.
        source: TooLarge,
    },
    /// What a board wrote is no flight.
    #[error("{file}: {problem}")]
    Board {
        /// Path as given.
        file: String,
        /// What is wrong.
        problem: String,
    },
    /// The map is not TOML, or not a map: syntax, unknown key, wrong type, unknown unit or frame.
    #[error("{map}, line {line}: {message} (in `{text}`)")]
    MapSyntax {
        /// Name of the map.
        map: String,
        /// Row, from 1.
        line: usize,
        /// What is wrong.
        message: String,
        /// The line itself.
        text: String,
    },
    /// A field of the map contradicts itself or its channel.
    #[error("{map}: {field}: {problem}")]
    MapField {
        /// Name of the map.
        map: String,
        /// Where in the map.
        field: String,
        /// What is wrong and what to write instead.
        problem: String,
    },
    /// No PATH offers a file that the map reads.
    #[error("{map}: file `{file}` is in none of the given paths: {given}")]
    MissingFile {
        /// Name of the map.
        map: String,
        /// The map's `file`.
        file: String,
        /// The paths given.
        given: String,
    },
    /// Two PATHs offer the same file.
    #[error(
        "{map}: file `{file}` is given twice: {first} and {second}; import one flight at a time"
    )]
    AmbiguousFile {
        /// Name of the map.
        map: String,
        /// The map's `file`.
        file: String,
        /// First match.
        first: String,
        /// Second match.
        second: String,
    },
    /// A PATH that no source of the map reads.
    #[error("{path}: no source of {map} reads this")]
    UnusedPath {
        /// Name of the map.
        map: String,
        /// Path as given.
        path: String,
    },
    /// More than one file, or none, without a map.
    #[error("PATH: an import without --map takes one file, got {given}")]
    NotOneFile {
        /// How many.
        given: usize,
    },
    /// What the file holds does not say what its channels mean.
    #[error(
        "{file}: needs --map: without one, import reads ULog (PX4), dataflash logs (ArduPilot), \
         blackbox logs (Betaflight, INAV), micro-SD logs (Crazyflie) and ROS 2 bags (MCAP), one file at a time; \
         maps that are built in: nanobench, crazypad, arpl"
    )]
    NeedsMap {
        /// Path as given.
        file: String,
    },
    /// No format begins like this, nor has this extension.
    #[error(
        "{file}: import reads ULog (PX4), dataflash logs (ArduPilot), blackbox logs (Betaflight, INAV), Crazyflie \
         micro-SD logs, MCAP (ROS 2, JSON, protobuf), Parquet and MATLAB's .mat up to v7, by their first bytes, and .csv, by the file's extension"
    )]
    UnknownFormat {
        /// Path as given.
        file: String,
    },
    /// The file contradicts its format: cut off, changed, or another format under this extension.
    #[error("{file}: {problem}")]
    Damaged {
        /// Path as given, and topic.
        file: String,
        /// What is wrong.
        problem: String,
    },
    /// The file has no message of a topic.
    #[error("{file}: no message of topic `{topic}`; nearest: {nearest}")]
    MissingTopic {
        /// Path as given.
        file: String,
        /// The topic that the map asks for, and the instance if it is not the first.
        topic: String,
        /// Topics with a similar name.
        nearest: String,
    },
    /// A column that does not hold one number a row.
    #[error("{file}: column `{column}` holds {kind}, not one number a row")]
    ColumnType {
        /// Path as given.
        file: String,
        /// The column that the map asks for.
        column: String,
        /// What it holds.
        kind: String,
    },
    /// The file has no header.
    #[error("{file}: empty file")]
    Empty {
        /// Path as given, and topic.
        file: String,
    },
    /// The file has a header and nothing else.
    #[error("{file}: a header and no rows")]
    HeaderOnly {
        /// Path as given, and topic.
        file: String,
    },
    /// The header lacks a column.
    #[error("{file}: no column `{column}`; nearest: {nearest}")]
    MissingColumn {
        /// Path as given, and topic.
        file: String,
        /// The column that the map asks for.
        column: String,
        /// Columns with a similar name.
        nearest: String,
    },
    /// The header has a column more than once.
    #[error("{file}: column `{column}` is in the header {count} times")]
    RepeatedColumn {
        /// Path as given, and topic.
        file: String,
        /// The column that the map asks for.
        column: String,
        /// How often it is there.
        count: usize,
    },
    /// A row is shorter or longer than the header.
    #[error("{file}, row {row}: {cells} cells, the header has {expected}")]
    RowLength {
        /// Path as given, and topic.
        file: String,
        /// Row, from 1.
        row: u64,
        /// Cells in this row.
        cells: usize,
        /// Cells in the header.
        expected: usize,
    },
    /// A value is no number, an infinite one, or an empty time.
    #[error("{file}, column `{column}`, row {row}: `{value}` {problem}")]
    Cell {
        /// Path as given, and topic.
        file: String,
        /// The column.
        column: String,
        /// Row, from 1.
        row: u64,
        /// The value as written.
        value: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// Time does not increase.
    #[error(
        "{file}, column `{column}`, row {row}: time {problem}: {time} after {previous} in row {previous_row}"
    )]
    TimeOrder {
        /// Path as given, and topic.
        file: String,
        /// The time column.
        column: String,
        /// Row, from 1.
        row: u64,
        /// `runs backwards` or `repeats`.
        problem: &'static str,
        /// Time of this row, in the unit of the file.
        time: f64,
        /// Time of the last kept row before it, in the unit of the file.
        previous: f64,
        /// That row.
        previous_row: u64,
    },
    /// A quaternion is too long or too short to be a rotation.
    #[error(
        "{file}, columns {columns}, row {row}: quaternion norm {norm:.4} is more than 5 % away from 1"
    )]
    QuaternionNorm {
        /// Path as given, and topic.
        file: String,
        /// The four columns.
        columns: String,
        /// Row, from 1.
        row: u64,
        /// The norm after scale and offset.
        norm: f64,
    },
    /// A channel without a single number.
    #[error("{file}, columns {columns}: `{channel}` has no number in any kept row")]
    AllMissing {
        /// Path as given, and topic.
        file: String,
        /// Columns of the channel.
        columns: String,
        /// Canonical name.
        channel: String,
    },
    /// The mask drops everything.
    #[error("{file}: `keep` drops all {rows} rows")]
    NothingKept {
        /// Path as given, and topic.
        file: String,
        /// Rows in the file.
        rows: usize,
    },
    /// Channels that share a source of the log do not share a time axis.
    #[error(
        "{map}: `{channel}` has other times than the rest of `{log_source}` ({problem}): {remedy}"
    )]
    TimeAxes {
        /// Name of the map.
        map: String,
        /// Canonical name of the channel that differs.
        channel: String,
        /// The source of the log, such as `battery`.
        log_source: String,
        /// Why they differ.
        problem: &'static str,
        /// What to do.
        remedy: &'static str,
    },
}
