//! Blackbox logs of Betaflight and its kin (INAV, Indiflight, EmuFlight): the main frames as rows.
//!
//! How frames are written stands in the header, whatever firmware wrote them. The columns are the
//! numbers as logged, without a scale.
//!
//! The crate `blackbox-log` 0.4.3 does not do: it averages the frame before an intra frame into the
//! one behind it, where the firmware has the intra frame alone, so that gyroscope and accelerometer
//! are off from there to the next intra frame; and it refuses firmware that it does not know.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use super::blackbox_frames::{Plan, Walked};
use super::error::ImportError;
use super::meter::Meter;
use super::rows::Rows;
use super::table::{Table, TableFile, places};

const MARKER: &[u8] = b"H Product:Blackbox flight data recorder by Nicholas Sherlock\n";
/// The column that every frame has beside its fields: its time, us.
const TIME: &str = "time";
/// The only topic.
const MAIN: &str = "main";

/// Whether a file begins as a blackbox log.
pub(super) fn is_blackbox(start: &[u8]) -> bool {
    start.starts_with(&MARKER[..MARKER.len().min(start.len()).max(10)])
}

/// The longest log of a file.
#[derive(Debug)]
pub(super) struct BlackboxLog<'a> {
    /// What stands behind the header.
    data: &'a [u8],
    plan: Plan,
    /// All headers.
    pub(super) header: BTreeMap<String, String>,
    /// Which log of the file it is, from 1, and of how many.
    pub(super) number: usize,
    pub(super) count: usize,
}

/// The numbers of some columns, without a scale.
pub(super) struct Frames {
    columns: Vec<(String, Vec<f64>)>,
    pub(super) walked: Walked,
}

impl<'a> BlackboxLog<'a> {
    /// Finds the longest log of a file and reads its header.
    ///
    /// # Errors
    /// No log, or a header that contradicts the format.
    pub(super) fn open(file: &'a [u8]) -> Result<Self, String> {
        let logs = logs(file);
        let longest = (logs.iter().enumerate()).max_by_key(|(i, log)| (log.len(), logs.len() - i));
        let (index, log) = longest.ok_or("has no header of a blackbox log")?;
        let bytes = &file[log.clone()];
        let (mut header, mut end) = (BTreeMap::new(), 0);
        for line in header_lines(bytes) {
            end = line.end + 1;
            let text = str::from_utf8(&bytes[line]).ok().and_then(|text| text.split_once(':'));
            header.extend(text.map(|(name, value)| (name.to_owned(), value.to_owned())));
        }
        let plan = Plan::new(&header)?;
        Ok(Self { data: &bytes[end..], plan, header, number: index + 1, count: logs.len() })
    }

    /// Names of the columns.
    pub(super) fn columns(&self) -> &[String] {
        &self.plan.names
    }

    /// Decodes some columns of all frames, and their times.
    pub(super) fn read(&self, wanted: &[&str]) -> Frames {
        let own = self.columns().iter().map(String::as_str).enumerate();
        let places: Vec<(usize, &str)> =
            own.filter(|(_, name)| *name != TIME && wanted.contains(name)).collect();
        let (mut values, mut time) = (vec![Vec::new(); places.len()], Vec::new());
        let walked = self.plan.walk(self.data, |time_us, raw| {
            time.push(time_us as f64);
            for ((field, _), values) in places.iter().zip(&mut values) {
                values.push(self.plan.number(*field, raw[*field]));
            }
        });
        let names = places.iter().map(|(_, name)| (*name).to_owned());
        let mut columns: Vec<(String, Vec<f64>)> = names.zip(values).collect();
        columns.push((TIME.to_owned(), time));
        Frames { columns, walked }
    }

    /// The numbers of the header; those of a list are `name[0]` and so on.
    pub(super) fn parameters(&self) -> BTreeMap<String, f64> {
        let mut all = BTreeMap::new();
        for (name, text) in self.header.iter().filter(|(name, _)| !name.starts_with("Field ")) {
            let numbers: Vec<Option<f64>> = text.split(',').map(header_number).collect();
            match numbers.as_slice() {
                [Some(number)] => drop(all.insert(name.clone(), *number)),
                list => all.extend(
                    list.iter()
                        .enumerate()
                        .filter_map(|(i, x)| Some((format!("{name}[{i}]"), (*x)?))),
                ),
            }
        }
        all
    }
}

impl Rows for Frames {
    fn len(&self) -> usize {
        self.walked.frames
    }

    fn column(&self, name: &str) -> Option<Cow<'_, [f64]>> {
        let (_, values) = self.columns.iter().find(|(column, _)| column == name)?;
        Some(values.into())
    }
}

/// A number of the header: decimal, or the bits of a float as `0x3f800000`.
fn header_number(text: &str) -> Option<f64> {
    let text = text.trim();
    match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16).ok().map(|bits| f64::from(f32::from_bits(bits))),
        None => text.parse().ok(),
    }
    .filter(|number: &f64| number.is_finite())
}

/// The logs of a file: each from its marker to the next.
fn logs(file: &[u8]) -> Vec<Range<usize>> {
    let is_start = |at: &usize| file[*at..].starts_with(MARKER);
    let starts: Vec<usize> =
        (0..file.len()).filter(|&at| file[at] == MARKER[0]).filter(is_start).collect();
    let ends = starts.iter().skip(1).copied().chain([file.len()]);
    starts.iter().zip(ends).map(|(&start, end)| start..end).collect()
}

/// The lines of a header, without the `H ` and the line feed.
fn header_lines(log: &[u8]) -> impl Iterator<Item = Range<usize>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let rest = log.get(at..)?.strip_prefix(b"H ")?;
        let length = rest.iter().position(|&byte| byte == b'\n')?;
        let start = at + 2;
        at = start + length + 1;
        Some(start..start + length)
    })
}

/// The frames of a file, not decoded yet.
pub(super) struct BlackboxFile<'a> {
    /// Path as given, for error messages.
    name: String,
    bytes: Vec<u8>,
    columns: Vec<String>,
    meter: &'a Meter<'a>,
}

impl<'a> BlackboxFile<'a> {
    /// Reads the header of the longest log.
    ///
    /// # Errors
    /// [`ImportError::Damaged`], [`ImportError::MissingTopic`].
    pub(super) fn open(
        file: &str,
        bytes: Vec<u8>,
        topic: &str,
        meter: &'a Meter<'a>,
    ) -> Result<Self, ImportError> {
        if topic != MAIN {
            let nearest = MAIN.to_owned();
            let (file, topic) = (file.to_owned(), topic.to_owned());
            return Err(ImportError::MissingTopic { file, topic, nearest });
        }
        let columns = BlackboxLog::open(&bytes)
            .map_err(|problem| ImportError::Damaged { file: file.to_owned(), problem })?
            .columns()
            .to_vec();
        Ok(Self { name: format!("{file}, topic `{topic}`"), bytes, columns, meter })
    }
}

impl TableFile for BlackboxFile<'_> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        places(&self.name, &self.columns, wanted)?;
        let log = BlackboxLog::open(&self.bytes)
            .map_err(|problem| ImportError::Damaged { file: self.name.clone(), problem })?;
        let frames = log.read(wanted);
        self.meter.add(self.bytes.len());
        if frames.walked.frames == 0 {
            return Err(ImportError::HeaderOnly { file: self.name });
        }
        let rows = (1..=frames.walked.frames as u64).collect();
        let values = |name: &&str| frames.column(name).map_or_else(Vec::new, Cow::into_owned);
        let values = wanted.iter().map(values).collect();
        let mut table = Table::new(self.name, wanted, values, rows);
        table.bytes_cut = frames.walked.bytes_lost as u64;
        Ok(table)
    }
}
