//! Many vehicles at once: `squirrel_sim::batch` behind one class for both scalars and all numbers of rotors.

use crate::arguments::{ArrayAny, Float, Indices, Numbers, is_32, rows};
use crate::error::value;
use crate::log::table;
use crate::state::{check_attitudes, state};
use crate::vehicle::Vehicle;
use nalgebra::Vector3;
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::{PyIndexError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3_stub_gen::derive::{gen_stub_pyclass, gen_stub_pyfunction, gen_stub_pymethods};
use squirrel_core::frames::In;
use squirrel_core::vehicle::Vehicle as Airframe;
use squirrel_sim::batch::simd::{Path, Paths};
use squirrel_sim::batch::{BODY_NUMBERS, Batch as Flock, Scheme, Settings};
use std::sync::{Mutex, MutexGuard};

/// Vehicle steps between two looks at Ctrl-C: some hundredths of a second.
const STEPS_A_LOOK: usize = 2_000_000;

/// A batch of any scalar and any number of rotors.
trait AnyFlock: Send {
    fn advance(&mut self, steps: usize);
    fn is_32(&self) -> bool;
    fn rotors(&self) -> usize;
    fn command(&mut self, command: &Bound<'_, PyAny>) -> PyResult<()>;
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>>;
    fn states_into(&self, out: &Bound<'_, PyAny>) -> PyResult<()>;
    fn reset(&mut self, states: &Bound<'_, PyAny>, vehicles: &[usize]) -> PyResult<()>;
    fn set_wind(&mut self, wind: &Bound<'_, PyAny>) -> PyResult<()>;
    fn replace(&mut self, number: usize, vehicle: &Airframe<f64>) -> PyResult<()>;
}

impl<T: Paths + Float, const ROTORS: usize> AnyFlock for Flock<T, ROTORS> {
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
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let width = BODY_NUMBERS + ROTORS;
        let mut numbers = vec![nalgebra::convert(0.0); self.len() * width];
        self.write_states(&mut numbers).map_err(value)?;
        Ok(table::<T>(py, numbers, width)?.into_any())
    }
    fn states_into(&self, out: &Bound<'_, PyAny>) -> PyResult<()> {
        let shape = [Some(self.len()), Some(BODY_NUMBERS + ROTORS)];
        rows::<T>("out", out, &shape, Numbers::Any)?;
        let out = out.cast::<PyArrayDyn<T>>()?;
        if !out.is_c_contiguous() {
            return Err(value("out: must be contiguous, row after row"));
        }
        let mut out = out.try_readwrite().map_err(|error| value(format!("out: {error}")))?;
        let numbers = out.as_slice_mut().map_err(|error| value(format!("out: {error}")))?;
        self.write_states(numbers).map_err(value)
    }
    fn reset(&mut self, states: &Bound<'_, PyAny>, vehicles: &[usize]) -> PyResult<()> {
        let width = BODY_NUMBERS + ROTORS;
        let rows = rows::<T>("state", states, &[Some(vehicles.len()), Some(width)], Numbers::Finite)?;
        check_attitudes("state", rows.numbers(), width, 6)?;
        for (vehicle, row) in vehicles.iter().zip(rows.numbers().chunks_exact(width)) {
            Self::reset(self, *vehicle, &state(row)).map_err(value)?;
        }
        Ok(())
    }
    fn set_wind(&mut self, wind: &Bound<'_, PyAny>) -> PyResult<()> {
        let wind = rows::<T>("wind_ned_m_s", wind, &[Some(self.len()), Some(3)], Numbers::Finite)?;
        for vehicle in 0..self.len() {
            Self::set_wind(self, vehicle, In::new(Vector3::from(wind.row(vehicle)))).map_err(value)?;
        }
        Ok(())
    }
    fn replace(&mut self, number: usize, vehicle: &Airframe<f64>) -> PyResult<()> {
        Self::replace(self, number, &vehicle.cast().map_err(value)?).map_err(value)
    }
}

/// The airframe with what its constant effects change.
fn airframe(vehicle: &Vehicle) -> PyResult<Airframe<f64>> {
    vehicle.file.effects.alter(&vehicle.file.vehicle).map_err(value)
}

/// Makes a batch.
fn flock(vehicles: &[Bound<'_, Vehicle>], settings: Settings, in_32: bool) -> PyResult<Box<dyn AnyFlock>> {
    let airframes = vehicles.iter().map(|vehicle| airframe(vehicle.get())).collect::<PyResult<Vec<_>>>()?;
    let rotors = airframes.first().map_or(0, |first| first.rotors().len());
    if let Some(at) = airframes.iter().position(|one| one.rotors().len() != rotors) {
        let others = airframes[at].rotors().len();
        return Err(value(format!(
            "vehicles[{at}]: {others} rotors, vehicles[0] has {rotors}; a batch holds one kind"
        )));
    }
    match rotors {
        // An empty list is the batch's to refuse.
        0 | 4 => of_rotors::<4>(&airframes, settings, in_32),
        6 => of_rotors::<6>(&airframes, settings, in_32),
        8 => of_rotors::<8>(&airframes, settings, in_32),
        _ => Err(value(format!("vehicles: {rotors} rotors, a batch holds vehicles of 4, 6 or 8"))),
    }
}

fn of_rotors<const ROTORS: usize>(
    airframes: &[Airframe<f64>],
    settings: Settings,
    in_32: bool,
) -> PyResult<Box<dyn AnyFlock>> {
    if in_32 { of::<f32, ROTORS>(airframes, settings) } else { of::<f64, ROTORS>(airframes, settings) }
}

fn of<T: Paths + Float, const ROTORS: usize>(
    airframes: &[Airframe<f64>],
    settings: Settings,
) -> PyResult<Box<dyn AnyFlock>> {
    let airframes =
        airframes.iter().map(|one| one.cast::<T>().map_err(value)).collect::<PyResult<Vec<_>>>()?;
    Ok(Box::new(Flock::<T, ROTORS>::new(&airframes, settings).map_err(value)?))
}

pub(crate) fn scheme(scheme: &str) -> PyResult<Scheme> {
    match scheme {
        "rk4" => Ok(Scheme::Rk4),
        "euler" => Ok(Scheme::Euler),
        other => Err(value(format!("scheme = {other}: must be rk4 or euler"))),
    }
}

fn settings(dt_s: f64, scheme: &str, threads: Option<usize>) -> PyResult<Settings> {
    let scheme = self::scheme(scheme)?;
    let all = Settings::default();
    Ok(Settings { dt_s, scheme, threads: threads.unwrap_or(all.threads), path: Path::best() })
}

/// Many vehicles at once, each with numbers of its own: rigid body, rotors with lag, drag, wind.
///
/// Vehicles start at rest at the origin, level, rotors stopped. What a vehicle does depends on nothing but itself: the same bits
/// in a batch of any size, at any place in it, on any number of threads, in one call or in many. Wings, batteries and effects
/// that change in flight do not act here. Several threads may call at once; they wait for each other.
///
/// Parameters
/// ----------
/// vehicles : sequence of Vehicle
///     ``[vehicle] * 1000`` for a thousand that are alike. All have 4, 6 or 8 rotors.
/// dt_s : float
///     Step.
/// scheme : str
///     ``rk4``, or ``euler``: a quarter of the work, first order.
/// dtype : str
///     ``float32`` or ``float64``.
/// threads : int, optional
///     That work, the caller among them; as many as there are cores if left out.
///
/// Raises
/// ------
/// ValueError
///     Names the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import squirrel
/// >>> vehicle = squirrel.Vehicle.bundled("squirrel")
/// >>> batch = squirrel.Batch(vehicles=[vehicle] * 100)
/// >>> batch.command(np.full((100, 4), 0.8, np.float32))
/// >>> batch.step(1000)
/// >>> bool((batch.states()[:, 2] < 0).all())
/// True
#[gen_stub_pyclass]
#[pyclass(frozen, module = "squirrel._squirrel")]
pub(crate) struct Batch {
    flock: Mutex<Box<dyn AnyFlock>>,
    vehicles: usize,
    settings: Settings,
}

impl Batch {
    fn lock<'a>(&'a self, py: Python<'_>) -> PyResult<MutexGuard<'a, Box<dyn AnyFlock>>> {
        let broken = |_| PyRuntimeError::new_err("a call on this batch has panicked; make a new one");
        self.flock.lock_py_attached(py).map_err(broken)
    }
}

#[gen_stub_pymethods]
#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (*, vehicles, dt_s = 1e-3, scheme = "rk4", dtype = "float32", threads = None))]
    fn new(
        vehicles: Vec<Bound<'_, Vehicle>>,
        dt_s: f64,
        scheme: &str,
        dtype: &str,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let in_32 = match dtype {
            "float32" => true,
            "float64" => false,
            other => return Err(value(format!("dtype = {other}: must be float32 or float64"))),
        };
        let settings = settings(dt_s, scheme, threads)?;
        let flock = flock(&vehicles, settings, in_32)?;
        Ok(Self { flock: Mutex::new(flock), vehicles: vehicles.len(), settings })
    }

    /// Tell the rotors what to do from now on.
    ///
    /// Parameters
    /// ----------
    /// command : ndarray of the batch's dtype, shape (n, rotors)
    ///     In the unit that each vehicle declares; limited to its range.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Another dtype or shape, a number that is not finite.
    fn command(&self, py: Python<'_>, command: ArrayAny<'_>) -> PyResult<()> {
        self.lock(py)?.command(&command.0)
    }

    /// Fly on, commands and wind held.
    ///
    /// A vehicle that leaves all bounds becomes NaN, and none of its neighbours with it. Ctrl-C ends the call between two steps.
    ///
    /// Parameters
    /// ----------
    /// steps : int
    ///     How many steps of `dt_s`.
    #[pyo3(signature = (steps = 1))]
    fn step(&self, py: Python<'_>, steps: usize) -> PyResult<()> {
        let mut guard = self.lock(py)?;
        let flock: &mut dyn AnyFlock = &mut **guard;
        let chunk = (STEPS_A_LOOK / self.vehicles).max(1);
        let mut left = steps;
        while left > chunk {
            py.detach(|| flock.advance(chunk));
            py.check_signals()?;
            left -= chunk;
        }
        py.detach(|| flock.advance(left));
        Ok(())
    }

    /// Motions of all vehicles.
    ///
    /// Parameters
    /// ----------
    /// out : ndarray of the batch's dtype, shape (n, 13 + rotors), optional
    ///     To write into; contiguous. A new array if left out.
    ///
    /// Returns
    /// -------
    /// ndarray of the batch's dtype, shape (n, 13 + rotors)
    ///     Position (NED, m), velocity (NED, m/s), attitude (body to NED, w x y z), angular rate (body, rad/s), rotor speeds (rad/s).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     `out` has another dtype, shape or order, or cannot be written to.
    #[pyo3(signature = (out = None))]
    #[gen_stub(override_return_type(type_repr = "numpy.typing.NDArray[typing.Any]", imports = ("numpy.typing", "typing")))]
    fn states<'py>(&self, py: Python<'py>, out: Option<ArrayAny<'py>>) -> PyResult<Bound<'py, PyAny>> {
        let flock = self.lock(py)?;
        let Some(out) = out else { return flock.states(py) };
        flock.states_into(&out.0)?;
        Ok(out.0)
    }

    /// Put vehicles somewhere else; their commands and their wind stay.
    ///
    /// Parameters
    /// ----------
    /// state : ndarray of the batch's dtype, shape (n, 13 + rotors)
    ///     As `states` gives them.
    /// vehicles : iterable of int, optional
    ///     Which; all in their order if left out.
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     There is no such vehicle.
    /// ValueError
    ///     Another dtype or shape, a number that is not finite, an attitude that is no rotation.
    #[pyo3(signature = (state, *, vehicles = None))]
    fn reset(&self, py: Python<'_>, state: ArrayAny<'_>, vehicles: Option<Indices>) -> PyResult<()> {
        let vehicles = vehicles.map_or_else(|| (0..self.vehicles).collect(), |given| given.0);
        vehicles.iter().try_for_each(|vehicle| self.check(*vehicle))?;
        self.lock(py)?.reset(&state.0, &vehicles)
    }

    /// Velocity of the air about each vehicle from now on.
    ///
    /// Parameters
    /// ----------
    /// wind_ned_m_s : ndarray of the batch's dtype, shape (n, 3)
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Another dtype or shape, a number that is not finite.
    fn set_wind(&self, py: Python<'_>, wind_ned_m_s: ArrayAny<'_>) -> PyResult<()> {
        self.lock(py)?.set_wind(&wind_ned_m_s.0)
    }

    /// Another airframe for one vehicle; it keeps its motion.
    ///
    /// Parameters
    /// ----------
    /// index : int
    ///     Which, from 0.
    /// vehicle : Vehicle
    ///     With as many rotors.
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     There is no such vehicle.
    /// ValueError
    ///     Another number of rotors, or rotors too quick for the step.
    fn replace(&self, py: Python<'_>, index: usize, vehicle: &Bound<'_, Vehicle>) -> PyResult<()> {
        self.check(index)?;
        let airframe = airframe(vehicle.get())?;
        let mut flock = self.lock(py)?;
        let (has, must) = (airframe.rotors().len(), flock.rotors());
        if has != must {
            return Err(value(format!("vehicle: {has} rotors, this batch holds vehicles of {must}")));
        }
        flock.replace(index, &airframe)
    }

    /// Step, s.
    #[getter]
    fn dt_s(&self) -> f64 {
        self.settings.dt_s
    }

    /// Threads that work, the caller among them.
    #[getter]
    fn threads(&self) -> usize {
        self.settings.threads
    }

    /// ``float32`` or ``float64``.
    #[getter]
    fn dtype(&self, py: Python<'_>) -> PyResult<&'static str> {
        Ok(if self.lock(py)?.is_32() { f32::NAME } else { f64::NAME })
    }

    fn __len__(&self) -> usize {
        self.vehicles
    }
}

impl Batch {
    fn check(&self, vehicle: usize) -> PyResult<()> {
        let all = self.vehicles;
        let missing = || PyIndexError::new_err(format!("vehicle {vehicle}: the batch has {all}"));
        if vehicle < all { Ok(()) } else { Err(missing()) }
    }
}

/// Fly many vehicles under given commands and keep every motion.
///
/// The dynamics are those of `Batch`, and so are the bits.
///
/// Parameters
/// ----------
/// vehicles : sequence of Vehicle
///     ``[vehicle] * n`` for n that are alike.
/// state : ndarray of float32 or float64, shape (n, 13 + rotors)
///     Where they start, as `Batch.states` gives it; its dtype is that of the flight.
/// command : ndarray of the same dtype, shape (periods, n, rotors)
///     Held for a period each.
/// steps_per_command : int
///     Steps of a period.
/// dt_s : float
///     Step.
/// scheme : str
///     ``rk4`` or ``euler``.
/// wind_ned_m_s : ndarray of the same dtype, shape (n, 3), optional
///     Velocity of the air; calm if left out.
/// threads : int, optional
///     That work; as many as there are cores if left out.
///
/// Returns
/// -------
/// ndarray of the same dtype, shape (periods, n, 13 + rotors)
///     Motions at the end of each period.
///
/// Raises
/// ------
/// ValueError
///     Names the argument, what was expected and what came.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[pyo3(signature = (*, vehicles, state, command, steps_per_command = 1, dt_s = 1e-3, scheme = "rk4", wind_ned_m_s = None, threads = None))]
#[gen_stub(override_return_type(type_repr = "numpy.typing.NDArray[typing.Any]", imports = ("numpy.typing", "typing")))]
pub(crate) fn rollout<'py>(
    py: Python<'py>,
    vehicles: Vec<Bound<'py, Vehicle>>,
    state: ArrayAny<'py>,
    command: ArrayAny<'py>,
    steps_per_command: usize,
    dt_s: f64,
    scheme: &str,
    wind_ned_m_s: Option<ArrayAny<'py>>,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let in_32 = is_32(&state.0);
    let settings = settings(dt_s, scheme, threads)?;
    let batch =
        Batch { flock: Mutex::new(flock(&vehicles, settings, in_32)?), vehicles: vehicles.len(), settings };
    batch.reset(py, state, None)?;
    if let Some(wind) = wind_ned_m_s {
        batch.set_wind(py, wind)?;
    }
    if in_32 {
        periods::<f32>(py, &batch, &command, steps_per_command)
    } else {
        periods::<f64>(py, &batch, &command, steps_per_command)
    }
}

/// The motions of all periods.
fn periods<'py, T: Float>(
    py: Python<'py>,
    batch: &Batch,
    command: &ArrayAny<'py>,
    steps: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let rotors = batch.lock(py)?.rotors();
    let (n, width) = (batch.vehicles, BODY_NUMBERS + rotors);
    let commands = rows::<T>("command", &command.0, &[None, Some(n), Some(rotors)], Numbers::Finite)?;
    let out = PyArray1::<T>::zeros(py, [commands.numbers().len() / rotors * width], false);
    let count = commands.numbers().len() / (n * rotors);
    let out = out.reshape([count, n, width])?;
    for period in 0..count {
        let command = command.0.get_item(period)?;
        batch.command(py, ArrayAny(command))?;
        batch.step(py, steps)?;
        let row = out.get_item(period)?;
        batch.lock(py)?.states_into(&row)?;
        py.check_signals()?;
    }
    Ok(out.into_any())
}
