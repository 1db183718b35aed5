//! Blackbox logs of Betaflight and its kin (INAV, Indiflight, EmuFlight): the main frames as rows.
//!
//! The crate `blackbox-log` decodes the frames. It takes a log only of a firmware that it knows by
//! name and version, though how frames are written is in the header and the same for all of them;
//! so it is handed a header whose firmware it knows. Of the other headers, two are numbers whose
//! meaning depends on the firmware and that no frame needs; they become 0 where it does not know
//! them. The columns are the numbers as logged, without a scale.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use blackbox_log::frame::{Frame, FrameDef};
use blackbox_log::headers::ParseError;
use blackbox_log::{Headers, ParserEvent};

use super::error::ImportError;
use super::meter::Meter;
use super::rows::Rows;
use super::table::{Table, TableFile, places};

const MARKER: &[u8] = b"H Product:Blackbox flight data recorder by Nicholas Sherlock\n";
const FIRMWARE: &str = "Firmware revision";
/// Headers that depend on the firmware and that no frame needs.
const NEEDLESS: [&str; 2] = ["debug_mode", "motor_pwm_protocol"];
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
    /// With a header that the decoder takes.
    bytes: Cow<'a, [u8]>,
    /// All headers as the file has them.
    pub(super) header: BTreeMap<String, String>,
    /// Which log of the file it is, from 1, and of how many.
    pub(super) number: usize,
    pub(super) count: usize,
}

/// The numbers of some columns, without a scale.
pub(super) struct Frames {
    columns: Vec<(String, Vec<f64>)>,
    rows: usize,
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
        let header = header_lines(bytes).filter_map(|line| {
            let (name, value) = str::from_utf8(&bytes[line]).ok()?.split_once(':')?;
            Some((name.to_owned(), value.to_owned()))
        });
        let (header, number, count) = (header.collect(), index + 1, logs.len());
        let mut log = Self { bytes: Cow::Borrowed(bytes), header, number, count };
        log.make_readable()?;
        Ok(log)
    }

    /// Rewrites the headers that the decoder refuses.
    fn make_readable(&mut self) -> Result<(), String> {
        if let Some(known) = self.header.get(FIRMWARE).and_then(|text| known_firmware(text)) {
            self.rewrite(FIRMWARE, &known);
        }
        for name in NEEDLESS.iter().filter(|name| !self.header.contains_key(**name)) {
            let line = format!("H {name}:0\n");
            let place = self.bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
            // Behind the marker and the version.
            let at = place.map(|(at, _)| at + 1).nth(1).ok_or("ends inside the header")?;
            self.bytes.to_mut().splice(at..at, line.into_bytes());
        }
        for _ in 0..=NEEDLESS.len() {
            match self.headers().err() {
                None => return Ok(()),
                Some(ParseError::InvalidHeader { header, .. })
                    if NEEDLESS.contains(&header.as_str()) =>
                {
                    self.rewrite(&header, "0");
                }
                Some(error) => return Err(problem(&error)),
            }
        }
        Err("has headers that cannot be read".to_owned())
    }

    fn rewrite(&mut self, name: &str, value: &str) {
        let own = |line: &Range<usize>| {
            self.bytes[line.clone()]
                .strip_prefix(name.as_bytes())
                .is_some_and(|rest| rest.starts_with(b":"))
        };
        let lines: Vec<Range<usize>> = header_lines(&self.bytes).filter(own).collect();
        // From the last on, so that the places of the others stay.
        for line in lines.into_iter().rev() {
            self.bytes.to_mut().splice(line.start + name.len() + 1..line.end, value.bytes());
        }
    }

    fn headers(&self) -> Result<Headers<'_>, ParseError> {
        let file = blackbox_log::File::new(&self.bytes);
        file.parse(0).unwrap_or(Err(ParseError::IncompleteHeaders))
    }

    /// Names of the columns.
    pub(super) fn columns(&self) -> Vec<String> {
        let headers = self.headers().ok();
        let fields = headers.iter().flat_map(|headers| headers.main_frame_def().iter());
        // The decoder has the frame's number first, under its name.
        let mut names: Vec<String> = fields.map(|field| field.name.to_owned()).collect();
        names.insert(names.len().min(1), TIME.to_owned());
        names
    }

    /// Decodes some columns of all frames.
    ///
    /// # Errors
    /// What the decoder says.
    pub(super) fn read(&self, wanted: &[&str]) -> Result<Frames, String> {
        let headers = self.headers().map_err(|error| problem(&error))?;
        let fields: Vec<(usize, &str, bool)> = (headers.main_frame_def().iter().enumerate())
            .map(|(index, field)| (index, field.name, field.signed))
            .collect();
        let place = |name: &&str| fields.iter().find(|(_, field, _)| field == name).copied();
        let places: Vec<(usize, &str, bool)> = wanted.iter().filter_map(place).collect();
        let mut values = vec![Vec::new(); places.len()];
        let (mut time, mut parser) = (Vec::new(), headers.data_parser());
        while let Some(event) = parser.next() {
            let ParserEvent::Main(frame) = event else { continue };
            time.push(frame.time_raw() as f64);
            for (&(index, _, signed), values) in places.iter().zip(&mut values) {
                let raw = frame.get_raw(index).unwrap_or_default();
                values.push(if signed { f64::from(raw.cast_signed()) } else { f64::from(raw) });
            }
        }
        let rows = time.len();
        let names = places.iter().map(|(_, name, _)| (*name).to_owned());
        let mut columns: Vec<(String, Vec<f64>)> = names.zip(values).collect();
        columns.push((TIME.to_owned(), time));
        Ok(Frames { columns, rows })
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
        self.rows
    }

    fn column(&self, name: &str) -> Option<Vec<f64>> {
        let (_, values) = self.columns.iter().find(|(column, _)| column == name)?;
        Some(values.clone())
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

/// A firmware whose frames are written as those of this one and that the decoder knows; `None` if
/// it knows this one.
fn known_firmware(text: &str) -> Option<String> {
    let mut words = text.split(' ');
    let (name, version) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    let mut numbers = version.splitn(3, '.').map(|number| number.parse::<u8>().ok());
    let version = numbers.next().flatten().zip(numbers.next().flatten());
    let patched = numbers.next().flatten().is_some();
    let inav = name.eq_ignore_ascii_case("inav");
    let known = match version {
        Some((5..=8, _)) if inav => patched,
        Some((4, 2..=5)) if name.eq_ignore_ascii_case("betaflight") => patched,
        _ => false,
    };
    (!known).then(|| if inav { "INAV 8.0.0 known" } else { "Betaflight 4.5.0 known" }.to_owned())
}

fn problem(error: &ParseError) -> String {
    format!("the header of the blackbox log: {error}")
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
            .columns();
        Ok(Self { name: format!("{file}, topic `{topic}`"), bytes, columns, meter })
    }
}

impl TableFile for BlackboxFile<'_> {
    fn columns(&self) -> &[String] {
        &self.columns
    }

    fn read(self: Box<Self>, wanted: &[&str]) -> Result<Table, ImportError> {
        places(&self.name, &self.columns, wanted)?;
        let damaged = |problem| ImportError::Damaged { file: self.name.clone(), problem };
        let frames = BlackboxLog::open(&self.bytes).and_then(|log| log.read(wanted));
        let frames = frames.map_err(damaged)?;
        self.meter.add(self.bytes.len());
        if frames.rows == 0 {
            return Err(ImportError::HeaderOnly { file: self.name });
        }
        let rows = (1..=frames.rows as u64).collect();
        let values = wanted.iter().map(|name| frames.column(name).unwrap_or_default()).collect();
        Ok(Table::new(self.name, wanted, values, rows))
    }
}
