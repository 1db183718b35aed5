//! Forces at the rotors' hubs, where the air comes by in another way than at the centre of mass: the
//! forms `at_rotors` of effects.
//!
//! Each is in proportion to the rotor's speed and to the velocity of the hub through the air,
//! `F_i = -S w_i (v + omega x r_i)`, as blade elements have it for the force in the rotor plane and
//! for what inflow takes of the thrust (Martin and Salaun, ICRA 2010; Bangura and Mahony, 2017). So
//! it damps turning, too. With all rotors at the speed of hover the forces add up to `-n S w_h v`.

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
/// * `slope` - `S` along each axis, N s^2/(m rad)
#[inline(always)]
pub(super) fn wrench<L: Lane>(
    at: &Situation<'_, L>,
    hubs: &[[L; 3]; MAX_ROTORS],
    slope: &[L; 3],
) -> BodyWrench<L> {
    let (mut out, none) = (BodyWrench::zero(), L::of(0.0));
    for (hub, &speed) in hubs.iter().zip(at.rotor_speed) {
        let velocity = plus(&at.flow.velocity, &cross(&at.flow.omega, hub));
        let force = core::array::from_fn(|k| none - slope[k] * speed * velocity[k]);
        out = out.plus(&BodyWrench { force, moment: cross(hub, &force) });
    }
    out
}
