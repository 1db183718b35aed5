//! An airframe for tests and benches: the squirrel's numbers on any planar layout of rotors.

use squirrel_core::nalgebra::{Matrix3, Vector3};
use squirrel_core::vehicle::{
    CommandKind, Drag, Limits, MAX_ROTORS, Parameters, Propulsion, Rotor, RotorAir, Vehicle, Wing,
};

/// Rotor hubs of the paper's X, m: front left, back left, back right, front right.
pub(crate) const PAPER_X: [[f64; 2]; 4] =
    [[0.085, -0.085], [-0.085, -0.085], [-0.085, 0.085], [0.085, 0.085]];
/// Signs of their reaction torque about down.
pub(crate) const PAPER_SIGNS: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];

/// The squirrel with its rotors at these places.
pub(crate) fn vehicle(positions: &[[f64; 2]], signs: &[f64]) -> Vehicle<f32> {
    let mut rotors = [Rotor::unused(); MAX_ROTORS];
    for (i, ([x, y], sign)) in positions.iter().zip(signs).enumerate() {
        rotors[i] = Rotor::planar(*x, *y, *sign);
    }
    Vehicle::new(Parameters {
        mass_kg: 0.548,
        inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(3.22e-3, 4.68e-3, 7.72e-3)),
        rotors,
        rotor_count: positions.len(),
        propulsion: Propulsion {
            command: CommandKind::SpeedFraction,
            speed_max_rad_s: 3000.0,
            thrust_coefficient_n_s2: 6.0e-7,
            torque_coefficient_n_m_s2: 6.6e-9,
            time_constant_up_s: 0.03,
            time_constant_down_s: 0.03,
            propeller_radius_m: 0.0508,
            air: RotorAir::still(),
            reference_voltage_v: 14.8,
            thrust_curve: None,
        },
        drag: Drag { linear_n_s_per_m: Vector3::zeros(), area_m2: 0.01 },
        wing: Some(Wing {
            area_per_side_m2: 0.02,
            normal_force_slope: 2.0,
            lateral_arm_m: 0.09,
            longitudinal_arm_m: 0.0,
            vertical_arm_m: 0.0,
            chord_m: 0.2,
            time_constant_s: 0.03,
        }),
        limits: Limits { tilt_max_rad: 0.52, thrust_max_n: 20.0, rotor_thrust_max_n: None },
    })
    .expect("the squirrel's numbers are sound")
}
