//! Wing operation event generator (WOEG): would spread wings help?
//!
//! Paper, section III.B, gives two definitions (docs/equations.md T11); both are here:
//! - [`WingTest::Normal`]: the force estimate pushes against the body's down axis, `-n . f > e`.
//!   For a flat plate this is "the air hits the belly".
//! - [`WingTest::Acceleration`]: the force estimate points where the position loop wants to go,
//!   `f_xy . a_cmd,xy > e |a_cmd|`.
//!
//! Differs from the paper: a threshold for opening and a lower one for closing.

use crate::frames::{In, Ned};
use nalgebra::Vector3;

/// What the force estimate is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WingTest {
    /// The body normal.
    Normal,
    /// The horizontal acceleration command.
    Acceleration,
}

/// Thresholds on the helpful force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WingEvents {
    /// The definition.
    pub test: WingTest,
    /// The flag rises above this helpful force, N.
    pub open_above_n: f32,
    /// The flag falls below this helpful force, N.
    pub close_below_n: f32,
}

/// Helpful part of the force and the flag.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WingFlag {
    /// Part of the force that helps, N; of [`super::plus`], mass times how much closer wings bring
    /// the acceleration to the command.
    pub helpful_n: f32,
    /// The paper's Flag.
    pub flag: bool,
}

impl WingEvents {
    /// * `force` - estimate of the aerodynamic force as if the wings were spread, N
    /// * `normal` - body down axis
    /// * `acceleration` - command of the position loop, m/s^2
    /// * `before` - the flag of the last tick
    pub fn evaluate(
        &self,
        force: In<Ned, f32>,
        normal: In<Ned, f32>,
        acceleration: In<Ned, f32>,
        before: bool,
    ) -> WingFlag {
        let helpful_n = match self.test {
            WingTest::Normal => -normal.vector.dot(&force.vector),
            WingTest::Acceleration => {
                let a = Vector3::new(acceleration.vector.x, acceleration.vector.y, 0.0);
                let size = a.norm();
                if size > 1e-3 { force.vector.dot(&a) / size } else { 0.0 }
            }
        };
        let threshold = if before { self.close_below_n } else { self.open_above_n };
        WingFlag { helpful_n, flag: helpful_n > threshold }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aero::flat_plate;
    use crate::frames::{Body, Rotation};

    fn events(test: WingTest) -> WingEvents {
        WingEvents { test, open_above_n: 0.1, close_below_n: 0.05 }
    }

    fn flag(
        test: WingTest,
        pitch: f32,
        velocity: Vector3<f32>,
        acceleration: Vector3<f32>,
    ) -> WingFlag {
        let normal =
            Rotation::<Ned, Body, f32>::from_euler(0.0, pitch, 0.0) * In::new(Vector3::z());
        let force = flat_plate::force(In::new(velocity), normal, 0.04);
        events(test).evaluate(force, normal, In::new(acceleration), false)
    }

    #[test]
    fn braking_nose_up_is_helped_by_both_definitions() {
        for test in [WingTest::Normal, WingTest::Acceleration] {
            let forward = Vector3::new(7.0, 0.0, 0.0);
            assert!(flag(test, 0.5, forward, Vector3::new(-8.0, 0.0, 0.0)).flag);
            // Nose down at speed the air hits the back: the wing would pull down and hold back.
            assert!(!flag(test, -0.5, forward, Vector3::new(8.0, 0.0, 0.0)).flag);
        }
    }

    #[test]
    fn falling_is_slowed_but_that_is_not_a_horizontal_help() {
        let down = Vector3::new(0.0, 0.0, 5.0);
        assert!(flag(WingTest::Normal, 0.0, down, Vector3::new(1.0, 0.0, 0.0)).flag);
        assert!(!flag(WingTest::Acceleration, 0.0, down, Vector3::new(1.0, 0.0, 0.0)).flag);
    }

    #[test]
    fn the_flag_has_hysteresis() {
        let e = events(WingTest::Normal);
        let between = In::new(Vector3::new(0.0, 0.0, -0.07));
        let normal = In::new(Vector3::z());
        assert!(!e.evaluate(between, normal, In::zero(), false).flag);
        assert!(e.evaluate(between, normal, In::zero(), true).flag);
    }
}
