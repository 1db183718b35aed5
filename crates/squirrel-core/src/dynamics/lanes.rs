//! The base model on lanes: what moves, what does not change, what is held, and the derivative.
//!
//! The same equations as [`derivative`](super::derivative), for vehicles side by side
//! ([`Row`](crate::lane::Row)) and for derivatives by the state. No closures and no iterators in
//! what runs in steps: code must end up in the function that was compiled for the registers.

use super::State;
use super::body;
use super::rotors::{inverse_lag, lag_rate, lag_start, thrust_and_moment};
use crate::aero::{Airflow, BodyWrench, drag};
use crate::lane::Lane;
use crate::lane::vector::{self, dot, minus, rotation, transposed_times};
use crate::math::Real;
use crate::numbers;
use crate::vehicle::{MAX_ROTORS, Vehicle};

numbers! {
    /// Rigid body and rotor speeds, in the units and frames of [`State`]; as a rate, the derivative
    /// of each.
    Motion<ROTORS> {
        /// NED, m.
        position [3],
        /// Over ground, NED, m/s.
        velocity [3],
        /// w x y z.
        attitude [4],
        /// rad/s.
        omega [3],
        /// rad/s; 0 in a place without a rotor.
        rotor_speed [ROTORS],
    }
}

numbers! {
    /// What does not change in flight, SI.
    Airframe<ROTORS> {
        /// 1/kg.
        inverse_mass,
        /// By columns, kg m^2.
        inertia [3] [3],
        /// Its inverse.
        inertia_inverse [3] [3],
        /// Along each axis, N s/m.
        linear_drag [3],
        /// `1/2 rho C_d A`.
        quadratic_drag,
        /// Thrust of each rotor over its speed squared, N s^2.
        thrust [ROTORS],
        /// Roll moment of each, likewise, N m s^2.
        roll [ROTORS],
        /// Pitch moment.
        pitch [ROTORS],
        /// Yaw moment.
        yaw [ROTORS],
        /// Inverse time constants of rotor speed, speeding up and slowing down, 1/s; 0 for no lag.
        inverse_lag [2],
    }
}

numbers! {
    /// What is held from call to call.
    Held<ROTORS> {
        /// Velocity of the air, NED, m/s, without what effects add to it.
        wind [3],
        /// Steady speeds that the rotors move towards, rad/s.
        target_speed [ROTORS],
    }
}

impl<T: Real, const ROTORS: usize> Airframe<T, ROTORS> {
    /// Of the first rotors of a vehicle.
    ///
    /// * `extra_time_constant_s` - on top of the vehicle's own, speeding up and slowing down
    pub fn new(vehicle: &Vehicle<T>, extra_time_constant_s: [T; 2]) -> Self {
        const { assert!(ROTORS >= 1 && ROTORS <= MAX_ROTORS) };
        let (p, per_square) = (vehicle.parameters(), vehicle.rotor_wrench_per_speed_squared());
        let first = |all: &[T; MAX_ROTORS]| core::array::from_fn(|i| all[i]);
        Self {
            inverse_mass: vehicle.inverse_mass(),
            inertia: p.inertia_kg_m2.into(),
            inertia_inverse: (*vehicle.inertia_inverse()).into(),
            linear_drag: p.drag.linear_n_s_per_m.into(),
            quadratic_drag: p.drag.per_square(),
            thrust: first(&per_square.thrust),
            roll: first(&per_square.roll),
            pitch: first(&per_square.pitch),
            yaw: first(&per_square.yaw),
            inverse_lag: inverse_lag(&p.propulsion, extra_time_constant_s),
        }
    }
}

impl<T: Real, const ROTORS: usize> From<&State<T>> for Motion<T, ROTORS> {
    fn from(state: &State<T>) -> Self {
        Self {
            position: state.position.vector.into(),
            velocity: state.velocity.vector.into(),
            attitude: state.attitude_wxyz(),
            omega: state.omega.vector.into(),
            rotor_speed: core::array::from_fn(|i| state.rotor_speed_rad_s[i]),
        }
    }
}

/// Motion through air that moves with `wind`.
#[inline(always)]
pub fn airflow<L: Lane, const ROTORS: usize>(
    state: &Motion<L, ROTORS>,
    wind: &[L; 3],
    columns: &[[L; 3]; 3],
) -> Airflow<L> {
    let relative = minus(&state.velocity, wind);
    Airflow {
        velocity: transposed_times(columns, &relative),
        speed: dot(&relative, &relative).root(),
        omega: state.omega,
    }
}

/// A rotor without lag is at its target at once.
#[inline(always)]
pub fn settle<L: Lane, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    held: &Held<L, ROTORS>,
    state: &mut Motion<L, ROTORS>,
) {
    for i in 0..ROTORS {
        state.rotor_speed[i] =
            lag_start(held.target_speed[i], state.rotor_speed[i], airframe.inverse_lag);
    }
}

/// Rate of the motion without surfaces and effects.
#[inline(always)]
pub fn derivative<L: Lane, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    held: &Held<L, ROTORS>,
    state: &Motion<L, ROTORS>,
) -> Motion<L, ROTORS> {
    let columns = rotation(&state.attitude);
    let air = airflow(state, &held.wind, &columns);
    let mut sum = rotors(airframe, &state.rotor_speed);
    sum.force = minus(&sum.force, &drag(&airframe.linear_drag, airframe.quadratic_drag, &air));
    let rotor_rate = rotor_rates(airframe, held, &state.rotor_speed);
    body_rate(airframe, state, &columns, &sum, rotor_rate)
}

/// Thrust and moment of all rotors.
#[inline(always)]
pub(super) fn rotors<L: Lane, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    speed: &[L; ROTORS],
) -> BodyWrench<L> {
    let none = L::of(0.0);
    let per_square = [&airframe.thrust, &airframe.roll, &airframe.pitch, &airframe.yaw];
    let (thrust, moment) = thrust_and_moment(per_square, speed);
    BodyWrench { force: [none, none, none - thrust], moment }
}

#[inline(always)]
pub(super) fn rotor_rates<L: Lane, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    held: &Held<L, ROTORS>,
    speed: &[L; ROTORS],
) -> [L; ROTORS] {
    let mut rate = *speed;
    for i in 0..ROTORS {
        rate[i] = lag_rate(held.target_speed[i], speed[i], airframe.inverse_lag);
    }
    rate
}

/// What force and moment, body frame, make of the motion.
#[inline(always)]
pub(super) fn body_rate<L: Lane, const ROTORS: usize>(
    airframe: &Airframe<L, ROTORS>,
    state: &Motion<L, ROTORS>,
    columns: &[[L; 3]; 3],
    wrench: &BodyWrench<L>,
    rotor_rate: [L; ROTORS],
) -> Motion<L, ROTORS> {
    let inertia = [&airframe.inertia, &airframe.inertia_inverse];
    Motion {
        position: state.velocity,
        velocity: body::acceleration(columns, &wrench.force, airframe.inverse_mass),
        attitude: body::attitude_rate(&state.attitude, &state.omega),
        omega: body::angular_acceleration(inertia, &state.omega, &wrench.moment),
        rotor_speed: rotor_rate,
    }
}

/// `state + h rate`.
#[inline(always)]
pub fn plus_scaled<L: Lane, const ROTORS: usize>(
    state: &Motion<L, ROTORS>,
    h: L,
    rate: &Motion<L, ROTORS>,
) -> Motion<L, ROTORS> {
    use vector::plus_scaled;
    Motion {
        position: plus_scaled(&state.position, h, &rate.position),
        velocity: plus_scaled(&state.velocity, h, &rate.velocity),
        attitude: plus_scaled(&state.attitude, h, &rate.attitude),
        omega: plus_scaled(&state.omega, h, &rate.omega),
        rotor_speed: plus_scaled(&state.rotor_speed, h, &rate.rotor_speed),
    }
}
