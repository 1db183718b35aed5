//! One row of a sweep: a flight state, a thrust-to-weight ratio, and all that is compared there.

use super::{Extremes, Question, Reach, Volumes};
use serde::Serialize;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_sim::setting::SettingError;

/// What wings change at a velocity and a thrust-to-weight ratio.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// Velocity relative to the air, NED, m/s.
    pub velocity_ned_m_s: [f64; 3],
    /// Its length, m/s.
    pub speed_m_s: f64,
    /// Its angle below the horizon, rad.
    pub descent_rad: f64,
    /// Limit of thrust over weight.
    pub thrust_to_weight: f64,
    /// Largest accelerations.
    #[serde(flatten)]
    pub extremes: Extremes,
    /// Volumes.
    #[serde(flatten)]
    pub volumes: Volumes,
}

impl Case {
    /// Answers a question.
    ///
    /// # Errors
    /// As [`Reach::new`].
    pub fn of(question: &Question) -> Result<Self, SettingError> {
        let reach = Reach::new(question)?;
        let v = question.velocity.vector;
        Ok(Self {
            velocity_ned_m_s: v.into(),
            speed_m_s: v.norm(),
            descent_rad: v.z.atan2(v.x.hypot(v.y)),
            thrust_to_weight: question.thrust_max_n / (question.mass_kg * GRAVITY_M_S2),
            extremes: reach.extremes(),
            volumes: reach.volumes(),
        })
    }

    /// What is compared: name, unit, and the numbers where there are any.
    pub fn figures(&self) -> [(&'static str, &'static str, Option<super::Compared>); 5] {
        let Self { extremes, volumes, .. } = self;
        [
            ("upward", "m/s\u{b2}", Some(extremes.upward_m_s2)),
            ("braking, height free", "m/s\u{b2}", extremes.braking_height_free_m_s2),
            ("braking, height held", "m/s\u{b2}", extremes.braking_level_m_s2),
            ("volume of the set", "m\u{b3}/s\u{2076}", Some(volumes.set_volume_m3_s6)),
            ("volume of its hull", "m\u{b3}/s\u{2076}", Some(volumes.hull_volume_m3_s6)),
        ]
    }
}
