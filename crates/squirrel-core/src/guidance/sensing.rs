//! Obstacle sensing: an obstacle counts when it is near and ahead.
//!
//! Paper, section V.B: within `R_d`, inside a field of view of +-15 deg about the direction of
//! movement. Distance is horizontal, to the obstacle's axis. Differs: an obstacle that the vehicle
//! is already avoiding is not seen again until it has left the range (the paper does not say how it
//! avoids re-triggering).

use crate::frames::{In, Ned};
use crate::vehicle::ParameterError;
use nalgebra::Vector2;

/// A vertical cylinder as guidance knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Identity that does not change, so that it can be recognised.
    pub id: u32,
    /// North, m.
    pub north_m: f32,
    /// East, m.
    pub east_m: f32,
}

/// What the sensor sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensing {
    /// `R_d`, m.
    pub range_m: f32,
    /// Half of the field of view, rad.
    pub half_view_rad: f32,
    /// Below this speed there is no direction of movement, m/s.
    pub speed_min_m_s: f32,
}

impl Sensing {
    /// # Errors
    /// A number that is not finite and positive, by its name in a scenario.
    pub fn check(&self) -> Result<(), ParameterError> {
        crate::vehicle::positive("range_m", self.range_m)?;
        if !(self.half_view_rad > 0.0 && self.half_view_rad <= core::f32::consts::PI) {
            return Err(ParameterError::of(
                "half_view_rad",
                self.half_view_rad,
                "must be > 0 and within half a turn",
            ));
        }
        crate::vehicle::positive("speed_min_m_s", self.speed_min_m_s)
    }

    /// The nearest obstacle in range and view that is not known yet.
    ///
    /// * `position`, `velocity` - as estimated, m and m/s
    /// * `known` - whether an obstacle of that identity is being avoided already
    pub fn nearest(
        &self,
        position: In<Ned, f32>,
        velocity: In<Ned, f32>,
        obstacles: &[Obstacle],
        known: impl Fn(u32) -> bool,
    ) -> Option<Obstacle> {
        let course = velocity.vector.xy();
        let speed = course.norm();
        if !(speed >= self.speed_min_m_s) {
            return None;
        }
        let view = crate::math::cos(self.half_view_rad);
        let mut best: Option<(f32, Obstacle)> = None;
        for obstacle in obstacles.iter().filter(|o| !known(o.id)) {
            let offset = offset(position, obstacle);
            let distance = offset.norm();
            let ahead = offset.dot(&course) >= view * distance * speed;
            if distance <= self.range_m && ahead && best.is_none_or(|(d, _)| distance < d) {
                best = Some((distance, *obstacle));
            }
        }
        best.map(|(_, obstacle)| obstacle)
    }
}

/// Horizontal vector from the vehicle to an obstacle, m.
pub(super) fn offset(position: In<Ned, f32>, obstacle: &Obstacle) -> Vector2<f32> {
    Vector2::new(obstacle.north_m, obstacle.east_m) - position.vector.xy()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    const SENSING: Sensing =
        Sensing { range_m: 5.0, half_view_rad: 0.261_799_4, speed_min_m_s: 1.0 };

    fn see(north_m: f32, east_m: f32, handled: Option<u32>) -> bool {
        let velocity = In::new(Vector3::new(7.0, 0.0, 0.0));
        SENSING
            .nearest(In::zero(), velocity, &[Obstacle { id: 7, north_m, east_m }], |id| {
                Some(id) == handled
            })
            .is_some()
    }

    #[test]
    fn sees_what_is_near_and_ahead() {
        assert!(see(4.9, 0.0, None));
        assert!(!see(5.1, 0.0, None), "out of range");
        assert!(see(4.0, 4.0 * 14.9_f32.to_radians().tan(), None));
        assert!(!see(4.0, 4.0 * 15.1_f32.to_radians().tan(), None), "out of view");
        assert!(!see(-2.0, 0.0, None), "behind");
        assert!(!see(4.9, 0.0, Some(7)), "already handled");
    }

    #[test]
    fn of_two_takes_the_nearer_and_sees_nothing_at_rest() {
        let two = [
            Obstacle { id: 1, north_m: 4.0, east_m: 0.0 },
            Obstacle { id: 2, north_m: 3.0, east_m: 0.2 },
        ];
        let velocity = In::new(Vector3::new(7.0, 0.0, 0.0));
        assert_eq!(SENSING.nearest(In::zero(), velocity, &two, |_| false).map(|o| o.id), Some(2));
        assert!(SENSING.nearest(In::zero(), In::zero(), &two, |_| false).is_none());
        let nan = In::new(Vector3::new(f32::NAN, 0.0, 0.0));
        assert!(SENSING.nearest(In::zero(), nan, &two, |_| false).is_none());
    }
}
