//! Numbers of a multirotor from its size: what published machines have in common, and how far they
//! lie apart.
//!
//! Each rule is the geometric mean over published machines, its spread their standard deviation,
//! rounded up. The table with its sources is in the tests of this file, which hold the constants to
//! it.

/// A number with the fraction by which it may be off, one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rule {
    pub(super) value: f64,
    pub(super) sd_fraction: f64,
}

const fn rule(value: f64, sd_fraction: f64) -> Rule {
    Rule { value, sd_fraction }
}

/// Distance of neighbouring hubs over the diameter of a propeller.
pub(super) const SPACING: Rule = rule(1.32, 0.10);
/// Radius of gyration about body x and y over the arm.
pub(super) const GYRATION_XY: Rule = rule(0.47, 0.12);
/// The same about body z.
pub(super) const GYRATION_Z: Rule = rule(0.65, 0.10);
/// Most thrust of all rotors over the weight, of machines of which neither motors nor cells are
/// known.
pub(super) const THRUST_TO_WEIGHT: Rule = rule(2.8, 0.40);
/// Reaction torque of a propeller over its thrust and diameter, `C_P / (2 pi C_T)`.
pub(super) const TORQUE_PER_THRUST_DIAMETER: Rule = rule(0.12, 0.30);
/// First-order lag of rotor speed, s: 0.033 to 0.072 are published, with no trend over size.
pub(super) const MOTOR_LAG_S: Rule = rule(0.05, 0.35);
/// Linear drag over mass, 1/s.
pub(super) const DRAG_PER_MASS_PER_S: Rule = rule(0.40, 0.40);
/// Drag area of the airframe over the arm squared.
pub(super) const DRAG_AREA_PER_ARM_SQUARED: Rule = rule(0.3, 0.7);
/// Top speed under load over that of the motor without load at the nominal voltage.
pub(super) const LOADED_SPEED: Rule = rule(0.62, 0.15);
/// Nominal voltage of a lithium polymer cell, V, and how far it moves from full to empty.
pub(super) const CELL_V: Rule = rule(3.7, 0.08);
/// Battery's part of the mass, at 150 Wh/kg.
pub(super) const BATTERY_OF_MASS: Rule = rule(0.28, 0.35);

/// Thrust coefficient `C_T = T / (rho n^2 D^4)` of a propeller that stands in still air.
///
/// A line through what the UIUC propeller data site (Brandt, Deters, Ananda, Selig) has at rest for
/// small propellers of two blades: about 0.11 at a pitch of 0.47 diameters (APC 10x4.7 SF, 0.104 to
/// 0.127 from 2400 to 6500 rpm), 0.15 at 0.8. Three blades give more, worn ones less.
pub(super) fn thrust_coefficient(pitch_over_diameter: f64) -> Rule {
    rule(0.055 + 0.125 * pitch_over_diameter, 0.25)
}

/// Pitch over diameter of a propeller of which only the diameter is known.
pub(super) const PITCH_OVER_DIAMETER: f64 = 0.5;

/// Cells of a machine of a mass that does not say.
pub(super) fn usual_cells(mass_kg: f64) -> u32 {
    match mass_kg {
        m if m < 0.08 => 1,
        m if m < 0.2 => 2,
        m if m < 0.4 => 3,
        m if m < 2.5 => 4,
        m if m < 8.0 => 6,
        _ => 12,
    }
}

#[cfg(test)]
pub(crate) mod published {
    //! Machines that publications and manufacturers describe.

    /// One of them. What a source does not have is `None`.
    pub(crate) struct Machine {
        pub(crate) name: &'static str,
        pub(crate) source: &'static str,
        pub(crate) mass_kg: f64,
        pub(crate) arm_m: f64,
        pub(crate) diameter_m: f64,
        pub(crate) inertia_kg_m2: [f64; 3],
        pub(crate) thrust_to_weight: Option<f64>,
        /// Torque over thrust, m.
        pub(crate) torque_per_thrust_m: Option<f64>,
        pub(crate) lag_s: Option<f64>,
        /// N s/m, in the rotor plane.
        pub(crate) linear_drag_n_s_per_m: Option<f64>,
    }

    pub(crate) const MACHINES: [Machine; 7] = [
        Machine {
            name: "Crazyflie 2.1 brushed",
            source: "Bitcraze, Crazyflie 2.1 data sheet (mass, arm); Foerster 2015, System Identification of the Crazyflie 2.0 \
                     (inertia, 0.1597 N a rotor at full duty, torque, drag, radius 23.1 mm); lag: Eschmann et al. 2024, arXiv 2404.07837",
            mass_kg: 0.027,
            arm_m: 0.046,
            diameter_m: 0.0462,
            inertia_kg_m2: [1.657e-5, 1.666e-5, 2.926e-5],
            thrust_to_weight: Some(2.41),
            torque_per_thrust_m: Some(0.00596),
            lag_s: Some(0.072),
            linear_drag_n_s_per_m: Some(0.0068),
        },
        Machine {
            name: "Crazyflie 2.1 thrust upgrade",
            source: "crazyflow 0.4.0 (TU Munich, PyPI), cf2x_T350: identified; propeller 47 mm: Bitcraze",
            mass_kg: 0.0379,
            arm_m: 0.046,
            diameter_m: 0.047,
            inertia_kg_m2: [15.7e-6, 17.1e-6, 30.0e-6],
            thrust_to_weight: Some(1.94),
            torque_per_thrust_m: Some(0.0049),
            lag_s: None,
            linear_drag_n_s_per_m: Some(0.0152),
        },
        Machine {
            name: "Crazyflie 2.1 brushless",
            source: "crazyflow 0.4.0 (TU Munich, PyPI), cf21B_500: identified; propeller 55 mm: Bitcraze",
            mass_kg: 0.0434,
            arm_m: 0.05,
            diameter_m: 0.055,
            inertia_kg_m2: [25e-6, 28e-6, 49e-6],
            thrust_to_weight: Some(1.88),
            torque_per_thrust_m: Some(0.0059),
            lag_s: None,
            linear_drag_n_s_per_m: Some(0.0216),
        },
        Machine {
            name: "AscTec Hummingbird",
            source: "RotorPy 3.0.0, hummingbird_params (mass, arm, inertia, coefficients), after IEEE 7991501; 20 N: AscTec data sheet; \
                     8 inch propellers",
            mass_kg: 0.5,
            arm_m: 0.17,
            diameter_m: 0.2032,
            inertia_kg_m2: [3.65e-3, 3.68e-3, 7.03e-3],
            thrust_to_weight: Some(4.08),
            torque_per_thrust_m: Some(0.0244),
            lag_s: None,
            linear_drag_n_s_per_m: None,
        },
        Machine {
            name: "Agilicious (Kingfisher)",
            source: "Foehn et al. 2022, Science Robotics 7 (67), doi 10.1126/scirobotics.abl6259, and its kingfisher.yaml: rotors at \
                     0.075, 0.10 m, 8.5 N a rotor; 5.1 inch propellers; drag of the same group's quadrotor over mass: Faessler et al. \
                     2018, RA-L 3 (2), 0.54 and 0.39 1/s",
            mass_kg: 0.752,
            arm_m: 0.125,
            diameter_m: 0.1295,
            inertia_kg_m2: [2.5e-3, 2.1e-3, 4.3e-3],
            thrust_to_weight: Some(4.61),
            torque_per_thrust_m: Some(0.022),
            lag_s: Some(0.033),
            linear_drag_n_s_per_m: Some(0.345),
        },
        Machine {
            name: "Holybro X500",
            source: "Eschmann et al., rl-tools x500_real: 2.0 kg, 15.93 N a rotor, inertia, lag; 10 inch propellers; arXiv 2404.07837",
            mass_kg: 2.0,
            arm_m: 0.25,
            diameter_m: 0.254,
            inertia_kg_m2: [2.1705e-2, 2.1304e-2, 3.94e-2],
            thrust_to_weight: Some(3.25),
            torque_per_thrust_m: None,
            lag_s: Some(0.054),
            linear_drag_n_s_per_m: None,
        },
        Machine {
            name: "460 mm quadrotor",
            source: "Bannwarth et al., multirotor_model: inertia by a trifilar pendulum, 1.48 kg with 0.26 kg of motors and propellers \
                     beside it, 10 inch propellers",
            mass_kg: 1.48,
            arm_m: 0.228,
            diameter_m: 0.254,
            inertia_kg_m2: [0.0176, 0.0176, 0.0362],
            thrust_to_weight: None,
            torque_per_thrust_m: None,
            lag_s: None,
            linear_drag_n_s_per_m: None,
        },
    ];
}

#[cfg(test)]
mod tests {
    use super::published::{MACHINES, Machine};
    use super::*;

    /// Holds a rule to the geometric mean and the spread of what machines have.
    fn held(what: &str, rule: Rule, of: impl Fn(&Machine) -> Vec<f64>) {
        let logs: Vec<f64> = MACHINES.iter().flat_map(of).map(f64::ln).collect();
        let count = logs.len() as f64;
        let mean = logs.iter().sum::<f64>() / count;
        let spread = (logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
        let (value, sd) = (rule.value, rule.sd_fraction);
        println!("{what}: {:.3} +- {spread:.3} of {count}, rule {value} +- {sd}", mean.exp());
        // Each machine lies within two sd of what the others have.
        for left_out in &logs {
            let others = (mean * count - left_out) / (count - 1.0);
            assert!((left_out - others).abs() < 2.0 * sd, "{what}: {}", left_out.exp());
        }
        // Within half a spread of the mean, which has two digits.
        assert!((value.ln() - mean).abs() < 0.5 * spread, "{what}: {}", mean.exp());
        assert!((0.8 * spread..2.0 * spread + 0.06).contains(&sd), "{what}: {spread}");
    }

    #[test]
    fn rules_are_what_published_machines_have() {
        let gyration =
            |m: &Machine, axis: usize| (m.inertia_kg_m2[axis] / m.mass_kg).sqrt() / m.arm_m;
        held("gyration xy", GYRATION_XY, |m| vec![gyration(m, 0), gyration(m, 1)]);
        held("gyration z", GYRATION_Z, |m| vec![gyration(m, 2)]);
        held("spacing", SPACING, |m| vec![2.0_f64.sqrt() * m.arm_m / m.diameter_m]);
        held("thrust to weight", THRUST_TO_WEIGHT, |m| m.thrust_to_weight.into_iter().collect());
        held("torque", TORQUE_PER_THRUST_DIAMETER, |m| {
            m.torque_per_thrust_m.into_iter().map(|k| k / m.diameter_m).collect()
        });
        held("lag", MOTOR_LAG_S, |m| m.lag_s.into_iter().collect());
        held("drag", DRAG_PER_MASS_PER_S, |m| {
            m.linear_drag_n_s_per_m.into_iter().map(|d| d / m.mass_kg).collect()
        });
        assert!(MACHINES.iter().all(|m| !m.source.is_empty()));
    }

    #[test]
    fn thrust_coefficients_are_those_of_small_propellers() {
        // UIUC, APC 10x4.7 SF at rest, 2377 to 6528 rpm: 0.1039 to 0.1274.
        let apc = thrust_coefficient(0.47);
        assert!((0.1039..0.1274).contains(&apc.value), "{apc:?}");
        // Foerster 2015: 0.1597 N at 3052 rad/s and 46.2 mm, pitch not stated.
        let of = |n: f64, rad_s: f64, m: f64| {
            n / (1.225 * (rad_s / std::f64::consts::TAU).powi(2) * m.powi(4))
        };
        // RotorPy: Hummingbird, 8x4.5 inch; Agilicious: three blades of 5.1 inch.
        for (measured, pitch) in [
            (of(0.1597, 3052.0, 0.0462), PITCH_OVER_DIAMETER),
            (of(5.57e-6, 1.0, 0.2032), 4.5 / 8.0),
            (of(1.562e-6, 1.0, 0.1295), 0.9),
        ] {
            let rule = thrust_coefficient(pitch);
            assert!((measured / rule.value).ln().abs() < 2.0 * rule.sd_fraction, "{measured}");
        }
    }
}
