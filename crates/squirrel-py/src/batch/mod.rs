//! Many vehicles at once: `squirrel_batch` behind one class for both scalars and all numbers
//! of rotors.

mod any_batch;
mod make;
pub(crate) mod rollout;

use crate::arguments::{Array64, ArrayAny, Float, Numbers, rows};
use crate::error::value;
use crate::interrupt::{now_and_then, watched};
use crate::kept::reduced;
use crate::scalars::{self, Indices};
use crate::vehicle::Vehicle;
use any_batch::{AnyBatch, advance, air, check_wind};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use pyo3_stub_gen::derive::{gen_stub_pyclass, gen_stub_pymethods};
use squirrel_batch::{BatchVehicle, Settings};
use std::sync::Mutex;

pub(crate) use make::{scheme_name, settings};

/// Many vehicles at once, each with numbers of its own.
///
/// All have rigid body, rotors with lag, drag and wind; wings with their servos, batteries and
/// effects fly where a vehicle has them, as they do in `simulate`, and what no vehicle of the batch
/// has costs nothing. The base model alone, ``whole=False``, is about three times as fast as a
/// vehicle with wings and battery.
///
/// Vehicles start at rest at the origin, level, rotors stopped, wings folded, batteries full. What
/// a vehicle does depends on nothing but itself: the same bits in a batch of any size, at any place
/// in it, on any number of threads and any registers, in one call or in many. Several threads may
/// call at once; they wait for each other.
///
/// Parameters
/// ----------
/// vehicles : sequence of Vehicle
///     ``[vehicle] * 1000`` for a thousand that are alike. All have 4, 6 or 8 rotors; wings, batteries and effects need 4. Refused
///     are wings that are a network, flat wings beside membranes, and effects that act on sensors, which a batch lacks.
/// whole : bool
///     Whether wings, batteries and effects fly, or the base model alone: rigid body, rotors, drag, and wind as `set_wind` says.
/// dt_s : float
///     Step.
/// scheme : str
///     ``rk4``, or ``euler``: a quarter of the work, first order.
/// dtype : str
///     ``float32`` or ``float64``.
/// threads : int, optional
///     That work, the caller among them; as many as there are cores if left out.
/// registers : str, optional
///     ``avx512``, ``avx2``, ``portable`` or ``scalar``; the widest that the processor has if left out. For comparisons: they differ in
///     speed alone.
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
/// >>> batch.command_wings(np.ones((100, 2), np.float32))
/// >>> batch.step(1000)
/// >>> bool((batch.states()[:, 2] < 0).all()), bool((batch.deployments() > 0.99).all())
/// (True, True)
#[gen_stub_pyclass]
#[pyclass(frozen, module = "squirrel._squirrel")]
pub(crate) struct Batch {
    locked: Mutex<Locked>,
    vehicles: usize,
    settings: Settings,
    whole: bool,
    /// Those that it was made with, which decide what there is a place for.
    made_with: Vec<Py<Vehicle>>,
    /// What any vehicle had when the batch was made.
    has_wings: bool,
    has_battery: bool,
}

/// What the lock is for.
struct Locked {
    batch: Box<dyn AnyBatch>,
    /// Whose gusts `set_air` asks for.
    vehicles: Vec<Py<Vehicle>>,
}

#[gen_stub_pymethods]
#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (*, vehicles, whole = true, dt_s = 1e-3, scheme = "rk4", dtype = "float32", threads = None, registers = None))]
    fn new(
        py: Python<'_>,
        vehicles: Vec<Bound<'_, Vehicle>>,
        whole: bool,
        #[pyo3(from_py_with = scalars::dt_s)] dt_s: f64,
        #[gen_stub(override_type(type_repr = "flight.Scheme", imports = ("squirrel.flight")))]
        scheme: &str,
        dtype: &str,
        #[pyo3(from_py_with = scalars::threads)] threads: Option<usize>,
        registers: Option<&str>,
    ) -> PyResult<Self> {
        let in_32 = match dtype {
            "float32" => true,
            "float64" => false,
            other => return Err(value(format!("dtype = {other}: must be float32 or float64"))),
        };
        Self::make(py, vehicles, settings(dt_s, scheme, threads, registers)?, in_32, whole)
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
        self.lock(py)?.batch.command(&command.0)
    }

    /// Tell the wings what to do from now on.
    ///
    /// Parameters
    /// ----------
    /// command : ndarray of the batch's dtype, shape (n, 2)
    ///     Left and right, 0 folded to 1 spread; limited. Without effect where a vehicle has no wings.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Another dtype or shape, a number that is not finite, a batch without wings.
    fn command_wings(&self, py: Python<'_>, command: ArrayAny<'_>) -> PyResult<()> {
        self.needs(self.has_wings, "wings")?;
        self.lock(py)?.batch.command_wings(&command.0)
    }

    /// Fly on, commands held.
    ///
    /// A vehicle that leaves all bounds becomes NaN, and none of its neighbours with it. Ctrl-C
    /// ends the call between two steps.
    ///
    /// Parameters
    /// ----------
    /// steps : int
    ///     How many steps of `dt_s`.
    #[pyo3(signature = (steps = 1))]
    fn step(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = scalars::steps)] steps: usize,
    ) -> PyResult<()> {
        advance(py, &mut *self.lock(py)?.batch, steps)
    }

    /// Command, fly on, and look: `command`, `step` and `states` in one call, with the same bits
    /// and in less time.
    ///
    /// Parameters
    /// ----------
    /// command : ndarray of the batch's dtype, shape (n, rotors)
    ///     In the unit that each vehicle declares; limited to its range; held for all steps.
    /// steps : int
    ///     How many steps of `dt_s`.
    /// out : ndarray of the batch's dtype, shape (n, 13 + rotors), optional
    ///     To write into; contiguous. A new array if left out.
    ///
    /// Returns
    /// -------
    /// ndarray of the batch's dtype, shape (n, 13 + rotors)
    ///     As `states` gives them.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Another dtype or shape, a command that is not finite, an `out` that cannot be written to. Nothing has moved then.
    #[pyo3(signature = (command, steps = 1, *, out = None))]
    #[gen_stub(override_return_type(type_repr = "numpy.typing.NDArray[typing.Any]", imports = ("numpy.typing", "typing")))]
    fn fly<'py>(
        &self,
        py: Python<'py>,
        command: ArrayAny<'py>,
        #[pyo3(from_py_with = scalars::steps)] steps: usize,
        out: Option<ArrayAny<'py>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.lock(py)?.batch.fly(py, &command.0, steps, out.map(|out| out.0))
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
    fn states<'py>(
        &self,
        py: Python<'py>,
        out: Option<ArrayAny<'py>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.lock(py)?.batch.states(py, out.map(|out| out.0))
    }

    /// How far the wings of all vehicles are open.
    ///
    /// Returns
    /// -------
    /// ndarray of the batch's dtype, shape (n, 2)
    ///     Left and right, 0 folded to 1 spread.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A batch without wings.
    #[gen_stub(override_return_type(type_repr = "numpy.typing.NDArray[typing.Any]", imports = ("numpy.typing", "typing")))]
    fn deployments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.needs(self.has_wings, "wings")?;
        self.lock(py)?.batch.deployments(py)
    }

    /// Batteries of all vehicles.
    ///
    /// Returns
    /// -------
    /// ndarray of the batch's dtype, shape (n, 3)
    ///     Charge (0 to 1), terminal voltage (V), current (A). A vehicle without a battery stays at its reference voltage.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A batch without batteries.
    #[gen_stub(override_return_type(type_repr = "numpy.typing.NDArray[typing.Any]", imports = ("numpy.typing", "typing")))]
    fn battery<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.needs(self.has_battery, "battery")?;
        self.lock(py)?.batch.battery(py)
    }

    /// Put vehicles somewhere else: wings folded, batteries full. Their air stays and so does what
    /// their rotors are told; commands on their way are lost.
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
    fn reset(
        &self,
        py: Python<'_>,
        state: ArrayAny<'_>,
        vehicles: Option<Indices>,
    ) -> PyResult<()> {
        let vehicles = self.numbers(vehicles)?;
        self.lock(py)?.batch.reset(py, &state.0, &vehicles)
    }

    /// Rest batteries at a charge.
    ///
    /// Parameters
    /// ----------
    /// charge : ndarray of the batch's dtype, shape (n,)
    ///     0 to 1. Without effect where a vehicle has no battery.
    /// vehicles : iterable of int, optional
    ///     Which; all in their order if left out.
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     There is no such vehicle.
    /// ValueError
    ///     Another dtype or shape, a charge out of range, a batch without batteries.
    #[pyo3(signature = (charge, *, vehicles = None))]
    fn set_charge(
        &self,
        py: Python<'_>,
        charge: ArrayAny<'_>,
        vehicles: Option<Indices>,
    ) -> PyResult<()> {
        self.needs(self.has_battery, "battery")?;
        let vehicles = self.numbers(vehicles)?;
        self.lock(py)?.batch.set_charge(py, &charge.0, &vehicles)
    }

    /// Velocity of the air about each vehicle from now on; gusts end, those of the effect ``gust``
    /// too.
    ///
    /// Parameters
    /// ----------
    /// wind_ned_m_s : ndarray of the batch's dtype, shape (n, 3)
    ///     At most 1000 m/s along an axis.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Another dtype or shape, a number that is not finite or beyond what air does.
    fn set_wind(&self, py: Python<'_>, wind_ned_m_s: ArrayAny<'_>) -> PyResult<()> {
        self.lock(py)?.batch.set_wind(py, &wind_ned_m_s.0)
    }

    /// Moving air about vehicles from now on, as a flight of `simulate` with the same seed has it.
    ///
    /// Gusts are a Gauss-Markov process of 1.5 s per axis that moves at 300 Hz. Those of the effect
    /// ``gust`` blow on top of them; where nothing was set, with the number of the vehicle as seed.
    ///
    /// Parameters
    /// ----------
    /// wind_ned_m_s : ndarray of float64, shape (n, 3)
    ///     Steady part.
    /// gust_sigma_m_s : ndarray of float64, shape (n,), optional
    ///     Standard deviation of the gusts per axis; 0 if left out.
    /// seed : iterable of int, optional
    ///     Of each vehicle's gusts; its number in the batch if left out.
    /// vehicles : iterable of int, optional
    ///     Which; all in their order if left out.
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     There is no such vehicle.
    /// ValueError
    ///     Another dtype or shape, a number that is not finite, a deviation below 0, a batch of the base model.
    #[pyo3(signature = (wind_ned_m_s, *, gust_sigma_m_s = None, seed = None, vehicles = None))]
    fn set_air(
        &self,
        py: Python<'_>,
        wind_ned_m_s: Array64<'_>,
        gust_sigma_m_s: Option<Array64<'_>>,
        seed: Option<Indices>,
        vehicles: Option<Indices>,
    ) -> PyResult<()> {
        let vehicles = self.numbers(vehicles)?;
        let n = vehicles.len();
        let wind =
            rows::<f64>("wind_ned_m_s", &wind_ned_m_s.0, &[Some(n), Some(3)], Numbers::Finite)?;
        check_wind(wind.numbers(), 3)?;
        let name = "gust_sigma_m_s";
        let sigma =
            gust_sigma_m_s.map(|sigma| rows::<f64>(name, &sigma.0, &[Some(n)], Numbers::Finite));
        let sigma =
            sigma.transpose()?.map_or_else(|| vec![0.0; n], |sigma| sigma.numbers().to_vec());
        if let Some(at) = sigma.iter().position(|sigma| !(0.0..=100.0).contains(sigma)) {
            let limit = if sigma[at] < 0.0 { ">= 0" } else { "<= 100" };
            return Err(value(format!("{name}[{at}] = {}: must be {limit}", sigma[at])));
        }
        let own = || vehicles.iter().map(|vehicle| *vehicle as u64).collect();
        let seeds = seed.map_or_else(|| Ok(own()), |given| given.of("seed"))?;
        if seeds.len() != n {
            return Err(value(format!("seed: expected {n}, got {}", seeds.len())));
        }
        let mut locked = self.lock(py)?;
        let Locked { batch, vehicles: fitted } = &mut *locked;
        for (i, number) in vehicles.into_iter().enumerate() {
            now_and_then(py, i)?;
            let member = BatchVehicle::from(&fitted[number].get().file);
            batch.set_air(number, &member, air(wind.row(i), sigma[i]), seeds[i])?;
        }
        Ok(())
    }

    /// Another vehicle in the place of one, as for a domain that is drawn anew; motion, air, charge
    /// of the battery, and what rotors and wings are told stay.
    ///
    /// Parameters
    /// ----------
    /// index : int
    ///     Which, from 0.
    /// vehicle : Vehicle
    ///     With as many rotors, and no wings, battery or effect of a kind that no vehicle had when the batch was made.
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     There is no such vehicle.
    /// ValueError
    ///     Another number of rotors, rotors too quick for the step, something that the batch has no place for.
    fn replace(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = scalars::index)] index: usize,
        vehicle: &Bound<'_, Vehicle>,
    ) -> PyResult<()> {
        self.check(&"index", index)?;
        let file = &vehicle.get().file;
        let mut locked = self.lock(py)?;
        let (has, must) = (file.vehicle.rotors().len(), locked.batch.rotors());
        if has != must {
            return Err(value(format!(
                "vehicle: {has} rotors, this batch holds vehicles of {must}"
            )));
        }
        if self.whole {
            locked.batch.refit(index, &BatchVehicle::from(file))?;
        } else {
            locked.batch.replace(index, &file.vehicle)?;
        }
        locked.vehicles[index] = vehicle.clone().unbind();
        Ok(())
    }

    /// Everything that changes in flight, to be taken up again by `restore`: motions, commands,
    /// wings, batteries, loads, gusts and commands on their way.
    ///
    /// Returns
    /// -------
    /// bytes
    ///     Equal where the batches fly on alike, bit for bit.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let guard = self.lock(py)?;
        let batch: &dyn AnyBatch = &*guard.batch;
        let bytes = watched(py, |go_on| batch.memory(go_on))?.map_err(value)?;
        drop(guard);
        Ok(PyBytes::new(py, &bytes))
    }

    /// Be again where a batch was; vehicles stay those that there are.
    ///
    /// Parameters
    /// ----------
    /// state : bytes
    ///     What `state` returned, of this batch or of one that is made alike.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The state of another kind of batch, or no state. Nothing has changed then.
    fn restore(&self, py: Python<'_>, state: &Bound<'_, PyBytes>) -> PyResult<()> {
        let mut guard = self.lock(py)?;
        let (batch, bytes): (&mut dyn AnyBatch, _) = (&mut *guard.batch, state.as_bytes());
        watched(py, |go_on| batch.restore(bytes, go_on))?.map_err(value)
    }

    #[gen_stub(override_return_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let guard = self.lock(py)?;
        let now = guard.vehicles.iter().enumerate();
        let replaced: Vec<_> = now
            .filter(|(index, vehicle)| !vehicle.is(&self.made_with[*index]))
            .map(|(index, vehicle)| (index, vehicle.clone_ref(py)))
            .collect();
        let is_32 = guard.batch.is_32();
        drop(guard);
        let made_with: Vec<_> = self.made_with.iter().map(|vehicle| vehicle.bind(py)).collect();
        let Settings { dt_s, scheme, threads, path } = self.settings;
        let dtype = if is_32 { f32::NAME } else { f64::NAME };
        let names = [scheme_name(scheme), path.name(), dtype];
        let state = self.state(py)?;
        reduced(py, "Batch", (made_with, replaced, dt_s, names, threads, self.whole, state))
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

    /// What the processor works with: ``avx512``, ``avx2``, ``portable`` or ``scalar``.
    #[getter]
    fn registers(&self) -> &'static str {
        self.settings.path.name()
    }

    /// ``float32`` or ``float64``.
    #[getter]
    fn dtype(&self, py: Python<'_>) -> PyResult<&'static str> {
        Ok(if self.lock(py)?.batch.is_32() { f32::NAME } else { f64::NAME })
    }

    fn __len__(&self) -> usize {
        self.vehicles
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (scalar, n) = (self.dtype(py)?, self.vehicles);
        let with = match (self.has_wings, self.has_battery) {
            (true, true) => ", wings and battery",
            (true, false) => ", wings",
            (false, true) => ", battery",
            (false, false) => "",
        };
        let scheme = scheme_name(self.settings.scheme);
        Ok(format!("<Batch of {n}{with}: {scheme} at {} s, {scalar}>", self.settings.dt_s))
    }
}
