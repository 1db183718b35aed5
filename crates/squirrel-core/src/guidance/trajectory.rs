//! The paper's reference: a cubic until the target speed is reached, then a straight line at that
//! speed.
//!
//! Paper, section V.B; the coefficients are not printed. docs/equations.md T20:
//! `s(t) = V (t^2 / T - t^3 / (3 T^2))` for `t < T`, then `s = V (t - T/3)`: starts at rest,
//! reaches `V` at `T` without a step in acceleration, peak acceleration `2 V / T`.

use crate::command::Reference;
use crate::frames::{In, Ned};
use crate::math::upper;
use nalgebra::Vector3;

/// A straight horizontal run from rest to a constant speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trajectory {
    /// Where it starts, m.
    pub start: In<Ned, f32>,
    course_rad: f32,
    /// Kept, for the reference is asked for three hundred times a second.
    direction: In<Ned, f32>,
    /// Final speed, m/s.
    pub speed_m_s: f32,
    /// Time to reach it, s, > 0.
    pub ramp_s: f32,
}

impl Trajectory {
    /// A run.
    ///
    /// * `start` - m
    /// * `course_rad` - direction, clockwise from north
    /// * `speed_m_s` - in the end
    /// * `ramp_s` - time to reach it, > 0
    pub fn new(start: In<Ned, f32>, course_rad: f32, speed_m_s: f32, ramp_s: f32) -> Self {
        let (s, c) = libm::sincosf(course_rad);
        Self { start, course_rad, direction: In::new(Vector3::new(c, s, 0.0)), speed_m_s, ramp_s }
    }

    /// Direction, rad clockwise from north.
    pub fn course_rad(&self) -> f32 {
        self.course_rad
    }

    /// Unit vector of the direction.
    pub fn direction(&self) -> In<Ned, f32> {
        self.direction
    }

    /// Reference at time `t_s` after the start; the start before that.
    pub fn at(&self, t_s: f32) -> Reference {
        let (v, ramp, t) = (self.speed_m_s, self.ramp_s, upper(t_s, 0.0));
        let (s, ds, dds) = if t < ramp {
            let x = t / ramp;
            (v * t * (x - x * x / 3.0), v * (2.0 * x - x * x), 2.0 * v / ramp * (1.0 - x))
        } else {
            (v * (t - ramp / 3.0), v, 0.0)
        };
        let direction = self.direction;
        Reference {
            position: self.start + direction * s,
            velocity: direction * ds,
            acceleration: direction * dds,
            yaw_rad: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run() -> Trajectory {
        Trajectory::new(In::zero(), 0.5, 7.0, 2.0)
    }

    #[test]
    fn starts_at_rest_and_reaches_the_speed_smoothly() {
        let (start, before, after) = (run().at(0.0), run().at(1.9999), run().at(2.0001));
        assert_eq!(start.velocity.vector.norm(), 0.0);
        assert!(
            (start.acceleration.vector.norm() - 7.0).abs() < 1e-4,
            "peak acceleration is 2 V / T"
        );
        assert!((before.position - after.position).vector.norm() < 2e-3);
        assert!(
            (after.velocity.vector.norm() - 7.0).abs() < 1e-4
                && before.acceleration.vector.norm() < 1e-2
        );
    }

    #[test]
    fn velocity_and_acceleration_are_derivatives() {
        let h = 1e-2_f32;
        for k in 1..60 {
            let t = k as f32 * 0.05;
            let slope = (run().at(t + h).position - run().at(t - h).position).vector / (2.0 * h);
            assert!((slope - run().at(t).velocity.vector).norm() < 5e-3, "{t}");
        }
    }
}
