//! Integral backstepping attitude control: attitude error to body torque.
//!
//! Two forms of one idea. [`euler`] is the law of the paper's source (Bouabdallah and Siegwart
//! 2007) made exact with the Euler kinematics; [`quaternion`] has no singularity and does not
//! unwind. Both return every term.

pub mod euler;
pub mod quaternion;

use super::command_filter::EulerReference;
use crate::frames::{Body, Ned, Rotation};
use crate::lane::Lane;
use crate::lane::functions::{limit, wrap};
use crate::math::{Real, real};
use crate::vehicle::{ParameterError, each_positive, positive};
use nalgebra::{Matrix3, Vector3};

/// Longest step that the inner loop integrates over, s; a longer gap counts as this.
pub const INNER_STEP_MAX_S: f32 = 0.02;
/// Largest yaw error that the quaternion law is given, rad: 20 deg, twice of what tight turns
/// leave.
pub const YAW_LEAD_MAX_RAD: f32 = 0.35;

/// Largest [`AttitudeGains::rotor_lead`]: what it multiplies the noise of a gyro by.
const ROTOR_LEAD_MAX: f32 = 10.0;

/// Which law turns error into torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AttitudeForm {
    /// docs/equations.md B.2; singular at 90 deg of pitch.
    Euler,
    /// docs/equations.md B.3.
    Quaternion,
}

impl AttitudeForm {
    /// The yaw to turn to on the way to a commanded one.
    ///
    /// The quaternion law turns roll, pitch and yaw together, and a large error of yaw leads it
    /// beside the thrust axis that was asked for. Yaw is the weakest axis, and the first that is
    /// given up where thrust is short: the yaw to turn to is never further than
    /// [`YAW_LEAD_MAX_RAD`] from the measured one. The Euler law needs no such limit.
    pub fn yaw_target_rad(self, measured_rad: f32, commanded_rad: f32) -> f32 {
        match self {
            Self::Euler => commanded_rad,
            Self::Quaternion => yaw_target(measured_rad, commanded_rad),
        }
    }

    /// The heading that commanded roll and pitch have to be of for thrust to point where it was
    /// asked to.
    ///
    /// The Euler law controls each angle on its own: roll and pitch act at the yaw that there is.
    /// The quaternion law turns to one attitude, of which [`Self::yaw_target_rad`] is a part: roll
    /// and pitch of another heading would tilt beside what was asked for while yaw lags.
    pub fn heading_rad(self, measured_rad: f32, commanded_rad: f32) -> f32 {
        match self {
            Self::Euler => measured_rad,
            Self::Quaternion => self.yaw_target_rad(measured_rad, commanded_rad),
        }
    }
}

/// Gains of the attitude loop, roll, pitch, yaw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttitudeGains {
    /// The law.
    pub form: AttitudeForm,
    /// Gain of the angle error, 1/s.
    pub c1_per_s: Vector3<f32>,
    /// Gain of the rate error, 1/s.
    pub c2_per_s: Vector3<f32>,
    /// Gain of the integral, 1/s^2.
    pub lambda_per_s2: Vector3<f32>,
    /// Limit of the integral of the angle error, rad s.
    pub integral_max_rad_s: f32,
    /// How much of the rotors' lag is made up for: ratio of zero to pole of [`Lead`], 1 for none.
    ///
    /// [`Lead`]: super::lead::Lead
    pub rotor_lead: f32,
    /// Corner of the command filter, rad/s.
    pub filter_frequency_rad_s: f32,
    /// Damping of the command filter.
    pub filter_damping: f32,
}

/// What the attitude loop remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AttitudeState {
    /// Integral of the angle error, rad s.
    pub integral: Vector3<f32>,
    /// What a rotor of the lag that [`Lead`](super::lead::Lead) leaves has made of the torque, N m.
    pub followed_n_m: Vector3<f32>,
    /// The quaternion law took the long way's sign at the last step.
    pub negative_sign: bool,
}

/// Every term of one attitude step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttitudeTerms {
    /// Angle error as the law defines it (reference minus angle, or minus twice the vector part),
    /// rad.
    pub angle_error: Vector3<f32>,
    /// Rate error, rad/s.
    pub rate_error: Vector3<f32>,
    /// Integral of the angle error, rad s.
    pub integral: Vector3<f32>,
    /// Gyroscopic part of the torque, `w x J w`, N m.
    pub gyroscopic_n_m: Vector3<f32>,
    /// The whole torque, N m.
    pub torque_n_m: Vector3<f32>,
}

impl AttitudeGains {
    /// How long a command takes through the command filter, s: `2 zeta / w`, how far the filter is
    /// behind a ramp.
    pub fn filter_delay_s(&self) -> f32 {
        2.0 * self.filter_damping / self.filter_frequency_rad_s
    }

    /// # Errors
    /// The first gain that is not finite and positive, by its name in `[control.attitude]`.
    pub fn check(&self) -> Result<(), ParameterError> {
        each_positive("control.attitude.c1_per_s", self.c1_per_s.as_slice())?;
        each_positive("control.attitude.c2_per_s", self.c2_per_s.as_slice())?;
        each_positive("control.attitude.lambda_per_s2", self.lambda_per_s2.as_slice())?;
        positive("control.attitude.integral_max_rad_s", self.integral_max_rad_s)?;
        if !(1.0..=ROTOR_LEAD_MAX).contains(&self.rotor_lead) {
            let reason = "must be 1 (none) to 10";
            return Err(ParameterError::of("control.attitude.rotor_lead", self.rotor_lead, reason));
        }
        positive("control.attitude.filter_frequency_rad_s", self.filter_frequency_rad_s)?;
        positive("control.attitude.filter_damping", self.filter_damping)?;
        // Where the filter's step is stable, for the longest step that the stack takes.
        let turn = self.filter_frequency_rad_s * INNER_STEP_MAX_S;
        if turn * turn + 4.0 * self.filter_damping * turn >= 4.0 {
            let reason = "the filter would run away: with x = frequency * 0.02 s, x^2 + 4 damping x must be < 4";
            return Err(ParameterError::of(
                "control.attitude.filter_frequency_rad_s",
                self.filter_frequency_rad_s,
                reason,
            ));
        }
        Ok(())
    }

    /// One step of the loop: torque, and the integral moved on.
    ///
    /// * `inertia_kg_m2` - of the vehicle
    /// * `ned_from_body`, `omega` (rad/s, body) - as estimated
    /// * `reference` - filtered command
    /// * `hold_integral` - actuators are saturated, do not wind up
    /// * `dt_s` - time since the last step
    #[allow(
        clippy::too_many_arguments,
        reason = "each is one physical quantity; a struct would be used once"
    )]
    pub fn update(
        &self,
        state: &mut AttitudeState,
        inertia_kg_m2: &Matrix3<f32>,
        ned_from_body: &Rotation<Ned, Body, f32>,
        omega: &Vector3<f32>,
        reference: &EulerReference,
        hold_integral: bool,
        dt_s: f32,
    ) -> AttitudeTerms {
        let (torque, angle_error, rate_error) = match self.form {
            AttitudeForm::Euler => {
                let law =
                    euler::Law { c1: self.c1_per_s, c2: self.c2_per_s, lambda: self.lambda_per_s2 };
                let (roll, pitch, yaw) = ned_from_body.euler();
                let out = law.torque(
                    inertia_kg_m2,
                    &Vector3::new(roll, pitch, yaw),
                    omega,
                    &reference.angle,
                    &reference.rate,
                    &reference.acceleration,
                    &state.integral,
                );
                (out.torque, out.e1, out.e2)
            }
            AttitudeForm::Quaternion => {
                let law = quaternion::Law::from_euler_gains(
                    &self.c1_per_s.into(),
                    &self.c2_per_s.into(),
                    &self.lambda_per_s2.into(),
                    &(*inertia_kg_m2).into(),
                );
                let target = quaternion::Target::from_euler(
                    &reference.angle.into(),
                    &reference.rate.into(),
                    &reference.acceleration.into(),
                );
                // The integral of half the error drives the quaternion law; its sign is opposite.
                let chi = state.integral * -0.5;
                let sign = if state.negative_sign { -1.0 } else { 1.0 };
                let out =
                    law.torque(&ned_from_body.wxyz(), &(*omega).into(), &target, &chi.into(), sign);
                state.negative_sign = out.sign < 0.0;
                (out.torque.into(), Vector3::from(out.z1) * -2.0, -Vector3::from(out.z2))
            }
        };
        if !hold_integral {
            let (before, error) = (state.integral.into(), angle_error.into());
            state.integral = integrated(&before, &error, self.integral_max_rad_s, dt_s).into();
        }
        AttitudeTerms {
            angle_error,
            rate_error,
            integral: state.integral,
            gyroscopic_n_m: omega.cross(&(inertia_kg_m2 * omega)),
            torque_n_m: torque,
        }
    }
}

/// The yaw to turn to on the way to a commanded one, see [`AttitudeForm::yaw_target_rad`].
#[inline(always)]
pub fn yaw_target<L: Lane>(measured_rad: L, commanded_rad: L) -> L {
    let largest = f64::from(YAW_LEAD_MAX_RAD);
    measured_rad + limit(wrap(commanded_rad - measured_rad), L::of(-largest), L::of(largest))
}

/// An integral of an error a step later, within its limit.
#[inline(always)]
pub fn integrated<L: Lane>(integral: &[L; 3], error: &[L; 3], largest: L, dt_s: L) -> [L; 3] {
    let mut next = *integral;
    for i in 0..3 {
        next[i] = limit(integral[i] + error[i] * dt_s, L::of(0.0) - largest, largest);
    }
    next
}

/// Sines and cosines of roll and pitch, and with them the kinematics of Euler angles,
/// `omega = E(angle) rate`.
#[derive(Debug, Clone, Copy)]
pub struct Tilt<T> {
    sr: T,
    cr: T,
    sp: T,
    cp: T,
}

impl<L: Lane> Tilt<L> {
    /// From sine and cosine of half the angles: a few products instead of two sines more.
    #[inline(always)]
    pub fn of_halves((sr, cr): (L, L), (sp, cp): (L, L)) -> Self {
        let (one, two) = (L::of(1.0), L::of(2.0));
        Self {
            sr: two * sr * cr,
            cr: one - two * sr * sr,
            sp: two * sp * cp,
            cp: one - two * sp * sp,
        }
    }

    /// `E rate`: the body rate of Euler angle rates.
    #[inline(always)]
    pub fn body_rate(&self, rate: &[L; 3]) -> [L; 3] {
        let Self { sr, cr, sp, cp } = *self;
        let [roll, pitch, yaw] = *rate;
        [roll - sp * yaw, cr * pitch + sr * cp * yaw, cr * cp * yaw - sr * pitch]
    }

    /// `E acceleration + E' rate`: the derivative of [`Self::body_rate`].
    #[inline(always)]
    pub fn body_acceleration(&self, rate: &[L; 3], acceleration: &[L; 3]) -> [L; 3] {
        let Self { sr, cr, sp, cp } = *self;
        let [roll, pitch, yaw] = *rate;
        let [p, q, r] = self.body_rate(acceleration);
        let none = L::of(0.0);
        [
            p - cp * pitch * yaw,
            q + ((cr * cp * roll - sr * sp * pitch) * yaw - sr * roll * pitch),
            r + ((none - sr * cp * roll - cr * sp * pitch) * yaw - cr * roll * pitch),
        ]
    }
}

impl<T: Real> Tilt<T> {
    fn of(angle: &Vector3<T>) -> Self {
        let (sr, cr) = angle.x.sin_cos();
        let (sp, cp) = angle.y.sin_cos();
        Self { sr, cr, sp, cp }
    }

    /// Euler angle rates of a body rate; total: the cosine of pitch is kept away from 0.
    fn euler_rate(&self, omega: &Vector3<T>) -> Vector3<T> {
        let Self { sr, cr, sp, cp } = *self;
        let floor: T = real(0.05);
        let cp = if cp.abs() < floor { floor } else { cp };
        let yaw_rate = (sr * omega.y + cr * omega.z) / cp;
        Vector3::new(omega.x + sp * yaw_rate, cr * omega.y - sr * omega.z, yaw_rate)
    }
}

#[cfg(test)]
mod fixtures {
    use crate::dynamics::{VectorSpace, rk4};
    use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

    pub(super) fn inertia() -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(3.22e-3, 4.68e-3, 7.72e-3))
    }

    /// A body that only turns, with the controller's integral.
    #[derive(Debug, Clone, Copy)]
    pub(super) struct Turning {
        q: Quaternion<f64>,
        pub(super) omega: Vector3<f64>,
        pub(super) chi: Vector3<f64>,
    }
    impl Turning {
        pub(super) fn attitude(&self) -> UnitQuaternion<f64> {
            UnitQuaternion::new_unchecked(self.q)
        }
        pub(super) fn times(mut self, sign: f64) -> Self {
            self.q *= sign;
            self
        }
    }
    impl VectorSpace<f64> for Turning {
        fn plus_scaled(&self, h: f64, k: &Self) -> Self {
            Self { q: self.q + k.q * h, omega: self.omega + k.omega * h, chi: self.chi + k.chi * h }
        }
    }

    /// Attitudes up to `largest` rad from level about several axes, turning, with an integral.
    pub(super) fn starts(largest: f64) -> Vec<Turning> {
        let axes = [
            Vector3::x(),
            Vector3::y(),
            Vector3::new(1.0, -1.0, 0.5),
            Vector3::new(-0.3, 1.0, 1.0),
        ];
        let attitude = |axis: &Vector3<f64>, angle: f64| {
            UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(*axis), angle)
                .into_inner()
        };
        let mut all = Vec::new();
        for axis in &axes {
            for share in [0.2, 1.0] {
                all.push(Turning {
                    q: attitude(axis, share * largest),
                    omega: Vector3::new(1.0, -2.0, 0.5),
                    chi: Vector3::new(0.01, -0.02, 0.03),
                });
            }
        }
        all
    }

    /// Flies the closed loop in continuous time and asserts that `value` never rises and comes down
    /// to nearly nothing.
    pub(super) fn never_rises(
        start: Turning,
        duration_s: f64,
        value: impl Fn(&Turning, f64) -> f64,
        torque_and_integrand: impl Fn(&Turning, f64) -> (Vector3<f64>, Vector3<f64>),
    ) {
        let dt = 5e-4;
        let (mut s, first) = (start, value(&start, 0.0));
        let mut last = first;
        for step in 0..(duration_s / dt) as usize {
            let t = step as f64 * dt;
            s = rk4_with_time(s, t, dt, &torque_and_integrand);
            s.q = s.q.normalize();
            let now = value(&s, t + dt);
            assert!(now <= last * (1.0 + 1e-9) + 1e-12, "V rose from {last} to {now} at {t} s");
            last = now;
        }
        assert!(last < 0.05 * first, "V only fell from {first} to {last}");
    }

    /// Time is part of the law, so it is part of the state that RK4 moves.
    #[derive(Clone, Copy)]
    struct Timed(Turning, f64);
    impl VectorSpace<f64> for Timed {
        fn plus_scaled(&self, h: f64, k: &Self) -> Self {
            Timed(self.0.plus_scaled(h, &k.0), self.1 + h * k.1)
        }
    }

    fn rk4_with_time(
        s: Turning,
        t: f64,
        dt: f64,
        torque_and_integrand: &impl Fn(&Turning, f64) -> (Vector3<f64>, Vector3<f64>),
    ) -> Turning {
        rk4(Timed(s, t), dt, |Timed(s, t)| {
            let (torque, integrand) = torque_and_integrand(s, *t);
            let j = inertia();
            let omega_dot = j.try_inverse().unwrap() * (torque - s.omega.cross(&(j * s.omega)));
            Timed(
                Turning {
                    q: s.q * Quaternion::from_imag(s.omega) * 0.5,
                    omega: omega_dot,
                    chi: integrand,
                },
                1.0,
            )
        })
        .0
    }
}
