//! Rotors: from command to speed, from speed to force and moment.
//!
//! `T_i = k_f Omega_i^2` along -z, `Q_i = yaw_sign_i k_m Omega_i^2` about +z, `Omega_i' = (target_i - Omega_i) / tau`
//! with its own `tau` for speeding up and slowing down (docs/equations.md D.5).

use crate::effects::{Effects, Supply};
use crate::frames::{Body, In, Wrench};
use crate::math::Real;
use crate::vehicle::{MAX_ROTORS, PerRotor, ROTOR_BLOCK, Vehicle};
use nalgebra::Vector3;

/// Rotor targets and lags for one held command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotorDrive<T> {
    /// Steady speed that each rotor moves towards, rad/s.
    pub target_rad_s: PerRotor<T>,
    inverse_time_constant_up: T,
    inverse_time_constant_down: T,
}

impl<T: Real> RotorDrive<T> {
    /// What a command asks of the rotors.
    ///
    /// * `command` - one number a rotor, in the unit that the vehicle declares
    /// * `battery_voltage_v` - felt only through the `battery_sag` effect
    pub fn new(
        vehicle: &Vehicle<T>,
        effects: &Effects<T>,
        command: &PerRotor<T>,
        battery_voltage_v: T,
    ) -> Self {
        let propulsion = &vehicle.parameters().propulsion;
        let mut target_rad_s = [T::zero(); MAX_ROTORS];
        for (target, u) in target_rad_s.iter_mut().zip(command).take(vehicle.parameters().rotor_count) {
            *target = propulsion.target_speed_rad_s(*u);
        }
        let mut extra_s = [T::zero(); 2];
        if effects.any() {
            let supply = Supply {
                voltage_v: battery_voltage_v,
                reference_voltage_v: propulsion.reference_voltage_v,
                speed_max_rad_s: propulsion.speed_max_rad_s,
            };
            effects.rotor_target(&mut target_rad_s, &supply);
            extra_s = effects.rotor_extra_time_constant_s();
        }
        let inverse = |tau: T| if tau > T::zero() { T::one() / tau } else { T::zero() };
        Self {
            target_rad_s,
            inverse_time_constant_up: inverse(propulsion.time_constant_up_s + extra_s[0]),
            inverse_time_constant_down: inverse(propulsion.time_constant_down_s + extra_s[1]),
        }
    }

    /// No change of these speeds, rad/s.
    pub fn holding(speed_rad_s: PerRotor<T>) -> Self {
        Self {
            target_rad_s: speed_rad_s,
            inverse_time_constant_up: T::zero(),
            inverse_time_constant_down: T::zero(),
        }
    }

    /// Rates of the rotor speeds, rad/s^2.
    #[inline(always)]
    pub(super) fn rates(&self, blocks: usize, speed: &PerRotor<T>) -> PerRotor<T> {
        let mut rate = [T::zero(); MAX_ROTORS];
        for block in 0..blocks {
            for i in block * ROTOR_BLOCK..(block + 1) * ROTOR_BLOCK {
                let gap = self.target_rad_s[i] - speed[i];
                let inverse = if gap > T::zero() {
                    self.inverse_time_constant_up
                } else {
                    self.inverse_time_constant_down
                };
                rate[i] = gap * inverse;
            }
        }
        rate
    }

    /// Moves rotor speeds exactly over a time of any length: `target + (speed - target) exp(-dt / tau)`.
    #[inline]
    pub fn lead(&self, speed: &mut PerRotor<T>, dt_s: T) {
        let keep = |inverse: T| if inverse > T::zero() { (-dt_s * inverse).exp() } else { T::zero() };
        let up = keep(self.inverse_time_constant_up);
        let down = if self.inverse_time_constant_down == self.inverse_time_constant_up {
            up
        } else {
            keep(self.inverse_time_constant_down)
        };
        for (speed, target) in speed.iter_mut().zip(&self.target_rad_s) {
            let gap = *target - *speed;
            *speed = *target - gap * if gap > T::zero() { up } else { down };
        }
    }

    /// Rotor speeds at the start of a step: a rotor without lag is at its target at once.
    #[inline(always)]
    pub fn settle(&self, speed: &mut PerRotor<T>) {
        for (speed, target) in speed.iter_mut().zip(&self.target_rad_s) {
            let inverse = if *target > *speed {
                self.inverse_time_constant_up
            } else {
                self.inverse_time_constant_down
            };
            if inverse == T::zero() {
                *speed = *target;
            }
        }
    }
}

/// Force and moment of all rotors, body frame.
#[inline(always)]
pub(super) fn wrench<T: Real>(vehicle: &Vehicle<T>, speed: &PerRotor<T>) -> Wrench<Body, T> {
    let per_square = vehicle.rotor_wrench_per_speed_squared();
    let (mut thrust, mut roll, mut pitch, mut yaw) = (T::zero(), T::zero(), T::zero(), T::zero());
    for block in 0..vehicle.rotor_blocks() {
        for i in block * ROTOR_BLOCK..(block + 1) * ROTOR_BLOCK {
            let square = speed[i] * speed[i];
            thrust += square * per_square.thrust[i];
            roll += square * per_square.roll[i];
            pitch += square * per_square.pitch[i];
            yaw += square * per_square.yaw[i];
        }
    }
    Wrench {
        force: In::new(Vector3::new(T::zero(), T::zero(), -thrust)),
        moment: In::new(Vector3::new(roll, pitch, yaw)),
    }
}

/// Sum of the rotor speeds about +z, rad/s: a rotor spins against its reaction torque.
#[inline(always)]
pub(super) fn spin<T: Real>(vehicle: &Vehicle<T>, speed: &PerRotor<T>) -> T {
    let pairs = vehicle.rotors().iter().zip(speed);
    pairs.fold(T::zero(), |sum, (rotor, speed)| sum - rotor.yaw_sign * *speed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::fixtures::squirrel;

    /// Which rotor does what follows from geometry alone: left pair rolls right, front pair pitches up, the rotors whose
    /// reaction is positive yaw right (clockwise from above).
    #[test]
    fn rotors_turn_the_airframe_the_right_way() {
        let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
        for (i, rotor) in vehicle.rotors().iter().enumerate() {
            let mut speed = [0.0; MAX_ROTORS];
            speed[i] = 1000.0;
            let w = wrench(&vehicle, &speed);
            assert!(w.force.vector.z < 0.0, "thrust points up");
            assert_eq!(w.moment.vector.x.signum(), -rotor.position.vector.y.signum());
            assert_eq!(w.moment.vector.y.signum(), rotor.position.vector.x.signum());
            assert_eq!(w.moment.vector.z.signum(), rotor.yaw_sign);
        }
    }

    #[test]
    fn speeding_up_and_slowing_down_have_their_own_lag() {
        let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
        let drive = RotorDrive::new(&vehicle, &Effects::none(), &[0.5; MAX_ROTORS], 14.8);
        let up = drive.rates(1, &[1000.0; MAX_ROTORS]);
        let down = drive.rates(1, &[2000.0; MAX_ROTORS]);
        assert!((up[0] - 500.0 / 0.03).abs() < 1e-6 && (down[0] + 500.0 / 0.04).abs() < 1e-6);
        assert_eq!(up[4], 0.0, "no rotor, no rate");
    }

    #[test]
    fn leading_is_exact_for_any_time() {
        let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
        let drive = RotorDrive::new(&vehicle, &Effects::none(), &[0.5; MAX_ROTORS], 14.8);
        let mut speed = [1000.0, 2000.0, 1500.0, 1000.0, 0.0, 0.0, 0.0, 0.0];
        drive.lead(&mut speed, 0.0);
        assert_eq!(speed[..2], [1000.0, 2000.0]);
        drive.lead(&mut speed, 0.06);
        assert!((speed[0] - (1500.0 - 500.0 * (-2.0_f64).exp())).abs() < 1e-9, "up in 0.03 s");
        assert!((speed[1] - (1500.0 + 500.0 * (-1.5_f64).exp())).abs() < 1e-9, "down in 0.04 s");
        assert_eq!((speed[2], speed[4]), (1500.0, 0.0));
    }

    #[test]
    fn a_rotor_without_lag_is_at_its_target() {
        let mut p = squirrel::<f64>();
        p.propulsion.time_constant_up_s = 0.0;
        let vehicle = Vehicle::new(p).unwrap();
        let drive = RotorDrive::new(&vehicle, &Effects::none(), &[0.5; MAX_ROTORS], 14.8);
        let mut speed = [1000.0; MAX_ROTORS];
        drive.settle(&mut speed);
        assert_eq!(speed[..4], [1500.0; 4]);
        let mut fast = [2000.0; MAX_ROTORS];
        drive.settle(&mut fast);
        assert_eq!(fast[..4], [2000.0; 4], "slowing down still lags");
    }
}
