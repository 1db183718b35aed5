//! How a log is read, whoever wrote it: by a map that is given, by the map that its own contents
//! say, or as an autopilot's log. The one place where that is decided.

use std::path::{Path, PathBuf};

use super::error::ImportError;
use super::format::{self, Format};
use super::map::ImportMap;
use super::mcap::{self, Logs};
use super::report::ImportReport;
use super::{files_of, import_of, import_without_map, usd_known};
use crate::FlightLog;

/// A flight that is about to be read.
#[derive(Debug)]
pub struct Reading {
    paths: Vec<PathBuf>,
    /// `None` for an autopilot's log, which says itself what its channels are.
    map: Option<ImportMap>,
    /// What was chosen, a line each, where the log's contents made the map.
    pub notes: Vec<String>,
    /// Bags that were read to make the map.
    logs: Logs,
}

impl Reading {
    /// Finds out how to read a flight. A bag is read for that, of the others the beginning.
    ///
    /// * `paths` - the flight's file, or its folder, or with a map all of its files
    /// * `map` - a map file, or the name of a built-in one
    /// * `topics` - of a ROS 2 bag, those that are taken where several say the same
    ///
    /// # Errors
    /// The map is none, a file needs one, or is not what it begins as; see [`ImportError`].
    pub fn new(
        paths: &[PathBuf],
        map: Option<&Path>,
        topics: &[String],
    ) -> Result<Self, ImportError> {
        let mut reading =
            Self { paths: paths.to_vec(), map: None, notes: Vec::new(), logs: Logs::default() };
        if let Some(map) = map {
            reading.map = Some(ImportMap::load(map)?);
            return Ok(reading);
        }
        let [path] = paths else {
            return Err(ImportError::NotOneFile { given: paths.len() });
        };
        let format = if path.is_dir() { Format::Mcap } else { format::format(path)? };
        match format {
            Format::Mcap => {
                let (map, notes) = mcap::map_of_bag(path, topics, &mut reading.logs)?;
                (reading.map, reading.notes) = (Some(map), notes);
            }
            Format::Usd => {
                let (map, notes) = usd_known::map_of_usd(path)?;
                (reading.map, reading.notes) = (Some(map), notes);
            }
            _ => {}
        }
        Ok(reading)
    }

    /// The files that are read.
    ///
    /// # Errors
    /// As of [`files_of`].
    pub fn files(&self) -> Result<Vec<PathBuf>, ImportError> {
        self.map.as_ref().map_or_else(|| Ok(self.paths.clone()), |map| files_of(map, &self.paths))
    }

    /// Reads the flight.
    ///
    /// * `watch` - as of [`import_watched`](super::import_watched)
    ///
    /// # Errors
    /// As of [`import`](super::import) and [`import_without_map`].
    pub fn import(
        self,
        watch: &dyn Fn(u64, u64),
    ) -> Result<(FlightLog, ImportReport), ImportError> {
        match (&self.map, self.paths.as_slice()) {
            (Some(map), paths) => import_of(map, paths, watch, self.logs),
            (None, [path]) => import_without_map(path, watch),
            (None, paths) => Err(ImportError::NotOneFile { given: paths.len() }),
        }
    }
}
