//! Failsafe: what flies when a sensor can no longer be believed.
//!
//! A sensor is *lost* when nothing valid came from it for longer than its limit; what is not finite
//! counts as nothing. It is *stuck* when it repeats itself bit for bit although it would have had
//! to change: a gyroscope that turns, an attitude while the gyroscope turns, a position with a
//! speed, an altitude with a vertical speed. (A sensor that hangs on a reading of perfect rest is
//! not noticed.) A sensor that never spoke is not lost: the vehicle has not taken off with it.
//!
//! | what is gone | reaction |
//! |---|---|
//! | angular rate, attitude, the clock | [`FailsafeMode::Cut`]: rotors stop, wings fold |
//! | position and velocity | [`FailsafeMode::Level`]: level, wings folded, down at [`DESCENT_M_S`] where the flight code estimates how fast it sinks, else with a little less thrust than weight |
//! | altitude | none; the height is that of the satellite fix, and the reason is reported |
//! | commands from outside | the outer loop flies again, without any memory; the reason is reported |
//!
//! Where the flight code estimates, position and velocity are gone once no fix was believed for
//! `LOST_S` of [`crate::estimate::navigator`], and the inertial units repeat themselves where all
//! of them do.
//!
//! When all is well again for [`RECOVERY_US`], control resumes without any memory of the time
//! before.

use super::Known;
use super::merge::{Heard, Merged};
use crate::math::{GRAVITY_M_S2, limit};
use nalgebra::Vector3;

/// The inertial unit is lost after this time, us.
pub const IMU_LIMIT_US: u32 = 100_000;
/// The attitude is lost after this time, us.
pub const ATTITUDE_LIMIT_US: u32 = 250_000;
/// Position and velocity are lost after this time, us: a receiver at 1 Hz may be late by half a
/// second.
pub const GNSS_LIMIT_US: u32 = 1_500_000;
/// The altitude is lost after this time, us.
pub const ALTITUDE_LIMIT_US: u32 = 1_000_000;
/// Commands from outside are lost after this time, us: 25 of them at [`crate::policy::RATE_HZ`].
pub const COMMAND_LIMIT_US: u32 = 500_000;
/// A sensor must be well for this time before it is believed again, us.
pub const RECOVERY_US: u32 = 200_000;
/// Thrust over weight of [`FailsafeMode::Level`] where nobody knows how fast it sinks: slowly at
/// first.
pub const LEVEL_THRUST_SHARE: f32 = 0.95;
/// How fast it comes down where somebody does, m/s.
pub const DESCENT_M_S: f32 = 1.0;
/// Acceleration for an error of that, 1/s, and the shares of the weight that it may take.
const DESCENT_PER_S: f32 = 2.0;
const DESCENT_SHARES: [f32; 2] = [0.6, 1.4];

/// Thrust over weight that brings a level vehicle down at [`DESCENT_M_S`].
pub(super) fn descending(descent_m_s: f32) -> f32 {
    let share = 1.0 + DESCENT_PER_S / GRAVITY_M_S2 as f32 * (descent_m_s - DESCENT_M_S);
    limit(share, DESCENT_SHARES[0], DESCENT_SHARES[1])
}

/// Repeated readings of the inertial unit, where it says that the vehicle turns faster than
/// [`TURNING_RAD_S`].
const IMU_REPEATS: u16 = 100;
const TURNING_RAD_S: f32 = 1e-3;
/// Repeated attitudes, where the gyroscope turned further than [`TURNED_RAD`] meanwhile.
const ATTITUDE_REPEATS: u16 = 10;
const TURNED_RAD: f32 = 0.1;
/// Repeated fixes that are faster than [`MOVING_M_S`].
const GNSS_REPEATS: u16 = 5;
const MOVING_M_S: f32 = 1.0;
/// Repeated altitudes, where the vertical velocity makes more than [`CLIMBED_M`] meanwhile.
const ALTITUDE_REPEATS: u16 = 25;
const CLIMBED_M: f32 = 1.0;
/// Frames in which time did not go on.
const CLOCK_REPEATS: u16 = 15;

/// What flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum FailsafeMode {
    /// The mission.
    #[default]
    Off = 0,
    /// Level, sinking, wings folded.
    Level = 1,
    /// Nothing: rotors stand, wings folded.
    Cut = 2,
}

/// Why; of several the first that holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FailsafeReason {
    /// All is well.
    #[default]
    None = 0,
    /// Time does not go on.
    ClockStuck = 1,
    /// No valid inertial measurement.
    ImuLost = 2,
    /// The inertial unit repeats itself.
    ImuStuck = 3,
    /// No valid attitude.
    AttitudeLost = 4,
    /// The attitude repeats itself.
    AttitudeStuck = 5,
    /// No valid fix.
    GnssLost = 6,
    /// The fix repeats itself.
    GnssStuck = 7,
    /// No altitude, or one that repeats itself.
    AltitudeLost = 8,
    /// No valid command from outside any more.
    CommandLost = 9,
}

impl FailsafeReason {
    /// All reasons, in the order of their numbers.
    pub const ALL: [Self; 10] = [
        Self::None,
        Self::ClockStuck,
        Self::ImuLost,
        Self::ImuStuck,
        Self::AttitudeLost,
        Self::AttitudeStuck,
        Self::GnssLost,
        Self::GnssStuck,
        Self::AltitudeLost,
        Self::CommandLost,
    ];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::ClockStuck => "clock_stuck",
            Self::ImuLost => "imu_lost",
            Self::ImuStuck => "imu_stuck",
            Self::AttitudeLost => "attitude_lost",
            Self::AttitudeStuck => "attitude_stuck",
            Self::GnssLost => "gnss_lost",
            Self::GnssStuck => "gnss_stuck",
            Self::AltitudeLost => "altitude_lost",
            Self::CommandLost => "command_lost",
        }
    }
}

/// What flies, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Failsafe {
    /// What flies.
    pub mode: FailsafeMode,
    /// Why.
    pub reason: FailsafeReason,
}

/// How long one sensor has been silent, and how often it said the same.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Watch {
    /// Since the last valid reading, us; `None` before the first.
    pub(super) age_us: Option<u32>,
    pub(super) repeats: u16,
}

impl Watch {
    fn look(&mut self, elapsed_us: u32, heard: Heard) {
        match heard {
            Heard::Nothing => self.age_us = self.age_us.map(|age| age.saturating_add(elapsed_us)),
            Heard::Same => (self.age_us, self.repeats) = (Some(0), self.repeats.saturating_add(1)),
            Heard::New => (self.age_us, self.repeats) = (Some(0), 0),
        }
    }

    fn is_lost(&self, limit_us: u32) -> bool {
        self.age_us.is_some_and(|age| age > limit_us)
    }
}

/// What the flight code's own estimate says, where it has one: the sensors behind it can no longer
/// be seen from here.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimated {
    /// Nobody knows any more where the vehicle is.
    pub(super) position_is_lost: bool,
    /// The inertial units repeat themselves.
    pub(super) imu_hangs: bool,
}

/// What the failsafe remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FailsafeState {
    /// What flies, and why.
    pub active: Failsafe,
    pub(super) imu: Watch,
    pub(super) attitude: Watch,
    pub(super) gnss: Watch,
    pub(super) altitude: Watch,
    /// Since the last command, us; `None` before the first.
    pub(super) command_age_us: Option<u32>,
    /// Frames since time went on.
    pub(super) standing: u16,
    /// Turned since the attitude changed, rad.
    pub(super) turned_rad: Vector3<f32>,
    /// Climbed since the altitude changed, m.
    pub(super) climbed_m: f32,
    /// It should have changed since then; holds until it does.
    pub(super) attitude_hangs: bool,
    pub(super) altitude_hangs: bool,
    /// Since things were as bad as `active` says, us.
    pub(super) better_us: u32,
}

impl FailsafeState {
    /// Looks at what came of a frame.
    ///
    /// * `elapsed_us` - time since the last frame, `None` for the first, 0 if it did not go on
    /// * `estimate` - what the flight code's own estimate says
    pub(super) fn update(
        &mut self,
        elapsed_us: Option<u32>,
        merged: Merged,
        known: &Known,
        estimate: Estimated,
    ) -> Failsafe {
        self.standing = if elapsed_us == Some(0) { self.standing.saturating_add(1) } else { 0 };
        let elapsed_us = elapsed_us.unwrap_or(0);
        self.imu.look(elapsed_us, merged.imu);
        self.attitude.look(elapsed_us, merged.attitude);
        self.gnss.look(elapsed_us, merged.gnss);
        self.altitude.look(elapsed_us, merged.altitude);
        self.command_age_us = if merged.commanded {
            Some(0)
        } else {
            self.command_age_us.map(|age| age.saturating_add(elapsed_us))
        };
        let dt_s = elapsed_us.min(IMU_LIMIT_US) as f32 * 1e-6;
        let omega = known.imu.map_or(Vector3::zeros(), |imu| imu.omega.vector);
        let climb_m_s = known.gnss.map_or(0.0, |gnss| -gnss.velocity.vector.z);
        self.turned_rad = if self.attitude.repeats == 0 {
            Vector3::zeros()
        } else {
            self.turned_rad + omega * dt_s
        };
        self.climbed_m =
            if self.altitude.repeats == 0 { 0.0 } else { self.climbed_m + climb_m_s * dt_s };
        self.attitude_hangs = self.attitude.repeats >= ATTITUDE_REPEATS
            && (self.attitude_hangs || self.turned_rad.norm_squared() > TURNED_RAD * TURNED_RAD);
        self.altitude_hangs = self.altitude.repeats >= ALTITUDE_REPEATS
            && (self.altitude_hangs || self.climbed_m.abs() > CLIMBED_M);

        let judged = self.judge(known, estimate);
        self.better_us = if judged.mode < self.active.mode {
            self.better_us.saturating_add(elapsed_us)
        } else {
            0
        };
        if judged.mode >= self.active.mode || self.better_us >= RECOVERY_US {
            self.active = judged;
        }
        self.active
    }

    /// Commands came, and come no more.
    pub(super) fn command_is_lost(&self) -> bool {
        self.command_age_us.is_some_and(|age| age > COMMAND_LIMIT_US)
    }

    fn judge(&self, known: &Known, estimate: Estimated) -> Failsafe {
        use {FailsafeMode as M, FailsafeReason as R};
        let turning = |omega: &Vector3<f32>| omega.norm_squared() > TURNING_RAD_S * TURNING_RAD_S;
        let imu_stuck = self.imu.repeats >= IMU_REPEATS
            && known.imu.is_some_and(|imu| {
                // Neither weight nor turning: the bus reads zeros.
                turning(&imu.omega.vector) || imu.specific_force.vector == Vector3::zeros()
            });
        let gnss_stuck = self.gnss.repeats >= GNSS_REPEATS
            && known
                .gnss
                .is_some_and(|g| g.velocity.vector.norm_squared() > MOVING_M_S * MOVING_M_S);
        let (mode, reason) = if self.standing >= CLOCK_REPEATS {
            (M::Cut, R::ClockStuck)
        } else if self.imu.is_lost(IMU_LIMIT_US) {
            (M::Cut, R::ImuLost)
        } else if imu_stuck || estimate.imu_hangs {
            (M::Cut, R::ImuStuck)
        } else if self.attitude.is_lost(ATTITUDE_LIMIT_US) {
            (M::Cut, R::AttitudeLost)
        } else if self.attitude_hangs {
            (M::Cut, R::AttitudeStuck)
        } else if estimate.position_is_lost || self.gnss.is_lost(GNSS_LIMIT_US) {
            (M::Level, R::GnssLost)
        } else if gnss_stuck {
            (M::Level, R::GnssStuck)
        } else if self.altitude.is_lost(ALTITUDE_LIMIT_US) || self.altitude_hangs {
            (M::Off, R::AltitudeLost)
        } else if self.command_is_lost() {
            (M::Off, R::CommandLost)
        } else {
            (M::Off, R::None)
        };
        Failsafe { mode, reason }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::wing_force::ForceModel;
    use crate::frames::{In, Rotation};
    use crate::guidance::mission::Mission;
    use crate::stack::tests::{level, stack_on};
    use crate::stack::{Gnss, SensorFrame, Stack, StackOutput, StackState};

    const STEP_US: u64 = 3333;

    /// A flight that moves and turns, every reading another one.
    fn moving(k: u64) -> SensorFrame {
        let t = k as f32 * STEP_US as f32 * 1e-6;
        let mut frame = level(k * STEP_US);
        if let Some(imu) = &mut frame.imu {
            imu.omega = In::new(Vector3::new(0.5 * (3.0 * t).cos(), 0.01, 0.0));
        }
        frame.attitude = Some(Rotation::from_euler(0.5 / 3.0 * (3.0 * t).sin(), 0.0, 0.0));
        let velocity = In::new(Vector3::new(3.0, 0.0, -2.0 + 0.01 * t));
        frame.gnss = k
            .is_multiple_of(30)
            .then(|| Gnss { position: In::new(Vector3::new(3.0 * t, 0.0, -2.0 * t)), velocity });
        frame.altitude_m = k.is_multiple_of(6).then_some(2.0 * t);
        frame
    }

    fn stack() -> Stack {
        stack_on(&ForceModel::FlatPlate, &Mission::Hover { position: In::zero() })
    }

    /// Two seconds well, three with a fault, two well again; the failsafe of every step.
    fn flown(fault: impl Fn(&mut SensorFrame)) -> Vec<(StackOutput, Failsafe)> {
        let (stack, mut state) = (stack(), StackState::default());
        let step = |k: u64| {
            let mut frame = moving(k);
            if (600..1500).contains(&k) {
                fault(&mut frame);
            }
            let output = stack.step(&mut state, &frame);
            (output, output.failsafe)
        };
        (0..2100).map(step).collect()
    }

    /// Reached after `delay` steps, and not before; kept to the end of the fault; gone at the end.
    fn expect(
        fault: impl Fn(&mut SensorFrame),
        mode: FailsafeMode,
        reason: FailsafeReason,
        delay: u64,
    ) {
        let all = flown(fault);
        let first = all.iter().position(|(_, f)| *f != Failsafe::default()).unwrap() as u64;
        assert!(
            (600 + delay - 35..=600 + delay + 35).contains(&first),
            "{reason:?} after {}",
            first - 600
        );
        for (output, failsafe) in &all[first as usize..1500] {
            assert_eq!((failsafe.mode, failsafe.reason), (mode, reason));
            match mode {
                FailsafeMode::Off => assert!(output.inner.is_some()),
                FailsafeMode::Level => {
                    let thrust = output.inner.unwrap().demand.thrust_n;
                    assert!(
                        (thrust / stack().vehicle().weight_n() - LEVEL_THRUST_SHARE).abs() < 1e-6
                    );
                    assert!(output.outer.is_none() && output.wing_command == [0.0; 2]);
                }
                FailsafeMode::Cut => {
                    assert_eq!((output.rotor_command, output.wing_command), ([0.0; 8], [0.0; 2]));
                }
            }
        }
        let last = all.len() - 1;
        assert_eq!(all[last].1, Failsafe::default(), "{reason:?}");
        assert!(all[last - 30..].iter().any(|(output, _)| output.outer.is_some()), "{reason:?}");
    }

    #[test]
    fn a_flight_that_is_well_is_left_alone() {
        assert!(flown(|_| {}).iter().all(|(_, failsafe)| *failsafe == Failsafe::default()));
    }

    #[test]
    fn what_is_lost_is_named_after_its_limit() {
        use {FailsafeMode as M, FailsafeReason as R};
        expect(|f| f.imu = None, M::Cut, R::ImuLost, 30);
        expect(|f| f.attitude = None, M::Cut, R::AttitudeLost, 75);
        expect(|f| f.gnss = None, M::Level, R::GnssLost, 450);
        expect(|f| f.altitude_m = None, M::Off, R::AltitudeLost, 300);
        let nan = |f: &mut SensorFrame| {
            if let Some(imu) = &mut f.imu {
                imu.omega.vector.y = f32::NAN;
            }
        };
        expect(nan, M::Cut, R::ImuLost, 30);
    }

    #[test]
    fn what_hangs_is_named() {
        use {FailsafeMode as M, FailsafeReason as R};
        let last = moving(599);
        expect(|f| f.imu = last.imu, M::Cut, R::ImuStuck, 100);
        expect(|f| f.attitude = last.attitude, M::Cut, R::AttitudeStuck, 60);
        let fix = moving(570).gnss;
        expect(|f| f.gnss = f.gnss.and(fix), M::Level, R::GnssStuck, 150);
        expect(
            |f| f.altitude_m = f.altitude_m.and(moving(594).altitude_m),
            M::Off,
            R::AltitudeLost,
            156,
        );
        expect(|f| f.time_us = 599 * STEP_US, M::Cut, R::ClockStuck, 15);
    }

    #[test]
    fn at_rest_on_the_ground_nothing_hangs() {
        let (stack, mut state) = (stack(), StackState::default());
        for k in 0..3000 {
            let output = stack.step(&mut state, &level(k * STEP_US));
            assert_eq!(output.failsafe, Failsafe::default(), "{k}");
        }
    }
}
