//! Integral backstepping on the rotation group: no singularity, no unwinding.
//!
//! Derived for this project (docs/equations.md B.3); not in the paper.
//!
//! ```text
//! q_e = q_d^-1 q    s = sign(w_e)    z1 = s vec(q_e)    R_e = R_d^T R    w_e = w - R_e^T w_d    chi' = z1
//! z1' = 1/2 (|eta| w_e + z1 x w_e)        z2 = w_e + C1 z1 + L chi
//! torque = w x J w + J (R_e^T w_d' - w_e x R_e^T w_d - C1 z1' - L z1) - k z1 - C2 z2
//! V = k (2 (1 - |eta|) + 1/2 chi^T L chi) + 1/2 z2^T J z2,   V' = -k z1^T C1 z1 - z2^T C2 z2
//! ```
//! The sign is kept while `|eta| < 0.1`, so that noise at 180 deg does not make it chatter.

use super::Tilt;
use crate::lane::Lane;
use crate::lane::functions::{sine_and_cosine_of_half, size};
use crate::lane::vector::{cross, minus, scaled, times};

/// Gains, diagonal matrices as vectors, and the inertia that they are for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law<L> {
    /// 1/s.
    pub c1: [L; 3],
    /// N m s.
    pub c2: [L; 3],
    /// 1/s^2.
    pub lambda: [L; 3],
    /// N m.
    pub k: L,
    /// By columns, kg m^2.
    pub inertia: [[L; 3]; 3],
}

/// Reference attitude with body rate and its derivative, both in the reference's own body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target<L> {
    /// Body to NED, `[w, x, y, z]`.
    pub attitude: [L; 4],
    /// rad/s.
    pub omega: [L; 3],
    /// rad/s^2.
    pub omega_dot: [L; 3],
}

/// Torque and the errors it answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer<L> {
    /// Vector part of the error quaternion, the short way round.
    pub z1: [L; 3],
    /// Rate error, rad/s.
    pub z2: [L; 3],
    /// Body torque, N m.
    pub torque: [L; 3],
    /// The sign used, 1 or -1, to be handed in at the next step.
    pub sign: L,
}

impl<L: Lane> Target<L> {
    /// From Euler angles and their derivatives.
    #[inline(always)]
    pub fn from_euler(angle: &[L; 3], rate: &[L; 3], acceleration: &[L; 3]) -> Self {
        let (sr, cr) = sine_and_cosine_of_half(angle[0]);
        let (sp, cp) = sine_and_cosine_of_half(angle[1]);
        let (sy, cy) = sine_and_cosine_of_half(angle[2]);
        let tilt = Tilt::of_halves((sr, cr), (sp, cp));
        Self {
            attitude: [
                cr * cp * cy + sr * sp * sy,
                sr * cp * cy - cr * sp * sy,
                cr * sp * cy + sr * cp * sy,
                cr * cp * sy - sr * sp * cy,
            ],
            omega: tilt.body_rate(rate),
            omega_dot: tilt.body_acceleration(rate, acceleration),
        }
    }
}

impl<L: Lane> Law<L> {
    /// The gains that give the same small-angle loop as the Euler law: the vector part is half the
    /// angle.
    ///
    /// * `inertia` - by columns, kg m^2
    #[inline(always)]
    pub fn from_euler_gains(
        c1: &[L; 3],
        c2: &[L; 3],
        lambda: &[L; 3],
        inertia: &[[L; 3]; 3],
    ) -> Self {
        let two = L::of(2.0);
        let [[x, ..], [_, y, _], [.., z]] = *inertia;
        Self {
            c1: scaled(c1, two),
            c2: [x * c2[0], y * c2[1], z * c2[2]],
            lambda: scaled(lambda, two),
            k: two * x.upper(y).upper(z),
            inertia: *inertia,
        }
    }

    /// * `attitude` - body to NED; `omega` - body rate, rad/s
    /// * `chi` - integral of `z1`, s
    /// * `sign` - of the last step
    #[inline(always)]
    pub fn torque(
        &self,
        attitude: &[L; 4],
        omega: &[L; 3],
        target: &Target<L>,
        chi: &[L; 3],
        sign: L,
    ) -> Answer<L> {
        let (none, one, half) = (L::of(0.0), L::of(1.0), L::of(0.5));
        // q_e = q_d^-1 q
        let ([w, x, y, z], [qw, qx, qy, qz]) = (target.attitude, *attitude);
        let eta = w * qw + x * qx + y * qy + z * qz;
        let error = [
            w * qx - x * qw - y * qz + z * qy,
            w * qy + x * qz - y * qw - z * qx,
            w * qz - x * qy + y * qx - z * qw,
        ];
        let clear = (none - eta).where_positive(none - one, one);
        let sign = (L::of(0.1) - size(eta)).where_positive(sign, clear);
        let omega_d = back(&error, eta, &target.omega);
        let omega_d_dot = back(&error, eta, &target.omega_dot);
        let z1 = scaled(&error, sign);
        let omega_e = minus(omega, &omega_d);
        let (turning, carried) = (cross(&z1, &omega_e), cross(&omega_e, &omega_d));
        let (mut z2, mut omega_dot) = (z1, z1);
        for i in 0..3 {
            let z1_dot = (omega_e[i] * (eta * sign) + turning[i]) * half;
            z2[i] = omega_e[i] + self.c1[i] * z1[i] + self.lambda[i] * chi[i];
            omega_dot[i] =
                omega_d_dot[i] - carried[i] - self.c1[i] * z1_dot - self.lambda[i] * z1[i];
        }
        let gyroscopic = cross(omega, &times(&self.inertia, omega));
        let mut torque = times(&self.inertia, &omega_dot);
        for i in 0..3 {
            torque[i] = gyroscopic[i] + torque[i] - z1[i] * self.k - self.c2[i] * z2[i];
        }
        Answer { z1, z2, torque, sign }
    }
}

/// A vector in the frame that a rotation `[real, imaginary]` leads to: its inverse, applied.
#[inline(always)]
fn back<L: Lane>(imaginary: &[L; 3], real_part: L, v: &[L; 3]) -> [L; 3] {
    let t = scaled(&cross(v, imaginary), L::of(2.0));
    let twice = cross(&t, imaginary);
    let mut out = *v;
    for i in 0..3 {
        out[i] = t[i] * real_part + twice[i] + v[i];
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::*;
    use super::*;

    use nalgebra::{Matrix3, UnitQuaternion, Vector3};

    fn law() -> Law<f64> {
        Law::from_euler_gains(
            &[9.0, 9.0, 4.0],
            &[14.0, 14.0, 5.0],
            &[8.0, 8.0, 2.0],
            &inertia().into(),
        )
    }

    fn four(q: &UnitQuaternion<f64>) -> [f64; 4] {
        [q.w, q.i, q.j, q.k]
    }

    fn unit([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
        UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z))
    }

    fn answer(s: &Turning, t: f64, sign: f64) -> Answer<f64> {
        law().torque(&four(&s.attitude()), &s.omega.into(), &target(t), &s.chi.into(), sign)
    }

    fn target(t: f64) -> Target<f64> {
        let (a, w) = ([0.4, -0.3, 0.8], [2.0, 3.0, 1.0]);
        let at = |f: fn(f64, f64, f64) -> f64| core::array::from_fn(|i| f(a[i], w[i], w[i] * t));
        Target::from_euler(
            &at(|a, _, x| a * x.sin()),
            &at(|a, w, x| a * w * x.cos()),
            &at(|a, w, x| -a * w * w * x.sin()),
        )
    }

    #[test]
    fn a_target_is_the_attitude_of_its_angles_and_its_rates_are_derivatives() {
        let h = 1e-5;
        for t in [0.1, 0.7, 1.9] {
            let (a, w) = (Vector3::new(0.4_f64, -0.3, 0.8), Vector3::new(2.0_f64, 3.0, 1.0));
            let angle = Vector3::from_fn(|i, _| a[i] * (w[i] * t).sin());
            let expected = UnitQuaternion::from_euler_angles(angle.x, angle.y, angle.z);
            let attitude = |t: f64| unit(target(t).attitude);
            let omega = |t: f64| Vector3::from(target(t).omega);
            // Its sines are polynomials.
            assert!(attitude(t).angle_to(&expected) < 1e-9);
            let turned = (attitude(t - h).inverse() * attitude(t + h)).scaled_axis() / (2.0 * h);
            assert!((turned - omega(t)).norm() < 1e-8, "{turned}");
            let slope = (omega(t + h) - omega(t - h)) / (2.0 * h);
            assert!((slope - Vector3::from(target(t).omega_dot)).norm() < 1e-8, "{slope}");
        }
    }

    /// The start's sign is held: the error starts within 170 deg and `V` falls, so `eta` does not
    /// change sign again.
    #[test]
    fn the_lyapunov_function_never_rises_for_q_and_its_antipode() {
        for sign in [1.0, -1.0] {
            for start in starts(2.9) {
                let first = answer(&start.times(sign), 0.0, sign).sign;
                let value = |s: &Turning, t: f64| {
                    let z2 = Vector3::from(answer(s, t, first).z2);
                    let eta = (unit(target(t).attitude).inverse() * s.attitude()).w.abs();
                    let lambda = Vector3::from(law().lambda);
                    law().k * (2.0 * (1.0 - eta) + 0.5 * lambda.component_mul(&s.chi).dot(&s.chi))
                        + 0.5 * z2.dot(&(inertia() * z2))
                };
                never_rises(start.times(sign), 4.0, value, |s, t| {
                    let a = answer(s, t, first);
                    (a.torque.into(), a.z1.into())
                });
            }
        }
    }

    #[test]
    fn antipodal_attitudes_get_the_same_torque() {
        for start in starts(2.0) {
            let [one, other] =
                [1.0, -1.0].map(|sign| Vector3::from(answer(&start.times(sign), 0.3, 1.0).torque));
            assert!((one - other).norm() < 1e-12);
        }
    }

    #[test]
    fn agrees_with_the_euler_law_for_small_errors() {
        let euler = super::super::euler::Law {
            c1: Vector3::new(9.0, 9.0, 4.0),
            c2: Vector3::new(14.0, 14.0, 5.0),
            lambda: Vector3::new(8.0, 8.0, 2.0),
        };
        let error = 1e-4;
        let zero = Vector3::zeros();
        let angle = Vector3::new(-error, 0.0, 0.0);
        let inertia: Matrix3<f64> = inertia();
        let a = euler.torque(&inertia, &angle, &zero, &zero, &zero, &zero, &zero);
        let attitude = UnitQuaternion::from_euler_angles(-error, 0.0, 0.0);
        let none = [0.0; 3];
        let b = law().torque(
            &four(&attitude),
            &none,
            &Target::from_euler(&none, &none, &none),
            &none,
            1.0,
        );
        // k is set by the largest inertia, so the loops agree to within that one term.
        assert!((a.torque.x / b.torque[0] - 1.0).abs() < 0.03, "{} {}", a.torque.x, b.torque[0]);
    }
}
