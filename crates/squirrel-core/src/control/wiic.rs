//! Wing-informed integration controller (WIIC): the angle stays at its limit, thrust makes the
//! motion.
//!
//! Paper, eq. 8, pitch at its limit: `pitch_d = pitch_max`, `U = -(m / pitch_max)(a_x - f_x / m)`,
//! `roll_d = (m / U)(a_y - f_y / m)`. Printed for one sign and zero yaw only. Here, in the heading
//! frame (docs/equations.md T9):
//!
//! - [`ThrustLaw::Literal`]: the printed law with the sign of the request, and its twin for roll.
//! - [`ThrustLaw::Exact`]: pitch case `A = -m(a_x - f_x/m) / (s sin(pitch_max))`,
//!   `B = m(a_y - f_y/m)`, `U = sqrt(A^2 + B^2)`, `roll = atan2(B, A)`; roll case
//!   `U = B / (s sin(roll_max))`, `sin(pitch) = -m(a_x - f_x/m) / (U cos(roll_max))`.
//!
//! Both leave height to itself, as the paper does. Where both angles are beyond their limit, the
//! one further beyond is held and the other clamped. Thrust ends in `[U_min, U_max]`; a demand that
//! the wings already exceed asks for `U_min`.

use super::AttitudeThrust;
use crate::math::{cos, limit, sin, upper};
use nalgebra::Vector2;

/// Small-angle law as printed, or the exact inverse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ThrustLaw {
    /// As printed in the paper.
    Literal,
    /// Without small angles.
    Exact,
}

/// Limits that the law works within.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Envelope {
    /// Limit of |roll| and |pitch|, rad.
    pub tilt_max_rad: f32,
    /// Smallest collective thrust, N, > 0.
    pub thrust_min_n: f32,
    /// Largest collective thrust, N.
    pub thrust_max_n: f32,
}

impl Envelope {
    /// The nearest command inside.
    pub fn limit(&self, wanted: &AttitudeThrust) -> AttitudeThrust {
        let angle = |x: f32| limit(x, -self.tilt_max_rad, self.tilt_max_rad);
        AttitudeThrust {
            roll_rad: angle(wanted.roll_rad),
            pitch_rad: angle(wanted.pitch_rad),
            thrust_n: limit(wanted.thrust_n, self.thrust_min_n, self.thrust_max_n),
        }
    }
}

/// Angles and thrust that give the acceleration with one angle at its limit.
///
/// * `acceleration` - command, forward and right in the heading frame, m/s^2
/// * `force` - aerodynamic force as if spread, same frame, N
/// * `request` - what the position loop asks for; says which angle is beyond its limit and on which
///   side
pub fn command(
    law: ThrustLaw,
    mass_kg: f32,
    acceleration: Vector2<f32>,
    force: Vector2<f32>,
    request: &AttitudeThrust,
    envelope: &Envelope,
) -> AttitudeThrust {
    // What thrust has to give: forward and right, N.
    let need = acceleration * mass_kg - force;
    let max = envelope.tilt_max_rad;
    let thrust_range = |u: f32| limit(u, envelope.thrust_min_n, envelope.thrust_max_n);
    let angle_range = |a: f32| limit(a, -max, max);
    if request.pitch_rad.abs() >= request.roll_rad.abs() {
        let sign = if request.pitch_rad < 0.0 { -1.0 } else { 1.0 };
        let (thrust_n, roll_rad) = match law {
            ThrustLaw::Literal => {
                let u = thrust_range(-need.x / (sign * max));
                (u, need.y / u)
            }
            ThrustLaw::Exact => {
                let a = -need.x / (sign * sin(max));
                let u = if a > 0.0 {
                    thrust_range(libm::hypotf(a, need.y))
                } else {
                    envelope.thrust_min_n
                };
                (
                    u,
                    if a > 0.0 {
                        libm::atan2f(need.y, a)
                    } else {
                        libm::asinf(limit(need.y / u, -1.0, 1.0))
                    },
                )
            }
        };
        AttitudeThrust { roll_rad: angle_range(roll_rad), pitch_rad: sign * max, thrust_n }
    } else {
        let sign = if request.roll_rad < 0.0 { -1.0 } else { 1.0 };
        let (thrust_n, pitch_rad) = match law {
            ThrustLaw::Literal => {
                let u = thrust_range(need.y / (sign * max));
                (u, -need.x / u)
            }
            ThrustLaw::Exact => {
                let u = thrust_range(need.y / (sign * sin(max)));
                let forward = upper(u * cos(max), 1e-6);
                (u, libm::asinf(limit(-need.x / forward, -1.0, 1.0)))
            }
        };
        AttitudeThrust { roll_rad: sign * max, pitch_rad: angle_range(pitch_rad), thrust_n }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Body, In, Ned, Rotation};
    use nalgebra::Vector3;
    use proptest::prelude::*;

    const MASS_KG: f32 = 0.548;

    fn envelope(tilt_max_rad: f32) -> Envelope {
        Envelope { tilt_max_rad, thrust_min_n: 0.1, thrust_max_n: 50.0 }
    }

    /// Horizontal force of the thrust at an attitude, heading frame.
    fn thrust_force(c: &AttitudeThrust) -> Vector2<f32> {
        let ned_from_body = Rotation::<Ned, Body, f32>::from_euler(c.roll_rad, c.pitch_rad, 0.0);
        (ned_from_body * In::new(Vector3::new(0.0, 0.0, -c.thrust_n))).vector.xy()
    }

    proptest! {
        /// Thrust and wings together give the commanded horizontal acceleration, wherever nothing
        /// is clamped.
        #[test]
        fn the_exact_law_gives_the_commanded_motion(
            ax in 2.0..8.0f32, ay in -3.0..3.0f32, fx in -0.5..0.5f32, fy in -0.5..0.5f32,
            signs in (any::<bool>(), any::<bool>()), roll_case in any::<bool>(),
        ) {
            let sign = |b: bool| if b { 1.0 } else { -1.0 };
            let (mut a, mut f) = (Vector2::new(sign(signs.0) * ax, ay), Vector2::new(fx, fy));
            let mut request = AttitudeThrust { roll_rad: 0.0, pitch_rad: -a.x, thrust_n: 5.0 };
            if roll_case {
                a = Vector2::new(ay, sign(signs.1) * ax);
                f = Vector2::new(fy, fx);
                request = AttitudeThrust { roll_rad: a.y, pitch_rad: 0.0, thrust_n: 5.0 };
            }
            let c = command(ThrustLaw::Exact, MASS_KG, a, f, &request, &envelope(0.6));
            prop_assume!(c.roll_rad.abs() < 0.6 || c.pitch_rad.abs() < 0.6);
            let got = (thrust_force(&c) + f) / MASS_KG;
            prop_assert!((got - a).norm() < 2e-3, "{got} for {a}");
        }

        #[test]
        fn limits_hold_whatever_comes_in(
            ax in -50.0..50.0f32, ay in -50.0..50.0f32, fx in -20.0..20.0f32, fy in -20.0..20.0f32,
            roll in -3.0..3.0f32, pitch in -3.0..3.0f32, literal in any::<bool>(),
        ) {
            let law = if literal { ThrustLaw::Literal } else { ThrustLaw::Exact };
            let request = AttitudeThrust { roll_rad: roll, pitch_rad: pitch, thrust_n: 5.0 };
            let e = Envelope { tilt_max_rad: 0.52, thrust_min_n: 0.5, thrust_max_n: 10.0 };
            let c = command(law, MASS_KG, Vector2::new(ax, ay), Vector2::new(fx, fy), &request, &e);
            prop_assert!((0.5..=10.0).contains(&c.thrust_n), "{c:?}");
            prop_assert!(c.roll_rad.abs() <= 0.52 && c.pitch_rad.abs() <= 0.52, "{c:?}");
        }
    }

    /// The printed law is the exact one to first order: halving every angle quarters the relative
    /// difference in thrust.
    #[test]
    fn literal_and_exact_agree_to_first_order() {
        let difference = |scale: f32| {
            let (a, f) = (Vector2::new(-6.0, 1.0) * scale, Vector2::new(-0.4, 0.1) * scale);
            let request = AttitudeThrust { roll_rad: 0.1 * scale, pitch_rad: scale, thrust_n: 5.0 };
            let e = envelope(0.5 * scale);
            let literal = command(ThrustLaw::Literal, MASS_KG, a, f, &request, &e);
            let exact = command(ThrustLaw::Exact, MASS_KG, a, f, &request, &e);
            assert_eq!(literal.pitch_rad, exact.pitch_rad);
            (literal.thrust_n / exact.thrust_n - 1.0).abs()
        };
        let (whole, half) = (difference(0.8), difference(0.4));
        assert!(whole > 1e-4, "the laws differ at large angles");
        assert!((3.0..5.0).contains(&(whole / half)), "{whole} {half}");
    }

    #[test]
    fn as_printed_for_the_paper_s_case() {
        // theta_d = +theta_max, a_cmd,x < 0, zero yaw: eq. 8 with numbers.
        let request = AttitudeThrust { roll_rad: 0.0, pitch_rad: 0.9, thrust_n: 5.0 };
        let max = core::f32::consts::FRAC_PI_6;
        let c = command(
            ThrustLaw::Literal,
            MASS_KG,
            Vector2::new(-8.0, 1.0),
            Vector2::new(-1.2, 0.2),
            &request,
            &envelope(max),
        );
        let thrust = -(MASS_KG / max) * (-8.0 + 1.2 / MASS_KG);
        assert!((c.thrust_n - thrust).abs() < 1e-5);
        assert!((c.roll_rad - (MASS_KG / thrust) * (1.0 - 0.2 / MASS_KG)).abs() < 1e-6);
    }

    #[test]
    fn wings_that_exceed_the_demand_leave_minimum_thrust() {
        let request = AttitudeThrust { roll_rad: 0.0, pitch_rad: 0.9, thrust_n: 5.0 };
        for law in [ThrustLaw::Literal, ThrustLaw::Exact] {
            let c = command(
                law,
                MASS_KG,
                Vector2::new(-2.0, 0.0),
                Vector2::new(-3.0, 0.0),
                &request,
                &envelope(0.52),
            );
            assert_eq!(c.thrust_n, 0.1);
        }
    }
}
