//! The whole flight code, step by step, for many vehicles.

use crate::arguments::{Array32, Numbers, Rows, rows};
use crate::control::{lock, memory};
use crate::error::value;
use crate::flight::scenario;
use crate::interrupt::now_and_then;
use crate::kept::{broken, put, reduced, take, take_rest};
use crate::scalars;
use crate::terms::Terms;
use crate::vehicle::{Vehicle, or_squirrel};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use pyo3_stub_gen::derive::{gen_stub_pyclass, gen_stub_pymethods};
use squirrel_core::frames::{In, Rotation};
use squirrel_core::stack::wire::{Outside, Reader};
use squirrel_core::stack::{self, Gnss, Imu, SensorFrame, StackState};
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{Integrator, Setup};
use std::sync::Mutex;

/// The whole flight code, the one that flies on the microcontroller, bit for bit (float32).
///
/// Parameters
/// ----------
/// vehicle : Vehicle, optional
///     With gains; the paper's squirrel if left out.
/// arm, scenario, seed, thrust_to_weight
///     As for `simulate`.
/// count : int
///     Vehicles that fly beside each other; each has a memory of its own.
///
/// Raises
/// ------
/// OSError
///     The scenario file cannot be read.
/// ValueError
///     One line that names the argument or field, and the value.
#[gen_stub_pyclass]
#[pyclass(frozen, module = "squirrel._squirrel")]
pub(crate) struct Stack {
    stack: stack::Stack,
    memory: Mutex<Vec<StackState>>,
}

#[gen_stub_pymethods]
#[pymethods]
impl Stack {
    #[new]
    #[pyo3(signature = (vehicle = None, *, arm = "twcc_flat", scenario = "hover", seed = None, thrust_to_weight = None, count = 1))]
    fn new(
        vehicle: Option<&Bound<'_, Vehicle>>,
        #[gen_stub(override_type(type_repr = "flight.Arm", imports = ("squirrel.flight")))]
        arm: &str,
        #[gen_stub(override_type(type_repr = "flight.Scenario | builtins.str", imports = ("squirrel.flight", "builtins")))]
        scenario: &str,
        #[pyo3(from_py_with = scalars::seed)] seed: Option<u64>,
        #[pyo3(from_py_with = scalars::thrust_to_weight)] thrust_to_weight: Option<f64>,
        #[pyo3(from_py_with = scalars::count)] count: usize,
    ) -> PyResult<Self> {
        let mut vehicle = or_squirrel(vehicle);
        // Attitudes come from the caller.
        vehicle.estimator = Estimator::External;
        let setup = Setup {
            vehicle,
            arm: Arm::parse(arm).map_err(value)?,
            scenario: self::scenario(scenario, seed, thrust_to_weight)?,
            integrator: Integrator::Rk4,
        };
        Ok(Self { stack: setup.stack().map_err(value)?, memory: memory(count)? })
    }

    /// One step of each vehicle.
    ///
    /// A measurement that is left out was not made in this step. One that is not finite is the
    /// flight code's to refuse: it keeps the last valid one and counts ``rejected``.
    ///
    /// Parameters
    /// ----------
    /// time_us : int
    ///     Since the start of the mission; the flight code's own rate is 300 Hz.
    /// omega_body_rad_s, specific_force_body_m_s2 : ndarray of float32, shape (count, 3), optional
    ///     Of the inertial unit, both or none.
    /// q_ned_from_body_wxyz : ndarray of float32, shape (count, 4), optional
    ///     Attitude; nothing is estimated here.
    /// position_ned_m, velocity_ned_m_s : ndarray of float32, shape (count, 3), optional
    ///     Of the satellite fix, both or none.
    /// altitude_m : ndarray of float32, shape (count,), optional
    ///     By the barometer, up.
    /// wing_force_ned_n : ndarray of float32, shape (count, 3), optional
    ///     What spread wings would do, where something knows it.
    ///
    /// Returns
    /// -------
    /// dict of str to ndarray of float32
    ///     A row for each vehicle: ``rotor_command`` (unit of the vehicle), ``wing_command`` (left, right; 0 folded, 1 spread),
    ///     ``reference_position_ned_m``, ``thrust_n`` and ``torque_n_m`` (demand on the mixer; NaN before there was any),
    ///     ``failsafe_mode``, ``failsafe_reason``, ``rejected``.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Names the argument, what was expected and what came.
    #[pyo3(signature = (*, time_us, omega_body_rad_s = None, specific_force_body_m_s2 = None, q_ned_from_body_wxyz = None, position_ned_m = None, velocity_ned_m_s = None, altitude_m = None, wing_force_ned_n = None))]
    #[gen_stub(override_return_type(type_repr = "dict[str, numpy.typing.NDArray[numpy.float32]]", imports = ("numpy", "numpy.typing")))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = scalars::time_us)] time_us: u64,
        omega_body_rad_s: Option<Array32<'py>>,
        specific_force_body_m_s2: Option<Array32<'py>>,
        q_ned_from_body_wxyz: Option<Array32<'py>>,
        position_ned_m: Option<Array32<'py>>,
        velocity_ned_m_s: Option<Array32<'py>>,
        altitude_m: Option<Array32<'py>>,
        wing_force_ned_n: Option<Array32<'py>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut memory = lock(&self.memory, py)?;
        let n = memory.len();
        let read = |name, array: &Option<Array32<'py>>, width: usize| {
            let shape = [Some(n), Some(width)];
            // One number a vehicle comes as a one-dimensional array.
            let shape = if width == 1 { &shape[..1] } else { &shape[..] };
            array.as_ref().map(|array| rows::<f32>(name, &array.0, shape, Numbers::Any)).transpose()
        };
        let omega = read("omega_body_rad_s", &omega_body_rad_s, 3)?;
        let force = read("specific_force_body_m_s2", &specific_force_body_m_s2, 3)?;
        let attitude = read("q_ned_from_body_wxyz", &q_ned_from_body_wxyz, 4)?;
        let position = read("position_ned_m", &position_ned_m, 3)?;
        let velocity = read("velocity_ned_m_s", &velocity_ned_m_s, 3)?;
        let altitude = read("altitude_m", &altitude_m, 1)?;
        let wing_force = read("wing_force_ned_n", &wing_force_ned_n, 3)?;
        both(["omega_body_rad_s", "specific_force_body_m_s2"], [&omega, &force])?;
        both(["position_ned_m", "velocity_ned_m_s"], [&position, &velocity])?;

        let rotors = self.stack.vehicle().rotors().len();
        let mut terms = Terms::default();
        for (i, state) in memory.iter_mut().enumerate() {
            now_and_then(py, i)?;
            let vector = |rows: &Rows<'_, f32>| Vector3::from(rows.row::<3>(i));
            let mut frame = SensorFrame::empty(time_us);
            frame.imu = omega.as_ref().zip(force.as_ref()).map(|(omega, force)| Imu {
                omega: In::new(vector(omega)),
                specific_force: In::new(vector(force)),
            });
            // As it is: whether it is a rotation is the flight code's to judge.
            frame.attitude = attitude.as_ref().map(|rows| {
                let [w, x, y, z] = rows.row(i);
                Rotation::new(UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)))
            });
            frame.gnss = position.as_ref().zip(velocity.as_ref()).map(|(position, velocity)| {
                Gnss { position: In::new(vector(position)), velocity: In::new(vector(velocity)) }
            });
            frame.altitude_m = altitude.as_ref().map(|rows| rows.row::<1>(i)[0]);
            frame.wing_force = wing_force.as_ref().map(|rows| In::new(vector(rows)));
            let out = self.stack.step(state, &frame);
            terms.push("rotor_command", &out.rotor_command[..rotors]);
            terms.push("wing_command", &out.wing_command);
            terms.push("reference_position_ned_m", out.reference.position.vector.as_slice());
            terms.push("thrust_n", &[out.inner.map_or(f32::NAN, |inner| inner.demand.thrust_n)]);
            let torque =
                out.inner.map_or(Vector3::repeat(f32::NAN), |inner| inner.demand.torque_n_m);
            terms.push("torque_n_m", torque.as_slice());
            terms.push("failsafe_mode", &[f32::from(out.failsafe.mode as u8)]);
            terms.push("failsafe_reason", &[f32::from(out.failsafe.reason as u8)]);
            terms.push("rejected", &[out.rejected as f32]);
        }
        terms.arrays(py)
    }

    /// Forget everything.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        lock(&self.memory, py)?.fill(StackState::default());
        Ok(())
    }

    /// The flight code as it is now, memory and all.
    ///
    /// Returns
    /// -------
    /// Stack
    ///     That goes on by itself.
    fn copy(&self, py: Python<'_>) -> PyResult<Self> {
        Ok(Self { stack: self.stack, memory: Mutex::new(lock(&self.memory, py)?.clone()) })
    }

    #[gen_stub(override_return_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let mut bytes = Vec::new();
        put(&mut bytes, &self.stack);
        for state in lock(&self.memory, py)?.iter() {
            // Attitudes come from outside, and nobody tells a voltage.
            put(&mut bytes, &Outside::of(state).ok_or_else(|| broken("Stack"))?);
        }
        reduced(py, "Stack", (PyBytes::new(py, &bytes),))
    }
}

impl Stack {
    /// What pickle kept.
    pub(crate) fn again(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let class = "Stack";
        let kept: Result<(Bound<'_, PyBytes>,), PyErr> = state.extract();
        let (bytes,) = kept.map_err(|_| broken(class))?;
        let mut from = Reader::new(bytes.as_bytes());
        let stack = take(class, &mut from)?;
        let memory: Vec<Outside> = take_rest(class, &mut from)?;
        let memory = memory.iter().map(|outside| *outside.state()).collect();
        Ok(Self { stack, memory: Mutex::new(memory) })
    }
}

/// Two halves of one measurement.
fn both(names: [&str; 2], given: [&Option<Rows<'_, f32>>; 2]) -> PyResult<()> {
    match given.map(Option::is_some) {
        [true, false] => Err(value(format!("{}: missing, but there is {}", names[1], names[0]))),
        [false, true] => Err(value(format!("{}: missing, but there is {}", names[0], names[1]))),
        _ => Ok(()),
    }
}
