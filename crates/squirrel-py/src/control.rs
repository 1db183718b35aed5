//! Control laws of the core, each with the memory of many vehicles.

use crate::arguments::{Array32, Numbers, Rows, rows};
use crate::error::value;
use crate::interrupt::now_and_then;
use crate::kept::{broken, put, reduced, take, take_rest};
use crate::scalars::{self, checked_count};
use crate::state::rotations;
use crate::terms::Terms;
use crate::vehicle::Vehicle;
use nalgebra::Vector3;
use pyo3::exceptions::{PyMemoryError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use pyo3_stub_gen::derive::{gen_stub_pyclass, gen_stub_pymethods};
use squirrel_core::control::Reference;
use squirrel_core::control::backstepping::{AttitudeForm, AttitudeGains, AttitudeState};
use squirrel_core::control::command_filter::EulerReference;
use squirrel_core::control::position::MeasuredMotion;
use squirrel_core::control::twcc::{OuterAirframe, TwccParameters, TwccState};
use squirrel_core::frames::In;
use squirrel_core::stack::StackParameters;
use squirrel_core::stack::wire::Reader;
use squirrel_core::vehicle::Vehicle as Checked;
use squirrel_sim::arm::Arm;
use std::sync::{Mutex, MutexGuard};

/// An empty memory for each vehicle.
pub(crate) fn memory<T: Default>(count: usize) -> PyResult<Mutex<Vec<T>>> {
    let count = checked_count("count", count)?;
    let mut all = Vec::new();
    all.try_reserve_exact(count).map_err(|error| PyMemoryError::new_err(error.to_string()))?;
    Python::attach(|py| {
        for turn in 0..count {
            now_and_then(py, turn)?;
            all.push(T::default());
        }
        Ok(Mutex::new(all))
    })
}

/// The memory of a law, one for each vehicle.
pub(crate) fn lock<'a, T: Clone>(
    memory: &'a Mutex<Vec<T>>,
    py: Python<'_>,
) -> PyResult<MutexGuard<'a, Vec<T>>> {
    memory
        .lock_py_attached(py)
        .map_err(|_| PyRuntimeError::new_err("a call on this object has panicked; make a new one"))
}

/// Gains of a vehicle that has them.
fn gains(vehicle: &Bound<'_, Vehicle>) -> PyResult<StackParameters> {
    let file = &vehicle.get().file;
    file.control.ok_or_else(|| {
        value(format!("vehicle: {}: [control] is missing; control needs gains", file.name))
    })
}

/// The vehicle as the flight code knows it.
fn single(vehicle: &Bound<'_, Vehicle>) -> PyResult<Checked<f32>> {
    vehicle.get().file.vehicle.cast().map_err(value)
}

/// Refuses what is no step.
fn step_s(dt_s: f64) -> PyResult<f32> {
    if dt_s > 0.0 && dt_s.is_finite() {
        Ok(dt_s as f32)
    } else {
        Err(value(format!("dt_s = {dt_s}: must be finite and > 0")))
    }
}

/// Rows that may be left out, and are zero then.
fn optional<'py>(
    name: &str,
    array: Option<&Array32<'py>>,
    n: usize,
) -> PyResult<impl Fn(usize) -> Vector3<f32> + use<'py>> {
    let rows: Option<Rows<'py, f32>> = array
        .map(|array| rows(name, &array.0, &[Some(n), Some(3)], Numbers::Finite))
        .transpose()?;
    Ok(move |i| rows.as_ref().map_or_else(Vector3::zeros, |rows| Vector3::from(rows.row::<3>(i))))
}

/// Integral backstepping: from attitude error to torque, the flight code's own law (float32).
///
/// Parameters
/// ----------
/// vehicle : Vehicle
///     With gains.
/// count : int
///     Vehicles that fly beside each other; each has a memory of its own.
///
/// Raises
/// ------
/// ValueError
///     The vehicle has no gains.
#[gen_stub_pyclass]
#[pyclass(frozen, module = "squirrel._squirrel")]
pub(crate) struct Backstepping {
    gains: AttitudeGains,
    vehicle: Checked<f32>,
    memory: Mutex<Vec<AttitudeState>>,
}

#[gen_stub_pymethods]
#[pymethods]
impl Backstepping {
    #[new]
    #[pyo3(signature = (vehicle, *, count = 1))]
    fn new(
        vehicle: &Bound<'_, Vehicle>,
        #[pyo3(from_py_with = scalars::count)] count: usize,
    ) -> PyResult<Self> {
        Ok(Self {
            gains: gains(vehicle)?.attitude,
            vehicle: single(vehicle)?,
            memory: memory(count)?,
        })
    }

    /// One step of each vehicle.
    ///
    /// Parameters
    /// ----------
    /// q_ned_from_body_wxyz : ndarray of float32, shape (count, 4)
    ///     Attitude.
    /// omega_body_rad_s : ndarray of float32, shape (count, 3)
    ///     Angular rate.
    /// angle_rad : ndarray of float32, shape (count, 3)
    ///     Wanted roll, pitch and yaw.
    /// rate_rad_s, acceleration_rad_s2 : ndarray of float32, shape (count, 3), optional
    ///     Derivatives of `angle_rad`; zero if left out.
    /// dt_s : float
    ///     Since the last step.
    /// hold_integral : bool
    ///     Do not wind up: the rotors are at their limit.
    ///
    /// Returns
    /// -------
    /// dict of str to ndarray of float32
    ///     Every term by name, a row for each vehicle: ``angle_error_rad``, ``rate_error_rad_s``, ``integral_rad_s``,
    ///     ``gyroscopic_torque_n_m``, ``torque_n_m``.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Names the argument, what was expected and what came.
    #[pyo3(signature = (*, q_ned_from_body_wxyz, omega_body_rad_s, angle_rad, dt_s, rate_rad_s = None, acceleration_rad_s2 = None, hold_integral = false))]
    #[gen_stub(override_return_type(type_repr = "dict[str, numpy.typing.NDArray[numpy.float32]]", imports = ("numpy", "numpy.typing")))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        q_ned_from_body_wxyz: Array32<'py>,
        omega_body_rad_s: Array32<'py>,
        angle_rad: Array32<'py>,
        #[pyo3(from_py_with = scalars::dt_s)] dt_s: f64,
        rate_rad_s: Option<Array32<'py>>,
        acceleration_rad_s2: Option<Array32<'py>>,
        hold_integral: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut memory = lock(&self.memory, py)?;
        let n = memory.len();
        let three = [Some(n), Some(3)];
        let name = "q_ned_from_body_wxyz";
        let attitudes = rotations(
            name,
            &rows(name, &q_ned_from_body_wxyz.0, &[Some(n), Some(4)], Numbers::Finite)?,
        )?;
        let omega = rows::<f32>("omega_body_rad_s", &omega_body_rad_s.0, &three, Numbers::Finite)?;
        let angle = rows::<f32>("angle_rad", &angle_rad.0, &three, Numbers::Finite)?;
        let rate = optional("rate_rad_s", rate_rad_s.as_ref(), n)?;
        let acceleration = optional("acceleration_rad_s2", acceleration_rad_s2.as_ref(), n)?;
        let dt_s = step_s(dt_s)?;
        let inertia = &self.vehicle.parameters().inertia_kg_m2;
        let mut terms = Terms::default();
        for (i, state) in memory.iter_mut().enumerate() {
            now_and_then(py, i)?;
            let wanted = EulerReference {
                angle: Vector3::from(angle.row(i)),
                rate: rate(i),
                acceleration: acceleration(i),
            };
            let omega = Vector3::from(omega.row(i));
            let out = self.gains.update(
                state,
                inertia,
                &attitudes[i],
                &omega,
                &wanted,
                hold_integral,
                dt_s,
            );
            terms.push("angle_error_rad", out.angle_error.as_slice());
            terms.push("rate_error_rad_s", out.rate_error.as_slice());
            terms.push("integral_rad_s", out.integral.as_slice());
            terms.push("gyroscopic_torque_n_m", out.gyroscopic_n_m.as_slice());
            terms.push("torque_n_m", out.torque_n_m.as_slice());
        }
        terms.arrays(py)
    }

    /// Forget everything.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        lock(&self.memory, py)?.fill(AttitudeState::default());
        Ok(())
    }

    #[gen_stub(override_return_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let mut bytes = Vec::new();
        put(&mut bytes, self.vehicle.parameters());
        put(&mut bytes, &self.gains);
        lock(&self.memory, py)?.iter().for_each(|state| put(&mut bytes, state));
        reduced(py, "Backstepping", (PyBytes::new(py, &bytes),))
    }
}

impl Backstepping {
    /// What pickle kept.
    pub(crate) fn again(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let class = "Backstepping";
        let kept: Result<(Bound<'_, PyBytes>,), PyErr> = state.extract();
        let (bytes,) = kept.map_err(|_| broken(class))?;
        let mut from = Reader::new(bytes.as_bytes());
        Ok(Self {
            vehicle: Checked::new(take(class, &mut from)?).map_err(value)?,
            gains: take(class, &mut from)?,
            memory: Mutex::new(take_rest(class, &mut from)?),
        })
    }
}

/// Thrust-wing coordination: from a reference to angles, thrust and wings, the flight code's own
/// law (float32).
///
/// Parameters
/// ----------
/// vehicle : Vehicle
///     With gains.
/// arm : str
///     As for `simulate`: which policy and which belief about the wings.
/// count : int
///     Vehicles that fly beside each other; each has a memory of its own.
///
/// Raises
/// ------
/// ValueError
///     The vehicle has no gains, or not the weights that the arm needs.
#[gen_stub_pyclass]
#[pyclass(frozen, module = "squirrel._squirrel")]
pub(crate) struct Twcc {
    parameters: TwccParameters,
    form: AttitudeForm,
    vehicle: Checked<f32>,
    airframe: OuterAirframe,
    memory: Mutex<Vec<TwccState>>,
}

#[gen_stub_pymethods]
#[pymethods]
impl Twcc {
    #[new]
    #[pyo3(signature = (vehicle, *, arm = "twcc_flat", count = 1))]
    fn new(
        vehicle: &Bound<'_, Vehicle>,
        #[gen_stub(override_type(type_repr = "flight.Arm", imports = ("squirrel.flight")))]
        arm: &str,
        #[pyo3(from_py_with = scalars::count)] count: usize,
    ) -> PyResult<Self> {
        let gains = gains(vehicle)?;
        let (mut parameters, form, airframe) = (gains.twcc, gains.attitude.form, single(vehicle)?);
        let weights = vehicle.get().file.weights.as_ref();
        Arm::parse(arm).and_then(|arm| arm.configure(&mut parameters, weights)).map_err(value)?;
        Self::of(&airframe, &parameters, form, memory(count)?)
    }

    /// One tick of each vehicle.
    ///
    /// Parameters
    /// ----------
    /// position_ned_m, velocity_ned_m_s : ndarray of float32, shape (count, 3)
    ///     Measured.
    /// q_ned_from_body_wxyz : ndarray of float32, shape (count, 4)
    ///     Attitude.
    /// reference_position_ned_m : ndarray of float32, shape (count, 3)
    ///     What to follow.
    /// reference_velocity_ned_m_s, reference_acceleration_ned_m_s2 : ndarray of float32, shape (count, 3), optional
    ///     Its derivatives; zero if left out.
    /// reference_yaw_rad : float
    ///     Heading, clockwise from north.
    /// wing_force_ned_n : ndarray of float32, shape (count, 3), optional
    ///     What spread wings would do; the arm ``twcc_oracle`` asks for it.
    /// dt_s : float
    ///     Since the last tick; the flight code's is 0.1 s.
    ///
    /// Returns
    /// -------
    /// dict of str to ndarray of float32
    ///     Every term by the names of flight logs (``control.outer``), a row for each vehicle, ``roll_pitch_command_rad``,
    ///     ``thrust_command_n`` and ``wing_command`` among them.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Names the argument, what was expected and what came.
    #[pyo3(signature = (*, position_ned_m, velocity_ned_m_s, q_ned_from_body_wxyz, reference_position_ned_m, reference_velocity_ned_m_s = None, reference_acceleration_ned_m_s2 = None, reference_yaw_rad = 0.0, wing_force_ned_n = None, dt_s = 0.1))]
    #[gen_stub(override_return_type(type_repr = "dict[str, numpy.typing.NDArray[numpy.float32]]", imports = ("numpy", "numpy.typing")))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        position_ned_m: Array32<'py>,
        velocity_ned_m_s: Array32<'py>,
        q_ned_from_body_wxyz: Array32<'py>,
        reference_position_ned_m: Array32<'py>,
        reference_velocity_ned_m_s: Option<Array32<'py>>,
        reference_acceleration_ned_m_s2: Option<Array32<'py>>,
        #[pyo3(from_py_with = scalars::reference_yaw_rad)] reference_yaw_rad: f32,
        wing_force_ned_n: Option<Array32<'py>>,
        #[pyo3(from_py_with = scalars::dt_s)] dt_s: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut memory = lock(&self.memory, py)?;
        let n = memory.len();
        let three = [Some(n), Some(3)];
        let position = rows::<f32>("position_ned_m", &position_ned_m.0, &three, Numbers::Finite)?;
        let velocity =
            rows::<f32>("velocity_ned_m_s", &velocity_ned_m_s.0, &three, Numbers::Finite)?;
        let name = "q_ned_from_body_wxyz";
        let attitudes = rotations(
            name,
            &rows(name, &q_ned_from_body_wxyz.0, &[Some(n), Some(4)], Numbers::Finite)?,
        )?;
        let wanted = rows::<f32>(
            "reference_position_ned_m",
            &reference_position_ned_m.0,
            &three,
            Numbers::Finite,
        )?;
        let wanted_velocity =
            optional("reference_velocity_ned_m_s", reference_velocity_ned_m_s.as_ref(), n)?;
        let wanted_acceleration = optional(
            "reference_acceleration_ned_m_s2",
            reference_acceleration_ned_m_s2.as_ref(),
            n,
        )?;
        let force = optional("wing_force_ned_n", wing_force_ned_n.as_ref(), n)?;
        if !reference_yaw_rad.is_finite() {
            return Err(value(format!("reference_yaw_rad = {reference_yaw_rad}: must be finite")));
        }
        let dt_s = step_s(dt_s)?;
        let mut terms = Terms::default();
        for (i, state) in memory.iter_mut().enumerate() {
            now_and_then(py, i)?;
            let (.., yaw_rad) = attitudes[i].euler();
            let motion = MeasuredMotion::new(
                In::new(Vector3::from(position.row(i))),
                In::new(Vector3::from(velocity.row(i))),
                &attitudes[i],
                self.form.heading_rad(yaw_rad, reference_yaw_rad),
            );
            let reference = Reference {
                position: In::new(Vector3::from(wanted.row(i))),
                velocity: In::new(wanted_velocity(i)),
                acceleration: In::new(wanted_acceleration(i)),
                yaw_rad: reference_yaw_rad,
            };
            let given = wing_force_ned_n.is_some().then(|| In::new(force(i)));
            let out = self.parameters.update(
                state,
                &self.airframe,
                &motion,
                &attitudes[i],
                given,
                &reference,
                dt_s,
            );
            outer(&mut terms, &out);
        }
        terms.arrays(py)
    }

    /// Forget everything.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        lock(&self.memory, py)?.fill(TwccState::default());
        Ok(())
    }

    #[gen_stub(override_return_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let mut bytes = Vec::new();
        put(&mut bytes, self.vehicle.parameters());
        put(&mut bytes, &self.parameters);
        put(&mut bytes, &self.form);
        lock(&self.memory, py)?.iter().for_each(|state| put(&mut bytes, state));
        reduced(py, "Twcc", (PyBytes::new(py, &bytes),))
    }
}

impl Twcc {
    fn of(
        vehicle: &Checked<f32>,
        parameters: &TwccParameters,
        form: AttitudeForm,
        memory: Mutex<Vec<TwccState>>,
    ) -> PyResult<Self> {
        let limits = vehicle.parameters().limits;
        parameters.check(limits.thrust_max_n).map_err(value)?;
        let airframe = OuterAirframe::new(vehicle, parameters.thrust_min_n, limits.tilt_max_rad);
        Ok(Self { parameters: *parameters, form, vehicle: *vehicle, airframe, memory })
    }

    /// What pickle kept.
    pub(crate) fn again(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let class = "Twcc";
        let kept: Result<(Bound<'_, PyBytes>,), PyErr> = state.extract();
        let (bytes,) = kept.map_err(|_| broken(class))?;
        let mut from = Reader::new(bytes.as_bytes());
        let vehicle = Checked::new(take(class, &mut from)?).map_err(value)?;
        let (parameters, form) = (take(class, &mut from)?, take(class, &mut from)?);
        Self::of(&vehicle, &parameters, form, Mutex::new(take_rest(class, &mut from)?))
    }
}

/// Appends every term of an outer tick.
fn outer(terms: &mut Terms, out: &squirrel_core::control::twcc::TwccTerms) {
    let p = &out.position;
    terms.push("position_error_ned_m", p.position_error.vector.as_slice());
    terms.push("velocity_desired_ned_m_s", p.velocity_desired.vector.as_slice());
    terms.push("velocity_error_ned_m_s", p.velocity_error.vector.as_slice());
    terms.push("velocity_error_slope_ned_m_s2", p.velocity_error_slope.as_slice());
    terms.push("velocity_error_integral_ned_m", p.integral.as_slice());
    terms.push("acceleration_demand_ned_m_s2", p.acceleration_demand.vector.as_slice());
    terms.push("acceleration_command_ned_m_s2", p.acceleration.vector.as_slice());
    terms.push("request_roll_pitch_rad", &[p.request.roll_rad, p.request.pitch_rad]);
    terms.push("request_thrust_n", &[p.request.thrust_n]);
    terms.push("wing_force_ned_n", out.wing_force.vector.as_slice());
    terms.push("angle_of_attack_rad", &[out.angle_of_attack_rad]);
    terms.push("helpful_force_n", &[out.wing.helpful_n]);
    terms.push("flag", &[f32::from(u8::from(out.wing.flag))]);
    terms.push("mode", &[f32::from(out.mode as u8)]);
    terms.push("reason", &[f32::from(out.reason as u8)]);
    terms.push("roll_pitch_command_rad", &[out.command.roll_rad, out.command.pitch_rad]);
    terms.push("thrust_command_n", &[out.command.thrust_n]);
    terms.push("wing_command", &[out.wing_command]);
    terms.push("clamped", &[f32::from(u8::from(out.clamped))]);
}
