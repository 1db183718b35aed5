//! `[faults]` of a scenario: what fails in flight, from when, for how long.

use crate::setting::SettingError;
use serde::{Deserialize, Serialize};

/// What can fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// No satellite fixes.
    GnssLost,
    /// The barometer reads `size` metres too much.
    BaroStep,
    /// One sample in ten of an inertial unit is off by `size` rad/s and ten times that in m/s^2.
    ImuSpike,
    /// An inertial unit repeats its last sample.
    ImuStuck,
    /// An inertial unit says NaN.
    ImuNan,
    /// An inertial unit is silent.
    ImuDead,
    /// The magnetic field is turned by `size` rad about down.
    CompassSwung,
    /// One rotor lacks `size`, a share of its thrust.
    MotorWeak,
    /// Wings do not move from `size`, 0 folded to 1 spread.
    WingStuck,
    /// All rotors lack `size`, a share of their thrust.
    BatterySag,
}

impl FaultKind {
    /// All kinds.
    pub const ALL: [Self; 10] = [
        Self::GnssLost,
        Self::BaroStep,
        Self::ImuSpike,
        Self::ImuStuck,
        Self::ImuNan,
        Self::ImuDead,
        Self::CompassSwung,
        Self::MotorWeak,
        Self::WingStuck,
        Self::BatterySag,
    ];

    /// Name in scenario files.
    pub fn name(self) -> &'static str {
        match self {
            Self::GnssLost => "gnss_lost",
            Self::BaroStep => "baro_step",
            Self::ImuSpike => "imu_spike",
            Self::ImuStuck => "imu_stuck",
            Self::ImuNan => "imu_nan",
            Self::ImuDead => "imu_dead",
            Self::CompassSwung => "compass_swung",
            Self::MotorWeak => "motor_weak",
            Self::WingStuck => "wing_stuck",
            Self::BatterySag => "battery_sag",
        }
    }

    /// Smallest and largest size, with its unit; `None` for what has none.
    fn sizes(self) -> Option<(f64, f64, &'static str)> {
        match self {
            Self::GnssLost | Self::ImuStuck | Self::ImuNan | Self::ImuDead => None,
            Self::BaroStep => Some((-1e3, 1e3, "m")),
            Self::ImuSpike => Some((0.0, 1e3, "rad/s")),
            Self::CompassSwung => Some((-4.0, 4.0, "rad")),
            Self::MotorWeak | Self::BatterySag => Some((0.0, 1.0, "a share")),
            Self::WingStuck => Some((0.0, 1.0, "deployment")),
        }
    }

    /// Which of it may fail: inertial units, rotors, wings.
    fn count(self, rotors: usize) -> Option<usize> {
        match self {
            Self::ImuSpike | Self::ImuStuck | Self::ImuNan | Self::ImuDead | Self::WingStuck => {
                Some(2)
            }
            Self::MotorWeak => Some(rotors),
            _ => None,
        }
    }
}

/// One fault.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultTable {
    /// From this time.
    pub start_s: f64,
    /// For so long; to the end if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// How much, in the unit of the kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<f64>,
    /// Which inertial unit (1, 2), rotor (1 and so on) or wing (1 left, 2 right); both units or
    /// wings if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub which: Option<u32>,
}

impl FaultTable {
    /// Whether it acts at a time, us.
    pub(crate) fn acts(&self, time_us: u64) -> bool {
        let t = time_us as f64 * 1e-6;
        t >= self.start_s && self.duration_s.is_none_or(|length| t < self.start_s + length)
    }

    /// Whether the part of this index, from 0, fails.
    pub(crate) fn hits(&self, part: usize) -> bool {
        self.which.is_none_or(|which| which as usize == part + 1)
    }

    /// # Errors
    /// `faults.kind.field = value: reason`.
    pub(crate) fn check(&self, kind: FaultKind, rotors: usize) -> Result<(), SettingError> {
        let name = kind.name();
        for (field, x) in [("start_s", Some(self.start_s)), ("duration_s", self.duration_s)] {
            if let Some(x) = x.filter(|x| !(0.0..=1e5).contains(x)) {
                return Err(SettingError::value(
                    format!("faults.{name}.{field}"),
                    x,
                    "must be 0 to 1e5",
                ));
            }
        }
        match (kind.sizes(), self.size) {
            (None, None) => {}
            (None, Some(x)) => {
                return Err(SettingError::value(
                    format!("faults.{name}.size"),
                    x,
                    "given, but this fault has no size",
                ));
            }
            (Some((low, high, unit)), x) => {
                let x = x.unwrap_or(f64::NAN);
                if !(low..=high).contains(&x) {
                    let reason = format!("must be {low} to {high} ({unit})");
                    return Err(SettingError::value(format!("faults.{name}.size"), x, reason));
                }
            }
        }
        let refused =
            |which, reason| SettingError::value(format!("faults.{name}.which"), which, reason);
        match (kind.count(rotors), self.which) {
            (Some(count), Some(which)) if (1..=count).contains(&(which as usize)) => Ok(()),
            (Some(count), Some(which)) => Err(refused(which, format!("must be 1 to {count}"))),
            (None, Some(which)) => Err(refused(which, "given, but there is only one".to_owned())),
            (_, None) if kind == FaultKind::MotorWeak => Err(SettingError::Missing {
                field: format!("faults.{name}.which"),
                what: "a rotor's number",
            }),
            (_, None) => Ok(()),
        }
    }
}
