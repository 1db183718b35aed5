//! Random runs with spread wings: flights to learn the force of the wings from, and to judge what
//! was learned by.
//!
//! One straight run after the other, each in a direction, at a speed, to a height and with a turn
//! of the nose that the seed draws; a multisine sways roll and pitch on top. Runs begin and end at
//! rest in reference terms, so that a flight passes through all speeds up to its top speed and
//! through braking, where the air hits the belly.

use super::excite::Draw;
use crate::setting::SettingError;
use serde::{Deserialize, Serialize};
use squirrel_core::frames::{In, Ned, Rotation};
use squirrel_core::guidance::excite::{Leg, MAX_LEGS, Multisine, Programme};
use squirrel_core::math::wrap_angle;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::vehicle::ParameterError;
use std::f32::consts::{FRAC_PI_2, PI};

/// Length of a flight, s: that of the shortest programme, rounded down.
pub(super) const DURATION_S: f64 = 30.0;
/// Shortest and longest run, s.
const RUN_S: [f32; 2] = [1.9, 4.1];
/// Share of a run in which it speeds up, and in which it brakes.
const RAMP_SHARE: f32 = 0.4;
/// Slowest run over the top speed.
const SLOWEST_SHARE: f32 = 0.2;
/// Heights stay within this share of the scenario's.
const HEIGHT_SHARE: f32 = 0.2;
/// The nose turns by at most this much in a run, rad.
const TURN_MAX_RAD: f32 = FRAC_PI_2;

/// Numbers of a flight of random runs. The wings are spread throughout.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunsTable {
    /// Top horizontal speed of the runs' reference; a vehicle that follows it late rounds it off.
    pub speed_m_s: f64,
    /// Top vertical speed of the runs' reference.
    pub climb_m_s: f64,
    /// Amplitude of each line of the multisine on roll and pitch.
    pub sway_rad: f64,
}

impl RunsTable {
    /// The table of `random_spread`.
    pub(super) fn built_in() -> Self {
        Self { speed_m_s: 10.0, climb_m_s: 4.0, sway_rad: 0.01 }
    }

    pub(super) fn check(&self) -> Result<(), SettingError> {
        for (field, x) in [("speed_m_s", self.speed_m_s), ("climb_m_s", self.climb_m_s)] {
            if !(x > 0.0 && x <= 30.0) {
                return Err(SettingError::value(field, x, "must be > 0 and <= 30"));
            }
        }
        if !(0.0..=0.05).contains(&self.sway_rad) {
            return Err(SettingError::value("sway_rad", self.sway_rad, "must be 0 to 0.05"));
        }
        Ok(())
    }

    /// What the flight code flies, about this height above the ground.
    pub(super) fn programme(&self, height_m: f64, seed: u64) -> Result<Programme, ParameterError> {
        let seed = (seed ^ (seed >> 32)) as u32;
        let draw = Draw { seed };
        let [speed, climb, sway] =
            [self.speed_m_s, self.climb_m_s, self.sway_rad].map(|x| x as f32);
        let height_m = height_m as f32;
        let start = In::new(Vector3::new(0.0, 0.0, -height_m));
        let (mut to, mut yaw_rad) = (start, 0.0);
        let legs: Vec<Leg> = (0..MAX_LEGS as u32)
            .map(|run| {
                // Six draws a run; the numbers before them are the excitation's.
                let share = |n: u32| draw.share(100 + 6 * run + n);
                let either = |n: u32| 2.0 * share(n) - 1.0;
                let duration_s = RUN_S[0] + (RUN_S[1] - RUN_S[0]) * share(0);
                let ramp_s = RAMP_SHARE * duration_s;
                let at_top_s = duration_s - ramp_s;
                let length_m =
                    speed * at_top_s * (SLOWEST_SHARE + (1.0 - SLOWEST_SHARE) * share(1));
                let course_rad = PI * either(2);
                let wanted_m = height_m * (1.0 + HEIGHT_SHARE * either(3));
                let reach_m = climb * at_top_s * share(4);
                let rise_m = (wanted_m + to.vector.z).clamp(-reach_m, reach_m);
                let along = Rotation::<Ned, Ned, f32>::from_euler(0.0, 0.0, course_rad);
                to = to + along * In::new(Vector3::new(length_m, 0.0, -rise_m));
                yaw_rad = wrap_angle(yaw_rad + TURN_MAX_RAD * either(5));
                Leg {
                    duration_s,
                    move_s: duration_s,
                    ramp_s,
                    to,
                    yaw_rad,
                    wings_s: [0.0, f32::MAX],
                }
            })
            .collect();
        Programme::new(start, &legs, Multisine::new([sway, sway, 0.0], 0.0, seed)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_cannot_be_flown_are_refused_by_name() {
        let good = RunsTable::built_in();
        for (broken, field) in [
            (RunsTable { speed_m_s: f64::NAN, ..good.clone() }, "speed_m_s = NaN"),
            (RunsTable { climb_m_s: 0.0, ..good.clone() }, "climb_m_s = 0"),
            (RunsTable { sway_rad: 0.06, ..good.clone() }, "sway_rad = 0.06"),
        ] {
            assert!(broken.check().unwrap_err().to_string().starts_with(field), "{broken:?}");
        }
    }

    #[test]
    fn runs_stay_in_their_numbers_and_differ_from_seed_to_seed() {
        let table = RunsTable::built_in();
        for seed in 0..50 {
            let programme = table.programme(30.0, seed).unwrap();
            let mut from = Vector3::new(0.0, 0.0, -30.0);
            let mut length_s = 0.0;
            for leg in programme.legs() {
                let velocity = (leg.to.vector - from) / (leg.move_s - leg.ramp_s);
                let speed = velocity.xy().norm();
                assert!((1.99..=10.01).contains(&speed) && velocity.z.abs() <= 4.001, "{velocity}");
                assert!((23.9..=36.1).contains(&-leg.to.vector.z), "{}", leg.to.vector);
                (from, length_s) = (leg.to.vector, length_s + f64::from(leg.duration_s));
            }
            assert!(length_s >= DURATION_S, "seed {seed} ends after {length_s} s");
            assert_ne!(programme, table.programme(30.0, seed + 1).unwrap());
        }
    }
}
