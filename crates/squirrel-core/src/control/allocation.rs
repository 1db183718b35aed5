//! Weighted allocation: the rotor thrusts that miss a demand by the least, where rotors differ in what they can give.
//!
//! The quadratic programme of docs/equations.md G.2, exactly, over `0 <= F_i <= F_max,i`:
//!
//! ```text
//! w_rp ((roll(F) - roll_d)^2 + (pitch(F) - pitch_d)^2) + w_u (1'F - U)^2 + w_psi (yaw(F) - yaw_d)^2 + w_c |F - F_prev|^2
//! ```
//! Every term is in newtons: roll over the rotors' mean `|y|`, pitch over their mean `|x|`, yaw over the mean `k_m / k_f`. So the
//! weights say the same of any airframe. In N m, yaw of the squirrel would weigh `1 * 0.011^2`, no more than the change of one thrust.
//!
//! How it differs from [`super::mixer::Mixer`], which the flight code flies: each rotor has a limit of its own, 0 for one that is
//! out; priorities are weights, so a little roll and pitch is given up where that saves much thrust; their direction is not kept;
//! more than four rotors are all used to their limits; thrusts do not jump where several answers are equally good. The mixer is
//! shorter, and lexicographic.
//!
//! A primal active set. Within the limits, a product with constants. Else: minimise over the rotors that are free, stop at the
//! first limit in the way and hold that rotor there; at a minimum, let go the rotor that gains most; if none gains, the conditions of
//! Karush, Kuhn and Tucker hold, and as the programme is strictly convex that is its only answer. The cost falls from minimum to
//! minimum, so none of the `3^n` ways to hold `n` rotors is minimised over twice; and no rotor is held that was not free at first or let go at
//! a minimum: at most `2 * 3^n + n - 1` steps, for four rotors [`STEPS_MAX`]. More rotors end there too, within the limits and better than they
//! began; no draw of the tests needed more than a fifth of it, and [`AllocationTerms::optimal`] says.
//!
//! Demands and thrusts are f32, the arithmetic is f64, which a Cortex-M7 has in hardware: with the weights of G.2 the curvature spans
//! 1e8, an f32 carries 1.7e7. In f32 this search is off by more than 1e-5 of the largest thrust in three draws of ten.

mod active_set;

use super::mixer::ThrustTorque;
use crate::math::{limit, upper};
use crate::vehicle::{MAX_ROTORS, ParameterError, PerRotor, Vehicle, not_negative, positive};
use active_set::Problem;
use nalgebra::Vector3;

/// Most steps of one allocation, each a minimisation: `2 * 3^4 + 3`.
pub const STEPS_MAX: u32 = 165;
/// Largest weight over that of the change: beyond, f64 runs out too.
const SPREAD_MAX: f32 = 1e9;

/// What a newton missed costs, 1/N^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Of roll and pitch, each over its mean arm.
    pub roll_pitch: f32,
    /// Of collective thrust.
    pub thrust: f32,
    /// Of yaw, over `k_m / k_f`.
    pub yaw: f32,
    /// Of each rotor's change against the thrusts before, > 0: it chooses where nothing else does.
    pub change: f32,
}

impl Default for Weights {
    /// Those of G.2.
    fn default() -> Self {
        Self { roll_pitch: 1e4, thrust: 1e2, yaw: 1.0, change: 1e-4 }
    }
}

/// Rotor thrusts and what they achieve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AllocationTerms {
    /// Thrust of each rotor, N, within its limits.
    pub rotor_thrust_n: PerRotor<f32>,
    /// What these thrusts amount to.
    pub achieved: ThrustTorque,
    /// Steps, 0 where no limit is in the way; at most [`STEPS_MAX`].
    pub steps: u32,
    /// Nothing costs less.
    pub optimal: bool,
}

/// The allocation of one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allocation {
    count: usize,
    thrust_max_n: f32,
    /// Thrust, roll, pitch and yaw torque of one newton of each rotor.
    effectiveness: PerRotor<[f32; 4]>,
    /// What one unit missed on an axis pulls at each rotor: weight over the square of the axis' arm, times the effectiveness.
    pull: PerRotor<[f64; 4]>,
    change: f64,
    /// Second derivatives of half the cost.
    curvature: PerRotor<PerRotor<f64>>,
    /// The change of each rotor per unit missed on an axis, where no limit is in the way.
    of_missed: PerRotor<[f64; 4]>,
}

impl Allocation {
    /// # Errors
    /// A weight that is negative, not finite or far beyond that of the change, or a layout without any roll or pitch.
    pub fn new(vehicle: &Vehicle<f32>, weights: &Weights) -> Result<Self, ParameterError> {
        not_negative("allocation.roll_pitch", weights.roll_pitch)?;
        not_negative("allocation.thrust", weights.thrust)?;
        not_negative("allocation.yaw", weights.yaw)?;
        positive("allocation.change", weights.change)?;
        let largest = upper(weights.roll_pitch, upper(weights.thrust, weights.yaw));
        if !(largest / weights.change <= SPREAD_MAX) {
            let reason = "must be at least 1e-9 of the largest weight";
            return Err(ParameterError::of("allocation.change", weights.change, reason));
        }
        let propulsion = &vehicle.parameters().propulsion;
        let torque_per_thrust = propulsion.torque_coefficient_n_m_s2 / propulsion.thrust_coefficient_n_s2;
        let mut effectiveness = [[0.0; 4]; MAX_ROTORS];
        let mut size = [0.0_f64; 4];
        let count = vehicle.rotors().len();
        for (row, rotor) in effectiveness.iter_mut().zip(vehicle.rotors()) {
            let r = rotor.position.vector;
            *row = [1.0, -r.y, r.x, rotor.yaw_sign * torque_per_thrust];
            for (sum, x) in size.iter_mut().zip(row) {
                *sum += f64::from(x.abs()) / count as f64;
            }
        }
        for (axis, arm) in size.iter().enumerate().take(3) {
            if !(*arm > 1e-6) {
                let reason = "the layout cannot produce roll (1) or pitch (2); mean arm";
                return Err(ParameterError::at("rotor[].position_body_m", axis, *arm, reason));
            }
        }
        let of_axis = [weights.thrust, weights.roll_pitch, weights.roll_pitch, weights.yaw].map(f64::from);
        let mut out = Self {
            count,
            thrust_max_n: vehicle.rotor_thrust_max_n(),
            effectiveness,
            pull: [[0.0; 4]; MAX_ROTORS],
            change: f64::from(weights.change),
            curvature: [[0.0; MAX_ROTORS]; MAX_ROTORS],
            of_missed: [[0.0; 4]; MAX_ROTORS],
        };
        for i in 0..out.rotors() {
            for k in 0..4 {
                // Without any reaction torque there is no yaw to weigh.
                let weight = if size[k] > 0.0 { of_axis[k] / (size[k] * size[k]) } else { 0.0 };
                out.pull[i][k] = weight * f64::from(effectiveness[i][k]);
            }
            for j in 0..out.rotors() {
                let products = out.pull[i].iter().zip(&effectiveness[j]).map(|(p, t)| p * f64::from(*t));
                out.curvature[i][j] = products.sum::<f64>() + if i == j { out.change } else { 0.0 };
            }
        }
        for k in 0..4 {
            let answer = out.newton_step([true; MAX_ROTORS], &out.pull.map(|pull| pull[k]));
            for (of, x) in out.of_missed.iter_mut().zip(answer) {
                of[k] = x;
            }
        }
        Ok(out)
    }

    /// Number of rotors, with the bound that [`Vehicle`] keeps: here the compiler sees that no loop leaves an array.
    fn rotors(&self) -> usize {
        self.count.min(MAX_ROTORS)
    }

    /// Rotor thrusts for a demand. Total: what is not finite counts as zero, limits beyond the vehicle's as the vehicle's.
    ///
    /// * `previous_n` - thrusts before, N
    /// * `limit_n` - most that each rotor can give, N; 0 for one that is out
    pub fn allocate(
        &self,
        demand: &ThrustTorque,
        previous_n: &PerRotor<f32>,
        limit_n: &PerRotor<f32>,
    ) -> AllocationTerms {
        let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
        let torque = demand.torque_n_m.map(finite);
        let want = [upper(finite(demand.thrust_n), 0.0), torque.x, torque.y, torque.z];
        let within = |f: &f32| f64::from(limit(finite(*f), 0.0, self.thrust_max_n));
        let (mut before, mut most) = ([0.0; MAX_ROTORS], [0.0; MAX_ROTORS]);
        for i in 0..self.rotors() {
            (before[i], most[i]) = (within(&previous_n[i]), within(&limit_n[i]));
        }
        let problem = Problem { want: want.map(f64::from), before, most };
        let missed = self.missed(&problem, &before);
        let (mut at, mut free, mut fits) = (before, [true; MAX_ROTORS], true);
        for i in 0..self.rotors() {
            for (of, x) in self.of_missed[i].iter().zip(&missed) {
                at[i] -= of * x;
            }
            free[i] = at[i] >= 0.0 && at[i] <= most[i];
            fits &= free[i];
            at[i] = limit(at[i], 0.0, most[i]);
        }
        let (at, steps, optimal) = if fits { (at, 0, true) } else { self.search(&problem, at, free) };
        self.terms(&at.map(|f| f as f32), steps, optimal)
    }

    fn terms(&self, thrust: &PerRotor<f32>, steps: u32, optimal: bool) -> AllocationTerms {
        let mut sum = [0.0; 4];
        for (f, of) in thrust.iter().zip(&self.effectiveness) {
            for (total, part) in sum.iter_mut().zip(of) {
                *total += part * f;
            }
        }
        let achieved = ThrustTorque { thrust_n: sum[0], torque_n_m: Vector3::new(sum[1], sum[2], sum[3]) };
        AllocationTerms { rotor_thrust_n: *thrust, achieved, steps, optimal }
    }
}
