//! The numbers of a membrane wing and their defaults.

use serde::Deserialize;
use squirrel_core::vehicle::ParameterError;

/// The numbers of a pair of membrane wings. Area and arm have no default; the others have those of
/// docs/equations.md D.1 to D.3.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MembraneParameters {
    /// Area of one side, m^2.
    pub area_per_side_m2: f64,
    /// Distance of each side's centre from the x axis, m.
    pub lateral_arm_m: f64,
    /// How far ahead of the centre of mass the centres are, m; 0.
    #[serde(default)]
    pub longitudinal_arm_m: f64,
    /// How far below the centre of mass they are, m; 0.
    #[serde(default)]
    pub vertical_arm_m: f64,
    /// Chord, m; 0.2 (D.3).
    #[serde(default = "chord_m")]
    pub chord_m: f64,
    /// Potential part K_p of the attached normal force, `C_N = K_p sin cos`; 1.48, Helmbold's at
    /// aspect ratio 1 (D.1).
    #[serde(default = "lift_slope")]
    pub lift_slope: f64,
    /// Vortex part K_v of the attached normal force, `C_N = K_v sin^2`; 2.9, fitted at aspect
    /// ratio 1 (D.1).
    #[serde(default = "vortex_slope")]
    pub vortex_slope: f64,
    /// Normal force coefficient C_D90 at 90 deg; 1.13, Viterna's at aspect ratio 1 (D.1).
    #[serde(default = "normal_drag")]
    pub normal_drag: f64,
    /// Angle of attack at which half of the flow is separated, rad; 40 deg, fitted at aspect
    /// ratio 1. Laboratories differ most here: 26 to 40 deg (docs/guide/wing.md).
    #[serde(default = "stall_angle_rad")]
    pub stall_angle_rad: f64,
    /// Width of the stall, rad; 6 deg (D.3).
    #[serde(default = "stall_width_rad")]
    pub stall_width_rad: f64,
    /// Tangential force coefficient C_T0 edge on; 0.015, a thin plate's.
    #[serde(default = "tangential_zero")]
    pub tangential_zero: f64,
    /// Tangential force per camber and normal force, k_T; 1 (D.3).
    #[serde(default = "tangential_camber")]
    pub tangential_camber: f64,
    /// Elastic modulus times thickness, N/m; 275, silicone of 0.5 MPa and 0.55 mm (D.2).
    #[serde(default = "tension_n_per_m")]
    pub tension_n_per_m: f64,
    /// Strain lambda_0 of the membrane without load; 0.02, assumed: D.2 leaves it open.
    #[serde(default = "prestrain")]
    pub prestrain: f64,
    /// Lag of the elastic camber, s; 0.05 (D.3).
    #[serde(default = "camber_time_constant_s")]
    pub camber_time_constant_s: f64,
    /// Camber by creep over elastic camber, steady; 0.3 (D.3).
    #[serde(default = "creep_fraction")]
    pub creep_fraction: f64,
    /// Lag of the creep, s; 0.5 (D.3).
    #[serde(default = "creep_time_constant_s")]
    pub creep_time_constant_s: f64,
    /// Factor g_s on force and moment; 1 (D.3).
    #[serde(default = "force_gain")]
    pub force_gain: f64,
    /// Travel of the pressure centre of a flat wing, 0 for none to 1 for a quarter chord at small
    /// angles; 1, as plates have it. Camber holds it back by itself.
    #[serde(default = "pressure_centre_shift")]
    pub pressure_centre_shift: f64,
}

/// Of the wing that the defaults describe. The squirrel's sides measure 0.1 m by a chord of 0.2 m.
/// Each alone has 0.5, both without a gap 1, and both with the body between them at most 1.4.
const ASPECT_RATIO: f64 = 1.0;

/// Rigid rectangular plates by aspect ratio, 1 to 3. Slope and broadside force are taken from
/// publications, the numbers of the vortex part and of the stall fitted to measured plates:
/// docs/guide/wing.md.
mod plate {
    /// Helmbold: `2 pi A / (2 + sqrt(4 + A^2))`.
    pub(super) fn lift_slope(ratio: f64) -> f64 {
        core::f64::consts::TAU * ratio / (2.0 + ratio.hypot(2.0))
    }
    /// Of vortices at the side edges alone.
    pub(super) fn vortex_slope(ratio: f64) -> f64 {
        2.9 / ratio
    }
    /// Viterna.
    pub(super) fn normal_drag(ratio: f64) -> f64 {
        1.11 + 0.018 * ratio
    }
    pub(super) fn stall_angle_rad(ratio: f64) -> f64 {
        (8.0 + 32.0 / ratio).to_radians()
    }
}

// serde takes a default as a function.
macro_rules! defaults {
    ($($field:ident = $value:expr;)*) => {
        $(fn $field() -> f64 { $value })*

        impl MembraneParameters {
            /// Wings of this size with the defaults for everything else.
            ///
            /// * `area_per_side_m2` - area of one side, m^2
            /// * `lateral_arm_m` - distance of each side's centre from the x axis, m
            pub fn new(area_per_side_m2: f64, lateral_arm_m: f64) -> Self {
                Self {
                    area_per_side_m2,
                    lateral_arm_m,
                    longitudinal_arm_m: 0.0,
                    vertical_arm_m: 0.0,
                    $($field: $field(),)*
                }
            }
        }
    };
}
defaults! {
    chord_m = 0.2;
    lift_slope = plate::lift_slope(ASPECT_RATIO);
    vortex_slope = plate::vortex_slope(ASPECT_RATIO);
    normal_drag = plate::normal_drag(ASPECT_RATIO);
    stall_angle_rad = plate::stall_angle_rad(ASPECT_RATIO);
    stall_width_rad = 6.0 * core::f64::consts::PI / 180.0;
    tangential_zero = 0.015;
    tangential_camber = 1.0;
    tension_n_per_m = 275.0;
    prestrain = 0.02;
    camber_time_constant_s = 0.05;
    creep_fraction = 0.3;
    creep_time_constant_s = 0.5;
    force_gain = 1.0;
    pressure_centre_shift = 1.0;
}

impl MembraneParameters {
    /// These, with the rigid constants of a rectangular wing of another aspect ratio; fitted from
    /// 1 to 3.
    #[must_use]
    pub fn with_aspect_ratio(self, ratio: f64) -> Self {
        Self {
            lift_slope: plate::lift_slope(ratio),
            vortex_slope: plate::vortex_slope(ratio),
            normal_drag: plate::normal_drag(ratio),
            stall_angle_rad: plate::stall_angle_rad(ratio),
            ..self
        }
    }

    /// The first field that cannot be used, if any.
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        let positive = [
            ("area_per_side_m2", self.area_per_side_m2),
            ("chord_m", self.chord_m),
            ("stall_angle_rad", self.stall_angle_rad),
            ("stall_width_rad", self.stall_width_rad),
            ("tension_n_per_m", self.tension_n_per_m),
            ("camber_time_constant_s", self.camber_time_constant_s),
            ("creep_time_constant_s", self.creep_time_constant_s),
        ];
        let not_negative = [
            ("lateral_arm_m", self.lateral_arm_m),
            ("lift_slope", self.lift_slope),
            ("vortex_slope", self.vortex_slope),
            ("normal_drag", self.normal_drag),
            ("tangential_zero", self.tangential_zero),
            ("tangential_camber", self.tangential_camber),
            ("prestrain", self.prestrain),
            ("creep_fraction", self.creep_fraction),
            ("force_gain", self.force_gain),
            ("pressure_centre_shift", self.pressure_centre_shift),
        ];
        let refuse =
            |field, value, reason| Err(ParameterError { field, index: None, value, reason });
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return refuse(field, value, "must be finite and > 0");
            }
        }
        for (field, value) in [
            ("longitudinal_arm_m", self.longitudinal_arm_m),
            ("vertical_arm_m", self.vertical_arm_m),
        ] {
            if !value.is_finite() {
                return refuse(field, value, "must be finite");
            }
        }
        for (field, value) in not_negative {
            if !(value.is_finite() && value >= 0.0) {
                return refuse(field, value, "must be finite and >= 0");
            }
        }
        if self.stall_angle_rad > core::f64::consts::FRAC_PI_2 {
            return refuse("stall_angle_rad", self.stall_angle_rad, "must be <= pi/2 rad (90 deg)");
        }
        if self.pressure_centre_shift > 1.0 {
            return refuse("pressure_centre_shift", self.pressure_centre_shift, "must be <= 1");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Membrane;
    use super::*;

    #[test]
    fn a_file_gives_size_and_what_differs() {
        let text = "area_per_side_m2 = 0.02\nlateral_arm_m = 0.09\ntension_n_per_m = 550.0";
        let read: MembraneParameters = toml::from_str(text).unwrap();
        assert_eq!(
            read,
            MembraneParameters { tension_n_per_m: 550.0, ..MembraneParameters::new(0.02, 0.09) }
        );
        assert!((read.stall_angle_rad.to_degrees() - 40.0).abs() < 1e-12);
    }

    #[test]
    fn misspelt_and_missing_keys_are_refused() {
        let error =
            |text: &str| toml::from_str::<MembraneParameters>(text).unwrap_err().to_string();
        let misspelt = error("area_per_side_m2 = 0.02\nlateral_arm_m = 0.09\nprestrian = 0.1");
        assert!(misspelt.contains("prestrian"), "{misspelt}");
        let missing = error("area_per_side_m2 = 0.02");
        assert!(missing.contains("lateral_arm_m"), "{missing}");
    }

    #[test]
    fn errors_name_field_and_value() {
        let error = |change: fn(&mut MembraneParameters)| {
            let mut p = MembraneParameters::new(0.02, 0.09);
            change(&mut p);
            Membrane::new(p).unwrap_err().to_string()
        };
        assert_eq!(error(|p| p.chord_m = 0.0), "chord_m = 0: must be finite and > 0");
        assert_eq!(error(|p| p.prestrain = -0.1), "prestrain = -0.1: must be finite and >= 0");
        assert!(error(|p| p.lift_slope = f64::NAN).starts_with("lift_slope = NaN"));
        assert!(error(|p| p.tension_n_per_m = f64::INFINITY).starts_with("tension_n_per_m = inf"));
        assert!(
            error(|p| p.stall_angle_rad = 34.0)
                .starts_with("stall_angle_rad = 34: must be <= pi/2")
        );
        assert!(
            error(|p| p.pressure_centre_shift = 1.5).starts_with("pressure_centre_shift = 1.5")
        );
    }
}
