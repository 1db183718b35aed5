//! What acts at the rotors' hubs, where the air comes by in another way than at the centre of mass:
//! the forms `at_rotors` of effects.
//!
//! Blade elements of fixed pitch have a force in the rotor plane, a loss of thrust to inflow and a
//! flapping moment that go with the rotor's speed and the velocity of its hub through the air,
//! `F_i = -S w_i (v + omega x r_i)`, and a lift that goes with the square of that velocity (Martin
//! and Salaun, ICRA 2010; Bangura and Mahony, 2017). So they damp turning, too. With all rotors at
//! the speed of hover and nothing turning they add up to the standard forms.

use super::Situation;
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::lane::vector::{cross, plus};
use crate::math::{Real, sqrt};
use crate::vehicle::{MAX_ROTORS, Vehicle};

/// Where the hubs are, from the centre of mass, m; zero for what is no rotor.
pub(super) fn hubs<T: Real>(vehicle: &Vehicle<T>) -> [[T; 3]; MAX_ROTORS] {
    let mut out = [[T::zero(); 3]; MAX_ROTORS];
    for (hub, rotor) in out.iter_mut().zip(vehicle.rotors()) {
        *hub = rotor.position.vector.into();
    }
    out
}

/// 1 over the sum of the rotor speeds in hover, s/rad.
pub(super) fn per_hover<T: Real>(vehicle: &Vehicle<T>) -> T {
    let per_square = &vehicle.rotor_wrench_per_speed_squared().thrust;
    let (mut count, mut thrust) = (T::zero(), T::zero());
    for (_, one) in vehicle.rotors().iter().zip(per_square) {
        count += T::one();
        thrust += *one;
    }
    sqrt(thrust / vehicle.weight_n()) / count
}

/// The wrench of all of them.
///
/// * `one` - force and moment of a rotor at its hub, of its speed, rad/s, and of the hub's velocity
///   through the air, m/s
#[inline(always)]
pub(super) fn wrench<L: Lane>(
    at: &Situation<'_, L>,
    hubs: &[[L; 3]; MAX_ROTORS],
    one: impl Fn(L, [L; 3]) -> BodyWrench<L>,
) -> BodyWrench<L> {
    let mut out = BodyWrench::zero();
    for (hub, &speed) in hubs.iter().zip(at.rotor_speed) {
        let velocity = plus(&at.flow.velocity, &cross(&at.flow.omega, hub));
        let BodyWrench { force, moment } = one(speed, velocity);
        out = out.plus(&BodyWrench { force, moment: plus(&moment, &cross(hub, &force)) });
    }
    out
}

/// The wrench of forces `-S w_i v_i`.
///
/// * `slope` - `S` along each axis, N s^2/(m rad)
#[inline(always)]
pub(super) fn drag<L: Lane>(
    at: &Situation<'_, L>,
    hubs: &[[L; 3]; MAX_ROTORS],
    slope: &[L; 3],
) -> BodyWrench<L> {
    wrench(at, hubs, |speed, velocity| {
        let pull = core::array::from_fn(|k| L::of(0.0) - slope[k] * speed * velocity[k]);
        BodyWrench::from_force(pull)
    })
}
