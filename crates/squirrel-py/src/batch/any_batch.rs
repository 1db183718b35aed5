//! A batch of any scalar and any number of rotors behind one trait, and how vehicles become one.

use crate::arguments::{Float, Numbers, array, rows};
use crate::error::value;
use crate::interrupt::{look, now_and_then, watched};
use crate::log::table;
use crate::state::{check_attitudes, state};
use crate::vehicle::Vehicle;
use nalgebra::{Vector3, convert};
use numpy::{PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use squirrel_batch::{BODY_NUMBERS, Batch, BatchError, BatchVehicle, Settings};
use squirrel_core::effects::GUST_TIME_CONSTANT_S;
use squirrel_core::frames::In;
use squirrel_core::vehicle::{RotorAir, Vehicle as Airframe};
use squirrel_sim::plant::{GustModel, WindParameters, WingPlant};
use squirrel_sim::simd::Paths;
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::HashMap;

/// Vehicle steps between two looks at Ctrl-C: a hundredth of a second, or some tenths where
/// everything is slow.
const STEPS_A_LOOK: usize = 1_000_000;
/// Fastest air along an axis.
const WIND_MAX_M_S: f64 = 1000.0;
/// Vehicle steps, some microseconds, below which handing the interpreter's lock to others takes
/// longer than what they wait for.
const FEW_STEPS: usize = 500;

/// A batch of any scalar and any number of rotors.
pub(super) trait AnyBatch: Send + Sync {
    fn vehicles(&self) -> usize;
    fn advance(&mut self, steps: usize);
    /// Commands, steps by way of `advance` where they are many, and motions.
    fn fly<'py>(
        &mut self,
        py: Python<'py>,
        command: &Bound<'py, PyAny>,
        steps: usize,
        out: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>>;
    fn is_32(&self) -> bool;
    fn rotors(&self) -> usize;
    fn command(&mut self, command: &Bound<'_, PyAny>) -> PyResult<()>;
    fn command_wings(&mut self, command: &Bound<'_, PyAny>) -> PyResult<()>;
    fn states<'py>(
        &mut self,
        py: Python<'py>,
        out: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>>;
    fn deployments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>>;
    fn battery<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>>;
    fn reset(
        &mut self,
        py: Python<'_>,
        states: &Bound<'_, PyAny>,
        vehicles: &[usize],
    ) -> PyResult<()>;
    fn set_charge(
        &mut self,
        py: Python<'_>,
        charge: &Bound<'_, PyAny>,
        vehicles: &[usize],
    ) -> PyResult<()>;
    fn set_wind(&mut self, py: Python<'_>, wind: &Bound<'_, PyAny>) -> PyResult<()>;
    fn memory(&self, go_on: &mut dyn FnMut() -> bool) -> Result<Vec<u8>, BatchError>;
    fn restore(&mut self, memory: &[u8], go_on: &mut dyn FnMut() -> bool)
    -> Result<(), BatchError>;
    fn set_air(
        &mut self,
        number: usize,
        member: &BatchVehicle,
        air: WindParameters,
        seed: u64,
    ) -> PyResult<()>;
    fn replace(&mut self, number: usize, airframe: &Airframe<f64>) -> PyResult<()>;
    fn refit(&mut self, number: usize, member: &BatchVehicle) -> PyResult<()>;
}

impl<T: Paths + Float, const ROTORS: usize> AnyBatch for Batch<T, ROTORS> {
    fn vehicles(&self) -> usize {
        self.len()
    }
    fn advance(&mut self, steps: usize) {
        self.step(steps);
    }
    fn is_32(&self) -> bool {
        size_of::<T>() == size_of::<f32>()
    }
    fn rotors(&self) -> usize {
        ROTORS
    }
    fn command(&mut self, command: &Bound<'_, PyAny>) -> PyResult<()> {
        let shape = [Some(self.len()), Some(ROTORS)];
        let command = rows::<T>("command", command, &shape, Numbers::Finite)?;
        Self::command(self, command.numbers()).map_err(value)
    }
    fn command_wings(&mut self, command: &Bound<'_, PyAny>) -> PyResult<()> {
        let command = rows::<T>("command", command, &[Some(self.len()), Some(2)], Numbers::Finite)?;
        Self::command_wings(self, command.numbers()).map_err(value)
    }
    fn states<'py>(
        &mut self,
        py: Python<'py>,
        out: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        with_rows::<T, ROTORS>(py, self.len(), out, |rows| self.write_states(rows).map_err(value))
    }
    fn fly<'py>(
        &mut self,
        py: Python<'py>,
        command: &Bound<'py, PyAny>,
        steps: usize,
        out: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let shape = [Some(self.len()), Some(ROTORS)];
        let command = rows::<T>("command", command, &shape, Numbers::Finite)?;
        let command = command.numbers();
        with_rows::<T, ROTORS>(py, self.len(), out, |rows| {
            match steps.saturating_mul(self.len()) {
                few if few < FEW_STEPS => {
                    return Self::fly(self, command, steps, rows).map_err(value);
                }
                STEPS_A_LOOK.. => {}
                _ => return py.detach(|| Self::fly(self, command, steps, rows).map_err(value)),
            }
            Self::command(self, command).map_err(value)?;
            advance(py, self, steps)?;
            self.write_states(rows).map_err(value)
        })
    }
    fn deployments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = (0..self.len()).map(|number| self.deployment(number).map_err(value));
        Ok(table(py, rows.collect::<PyResult<Vec<_>>>()?.into_flattened(), 2)?.into_any())
    }
    fn battery<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let none = [convert(f64::NAN); 3];
        let rows =
            (0..self.len()).map(|number| Ok(self.battery(number).map_err(value)?.unwrap_or(none)));
        Ok(table(py, rows.collect::<PyResult<Vec<_>>>()?.into_flattened(), 3)?.into_any())
    }
    fn memory(&self, go_on: &mut dyn FnMut() -> bool) -> Result<Vec<u8>, BatchError> {
        Self::memory(self, go_on)
    }
    fn restore(
        &mut self,
        memory: &[u8],
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), BatchError> {
        Self::restore(self, memory, go_on)
    }
    fn reset(
        &mut self,
        py: Python<'_>,
        states: &Bound<'_, PyAny>,
        vehicles: &[usize],
    ) -> PyResult<()> {
        let width = BODY_NUMBERS + ROTORS;
        let rows =
            rows::<T>("state", states, &[Some(vehicles.len()), Some(width)], Numbers::Finite)?;
        check_attitudes("state", rows.numbers(), width, 6)?;
        let rows = rows.numbers().chunks_exact(width);
        for (i, (vehicle, row)) in vehicles.iter().zip(rows).enumerate() {
            now_and_then(py, i)?;
            Self::reset(self, *vehicle, &state(row)).map_err(value)?;
        }
        Ok(())
    }
    fn set_charge(
        &mut self,
        py: Python<'_>,
        charge: &Bound<'_, PyAny>,
        vehicles: &[usize],
    ) -> PyResult<()> {
        let charges = rows::<T>("charge", charge, &[Some(vehicles.len())], Numbers::Finite)?;
        let charges: Vec<f64> = charges
            .numbers()
            .iter()
            .map(|x| nalgebra::try_convert(*x).unwrap_or(f64::NAN))
            .collect();
        if let Some(at) = charges.iter().position(|charge| !(0.0..=1.0).contains(charge)) {
            return Err(value(format!("charge[{at}] = {}: must be 0 to 1", charges[at])));
        }
        for (i, (vehicle, charge)) in vehicles.iter().zip(charges).enumerate() {
            now_and_then(py, i)?;
            Self::set_charge(self, *vehicle, charge).map_err(value)?;
        }
        Ok(())
    }
    fn set_wind(&mut self, py: Python<'_>, wind: &Bound<'_, PyAny>) -> PyResult<()> {
        let wind = rows::<T>("wind_ned_m_s", wind, &[Some(self.len()), Some(3)], Numbers::Finite)?;
        check_wind(wind.numbers(), 3)?;
        for vehicle in 0..self.len() {
            now_and_then(py, vehicle)?;
            Self::set_wind(self, vehicle, In::new(Vector3::from(wind.row(vehicle))))
                .map_err(value)?;
        }
        Ok(())
    }
    fn set_air(
        &mut self,
        number: usize,
        member: &BatchVehicle,
        air: WindParameters,
        seed: u64,
    ) -> PyResult<()> {
        Self::set_air(self, number, member, air, seed).map_err(|error| match error {
            BatchError::NotFitted { .. } => value(
                "gust_sigma_m_s: the base model has no gusts; set_wind between steps moves its air",
            ),
            error => value(error),
        })
    }
    fn replace(&mut self, number: usize, airframe: &Airframe<f64>) -> PyResult<()> {
        Self::replace(self, number, &airframe.cast().map_err(value)?).map_err(value)
    }
    fn refit(&mut self, number: usize, member: &BatchVehicle) -> PyResult<()> {
        Self::refit(self, number, member).map_err(refused)
    }
}

/// Steps, with looks at Ctrl-C in between where they are many.
///
/// # Errors
/// Ctrl-C.
pub(super) fn advance(py: Python<'_>, batch: &mut dyn AnyBatch, steps: usize) -> PyResult<()> {
    if steps.saturating_mul(batch.vehicles()) < FEW_STEPS {
        batch.advance(steps);
        return Ok(());
    }
    let at_once = (STEPS_A_LOOK / batch.vehicles()).max(1);
    let mut left = steps;
    while left > at_once {
        py.detach(|| batch.advance(at_once));
        look(py)?;
        left -= at_once;
    }
    py.detach(|| batch.advance(left));
    Ok(())
}

/// Rows of motions that `write` fills: of an array that came, or of a new one.
fn with_rows<'py, T: Paths + Float, const ROTORS: usize>(
    py: Python<'py>,
    vehicles: usize,
    out: Option<Bound<'py, PyAny>>,
    write: impl FnOnce(&mut [T]) -> PyResult<()>,
) -> PyResult<Bound<'py, PyAny>> {
    let width = BODY_NUMBERS + ROTORS;
    let Some(out) = out else {
        let mut numbers = vec![convert(0.0); vehicles * width];
        write(&mut numbers)?;
        return Ok(table::<T>(py, numbers, width)?.into_any());
    };
    let array = array::<T>("out", &out, &[Some(vehicles), Some(width)])?;
    if !array.is_c_contiguous() {
        return Err(value("out: must be contiguous, row after row"));
    }
    let mut rows = array.try_readwrite().map_err(|error| value(format!("out: {error}")))?;
    write(rows.as_slice_mut().map_err(|error| value(format!("out: {error}")))?)?;
    drop(rows);
    Ok(out)
}

/// A batch that cannot be, and what can.
fn refused(error: BatchError) -> PyErr {
    match error {
        BatchError::Effect { .. } | BatchError::Network { .. } | BatchError::Wings { .. } => {
            value(format!("{error}; whole=False flies the base model"))
        }
        error => value(error),
    }
}

/// Refuses air that no air does: numbers beyond it leave all bounds, and motions become NaN.
pub(super) fn check_wind<T: Paths>(numbers: &[T], width: usize) -> PyResult<()> {
    let most = convert::<f64, T>(WIND_MAX_M_S);
    numbers.iter().position(|x| x.abs() > most).map_or(Ok(()), |at| {
        let (x, row, column) = (numbers[at], at / width, at % width);
        Err(value(format!(
            "wind_ned_m_s[{row}, {column}] = {x}: must be -{WIND_MAX_M_S} to {WIND_MAX_M_S}"
        )))
    })
}

/// Steady air with gusts as a scenario has them where it does not say otherwise.
pub(super) fn air(mean_ned_m_s: [f64; 3], gust_sigma_m_s: f64) -> WindParameters {
    let gust = GustModel::GaussMarkov { time_constant_s: GUST_TIME_CONSTANT_S };
    WindParameters { mean_ned_m_s, gust_sigma_m_s, gust }
}

/// Vehicles of which many may be one object, as in `[vehicle] * 1000`.
pub(super) struct Kinds<'a> {
    /// Of each vehicle, which of the files is its own.
    pub(super) of: Vec<usize>,
    pub(super) files: Vec<&'a VehicleFile>,
    /// The first vehicle of each.
    first: Vec<usize>,
}

impl<'a> Kinds<'a> {
    pub(super) fn of(vehicles: &'a [Bound<'_, Vehicle>]) -> Self {
        let (mut known, mut kinds) =
            (HashMap::new(), Self { of: Vec::new(), files: Vec::new(), first: Vec::new() });
        for (number, vehicle) in vehicles.iter().enumerate() {
            let kind = *known.entry(vehicle.as_ptr()).or_insert_with(|| {
                kinds.files.push(&vehicle.get().file);
                kinds.first.push(number);
                kinds.files.len() - 1
            });
            kinds.of.push(kind);
        }
        kinds
    }
}

/// Makes a batch; Ctrl-C ends it.
///
/// * `whole` - with wings, batteries and effects; otherwise the airframes alone
pub(super) fn any_batch(
    py: Python<'_>,
    kinds: &Kinds<'_>,
    settings: Settings,
    in_32: bool,
    whole: bool,
) -> PyResult<Box<dyn AnyBatch>> {
    let files = &kinds.files;
    let rotors = files.first().map_or(0, |first| first.vehicle.rotors().len());
    if let Some(at) = files.iter().position(|one| one.vehicle.rotors().len() != rotors) {
        let (others, first) = (files[at].vehicle.rotors().len(), kinds.first[at]);
        return Err(value(format!(
            "vehicles[{first}]: {others} rotors, vehicles[0] has {rotors}; a batch holds one kind"
        )));
    }
    match rotors {
        // An empty list is the batch's to refuse.
        0 | 4 if whole && in_32 => of_members::<f32>(py, kinds, settings),
        0 | 4 if whole => of_members::<f64>(py, kinds, settings),
        0 | 4 => of_airframes::<4>(py, kinds, settings, in_32),
        6 | 8 if whole && files.iter().any(|file| !is_base(file)) => Err(value(format!(
            "vehicles: {rotors} rotors; wings, batteries and effects fly in batches of 4 rotors only; whole=False flies the base model"
        ))),
        6 => of_airframes::<6>(py, kinds, settings, in_32),
        8 => of_airframes::<8>(py, kinds, settings, in_32),
        _ => Err(value(format!("vehicles: {rotors} rotors, a batch holds vehicles of 4, 6 or 8"))),
    }
}

/// Whether the base model is all that a vehicle has.
fn is_base(file: &VehicleFile) -> bool {
    matches!(file.wing, WingPlant::None)
        && file.battery.is_none()
        && !file.effects.any()
        && file.vehicle.parameters().propulsion.air == RotorAir::still()
}

fn of_members<T: Paths + Float>(
    py: Python<'_>,
    kinds: &Kinds<'_>,
    settings: Settings,
) -> PyResult<Box<dyn AnyBatch>> {
    let members: Vec<BatchVehicle> = kinds.files.iter().map(|file| (*file).into()).collect();
    let made = watched(py, |go_on| Batch::<T, 4>::of_kinds(&kinds.of, &members, settings, go_on))?;
    Ok(Box::new(made.map_err(refused)?))
}

fn of_airframes<const ROTORS: usize>(
    py: Python<'_>,
    kinds: &Kinds<'_>,
    settings: Settings,
    in_32: bool,
) -> PyResult<Box<dyn AnyBatch>> {
    if in_32 {
        of::<f32, ROTORS>(py, kinds, settings)
    } else {
        of::<f64, ROTORS>(py, kinds, settings)
    }
}

fn of<T: Paths + Float, const ROTORS: usize>(
    py: Python<'_>,
    kinds: &Kinds<'_>,
    settings: Settings,
) -> PyResult<Box<dyn AnyBatch>> {
    let cast = |file: &&VehicleFile| file.vehicle.cast::<T>().map_err(value);
    let airframes = kinds.files.iter().map(cast).collect::<PyResult<Vec<_>>>()?;
    let made = watched(py, |go_on| {
        Batch::<T, ROTORS>::new_of_kinds(&kinds.of, &airframes, settings, go_on)
    })?;
    Ok(Box::new(made.map_err(value)?))
}
