//! How the motion after a step changes with the motion before it, by dual numbers.
//!
//! The step of [`Plant::step`] on lanes that carry derivatives by position, attitude, velocity and
//! rate, twelve in all. An attitude changes by a rotation vector in the body frame:
//! `q <- q (1, delta / 2)`. Rotor speeds, membranes, servos, battery and load are what they are;
//! what of them depends on the motion within the step, as the rate of the angle of attack does, is
//! followed.

use super::{Plant, PlantState, WingPlant};
use squirrel_core::dynamics::lanes::Motion;
use squirrel_core::dynamics::runge_kutta;
use squirrel_core::dynamics::whole::{self, FLAT, MEMBRANE, lateral};
use squirrel_core::frames::{In, Ned};
use squirrel_core::lane::vector::rotation;
use squirrel_core::lane::{Dual, Lane};
use squirrel_core::nalgebra::{Quaternion, SMatrix};
use squirrel_core::vehicle::{MAX_ROTORS, PerRotor, ROTOR_BLOCK};

/// Variables of a motion: position, m, rotation, rad, velocity, m/s, rate, rad/s; three each.
pub const VARIABLES: usize = 12;

type Variable = Dual<VARIABLES>;

/// Change of the motion after a step, by row, over its change before it, by column.
pub type Jacobian = SMatrix<f64, VARIABLES, VARIABLES>;

impl Plant {
    /// Derivatives of the motion after a step by the motion before it; `None` where the wings are a
    /// network.
    ///
    /// * arguments as in [`Self::step`], which moves the state; this does not
    // A step on twelve derivatives takes long to compile: inline, so that only who asks for it does.
    #[inline]
    pub fn jacobian(
        &self,
        state: &PlantState,
        rotor_command: &PerRotor<f64>,
        wing_command: [f64; 2],
        wind: In<Ned, f64>,
    ) -> Option<Jacobian> {
        let mut state = *state;
        self.drive(&mut state, rotor_command);
        let deployment = self.deploy(&mut state, wing_command);
        if self.vehicle().rotor_blocks() == 1 {
            self.of_rotors::<ROTOR_BLOCK>(&state, deployment, wind)
        } else {
            self.of_rotors::<MAX_ROTORS>(&state, deployment, wind)
        }
    }

    fn of_rotors<const ROTORS: usize>(
        &self,
        state: &PlantState,
        deployment: [f64; 2],
        wind: In<Ned, f64>,
    ) -> Option<Jacobian> {
        let constant = Variable::constant;
        let membrane = matches!(self.wing, WingPlant::Membrane { .. });
        let mut vehicle = self.whole::<ROTORS>()?;
        vehicle.held.wind = wind.vector.into();
        vehicle.held.target_speed = core::array::from_fn(|i| state.drive.target_rad_s[i]);
        vehicle.air_omega = state.air_omega.map(|air| air.vector.into());
        vehicle.load = state.load;
        vehicle.deployment = deployment;
        let mut vehicle = vehicle.map(constant);
        let before = variables::<ROTORS>(&Motion::from(&state.body));
        let sides = [0, 1].map(|side| state.membrane.side(side).map(constant));
        if membrane {
            let air = whole::air::<_, ROTORS, true>(&vehicle, &before, &rotation(&before.attitude));
            let y = lateral(vehicle.membrane.arm_m);
            for side in 0..2 {
                let turned = vehicle.membrane.angle_of_attack(&air, y[side])
                    - constant(state.wing_angle_rad[side]);
                vehicle.angle_rate[side] = turned / constant(self.dt_s());
            }
        }
        let stages = runge_kutta(constant(self.dt_s()));
        let (after, _) = if membrane {
            whole::step::<_, ROTORS, MEMBRANE, true>(&vehicle, &stages, &before, &sides)
        } else {
            whole::step::<_, ROTORS, FLAT, true>(&vehicle, &stages, &before, &sides)
        };
        Some(rows(&after))
    }
}

/// The quaternion that `q` gains over a rotation vector along a body axis.
fn along(q: Quaternion<f64>, axis: usize) -> Quaternion<f64> {
    let mut half = [0.0; 3];
    half[axis] = 0.5;
    q * Quaternion::new(0.0, half[0], half[1], half[2])
}

/// A motion whose derivatives by itself are one.
fn variables<const ROTORS: usize>(motion: &Motion<f64, ROTORS>) -> Motion<Variable, ROTORS> {
    let three = |numbers: [f64; 3], from: usize| {
        [0, 1, 2].map(|axis| Variable::variable(numbers[axis], from + axis))
    };
    let [w, x, y, z] = motion.attitude;
    let mut attitude = motion.attitude.map(Variable::constant);
    for axis in 0..3 {
        let gained = along(Quaternion::new(w, x, y, z), axis);
        for (component, by) in attitude.iter_mut().zip([gained.w, gained.i, gained.j, gained.k]) {
            component.by[3 + axis] = by;
        }
    }
    Motion {
        position: three(motion.position, 0),
        velocity: three(motion.velocity, 6),
        attitude,
        omega: three(motion.omega, 9),
        rotor_speed: motion.rotor_speed.map(Variable::splat),
    }
}

fn rows<const ROTORS: usize>(motion: &Motion<Variable, ROTORS>) -> Jacobian {
    let [w, x, y, z] = motion.attitude.map(|component| component.value);
    let back = Quaternion::new(w, x, y, z).conjugate();
    Jacobian::from_fn(|row, column| {
        let axis = row % 3;
        match row / 3 {
            0 => motion.position[axis].by[column],
            1 => {
                let [w, x, y, z] = motion.attitude.map(|component| component.by[column]);
                2.0 * (back * Quaternion::new(w, x, y, z)).imag()[axis]
            }
            2 => motion.velocity[axis].by[column],
            _ => motion.omega[axis].by[column],
        }
    })
}

#[cfg(test)]
mod tests;
