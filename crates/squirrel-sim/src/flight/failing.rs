//! The scenario's faults at work: in what sensors say, in what rotors give, in whether wings move.

use super::FlightError;
use super::commands::Command;
use crate::scenario::{FaultKind, FaultTable, Scenario};
use squirrel_core::effects::Effects;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::{Rotation3, Vector3};
use squirrel_core::stack::{Imu, SensorFrame};

/// Every this many samples one spikes.
const SPIKE_EVERY: u64 = 10;

/// The faults of one flight.
pub(super) struct Failing {
    faults: Vec<(FaultKind, FaultTable)>,
    /// The last good sample of each unit.
    last: [Option<Imu>; 2],
    samples: u64,
}

impl Failing {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let faults = scenario.faults.iter().map(|(kind, table)| (*kind, *table)).collect();
        Self { faults, last: [None; 2], samples: 0 }
    }

    fn active(&self, time_us: u64) -> impl Iterator<Item = (FaultKind, FaultTable)> + '_ {
        self.faults.iter().filter(move |(_, table)| table.acts(time_us)).copied()
    }

    /// What sensors say instead.
    pub(super) fn spoil(&mut self, frame: &mut SensorFrame) {
        if self.faults.is_empty() {
            return;
        }
        let good = [frame.imu, frame.imu_2];
        let is_sample = good.iter().any(Option::is_some);
        self.samples += u64::from(is_sample);
        let is_spike = is_sample && self.samples.is_multiple_of(SPIKE_EVERY);
        let mut stuck = [false; 2];
        for (kind, table) in self.faults.iter().filter(|(_, table)| table.acts(frame.time_us)) {
            let size = table.size.unwrap_or(0.0);
            for (part, unit) in [&mut frame.imu, &mut frame.imu_2].into_iter().enumerate() {
                if !table.hits(part) {
                    continue;
                }
                match kind {
                    FaultKind::ImuSpike => {
                        if let Some(imu) = unit.as_mut().filter(|_| is_spike) {
                            imu.omega = imu.omega + In::new(Vector3::repeat(size as f32));
                            imu.specific_force =
                                imu.specific_force + In::new(Vector3::repeat(10.0 * size as f32));
                        }
                    }
                    FaultKind::ImuStuck => {
                        stuck[part] = true;
                        *unit = unit.and(self.last[part]);
                    }
                    FaultKind::ImuNan => {
                        if let Some(imu) = unit {
                            imu.omega = In::new(Vector3::repeat(f32::NAN));
                        }
                    }
                    FaultKind::ImuDead => *unit = None,
                    _ => {}
                }
            }
            match kind {
                FaultKind::GnssLost => frame.gnss = None,
                FaultKind::BaroStep => frame.altitude_m = frame.altitude_m.map(|h| h + size as f32),
                FaultKind::CompassSwung => {
                    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), size as f32);
                    frame.magnetic = frame.magnetic.map(|field| In::new(turn * field.vector));
                }
                _ => {}
            }
        }
        for part in 0..2 {
            if !stuck[part] {
                self.last[part] = good[part].or(self.last[part]);
            }
        }
    }

    /// What wings are told instead.
    pub(super) fn hold(&self, time_us: u64, command: &mut Command) {
        for (_, table) in self.active(time_us).filter(|(kind, _)| *kind == FaultKind::WingStuck) {
            for (side, wing) in command.wing.iter_mut().enumerate() {
                if table.hits(side) {
                    *wing = table.size.unwrap_or(0.0);
                }
            }
        }
    }

    /// Whether rotors are weak now.
    pub(super) fn is_weak(&self, time_us: u64) -> bool {
        self.active(time_us)
            .any(|(kind, _)| matches!(kind, FaultKind::MotorWeak | FaultKind::BatterySag))
    }

    /// A vehicle's effects and those of its rotors' faults; `None` where there are none.
    ///
    /// # Errors
    /// The vehicle has such an effect already, or rotors fail at different times.
    pub(super) fn weakened(
        &self,
        effects: &Effects<f64>,
    ) -> Result<Option<Effects<f64>>, FlightError> {
        let (mut effects, mut first) = (*effects, None::<FaultTable>);
        for (kind, table) in &self.faults {
            let size = table.size.unwrap_or(0.0);
            let (effect, values) = match kind {
                FaultKind::MotorWeak => {
                    ("weak_rotor", vec![f64::from(table.which.unwrap_or(1)), size])
                }
                FaultKind::BatterySag => ("thrust_coefficient", vec![-size]),
                _ => continue,
            };
            let kind = kind.name();
            let is_taken = effects.get_mut(effect).is_some();
            match effects.insert(effect) {
                Some(found) if !is_taken => found.values[..values.len()].copy_from_slice(&values),
                _ => {
                    return Err(FlightError(format!(
                        "faults.{kind}: the vehicle has effects.{effect} already"
                    )));
                }
            }
            let window = |table: &FaultTable| (table.start_s, table.duration_s);
            if first.as_ref().is_some_and(|first| window(first) != window(table)) {
                let start_s = table.start_s;
                let reason = "must begin and end with the other fault of rotors";
                return Err(FlightError(format!("faults.{kind}.start_s = {start_s}: {reason}")));
            }
            first = Some(*table);
        }
        Ok(first.map(|_| effects))
    }
}
