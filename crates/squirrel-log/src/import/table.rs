//! What every reader gives: the columns that a map asks for, as numbers, with the row of the file
//! each came from.

use std::fs;
use std::io::{self, Read};
use std::path::Path;

use super::csv_file::CsvFile;
use super::error::ImportError;
use super::map::ImportMap;
use super::mat_file::MatFile;
use super::mcap::Logs;
use super::meter::Meter;
use super::names::nearest;
use super::number::Column;
use super::parquet_file::ParquetFile;
use super::ulog_file::UlogFile;
use super::usd_file::UsdFile;
use super::usd_format::is_usd;

/// A file, or a topic of one, whose column names are known and whose numbers are not read yet.
pub(super) trait TableFile {
    /// Names of the columns.
    fn columns(&self) -> &[String];

    /// Reads some columns to the end of the file; `wanted` has no name twice.
    ///
    /// # Errors
    /// A missing or repeated column, a value that is no number or infinite, a damaged file, no
    /// rows.
    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError>;
}

/// Columns of a file. A missing value is NaN, always with the same bits; nothing is infinite.
#[derive(Debug)]
pub(super) struct Table {
    /// Path as given, and the topic if the file has topics, for error messages.
    pub(super) name: String,
    columns: Vec<(String, Vec<f64>)>,
    /// Number of each row from 1: in CSV the line of the file, in a topic the message.
    pub(super) rows: Vec<u64>,
    /// Bytes at the end of the file that hold no whole record.
    pub(super) bytes_cut: u64,
}

/// What a file is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Csv,
    Parquet,
    Ulog,
    Mcap,
    /// MATLAB.
    Mat,
    /// Micro-SD log of a Crazyflie.
    Usd,
}

/// The format of a file: by its extension, or by its first byte, for the logs of a Crazyflie are
/// called `log00`.
///
/// # Errors
/// Neither says it, or the file cannot be read or is empty.
fn format(path: &Path) -> Result<Format, ImportError> {
    check_known(path)?;
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "csv" => return Ok(Format::Csv),
        "parquet" => return Ok(Format::Parquet),
        "ulg" => return Ok(Format::Ulog),
        "mcap" => return Ok(Format::Mcap),
        "mat" => return Ok(Format::Mat),
        _ => {}
    }
    let file = path.display().to_string();
    match first_bytes(path) {
        Ok(first) if first.first().is_some_and(|first| is_usd(*first)) => Ok(Format::Usd),
        Ok(first) if first.is_empty() => Err(ImportError::Empty { file }),
        Ok(_) => Err(ImportError::UnknownFormat { file }),
        Err(source) => Err(ImportError::Read { file, source }),
    }
}

/// Refuses files that another program makes readable, by name.
///
/// # Errors
/// [`ImportError::Damaged`] with what to do, [`ImportError::Read`].
pub(super) fn check_known(path: &Path) -> Result<(), ImportError> {
    let file = path.display().to_string();
    let first =
        first_bytes(path).map_err(|source| ImportError::Read { file: file.clone(), source })?;
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
    match first_bytes(path) {
        Ok(first) => Ok(first.starts_with(magic)),
        Err(source) => Err(ImportError::Read { file: path.display().to_string(), source }),
    }
}

/// How a file begins that import does not read, and what makes one of it that it does.
const CONVERTIBLE: [(&[u8], &str); 4] = [
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
    (
        b"MATLAB 7.3 MAT-f",
        "a MAT-file v7.3 (HDF5); import reads up to v7: in MATLAB, `save -v7 FILE.mat` writes one",
    ),
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file; import reads CSV, Parquet and MATLAB's `save -v7`"),
];

fn first_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut first = Vec::new();
    fs::File::open(path)?.take(16).read_to_end(&mut first)?;
    Ok(first)
}

/// Opens the file of one `[[source]]`.
///
/// # Errors
/// An unknown format, `topic` or `instance` where the format has none or missing where it has, an
/// unreadable or empty file, a damaged header, a missing topic.
pub(super) fn open<'a>(
    map: &ImportMap,
    index: usize,
    path: &Path,
    logs: &mut Logs,
    meter: &'a Meter<'a>,
) -> Result<Box<dyn TableFile + 'a>, ImportError> {
    let file = path.display().to_string();
    let source = &map.sources[index];
    let topic_error = |key: &str, problem: String| ImportError::MapField {
        map: map.name.clone(),
        field: format!("source {}, {key}", index + 1),
        problem,
    };
    let format = format(path)?;
    if source.instance.is_some() && format != Format::Ulog {
        return Err(topic_error("instance", format!("means nothing for `{file}`: leave it out")));
    }
    let has_topics = !matches!(format, Format::Csv | Format::Parquet | Format::Mat);
    if source.topic.is_some() && !has_topics {
        return Err(topic_error("topic", format!("means nothing for `{file}`: leave it out")));
    }
    let topic = match &source.topic {
        None if has_topics => {
            return Err(topic_error("topic", format!("missing: say which topic of `{file}`")));
        }
        topic => topic.as_deref().unwrap_or_default(),
    };
    let whole = || match fs::read(path) {
        Ok(bytes) if bytes.is_empty() => Err(ImportError::Empty { file: file.clone() }),
        Ok(bytes) => Ok(bytes),
        Err(source) => Err(ImportError::Read { file: file.clone(), source }),
    };
    Ok(match format {
        Format::Csv => Box::new(CsvFile::open(path, meter)?),
        Format::Parquet => Box::new(ParquetFile::open(path, meter)?),
        Format::Ulog => {
            Box::new(UlogFile::open(&file, whole()?, topic, source.instance.unwrap_or(0), meter)?)
        }
        Format::Mcap => logs.open(map, path, topic, meter)?,
        Format::Mat => Box::new(MatFile::open(&file, whole()?, meter)?),
        Format::Usd => Box::new(UsdFile::open(&file, whole()?, topic, meter)?),
    })
}

impl Table {
    /// * `rows` - number of each row in the file
    /// * `values` - one list a wanted column, as long as `rows`
    pub(super) fn new(
        name: String,
        wanted: &[&str],
        values: Vec<Vec<f64>>,
        rows: Vec<u64>,
    ) -> Self {
        let columns = wanted.iter().map(|&column| column.to_owned()).zip(values).collect();
        Self { name, columns, rows, bytes_cut: 0 }
    }

    /// Of a binary log: the wanted columns, a row a record.
    ///
    /// * `columns`, `names` - all columns of a record
    ///
    /// # Errors
    /// A column that is missing, or a number that no log holds.
    pub(super) fn of_records<'r>(
        file: String,
        columns: &[Column],
        names: &[String],
        wanted: &[&str],
        records: &(impl ExactSizeIterator<Item = &'r [u8]> + Clone),
    ) -> Result<Self, ImportError> {
        let places = places(&file, names, wanted)?;
        let mut values = vec![Vec::with_capacity(records.len()); wanted.len()];
        for (&place, values) in places.iter().zip(&mut values) {
            let column = &columns[place];
            for (row, record) in records.clone().enumerate() {
                let number = column.number(record);
                values.push(checked(number).map_err(|problem| ImportError::Cell {
                    file: file.clone(),
                    column: column.name.clone(),
                    row: row as u64 + 1,
                    value: number.to_string(),
                    problem,
                })?);
            }
        }
        let rows = (1..=records.len() as u64).collect();
        Ok(Self::new(file, wanted, values, rows))
    }

    /// Rows.
    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    /// The numbers of a column that was asked for; empty if it was not.
    pub(super) fn column(&self, name: &str) -> &[f64] {
        self.columns.iter().find(|(column, _)| column == name).map_or(&[], |(_, values)| values)
    }

    /// Whether the table has all of these columns.
    pub(super) fn has_all(&self, names: &[&str]) -> bool {
        names.iter().all(|name| self.columns.iter().any(|(column, _)| column == name))
    }

    #[cfg(test)]
    pub(super) fn from_columns(columns: &[(&str, &[f64])]) -> Self {
        let (names, values): (Vec<&str>, Vec<_>) =
            columns.iter().map(|(name, x)| (*name, x.to_vec())).unzip();
        let rows = (2..).take(columns[0].1.len()).collect();
        Self::new("test.csv".to_owned(), &names, values, rows)
    }
}

/// Where each wanted column stands among those of the file.
///
/// # Errors
/// [`ImportError::MissingColumn`], [`ImportError::RepeatedColumn`].
pub(super) fn places(
    file: &str,
    columns: &[String],
    wanted: &[&str],
) -> Result<Vec<usize>, ImportError> {
    let place = |column: &&str| {
        let mut found = columns.iter().enumerate().filter(|(_, name)| name == column);
        match (found.next(), found.count()) {
            (Some((place, _)), 0) => Ok(place),
            (Some(_), others) => Err(ImportError::RepeatedColumn {
                file: file.to_owned(),
                column: (*column).to_owned(),
                count: others + 1,
            }),
            (None, _) => Err(ImportError::MissingColumn {
                file: file.to_owned(),
                column: (*column).to_owned(),
                nearest: nearest(column, columns.iter().map(String::as_str)),
            }),
        }
    };
    wanted.iter().map(place).collect()
}

/// A number of a file as the table has it; an error is what is wrong with it.
pub(super) fn checked(number: f64) -> Result<f64, &'static str> {
    match number {
        x if x.is_infinite() => Err("is infinite"),
        x if x.is_nan() => Ok(f64::NAN), // one bit pattern, whatever the file has
        x => Ok(x),
    }
}

/// A number written as text; empty is NaN.
pub(super) fn parsed(text: &[u8]) -> Result<f64, &'static str> {
    if text.is_empty() {
        return Ok(f64::NAN);
    }
    let number = std::str::from_utf8(text).ok().and_then(|text| text.parse::<f64>().ok());
    number.map_or(Err("is no number"), checked)
}
