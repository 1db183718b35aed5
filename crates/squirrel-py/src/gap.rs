//! The gap workflow: its steps on logs in memory. `squirrel/gap.py` makes dataclasses of what comes
//! back.

use crate::error::value;
use crate::interrupt::{Stop, interruptible, look};
use crate::json;
use crate::log::FlightLog;
use crate::vehicle::{Vehicle, write_file};
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyDict};
use pyo3_stub_gen::derive::gen_stub_pyfunction;
use squirrel_gap::{Flights, Verdict, Workflow};
use squirrel_sim::vehicle_file::{VehicleFile, listed_effects};
use std::path::{Path, PathBuf};

/// Names and logs in the order of the dictionary; each is copied, and Ctrl-C ends it between two.
fn logs(argument: &str, flights: &Bound<'_, PyDict>) -> PyResult<Flights> {
    let copied = named(argument, flights).map(|flight| {
        look(flights.py())?;
        let (name, log) = flight?;
        Ok((name, squirrel_log::FlightLog::clone(&log.get().log)))
    });
    copied.collect()
}

/// The flights of an argument, as they lie in Python.
pub(crate) fn named<'py>(
    argument: &str,
    flights: &Bound<'py, PyDict>,
) -> impl Iterator<Item = PyResult<(String, Bound<'py, FlightLog>)>> {
    flights.iter().map(move |(name, log)| {
        let wrong = || {
            value(format!(
                "{argument}: expected names (str) and FlightLogs, got {name} of {}",
                log.get_type()
            ))
        };
        let own: String = name.extract().map_err(|_| wrong())?;
        Ok((own, log.cast::<FlightLog>().map_err(|_| wrong())?.clone()))
    })
}

/// The effects that a vehicle file may name.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[gen_stub(override_return_type(type_repr = "list[dict[str, typing.Any]]", imports = ("typing")))]
pub(crate) fn gap_effects(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    json(py, &listed_effects())
}

/// What flights are worth before any verdict, as the JSON of ``squirrel gap check``.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[gen_stub(override_return_type(type_repr = "dict[str, typing.Any]", imports = ("typing")))]
pub(crate) fn gap_check<'py>(
    py: Python<'py>,
    vehicle: &Bound<'py, Vehicle>,
    #[gen_stub(override_type(type_repr = "dict[str, FlightLog]"))] flights: &Bound<'py, PyDict>,
    #[gen_stub(override_type(type_repr = "dict[str, FlightLog]"))] held_out: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyAny>> {
    let vehicle = vehicle.get().file.clone();
    let (flights, held_out) = (logs("flights", flights)?, logs("held_out", held_out)?);
    let found = interruptible(py, move |stop| {
        squirrel_gap::check(&vehicle, &flights, &held_out, &|_: &str| stop.check())
    })?
    .map_err(value)?;
    json(py, &found)
}

/// Where flights disagree with a vehicle, as the JSON of ``squirrel gap find``.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[gen_stub(override_return_type(type_repr = "dict[str, typing.Any]", imports = ("typing")))]
pub(crate) fn gap_find<'py>(
    py: Python<'py>,
    vehicle: &Bound<'py, Vehicle>,
    #[gen_stub(override_type(type_repr = "dict[str, FlightLog]"))] flights: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyAny>> {
    let (vehicle, flights) = (vehicle.get().file.clone(), logs("flights", flights)?);
    let finding =
        interruptible(py, move |_| squirrel_gap::find(&vehicle, &flights))?.map_err(value)?;
    json(py, &finding)
}

/// What a vehicle lacks, as the JSON of ``squirrel gap run``, and the vehicle with it.
///
/// * `baseline` - good flights of the same machine; empty for none
/// * `fit` - whether the file gets its numbers as these flights have them, too
/// * `out` - folder for the report and the patched vehicle file
/// * `fly_again` - whether held-out flights are flown again in closed loop
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[gen_stub(override_return_type(type_repr = "tuple[dict[str, typing.Any], Vehicle | None]", imports = ("typing")))]
pub(crate) fn gap_diagnose<'py>(
    py: Python<'py>,
    vehicle: &Bound<'py, Vehicle>,
    #[gen_stub(override_type(type_repr = "dict[str, FlightLog]"))] flights: &Bound<'py, PyDict>,
    #[gen_stub(override_type(type_repr = "dict[str, FlightLog]"))] held_out: &Bound<'py, PyDict>,
    #[gen_stub(override_type(type_repr = "dict[str, FlightLog]"))] baseline: &Bound<'py, PyDict>,
    fit: bool,
    fly_again: bool,
    out: Option<PathBuf>,
) -> PyResult<(Bound<'py, PyAny>, Option<Vehicle>)> {
    let vehicle = vehicle.get().file.clone();
    let (flights, held_out) = (logs("flights", flights)?, logs("held_out", held_out)?);
    let baseline = logs("baseline", baseline)?;
    let (verdict, patched) = interruptible(py, move |stop| {
        diagnose(vehicle, [flights, held_out, baseline], [fit, fly_again], out.as_deref(), stop)
    })??;
    Ok((json(py, &verdict)?, patched.map(|file| Vehicle { file })))
}

/// * `out` - folder for the report and the patched vehicle file
fn diagnose(
    vehicle: VehicleFile,
    [flights, held_out, baseline]: [Flights; 3],
    [fit, fly_again]: [bool; 2],
    out: Option<&Path>,
    stop: &Stop,
) -> PyResult<(Verdict, Option<VehicleFile>)> {
    let tick = |_: &str| stop.check();
    // For the report alone: whatever it finds, the verdict is what it would be without.
    let check = out.and_then(|_| squirrel_gap::check(&vehicle, &flights, &held_out, &tick).ok());
    let mut found =
        Workflow::diagnose(vehicle, &baseline, flights, held_out, &tick).map_err(value)?;
    found.check = check;
    let patched = found.patched(fit).map_err(value)?.ok();
    if fly_again && let Some(patched) = &patched {
        stop.check();
        found.fly_again(patched).map_err(value)?;
    }
    stop.check();
    if let Some(folder) = out {
        let fail = |e: std::io::Error| {
            crate::error::system(e.kind(), format!("{}: {e}", folder.display()))
        };
        std::fs::create_dir_all(folder).map_err(fail)?;
        if let Some(patched) = &patched {
            let path = folder.join("vehicle.toml");
            write_file(&path, patched.text.as_bytes())?;
            found.diagnosis.verdict.model_patch = Some(path.display().to_string());
        }
        write_file(&folder.join("report.html"), found.report(patched.as_ref()).as_bytes())?;
    }
    Ok((found.diagnosis.verdict, patched.map(|patched| patched.vehicle)))
}
