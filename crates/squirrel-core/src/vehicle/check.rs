//! The checks of [`super::Parameters`]: finite, in range, physically possible.

use super::{MAX_ROTORS, Parameters};
use crate::math::Real;
use nalgebra::{Matrix3, SymmetricEigen};

/// A number of a vehicle or controller that cannot be used. Displays as `field = value: reason`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterError {
    /// Field as the vehicle file spells it: `mass.mass_kg`.
    pub field: &'static str,
    /// Index, where the field is a list.
    pub index: Option<usize>,
    /// The offending value.
    pub value: f64,
    /// What must hold.
    pub reason: &'static str,
}

impl core::fmt::Display for ParameterError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.index {
            // A list of tables reads as `rotor[2].position_body_m`.
            Some(i) => match self.field.split_once("[]") {
                Some((head, tail)) => write!(f, "{head}[{i}]{tail}")?,
                None => write!(f, "{}[{i}]", self.field)?,
            },
            None => write!(f, "{}", self.field)?,
        }
        write!(f, " = {}: {}", self.value, self.reason)
    }
}
impl core::error::Error for ParameterError {}

fn plain<T: Real>(x: T) -> f64 {
    nalgebra::try_convert(x).unwrap_or(f64::NAN)
}

impl ParameterError {
    pub(crate) fn of<T: Real>(field: &'static str, value: T, reason: &'static str) -> Self {
        Self { field, index: None, value: plain(value), reason }
    }
    pub(crate) fn at<T: Real>(
        field: &'static str,
        index: usize,
        value: T,
        reason: &'static str,
    ) -> Self {
        Self { field, index: Some(index), value: plain(value), reason }
    }
    pub(crate) fn inertia(reason: &'static str) -> Self {
        Self { field: "mass.inertia_kg_m2", index: None, value: 0.0, reason }
    }
}

/// `value` must be finite and > 0.
pub(crate) fn positive<T: Real>(field: &'static str, value: T) -> Result<(), ParameterError> {
    if value.is_finite() && value > T::zero() {
        return Ok(());
    }
    Err(ParameterError::of(field, value, "must be finite and > 0"))
}

/// `value` must be finite and >= 0.
pub(crate) fn not_negative<T: Real>(field: &'static str, value: T) -> Result<(), ParameterError> {
    if value.is_finite() && value >= T::zero() {
        return Ok(());
    }
    Err(ParameterError::of(field, value, "must be finite and >= 0"))
}

/// `value` must be finite and of a size up to `most`.
pub(super) fn at_most<T: Real>(
    field: &'static str,
    value: T,
    most: f64,
    reason: &'static str,
) -> Result<(), ParameterError> {
    if plain(value).abs() <= most { Ok(()) } else { Err(ParameterError::of(field, value, reason)) }
}

/// Every number of a list must be finite and > 0.
pub(crate) fn each_positive<T: Real>(
    field: &'static str,
    list: &[T],
) -> Result<(), ParameterError> {
    each(field, list, positive)
}

/// Every number of a list must be finite and >= 0.
pub(crate) fn each_not_negative<T: Real>(
    field: &'static str,
    list: &[T],
) -> Result<(), ParameterError> {
    each(field, list, not_negative)
}

fn each<T: Real>(
    field: &'static str,
    list: &[T],
    check: fn(&'static str, T) -> Result<(), ParameterError>,
) -> Result<(), ParameterError> {
    for (i, x) in list.iter().enumerate() {
        check(field, *x).map_err(|error| ParameterError { index: Some(i), ..error })?;
    }
    Ok(())
}

pub(super) fn check<T: Real>(p: &Parameters<T>) -> Result<(), ParameterError> {
    positive("mass.mass_kg", p.mass_kg)?;
    inertia(&p.inertia_kg_m2)?;
    rotors(p)?;
    let propulsion = &p.propulsion;
    positive("propulsion.speed_max_rad_s", propulsion.speed_max_rad_s)?;
    positive("propulsion.thrust_coefficient_n_s2", propulsion.thrust_coefficient_n_s2)?;
    not_negative("propulsion.torque_coefficient_n_m_s2", propulsion.torque_coefficient_n_m_s2)?;
    not_negative("propulsion.time_constant_up_s", propulsion.time_constant_up_s)?;
    not_negative("propulsion.time_constant_down_s", propulsion.time_constant_down_s)?;
    positive("propulsion.propeller_diameter_m", propulsion.propeller_radius_m)?;
    propulsion.air.check()?;
    positive("propulsion.reference_voltage_v", propulsion.reference_voltage_v)?;
    each_not_negative("drag.linear_n_s_per_m", p.drag.linear_n_s_per_m.as_slice())?;
    not_negative("drag.area_m2", p.drag.area_m2)?;
    if let Some(wing) = &p.wing {
        positive("wing.area_per_side_m2", wing.area_per_side_m2)?;
        positive("wing.normal_force_slope", wing.normal_force_slope)?;
        not_negative("wing.lateral_arm_m", wing.lateral_arm_m)?;
        for (field, place) in [
            ("wing.longitudinal_arm_m", wing.longitudinal_arm_m),
            ("wing.vertical_arm_m", wing.vertical_arm_m),
        ] {
            at_most(field, place, 100.0, "must be finite and within 100 m")?;
        }
        positive("wing.chord_m", wing.chord_m)?;
        positive("wing.time_constant_s", wing.time_constant_s)?;
    }
    positive("limits.tilt_max_rad", p.limits.tilt_max_rad)?;
    if plain(p.limits.tilt_max_rad) > 1.4 {
        return Err(ParameterError::of(
            "limits.tilt_max_rad",
            p.limits.tilt_max_rad,
            "must be <= 1.4 rad (80 deg)",
        ));
    }
    positive("limits.thrust_max_n", p.limits.thrust_max_n)?;
    p.limits.rotor_thrust_max_n.map_or(Ok(()), |limit| positive("limits.rotor_thrust_max_n", limit))
}

fn rotors<T: Real>(p: &Parameters<T>) -> Result<(), ParameterError> {
    if p.rotor_count == 0 || p.rotor_count > MAX_ROTORS {
        return Err(ParameterError {
            field: "rotor (number of tables)",
            index: None,
            value: p.rotor_count as f64,
            reason: "must be 1 to 8",
        });
    }
    for (i, rotor) in p.rotors[..p.rotor_count].iter().enumerate() {
        for x in rotor.position.vector.iter() {
            if !x.is_finite() || plain(*x).abs() > 100.0 {
                return Err(ParameterError::at(
                    "rotor[].position_body_m",
                    i,
                    *x,
                    "must be finite and within 100 m",
                ));
            }
        }
        if rotor.yaw_sign != T::one() && rotor.yaw_sign != -T::one() {
            return Err(ParameterError::at(
                "rotor[].yaw_sign",
                i,
                rotor.yaw_sign,
                "must be 1 or -1",
            ));
        }
    }
    Ok(())
}

/// Symmetric, positive definite, and each principal moment at most the sum of the other two: no
/// mass distribution has other inertia.
fn inertia<T: Real>(j: &Matrix3<T>) -> Result<(), ParameterError> {
    let field = "mass.inertia_kg_m2";
    for (i, x) in j.iter().enumerate() {
        if !x.is_finite() {
            return Err(ParameterError::at(field, i, *x, "must be finite"));
        }
    }
    let skew = (j - j.transpose()).amax();
    if plain(skew) > 1e-6 * plain(j.amax()) {
        return Err(ParameterError::of(
            field,
            skew,
            "must be symmetric; largest difference across the diagonal",
        ));
    }
    let moments = SymmetricEigen::new(*j).eigenvalues;
    let mut m = [plain(moments[0]), plain(moments[1]), plain(moments[2])];
    m.sort_unstable_by(f64::total_cmp);
    if m[0] <= 0.0 {
        return Err(ParameterError {
            field,
            index: None,
            value: m[0],
            reason: "must be positive definite; smallest principal moment",
        });
    }
    // A flat plate meets the bound exactly; the slack is for rounding in f32.
    if m[2] > (m[0] + m[1]) * (1.0 + 1e-5) {
        return Err(ParameterError {
            field,
            index: None,
            value: m[2],
            reason: "largest principal moment exceeds the sum of the other two; no body has such inertia",
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{Vehicle, fixtures::squirrel};
    use super::*;
    use nalgebra::Vector3;

    fn error_of(change: impl Fn(&mut Parameters<f64>)) -> String {
        let mut p = squirrel();
        change(&mut p);
        Vehicle::new(p).unwrap_err().to_string()
    }

    #[test]
    fn the_squirrel_is_possible() {
        Vehicle::new(squirrel::<f64>()).unwrap();
        Vehicle::new(squirrel::<f32>()).unwrap();
    }

    #[test]
    fn errors_name_field_and_value() {
        assert_eq!(error_of(|p| p.mass_kg = -1.0), "mass.mass_kg = -1: must be finite and > 0");
        assert!(error_of(|p| p.mass_kg = f64::NAN).starts_with("mass.mass_kg = NaN"));
        assert!(error_of(|p| p.rotors[2].yaw_sign = 0.5).starts_with("rotor[2].yaw_sign = 0.5"));
        assert!(
            error_of(|p| p.rotors[1].position.vector.y = f64::INFINITY)
                .starts_with("rotor[1].position_body_m = inf")
        );
        assert!(
            error_of(|p| p.drag.linear_n_s_per_m.y = -0.1)
                .starts_with("drag.linear_n_s_per_m[1] = -0.1")
        );
        assert!(error_of(|p| p.limits.tilt_max_rad = 30.0).starts_with("limits.tilt_max_rad = 30"));
        assert!(error_of(|p| p.rotor_count = 9).contains("= 9"));
    }

    #[test]
    fn inertia_that_no_body_has_is_refused() {
        // The third is the Crazyflie inertia of a published simulator, off by less than a percent.
        for moments in [[1.0, 1.0, 2.1], [1.0, -1.0, 1.0], [1.43e-5, 1.43e-5, 2.89e-5]] {
            let text =
                error_of(|p| p.inertia_kg_m2 = Matrix3::from_diagonal(&Vector3::from(moments)));
            assert!(text.starts_with("mass.inertia_kg_m2"), "{text}");
        }
        let skew = error_of(|p| p.inertia_kg_m2[(0, 1)] = 1e-3);
        assert!(skew.contains("symmetric"), "{skew}");
    }
}
