//! The paper's force model: a recurrent network that sees speed and angle of attack corrects the
//! flat plate.

use super::elman::Elman;
use super::head::{Correction, Flow, TurnedNormal, force};
use crate::aero::angle_of_attack;
use crate::frames::{Body, In};
use crate::math::all_finite;
use crate::vehicle::{ParameterError, positive};

/// Rows of a window.
pub const WINDOW: usize = 10;
/// Time between rows, s: the period of the outer loop.
pub const STEP_S: f32 = 0.1;
/// Inputs of a row.
pub const INPUTS: usize = 2;
/// Neurons of a layer.
pub const HIDDEN: usize = 8;
/// The network sees speed in this unit, m/s.
pub const SPEED_SCALE_M_S: f32 = 10.0;

/// What the network sees of a moment: `|v| / 10 m/s` and the angle of attack in rad.
///
/// * `velocity` - velocity relative to the air, m/s; on a vehicle without airspeed sensor that over
///   ground
pub fn features(velocity: In<Body, f32>) -> [f32; INPUTS] {
    [velocity.vector.norm() / SPEED_SCALE_M_S, angle_of_attack(velocity)]
}

/// The last rows, oldest first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct History {
    pub(crate) rows: [[f32; INPUTS]; WINDOW],
    pub(crate) seen: usize,
}

impl History {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        Self { rows: [[0.0; INPUTS]; WINDOW], seen: 0 }
    }

    /// The oldest row makes room for this one.
    pub fn push(&mut self, row: [f32; INPUTS]) {
        let mut newer = row;
        for place in self.rows.iter_mut().rev() {
            newer = core::mem::replace(place, newer);
        }
        self.seen = (self.seen + 1).min(WINDOW);
    }

    /// The window; `None` before it is full, because the network has not been trained on less.
    pub fn window(&self) -> Option<&[[f32; INPUTS]; WINDOW]> {
        (self.seen == WINDOW).then_some(&self.rows)
    }
}

impl Default for History {
    fn default() -> Self {
        Self::new()
    }
}

/// What was flown in training; beyond it a network guesses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// Lowest and highest speed, m/s.
    pub speed_m_s: [f32; 2],
    /// Lowest and highest angle of attack, rad.
    pub alpha_rad: [f32; 2],
}

/// Weights and plate of one vehicle. Plain data, so that it can be a `const`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parnn {
    /// The network; its outputs are those of [`Correction::from_outputs`].
    pub net: Elman<INPUTS, HIDDEN, 2>,
    /// Area of the flat plate that is corrected, m^2.
    pub area_m2: f32,
    /// What the network was trained on.
    pub domain: Domain,
}

/// What [`Parnn`] makes of a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Force of the air on the spread wings, N.
    pub force: In<Body, f32>,
    /// The network's word.
    pub correction: Correction<f32>,
    /// Angle of attack that the wing seems to have, rad.
    pub alpha_est_rad: f32,
}

impl Parnn {
    /// # Errors
    /// A weight that is not finite, an area that is none, a range that runs backwards.
    pub fn check(&self) -> Result<(), ParameterError> {
        if let Some(weight) = self.net.tensors().into_iter().flatten().find(|w| !w.is_finite()) {
            return Err(ParameterError::of("parnn.net", *weight, "every weight must be finite"));
        }
        positive("parnn.area_m2", self.area_m2)?;
        for (field, [low, high]) in [
            ("domain.speed_m_s", self.domain.speed_m_s),
            ("domain.alpha_rad", self.domain.alpha_rad),
        ] {
            if !(low.is_finite() && high.is_finite() && low <= high) {
                let wrong = if low.is_finite() { high } else { low };
                return Err(ParameterError::of(
                    field,
                    wrong,
                    "must be two finite numbers, the lower first",
                ));
            }
        }
        Ok(())
    }

    /// The force at the last row of a window.
    ///
    /// * `rows` - [`features`], oldest first: [`WINDOW`] of them, or as many as the network was
    ///   trained on
    /// * `velocity` - at the last row, as for [`features`]
    pub fn estimate(&self, rows: &[[f32; INPUTS]], velocity: In<Body, f32>) -> Estimate {
        let correction = Correction::from_outputs(self.net.window(rows));
        let flow = Flow::new(velocity);
        let force = force(&flow, correction, self.area_m2);
        // Only weights of absurd size come here; the caller must get a force that can be subtracted
        // all the same.
        let force = if all_finite(&force.vector) { force } else { In::zero() };
        Estimate {
            force,
            correction,
            alpha_est_rad: TurnedNormal::new(&flow, correction.alpha_w_rad).alpha_est_rad(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aero::flat_plate;
    use nalgebra::Vector3;

    const DOMAIN: Domain = Domain { speed_m_s: [0.0, 8.0], alpha_rad: [-1.0, 1.0] };

    /// A network that says nothing: `alpha_w = 0`, `gamma = 1`.
    fn silent() -> Parnn {
        let mut net = Elman::filled(0.0);
        net.output.bias = [0.0, 0.541_324_85];
        Parnn { net, area_m2: 0.04, domain: DOMAIN }
    }

    #[test]
    fn a_silent_network_flies_the_flat_plate() {
        for velocity in [[7.0, 1.0, 3.0], [0.3, 0.0, 0.1], [0.0, 0.0, 9.0], [-4.0, 2.0, -5.0]] {
            let velocity = In::new(Vector3::from(velocity));
            let estimate = silent().estimate(&[features(velocity); WINDOW], velocity);
            let plate = flat_plate::force(velocity, In::new(Vector3::z()), 0.04);
            let difference = (estimate.force - plate).vector.norm();
            assert!(difference <= 2e-7 * plate.vector.norm(), "{estimate:?} {plate:?}");
            assert!((estimate.alpha_est_rad - angle_of_attack(velocity)).abs() < 1e-3);
        }
    }

    #[test]
    fn a_standing_vehicle_has_no_wing_force() {
        for velocity in
            [[0.0; 3], [0.1, 0.2, -0.1], [f32::NAN, 1.0, 1.0], [f32::INFINITY, 0.0, 0.0]]
        {
            let velocity = In::new(Vector3::from(velocity));
            let estimate = silent().estimate(&[features(velocity); WINDOW], velocity);
            assert_eq!(estimate.force.vector.norm(), 0.0, "{velocity:?}");
            assert!(estimate.alpha_est_rad.is_finite());
        }
    }

    #[test]
    fn absurd_weights_give_no_force() {
        let absurd = Parnn { net: Elman::filled(f32::MAX), ..silent() };
        let velocity = In::new(Vector3::new(5.0, 0.0, 2.0));
        let estimate = absurd.estimate(&[features(velocity); WINDOW], velocity);
        assert!(all_finite(&estimate.force.vector), "{estimate:?}");
    }

    #[test]
    fn what_cannot_fly_is_named() {
        silent().check().unwrap();
        let says = |change: &dyn Fn(&mut Parnn)| {
            let mut parnn = silent();
            change(&mut parnn);
            parnn.check().unwrap_err().to_string()
        };
        let error = says(&|p| p.net.second.hidden[3][5] = f32::NAN);
        assert_eq!(error, "parnn.net = NaN: every weight must be finite");
        assert!(says(&|p| p.area_m2 = 0.0).starts_with("parnn.area_m2 = 0: "));
        assert!(says(&|p| p.domain.speed_m_s = [2.0, 1.0]).starts_with("domain.speed_m_s = 1: "));
        assert!(
            says(&|p| p.domain.alpha_rad[0] = f32::NAN).starts_with("domain.alpha_rad = NaN: ")
        );
    }

    #[test]
    fn a_history_speaks_when_it_is_full_and_forgets_the_oldest() {
        let mut history = History::new();
        for k in 0..WINDOW {
            assert_eq!(history.window(), None, "{k}");
            history.push([k as f32, 0.5]);
        }
        history.push([10.0, 0.5]);
        let speeds = history.window().expect("full").map(|row| row[0]);
        assert_eq!(speeds, core::array::from_fn(|k| k as f32 + 1.0));
    }
}
