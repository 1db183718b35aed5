//! Sensor faults put into recorded frames: to see what the flight code does when a sensor fails.
//!
//! A [`Fault`] is one sensor, one kind and a window of time. What it makes of a flight's frames is
//! no closed loop: the vehicle in the log does not feel what the flight code answers.

use squirrel_core::frames::{In, Rotation};
use squirrel_core::guidance::mission::scramble;
use squirrel_core::nalgebra::{Quaternion, Unit, Vector3};
use squirrel_core::stack::SensorFrame;

/// What fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensor {
    /// Inertial units.
    Imu,
    /// Attitude.
    Attitude,
    /// Position and velocity.
    Gnss,
    /// Barometer.
    Altitude,
    /// All of them; and where they are missing or late, the frame too.
    All,
}

/// How it fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorFaultKind {
    /// One number is NaN.
    NotANumber,
    /// One number is infinite.
    Infinite,
    /// It repeats its last reading.
    Stuck,
    /// For half of the window nothing comes, then readings that are that old.
    Late,
    /// Nothing comes.
    Missing,
}

/// One fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// What fails.
    pub sensor: Sensor,
    /// How.
    pub kind: SensorFaultKind,
    /// From this time, us.
    pub start_us: u64,
    /// Up to this time, us.
    pub end_us: u64,
}

const SENSORS: [Sensor; 5] =
    [Sensor::Imu, Sensor::Attitude, Sensor::Gnss, Sensor::Altitude, Sensor::All];
const KINDS: [SensorFaultKind; 5] = [
    SensorFaultKind::NotANumber,
    SensorFaultKind::Infinite,
    SensorFaultKind::Stuck,
    SensorFaultKind::Late,
    SensorFaultKind::Missing,
];
/// Before and after the fault the flight is well for this long, us.
const WELL_US: [u64; 2] = [500_000, 1_000_000];
/// Longest fault, us.
const LONGEST_US: u64 = 2_400_000;

impl Fault {
    /// A piece of a flight with a fault, drawn from a seed: half a second well, up to 2.4 s with
    /// the fault, a second well.
    ///
    /// * `frames` - of a flight of at least 5 s
    ///
    /// # Errors
    /// One line where the flight is shorter.
    pub fn draw(frames: &[SensorFrame], seed: u32) -> Result<(Self, Vec<SensorFrame>), String> {
        let draw =
            |k: u32, of: u64| u64::from(scramble(seed.wrapping_mul(5).wrapping_add(k + 1))) % of;
        let length_us = WELL_US[0] + LONGEST_US + WELL_US[1];
        let (Some(first), Some(last)) = (frames.first(), frames.last()) else {
            return Err("no frames".to_owned());
        };
        let room_us = (last.time_us - first.time_us).checked_sub(length_us + 1_000_000);
        let Some(room_us) = room_us else {
            return Err(format!("{} frames are too few for a fault: must be 5 s", frames.len()));
        };
        let from_us = first.time_us + draw(0, room_us + 1);
        let start_us = from_us + WELL_US[0];
        let end_us = start_us + 1 + draw(1, LONGEST_US);
        let fault = Self {
            sensor: SENSORS[draw(2, SENSORS.len() as u64) as usize],
            kind: KINDS[draw(3, KINDS.len() as u64) as usize],
            start_us,
            end_us,
        };
        let piece = |f: &&SensorFrame| f.time_us >= from_us && f.time_us < end_us + WELL_US[1];
        let piece: Vec<SensorFrame> = frames.iter().filter(piece).copied().collect();
        Ok((fault, fault.put_into(&piece)))
    }

    /// The frames with the fault in them.
    pub fn put_into(&self, frames: &[SensorFrame]) -> Vec<SensorFrame> {
        let mut out = Vec::with_capacity(frames.len());
        let mut good = SensorFrame::empty(0);
        let late_us = (self.end_us - self.start_us) / 2;
        for frame in frames {
            if !(self.start_us..self.end_us).contains(&frame.time_us) {
                // The last reading of each sensor, for those that hang.
                good.imu = frame.imu.or(good.imu);
                good.imu_2 = frame.imu_2.or(good.imu_2);
                good.attitude = frame.attitude.or(good.attitude);
                good.gnss = frame.gnss.or(good.gnss);
                good.altitude_m = frame.altitude_m.or(good.altitude_m);
                out.push(*frame);
                continue;
            }
            let old = match self.kind {
                SensorFaultKind::Late => {
                    let sent = frame.time_us.saturating_sub(late_us).max(self.start_us);
                    let then = frames.partition_point(|f| f.time_us < sent);
                    (frame.time_us >= self.start_us + late_us).then(|| frames[then])
                }
                _ => None,
            };
            let whole = self.sensor == Sensor::All && old.is_none();
            if whole && matches!(self.kind, SensorFaultKind::Late | SensorFaultKind::Missing) {
                continue;
            }
            let mut broken = *frame;
            let hit = |sensor| self.sensor == sensor || self.sensor == Sensor::All;
            let bad = if self.kind == SensorFaultKind::Infinite { f32::INFINITY } else { f32::NAN };
            let old = old.unwrap_or(SensorFrame::empty(0));
            match self.kind {
                SensorFaultKind::NotANumber | SensorFaultKind::Infinite => {
                    for imu in [&mut broken.imu, &mut broken.imu_2] {
                        if let Some(imu) = imu.as_mut().filter(|_| hit(Sensor::Imu)) {
                            imu.omega = In::new(Vector3::new(imu.omega.vector.x, bad, 0.0));
                        }
                    }
                    if let Some(q) = broken.attitude.as_mut().filter(|_| hit(Sensor::Attitude)) {
                        *q =
                            Rotation::new(Unit::new_unchecked(Quaternion::new(bad, 0.0, 0.0, 0.0)));
                    }
                    if let Some(gnss) = broken.gnss.as_mut().filter(|_| hit(Sensor::Gnss)) {
                        gnss.velocity = In::new(Vector3::new(0.0, bad, 0.0));
                    }
                    if hit(Sensor::Altitude) {
                        broken.altitude_m = broken.altitude_m.map(|_| bad);
                    }
                }
                SensorFaultKind::Stuck => {
                    if hit(Sensor::Imu) {
                        broken.imu = broken.imu.and(good.imu);
                        broken.imu_2 = broken.imu_2.and(good.imu_2);
                    }
                    if hit(Sensor::Attitude) {
                        broken.attitude = broken.attitude.and(good.attitude);
                    }
                    if hit(Sensor::Gnss) {
                        broken.gnss = broken.gnss.and(good.gnss);
                    }
                    if hit(Sensor::Altitude) {
                        broken.altitude_m = broken.altitude_m.and(good.altitude_m);
                    }
                }
                SensorFaultKind::Late | SensorFaultKind::Missing => {
                    if hit(Sensor::Imu) {
                        (broken.imu, broken.imu_2) = (old.imu, old.imu_2);
                    }
                    if hit(Sensor::Attitude) {
                        broken.attitude = old.attitude;
                    }
                    if hit(Sensor::Gnss) {
                        broken.gnss = old.gnss;
                    }
                    if hit(Sensor::Altitude) {
                        broken.altitude_m = old.altitude_m;
                    }
                }
            }
            out.push(broken);
        }
        out
    }
}
