//! Attitude from gyroscope and accelerometer: a stop-gap until the flight code estimates it.
//!
//! On the ground tilt comes from the averaged specific force, the heading is what the board's file says, and the average rate is the
//! gyroscope's bias. In flight the rate is integrated, and the tilt is drawn slowly towards where the specific force says that up
//! is, while that is about as long as gravity. Nothing corrects the heading: it drifts with what is left of the bias, and a
//! long acceleration bends the tilt. Good for minutes of gentle flight, not for a mission.

use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::{UnitQuaternion, Vector3};
use squirrel_core::stack::Imu;

/// Averages on the ground are over about this time, s.
const AVERAGE_S: f32 = 0.5;
/// The tilt follows the specific force within about this time, s.
const CORRECTION_S: f32 = 5.0;
/// It follows only while the specific force is gravity within this, m/s^2.
const GRAVITY_WITHIN_M_S2: f32 = 1.0;
/// Slower is still, rad/s.
const STILL_RAD_S: f32 = 0.05;
/// Less tilt is level, rad.
const LEVEL_RAD: f32 = 0.2;

/// Attitude, and what it is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// The estimate.
    pub ned_from_body: Rotation<Ned, Body, f32>,
    heading_rad: f32,
    force_m_s2: Vector3<f32>,
    bias_rad_s: Vector3<f32>,
}

impl Attitude {
    /// Level; `heading_rad` is how the vehicle stands at arming, clockwise from north.
    #[must_use]
    pub fn new(heading_rad: f32) -> Self {
        Self {
            ned_from_body: Rotation::from_euler(0.0, 0.0, heading_rad),
            heading_rad,
            force_m_s2: Vector3::new(0.0, 0.0, -GRAVITY_M_S2 as f32),
            bias_rad_s: Vector3::zeros(),
        }
    }

    /// A sample while the vehicle stands, `dt_s` after the last.
    pub fn on_the_ground(&mut self, sample: &Imu, dt_s: f32) {
        let part = (dt_s / AVERAGE_S).clamp(0.0, 1.0);
        self.force_m_s2 += (sample.specific_force.vector - self.force_m_s2) * part;
        self.bias_rad_s += (sample.omega.vector - self.bias_rad_s) * part;
        let f = self.force_m_s2;
        let roll = libm::atan2f(-f.y, -f.z);
        let pitch = libm::atan2f(f.x, libm::hypotf(f.y, f.z));
        self.ned_from_body = Rotation::from_euler(roll, pitch, self.heading_rad);
    }

    /// A sample in flight, `dt_s` after the last.
    pub fn in_flight(&mut self, sample: &Imu, dt_s: f32) {
        let mut rate = self.without_bias(sample);
        let f = sample.specific_force.vector;
        let size = f.norm();
        if (size - GRAVITY_M_S2 as f32).abs() < GRAVITY_WITHIN_M_S2 {
            let up_body = self.ned_from_body.inverse() * In::new(-Vector3::z());
            rate += (f / size).cross(&up_body.vector) / CORRECTION_S;
        }
        let turned = self.ned_from_body.quaternion * UnitQuaternion::from_scaled_axis(rate * dt_s);
        // Rounding makes it longer or shorter in time.
        self.ned_from_body = Rotation::new(UnitQuaternion::new_normalize(turned.into_inner()));
    }

    /// Angular rate without the bias, rad/s, body.
    #[must_use]
    pub fn without_bias(&self, sample: &Imu) -> Vector3<f32> {
        sample.omega.vector - self.bias_rad_s
    }

    /// Level and still, as a vehicle should be that is armed.
    #[must_use]
    pub fn is_level_and_still(&self, sample: &Imu) -> bool {
        let (roll, pitch, _) = self.ned_from_body.euler();
        roll.abs() < LEVEL_RAD && pitch.abs() < LEVEL_RAD && self.without_bias(sample).norm() < STILL_RAD_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BIAS: [f32; 3] = [0.01, -0.02, 0.03];
    const DT_S: f32 = 1.0 / 300.0;

    /// What the sensor says of a vehicle that turns in place.
    fn sample(ned_from_body: Rotation<Ned, Body, f32>, rate: Vector3<f32>) -> Imu {
        let up = ned_from_body.inverse() * In::new(-Vector3::z() * GRAVITY_M_S2 as f32);
        Imu { omega: In::new(rate + Vector3::from(BIAS)), specific_force: up }
    }

    fn standing(tilt: (f32, f32), heading: f32) -> Attitude {
        let mut attitude = Attitude::new(heading);
        for _ in 0..3000 {
            attitude.on_the_ground(
                &sample(Rotation::from_euler(tilt.0, tilt.1, heading), Vector3::zeros()),
                DT_S,
            );
        }
        attitude
    }

    #[test]
    fn standing_it_knows_tilt_heading_and_bias() {
        let attitude = standing((0.1, -0.05), 1.2);
        let truth = Rotation::from_euler(0.1, -0.05, 1.2);
        assert!(attitude.ned_from_body.quaternion.angle_to(&truth.quaternion) < 1e-3);
        assert!(attitude.is_level_and_still(&sample(truth, Vector3::zeros())));
        assert!(!attitude.is_level_and_still(&sample(truth, Vector3::new(0.0, 0.0, 0.1))));
        assert!(!standing((0.3, 0.0), 0.0).is_level_and_still(&sample(truth, Vector3::zeros())));
    }

    #[test]
    fn flying_it_follows_a_turn_for_a_minute() {
        let mut attitude = standing((0.0, 0.0), 0.5);
        let mut truth = Rotation::<Ned, Body, f32>::from_euler(0.0, 0.0, 0.5);
        for k in 0..18_000u16 {
            let t = f32::from(k) * DT_S;
            let rate = Vector3::new(0.6 * (2.0 * t).cos(), 0.4 * (3.0 * t).sin(), 0.2);
            attitude.in_flight(&sample(truth, rate), DT_S);
            truth = Rotation::new(truth.quaternion * UnitQuaternion::from_scaled_axis(rate * DT_S));
        }
        let error = attitude.ned_from_body.quaternion.angle_to(&truth.quaternion);
        assert!(error < 0.02, "{error} rad");
    }

    /// The sign of the correction: from a wrong tilt it must come back, not run away.
    #[test]
    fn a_wrong_tilt_is_drawn_back_to_gravity_but_not_by_another_force() {
        let wrong =
            Attitude { ned_from_body: Rotation::from_euler(0.2, -0.2, 0.0), ..standing((0.0, 0.0), 0.0) };
        let level = sample(Rotation::identity(), Vector3::zeros());
        let (mut attitude, mut pushed) = (wrong, wrong);
        let hard = Imu { specific_force: level.specific_force * 1.5, ..level };
        for _ in 0..9000 {
            attitude.in_flight(&level, DT_S);
            pushed.in_flight(&hard, DT_S);
        }
        let (roll, pitch, _) = attitude.ned_from_body.euler();
        assert!(roll.abs() < 0.01 && pitch.abs() < 0.01, "{roll} {pitch}");
        assert!((pushed.ned_from_body.euler().0 - 0.2).abs() < 0.01);
    }
}
