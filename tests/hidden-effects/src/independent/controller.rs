//! The autopilot: a position loop that asks for a thrust vector, a geometric attitude loop, and
//! rotor shares by the least squares of the nominal layout. 300 Hz.

use super::programme::Reference;
use crate::airframe::{Airframe, GRAVITY_M_S2, MAX_ROTORS};
use nalgebra::{Matrix3, Matrix4, UnitQuaternion, Vector3, Vector4};

/// What the autopilot knows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub(super) position: Vector3<f64>,
    pub(super) velocity: Vector3<f64>,
    pub(super) attitude: UnitQuaternion<f64>,
    pub(super) omega: Vector3<f64>,
}

/// An autopilot that believes the nominal numbers.
#[derive(Debug, Clone)]
pub(super) struct Controller {
    airframe: Airframe,
    /// Thrust of each rotor for total thrust and the three moments.
    share: Vec<Vector4<f64>>,
    integral: Vector3<f64>,
}

const POSITION_PER_S2: [f64; 3] = [2.2, 2.2, 5.0];
const VELOCITY_PER_S: [f64; 3] = [2.8, 2.8, 4.0];
const INTEGRAL_PER_S3: [f64; 3] = [0.5, 0.5, 2.0];
const INTEGRAL_MAX_M_S2: f64 = 4.0;
const ACCELERATION_MAX_M_S2: f64 = 7.0;
const ATTITUDE_PER_S2: [f64; 3] = [30.0, 30.0, 6.0];
const RATE_PER_S: [f64; 3] = [8.5, 8.5, 4.0];
/// Share of a rotor's top thrust that a command may ask for.
const THRUST_SHARE: [f64; 2] = [0.012, 0.95];

impl Controller {
    pub(super) fn new(airframe: &Airframe) -> Self {
        let column = |rotor: &crate::airframe::Rotor| {
            let p = rotor.position_body_m;
            let drag_arm = rotor.torque_coefficient_n_m_s2 / rotor.thrust_coefficient_n_s2;
            Vector4::new(1.0, -p.y, p.x, rotor.yaw_sign * drag_arm)
        };
        let columns: Vec<_> = airframe.rotors.iter().map(column).collect();
        let gram: Matrix4<f64> = columns.iter().map(|c| c * c.transpose()).sum();
        // A layout that cannot make all four would leave zeros here and fall at once; none of ours
        // is one.
        let inverse = gram.try_inverse().unwrap_or_else(Matrix4::zeros);
        let share = columns.iter().map(|c| inverse * c).collect();
        Self { airframe: airframe.clone(), share, integral: Vector3::zeros() }
    }

    /// Rotor commands for the next period.
    pub(super) fn step(
        &mut self,
        estimate: &Estimate,
        wanted: &Reference,
        dt_s: f64,
    ) -> [f64; MAX_ROTORS] {
        let gain = |k: [f64; 3], x: Vector3<f64>| Vector3::from(k).component_mul(&x);
        let off = wanted.position - estimate.position;
        let slow = off.map(|x| x.clamp(-1.0, 1.0));
        self.integral += gain(INTEGRAL_PER_S3, slow) * dt_s;
        self.integral = self.integral.map(|x| x.clamp(-INTEGRAL_MAX_M_S2, INTEGRAL_MAX_M_S2));
        let mut acceleration = wanted.acceleration
            + gain(VELOCITY_PER_S, wanted.velocity - estimate.velocity)
            + gain(POSITION_PER_S2, off)
            + self.integral;
        let across = acceleration.xy().norm();
        if across > ACCELERATION_MAX_M_S2 {
            let scale = ACCELERATION_MAX_M_S2 / across;
            acceleration.x *= scale;
            acceleration.y *= scale;
        }
        acceleration.z = acceleration.z.clamp(-8.0, 6.0);
        let lift = Vector3::new(0.0, 0.0, GRAVITY_M_S2) - acceleration;
        let down = estimate.attitude * Vector3::z();
        let thrust = self.airframe.mass_kg * (lift.dot(&down) + wanted.heave_m_s2).max(1.0);

        let error = (estimate.attitude.inverse() * attitude(lift, wanted.yaw)).scaled_axis();
        let rate = Vector3::new(0.0, 0.0, wanted.yaw_rate) - estimate.omega;
        let angular = gain(ATTITUDE_PER_S2, error) + gain(RATE_PER_S, rate) + wanted.angular_rad_s2;
        let inertia = Matrix3::from_diagonal(&self.airframe.inertia_kg_m2);
        let mut moment = inertia * angular + estimate.omega.cross(&(inertia * estimate.omega));
        // Yaw must not take the rotors from roll and pitch.
        let rotor = &self.airframe.rotors[0];
        let yaw_max =
            0.5 * thrust * rotor.torque_coefficient_n_m_s2 / rotor.thrust_coefficient_n_s2;
        moment.z = moment.z.clamp(-yaw_max, yaw_max);
        self.commands(thrust, moment)
    }

    fn commands(&self, thrust: f64, moment: Vector3<f64>) -> [f64; MAX_ROTORS] {
        let wrench = Vector4::new(thrust, moment.x, moment.y, moment.z);
        let mut commands = [0.0; MAX_ROTORS];
        for ((command, share), rotor) in
            commands.iter_mut().zip(&self.share).zip(&self.airframe.rotors)
        {
            let most = rotor.thrust_coefficient_n_s2 * self.airframe.speed_max_rad_s.powi(2);
            *command = (share.dot(&wrench) / most).clamp(THRUST_SHARE[0], THRUST_SHARE[1]).sqrt();
        }
        commands
    }
}

/// The attitude whose down axis lies along `down_ned` and whose forward axis points to `yaw`, as
/// far as it can.
fn attitude(down_ned: Vector3<f64>, yaw: f64) -> UnitQuaternion<f64> {
    let down = down_ned / down_ned.norm();
    let heading = Vector3::new(yaw.cos(), yaw.sin(), 0.0);
    let right = down.cross(&heading);
    let right = right / right.norm();
    let rotation = Matrix3::from_columns(&[right.cross(&down), right, down]);
    UnitQuaternion::from_matrix(&rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::Draw;

    #[test]
    fn commands_make_the_thrust_and_the_moments() {
        for seed in 0..20 {
            let airframe = Airframe::draw(&mut Draw::new(seed));
            let weight = airframe.mass_kg * GRAVITY_M_S2;
            let moment = Vector3::new(0.03, -0.05, 0.004) * airframe.mass_kg;
            let commands = Controller::new(&airframe).commands(weight, moment);
            let (mut thrust, mut made) = (0.0, Vector3::zeros());
            for (rotor, u) in airframe.rotors.iter().zip(commands) {
                let square = (u * airframe.speed_max_rad_s).powi(2);
                let t = rotor.thrust_coefficient_n_s2 * square;
                thrust += t;
                made += rotor.position_body_m.cross(&Vector3::new(0.0, 0.0, -t));
                made.z += rotor.yaw_sign * rotor.torque_coefficient_n_m_s2 * square;
            }
            assert!(
                (thrust / weight - 1.0).abs() < 1e-9 && (made - moment).norm() < 1e-9,
                "{seed}: {made}"
            );
        }
    }

    #[test]
    fn the_wanted_attitude_tilts_towards_the_acceleration() {
        // To accelerate north the vehicle pitches its nose down: the down axis leans back.
        let lift = Vector3::new(-3.0, 0.0, GRAVITY_M_S2);
        let (_, pitch, yaw) = attitude(lift, 0.0).euler_angles();
        assert!((pitch + (3.0_f64 / GRAVITY_M_S2).atan()).abs() < 1e-9 && yaw.abs() < 1e-9);
        let (roll, _, _) = attitude(Vector3::new(0.0, -3.0, GRAVITY_M_S2), 0.0).euler_angles();
        assert!(roll > 0.2, "right for east");
    }
}
