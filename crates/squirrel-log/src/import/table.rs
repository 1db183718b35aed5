//! What every reader gives: the columns that a map asks for, as numbers, with the row of the file
//! each came from.

use std::path::Path;

use super::ardupilot_file::BinFile;
use super::array_file::ArrayFile;
use super::blackbox_file::BlackboxFile;
use super::csv_file::CsvFile;
use super::error::ImportError;
use super::format::{Format, format};
use super::hdf5_format::Hdf5;
use super::map::ImportMap;
use super::mat_format::Level5;
use super::mcap::Logs;
use super::meter::Meter;
use super::names::nearest;
use super::number::Column;
use super::parquet_file::ParquetFile;
use super::ulog_file::UlogFile;
use super::usd_file::UsdFile;
use crate::files;

/// Records of which all columns are read before the next: few enough for the processor's cache.
const RECORDS_AT_ONCE: usize = 512;

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
    if source.instance.is_some() && !matches!(format, Format::Ulog | Format::ArduPilot) {
        return Err(topic_error("instance", format!("means nothing for `{file}`: leave it out")));
    }
    let has_topics = !matches!(format, Format::Csv | Format::Parquet | Format::Mat | Format::Hdf5);
    if source.topic.is_some() && !has_topics {
        return Err(topic_error("topic", format!("means nothing for `{file}`: leave it out")));
    }
    let topic = match &source.topic {
        None if has_topics => {
            return Err(topic_error("topic", format!("missing: say which topic of `{file}`")));
        }
        topic => topic.as_deref().unwrap_or_default(),
    };
    let whole = || match files::read(path) {
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
        Format::ArduPilot => {
            let instance = source.instance.unwrap_or(0);
            Box::new(BinFile::open(&file, whole()?, (topic, instance), meter)?)
        }
        Format::Blackbox => Box::new(BlackboxFile::open(&file, whole()?, topic, meter)?),
        Format::Mcap => logs.open(map, path, topic, meter)?,
        Format::Mat => Box::new(ArrayFile::open(&file, whole()?, Level5::read, meter)?),
        Format::Hdf5 => Box::new(ArrayFile::open(&file, whole()?, Hdf5::read, meter)?),
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
        mut records: impl ExactSizeIterator<Item = &'r [u8]>,
    ) -> Result<Self, ImportError> {
        let places = places(&file, names, wanted)?;
        let count = records.len();
        let mut values: Vec<Vec<f64>> = wanted.iter().map(|_| Vec::with_capacity(count)).collect();
        for start in (0..count).step_by(RECORDS_AT_ONCE) {
            let some: Vec<&[u8]> = records.by_ref().take(RECORDS_AT_ONCE).collect();
            for (&place, values) in places.iter().zip(&mut values) {
                let column = &columns[place];
                for (row, record) in (start..).zip(&some) {
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
        }
        let rows = (1..=count as u64).collect();
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
