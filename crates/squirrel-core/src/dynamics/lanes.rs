//! The base model on lanes: what moves, what does not change, what is held, and the derivative.
//!
//! The same equations as [`derivative`](super::derivative), for vehicles side by side ([`Row`]) and for derivatives by the state.
//! No closures and no iterators in what runs in steps: code must end up in the function that was compiled for the registers.

use super::State;
use super::body;
use super::rotors::{lag_rate, lag_start, thrust_and_moment};
use crate::aero::{Airflow, BodyWrench, drag};
use crate::lane::vector::{self, dot, minus, rotation, transposed_times};
use crate::lane::{Lane, Register, Row, load, put, store};
use crate::math::Real;
use crate::vehicle::{MAX_ROTORS, Vehicle};

/// Rigid body and rotor speeds, in the units and frames of [`State`]; as a rate, the derivative of each.
#[derive(Debug, Clone, Copy)]
pub struct Motion<L, const ROTORS: usize> {
    /// NED, m.
    pub position: [L; 3],
    /// Over ground, NED, m/s.
    pub velocity: [L; 3],
    /// w x y z.
    pub attitude: [L; 4],
    /// rad/s.
    pub omega: [L; 3],
    /// rad/s; 0 in a place without a rotor.
    pub rotor_speed: [L; ROTORS],
}

/// What does not change in flight, SI.
#[derive(Debug, Clone, Copy)]
pub struct Airframe<L, const ROTORS: usize> {
    /// 1/kg.
    pub inverse_mass: L,
    /// By columns, kg m^2.
    pub inertia: [[L; 3]; 3],
    /// Its inverse.
    pub inertia_inverse: [[L; 3]; 3],
    /// Along each axis, N s/m.
    pub linear_drag: [L; 3],
    /// `1/2 rho C_d A`.
    pub quadratic_drag: L,
    /// Thrust of each rotor over its speed squared, N s^2.
    pub thrust: [L; ROTORS],
    /// Roll moment of each, likewise, N m s^2.
    pub roll: [L; ROTORS],
    /// Pitch moment.
    pub pitch: [L; ROTORS],
    /// Yaw moment.
    pub yaw: [L; ROTORS],
    /// Inverse time constants of rotor speed, speeding up and slowing down, 1/s; 0 for no lag.
    pub inverse_lag: [L; 2],
}

/// What is held from call to call.
#[derive(Debug, Clone, Copy)]
pub struct Held<L, const ROTORS: usize> {
    /// Velocity of the air, NED, m/s, without what effects add to it.
    pub wind: [L; 3],
    /// Steady speeds that the rotors move towards, rad/s.
    pub target_speed: [L; ROTORS],
}

impl<T: Real, const ROTORS: usize> Airframe<T, ROTORS> {
    /// Of the first rotors of a vehicle.
    ///
    /// * `extra_time_constant_s` - on top of the vehicle's own, speeding up and slowing down
    pub fn new(vehicle: &Vehicle<T>, extra_time_constant_s: [T; 2]) -> Self {
        const { assert!(ROTORS >= 1 && ROTORS <= MAX_ROTORS) };
        let (p, per_square) = (vehicle.parameters(), vehicle.rotor_wrench_per_speed_squared());
        let [up, down] = extra_time_constant_s;
        let inverse = |tau: T| if tau > T::zero() { T::one() / tau } else { T::zero() };
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
            inverse_lag: [
                inverse(p.propulsion.time_constant_up_s + up),
                inverse(p.propulsion.time_constant_down_s + down),
            ],
        }
    }
}

impl<X: Copy, const ROTORS: usize> Airframe<X, ROTORS> {
    /// The same numbers in another form.
    pub fn map<Y>(&self, f: impl Fn(X) -> Y) -> Airframe<Y, ROTORS> {
        Airframe {
            inverse_mass: f(self.inverse_mass),
            inertia: self.inertia.map(|column| column.map(&f)),
            inertia_inverse: self.inertia_inverse.map(|column| column.map(&f)),
            linear_drag: self.linear_drag.map(&f),
            quadratic_drag: f(self.quadratic_drag),
            thrust: self.thrust.map(&f),
            roll: self.roll.map(&f),
            pitch: self.pitch.map(&f),
            yaw: self.yaw.map(&f),
            inverse_lag: self.inverse_lag.map(&f),
        }
    }
}

impl<S: Copy, const ROTORS: usize> Airframe<Row<S>, ROTORS> {
    /// Puts the numbers of a vehicle into column `lane`.
    pub fn put(&mut self, lane: usize, airframe: &Airframe<S, ROTORS>) {
        self.inverse_mass[lane] = airframe.inverse_mass;
        for column in 0..3 {
            put(&mut self.inertia[column], lane, airframe.inertia[column]);
            put(&mut self.inertia_inverse[column], lane, airframe.inertia_inverse[column]);
        }
        put(&mut self.linear_drag, lane, airframe.linear_drag);
        self.quadratic_drag[lane] = airframe.quadratic_drag;
        put(&mut self.thrust, lane, airframe.thrust);
        put(&mut self.roll, lane, airframe.roll);
        put(&mut self.pitch, lane, airframe.pitch);
        put(&mut self.yaw, lane, airframe.yaw);
        put(&mut self.inverse_lag, lane, airframe.inverse_lag);
    }
}

impl<T: Real, const ROTORS: usize> From<&State<T>> for Motion<T, ROTORS> {
    fn from(state: &State<T>) -> Self {
        let q = &state.attitude;
        Self {
            position: state.position.vector.into(),
            velocity: state.velocity.vector.into(),
            attitude: [q.w, q.i, q.j, q.k],
            omega: state.omega.vector.into(),
            rotor_speed: core::array::from_fn(|i| state.rotor_speed_rad_s[i]),
        }
    }
}

#[inline(always)]
fn load_columns<L: Register>(rows: &[[Row<L::Element>; 3]; 3], start: usize) -> [[L; 3]; 3] {
    [load(&rows[0], start), load(&rows[1], start), load(&rows[2], start)]
}

impl<L: Register, const ROTORS: usize> Motion<L, ROTORS> {
    /// Registers from column `start` and on.
    #[inline(always)]
    pub fn load(rows: &Motion<Row<L::Element>, ROTORS>, start: usize) -> Self {
        Self {
            position: load(&rows.position, start),
            velocity: load(&rows.velocity, start),
            attitude: load(&rows.attitude, start),
            omega: load(&rows.omega, start),
            rotor_speed: load(&rows.rotor_speed, start),
        }
    }

    /// Registers to column `start` and on.
    #[inline(always)]
    pub fn store(&self, rows: &mut Motion<Row<L::Element>, ROTORS>, start: usize) {
        store(&self.position, &mut rows.position, start);
        store(&self.velocity, &mut rows.velocity, start);
        store(&self.attitude, &mut rows.attitude, start);
        store(&self.omega, &mut rows.omega, start);
        store(&self.rotor_speed, &mut rows.rotor_speed, start);
    }
}

impl<L: Register, const ROTORS: usize> Airframe<L, ROTORS> {
    /// Registers from column `start` and on.
    #[inline(always)]
    pub fn load(rows: &Airframe<Row<L::Element>, ROTORS>, start: usize) -> Self {
        Self {
            inverse_mass: L::load(&rows.inverse_mass[start..]),
            inertia: load_columns(&rows.inertia, start),
            inertia_inverse: load_columns(&rows.inertia_inverse, start),
            linear_drag: load(&rows.linear_drag, start),
            quadratic_drag: L::load(&rows.quadratic_drag[start..]),
            thrust: load(&rows.thrust, start),
            roll: load(&rows.roll, start),
            pitch: load(&rows.pitch, start),
            yaw: load(&rows.yaw, start),
            inverse_lag: load(&rows.inverse_lag, start),
        }
    }
}

impl<L: Register, const ROTORS: usize> Held<L, ROTORS> {
    /// Registers from column `start` and on.
    #[inline(always)]
    pub fn load(rows: &Held<Row<L::Element>, ROTORS>, start: usize) -> Self {
        Self { wind: load(&rows.wind, start), target_speed: load(&rows.target_speed, start) }
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
        state.rotor_speed[i] = lag_start(held.target_speed[i], state.rotor_speed[i], airframe.inverse_lag);
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
