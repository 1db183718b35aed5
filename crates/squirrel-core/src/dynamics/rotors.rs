//! Rotors: from command to speed, from speed to force and moment.
//!
//! `T_i = k_f Omega_i^2` along -z, `Q_i = yaw_sign_i k_m Omega_i^2` about +z,
//! `Omega_i' = (target_i - Omega_i) / tau` with its own `tau` for speeding up and slowing down
//! (docs/equations.md D.5).

use crate::effects::Acting;
use crate::frames::{Body, In, Wrench};
use crate::lane::Lane;
use crate::math::Real;
use crate::vehicle::{MAX_ROTORS, PerRotor, Propulsion, ROTOR_BLOCK, Vehicle};
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
        effects: &Acting<T>,
        command: &PerRotor<T>,
        battery_voltage_v: T,
    ) -> Self {
        let propulsion = &vehicle.parameters().propulsion;
        let mut target_rad_s = [T::zero(); MAX_ROTORS];
        for (target, u) in
            target_rad_s.iter_mut().zip(command).take(vehicle.parameters().rotor_count)
        {
            *target = propulsion.target_speed_rad_s(*u);
        }
        if effects.any() {
            effects.numbers().rotor_targets(
                effects.present(),
                &mut target_rad_s,
                battery_voltage_v,
            );
        }
        let extra_s = effects.rotor_extra_time_constant_s();
        let [up, down] = inverse_lag(propulsion, extra_s);
        Self { target_rad_s, inverse_time_constant_up: up, inverse_time_constant_down: down }
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
        let inverse = [self.inverse_time_constant_up, self.inverse_time_constant_down];
        for i in 0..blocks * ROTOR_BLOCK {
            rate[i] = lag_rate(self.target_rad_s[i], speed[i], inverse);
        }
        rate
    }

    /// Moves rotor speeds exactly over a time of any length:
    /// `target + (speed - target) exp(-dt / tau)`.
    #[inline]
    pub fn lead(&self, speed: &mut PerRotor<T>, dt_s: T) {
        let keep =
            |inverse: T| if inverse > T::zero() { (-dt_s * inverse).exp() } else { T::zero() };
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
        let inverse = [self.inverse_time_constant_up, self.inverse_time_constant_down];
        for (speed, target) in speed.iter_mut().zip(&self.target_rad_s) {
            *speed = lag_start(*target, *speed, inverse);
        }
    }
}

/// Inverse time constants of the rotors, speeding up and slowing down, 1/s; 0 for no lag.
///
/// * `extra_s` - on top of the propulsion's own
#[inline(always)]
pub(super) fn inverse_lag<T: Real>(propulsion: &Propulsion<T>, [up_s, down_s]: [T; 2]) -> [T; 2] {
    [propulsion.time_constant_up_s + up_s, propulsion.time_constant_down_s + down_s]
        .map(|tau| if tau > T::zero() { T::one() / tau } else { T::zero() })
}

/// Rate of one rotor's speed, rad/s^2.
///
/// * `inverse` - of the time constants of speeding up and of slowing down, 1/s; 0 for no lag
#[inline(always)]
pub fn lag_rate<L: Lane>(target: L, speed: L, inverse: [L; 2]) -> L {
    let gap = target - speed;
    gap * gap.where_positive(inverse[0], inverse[1])
}

/// Speed of one rotor at the start of a step: without lag it is at its target at once.
///
/// * `inverse` - as of [`lag_rate`]
#[inline(always)]
pub fn lag_start<L: Lane>(target: L, speed: L, inverse: [L; 2]) -> L {
    (target - speed).where_positive(inverse[0], inverse[1]).where_positive(speed, target)
}

/// Thrust and the three moments of all rotors, N and N m.
///
/// * `per_square` - thrust, roll, pitch and yaw of each over its speed squared
/// * `speed` - rad/s
#[inline(always)]
pub fn thrust_and_moment<L: Lane, const ROTORS: usize>(
    [thrust, roll, pitch, yaw]: [&[L; ROTORS]; 4],
    speed: &[L; ROTORS],
) -> (L, [L; 3]) {
    let square = speed[0] * speed[0];
    let mut sum = square * thrust[0];
    let mut moment = [square * roll[0], square * pitch[0], square * yaw[0]];
    for i in 1..ROTORS {
        let square = speed[i] * speed[i];
        sum = sum + square * thrust[i];
        moment[0] = moment[0] + square * roll[i];
        moment[1] = moment[1] + square * pitch[i];
        moment[2] = moment[2] + square * yaw[i];
    }
    (sum, moment)
}

/// Force and moment of all rotors, body frame.
#[inline(always)]
pub(super) fn wrench<T: Real>(vehicle: &Vehicle<T>, speed: &PerRotor<T>) -> Wrench<Body, T> {
    let p = vehicle.rotor_wrench_per_speed_squared();
    let all = [&p.thrust, &p.roll, &p.pitch, &p.yaw];
    // Mostly there are four.
    let (thrust, moment) = if vehicle.rotor_blocks() == 1 {
        thrust_and_moment(all.map(first_block), first_block(speed))
    } else {
        thrust_and_moment(all, speed)
    };
    Wrench {
        force: In::new(Vector3::new(T::zero(), T::zero(), -thrust)),
        moment: In::new(Vector3::from(moment)),
    }
}

#[inline(always)]
fn first_block<T>(all: &PerRotor<T>) -> &[T; ROTOR_BLOCK] {
    const { assert!(ROTOR_BLOCK <= MAX_ROTORS) };
    match all.first_chunk() {
        Some(block) => block,
        None => unreachable!(),
    }
}

/// Signs of the rotors' spin about +z: a rotor spins against its reaction torque.
#[inline(always)]
pub fn spin_signs<T: Real>(vehicle: &Vehicle<T>) -> PerRotor<T> {
    let mut signs = [T::zero(); MAX_ROTORS];
    for (sign, rotor) in signs.iter_mut().zip(vehicle.rotors()) {
        *sign = -rotor.yaw_sign;
    }
    signs
}

/// Sum of the rotor speeds about +z, rad/s.
#[inline(always)]
pub fn spin<L: Lane, const ROTORS: usize>(signs: &[L; ROTORS], speed: &[L; ROTORS]) -> L {
    let mut sum = L::of(0.0);
    for i in 0..ROTORS {
        sum = sum + signs[i] * speed[i];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Effects;
    use crate::vehicle::fixtures::squirrel;

    fn acting(effects: &Effects<f64>) -> Acting<f64> {
        Acting::new(effects, &Vehicle::new(squirrel::<f64>()).unwrap())
    }

    /// Which rotor does what follows from geometry alone: left pair rolls right, front pair pitches
    /// up, the rotors whose reaction is positive yaw right (clockwise from above).
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
        let drive = RotorDrive::new(&vehicle, &acting(&Effects::none()), &[0.5; MAX_ROTORS], 14.8);
        let up = drive.rates(1, &[1000.0; MAX_ROTORS]);
        let down = drive.rates(1, &[2000.0; MAX_ROTORS]);
        assert!((up[0] - 500.0 / 0.03).abs() < 1e-6 && (down[0] + 500.0 / 0.04).abs() < 1e-6);
        assert_eq!(up[4], 0.0, "no rotor, no rate");
    }

    #[test]
    fn leading_is_exact_for_any_time() {
        let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
        let drive = RotorDrive::new(&vehicle, &acting(&Effects::none()), &[0.5; MAX_ROTORS], 14.8);
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
        let drive = RotorDrive::new(&vehicle, &acting(&Effects::none()), &[0.5; MAX_ROTORS], 14.8);
        let mut speed = [1000.0; MAX_ROTORS];
        drive.settle(&mut speed);
        assert_eq!(speed[..4], [1500.0; 4]);
        let mut fast = [2000.0; MAX_ROTORS];
        drive.settle(&mut fast);
        assert_eq!(fast[..4], [2000.0; 4], "slowing down still lags");
    }
}
