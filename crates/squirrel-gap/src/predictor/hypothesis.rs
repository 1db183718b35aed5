//! What is assumed of the vehicle and its sensors while flights are predicted.

use super::SensorErrors;
use super::late::LateS;
use nalgebra::Vector3;
use squirrel_core::effects::{Effect, Effects, ThrustCoefficient};
use squirrel_core::vehicle::Vehicle;

/// A hypothesis: the airframe, the effects that act, and what the sensors of each flight do.
#[derive(Debug, Clone)]
pub(crate) struct Hypothesis {
    pub(crate) vehicle: Vehicle<f64>,
    pub(crate) effects: Effects<f64>,
    pub(crate) errors: Vec<SensorErrors>,
    /// By what fraction the thrust of each flight is more than the vehicle's: propellers wear, and
    /// packs differ.
    pub(crate) thrust: Vec<f64>,
    /// Where the frame's drag acts, body frame, m.
    pub(crate) drag_centre_m: Vector3<f64>,
}

impl Hypothesis {
    /// All of it that the residual of one flight's dynamics depends on.
    pub(super) fn asked_of(&self, flight: usize) -> Asked {
        Asked {
            vehicle: self.vehicle,
            effects: self.effects,
            errors: self.errors[flight],
            thrust: self.thrust.get(flight).copied().unwrap_or(0.0),
            drag_centre_m: self.drag_centre_m,
        }
    }

    /// The same with sensors that are not late.
    pub(crate) fn on_time(mut self) -> Self {
        for errors in &mut self.errors {
            errors.late_s = LateS::default();
        }
        self
    }

    /// The same with the vehicle as it was in one flight.
    pub(super) fn in_flight(&self, flight: usize) -> Option<Self> {
        let fraction = *self.thrust.get(flight).filter(|fraction| **fraction != 0.0)?;
        let mut day = Effects::none();
        day.insert(ThrustCoefficient::<f64>::NAME)?.values[0] = fraction;
        Some(Self { vehicle: day.alter(&self.vehicle).ok()?, ..self.clone() })
    }
}

/// See [`Hypothesis::asked_of`].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Asked {
    vehicle: Vehicle<f64>,
    effects: Effects<f64>,
    errors: SensorErrors,
    thrust: f64,
    drag_centre_m: Vector3<f64>,
}
