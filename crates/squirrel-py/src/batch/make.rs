//! How batches are made: of arguments, and of what pickle kept.

use super::any_batch::{Kinds, air, any_batch};
use super::{Batch, Locked};
use crate::arguments::Float;
use crate::error::value;
use crate::interrupt::now_and_then;
use crate::kept::broken;
use crate::scalars::Indices;
use crate::vehicle::Vehicle;
use pyo3::exceptions::{PyIndexError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::{PyBytes, PyTuple};
use squirrel_batch::{BatchVehicle, Scheme, Settings};
use squirrel_sim::plant::WingPlant;
use squirrel_sim::simd::Path;
use squirrel_sim::vehicle_file::VehicleFile;
use std::fmt::Display;
use std::sync::{Mutex, MutexGuard};

/// Threads that a call may ask for.
const THREADS_MAX: usize = 1024;

pub(crate) fn settings(
    dt_s: f64,
    scheme: &str,
    threads: Option<usize>,
    registers: Option<&str>,
) -> PyResult<Settings> {
    let scheme = match scheme {
        "rk4" => Scheme::Rk4,
        "euler" => Scheme::Euler,
        other => return Err(value(format!("scheme = {other}: must be rk4 or euler"))),
    };
    let path = match registers {
        None => Path::best(),
        Some(name) => {
            Path::available().into_iter().find(|path| path.name() == name).ok_or_else(|| {
                let names: Vec<&str> = Path::available().into_iter().map(Path::name).collect();
                value(format!("registers = {name}: this processor has {}", names.join(", ")))
            })?
        }
    };
    let all = Settings::default();
    if let Some(threads) = threads
        && !(1..=THREADS_MAX).contains(&threads)
    {
        let limit = if threads == 0 { "at least 1" } else { "at most 1024" };
        return Err(value(format!("threads = {threads}: must be {limit}")));
    }
    Ok(Settings { dt_s, scheme, threads: threads.unwrap_or(all.threads), path })
}

/// Name of a scheme in arguments.
pub(crate) fn scheme_name(scheme: Scheme) -> &'static str {
    match scheme {
        Scheme::Rk4 => "rk4",
        Scheme::Euler => "euler",
    }
}

impl Batch {
    pub(super) fn make(
        py: Python<'_>,
        vehicles: Vec<Bound<'_, Vehicle>>,
        settings: Settings,
        in_32: bool,
        whole: bool,
    ) -> PyResult<Self> {
        let kinds = Kinds::of(&vehicles);
        let mut batch = any_batch(py, &kinds, settings, in_32, whole)?;
        let any = |has: fn(&VehicleFile) -> bool| whole && kinds.files.iter().any(|file| has(file));
        let has_wings = any(|file| !matches!(file.wing, WingPlant::None));
        let has_battery = any(|file| file.battery.is_some());
        let gusty: Vec<_> = kinds
            .files
            .iter()
            .map(|file| file.effects.gust().is_some().then(|| BatchVehicle::from(*file)))
            .collect();
        for (number, kind) in kinds.of.iter().enumerate().filter(|_| whole) {
            now_and_then(py, number)?;
            if let Some(member) = &gusty[*kind] {
                batch.set_air(number, member, air([0.0; 3], 0.0), number as u64)?;
            }
        }
        let count = vehicles.len();
        let vehicles: Vec<_> = vehicles.into_iter().map(Bound::unbind).collect();
        let made_with = vehicles.iter().map(|vehicle| vehicle.clone_ref(py)).collect();
        let locked = Mutex::new(Locked { batch, vehicles });
        Ok(Self { locked, vehicles: count, settings, whole, made_with, has_wings, has_battery })
    }

    /// What pickle kept.
    pub(crate) fn again(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let py = state.py();
        let kept: Result<Kept<'_>, PyErr> = state.extract();
        let (vehicles, replaced, dt_s, [scheme, registers, dtype], threads, whole, bytes) =
            kept.map_err(|_| broken("Batch"))?;
        // Registers differ in speed alone, and another processor has others.
        let registers = Path::available().into_iter().find(|path| path.name() == registers);
        let settings = settings(dt_s, &scheme, Some(threads), registers.map(Path::name))?;
        let batch = Self::make(py, vehicles, settings, dtype == f32::NAME, whole)?;
        for (index, vehicle) in replaced {
            batch.replace(py, index, &vehicle)?;
        }
        batch.restore(py, &bytes)?;
        Ok(batch)
    }

    pub(super) fn lock<'a>(&'a self, py: Python<'_>) -> PyResult<MutexGuard<'a, Locked>> {
        let broken =
            |_| PyRuntimeError::new_err("a call on this batch has panicked; make a new one");
        self.locked.lock_py_attached(py).map_err(broken)
    }

    /// The vehicles that a call is about: those it names, or all.
    ///
    /// # Errors
    /// One that is not there.
    pub(super) fn numbers(&self, vehicles: Option<Indices>) -> PyResult<Vec<usize>> {
        let Some(given) = vehicles else { return Ok((0..self.vehicles).collect()) };
        let numbers = given.of("vehicles")?.into_iter().enumerate();
        numbers
            .map(|(at, number)| {
                let number = usize::try_from(number).unwrap_or(usize::MAX);
                self.check(&format_args!("vehicles[{at}]"), number).map(|()| number)
            })
            .collect()
    }

    pub(super) fn check(&self, name: &dyn Display, vehicle: usize) -> PyResult<()> {
        let all = self.vehicles;
        let missing =
            || PyIndexError::new_err(format!("{name} = {vehicle}: the batch has {all} vehicles"));
        if vehicle < all { Ok(()) } else { Err(missing()) }
    }

    /// Refuses a call about something that no vehicle has, which would do nothing.
    pub(super) fn needs(&self, is_there: bool, what: &str) -> PyResult<()> {
        let why =
            if self.whole { "no vehicle of it has any" } else { "it was made with whole=False" };
        if is_there { Ok(()) } else { Err(value(format!("the batch has no {what}: {why}"))) }
    }
}

/// What pickle keeps: vehicles that it was made with, those that replaced some, step, names of
/// scheme, registers and dtype, threads, whether it is whole, memory.
type Kept<'py> = (
    Vec<Bound<'py, Vehicle>>,
    Vec<(usize, Bound<'py, Vehicle>)>,
    f64,
    [String; 3],
    usize,
    bool,
    Bound<'py, PyBytes>,
);
