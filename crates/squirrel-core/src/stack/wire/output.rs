//! What goes into a step and what comes out of it.

use super::{Reader, Wire, Writer, wire_enum, wire_struct};
use crate::control::backstepping::AttitudeTerms;
use crate::control::command_filter::EulerReference;
use crate::control::mixer::{MixerTerms, ThrustTorque};
use crate::control::position::PositionTerms;
use crate::control::twcc::{Mode, Reason, TwccTerms};
use crate::control::wing_force::{Guard, ParnnTerms};
use crate::control::woeg::WingFlag;
use crate::control::{AttitudeThrust, Reference};
use crate::estimate::navigator::{Health, NavigationTerms};
use crate::guidance::excite::Excitation;
use crate::guidance::sensing::Obstacle;
use crate::policy::PilotCommand;
use crate::rnn::head::Correction;
use crate::rnn::parnn::Estimate;
use crate::stack::failsafe::{Failsafe, FailsafeMode, FailsafeReason};
use crate::stack::{Gnss, Imu, InnerTerms, SensorFrame, StackOutput};

/// Obstacles as a count and as many obstacles.
impl Wire for SensorFrame {
    fn put(&self, to: &mut Writer<'_>) {
        self.time_us.put(to);
        self.imu.put(to);
        self.imu_2.put(to);
        self.attitude.put(to);
        self.gnss.put(to);
        self.altitude_m.put(to);
        self.magnetic.put(to);
        self.battery_v.put(to);
        self.wing_force.put(to);
        self.command.put(to);
        (self.obstacles().len() as u8).put(to);
        for obstacle in self.obstacles() {
            obstacle.put(to);
        }
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        let mut frame = Self::empty(Wire::take(from)?);
        frame.imu = Wire::take(from)?;
        frame.imu_2 = Wire::take(from)?;
        frame.attitude = Wire::take(from)?;
        frame.gnss = Wire::take(from)?;
        frame.altitude_m = Wire::take(from)?;
        frame.magnetic = Wire::take(from)?;
        frame.battery_v = Wire::take(from)?;
        frame.wing_force = Wire::take(from)?;
        frame.command = Wire::take(from)?;
        let mut obstacles =
            [Obstacle { id: 0, north_m: 0.0, east_m: 0.0 }; super::super::MAX_OBSTACLES];
        let seen = obstacles.get_mut(..usize::from(u8::take(from)?))?;
        for place in seen.iter_mut() {
            *place = Wire::take(from)?;
        }
        frame.set_obstacles(seen);
        Some(frame)
    }
}

impl Wire for Health {
    fn put(&self, to: &mut Writer<'_>) {
        self.0.put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        u16::take(from).map(Self)
    }
}

wire_struct! {
    Imu { omega, specific_force }
    Gnss { position, velocity }
    Obstacle { id, north_m, east_m }
    StackOutput { rotor_command, wing_command, reference, rejected, failsafe, health, navigation, wind, outer, inner }
    NavigationTerms { ned_from_body, gyro_bias, position, velocity }
    Failsafe { mode, reason }
    Reference { position, velocity, acceleration, yaw_rad }
    TwccTerms {
        position, wing_force, parnn, angle_of_attack_rad, wing, mode, reason, command, wing_command, clamped,
    }
    PositionTerms {
        position_error, velocity_desired, velocity_error, velocity_error_slope, integral, acceleration_demand,
        acceleration, request,
    }
    AttitudeThrust { roll_rad, pitch_rad, thrust_n }
    PilotCommand { attitude, wing }
    ParnnTerms { guard, estimate }
    Estimate { force, correction, alpha_est_rad }
    Correction<f32> { alpha_w_rad, gamma }
    WingFlag { helpful_n, flag }
    InnerTerms { filter, excitation, attitude, demand, mixer }
    EulerReference { angle, rate, acceleration }
    Excitation { attitude, thrust_share }
    AttitudeTerms { angle_error, rate_error, integral, gyroscopic_n_m, torque_n_m }
    ThrustTorque { thrust_n, torque_n_m }
    MixerTerms { rotor_thrust_n, achieved, roll_pitch_share, saturated }
}

wire_enum! {
    FailsafeMode { Off, Level, Cut }
    FailsafeReason {
        None, ClockStuck, ImuLost, ImuStuck, AttitudeLost, AttitudeStuck, GnssLost, GnssStuck, AltitudeLost,
        CommandLost,
    }
    Mode { Primary, WingsOpen, FullThrust }
    Reason { InsideLimits, WingsWouldNotHelp, RollLimit, PitchLimit, ThrustLimit, Dwell, PolicyFixed, WingsComeCloser }
    Guard { Inside, WindowNotFull, Speed, AngleOfAttack }
}
