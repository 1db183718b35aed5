//! Errors of the crates below as Python's: what a file or system refused is an `OSError`,
//! everything else a `ValueError`; the text is squirrel's own line.

use pyo3::PyErr;
use pyo3::exceptions::PyValueError;
use squirrel_log::import::ImportError;
use squirrel_log::{LogError, files};
use squirrel_nn::NnError;
use squirrel_sim::vehicle_file::VehicleFileError;
use squirrel_sim::weights::WeightsError;
use std::io;

/// A `ValueError` with this line.
pub(crate) fn value(line: impl ToString) -> PyErr {
    PyValueError::new_err(one_line(&line.to_string()))
}

/// The `OSError` of this kind (`FileNotFoundError`, `PermissionError`, ...) with this line.
pub(crate) fn system(kind: io::ErrorKind, line: impl ToString) -> PyErr {
    io::Error::new(kind, one_line(&line.to_string())).into()
}

/// Line breaks and whatever else of a name or a file acts on a terminal spelt out, nearly as Python's
/// `repr` does: an error stays one line.
fn one_line(text: &str) -> String {
    files::spelt_out(text, files::acts).into_owned()
}

/// Of a vehicle file.
pub(crate) fn vehicle(error: &VehicleFileError) -> PyErr {
    match error {
        VehicleFileError::Read { source, .. } => system(source.kind(), error),
        _ => value(error),
    }
}

/// Of a flight log.
pub(crate) fn log(error: &LogError) -> PyErr {
    match error {
        LogError::Io { error: cause, .. } => system(cause.kind(), error),
        _ => value(error),
    }
}

/// Of a log that somebody else wrote.
pub(crate) fn import(error: &ImportError) -> PyErr {
    match error {
        ImportError::Read { source, .. } => system(source.kind(), error),
        _ => value(error),
    }
}

/// Of training.
pub(crate) fn nn(error: &NnError) -> PyErr {
    match error {
        NnError::Weights(error) => weights(error),
        _ => value(error),
    }
}

/// Of weights.
pub(crate) fn weights(error: &WeightsError) -> PyErr {
    match error {
        WeightsError::Io { error: cause, .. } => system(cause.kind(), error),
        _ => value(error),
    }
}
