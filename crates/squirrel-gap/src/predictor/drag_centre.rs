//! The frame's drag beside the point that the vehicle file's positions refer to.
//!
//! ```text
//! w' += J^-1 (r x F_drag)      F_drag: base drag, linear_drag and quadratic_drag; r: where it acts
//! ```
//! No file says where, and a few hundredths of an arm, on which the air's pressure may well act, are
//! more than the noise of a calm flight: unaccounted for, they are read into rotors that are
//! elsewhere, and hide a centre of mass that is.

use super::{Hypothesis, Predictor};
use crate::GapError;
use nalgebra::Vector3;
use squirrel_core::effects::{ConstantWind, Effect, Effects, LinearDrag, QuadraticDrag};
use squirrel_core::frames::{Body, In, Ned};
use squirrel_core::vehicle::MAX_ROTORS;
use squirrel_sim::plant::{Plant, PlantState, SideBySide, WingPlant};

/// Drag that acts elsewhere.
pub(crate) struct DragCentre {
    at_m: Vector3<f64>,
    /// The vehicle with nothing but its drag: with rotors that stand still no other force is left.
    drag: Plant,
}

impl DragCentre {
    /// `None` where drag acts where the file's positions are from.
    ///
    /// # Errors
    /// As [`Predictor::plant_at`].
    pub(crate) fn of(
        predictor: &Predictor<'_>,
        hypothesis: &Hypothesis,
        dt_s: f64,
    ) -> Result<Option<Self>, GapError> {
        let at_m = hypothesis.drag_centre_m;
        if at_m == Vector3::zeros() {
            return Ok(None);
        }
        let (mut all, mut effects) = (hypothesis.effects, Effects::none());
        for name in [LinearDrag::<f64>::NAME, QuadraticDrag::<f64>::NAME, ConstantWind::<f64>::NAME]
        {
            if let Some(own) = all.get_mut(name)
                && let Some(found) = effects.insert(name)
            {
                found.values.copy_from_slice(own.values);
            }
        }
        let drag = Plant::new(hypothesis.vehicle, effects, WingPlant::None, None, dt_s)
            .map_err(|problem| predictor.refused(problem))?;
        Ok(Some(Self { at_m, drag }))
    }

    /// What it adds to the angular acceleration at each state, rad/s^2.
    ///
    /// * `plant` - whose inertia the vehicle has
    pub(super) fn turns(&self, plant: &Plant, states: &SideBySide) -> Vec<Vector3<f64>> {
        let led = self.drag.led_at_without_rotors(states);
        led.iter().map(|led| self.turning(plant, led.wrench.force)).collect()
    }

    /// Turns a plant that flies by itself by what drag adds to it.
    ///
    /// * `wind` - over ground, beside that of effects
    /// * `dt_s` - how long the state lasts
    pub(crate) fn turn(
        &self,
        plant: &Plant,
        state: &mut PlantState,
        wind: In<Ned, f64>,
        dt_s: f64,
    ) {
        let mut still = *state;
        still.body.rotor_speed_rad_s = [0.0; MAX_ROTORS];
        let turning = self.turning(plant, self.drag.wrench(&still, wind).force);
        state.body.omega = In::new(state.body.omega.vector + turning * dt_s);
    }

    fn turning(&self, plant: &Plant, drag: In<Body, f64>) -> Vector3<f64> {
        plant.vehicle().inertia_inverse() * self.at_m.cross(&drag.vector)
    }
}
