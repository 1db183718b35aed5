//! The base model of the core, vehicle by vehicle.

use crate::arguments::{Array64, Numbers, Rows, rows};
use crate::error::value;
use crate::interrupt::now_and_then;
use crate::log::table;
use crate::scalars;
use crate::state::{check_attitudes, push, state};
use crate::vehicle::Vehicle;
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3_stub_gen::derive::gen_stub_pyfunction;
use squirrel_batch::BODY_NUMBERS;
use squirrel_core::dynamics::{self, Held, RotorDrive, State, rk4};
use squirrel_core::effects::Acting;
use squirrel_core::frames::{In, Wrench};
use squirrel_core::vehicle::MAX_ROTORS;
use squirrel_core::{nalgebra::Vector3, vehicle};

/// What a call is about.
struct Model<'py> {
    vehicle: vehicle::Vehicle<f64>,
    effects: Acting<f64>,
    states: Rows<'py, f64>,
    commands: Rows<'py, f64>,
    winds: Option<Rows<'py, f64>>,
    voltage_v: f64,
    rotors: usize,
}

impl<'py> Model<'py> {
    fn new(
        vehicle: &Bound<'py, Vehicle>,
        state: &Array64<'py>,
        command: &Array64<'py>,
        wind_ned_m_s: Option<&Array64<'py>>,
        voltage_v: Option<f64>,
    ) -> PyResult<Self> {
        let file = &vehicle.get().file;
        let rotors = file.vehicle.rotors().len();
        let width = BODY_NUMBERS + rotors;
        let states = rows("state", &state.0, &[None, Some(width)], Numbers::Finite)?;
        check_attitudes("state", states.numbers(), width, 6)?;
        let n = Some(states.numbers().len() / width);
        let commands = rows("command", &command.0, &[n, Some(rotors)], Numbers::Finite)?;
        let winds = wind_ned_m_s
            .map(|wind| rows("wind_ned_m_s", &wind.0, &[n, Some(3)], Numbers::Finite))
            .transpose()?;
        let voltage_v =
            voltage_v.unwrap_or(file.vehicle.parameters().propulsion.reference_voltage_v);
        if !voltage_v.is_finite() {
            return Err(value(format!("voltage_v = {voltage_v}: must be finite")));
        }
        let vehicle = file.effects.alter(&file.vehicle).map_err(value)?;
        let effects = Acting::new(&file.effects, &vehicle);
        Ok(Self { vehicle, effects, states, commands, winds, voltage_v, rotors })
    }

    fn held(&self, i: usize) -> Held<f64> {
        let mut command = [0.0; MAX_ROTORS];
        command[..self.rotors]
            .copy_from_slice(&self.commands.numbers()[i * self.rotors..][..self.rotors]);
        let drive = RotorDrive::new(&self.vehicle, &self.effects, &command, self.voltage_v);
        Held {
            wind: self
                .winds
                .as_ref()
                .map_or_else(In::zero, |winds| In::new(Vector3::from(winds.row(i)))),
            ..Held::in_still_air(drive)
        }
    }

    fn rate(&self, state: &State<f64>, held: &Held<f64>) -> State<f64> {
        dynamics::derivative(&self.vehicle, &self.effects, state, held, |_| Wrench::zero())
    }

    /// A row of results for each motion.
    fn map(
        &self,
        py: Python<'py>,
        result: impl Fn(State<f64>, &Held<f64>) -> PyResult<State<f64>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let width = BODY_NUMBERS + self.rotors;
        let mut out = Vec::with_capacity(self.states.numbers().len());
        for (i, row) in self.states.numbers().chunks_exact(width).enumerate() {
            now_and_then(py, i)?;
            push(&mut out, &result(state(row), &self.held(i))?, self.rotors);
        }
        table(py, out, width)
    }
}

/// Time derivative of motions: rotors with lag, drag, rigid body, and the effects of the vehicle.
///
/// Wings belong to the plant: they act in `simulate`, not here.
///
/// Parameters
/// ----------
/// vehicle : Vehicle
/// state : ndarray of float64, shape (n, 13 + rotors)
///     Position (NED, m), velocity (NED, m/s), attitude (body to NED, w x y z), angular rate (body, rad/s), rotor speeds (rad/s).
/// command : ndarray of float64, shape (n, rotors)
///     In the unit that the vehicle declares.
/// wind_ned_m_s : ndarray of float64, shape (n, 3), optional
///     Velocity of the air; calm if left out.
/// voltage_v : float, optional
///     Of the battery, which only the effect ``battery_sag`` feels; the reference voltage if left out.
///
/// Returns
/// -------
/// ndarray of float64, shape (n, 13 + rotors)
///     Of each number of `state` its rate.
///
/// Raises
/// ------
/// ValueError
///     Names the argument, what was expected and what came.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[pyo3(signature = (vehicle, *, state, command, wind_ned_m_s = None, voltage_v = None))]
pub(crate) fn derivative<'py>(
    py: Python<'py>,
    vehicle: &Bound<'py, Vehicle>,
    state: Array64<'py>,
    command: Array64<'py>,
    wind_ned_m_s: Option<Array64<'py>>,
    #[pyo3(from_py_with = scalars::voltage_v)] voltage_v: Option<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let model = Model::new(vehicle, &state, &command, wind_ned_m_s.as_ref(), voltage_v)?;
    model.map(py, |state, held| Ok(model.rate(&state, held)))
}

/// Motions some Runge-Kutta steps of fourth order later, commands and wind held.
///
/// The same bits as `Batch` in float64, for vehicles whose effects are all constant.
///
/// Parameters
/// ----------
/// vehicle : Vehicle
/// state : ndarray of float64, shape (n, 13 + rotors)
///     As for `derivative`.
/// command : ndarray of float64, shape (n, rotors)
///     In the unit that the vehicle declares.
/// dt_s : float
///     Step.
/// steps : int
///     How many.
/// wind_ned_m_s : ndarray of float64, shape (n, 3), optional
///     Velocity of the air; calm if left out.
/// voltage_v : float, optional
///     As for `derivative`.
///
/// Returns
/// -------
/// ndarray of float64, shape (n, 13 + rotors)
///
/// Raises
/// ------
/// ValueError
///     Names the argument, what was expected and what came.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[pyo3(signature = (vehicle, *, state, command, dt_s, steps = 1, wind_ned_m_s = None, voltage_v = None))]
pub(crate) fn rk4_step<'py>(
    py: Python<'py>,
    vehicle: &Bound<'py, Vehicle>,
    state: Array64<'py>,
    command: Array64<'py>,
    #[pyo3(from_py_with = scalars::dt_s)] dt_s: f64,
    #[pyo3(from_py_with = scalars::steps)] steps: usize,
    wind_ned_m_s: Option<Array64<'py>>,
    #[pyo3(from_py_with = scalars::voltage_v)] voltage_v: Option<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    if !(dt_s > 0.0 && dt_s.is_finite()) {
        return Err(value(format!("dt_s = {dt_s}: must be finite and > 0")));
    }
    let model = Model::new(vehicle, &state, &command, wind_ned_m_s.as_ref(), voltage_v)?;
    let taken = std::cell::Cell::new(0_usize);
    model.map(py, |mut state, held| {
        for _ in 0..steps {
            held.drive.settle(&mut state.rotor_speed_rad_s);
            state = rk4(state, dt_s, |stage| model.rate(stage, held)).normalised();
            taken.set(taken.get().wrapping_add(1));
            now_and_then(py, taken.get())?;
        }
        Ok(state)
    })
}
