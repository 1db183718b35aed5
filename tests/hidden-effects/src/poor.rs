//! Flights that show little: short, calm, or without the fixes that say how the vehicle moves.

use crate::draw::Draw;
use crate::independent::Excitation;
use serde::{Deserialize, Serialize};
use squirrel_log::FlightLog;

/// How poor flights are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Poor {
    /// What is flown.
    pub excitation: Excitation,
    /// How long the log is, s.
    pub seconds: f64,
    /// Whether it has position and velocity.
    pub has_fixes: bool,
}

/// Length of a flight that is cut off, s.
const SHORT_S: [f64; 2] = [6.0, 15.0];
/// Longer than any flight, s.
const WHOLE_S: f64 = 1e3;
/// Sources that a log without fixes lacks.
const FIXES: [&str; 2] = ["gnss", "baro"];

impl Poor {
    /// The kinds in turn, so that in three rounds each effect is hidden in each.
    pub fn draw(index: usize, draw: &mut Draw) -> Self {
        let seconds = draw.uniform(SHORT_S[0], SHORT_S[1]);
        let (excitation, seconds, has_fixes) = match (index + index / 33) % 3 {
            0 => (Excitation::Rich, seconds, true),
            1 => (Excitation::Calm, 2.0 * seconds, true),
            _ => return Self::inertial(),
        };
        Self { excitation, seconds, has_fixes }
    }

    /// Whole flights without fixes.
    pub fn inertial() -> Self {
        Self { excitation: Excitation::Rich, seconds: WHOLE_S, has_fixes: false }
    }

    /// What is left of a log.
    pub fn of(self, mut log: FlightLog) -> FlightLog {
        if !self.has_fixes {
            log.sources.retain(|name, _| !FIXES.contains(&name.as_str()));
        }
        let first = log.sources.values().filter_map(|source| source.time_s.first());
        let end_s = first.copied().fold(f64::INFINITY, f64::min) + self.seconds;
        for source in log.sources.values_mut() {
            let kept = source.time_s.partition_point(|t| *t <= end_s);
            source.time_s.truncate(kept);
            for channel in source.channels.values_mut() {
                channel.values.truncate(kept * channel.width);
            }
        }
        log
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logs_are_cut_and_lose_their_fixes() {
        let mut log = FlightLog::default();
        for k in 0..100 {
            let t = 3.0 + 0.1 * f64::from(k);
            log.source_mut("gnss").push(t, &[("velocity_ned_m_s", &[t, 0.0, 0.0])]);
            log.source_mut("imu").push(t, &[("omega_body_rad_s", &[t, t, t])]);
        }
        let poor = Poor { excitation: Excitation::Rich, seconds: 5.05, has_fixes: true };
        let cut = poor.of(log.clone());
        let (time_s, velocity) = cut.channel("gnss.velocity_ned_m_s").unwrap();
        assert_eq!((time_s.len(), velocity.values.len()), (51, 153));
        let blind = Poor { has_fixes: false, ..poor }.of(log);
        assert!(blind.channel("gnss.velocity_ned_m_s").is_none());
        assert_eq!(blind.sources["imu"].time_s.len(), 51);
    }

    #[test]
    fn each_kind_is_drawn() {
        let mut draw = Draw::new(1);
        let kinds: Vec<Poor> = (0..3).map(|index| Poor::draw(index, &mut draw)).collect();
        assert_eq!(kinds.iter().filter(|poor| poor.has_fixes).count(), 2);
        assert!(kinds.iter().any(|poor| poor.excitation == Excitation::Calm));
        assert_eq!(
            Poor::draw(33, &mut draw).excitation,
            Excitation::Calm,
            "the next round is turned"
        );
    }
}
