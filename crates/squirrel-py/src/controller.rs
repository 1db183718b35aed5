//! A Python function that flies: asked so many times a second of the flight, on what the flight
//! code knows, for attitude and thrust or for the rotors' own commands.
//!
//! It sees nothing but the flight and its time, so that it may be as deterministic as the flight is;
//! what it raises ends the flight and is raised.

use crate::error::value;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use squirrel_core::command::AttitudeThrust;
use squirrel_core::frames::{In, Ned};
use squirrel_core::guidance::mission::{Mission, MissionState};
use squirrel_core::policy::PilotCommand;
use squirrel_core::stack::{Known, SensorFrame, StackOutput};
use squirrel_sim::flight::{CONTROL_RATE_HZ, Offboard, Setup};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What is asked of the function where it is asked for attitude and thrust.
const ATTITUDE: [&str; 4] = ["thrust_n", "roll_rad", "pitch_rad", "wing"];

/// What the function said last, or why it says no more.
#[derive(Debug, Default)]
struct Said {
    /// A command for each rotor, and one for the wings.
    rotors: Option<Vec<f32>>,
    raised: Option<PyErr>,
}

/// What the function said, where the flight code's answers pass.
#[derive(Debug, Clone, Default)]
pub(crate) struct Heard(Arc<Mutex<Said>>);

impl Heard {
    fn lock(&self) -> MutexGuard<'_, Said> {
        // A lock is never held over anything that could panic.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What the function raised.
    pub(crate) fn raised(&self) -> Option<PyErr> {
        self.lock().raised.take()
    }

    /// Whether the flight must end.
    pub(crate) fn is_over(&self) -> bool {
        self.lock().raised.is_some()
    }

    /// Puts the function's rotor commands in the place of the flight code's.
    pub(crate) fn replace(&self, output: &mut StackOutput) {
        if let Some((wing, rotors)) = self.lock().rotors.as_deref().and_then(<[f32]>::split_last) {
            output.rotor_command[..rotors.len()].copy_from_slice(rotors);
            output.wing_command = [*wing; 2];
        }
    }
}

/// A Python function in the place of an offboard computer, or of the whole flight code.
#[derive(Debug)]
pub(crate) struct Controller {
    function: Py<PyAny>,
    /// Steps of the flight code from one question to the next.
    steps: u64,
    /// Rotors, where it commands these.
    rotors: Option<usize>,
    mission: Mission,
    known: Known,
    heard: Heard,
}

impl Controller {
    /// Before take-off.
    ///
    /// * `commands` - `attitude` or `rotors`
    ///
    /// # Errors
    /// `ValueError` that names the argument.
    pub(crate) fn new(
        function: &Bound<'_, PyAny>,
        rate_hz: u64,
        commands: &str,
        setup: &Setup,
    ) -> PyResult<Self> {
        if !function.is_callable() {
            let kind = function.get_type().name()?;
            return Err(value(format!("controller: expected a function, got {kind}")));
        }
        if rate_hz == 0 || !CONTROL_RATE_HZ.is_multiple_of(rate_hz) {
            return Err(value(format!(
                "controller_hz = {rate_hz}: must divide {CONTROL_RATE_HZ}, the rate of the flight code"
            )));
        }
        let rotors = match commands {
            "attitude" => None,
            "rotors" => Some(setup.vehicle.vehicle.rotors().len()),
            _ => {
                return Err(value(format!(
                    "controller_commands = {commands}: must be attitude or rotors"
                )));
            }
        };
        Ok(Self {
            function: function.clone().unbind(),
            steps: CONTROL_RATE_HZ / rate_hz,
            rotors,
            mission: setup.scenario.mission().map_err(value)?,
            known: Known::default(),
            heard: Heard::default(),
        })
    }

    /// Where the flight code's answers hear of it.
    pub(crate) fn heard(&self) -> Heard {
        self.heard.clone()
    }

    /// What the function may know, by names with units.
    fn sight<'py>(&self, py: Python<'py>, time_us: u64) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Known { imu: Some(imu), attitude: Some(attitude), gnss: Some(gnss), .. } = self.known
        else {
            return Ok(None);
        };
        let mut position = gnss.position;
        if let Some(altitude_m) = self.known.altitude_m {
            position.vector.z = -altitude_m;
        }
        let reference = self.mission.reference(&MissionState::default(), time_us);
        let sight = PyDict::new(py);
        let put = |name: &str, row: &[f32]| sight.set_item(name, PyArray1::from_slice(py, row));
        let ned = |vector: In<Ned, f32>| <[f32; 3]>::from(vector.vector);
        put("position_ned_m", &ned(position))?;
        put("velocity_ned_m_s", &ned(gnss.velocity))?;
        put("q_ned_from_body_wxyz", &attitude.wxyz())?;
        put("omega_body_rad_s", &<[f32; 3]>::from(imu.omega.vector))?;
        put("specific_force_body_m_s2", &<[f32; 3]>::from(imu.specific_force.vector))?;
        put("reference_position_ned_m", &ned(reference.position))?;
        put("reference_velocity_ned_m_s", &ned(reference.velocity))?;
        put("reference_acceleration_ned_m_s2", &ned(reference.acceleration))?;
        Ok(Some(sight))
    }

    /// Asks the function.
    fn ask(&self, py: Python<'_>, time_us: u64) -> PyResult<Option<Vec<f32>>> {
        let Some(sight) = self.sight(py, time_us)? else { return Ok(None) };
        let time_s = time_us as f64 * 1e-6;
        let answer = self.function.bind(py).call1((sight, time_s)).inspect_err(|raised| {
            // When it was, beside what the function has to say; without it, that is enough.
            let note = format!("controller: raised at {time_s:.3} s of the flight");
            let _ = raised.value(py).call_method1("add_note", (note,));
        })?;
        let numbers = self.rotors.map_or(ATTITUDE.len(), |rotors| rotors + 1);
        let name = |i: usize| match self.rotors {
            None => ATTITUDE[i].to_owned(),
            Some(rotors) if i == rotors => "wing".to_owned(),
            Some(_) => format!("rotor {i}"),
        };
        let names = || (0..numbers).map(name).collect::<Vec<_>>().join(", ");
        let said: Vec<f64> =
            answer.call_method0("tolist").unwrap_or(answer).extract().map_err(|_| {
                value(format!("controller: at {time_s:.3} s: must return numbers: {}", names()))
            })?;
        if said.len() != numbers {
            return Err(value(format!(
                "controller: at {time_s:.3} s: returned {} numbers, must be {numbers}: {}",
                said.len(),
                names()
            )));
        }
        if let Some(i) = said.iter().position(|x| !(*x as f32).is_finite()) {
            return Err(value(format!(
                "controller: at {time_s:.3} s: {} = {}: must be finite",
                name(i),
                said[i]
            )));
        }
        Ok(Some(said.into_iter().map(|x| x as f32).collect()))
    }
}

impl Offboard for Controller {
    fn command(&mut self, tick: u64, frame: &SensorFrame) -> Option<PilotCommand> {
        self.known.take_over(frame);
        if !tick.is_multiple_of(self.steps) || self.heard.is_over() {
            return None;
        }
        let said = Python::attach(|py| self.ask(py, frame.time_us));
        let mut heard = self.heard.lock();
        match said {
            Err(raised) => heard.raised = Some(raised),
            Ok(None) => {}
            Ok(Some(said)) if self.rotors.is_some() => heard.rotors = Some(said),
            Ok(Some(said)) => {
                let attitude =
                    AttitudeThrust { thrust_n: said[0], roll_rad: said[1], pitch_rad: said[2] };
                return Some(PilotCommand { attitude, wing: said[3].clamp(0.0, 1.0) });
            }
        }
        None
    }

    fn facts(&self) -> Vec<(&'static str, String)> {
        let rate_hz = CONTROL_RATE_HZ / self.steps;
        let what = if self.rotors.is_some() { "rotors" } else { "attitude" };
        vec![("controller", format!("a Python function commands {what} at {rate_hz} Hz"))]
    }
}
