//! The numbers of an airframe as a file or a program writes them, unchecked.

use super::{RotorAir, ThrustCurve};
use crate::frames::{Body, In};
use crate::math::{AIR_DENSITY_KG_M3, Real, real};
use nalgebra::{Matrix3, Vector3};

/// Most rotors a vehicle may have. Rotor loops run over blocks of [`ROTOR_BLOCK`]; unused places
/// are zero.
pub const MAX_ROTORS: usize = 8;
/// Rotors per block: a fixed inner length lets the compiler unroll.
pub const ROTOR_BLOCK: usize = 4;

/// One number per rotor, in command order.
pub type PerRotor<T> = [T; MAX_ROTORS];

/// Where a rotor sits and which way it twists the airframe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotor<T: Real> {
    /// Hub position in the body frame, m. Thrust acts along -z.
    pub position: In<Body, T>,
    /// Sign of the reaction torque about +z (down): -1 for a rotor that turns clockwise seen from
    /// above.
    pub yaw_sign: T,
}

/// What one rotor command number means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandKind {
    /// 0..1, fraction of the top rotor speed.
    SpeedFraction,
    /// 0..1, duty cycle.
    Duty,
    /// 1000..2000 us pulse width, linear in duty.
    PwmMicroseconds,
    /// Thrust, N.
    ThrustNewton,
}

/// How commands become rotor speed, thrust and reaction torque. All rotors are alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Propulsion<T> {
    /// Meaning of a command.
    pub command: CommandKind,
    /// Top rotor speed at the reference voltage, rad/s.
    pub speed_max_rad_s: T,
    /// Thrust over speed squared, N s^2 (per rad^2).
    pub thrust_coefficient_n_s2: T,
    /// Reaction torque over speed squared, N m s^2 (per rad^2).
    pub torque_coefficient_n_m_s2: T,
    /// First-order lag of rotor speed when speeding up, s; 0 for none.
    pub time_constant_up_s: T,
    /// First-order lag of rotor speed when slowing down, s; 0 for none.
    pub time_constant_down_s: T,
    /// Radius of a propeller, m: its disc's area makes the speed of its jet.
    pub propeller_radius_m: T,
    /// What motion through the air makes of thrust.
    pub air: RotorAir<T>,
    /// Battery voltage at which the numbers above hold, V.
    pub reference_voltage_v: T,
    /// The paper's cubic from the voltage that a duty cycle applies to thrust; replaces the square
    /// law of the command.
    pub thrust_curve: Option<ThrustCurve<T>>,
}

/// Drag of airframe and rotors without wings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drag<T: Real> {
    /// Force over airspeed per body axis, N s/m: `F = -linear * v`.
    pub linear_n_s_per_m: Vector3<T>,
    /// Drag area `C_d A`, m^2: `F = -1/2 rho C_d A |v| v`.
    pub area_m2: T,
}

impl<T: Real> Drag<T> {
    /// `1/2 rho C_d A`, N s^2/m^2.
    #[inline(always)]
    pub fn per_square(&self) -> T {
        real::<T>(0.5 * AIR_DENSITY_KG_M3) * self.area_m2
    }
}

/// A pair of wings that lie in the body's x-y plane when spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wing<T> {
    /// Area of one side, m^2.
    pub area_per_side_m2: T,
    /// Normal force coefficient over sin(angle of attack); 2 for the paper's flat plate.
    pub normal_force_slope: T,
    /// Distance of each side's centre from the x axis, m.
    pub lateral_arm_m: T,
    /// How far ahead of the centre of mass the centres are, m.
    pub longitudinal_arm_m: T,
    /// How far below the centre of mass they are, m.
    pub vertical_arm_m: T,
    /// Length along the flight, m; with the area it gives each side's span.
    pub chord_m: T,
    /// First-order lag of deployment, s.
    pub time_constant_s: T,
}

/// What the flight code may ask for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits<T> {
    /// Limit of |roll| and of |pitch|, rad.
    pub tilt_max_rad: T,
    /// Limit of the collective thrust, N.
    pub thrust_max_n: T,
    /// Limit of the thrust of each rotor, N, where it is below what the rotor can give.
    pub rotor_thrust_max_n: Option<T>,
}

/// Every number of an airframe, unchecked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters<T: Real> {
    /// Mass, kg.
    pub mass_kg: T,
    /// Inertia about the centre of mass in the body frame, kg m^2.
    pub inertia_kg_m2: Matrix3<T>,
    /// The first `rotor_count` entries, in command order.
    pub rotors: [Rotor<T>; MAX_ROTORS],
    /// Number of rotors, 1 to [`MAX_ROTORS`].
    pub rotor_count: usize,
    /// How commands become thrust.
    pub propulsion: Propulsion<T>,
    /// Drag without wings.
    pub drag: Drag<T>,
    /// The wings, if the vehicle has any.
    pub wing: Option<Wing<T>>,
    /// Limits for the flight code.
    pub limits: Limits<T>,
}

impl<T: Real> Rotor<T> {
    /// A place that no rotor takes.
    pub fn unused() -> Self {
        Self { position: In::zero(), yaw_sign: T::zero() }
    }
    /// A rotor in the plane of the centre of mass, m.
    pub fn planar(x_m: f64, y_m: f64, yaw_sign: f64) -> Self {
        Self {
            position: In::new(Vector3::new(real(x_m), real(y_m), T::zero())),
            yaw_sign: real(yaw_sign),
        }
    }
}

impl<T: Real> Propulsion<T> {
    /// Mean of the lags of speeding up and of slowing down, s.
    pub fn time_constant_s(&self) -> T {
        real::<T>(0.5) * (self.time_constant_up_s + self.time_constant_down_s)
    }

    /// Steady rotor speed at the reference voltage for a command, rad/s. Commands outside their
    /// range are limited.
    #[inline]
    pub fn target_speed_rad_s(&self, command: T) -> T {
        let fraction = match self.command {
            CommandKind::ThrustNewton => return self.speed_for_thrust(command),
            CommandKind::SpeedFraction | CommandKind::Duty => command,
            CommandKind::PwmMicroseconds => (command - real(1000.0)) * real(1e-3),
        };
        let fraction = crate::math::limit(fraction, T::zero(), T::one());
        match &self.thrust_curve {
            None => fraction * self.speed_max_rad_s,
            Some(curve) => {
                self.speed_for_thrust(curve.thrust_n(fraction * self.reference_voltage_v))
            }
        }
    }
    /// The command that gives a thrust, at the reference voltage. Inverse of
    /// [`Self::target_speed_rad_s`].
    ///
    /// * `thrust_n` - thrust of one rotor, N, not below 0; commands that are fractions or pulses
    ///   are limited to their range
    #[inline]
    pub fn command_for_thrust(&self, thrust_n: T) -> T {
        let fraction = match (self.command, &self.thrust_curve) {
            (CommandKind::ThrustNewton, _) => return crate::math::upper(thrust_n, T::zero()),
            (_, Some(curve)) => curve.voltage_v(thrust_n) / self.reference_voltage_v,
            (_, None) => self.speed_for_thrust(thrust_n) / self.speed_max_rad_s,
        };
        let fraction = crate::math::limit(fraction, T::zero(), T::one());
        match self.command {
            CommandKind::PwmMicroseconds => real::<T>(1000.0) + fraction * real(1000.0),
            _ => fraction,
        }
    }
    #[inline(always)]
    fn speed_for_thrust(&self, thrust_n: T) -> T {
        crate::math::sqrt(crate::math::upper(thrust_n, T::zero()) / self.thrust_coefficient_n_s2)
    }
}

#[cfg(test)]
pub(crate) mod fixtures {
    use super::*;

    /// The squirrel's numbers as the tests of this crate use them.
    pub(crate) fn squirrel<T: Real>() -> Parameters<T> {
        let mut rotors = [Rotor::unused(); MAX_ROTORS];
        let d = 0.085;
        for (i, (x, y, s)) in
            [(d, -d, -1.0), (-d, -d, 1.0), (-d, d, -1.0), (d, d, 1.0)].into_iter().enumerate()
        {
            rotors[i] = Rotor::planar(x, y, s);
        }
        Parameters {
            mass_kg: real(0.548),
            inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(
                real(3.22e-3),
                real(4.68e-3),
                real(7.72e-3),
            )),
            rotors,
            rotor_count: 4,
            propulsion: Propulsion {
                command: CommandKind::SpeedFraction,
                speed_max_rad_s: real(3000.0),
                thrust_coefficient_n_s2: real(6.0e-7),
                torque_coefficient_n_m_s2: real(6.6e-9),
                time_constant_up_s: real(0.03),
                time_constant_down_s: real(0.04),
                propeller_radius_m: real(0.0508),
                air: RotorAir::still(),
                reference_voltage_v: real(14.8),
                thrust_curve: None,
            },
            drag: Drag { linear_n_s_per_m: Vector3::zeros(), area_m2: real(0.01) },
            wing: Some(Wing {
                area_per_side_m2: real(0.02),
                normal_force_slope: real(2.0),
                lateral_arm_m: real(0.09),
                longitudinal_arm_m: T::zero(),
                vertical_arm_m: real(0.02),
                chord_m: real(0.2),
                time_constant_s: real(0.07),
            }),
            limits: Limits {
                tilt_max_rad: real(core::f64::consts::FRAC_PI_6),
                thrust_max_n: real(10.7),
                rotor_thrust_max_n: None,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_and_thrust_are_inverse_for_every_kind() {
        let kinds = [
            CommandKind::SpeedFraction,
            CommandKind::Duty,
            CommandKind::PwmMicroseconds,
            CommandKind::ThrustNewton,
        ];
        for kind in kinds {
            let mut p = super::fixtures::squirrel::<f64>().propulsion;
            p.command = kind;
            for thrust in [0.0, 0.3, 1.3435, 4.0] {
                let speed = p.target_speed_rad_s(p.command_for_thrust(thrust));
                assert!(
                    (p.thrust_coefficient_n_s2 * speed * speed - thrust).abs() < 1e-12,
                    "{kind:?}"
                );
            }
        }
    }
}
