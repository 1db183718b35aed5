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
use crate::lane::functions::size;
use crate::lane::vector::{cross, minus, scaled, times};
use crate::math::{Real, real};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Gains; diagonal matrices as vectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law<T: Real> {
    /// 1/s.
    pub c1: Vector3<T>,
    /// N m s.
    pub c2: Vector3<T>,
    /// 1/s^2.
    pub lambda: Vector3<T>,
    /// N m.
    pub k: T,
}

/// Reference attitude with body rate and its derivative, both in the reference's own body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target<T: Real> {
    /// Body to NED.
    pub attitude: UnitQuaternion<T>,
    /// rad/s.
    pub omega: Vector3<T>,
    /// rad/s^2.
    pub omega_dot: Vector3<T>,
}

/// Torque and the errors it answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer<T: Real> {
    /// Vector part of the error quaternion, the short way round.
    pub z1: Vector3<T>,
    /// Rate error, rad/s.
    pub z2: Vector3<T>,
    /// Body torque, N m.
    pub torque: Vector3<T>,
    /// The sign used, to be handed in at the next step.
    pub negative_sign: bool,
}

impl<T: Real> Target<T> {
    /// From Euler angles and their derivatives.
    pub fn from_euler(angle: &Vector3<T>, rate: &Vector3<T>, acceleration: &Vector3<T>) -> Self {
        let half = |angle: T| (angle * real(0.5)).sin_cos();
        let (roll, pitch, yaw) = (half(angle.x), half(angle.y), half(angle.z));
        let tilt = Tilt::of_halves(roll, pitch);
        let ((sr, cr), (sp, cp), (sy, cy)) = (roll, pitch, yaw);
        let [w, x, y, z] = attitude_of_halves([(sr, cr), (sp, cp), (sy, cy)]);
        let attitude = Quaternion::new(w, x, y, z);
        Self {
            attitude: UnitQuaternion::new_unchecked(attitude),
            omega: Vector3::from(tilt.body_rate(&(*rate).into())),
            omega_dot: Vector3::from(tilt.body_acceleration(&(*rate).into(), &(*acceleration).into())),
        }
    }
}

impl<T: Real> Law<T> {
    /// The gains that give the same small-angle loop as the Euler law: the vector part is half the angle.
    pub fn from_euler_gains(
        c1: &Vector3<T>,
        c2: &Vector3<T>,
        lambda: &Vector3<T>,
        inertia: &Matrix3<T>,
    ) -> Self {
        let two: T = real(2.0);
        let diagonal = inertia.diagonal();
        Self { c1: c1 * two, c2: diagonal.component_mul(c2), lambda: lambda * two, k: two * diagonal.max() }
    }

    /// * `inertia` - kg m^2
    /// * `attitude` - body to NED; `omega` - body rate, rad/s
    /// * `chi` - integral of `z1`, s
    /// * `negative_sign` - the sign of the last step
    pub fn torque(
        &self,
        inertia: &Matrix3<T>,
        attitude: &UnitQuaternion<T>,
        omega: &Vector3<T>,
        target: &Target<T>,
        chi: &Vector3<T>,
        negative_sign: bool,
    ) -> Answer<T> {
        let four = |q: &UnitQuaternion<T>| [q.w, q.i, q.j, q.k];
        let law = Gains {
            c1: self.c1.into(),
            c2: self.c2.into(),
            lambda: self.lambda.into(),
            k: self.k,
            inertia: (*inertia).into(),
        };
        let wanted = Wanted {
            attitude: four(&target.attitude),
            omega: target.omega.into(),
            omega_dot: target.omega_dot.into(),
        };
        let sign = if negative_sign { -T::one() } else { T::one() };
        let out = law.torque(&four(attitude), &(*omega).into(), &wanted, &(*chi).into(), sign);
        Answer {
            z1: out.z1.into(),
            z2: out.z2.into(),
            torque: out.torque.into(),
            negative_sign: out.sign < T::zero(),
        }
    }
}

/// The attitude of Euler angles, `[w, x, y, z]`, from sine and cosine of half of each.
#[inline(always)]
pub fn attitude_of_halves<L: Lane>([(sr, cr), (sp, cp), (sy, cy)]: [(L, L); 3]) -> [L; 4] {
    [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]
}

/// [`Law`] on lanes, with the inertia that it is for.
#[derive(Debug, Clone, Copy)]
pub struct Gains<L> {
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

/// [`Target`] on lanes.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<L> {
    /// Body to NED, `[w, x, y, z]`.
    pub attitude: [L; 4],
    /// rad/s.
    pub omega: [L; 3],
    /// rad/s^2.
    pub omega_dot: [L; 3],
}

/// [`Answer`] on lanes.
#[derive(Debug, Clone, Copy)]
pub struct Torque<L> {
    /// Vector part of the error quaternion, the short way round.
    pub z1: [L; 3],
    /// Rate error, rad/s.
    pub z2: [L; 3],
    /// Body torque, N m.
    pub torque: [L; 3],
    /// The sign used, 1 or -1, to be handed in at the next step.
    pub sign: L,
}

impl<L: Lane> Gains<L> {
    /// * `attitude` - body to NED; `omega` - body rate, rad/s
    /// * `chi` - integral of `z1`, s
    /// * `sign` - of the last step
    #[inline(always)]
    pub fn torque(
        &self,
        attitude: &[L; 4],
        omega: &[L; 3],
        target: &Wanted<L>,
        chi: &[L; 3],
        sign: L,
    ) -> Torque<L> {
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
            omega_dot[i] = omega_d_dot[i] - carried[i] - self.c1[i] * z1_dot - self.lambda[i] * z1[i];
        }
        let gyroscopic = cross(omega, &times(&self.inertia, omega));
        let mut torque = times(&self.inertia, &omega_dot);
        for i in 0..3 {
            torque[i] = gyroscopic[i] + torque[i] - z1[i] * self.k - self.c2[i] * z2[i];
        }
        Torque { z1, z2, torque, sign }
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

    fn law() -> Law<f64> {
        Law::from_euler_gains(
            &Vector3::new(9.0, 9.0, 4.0),
            &Vector3::new(14.0, 14.0, 5.0),
            &Vector3::new(8.0, 8.0, 2.0),
            &inertia(),
        )
    }

    fn target(t: f64) -> Target<f64> {
        let (a, w) = (Vector3::new(0.4, -0.3, 0.8), Vector3::new(2.0, 3.0, 1.0));
        Target::from_euler(
            &Vector3::from_fn(|i, _| a[i] * (w[i] * t).sin()),
            &Vector3::from_fn(|i, _| a[i] * w[i] * (w[i] * t).cos()),
            &Vector3::from_fn(|i, _| -a[i] * w[i] * w[i] * (w[i] * t).sin()),
        )
    }

    #[test]
    fn a_target_is_the_attitude_of_its_angles_and_its_rates_are_derivatives() {
        let h = 1e-6;
        for t in [0.1, 0.7, 1.9] {
            let (a, w) = (Vector3::new(0.4_f64, -0.3, 0.8), Vector3::new(2.0_f64, 3.0, 1.0));
            let angle = Vector3::from_fn(|i, _| a[i] * (w[i] * t).sin());
            let expected = UnitQuaternion::from_euler_angles(angle.x, angle.y, angle.z);
            assert!(target(t).attitude.angle_to(&expected) < 1e-12);
            let turned =
                (target(t - h).attitude.inverse() * target(t + h).attitude).scaled_axis() / (2.0 * h);
            assert!((turned - target(t).omega).norm() < 1e-8, "{turned}");
            let slope = (target(t + h).omega - target(t - h).omega) / (2.0 * h);
            assert!((slope - target(t).omega_dot).norm() < 1e-8, "{slope}");
        }
    }

    /// The start's sign is held: the error starts within 170 deg and `V` falls, so `eta` does not change sign again.
    #[test]
    fn the_lyapunov_function_never_rises_for_q_and_its_antipode() {
        for sign in [1.0, -1.0] {
            for start in starts(2.9) {
                let first = law().torque(
                    &inertia(),
                    &start.times(sign).attitude(),
                    &start.omega,
                    &target(0.0),
                    &start.chi,
                    sign < 0.0,
                );
                let answer = |s: &Turning, t: f64| {
                    law().torque(&inertia(), &s.attitude(), &s.omega, &target(t), &s.chi, first.negative_sign)
                };
                let value = |s: &Turning, t: f64| {
                    let a = answer(s, t);
                    let eta = (target(t).attitude.inverse() * s.attitude()).w.abs();
                    law().k * (2.0 * (1.0 - eta) + 0.5 * law().lambda.component_mul(&s.chi).dot(&s.chi))
                        + 0.5 * a.z2.dot(&(inertia() * a.z2))
                };
                never_rises(start.times(sign), 4.0, value, |s, t| {
                    let a = answer(s, t);
                    (a.torque, a.z1)
                });
            }
        }
    }

    #[test]
    fn antipodal_attitudes_get_the_same_torque() {
        for start in starts(2.0) {
            let one =
                law().torque(&inertia(), &start.attitude(), &start.omega, &target(0.3), &start.chi, false);
            let other = law().torque(
                &inertia(),
                &start.times(-1.0).attitude(),
                &start.omega,
                &target(0.3),
                &start.chi,
                false,
            );
            assert!((one.torque - other.torque).norm() < 1e-12);
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
        let a = euler.torque(&inertia(), &angle, &zero, &zero, &zero, &zero, &zero);
        let attitude = UnitQuaternion::from_euler_angles(-error, 0.0, 0.0);
        let b = law().torque(
            &inertia(),
            &attitude,
            &zero,
            &Target::from_euler(&zero, &zero, &zero),
            &zero,
            false,
        );
        // k is set by the largest inertia, so the loops agree to within that one term.
        assert!((a.torque.x / b.torque.x - 1.0).abs() < 0.03, "{} {}", a.torque.x, b.torque.x);
    }
}
