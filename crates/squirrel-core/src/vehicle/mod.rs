//! The numbers of one airframe: mass, rotors, propulsion, drag, wing, limits. Checked once,
//! constant in flight.
//!
//! [`Parameters`] is plain data, as a file or a program writes it. [`Vehicle::new`] checks every
//! number and derives what the hot loops need; an error names the field as the vehicle file spells
//! it, and the value.

mod check;
mod parameters;
mod rotor_air;
mod thrust_curve;

pub use check::ParameterError;
pub(crate) use check::{each_not_negative, each_positive, not_negative, positive};
#[cfg(test)]
pub(crate) use parameters::fixtures;
pub use parameters::{
    CommandKind, Drag, Limits, MAX_ROTORS, Parameters, PerRotor, Propulsion, ROTOR_BLOCK, Rotor,
    Wing,
};
pub use rotor_air::RotorAir;
pub use thrust_curve::ThrustCurve;

use crate::frames::{Body, In};
use crate::math::{GRAVITY_M_S2, Real, real};
use nalgebra::{Matrix3, Vector3};

/// Numbers of the airframe that effects change once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alteration<T: Real> {
    /// Mass, kg.
    pub mass_kg: T,
    /// Inertia, kg m^2.
    pub inertia_kg_m2: Matrix3<T>,
    /// Factor on the thrust of each rotor.
    pub thrust: PerRotor<T>,
    /// Factor on the reaction torque of each rotor.
    pub torque: PerRotor<T>,
}

/// A checked airframe with what the loops derive from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vehicle<T: Real> {
    parameters: Parameters<T>,
    inverse_mass: T,
    inertia_inverse: Matrix3<T>,
    per_speed_squared: RotorWrench<T>,
}

/// Thrust (along -z) and moments that each rotor gives per speed squared; zero where there is no
/// rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RotorWrench<T> {
    pub(crate) thrust: PerRotor<T>,
    pub(crate) roll: PerRotor<T>,
    pub(crate) pitch: PerRotor<T>,
    pub(crate) yaw: PerRotor<T>,
}

impl<T: Real> RotorWrench<T> {
    fn new(p: &Parameters<T>) -> Self {
        let none = [T::zero(); MAX_ROTORS];
        let mut out = Self { thrust: none, roll: none, pitch: none, yaw: none };
        let k_f = p.propulsion.thrust_coefficient_n_s2;
        for (i, rotor) in p.rotors[..p.rotor_count].iter().enumerate() {
            // r x (0, 0, -T)
            out.thrust[i] = k_f;
            out.roll[i] = -rotor.position.vector.y * k_f;
            out.pitch[i] = rotor.position.vector.x * k_f;
            out.yaw[i] = rotor.yaw_sign * p.propulsion.torque_coefficient_n_m_s2;
        }
        out
    }
}

impl<T: Real> Vehicle<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// [`ParameterError`] names the first field that is not finite, out of range or physically
    /// impossible.
    pub fn new(parameters: Parameters<T>) -> Result<Self, ParameterError> {
        check::check(&parameters)?;
        let inertia_inverse = parameters
            .inertia_kg_m2
            .try_inverse()
            .ok_or(ParameterError::inertia("inertia is singular"))?;
        let inverse_mass = T::one() / parameters.mass_kg;
        Ok(Self {
            parameters,
            inverse_mass,
            inertia_inverse,
            per_speed_squared: RotorWrench::new(&parameters),
        })
    }
    #[inline(always)]
    pub(crate) fn rotor_wrench_per_speed_squared(&self) -> &RotorWrench<T> {
        &self.per_speed_squared
    }
    /// The vehicle with numbers that effects changed; its geometry and propulsion stay as declared.
    ///
    /// # Errors
    /// A mass or inertia that is not positive. The triangle inequality is not asked for: an error
    /// of one moment is a hypothesis about numbers, not a body.
    pub(crate) fn altered(&self, change: &Alteration<T>) -> Result<Self, ParameterError> {
        check::positive("mass.mass_kg", change.mass_kg)?;
        let mut out = *self;
        out.inverse_mass = T::one() / change.mass_kg;
        out.parameters.mass_kg = change.mass_kg;
        out.parameters.inertia_kg_m2 = change.inertia_kg_m2;
        for moment in change.inertia_kg_m2.diagonal().iter() {
            check::positive("mass.inertia_kg_m2", *moment)?;
        }
        out.inertia_inverse = change
            .inertia_kg_m2
            .try_inverse()
            .ok_or(ParameterError::inertia("inertia is singular"))?;
        let rotors = &mut out.per_speed_squared;
        for i in 0..MAX_ROTORS {
            rotors.thrust[i] *= change.thrust[i];
            rotors.roll[i] *= change.thrust[i];
            rotors.pitch[i] *= change.thrust[i];
            rotors.yaw[i] *= change.torque[i];
        }
        Ok(out)
    }
    /// Thrust and reaction torque of each rotor over what the propulsion numbers give: rotors of
    /// one make scatter.
    pub fn rotor_factors(&self) -> [PerRotor<T>; 2] {
        let (own, alike) = (&self.per_speed_squared, RotorWrench::new(&self.parameters));
        let over = |own: &PerRotor<T>, alike: &PerRotor<T>| {
            let mut factors = [T::one(); MAX_ROTORS];
            for ((factor, own), alike) in factors.iter_mut().zip(own).zip(alike) {
                if *alike != T::zero() {
                    *factor = *own / *alike;
                }
            }
            factors
        };
        [over(&own.thrust, &alike.thrust), over(&own.yaw, &alike.yaw)]
    }
    /// The vehicle with rotors that give more or less than the propulsion numbers say. What is cast
    /// from it, as flight code is, takes its rotors for alike.
    ///
    /// * `thrust`, `torque` - over what each rotor had
    ///
    /// # Errors
    /// A factor that is not positive, by its field in vehicle files.
    pub fn with_rotor_factors(
        &self,
        [thrust, torque]: [PerRotor<T>; 2],
    ) -> Result<Self, ParameterError> {
        for (field, factors) in
            [("rotor[].thrust_fraction", &thrust), ("rotor[].torque_fraction", &torque)]
        {
            check::each_positive(field, factors)?;
        }
        let p = &self.parameters;
        self.altered(&Alteration {
            mass_kg: p.mass_kg,
            inertia_kg_m2: p.inertia_kg_m2,
            thrust,
            torque,
        })
    }
    /// The vehicle with one rotor beside its place and with another reaction torque: rotors of one
    /// make scatter. Out of the range of [`Self::rotors`], the vehicle itself.
    ///
    /// * `moved` - of the hub, m
    /// * `torque_factor` - over what the rotor had
    #[must_use]
    pub fn with_rotor_off(&self, rotor: usize, moved: In<Body, T>, torque_factor: T) -> Self {
        let mut out = *self;
        if let Some(own) = out.parameters.rotors[..self.parameters.rotor_count].get_mut(rotor) {
            own.position = own.position + moved;
            let wrench = &mut out.per_speed_squared;
            wrench.roll[rotor] -= moved.vector.y * wrench.thrust[rotor];
            wrench.pitch[rotor] += moved.vector.x * wrench.thrust[rotor];
            wrench.yaw[rotor] *= torque_factor;
        }
        out
    }
    /// The vehicle with more linear drag along its axes, N s/m: the declared number holds to its
    /// tolerance along each.
    #[must_use]
    pub fn with_more_drag(&self, linear_n_s_per_m: Vector3<T>) -> Self {
        let mut out = *self;
        out.parameters.drag.linear_n_s_per_m += linear_n_s_per_m;
        out
    }
    /// The checked numbers.
    #[inline(always)]
    pub fn parameters(&self) -> &Parameters<T> {
        &self.parameters
    }
    /// Inverse of the mass, 1/kg.
    #[inline(always)]
    pub fn inverse_mass(&self) -> T {
        self.inverse_mass
    }
    /// Inverse of the inertia, 1/(kg m^2).
    #[inline(always)]
    pub fn inertia_inverse(&self) -> &Matrix3<T> {
        &self.inertia_inverse
    }
    /// Power of the rotors over that in hover, as their torque has it: the mean cube of their
    /// speeds, 1 in hover.
    pub fn rotor_load(&self, speed_rad_s: &PerRotor<T>) -> T {
        let (mut thrust, mut cubes) = (T::zero(), T::zero());
        for (per_square, speed) in
            self.per_speed_squared.thrust.iter().zip(speed_rad_s).take(self.parameters.rotor_count)
        {
            thrust += *per_square;
            cubes += *speed * *speed * *speed;
        }
        let square = real::<T>(GRAVITY_M_S2) / (self.inverse_mass * thrust);
        cubes / (real::<T>(self.parameters.rotor_count as f64) * square * square.sqrt())
    }
    /// The rotors in command order.
    pub fn rotors(&self) -> &[Rotor<T>] {
        self.parameters.rotors.get(..self.parameters.rotor_count).unwrap_or(&[])
    }
    /// Number of blocks of [`ROTOR_BLOCK`] that hold all rotors.
    #[inline(always)]
    pub fn rotor_blocks(&self) -> usize {
        self.parameters.rotor_count.div_ceil(ROTOR_BLOCK)
    }
    /// Weight, N.
    pub fn weight_n(&self) -> T {
        self.parameters.mass_kg * real(crate::math::GRAVITY_M_S2)
    }
    /// Area of the flat plate that has the force of both wings, m^2; 0 for none.
    pub fn plate_area_m2(&self) -> T {
        // Two sides; the flat plate's own slope is 2.
        let area = |w: &Wing<T>| w.area_per_side_m2 * w.normal_force_slope;
        self.parameters.wing.as_ref().map_or(T::zero(), area)
    }
    /// Most thrust that one rotor may be asked for, N: its top thrust at the reference voltage, or
    /// its limit if lower.
    pub fn rotor_thrust_max_n(&self) -> T {
        self.rotor_thrust_at_n(T::one())
    }
    /// [`Self::rotor_thrust_max_n`] where the battery leaves a share of the top thrust.
    pub fn rotor_thrust_at_n(&self, share: T) -> T {
        let top = self.rotor_thrust_top_n() * share;
        self.parameters
            .limits
            .rotor_thrust_max_n
            .map_or(top, |limit| crate::math::lower(limit, top))
    }
    /// Top thrust of one rotor at the reference voltage, N.
    pub(crate) fn rotor_thrust_top_n(&self) -> T {
        let p = &self.parameters.propulsion;
        match p.thrust_curve {
            Some(curve) => curve.thrust_n(p.reference_voltage_v),
            None => p.thrust_coefficient_n_s2 * p.speed_max_rad_s * p.speed_max_rad_s,
        }
    }
    /// The same vehicle in another scalar, checked again: what is sound in `f64` may degenerate in
    /// `f32`.
    ///
    /// # Errors
    /// As [`Vehicle::new`].
    pub fn cast<U: Real>(&self) -> Result<Vehicle<U>, ParameterError> {
        fn to<T: Real, U: Real>(x: T) -> U {
            real(nalgebra::try_convert(x).unwrap_or(f64::NAN))
        }
        let p = &self.parameters;
        let propulsion = Propulsion {
            command: p.propulsion.command,
            speed_max_rad_s: to(p.propulsion.speed_max_rad_s),
            thrust_coefficient_n_s2: to(p.propulsion.thrust_coefficient_n_s2),
            torque_coefficient_n_m_s2: to(p.propulsion.torque_coefficient_n_m_s2),
            time_constant_up_s: to(p.propulsion.time_constant_up_s),
            time_constant_down_s: to(p.propulsion.time_constant_down_s),
            propeller_radius_m: to(p.propulsion.propeller_radius_m),
            air: p.propulsion.air.map(to),
            reference_voltage_v: to(p.propulsion.reference_voltage_v),
            thrust_curve: match p.propulsion.thrust_curve {
                Some(curve) => Some(ThrustCurve::new(
                    curve.coefficients().map(to),
                    to(p.propulsion.reference_voltage_v),
                )?),
                None => None,
            },
        };
        Vehicle::new(Parameters {
            mass_kg: to(p.mass_kg),
            inertia_kg_m2: p.inertia_kg_m2.map(to),
            rotors: p.rotors.map(|r| Rotor {
                position: In::new(r.position.vector.map(to)),
                yaw_sign: to(r.yaw_sign),
            }),
            rotor_count: p.rotor_count,
            propulsion,
            drag: Drag {
                linear_n_s_per_m: p.drag.linear_n_s_per_m.map(to),
                area_m2: to(p.drag.area_m2),
            },
            wing: p.wing.map(|w| Wing {
                area_per_side_m2: to(w.area_per_side_m2),
                normal_force_slope: to(w.normal_force_slope),
                lateral_arm_m: to(w.lateral_arm_m),
                longitudinal_arm_m: to(w.longitudinal_arm_m),
                vertical_arm_m: to(w.vertical_arm_m),
                chord_m: to(w.chord_m),
                time_constant_s: to(w.time_constant_s),
            }),
            limits: Limits {
                tilt_max_rad: to(p.limits.tilt_max_rad),
                thrust_max_n: to(p.limits.thrust_max_n),
                rotor_thrust_max_n: p.limits.rotor_thrust_max_n.map(to),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::fixtures::squirrel;
    use super::*;

    #[test]
    fn a_rotor_that_is_off_is_one_that_was_declared_there() {
        let moved = Vector3::new(0.01, -0.02, 0.0);
        let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
        let off = vehicle.with_rotor_off(1, In::new(moved), 1.1);
        let mut p = squirrel();
        p.rotors[1].position = p.rotors[1].position + In::new(moved);
        let declared = Vehicle::new(p).unwrap();
        let (a, b) =
            (off.rotor_wrench_per_speed_squared(), declared.rotor_wrench_per_speed_squared());
        for i in 0..4 {
            assert!(
                (a.roll[i] - b.roll[i]).abs() < 1e-20 && (a.pitch[i] - b.pitch[i]).abs() < 1e-20
            );
            let factor = if i == 1 { 1.1 } else { 1.0 };
            assert!((a.yaw[i] - factor * b.yaw[i]).abs() < 1e-20);
        }
        assert_eq!(off.rotors(), declared.rotors());
        // There is no rotor 5 to be off.
        assert_eq!(vehicle.with_rotor_off(5, In::new(moved), 1.1), vehicle);
        let dragged = vehicle.with_more_drag(Vector3::new(0.0, 0.1, 0.2));
        assert_eq!(dragged.parameters().drag.linear_n_s_per_m, Vector3::new(0.0, 0.1, 0.2));
    }

    #[test]
    fn casting_keeps_the_airframe() {
        let vehicle = Vehicle::new(fixtures::squirrel::<f64>()).unwrap();
        let single: Vehicle<f32> = vehicle.cast().unwrap();
        assert_eq!(single.parameters().mass_kg, 0.548_f32);
        assert_eq!(single, Vehicle::new(fixtures::squirrel::<f32>()).unwrap());
    }
}
