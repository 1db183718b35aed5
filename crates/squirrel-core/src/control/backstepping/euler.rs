//! Integral backstepping in Euler angles.
//!
//! Source: Bouabdallah and Siegwart 2007, the law that the paper's section III.A names; derivation
//! in docs/equations.md B.1, B.2. Differs from the source: the exact kinematics `omega = E rate`
//! replace "body rate = angle rate", so that the closed loop is `angle'' = nu` for any angles below
//! 90 deg of pitch and the Lyapunov proof holds there.
//!
//! ```text
//! e1 = angle_d - angle          e2 = c1 e1 + rate_d + lambda chi - rate          chi' = e1
//! nu = (1 - c1^2 + lambda) e1 + (c1 + c2) e2 - c1 lambda chi + acceleration_d
//! torque = w x J w + J (E nu + E' rate)
//! V = 1/2 (lambda chi^2 + e1^2 + e2^2),   V' = -c1 e1^2 - c2 e2^2
//! ```

use super::Tilt;
use crate::math::{Real, real};
use nalgebra::{Matrix3, Vector3};

/// Gains, roll, pitch, yaw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law<T: Real> {
    /// 1/s.
    pub c1: Vector3<T>,
    /// 1/s.
    pub c2: Vector3<T>,
    /// 1/s^2.
    pub lambda: Vector3<T>,
}

/// Torque and the errors it answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer<T: Real> {
    /// Angle error, rad.
    pub e1: Vector3<T>,
    /// Rate error, rad/s.
    pub e2: Vector3<T>,
    /// Body torque, N m.
    pub torque: Vector3<T>,
}

impl<T: Real> Law<T> {
    /// * `inertia` - kg m^2
    /// * `angle` - roll, pitch, yaw, rad; `omega` - body rate, rad/s
    /// * `angle_d`, `rate_d`, `acceleration_d` - reference and its derivatives
    /// * `chi` - integral of the angle error, rad s
    #[allow(clippy::too_many_arguments, reason = "the equation has these symbols")]
    pub fn torque(
        &self,
        inertia: &Matrix3<T>,
        angle: &Vector3<T>,
        omega: &Vector3<T>,
        angle_d: &Vector3<T>,
        rate_d: &Vector3<T>,
        acceleration_d: &Vector3<T>,
        chi: &Vector3<T>,
    ) -> Answer<T> {
        let tilt = Tilt::of(angle);
        let rate = tilt.euler_rate(omega);
        let mut e1 = angle_d - angle;
        e1.z = wrap(e1.z);
        let e2 = self.c1.component_mul(&e1) + rate_d + self.lambda.component_mul(chi) - rate;
        let mut nu = *acceleration_d;
        for i in 0..3 {
            let (c1, c2, l) = (self.c1[i], self.c2[i], self.lambda[i]);
            nu[i] += (T::one() - c1 * c1 + l) * e1[i] + (c1 + c2) * e2[i] - c1 * l * chi[i];
        }
        let omega_dot = Vector3::from(tilt.body_acceleration(&rate.into(), &nu.into()));
        Answer { e1, e2, torque: omega.cross(&(inertia * omega)) + inertia * omega_dot }
    }
}

/// Angle into [-pi, pi] for arguments within one turn.
fn wrap<T: Real>(angle: T) -> T {
    let (pi, turn): (T, T) = (real(core::f64::consts::PI), real(core::f64::consts::TAU));
    if angle > pi {
        angle - turn
    } else if angle < -pi {
        angle + turn
    } else {
        angle
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::*;
    use super::*;
    use crate::frames::{Body, Ned, Rotation};

    const LAW: Law<f64> = Law {
        c1: Vector3::new(9.0, 9.0, 4.0),
        c2: Vector3::new(14.0, 14.0, 5.0),
        lambda: Vector3::new(8.0, 8.0, 2.0),
    };

    /// Swinging reference: angle and its two derivatives.
    fn reference(t: f64) -> [Vector3<f64>; 3] {
        let (a, w) = (Vector3::new(0.4, -0.3, 0.8), Vector3::new(2.0, 3.0, 1.0));
        [
            Vector3::from_fn(|i, _| a[i] * (w[i] * t).sin()),
            Vector3::from_fn(|i, _| a[i] * w[i] * (w[i] * t).cos()),
            Vector3::from_fn(|i, _| -a[i] * w[i] * w[i] * (w[i] * t).sin()),
        ]
    }

    fn answer(s: &Turning, t: f64) -> Answer<f64> {
        let (roll, pitch, yaw) = Rotation::<Ned, Body, f64>::new(s.attitude()).euler();
        let [angle_d, rate_d, acceleration_d] = reference(t);
        LAW.torque(
            &inertia(),
            &Vector3::new(roll, pitch, yaw),
            &s.omega,
            &angle_d,
            &rate_d,
            &acceleration_d,
            &s.chi,
        )
    }

    #[test]
    fn the_lyapunov_function_never_rises_for_q_and_its_antipode() {
        for sign in [1.0, -1.0] {
            for start in starts(1.1) {
                let value = |s: &Turning, t: f64| {
                    let a = answer(s, t);
                    0.5 * (LAW.lambda.component_mul(&s.chi).dot(&s.chi)
                        + a.e1.norm_squared()
                        + a.e2.norm_squared())
                };
                never_rises(start.times(sign), 3.0, value, |s, t| {
                    let a = answer(s, t);
                    (a.torque, a.e1)
                });
            }
        }
    }
}
