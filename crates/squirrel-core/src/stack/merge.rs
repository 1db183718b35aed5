//! What a frame adds to what is known.

use super::Known;
use crate::command::PilotCommand;
use crate::frame::{POSITION_MAX_M, SensorFrame, is_voltage};
use crate::frames::{Body, Ned, Rotation};
use crate::math::all_finite;

impl SensorFrame {
    /// Takes over what is valid, and says what came of it.
    pub(super) fn merge_into(&self, known: &mut Known) -> Merged {
        let mut rejected = 0;
        let mut accept = |valid: bool| {
            rejected += u32::from(!valid);
            valid
        };
        let imu = self.imu.as_ref().filter(|imu| accept(imu.is_reading()));
        let is_turn =
            |q: &Rotation<Ned, Body, f32>| (q.quaternion.norm_squared() - 1.0).abs() < 1e-3;
        let attitude = self.attitude.as_ref().filter(|q| accept(is_turn(q)));
        let gnss = self.gnss.as_ref().filter(|gnss| accept(gnss.is_reading()));
        let altitude_m =
            self.altitude_m.as_ref().filter(|altitude| accept(altitude.abs() <= POSITION_MAX_M));
        if let Some(force) = self.wing_force
            && accept(all_finite(&force.vector))
        {
            known.wing_force = Some(force);
        }
        let voltage_v = self.battery_v.filter(|voltage_v| accept(is_voltage(*voltage_v)));
        let mut commanded = false;
        if let Some(PilotCommand { attitude: a, wing }) = self.command
            // Finite where all of them are.
            && accept((a.roll_rad + a.pitch_rad + a.thrust_n + wing).is_finite())
        {
            known.command = self.command;
            commanded = true;
        }
        Merged {
            imu: Heard::replace(&mut known.imu, imu),
            attitude: Heard::replace(&mut known.attitude, attitude),
            gnss: Heard::replace(&mut known.gnss, gnss),
            altitude: Heard::replace(&mut known.altitude_m, altitude_m),
            voltage_v,
            commanded,
            rejected,
        }
    }
}

/// What a frame brought of one sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Heard {
    /// Nothing, or nothing valid.
    Nothing,
    /// What was known already, bit for bit.
    Same,
    /// A new reading.
    New,
}

impl Heard {
    fn replace<T: PartialEq + Copy>(known: &mut Option<T>, reading: Option<&T>) -> Self {
        let Some(reading) = reading else { return Self::Nothing };
        let heard = if known.as_ref() == Some(reading) { Self::Same } else { Self::New };
        *known = Some(*reading);
        heard
    }
}

/// What came of a frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Merged {
    pub(super) imu: Heard,
    pub(super) attitude: Heard,
    pub(super) gnss: Heard,
    pub(super) altitude: Heard,
    /// Voltage of the battery, V.
    pub(super) voltage_v: Option<f32>,
    /// A command came from outside.
    pub(super) commanded: bool,
    /// Measurements that were not finite, or larger than any flight.
    pub(super) rejected: u32,
}
