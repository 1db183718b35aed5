//! The paper's network as the truth about the wings: its "simulation mode", in which plant and
//! controller agree.
//!
//! Ten times a second the network sees the motion through the air and says its correction; in
//! between the correction is held, and the corrected flat plate follows the air at once
//! (docs/equations.md E.2). There is no guard: the network's word is the truth here. Before its
//! window is full the wing is the flat plate. Forces are the `f32` of the flight code, so that
//! where both see the same they say the same, bit for bit.

use squirrel_core::aero::Air;
use squirrel_core::frames::{Body, In, Wrench};
use squirrel_core::nalgebra::Vector3;
use squirrel_core::rnn::head::{Correction, Flow, force};
use squirrel_core::rnn::parnn::{History, Parnn, STEP_S, WINDOW, features};
use squirrel_core::vehicle::Wing;

/// What is left of 0.1 s by the rounding of steps is no reason to wait for another step.
const EARLY_S: f64 = 1e-6;

/// Wings that do what the network says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParnnWing {
    /// The network and its plate.
    pub parnn: Parnn,
    /// Distance of each side's centre of pressure from the middle, m.
    pub lateral_arm_m: f64,
}

/// What the network saw and said last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParnnWingState {
    history: History,
    correction: Correction<f32>,
    /// Time since the last row, s.
    age_s: f64,
}

impl ParnnWingState {
    /// Nothing seen yet: the flat plate.
    pub(super) fn new() -> Self {
        let correction = Correction { alpha_w_rad: 0.0, gamma: 1.0 };
        Self { history: History::new(), correction, age_s: 0.0 }
    }
}

fn single(velocity: In<Body, f64>) -> In<Body, f32> {
    In::new(velocity.vector.map(|x| x as f32))
}

impl ParnnWing {
    /// The wings of a vehicle with this network.
    pub(crate) fn new(parnn: &Parnn, wing: &Wing<f64>) -> Self {
        Self { parnn: *parnn, lateral_arm_m: wing.lateral_arm_m }
    }

    /// Time passes in this air, s: rows that are due are taken from it, and the network speaks.
    pub(super) fn pass(&self, state: &mut ParnnWingState, air: &Air<f64>, dt_s: f64) {
        let step_s = f64::from(STEP_S);
        state.age_s += dt_s;
        if state.age_s + EARLY_S < step_s {
            return;
        }
        let due = ((state.age_s + EARLY_S) / step_s).floor();
        state.age_s -= due * step_s;
        let velocity = single(air.velocity);
        // More rows than a window holds would only push each other out.
        for _ in 0..due.min(WINDOW as f64) as usize {
            state.history.push(features(velocity));
        }
        if let Some(window) = state.history.window() {
            state.correction = self.parnn.estimate(window, velocity).correction;
        }
    }

    /// Force and moment in this air at a deployment, left and right, 0..1. Each side carries half
    /// of the force.
    #[inline(always)]
    pub(super) fn wrench(
        &self,
        state: &ParnnWingState,
        air: &Air<f64>,
        deployment: [f64; 2],
    ) -> Wrench<Body, f64> {
        let spread = force(&Flow::new(single(air.velocity)), state.correction, self.parnn.area_m2);
        let spread = spread.vector.map(f64::from);
        let arm = Vector3::new(0.0, self.lateral_arm_m, 0.0);
        let [left, right] = deployment;
        Wrench {
            force: In::new(spread * (0.5 * (left + right))),
            moment: In::new(arm.cross(&spread) * (0.5 * (right - left))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle_file::VehicleFile;

    fn wing() -> ParnnWing {
        let file = VehicleFile::squirrel();
        ParnnWing::new(file.weights.unwrap().parnn(), &file.vehicle.parameters().wing.unwrap())
    }

    fn air(k: u32) -> Air<f64> {
        let t = f64::from(k) * 0.1;
        let velocity = Vector3::new(5.0 + t.sin(), 0.5 * (2.0 * t).cos(), 1.0 + (1.7 * t).sin());
        Air::new(In::new(velocity), In::zero())
    }

    /// The bits of the flight code at the instants at which it is asked.
    #[test]
    fn the_force_is_what_the_flight_code_computes() {
        let wing = wing();
        let mut state = ParnnWingState::new();
        let mut history = History::new();
        for k in 0..30 {
            let velocity = single(air(k).velocity);
            wing.pass(&mut state, &air(k), 0.1);
            history.push(features(velocity));
            let force = wing.wrench(&state, &air(k), [1.0; 2]).force.vector;
            let expected = match history.window() {
                Some(window) => wing.parnn.estimate(window, velocity).force,
                None => squirrel_core::aero::flat_plate::force(
                    velocity,
                    In::new(Vector3::z()),
                    wing.parnn.area_m2,
                ),
            };
            assert_eq!(force, expected.vector.map(f64::from), "{k}");
        }
    }

    /// A step of the plant is no tenth of a second: rows come at the same times whatever it is.
    #[test]
    fn rows_come_ten_times_a_second_whatever_the_step() {
        let wing = wing();
        let after = |dt_s: f64, steps: u32| {
            let mut state = ParnnWingState::new();
            for k in 1..=steps {
                // The air changes when a row is due only.
                let row = (f64::from(k) * dt_s * 10.0 + 1e-9).floor() as u32;
                wing.pass(&mut state, &air(row), dt_s);
            }
            (state.history, state.correction)
        };
        let reference = after(0.1, 25);
        assert!(reference.0.window().is_some());
        assert_eq!(after(1e-3, 2500), reference);
        assert_eq!(after(0.004, 625), reference);
        let mut long = ParnnWingState::new();
        wing.pass(&mut long, &air(0), 1e9);
        assert_eq!(long.history.window().unwrap(), &[features(single(air(0).velocity)); WINDOW]);
    }

    #[test]
    fn one_side_alone_rolls_and_yaws_the_vehicle_about_its_arm() {
        let (wing, state) = (wing(), ParnnWingState::new());
        let air = Air::new(In::new(Vector3::new(6.0, 0.0, 3.0)), In::zero());
        let of = |deployment| wing.wrench(&state, &air, deployment);
        assert_eq!(of([0.0; 2]).force.vector.norm(), 0.0);
        assert_eq!(of([1.0; 2]).moment.vector.norm(), 0.0);
        assert!(of([1.0, 0.0]).moment.vector.x > 0.0, "left lift rolls right");
        let both = of([1.0, 0.0]).force + of([0.0, 1.0]).force;
        assert!((both - of([1.0; 2]).force).vector.norm() < 1e-12);
    }

    #[test]
    fn absurd_air_makes_no_nan() {
        let (wing, mut state) = (wing(), ParnnWingState::new());
        for x in [0.0, 1e-30, 1e30, 1e300, f64::MAX] {
            let air = Air::new(In::new(Vector3::new(x, -x, x)), In::zero());
            wing.pass(&mut state, &air, 2.0);
            let wrench = wing.wrench(&state, &air, [1.0, 0.3]);
            assert!(
                wrench.force.vector.iter().chain(&wrench.moment.vector).all(|f| f.is_finite()),
                "{x}"
            );
        }
    }
}
