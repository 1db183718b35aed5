//! The base model: rotors, drag and a rigid body (paper, eq. 3), integrated by RK4.
//!
//! ```text
//! r'' = g e3 + R f / m            f = rotors + drag + surfaces + effects, body frame
//! w'  = J^-1 (M - w x J w)        q' = 1/2 q (0, w)        Omega_i' = (Omega_target,i - Omega_i) / tau
//! ```
//! Air enters only through the air-relative velocity `R^T (v - wind)` (the paper writes the ground
//! velocity; docs/equations.md T6). Wings are a caller's closure, because their own states belong
//! to the plant.

pub mod battery;
pub mod body;
pub mod lanes;
mod rk4;
pub mod rotors;
pub mod servo;
mod state;
pub mod whole;

pub use rk4::{Stages, VectorSpace, rk4, runge_kutta};
pub use rotors::RotorDrive;
pub use state::State;

use crate::aero::{self, Air, Airflow, BodyWrench, flat_plate};
use crate::effects::{Acting, Effects, Prepared, Present, Situation, Tether};
use crate::frames::{Body, In, Ned, Wrench};
use crate::lane::Lane;
use crate::lane::vector::{cross, plus, rotation, times, transposed_times};
use crate::math::{GRAVITY_M_S2, Real};
use crate::vehicle::{MAX_ROTORS, Vehicle};
use nalgebra::{Matrix3, Vector3};

/// Motion of the airframe through the air.
///
/// * `wind` - velocity of the air, m/s
/// * `air_omega` - its angular velocity, rad/s, where it turns
#[inline(always)]
pub fn air<T: Real>(state: &State<T>, wind: In<Ned, T>, air_omega: Option<In<Ned, T>>) -> Air<T> {
    air_in(state, wind, air_omega, &rotation_matrix(state))
}

#[inline(always)]
fn air_in<T: Real>(
    state: &State<T>,
    wind: In<Ned, T>,
    air_omega: Option<In<Ned, T>>,
    ned_from_body: &Matrix3<T>,
) -> Air<T> {
    let relative_ned = (state.velocity - wind).vector;
    // The norm is that of the body velocity too; taken before the rotation, its root does not wait
    // for it.
    Air {
        velocity: In::new(ned_from_body.tr_mul(&relative_ned)),
        speed: relative_ned.norm(),
        omega: match air_omega {
            None => state.omega,
            Some(air_omega) => state.omega - In::new(ned_from_body.tr_mul(&air_omega.vector)),
        },
    }
}

/// The attitude as a matrix: two products with it cost less, and wait less, than two with the
/// quaternion.
#[inline(always)]
fn rotation_matrix<T: Real>(state: &State<T>) -> Matrix3<T> {
    Matrix3::from(rotation(&state.attitude_wxyz()))
}

/// Base drag of the airframe, body frame: `F = -(D v + 1/2 rho C_d A |v| v)`.
#[inline(always)]
pub fn drag<T: Real>(vehicle: &Vehicle<T>, air: &Air<T>) -> In<Body, T> {
    let drag = &vehicle.parameters().drag;
    let flow = Airflow::from(air);
    -In::new(Vector3::from(aero::drag(&drag.linear_n_s_per_m.into(), drag.per_square(), &flow)))
}

/// What is held over a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held<T: Real> {
    /// Rotor targets and lags.
    pub drive: RotorDrive<T>,
    /// Wind velocity, m/s, without what effects add to it.
    pub wind: In<Ned, T>,
    /// Angular velocity of the air, rad/s, where it turns.
    pub air_omega: Option<In<Ned, T>>,
    /// Deployment of the left and the right wing, 0..1; for effects on wings.
    pub deployment: [T; 2],
    /// A load at the centre of mass; acts only where there are effects.
    pub tether: Option<Tether<T>>,
}

impl<T: Real> Held<T> {
    /// Nothing but rotors, in air that stands still.
    pub fn in_still_air(drive: RotorDrive<T>) -> Self {
        Self { drive, wind: In::zero(), air_omega: None, deployment: [T::zero(); 2], tether: None }
    }
}

/// Force and moment on the airframe without gravity, body frame.
///
/// * `vehicle` - with what effects change once, see
///   [`Effects::alter`](crate::effects::Effects::alter)
/// * `effects` - of this vehicle
/// * `surfaces` - wrench of the wings for a given motion through the air
#[inline(always)]
pub fn wrench<T: Real>(
    vehicle: &Vehicle<T>,
    effects: &Acting<T>,
    state: &State<T>,
    held: &Held<T>,
    surfaces: impl FnOnce(&Air<T>) -> Wrench<Body, T>,
) -> Wrench<Body, T> {
    let ned_from_body = rotation_matrix(state);
    let wind = total_wind(effects, state, held.wind);
    let air = air_in(state, wind, held.air_omega, &ned_from_body);
    wrench_in(vehicle, effects, state, held, &air, &ned_from_body, surfaces)
}

#[inline(always)]
fn wrench_in<T: Real>(
    vehicle: &Vehicle<T>,
    effects: &Acting<T>,
    state: &State<T>,
    held: &Held<T>,
    air: &Air<T>,
    ned_from_body: &Matrix3<T>,
    surfaces: impl FnOnce(&Air<T>) -> Wrench<Body, T>,
) -> Wrench<Body, T> {
    let rotors = rotors::wrench(vehicle, &state.rotor_speed_rad_s);
    let wings = surfaces(air);
    let rest = Wrench::from_force(drag(vehicle, air)) + wings;
    if !effects.any() {
        return rotors + rest;
    }
    // Copies, so that without effects nothing here needs an address and all of it stays in
    // registers.
    let (state, air, ned_from_body) = (*state, *air, *ned_from_body);
    affected(vehicle, effects, &state, held, &air, &ned_from_body, [rotors, rest, wings])
}

/// The wrench of `[rotors, rest, wings]`, the wings a part of the rest, with everything that effects
/// do to it.
#[inline(never)]
fn affected<T: Real>(
    vehicle: &Vehicle<T>,
    effects: &Acting<T>,
    state: &State<T>,
    held: &Held<T>,
    air: &Air<T>,
    ned_from_body: &Matrix3<T>,
    wrenches: [Wrench<Body, T>; 3],
) -> Wrench<Body, T> {
    let (present, numbers) = (effects.present(), effects.numbers());
    let speed = &state.rotor_speed_rad_s;
    let rotor_spin = if Prepared::<T>::feel_rotor_spin(present) {
        let signs = rotors::spin_signs(vehicle);
        [*speed, held.drive.rates(vehicle.rotor_blocks(), speed)]
            .map(|all| rotors::spin(&signs, &all))
    } else {
        [T::zero(); 2]
    };
    let none = flat_plate::Pair::all(T::zero());
    let at = Surroundings {
        flow: &Airflow::from(air),
        omega: &state.omega.vector.into(),
        ned_from_body: &(*ned_from_body).into(),
        height_m: -state.position.vector.z,
        inverse_mass: vehicle.inverse_mass(),
        rotor_spin,
        wing_force: wrenches[2].force.vector.into(),
        rotor_speed: &speed[..vehicle.parameters().rotor_count.min(MAX_ROTORS)],
        wings: &vehicle.parameters().wing.as_ref().map_or(none, flat_plate::Pair::new),
        deployment: held.deployment,
        tether: held.tether,
    };
    let [rotors, rest, _] = wrenches.map(BodyWrench::from);
    with_effects(numbers, present, [&rotors, &rest], &at).into()
}

/// What effects may look at in a step.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a, L: Lane> {
    /// Motion through the air.
    pub flow: &'a Airflow<L>,
    /// Angular rate of the airframe, rad/s, whether the air turns or not.
    pub omega: &'a [L; 3],
    /// By columns.
    pub ned_from_body: &'a [[L; 3]; 3],
    /// Above the origin's level, m.
    pub height_m: L,
    /// 1/kg.
    pub inverse_mass: L,
    /// Sum of the rotor speeds about +z, rad/s, and its rate, rad/s^2, where an effect feels them.
    pub rotor_spin: [L; 2],
    /// Speed of each rotor, rad/s.
    pub rotor_speed: &'a [L],
    /// Force of the wings that fly, body frame, N.
    pub wing_force: [L; 3],
    /// The flat wings that the vehicle declares.
    pub wings: &'a flat_plate::Pair<L>,
    /// Left and right, 0..1.
    pub deployment: [L; 2],
    /// A load at the centre of mass.
    pub tether: Option<Tether<L>>,
}

/// The wrench of `[rotors, rest]` with everything that effects do to it.
#[inline(always)]
pub fn with_effects<L: Lane>(
    numbers: &Prepared<L>,
    present: Present,
    [rotors, rest]: [&BodyWrench<L>; 2],
    at: &Surroundings<'_, L>,
) -> BodyWrench<L> {
    let factor = numbers.thrust_factor(present, at.flow, at.height_m);
    let ([x, y, z], [roll, pitch, yaw]) = (rotors.force, rotors.moment);
    let lifted = BodyWrench {
        force: [x * factor, y * factor, z * factor],
        moment: [roll * factor, pitch * factor, yaw],
    };
    let base = lifted.plus(rest);
    let mut sum = base.plus(&numbers.wrench(
        present,
        &Situation {
            flow: at.flow,
            omega: at.omega,
            thrust_n: L::of(0.0) - lifted.force[2],
            rotor_speed: at.rotor_speed,
            thrust_factor: factor,
            force: base.force,
            rotor_spin: at.rotor_spin,
            wing_force: at.wing_force,
            wings: at.wings,
            deployment: at.deployment,
        },
    ));
    if let Some(tether) = &at.tether {
        let pull = tether.force(&times(at.ned_from_body, &sum.force), at.inverse_mass);
        sum.force = plus(&sum.force, &transposed_times(at.ned_from_body, &pull));
    }
    if present.has_added_mass() {
        let added_mass_kg = numbers.added_mass_kg(present);
        let gravity_z = at.ned_from_body[2][2] * L::of(GRAVITY_M_S2);
        // The body axes turn beneath the velocity through the air, at the airframe's own rate:
        // what the air's rotation adds to the wind at the centre of mass is the wind's to say.
        let turning = cross(at.omega, &at.flow.velocity)[2];
        let rate = (sum.force[2] * at.inverse_mass + gravity_z - turning)
            / (L::of(1.0) + added_mass_kg * at.inverse_mass);
        sum.force[2] = sum.force[2] - added_mass_kg * rate;
    }
    sum
}

/// Wind with what effects add to it where the vehicle is, m/s.
#[inline(always)]
pub fn total_wind<T: Real>(effects: &Acting<T>, state: &State<T>, wind: In<Ned, T>) -> In<Ned, T> {
    if effects.any() { wind + wind_of(effects, -state.position.vector.z) } else { wind }
}

#[inline(never)]
fn wind_of<T: Real>(effects: &Acting<T>, height_m: T) -> In<Ned, T> {
    let [north, east] = effects.numbers().wind(effects.present(), height_m);
    In::new(Vector3::new(north, east, T::zero()))
}

/// Time derivative of the state: each field of the result is the rate of the field of the same
/// name.
///
/// * arguments as in [`wrench`]
#[inline(always)]
pub fn derivative<T: Real>(
    vehicle: &Vehicle<T>,
    effects: &Acting<T>,
    state: &State<T>,
    held: &Held<T>,
    surfaces: impl FnOnce(&Air<T>) -> Wrench<Body, T>,
) -> State<T> {
    let ned_from_body = rotation_matrix(state);
    let wind = total_wind(effects, state, held.wind);
    let air = air_in(state, wind, held.air_omega, &ned_from_body);
    let wrench = wrench_in(vehicle, effects, state, held, &air, &ned_from_body, surfaces);
    let columns = ned_from_body.into();
    let acceleration =
        body::acceleration(&columns, &wrench.force.vector.into(), vehicle.inverse_mass());
    State {
        position: state.velocity,
        velocity: In::new(Vector3::from(acceleration)),
        attitude: state.attitude_rate(),
        omega: angular_acceleration(vehicle, state.omega, &wrench),
        rotor_speed_rad_s: held.drive.rates(vehicle.rotor_blocks(), &state.rotor_speed_rad_s),
    }
}

/// Angular acceleration, rad/s^2: `J^-1 (M - w x J w)`.
///
/// * `omega` - angular rate, rad/s
#[inline(always)]
pub fn angular_acceleration<T: Real>(
    vehicle: &Vehicle<T>,
    omega: In<Body, T>,
    wrench: &Wrench<Body, T>,
) -> In<Body, T> {
    let columns: [[[T; 3]; 3]; 2] =
        [vehicle.parameters().inertia_kg_m2.into(), (*vehicle.inertia_inverse()).into()];
    let moment = wrench.moment.vector.into();
    let rate =
        body::angular_acceleration([&columns[0], &columns[1]], &omega.vector.into(), &moment);
    In::new(Vector3::from(rate))
}

/// What an accelerometer reads without noise, m/s^2: `f / m + w' x r + w x (w x r)`, with `r` from
/// the centre of mass, on which the state and the wrench are, to the accelerometer.
///
/// * `omega` - angular rate, rad/s
#[inline(always)]
pub fn specific_force<T: Real>(
    vehicle: &Vehicle<T>,
    effects: &Effects<T>,
    omega: In<Body, T>,
    wrench: &Wrench<Body, T>,
) -> In<Body, T> {
    let centre = wrench.force * vehicle.inverse_mass();
    if !effects.any() {
        return centre;
    }
    let omega_dot = angular_acceleration(vehicle, omega, wrench).vector.into();
    let place_m = effects.accelerometer_position().vector.into();
    let rates = [&omega.vector.into(), &omega_dot];
    In::new(Vector3::from(body::specific_force(&centre.vector.into(), rates, &place_m)))
}

#[cfg(test)]
mod tests;
