//! Induced speed of a rotor: how fast it blows, by momentum theory (Glauert 1935; Leishman,
//! Principles of Helicopter Aerodynamics, ch. 2).
//!
//! ```text
//! v_h^2 = T / (2 rho pi R^2)                    in hover
//! v_i sqrt(V_a^2 + (V_c + v_i)^2) = v_h^2       V_a across the disc, V_c the climb through it
//! ```
//! Two steps of Newton's method from `v_h^2 / sqrt(V_a^2 + l^2)`, with `l = V_c / 2 + sqrt(V_c^2 /
//! 4 + v_h^2)`, which is exact on both axes: within 0.2 % in level flight and climb, 2 % in a
//! descent. Momentum theory ends where a rotor sinks into its own wake: the climb does not count
//! below `-v_h`.

use crate::lane::Lane;
use crate::math::{AIR_DENSITY_KG_M3, Real, real, sqrt};
use crate::vehicle::Vehicle;

/// Stands for 0 where a division must stay finite, m^2/s^2.
const TINY: f64 = 1e-12;

/// `1 / (2 rho pi R^2)`: times a thrust, N, it is the square of the induced speed in hover.
#[inline(always)]
pub fn per_thrust<L: Lane>(propeller_radius_m: L) -> L {
    L::of(0.5 / (AIR_DENSITY_KG_M3 * core::f64::consts::PI))
        / (propeller_radius_m * propeller_radius_m)
}

/// Induced speed at the disc, m/s; 0 for a rotor without thrust.
///
/// * `hover_squared` - `v_h^2`, m^2/s^2, see [`per_thrust`]
/// * `across_squared` - square of the airspeed across the disc, m^2/s^2
/// * `climb` - airspeed through the disc against the jet, m/s; negative in a descent
#[inline(always)]
pub fn speed<L: Lane>(hover_squared: L, across_squared: L, climb: L) -> L {
    let none = L::of(0.0);
    let square = hover_squared.upper(none) + L::of(TINY);
    let climb = climb.upper(none - square.root());
    let half = L::of(0.5) * climb;
    let through = half + (half * half + square).root();
    let mut v = square / (across_squared + through * through).root();
    for _ in 0..2 {
        // f = v^2 (V_a^2 + (V_c + v)^2) - v_h^4
        let through = climb + v;
        let flow = across_squared + through * through;
        let slope = L::of(2.0) * v * (flow + v * through);
        v = v - (v * v * flow - square * square) / slope;
    }
    (hover_squared - L::of(TINY)).where_positive(v, none)
}

/// Of a vehicle's rotors in hover, m/s.
pub fn in_hover<T: Real>(vehicle: &Vehicle<T>) -> T {
    let p = vehicle.parameters();
    let share_n = vehicle.weight_n() / real(p.rotor_count as f64);
    sqrt(share_n * per_thrust(p.propulsion.propeller_radius_m))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residual of the equation, relative.
    fn residual(square: f64, across: f64, climb: f64) -> f64 {
        let v = speed(square, across * across, climb);
        let climb = climb.max(-square.sqrt());
        v * (across * across + (climb + v) * (climb + v)).sqrt() / square - 1.0
    }

    #[test]
    fn momentum_is_the_thrust_in_hover_climb_descent_and_forward_flight() {
        for across in [0.0, 1.0, 3.0, 6.5, 10.0, 20.0] {
            for climb in [-6.5, -3.0, 0.0, 3.0, 8.0] {
                let off = residual(6.5 * 6.5, across, climb);
                let bar = if climb < 0.0 { 2e-2 } else { 2e-3 };
                assert!(off.abs() < bar, "{across} m/s across, {climb} m/s up: {off}");
            }
        }
        let hover: f64 = speed(1.344 * per_thrust(0.0635), 0.0, 0.0);
        assert!((hover - 6.58).abs() < 0.01, "a fourth of 5.4 N over a 5 inch disc: {hover}");
    }

    #[test]
    fn a_rotor_without_thrust_blows_nothing() {
        for thrust in [0.0, -1.0] {
            assert_eq!(speed(thrust, 49.0, 1.0), 0.0);
            assert_eq!(speed(thrust, 0.0, -3.0), 0.0);
        }
        assert!(speed(1e-9_f64, 0.0, 0.0).is_finite());
    }
}
