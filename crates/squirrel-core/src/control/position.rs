//! Primary controller (PC): cascaded position and velocity control, 10 Hz.
//!
//! Paper, section III.B:
//! ```text
//! v_jd = k_p^p (j_d - j)      e_j = v_jd - v_j      a_cmd,j = k_p^v e_j + k_i^v int(e_j) + k_d^v e_j'
//! U = m (g - a_cmd,z) / (cos(roll) cos(pitch))      pitch_d = -(m/U) a_cmd,x      roll_d = (m/U) a_cmd,y
//! ```
//! Differs: accelerations are turned into the heading frame first (the paper's law holds at zero
//! yaw only, docs/equations.md T7), limited, and the integral is frozen while anything is
//! saturated. `U` uses the measured tilt with the product of cosines kept above 0.5 (T8).
//! [`AngleLaw::Exact`] inverts the thrust direction instead of taking sines as angles.

use super::{AttitudeThrust, Reference};
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::{GRAVITY_M_S2, cos, limit, limit_norm, sqrt, upper};
use crate::vehicle::{ParameterError, each_not_negative, each_positive, positive};
use nalgebra::{Vector2, Vector3};

/// How an acceleration becomes roll and pitch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AngleLaw {
    /// As printed in the paper: angle for sine, 4.7 % off at 30 deg.
    SmallAngle,
    /// `pitch = atan2(-a_x, g - a_z)`, `roll = atan2(a_y cos(pitch), g - a_z)`.
    Exact,
}

/// Gains of the position and velocity loops, north, east, down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionGains {
    /// Position to velocity, 1/s.
    pub position_per_s: Vector3<f32>,
    /// Velocity error to acceleration, 1/s.
    pub velocity_per_s: Vector3<f32>,
    /// Integral of the velocity error to acceleration, 1/s^2.
    pub integral_per_s2: Vector3<f32>,
    /// Derivative of the velocity error to acceleration.
    pub derivative: Vector3<f32>,
    /// Share of the reference velocity that is fed forward, 0 in the paper.
    pub velocity_feed_forward: f32,
    /// Share of the reference acceleration that is fed forward, 0 in the paper.
    pub acceleration_feed_forward: f32,
    /// With what the way to the reference can be braked, m/s^2; infinite in the paper. The position
    /// loop asks for no more horizontal speed towards it than that: it is proportional to the error
    /// nearby, and to its square root far away.
    pub approach_max_m_s2: f32,
    /// Limit of the horizontal velocity that the position loop asks for, m/s; infinite in the
    /// paper.
    pub speed_max_m_s: f32,
    /// Limit of the horizontal acceleration command, m/s^2.
    pub acceleration_max_horizontal_m_s2: f32,
    /// Limit of the vertical acceleration command, m/s^2.
    pub acceleration_max_vertical_m_s2: f32,
    /// Limit of the integral of the velocity error, m.
    pub integral_max_m: f32,
    /// From acceleration to angles.
    pub angle_law: AngleLaw,
}

/// What the loop remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PositionState {
    /// Integral of the velocity error, m.
    pub integral: Vector3<f32>,
    /// Velocity error of the last tick, m/s, once there was one.
    pub last_error: Option<Vector3<f32>>,
}

/// Every term of one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionTerms {
    /// Reference minus position, m.
    pub position_error: In<Ned, f32>,
    /// Velocity that the position loop asks for, m/s.
    pub velocity_desired: In<Ned, f32>,
    /// Desired minus measured velocity, m/s.
    pub velocity_error: In<Ned, f32>,
    /// Derivative of the velocity error, m/s^2.
    pub velocity_error_slope: Vector3<f32>,
    /// Integral of the velocity error, m.
    pub integral: Vector3<f32>,
    /// Acceleration command before limits, m/s^2.
    pub acceleration_demand: In<Ned, f32>,
    /// Acceleration command, m/s^2.
    pub acceleration: In<Ned, f32>,
    /// Angles and thrust that would give it, not limited.
    pub request: AttitudeThrust,
}

/// Force that nobody commanded, as felt, N: what [`super::plus`] adds to what it believes, along
/// body z or whole ([`super::plus::Feels`]).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ForceResidual {
    /// With wings folded: thrust that is short.
    pub short_n: f32,
    /// Of spread wings, beside the flat plate in still air and
    /// [`wing_download_n`](super::plus::Plus::wing_download_n).
    pub wings_n: f32,
    /// All that acts beside thrust and gravity.
    pub beside: In<Ned, f32>,
}

/// Measured motion at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredMotion {
    /// Position, m.
    pub position: In<Ned, f32>,
    /// Velocity over ground, m/s.
    pub velocity: In<Ned, f32>,
    /// Roll that has the thrust axis where it is, at [`Self::heading_rad`], rad.
    pub roll_rad: f32,
    /// Pitch, likewise.
    pub pitch_rad: f32,
    /// The heading that roll and pitch are of, measured and commanded ones, rad: see
    /// [`super::backstepping::AttitudeForm::heading_rad`].
    pub heading_rad: f32,
    /// Of the air over ground, m/s; the paper's laws know of none.
    pub wind: In<Ned, f32>,
    /// Force that nobody commanded; the paper's laws know of none.
    pub residual: ForceResidual,
}

impl MeasuredMotion {
    /// With the thrust axis of an attitude, as roll and pitch at a heading that need not be the
    /// measured one, and no residual.
    pub fn new(
        position: In<Ned, f32>,
        velocity: In<Ned, f32>,
        ned_from_body: &Rotation<Ned, Body, f32>,
        heading_rad: f32,
    ) -> Self {
        let down = (*ned_from_body * In::new(Vector3::z())).vector;
        let level = heading_frame(&down, heading_rad);
        let roll_rad = -libm::asinf(limit(level.y, -1.0, 1.0));
        let pitch_rad = libm::atan2f(level.x, down.z);
        let residual = ForceResidual::default();
        Self { position, velocity, roll_rad, pitch_rad, heading_rad, wind: In::zero(), residual }
    }
}

impl PositionGains {
    /// # Errors
    /// The first gain that is not finite or out of range, by its name in `[control.position]`.
    pub fn check(&self) -> Result<(), ParameterError> {
        each_positive("control.position.position_per_s", self.position_per_s.as_slice())?;
        each_positive("control.position.velocity_per_s", self.velocity_per_s.as_slice())?;
        each_not_negative("control.position.integral_per_s2", self.integral_per_s2.as_slice())?;
        each_not_negative("control.position.derivative", self.derivative.as_slice())?;
        let horizontal = self.acceleration_max_horizontal_m_s2;
        positive("control.position.acceleration_max_horizontal_m_s2", horizontal)?;
        positive(
            "control.position.acceleration_max_vertical_m_s2",
            self.acceleration_max_vertical_m_s2,
        )?;
        positive("control.position.integral_max_m", self.integral_max_m)?;
        for (field, share) in [
            ("control.position.velocity_feed_forward", self.velocity_feed_forward),
            ("control.position.acceleration_feed_forward", self.acceleration_feed_forward),
        ] {
            if !(0.0..=1.0).contains(&share) {
                return Err(ParameterError::of(field, share, "must be 0 to 1"));
            }
        }
        for (field, x) in [
            ("control.position.approach_max_m_s2", self.approach_max_m_s2),
            ("control.position.speed_max_m_s", self.speed_max_m_s),
        ] {
            if !(x > 0.0) {
                return Err(ParameterError::of(field, x, "must be > 0"));
            }
        }
        Ok(())
    }

    /// One tick.
    ///
    /// * `mass_kg` - of the vehicle
    /// * `hold_integral` - the last command was saturated
    /// * `dt_s` - time since the last tick
    pub fn update(
        &self,
        state: &mut PositionState,
        mass_kg: f32,
        motion: &MeasuredMotion,
        reference: &Reference,
        hold_integral: bool,
        dt_s: f32,
    ) -> PositionTerms {
        let position_error = reference.position.vector - motion.position.vector;
        let mut velocity_desired =
            self.approach(&position_error) + reference.velocity.vector * self.velocity_feed_forward;
        let horizontal = limit_norm(
            Vector3::new(velocity_desired.x, velocity_desired.y, 0.0),
            self.speed_max_m_s,
        );
        (velocity_desired.x, velocity_desired.y) = (horizontal.x, horizontal.y);
        let error = velocity_desired - motion.velocity.vector;
        let slope = match state.last_error {
            Some(last) if dt_s > 0.0 => (error - last) / dt_s,
            _ => Vector3::zeros(),
        };
        if !hold_integral {
            let max = self.integral_max_m;
            state.integral = (state.integral + error * dt_s).map(|x| limit(x, -max, max));
        }
        state.last_error = Some(error);
        let demand = self.velocity_per_s.component_mul(&error)
            + self.integral_per_s2.component_mul(&state.integral)
            + self.derivative.component_mul(&slope)
            + reference.acceleration.vector * self.acceleration_feed_forward;
        let horizontal = limit_norm(
            Vector3::new(demand.x, demand.y, 0.0),
            self.acceleration_max_horizontal_m_s2,
        );
        let max = self.acceleration_max_vertical_m_s2;
        let acceleration = Vector3::new(horizontal.x, horizontal.y, limit(demand.z, -max, max));
        PositionTerms {
            position_error: In::new(position_error),
            velocity_desired: In::new(velocity_desired),
            velocity_error: In::new(error),
            velocity_error_slope: slope,
            integral: state.integral,
            acceleration_demand: In::new(demand),
            acceleration: In::new(acceleration),
            request: request(self.angle_law, mass_kg, &acceleration, motion),
        }
    }

    /// Velocity towards the reference, m/s. Far away it is that from which
    /// [`Self::approach_max_m_s2`] stops at the reference, with the proportional law's lag:
    /// `v^2 = a (2 e - a / k^2)` joins `v = k e` smoothly at `e = a / k^2`.
    fn approach(&self, position_error: &Vector3<f32>) -> Vector3<f32> {
        let mut velocity = self.position_per_s.component_mul(position_error);
        let (error, speed) = (position_error.xy().norm(), velocity.xy().norm());
        let max = self.approach_max_m_s2;
        // That is k v > a; where both are nothing, they are proportional.
        if speed * speed > max * error {
            let slow = sqrt(max * (2.0 * error - max * error * error / (speed * speed))) / speed;
            (velocity.x, velocity.y) = (velocity.x * slow, velocity.y * slow);
        }
        velocity
    }
}

/// Horizontal part of a NED vector in the heading frame: forward, right.
pub(super) fn heading_frame(v_ned: &Vector3<f32>, heading_rad: f32) -> Vector2<f32> {
    let (s, c) = libm::sincosf(heading_rad);
    Vector2::new(c * v_ned.x + s * v_ned.y, -s * v_ned.x + c * v_ned.y)
}

fn request(
    law: AngleLaw,
    mass_kg: f32,
    acceleration_ned: &Vector3<f32>,
    motion: &MeasuredMotion,
) -> AttitudeThrust {
    let a = heading_frame(acceleration_ned, motion.heading_rad);
    // Thrust never asks for free fall or less: a downward command stronger than that keeps a tenth
    // of g.
    let lift = upper(GRAVITY_M_S2 as f32 - acceleration_ned.z, 0.1 * GRAVITY_M_S2 as f32);
    let cosines = cos(motion.roll_rad) * cos(motion.pitch_rad);
    let thrust_n = mass_kg * lift / upper(cosines, 0.5);
    let (roll_rad, pitch_rad) = match law {
        AngleLaw::SmallAngle => (mass_kg / thrust_n * a.y, -mass_kg / thrust_n * a.x),
        AngleLaw::Exact => {
            let pitch = libm::atan2f(-a.x, lift);
            (libm::atan2f(a.y * cos(pitch), lift), pitch)
        }
    };
    AttitudeThrust { roll_rad, pitch_rad, thrust_n }
}

#[cfg(test)]
pub(super) mod fixtures {
    use super::*;

    pub(in super::super) fn gains() -> PositionGains {
        PositionGains {
            position_per_s: Vector3::new(1.6, 1.6, 0.8),
            velocity_per_s: Vector3::new(2.5, 2.5, 1.6),
            integral_per_s2: Vector3::new(0.15, 0.15, 0.15),
            derivative: Vector3::new(0.05, 0.05, 0.05),
            velocity_feed_forward: 0.0,
            acceleration_feed_forward: 0.0,
            approach_max_m_s2: f32::INFINITY,
            speed_max_m_s: f32::INFINITY,
            acceleration_max_horizontal_m_s2: 11.0,
            acceleration_max_vertical_m_s2: 3.0,
            integral_max_m: 2.0,
            angle_law: AngleLaw::Exact,
        }
    }
    pub(in super::super) fn still() -> MeasuredMotion {
        MeasuredMotion {
            position: In::zero(),
            velocity: In::zero(),
            roll_rad: 0.0,
            pitch_rad: 0.0,
            heading_rad: 0.0,
            wind: In::zero(),
            residual: ForceResidual::default(),
        }
    }
    pub(in super::super) fn at(north: f32, east: f32, down: f32) -> Reference {
        Reference {
            position: In::new(Vector3::new(north, east, down)),
            velocity: In::zero(),
            acceleration: In::zero(),
            yaw_rad: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::fixtures::*;
    use super::*;

    fn tick(
        gains: &PositionGains,
        motion: &MeasuredMotion,
        reference: &Reference,
    ) -> PositionTerms {
        gains.update(&mut PositionState::default(), 0.548, motion, reference, false, 0.1)
    }

    #[test]
    fn on_the_spot_it_asks_for_hover() {
        let terms = tick(&gains(), &still(), &at(0.0, 0.0, 0.0));
        assert!((terms.request.thrust_n - 0.548 * 9.80665).abs() < 1e-4);
        assert_eq!((terms.request.roll_rad, terms.request.pitch_rad), (0.0, 0.0));
    }

    #[test]
    fn a_goal_ahead_lowers_the_nose_and_one_to_the_right_rolls_right() {
        let terms = tick(&gains(), &still(), &at(2.0, 1.0, 0.0));
        assert!(terms.request.pitch_rad < 0.0 && terms.request.roll_rad > 0.0, "{terms:?}");
        let above = tick(&gains(), &still(), &at(0.0, 0.0, -2.0));
        assert!(above.request.thrust_n > 0.548 * 9.80665, "a goal above asks for more thrust");
    }

    /// Thrust along the requested attitude must be the requested acceleration, whatever the
    /// heading.
    #[test]
    fn the_exact_law_inverts_the_dynamics_at_any_yaw() {
        for yaw in [-3.0, -1.0, 0.0, 0.7, 2.5] {
            let motion = MeasuredMotion { heading_rad: yaw, ..still() };
            let terms = tick(&gains(), &motion, &at(1.0, -0.7, -0.3));
            let r = terms.request;
            let ned_from_body =
                Rotation::<Ned, Body, f32>::from_euler(r.roll_rad, r.pitch_rad, yaw);
            let a = terms.acceleration.vector;
            let lift = GRAVITY_M_S2 as f32 - a.z;
            // Thrust that holds the vertical at the requested tilt.
            let u = 0.548 * lift / (r.roll_rad.cos() * r.pitch_rad.cos());
            let got = (ned_from_body * In::new(Vector3::new(0.0, 0.0, -u / 0.548))).vector
                + Vector3::new(0.0, 0.0, GRAVITY_M_S2 as f32);
            assert!((got - a).norm() < 1e-4, "yaw {yaw}: {got} for {a}");
        }
    }

    /// Roll and pitch say where the thrust axis is, whatever heading they are of and whatever the
    /// yaw is.
    #[test]
    fn roll_and_pitch_at_any_heading_have_the_thrust_axis_of_the_attitude() {
        for (yaw, heading) in [(0.0, 0.0), (0.3, 0.3), (0.0, 0.5), (1.5, 0.0), (-3.0, 2.0)] {
            let attitude = Rotation::<Ned, Body, f32>::from_euler(0.4, -0.3, yaw);
            let motion = MeasuredMotion::new(In::zero(), In::zero(), &attitude, heading);
            let same =
                Rotation::<Ned, Body, f32>::from_euler(motion.roll_rad, motion.pitch_rad, heading);
            let axis = |of: Rotation<Ned, Body, f32>| (of * In::new(Vector3::z())).vector;
            assert!(
                (axis(attitude) - axis(same)).norm() < 1e-5,
                "yaw {yaw}, heading {heading}: {motion:?}"
            );
            if yaw == heading {
                assert!(
                    (motion.roll_rad - 0.4).abs() < 1e-5 && (motion.pitch_rad + 0.3).abs() < 1e-5
                );
            }
        }
    }

    #[test]
    fn both_angle_laws_agree_to_first_order() {
        let mut paper = gains();
        paper.angle_law = AngleLaw::SmallAngle;
        for size in [0.02_f32, 0.04] {
            let exact = tick(&gains(), &still(), &at(size, -size, 0.0)).request;
            let printed = tick(&paper, &still(), &at(size, -size, 0.0)).request;
            let difference = (exact.pitch_rad - printed.pitch_rad).abs()
                + (exact.roll_rad - printed.roll_rad).abs();
            assert!(difference < 20.0 * size.powi(3), "{difference}");
        }
    }

    #[test]
    fn limits_hold_and_a_held_integral_does_not_move() {
        let mut state = PositionState::default();
        let far = at(100.0, 50.0, -40.0);
        let terms = gains().update(&mut state, 0.548, &still(), &far, true, 0.1);
        assert_eq!(state.integral, Vector3::zeros());
        let a = terms.acceleration.vector;
        assert!(a.xy().norm() <= 11.0 + 1e-4 && a.z.abs() <= 3.0);
        for _ in 0..1000 {
            gains().update(&mut state, 0.548, &still(), &far, false, 0.1);
        }
        assert!(state.integral.amax() <= 2.0);
    }

    #[test]
    fn what_the_reference_does_is_fed_forward_and_speed_has_a_limit() {
        let ahead = gains();
        let forward = PositionGains {
            velocity_feed_forward: 1.0,
            acceleration_feed_forward: 1.0,
            speed_max_m_s: 2.0,
            acceleration_max_horizontal_m_s2: 100.0,
            ..ahead
        };
        let mut reference = at(0.0, 0.0, 0.0);
        reference.velocity.vector.x = 1.0;
        reference.acceleration.vector.x = 0.5;
        // 2.5 * 1 and 0.15 * 0.1, and half of it again.
        let a = tick(&forward, &still(), &reference).acceleration.vector;
        assert!((a - Vector3::new(2.5 + 0.015 + 0.5, 0.0, 0.0)).norm() < 1e-5, "{a}");
        assert_eq!(tick(&ahead, &still(), &reference).acceleration.vector, Vector3::zeros());
        let far = tick(&forward, &still(), &at(30.0, 40.0, 5.0)).velocity_desired.vector;
        assert!((far - Vector3::new(1.2, 1.6, 4.0)).norm() < 1e-5, "{far}");
    }

    /// Braked with the given acceleration from the speed that is asked for, the vehicle comes to
    /// rest at the reference but for the lag of the proportional law, `v / k`; nearby, and without
    /// a limit, nothing changes.
    #[test]
    fn an_approach_is_no_faster_than_can_be_braked() {
        let slow = PositionGains { approach_max_m_s2: 2.0, ..gains() };
        for distance in [0.5_f32, 0.78, 0.79, 3.0, 30.0] {
            let speed = |gains: &PositionGains| {
                let terms = tick(gains, &still(), &at(0.6 * distance, -0.8 * distance, -1.0));
                assert!(
                    (terms.velocity_desired.vector.z + 0.8).abs() < 1e-6,
                    "height has a loop of its own"
                );
                terms.velocity_desired.vector.xy().norm()
            };
            let (v, proportional) = (speed(&slow), speed(&gains()));
            assert!((proportional - 1.6 * distance).abs() < 1e-4);
            // Where both laws join, a / k^2.
            if distance < 2.0 / 2.56 {
                assert_eq!(v, proportional, "{distance}");
            } else {
                let lag = 2.0 / (2.0 * 2.56);
                assert!((v * v / 4.0 - (distance - lag)).abs() < 1e-3, "{v} m/s at {distance} m");
            }
        }
        assert_eq!(tick(&slow, &still(), &at(0.0, 0.0, 0.0)).velocity_desired, In::zero());
    }

    #[test]
    fn a_bad_gain_is_named() {
        let mut bad = gains();
        bad.velocity_per_s.y = f32::NAN;
        assert!(
            bad.check()
                .unwrap_err()
                .to_string()
                .starts_with("control.position.velocity_per_s[1] = NaN")
        );
        gains().check().unwrap();
    }
}
