//! Everything that is constant in flight: vehicle, gains, mission. What is derived from them is
//! derived again on the target.

use super::{Reader, Wire, Writer, wire_enum, wire_struct};
use crate::control::backstepping::{AttitudeForm, AttitudeGains};
use crate::control::plus::{Feels, Plus, TiltLimit};
use crate::control::position::{AngleLaw, PositionGains};
use crate::control::supply::ThrustByVoltage;
use crate::control::twcc::{Trigger, TwccParameters, WingPolicy};
use crate::control::wiic::ThrustLaw;
use crate::control::wing_force::ForceModel;
use crate::control::woeg::{WingEvents, WingTest};
use crate::estimate::altitude::AltitudeParameters;
use crate::estimate::eskf::EskfParameters;
use crate::estimate::mahony::MahonyParameters;
use crate::estimate::mekf::MekfParameters;
use crate::estimate::navigator::{Filter, Navigation, Start};
use crate::estimate::rkf::{Fading, RkfParameters};
use crate::guidance::excite::{Leg, Line, Multisine, Programme};
use crate::guidance::mission::{Mission, Steering, TurnSide};
use crate::guidance::sensing::Sensing;
use crate::guidance::trajectory::Trajectory;
use crate::rnn::elman::{Dense, Elman, Recurrent};
use crate::rnn::parnn::{Domain, HIDDEN, INPUTS, Parnn};
use crate::stack::{Stack, StackParameters};
use crate::vehicle::{
    CommandKind, Drag, Limits, MAX_ROTORS, Parameters, Propulsion, Rotor, RotorAir, ThrustCurve,
    Vehicle, Wing,
};

impl Wire for Stack {
    fn put(&self, to: &mut Writer<'_>) {
        self.vehicle.parameters().put(to);
        self.parameters.put(to);
        self.mission.put(to);
    }
    /// `None` also where [`Stack::new`] refuses the numbers.
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        let vehicle = Vehicle::new(Wire::take(from)?).ok()?;
        Self::new(vehicle, Wire::take(from)?, Wire::take(from)?).ok()
    }
}

impl Wire for Parameters<f32> {
    fn put(&self, to: &mut Writer<'_>) {
        self.mass_kg.put(to);
        self.inertia_kg_m2.put(to);
        self.rotors.put(to);
        (self.rotor_count as u8).put(to);
        self.propulsion.put(to);
        self.drag.put(to);
        self.wing.put(to);
        self.limits.put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            mass_kg: Wire::take(from)?,
            inertia_kg_m2: Wire::take(from)?,
            rotors: <[Rotor<f32>; MAX_ROTORS]>::take(from)?,
            rotor_count: usize::from(u8::take(from)?),
            propulsion: Wire::take(from)?,
            drag: Wire::take(from)?,
            wing: Wire::take(from)?,
            limits: Wire::take(from)?,
        })
    }
}

/// Coefficients and the top of their range; checked again.
impl Wire for ThrustCurve<f32> {
    fn put(&self, to: &mut Writer<'_>) {
        self.coefficients().put(to);
        self.voltage_max_v().put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        Self::new(Wire::take(from)?, Wire::take(from)?).ok()
    }
}

impl Wire for ForceModel {
    fn put(&self, to: &mut Writer<'_>) {
        match self {
            Self::FlatPlate => 0u8.put(to),
            Self::Given => 1u8.put(to),
            Self::Parnn(parnn) => {
                2u8.put(to);
                parnn.put(to);
            }
        }
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        match u8::take(from)? {
            0 => Some(Self::FlatPlate),
            1 => Some(Self::Given),
            2 => Wire::take(from).map(Self::Parnn),
            _ => None,
        }
    }
}

impl Wire for Filter {
    fn put(&self, to: &mut Writer<'_>) {
        match self {
            Self::External => 0u8.put(to),
            Self::Rkf(parameters) => {
                1u8.put(to);
                parameters.put(to);
            }
            Self::Mahony(parameters) => {
                2u8.put(to);
                parameters.put(to);
            }
            Self::Mekf(parameters) => {
                3u8.put(to);
                parameters.put(to);
            }
            Self::Eskf(parameters) => {
                4u8.put(to);
                parameters.put(to);
            }
        }
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        match u8::take(from)? {
            0 => Some(Self::External),
            1 => Wire::take(from).map(Self::Rkf),
            2 => Wire::take(from).map(Self::Mahony),
            3 => Wire::take(from).map(Self::Mekf),
            4 => Wire::take(from).map(Self::Eskf),
            _ => None,
        }
    }
}

impl Wire for Mission {
    fn put(&self, to: &mut Writer<'_>) {
        match self {
            Self::Hover { position } => {
                0u8.put(to);
                position.put(to);
            }
            Self::Avoid { run, sensing, steering } => {
                1u8.put(to);
                run.put(to);
                sensing.put(to);
                steering.put(to);
            }
            Self::Circle { centre, radius_m, speed_m_s } => {
                2u8.put(to);
                centre.put(to);
                radius_m.put(to);
                speed_m_s.put(to);
            }
            Self::Excite(programme) => {
                3u8.put(to);
                programme.put(to);
            }
        }
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        match u8::take(from)? {
            0 => Some(Self::Hover { position: Wire::take(from)? }),
            1 => Some(Self::Avoid {
                run: Wire::take(from)?,
                sensing: Wire::take(from)?,
                steering: Wire::take(from)?,
            }),
            2 => Some(Self::Circle {
                centre: Wire::take(from)?,
                radius_m: Wire::take(from)?,
                speed_m_s: Wire::take(from)?,
            }),
            3 => Wire::take(from).map(Self::Excite),
            _ => None,
        }
    }
}

impl Wire for Trajectory {
    fn put(&self, to: &mut Writer<'_>) {
        self.start.put(to);
        self.course_rad().put(to);
        self.speed_m_s.put(to);
        self.ramp_s.put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self::new(Wire::take(from)?, Wire::take(from)?, Wire::take(from)?, Wire::take(from)?))
    }
}

/// The number of legs, then as many legs; checked again.
impl Wire for Programme {
    fn put(&self, to: &mut Writer<'_>) {
        self.start.put(to);
        (self.legs().len() as u8).put(to);
        for leg in self.legs() {
            leg.put(to);
        }
        self.multisine().put(to);
    }
    fn take(from: &mut Reader<'_>) -> Option<Self> {
        let start = Wire::take(from)?;
        let mut legs = [Leg::UNUSED; crate::guidance::excite::MAX_LEGS];
        let used = legs.get_mut(..usize::from(u8::take(from)?))?;
        for leg in used.iter_mut() {
            *leg = Wire::take(from)?;
        }
        Self::new(start, used, Wire::take(from)?).ok()
    }
}

wire_struct! {
    Rotor<f32> { position, yaw_sign }
    Propulsion<f32> {
        command, speed_max_rad_s, thrust_coefficient_n_s2, torque_coefficient_n_m_s2, time_constant_up_s,
        time_constant_down_s, propeller_radius_m, air,
        reference_voltage_v, thrust_curve,
    }
    RotorAir<f32> {
        axial_inflow_s_per_m, translational_lift_s2_per_m2, flapping_moment_n_m_s_per_m, vortex_ring_fraction,
    }
    Drag<f32> { linear_n_s_per_m, area_m2 }
    Wing<f32> {
        area_per_side_m2, normal_force_slope, lateral_arm_m, longitudinal_arm_m, vertical_arm_m, chord_m,
        time_constant_s,
    }
    Limits<f32> { tilt_max_rad, thrust_max_n, rotor_thrust_max_n }
    StackParameters { attitude, twcc, navigation, thrust }
    ThrustByVoltage { exponent, reference_v }
    AttitudeGains {
        form, c1_per_s, c2_per_s, lambda_per_s2, integral_max_rad_s, rotor_lead, filter_frequency_rad_s, filter_damping,
    }
    Navigation { filter, altitude, start }
    Start { ned_from_body, gyro_bias, position, fix_offset, altitude_offset_m }
    AltitudeParameters { accel_noise_m_s2, bias_walk_m_s2_root_s, baro_noise_m }
    RkfParameters { gyro_noise_rad_s, accel_noise_m_s2, external_memory, fading }
    MahonyParameters { proportional_per_s, integral_per_s2, gate_m_s2 }
    MekfParameters {
        gyro_noise_rad_s, bias_walk_rad_s_root_s, bias_deviation_rad_s, fix_noise_m_s2, alone_noise_m_s2, gate_m_s2,
        heading_noise_rad,
    }
    EskfParameters {
        gyro_noise_rad_s, accel_noise_m_s2, gyro_walk_rad_s_root_s, accel_walk_m_s2_root_s, start_turn_rad,
        start_heading_rad, start_gyro_bias_rad_s, start_accel_bias_m_s2, gnss_position_noise_m, gnss_velocity_noise_m_s, gnss_latency_s,
        baro_noise_m, heading_noise_rad, alone_noise_m_s2, gate,
    }
    TwccParameters {
        position, wing_events, thrust_law, trigger, force_model, policy, dwell_s, thrust_min_n, plus,
    }
    Plus { position, delay_s, vertical_weight, height_band_m, sink_band_m, thrust_share, approach_share, open_above_m_s2, wing_download_n, feels, tilt_limit }
    PositionGains {
        position_per_s, velocity_per_s, integral_per_s2, derivative, velocity_feed_forward, acceleration_feed_forward, approach_max_m_s2,
        speed_max_m_s, acceleration_max_horizontal_m_s2, acceleration_max_vertical_m_s2, integral_max_m, angle_law,
    }
    WingEvents { test, open_above_n, close_below_n }
    Parnn { net, area_m2, domain }
    Elman<INPUTS, HIDDEN, 2> { first, second, output }
    Recurrent<INPUTS, HIDDEN> { input, hidden, bias }
    Recurrent<HIDDEN, HIDDEN> { input, hidden, bias }
    Dense<HIDDEN, 2> { weight, bias }
    Domain { speed_m_s, alpha_rad }
    Sensing { range_m, half_view_rad, speed_min_m_s }
    Steering { min_rad, max_rad, ramp_s, side, seed }
    Leg { duration_s, move_s, ramp_s, to, yaw_rad, wings_s }
    Multisine { lines }
    Line { frequency_hz, amplitude, phase }
}

wire_enum! {
    Fading { None, Single, Multiple }
    CommandKind { SpeedFraction, Duty, PwmMicroseconds, ThrustNewton }
    AttitudeForm { Euler, Quaternion }
    AngleLaw { SmallAngle, Exact }
    TurnSide { Angle, Drawn, Away }
    WingTest { Normal, Acceleration }
    ThrustLaw { Literal, Exact }
    Trigger { Angle, AngleOrThrust }
    Feels { BodyZ, Everything }
    TiltLimit { Box, Cone }
    WingPolicy { Folded, Open, Coordinated, CoordinatedWithoutWings }
}
