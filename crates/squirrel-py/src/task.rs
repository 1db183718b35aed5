//! Environments: `squirrel_batch::task` as arrays. `squirrel.envs` makes Gymnasium's classes of it.

use crate::arguments::{Array32, Numbers, rows};
use crate::batch::{scheme_name, settings};
use crate::error::{value, vehicle as vehicle_error};
use crate::interrupt::watched;
use crate::kept::{broken, reduced};
use crate::log::table;
use crate::scalars::{self, checked_count};
use crate::vehicle::Vehicle;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyIndexError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use pyo3_stub_gen::derive::{gen_stub_pyclass, gen_stub_pymethods};
use squirrel_batch::Settings;
use squirrel_batch::task::course::{CourseKind, Terms};
use squirrel_batch::task::{Level, Outcome, TaskSettings, Tasks as Environments};
use squirrel_core::policy::OBSERVATION;
use squirrel_sim::simd::Path;
use std::sync::{Mutex, MutexGuard};

/// Rotors of the vehicles.
const ROTORS: usize = 4;

/// Environments to learn in, side by side: what the classes of `squirrel.envs` are made of.
///
/// An action is 20 ms of flight. An episode that has ended is followed by a new one in the next
/// step, whose action is not looked at. The reward of a step of 20 ms is
///
///     (1 - d / 5 m - 0.005 w^2) / 50
///
/// with d the distance to the reference and w the angular rate in rad/s, so that ten seconds are worth ten at most; -5 where the
/// vehicle is lost: it hit a trunk, overturned, or d reached 5 m. `reward_terms` has its parts. The air is still but for the
/// vehicles' own effects (``constant_wind``, ``gust``): vehicles with different ones are how wind, gusts and everything else
/// are randomised. Environment k draws from ``seed + k``: what happens in it
/// does not depend on how many there are, nor on threads.
///
/// Parameters
/// ----------
/// task : str
///     ``avoid``: follow a straight run of 4 to 8 m/s, from rest or at speed, past six trunks of 0.5 m radius that are seen from 5 m: each
///     8 to 16 m behind the one before and up to 0.7 m beside the run. ``track``: follow a curve, one sine an axis, of 1 to 5 m and
///     1 to 4 m/s (0.3 times as much in height), at most 4 m/s^2. All are drawn anew for each episode, evenly within these limits.
/// vehicles : sequence of Vehicle
///     Each episode takes one of them, with its wings, battery and effects: domain randomisation is a list of vehicles. All have four
///     rotors; those without ``[control]`` fly by gains by rule (`gains_by_rule`).
/// num_envs : int
///     How many environments.
/// action : str
///     ``motor``: thrust of each rotor from none to all, and wings. ``body_rate``: rates of roll, pitch, yaw (6, 6, 3 rad/s), thrust in
///     weights above hover, and wings. ``attitude_wing``: roll and pitch in the vehicle's largest tilt, thrust in weights above
///     hover, wings. All in [-1, 1]; wings are folded at -1 and spread at 1.
/// seed : int
///     Of everything random.
/// episode_s : float
///     Length of an episode.
/// sensors : bool
///     Observations come from the vehicle's sensors, with their rates, delays and noise, instead of the true state.
/// scheme : str
///     ``rk4`` or ``euler``, of steps of 2 ms.
/// threads : int, optional
///     That work, the caller among them; as many as there are cores if left out.
/// registers : str, optional
///     As in `Batch`.
///
/// Raises
/// ------
/// ValueError
///     Names the argument, what was expected and what came.
#[gen_stub_pyclass]
#[pyclass(frozen, module = "squirrel._squirrel")]
pub(crate) struct Tasks {
    environments: Mutex<Environments<ROTORS>>,
    vehicles: Vec<Py<Vehicle>>,
    settings: TaskSettings,
    count: usize,
}

impl Tasks {
    fn lock<'a>(&'a self, py: Python<'_>) -> PyResult<MutexGuard<'a, Environments<ROTORS>>> {
        let broken =
            |_| PyRuntimeError::new_err("a call on these environments has panicked; make new ones");
        self.environments.lock_py_attached(py).map_err(broken)
    }

    fn make(
        vehicles: Vec<Bound<'_, Vehicle>>,
        py: Python<'_>,
        count: usize,
        seed: u64,
        settings: TaskSettings,
    ) -> PyResult<Self> {
        let count = checked_count("num_envs", count)?;
        if vehicles.is_empty() {
            return Err(value("vehicles: none given"));
        }
        let ruled = |vehicle: &Bound<'_, Vehicle>| vehicle.get().file.with_gains_by_rule();
        let files: Result<Vec<_>, _> = vehicles.iter().map(ruled).collect();
        let files = files.map_err(|e| vehicle_error(&e))?;
        let made =
            watched(py, |go_on| Environments::new_while(&files, count, seed, settings, go_on));
        let environments = Mutex::new(made?.map_err(value)?);
        let vehicles = vehicles.into_iter().map(Bound::unbind).collect();
        Ok(Self { environments, vehicles, settings, count })
    }

    /// What pickle kept.
    pub(crate) fn again(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let py = state.py();
        let kept: Result<Kept<'_>, PyErr> = state.extract();
        let (vehicles, count, names, episode_s, sensors, threads, bytes) =
            kept.map_err(|_| broken("Tasks"))?;
        let [task, action, scheme, registers] = &names;
        let registers = Path::available().into_iter().find(|path| path.name() == *registers);
        let registers = registers.map(Path::name);
        let run = settings(2e-3, scheme, Some(threads), registers)?;
        let settings = task_settings([task, action], episode_s, sensors, run)?;
        let tasks = Self::make(vehicles, py, count, 0, settings)?;
        let mut guard = tasks.lock(py)?;
        let (environments, bytes): (&mut Environments<ROTORS>, _) = (&mut guard, bytes.as_bytes());
        watched(py, |go_on| environments.restore(bytes, go_on))?.map_err(value)?;
        drop(guard);
        Ok(tasks)
    }

    fn check(&self, index: usize) -> PyResult<()> {
        let all = self.count;
        let missing =
            || PyIndexError::new_err(format!("index = {index}: there are {all} environments"));
        if index < all { Ok(()) } else { Err(missing()) }
    }
}

#[gen_stub_pymethods]
#[pymethods]
impl Tasks {
    #[new]
    #[pyo3(signature = (
        *,
        task,
        vehicles,
        num_envs = 1,
        action = "attitude_wing",
        seed = 0,
        episode_s = 10.0,
        sensors = false,
        scheme = "rk4",
        threads = None,
        registers = None,
    ))]
    fn new(
        py: Python<'_>,
        #[gen_stub(override_type(type_repr = "flight.Task", imports = ("squirrel.flight")))]
        task: &str,
        vehicles: Vec<Bound<'_, Vehicle>>,
        #[pyo3(from_py_with = scalars::num_envs)] num_envs: usize,
        #[gen_stub(override_type(type_repr = "flight.Action", imports = ("squirrel.flight")))]
        action: &str,
        #[pyo3(from_py_with = scalars::seed)] seed: u64,
        #[pyo3(from_py_with = scalars::episode_s)] episode_s: f64,
        sensors: bool,
        #[gen_stub(override_type(type_repr = "flight.Scheme", imports = ("squirrel.flight")))]
        scheme: &str,
        #[pyo3(from_py_with = scalars::threads)] threads: Option<usize>,
        registers: Option<&str>,
    ) -> PyResult<Self> {
        // The length of a step is the task's.
        let run = settings(2e-3, scheme, threads, registers)?;
        let settings = task_settings([task, action], episode_s, sensors, run)?;
        Self::make(vehicles, py, num_envs, seed, settings)
    }

    /// New streams of random numbers, from the next episodes on.
    ///
    /// Parameters
    /// ----------
    /// index : int
    ///     Which environment, from 0.
    /// seed : int
    ///     Its seed.
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     There is no such environment.
    fn seed(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = scalars::index)] index: usize,
        #[pyo3(from_py_with = scalars::seed)] seed: u64,
    ) -> PyResult<()> {
        self.check(index)?;
        self.lock(py)?.seed(index, seed).map_err(value)
    }

    /// Start new episodes.
    ///
    /// Parameters
    /// ----------
    /// mask : sequence of bool, optional
    ///     In which environments; in all if left out.
    ///
    /// Returns
    /// -------
    /// ndarray of float32, shape (num_envs, 25)
    ///     What all of them see.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A mask of another length.
    #[pyo3(signature = (mask = None))]
    #[gen_stub(override_return_type(type_repr = "numpy.typing.NDArray[numpy.float32]", imports = ("numpy.typing", "numpy")))]
    fn reset<'py>(
        &self,
        py: Python<'py>,
        mask: Option<Vec<bool>>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        if let Some(mask) = &mask
            && mask.len() != self.count
        {
            return Err(value(format!("mask: {} values, must be {}", mask.len(), self.count)));
        }
        let mut seen = vec![0.0; self.count * OBSERVATION];
        let which = |k: usize| mask.as_ref().is_none_or(|mask| mask[k]);
        let mut guard = self.lock(py)?;
        let environments: &mut Environments<ROTORS> = &mut guard;
        let rows = &mut seen;
        watched(py, |go_on| environments.reset_while(which, rows, go_on))?.map_err(value)?;
        drop(guard);
        table(py, seen, OBSERVATION)
    }

    /// Fly on for 20 ms.
    ///
    /// Parameters
    /// ----------
    /// actions : ndarray of float32, shape (num_envs, 4 or 5)
    ///     Limited to [-1, 1].
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     Observations, float32, shape (num_envs, 25); rewards, float32; terminated and truncated, bool, shape (num_envs,).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Another dtype or shape, a number that is not finite.
    #[gen_stub(override_return_type(
        type_repr = "tuple[numpy.typing.NDArray[numpy.float32], numpy.typing.NDArray[numpy.float32], numpy.typing.NDArray[numpy.bool_], numpy.typing.NDArray[numpy.bool_]]",
        imports = ("numpy.typing", "numpy")
    ))]
    fn step<'py>(&self, py: Python<'py>, actions: Array32<'py>) -> PyResult<Stepped<'py>> {
        let shape = [Some(self.count), Some(self.settings.level.numbers(ROTORS))];
        let actions = rows::<f32>("actions", &actions.0, &shape, Numbers::Finite)?;
        let n = self.count;
        let (mut observation, mut reward) = (vec![0.0; n * OBSERVATION], vec![0.0; n]);
        let (mut terminated, mut truncated) = (vec![false; n], vec![false; n]);
        let outcome = Outcome {
            observation: &mut observation,
            reward: &mut reward,
            terminated: &mut terminated,
            truncated: &mut truncated,
        };
        let actions = actions.numbers();
        let mut guard = self.lock(py)?;
        let environments: &mut Environments<ROTORS> = &mut guard;
        py.detach(|| environments.step(actions, outcome)).map_err(value)?;
        drop(guard);
        Ok((
            table(py, observation, OBSERVATION)?,
            PyArray1::from_vec(py, reward),
            PyArray1::from_vec(py, terminated),
            PyArray1::from_vec(py, truncated),
        ))
    }

    /// What the rewards of the last step are made of.
    ///
    /// Returns
    /// -------
    /// dict of str to ndarray of float32, shape (num_envs,)
    ///     ``near``: (1 - d / 5 m) / 50, d the distance to the reference; ``turning``: -0.005 w^2 / 50, w the angular rate in rad/s;
    ///     ``lost``: -5 where the vehicle hit a trunk, overturned or strayed by 5 m, and then the others are 0. Their sum is the reward, to
    ///     the rounding. Zero before the first step, and where an episode began in the last one.
    #[gen_stub(override_return_type(type_repr = "dict[str, numpy.typing.NDArray[numpy.float32]]", imports = ("numpy.typing", "numpy")))]
    fn reward_terms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let terms = self.lock(py)?.reward_terms();
        let out = PyDict::new(py);
        let put = |name: &str, of: fn(&Terms) -> f32| {
            out.set_item(name, PyArray1::from_vec(py, terms.iter().map(of).collect()))
        };
        put("near", |terms| terms.near)?;
        put("turning", |terms| terms.turning)?;
        put("lost", |terms| terms.lost)?;
        Ok(out)
    }

    /// Motions of all vehicles and what they should follow.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     States, float32, shape (num_envs, 17), as `Batch.states` has them; positions that the references have, NED, m, shape
    ///     (num_envs, 3).
    #[gen_stub(override_return_type(
        type_repr = "tuple[numpy.typing.NDArray[numpy.float32], numpy.typing.NDArray[numpy.float32]]",
        imports = ("numpy.typing", "numpy")
    ))]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Motions<'py>> {
        let environments = self.lock(py)?;
        let (mut states, mut references) = (Vec::new(), Vec::new());
        for index in 0..self.count {
            let (state, reference) = environments.state(index).map_err(value)?;
            let q = &state.attitude;
            states.extend(state.position.vector.iter());
            states.extend(state.velocity.vector.iter());
            states.extend([q.w, q.i, q.j, q.k]);
            states.extend(state.omega.vector.iter());
            states.extend(&state.rotor_speed_rad_s[..4]);
            references.extend(reference.position.vector.iter());
        }
        Ok((table(py, states, 17)?, table(py, references, 3)?))
    }

    /// Trunks of one environment.
    ///
    /// Parameters
    /// ----------
    /// index : int
    ///     Which, from 0.
    ///
    /// Returns
    /// -------
    /// ndarray of float32, shape (n, 3)
    ///     North, east, radius, m.
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     There is no such environment.
    #[gen_stub(override_return_type(type_repr = "numpy.typing.NDArray[numpy.float32]", imports = ("numpy.typing", "numpy")))]
    fn obstacles<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = scalars::index)] index: usize,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.check(index)?;
        let obstacles = self.lock(py)?.obstacles(index).map_err(value)?;
        table(py, obstacles.concat(), 3)
    }

    /// Which of the vehicles fly by gains by rule, because their files have none: places in the
    /// sequence of vehicles.
    #[getter]
    fn gains_by_rule(&self) -> Vec<usize> {
        let bare = |vehicle: &Py<Vehicle>| vehicle.get().file.control.is_none();
        let places = self.vehicles.iter().enumerate().filter(|(_, vehicle)| bare(vehicle));
        places.map(|(place, _)| place).collect()
    }

    /// Numbers of an observation.
    #[getter]
    #[allow(clippy::unused_self, reason = "a property of the environments, beside the other")]
    fn observation_numbers(&self) -> usize {
        OBSERVATION
    }

    /// Numbers of an action.
    #[getter]
    fn action_numbers(&self) -> usize {
        self.settings.level.numbers(ROTORS)
    }

    #[gen_stub(override_return_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let TaskSettings { kind, level, episode_s, sensors, scheme, threads, path } = self.settings;
        let kind = match kind {
            CourseKind::Avoid => "avoid",
            CourseKind::Track => "track",
        };
        let level = match level {
            Level::Motor => "motor",
            Level::BodyRate => "body_rate",
            Level::AttitudeWing => "attitude_wing",
        };
        let names = [kind, level, scheme_name(scheme), path.name()];
        let guard = self.lock(py)?;
        let environments: &Environments<ROTORS> = &guard;
        let bytes = watched(py, |go_on| environments.memory(go_on))?.map_err(value)?;
        drop(guard);
        let vehicles: Vec<_> = self.vehicles.iter().map(|vehicle| vehicle.bind(py)).collect();
        let bytes = PyBytes::new(py, &bytes);
        reduced(py, "Tasks", (vehicles, self.count, names, episode_s, sensors, threads, bytes))
    }

    fn __len__(&self) -> usize {
        self.count
    }
}

/// What pickle keeps: vehicles, their number, names of task, action, scheme and registers, length of
/// an episode, sensors, threads, memory.
type Kept<'py> =
    (Vec<Bound<'py, Vehicle>>, usize, [String; 4], f64, bool, usize, Bound<'py, PyBytes>);

fn task_settings(
    [task, action]: [&str; 2],
    episode_s: f64,
    sensors: bool,
    run: Settings,
) -> PyResult<TaskSettings> {
    let kind = match task {
        "avoid" => CourseKind::Avoid,
        "track" => CourseKind::Track,
        other => return Err(value(format!("task = {other}: must be avoid or track"))),
    };
    let level = match action {
        "motor" => Level::Motor,
        "body_rate" => Level::BodyRate,
        "attitude_wing" => Level::AttitudeWing,
        other => {
            return Err(value(format!(
                "action = {other}: must be motor, body_rate or attitude_wing"
            )));
        }
    };
    let Settings { scheme, threads, path, .. } = run;
    Ok(TaskSettings { kind, level, episode_s, sensors, scheme, threads, path })
}

/// States and what they should be.
type Motions<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>);

/// Observations, rewards, terminated, truncated.
type Stepped<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
);
