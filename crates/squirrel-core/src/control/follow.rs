//! Following a plan: the thrust vector that was planned, with the errors of position and velocity
//! on top.
//!
//! ```text
//! -U n = F(t + delay) + m (k_p (p(t) - p_measured) + k_v (v(t) - v_measured))        F: what the rotors push
//! ```
//! The plan's thrust already holds the air's part (docs/equations.md G.1), so no wing model is
//! asked here; wings are told what the plan has for them when their servo will have moved. Where
//! the thrust does not suffice, height goes first.

use super::AttitudeThrust;
use super::backstepping::AttitudeGains;
use super::position::{MeasuredMotion, heading_frame};
use super::twcc::OuterAirframe;
use crate::command::PilotCommand;
use crate::frames::{In, Ned};
use crate::math::{GRAVITY_M_S2, limit, limit_norm, lower, sqrt, upper};
use crate::vehicle::{ParameterError, positive};
use nalgebra::Vector3;

/// One instant of a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanPoint {
    /// Position, m.
    pub position: In<Ned, f32>,
    /// Velocity, m/s.
    pub velocity: In<Ned, f32>,
    /// Force of the rotors, N.
    pub thrust: In<Ned, f32>,
    /// Deployment of both wings, 0 folded to 1 spread.
    pub wing: f32,
}

/// How firmly a plan is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowGains {
    /// Position error to acceleration, 1/s^2.
    pub position_per_s2: f32,
    /// Velocity error to acceleration, 1/s.
    pub velocity_per_s: f32,
    /// Limit of what errors may ask for, m/s^2.
    pub acceleration_max_m_s2: f32,
    /// From a command to the attitude and thrust that it asks for, s.
    pub delay_s: f32,
    /// From a command to a wing that has moved, s.
    pub wing_delay_s: f32,
}

/// Most of the thrust that goes into height: at all of it, a little more or less would be all or
/// nothing sideways, and turning back and forth takes more of the thrust than there is.
const HEIGHT_SHARE: f32 = 0.95;

/// What height has in any case, over the weight.
const WEIGHT_SHARE: f32 = 1.02;

impl FollowGains {
    /// For an attitude loop with these gains: what it adds to its command filter's delay is left
    /// to the errors (0.02 s more follows a turn with little thrust closer, and one with much
    /// thrust less closely).
    pub fn behind(attitude: &AttitudeGains) -> Self {
        Self {
            position_per_s2: 4.0,
            velocity_per_s: 3.5,
            acceleration_max_m_s2: 6.0,
            delay_s: attitude.filter_delay_s(),
            wing_delay_s: 0.05,
        }
    }

    /// # Errors
    /// The first number out of range, by its name.
    pub fn check(&self) -> Result<(), ParameterError> {
        positive("follow.position_per_s2", self.position_per_s2)?;
        positive("follow.velocity_per_s", self.velocity_per_s)?;
        positive("follow.acceleration_max_m_s2", self.acceleration_max_m_s2)?;
        for (field, x) in
            [("follow.delay_s", self.delay_s), ("follow.wing_delay_s", self.wing_delay_s)]
        {
            if !(0.0..=1.0).contains(&x) {
                return Err(ParameterError::of(field, x, "must be 0 to 1"));
            }
        }
        Ok(())
    }

    /// The command at an instant. Total for finite arguments: within the airframe's envelope.
    ///
    /// * `now` - the plan at this instant
    /// * `ahead` - its force of the rotors [`Self::delay_s`] later, N
    /// * `wing` - its deployment [`Self::wing_delay_s`] later
    pub fn command(
        &self,
        airframe: &OuterAirframe,
        motion: &MeasuredMotion,
        now: &PlanPoint,
        ahead: In<Ned, f32>,
        wing: f32,
    ) -> PilotCommand {
        let error = (now.position.vector - motion.position.vector) * self.position_per_s2
            + (now.velocity.vector - motion.velocity.vector) * self.velocity_per_s;
        // Along body z.
        let wanted =
            -ahead.vector - limit_norm(error, self.acceleration_max_m_s2) * airframe.mass_kg;
        let most = airframe.envelope.thrust_max_n;
        // Height first: what is left of the thrust goes sideways. A thrust that would have to pull
        // downwards is none.
        let hover_n = airframe.mass_kg * GRAVITY_M_S2 as f32;
        let most_down = lower(upper(HEIGHT_SHARE * most, WEIGHT_SHARE * hover_n), most);
        let down = limit(wanted.z, airframe.envelope.thrust_min_n, most_down);
        let level = heading_frame(&wanted, motion.heading_rad);
        let sideways =
            limit_norm(Vector3::new(level.x, level.y, 0.0), sqrt(most * most - down * down));
        let level = sideways.xy();
        let pitch_rad = libm::atan2f(level.x, down);
        let roll_rad = -libm::atan2f(level.y, libm::hypotf(level.x, down));
        let max = airframe.envelope.tilt_max_rad;
        let (roll_rad, pitch_rad) = (limit(roll_rad, -max, max), limit(pitch_rad, -max, max));
        let ((sr, cr), (sp, cp)) = (libm::sincosf(roll_rad), libm::sincosf(pitch_rad));
        let thrust_n =
            Vector3::new(sp * cr, -sr, cp * cr).dot(&Vector3::new(level.x, level.y, down));
        let command = AttitudeThrust { roll_rad, pitch_rad, thrust_n };
        PilotCommand { attitude: airframe.envelope.limit(&command), wing: limit(wing, 0.0, 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::backstepping::AttitudeForm;
    use super::super::command_filter::{Filter, Poles};
    use super::super::position::fixtures::still;
    use super::super::twcc::fixtures::airframe;
    use super::*;
    use crate::frames::{Body, Rotation};

    fn gains() -> FollowGains {
        FollowGains::behind(&attitude())
    }

    fn attitude() -> AttitudeGains {
        AttitudeGains {
            form: AttitudeForm::Quaternion,
            c1_per_s: Vector3::repeat(5.0),
            c2_per_s: Vector3::repeat(8.0),
            lambda_per_s2: Vector3::repeat(2.0),
            integral_max_rad_s: 0.1,
            rotor_lead: 1.0,
            filter_frequency_rad_s: 20.0,
            filter_damping: 1.0,
        }
    }

    fn hovering() -> PlanPoint {
        let thrust = In::new(Vector3::new(0.0, 0.0, -0.548 * 9.80665));
        PlanPoint { position: In::zero(), velocity: In::zero(), thrust, wing: 0.0 }
    }

    /// On the plan the command is the plan's thrust vector, whatever the heading.
    #[test]
    fn on_the_plan_the_thrust_is_the_plans() {
        for heading_rad in [0.0, 0.8, -2.0] {
            let thrust = Vector3::new(1.1, -0.8, -5.5);
            let motion = MeasuredMotion { heading_rad, ..still() };
            let command = gains().command(&airframe(), &motion, &hovering(), In::new(thrust), 1.0);
            let a = command.attitude;
            let ned_from_body =
                Rotation::<Ned, Body, f32>::from_euler(a.roll_rad, a.pitch_rad, heading_rad);
            let got = ned_from_body * In::new(Vector3::new(0.0, 0.0, -a.thrust_n));
            assert!((got.vector - thrust).norm() < 1e-4, "{heading_rad}: {}", got.vector);
            assert_eq!(command.wing, 1.0);
        }
    }

    /// Behind and below the plan: nose down and more thrust.
    #[test]
    fn errors_are_flown_out() {
        let ahead = PlanPoint { position: In::new(Vector3::new(0.3, 0.2, -0.2)), ..hovering() };
        let command =
            gains().command(&airframe(), &still(), &ahead, hovering().thrust, 0.0).attitude;
        assert!(
            command.pitch_rad < -0.05 && command.roll_rad > 0.03 && command.thrust_n > 5.4,
            "{command:?}"
        );
    }

    /// Whatever is asked for, the command stays in the envelope.
    #[test]
    fn commands_stay_in_the_envelope() {
        let airframe = airframe();
        for thrust in [[1e30, 0.0, -1e30], [0.0; 3], [-50.0, 80.0, 3.0], [0.0, 0.0, f32::MAX]] {
            for position in [0.0, 1e6, -1e30] {
                let far = PlanPoint { position: In::new(Vector3::repeat(position)), ..hovering() };
                let thrust = In::new(Vector3::from(thrust));
                let a = gains().command(&airframe, &still(), &far, thrust, 7.0);
                let e = airframe.envelope;
                let a = (a.attitude, a.wing);
                assert!(
                    a.0.roll_rad.abs() <= e.tilt_max_rad && a.0.pitch_rad.abs() <= e.tilt_max_rad
                );
                assert!((e.thrust_min_n..=e.thrust_max_n).contains(&a.0.thrust_n), "{a:?}");
                assert_eq!(a.1, 1.0);
            }
        }
    }

    /// A command goes out as long before the plan's thrust as the command filter holds it back: it
    /// is `2 zeta / w` behind a ramp (docs/equations.md B.2), here measured.
    #[test]
    fn what_is_ahead_is_the_filters_delay() {
        let attitude = attitude();
        let poles = Poles::new(attitude.filter_frequency_rad_s, attitude.filter_damping);
        let mut filter = Filter { angle: [0.0; 3], rate: [0.0; 3] };
        let (rate_rad_s, dt_s) = (0.2, 1.0 / 3000.0);
        let mut target = 0.0_f32;
        for _ in 0..6000 {
            target += rate_rad_s * dt_s;
            filter.step(&[target, 0.0, 0.0], &poles, dt_s);
        }
        let behind_s = (target - filter.angle[0]) / rate_rad_s;
        assert!((attitude.filter_delay_s() - behind_s).abs() < 0.001, "{behind_s}");
        assert_eq!(gains().delay_s, attitude.filter_delay_s());
    }

    #[test]
    fn a_bad_gain_is_named() {
        let bad = FollowGains { delay_s: f32::NAN, ..gains() };
        assert!(bad.check().unwrap_err().to_string().starts_with("follow.delay_s = NaN"));
        gains().check().unwrap();
    }
}
