//! Duals against central differences.

use super::*;
use crate::vehicle_file::{SQUIRREL_TOML, VehicleFile};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use squirrel_core::dynamics::State;
use squirrel_core::nalgebra::{UnitQuaternion, Vector3};

/// Step of the differences, in the unit of each variable.
const STEP: f64 = 2e-5;
const EFFECTS: &str = "[effects.linear_drag]\nextra_drag_n_s_per_m = 0.1\n[effects.cg_offset]\ncg_x_m = 0.005\ncg_y_m = -0.004\n\
    [effects.battery_sag]\nvoltage_exponent = 0.8\n[effects.payload_swing]\nmass_kg = 0.05\nlength_m = 0.6\n\
    [effects.wing_membrane]\ngain = 0.2\nangle_of_attack_offset_rad = 0.05\n[effects.rotor_gyro_torque]\n\
    rotor_inertia_kg_m2 = 1e-5\n[effects.added_mass]\nmass_kg = 0.05\n[effects.constant_wind]\n\
    wind_north_m_s = 2.0\nwind_east_m_s = -1.0\n[effects.translational_lift]\ngain_s2_per_m2 = 1e-3\n[effects.ground_effect]\n\
    effective_radius_m = 0.3\n[effects.angular_damping]\ndamping_n_m_s_per_rad = 5e-3\n";

fn plant(model: &str, effects: &str) -> Plant {
    let text = SQUIRREL_TOML.replace("model = \"membrane\"", &format!("model = \"{model}\""));
    let file = VehicleFile::parse(&format!("{text}\n{effects}"), "test").unwrap();
    Plant::new(file.vehicle, file.effects, file.wing, file.battery, 1e-3).unwrap()
}

/// A body that is moved in one variable.
fn moved(body: &State<f64>, variable: usize, by: f64) -> State<f64> {
    let mut moved = *body;
    let mut step = Vector3::zeros();
    step[variable % 3] = by;
    match variable / 3 {
        0 => moved.position.vector += step,
        1 => moved.attitude = body.attitude * *UnitQuaternion::from_scaled_axis(step),
        2 => moved.velocity.vector += step,
        _ => moved.omega.vector += step,
    }
    moved
}

/// What is between two bodies, over `2 STEP`.
fn difference(high: &State<f64>, low: &State<f64>) -> [f64; VARIABLES] {
    let turned = (UnitQuaternion::new_normalize(low.attitude).inverse()
        * UnitQuaternion::new_normalize(high.attitude))
    .scaled_axis();
    let parts = [
        high.position.vector - low.position.vector,
        turned,
        high.velocity.vector - low.velocity.vector,
        high.omega.vector - low.omega.vector,
    ];
    core::array::from_fn(|i| parts[i / 3][i % 3] / (2.0 * STEP))
}

/// A thousand flights, half with each wing, half with effects: after a few steps with wings that
/// open, duals are what differences say, to a millionth of each row.
#[test]
fn duals_are_central_differences() {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let mut draw = |size: f64| rng.random_range(-size..size);
    for case in 0..1000 {
        let plant = plant(["flat", "membrane"][case % 2], if case % 4 < 2 { "" } else { EFFECTS });
        let mut body = State::at_rest();
        body.position.vector = Vector3::new(draw(5.0), draw(5.0), -2.0 + draw(1.0));
        // Away from edge-on air and from hover, where speeds and angles have kinks.
        body.velocity.vector = Vector3::new(5.0 + draw(2.0), draw(2.0), 2.0 + draw(1.0));
        body.attitude = *UnitQuaternion::from_euler_angles(draw(0.3), 0.2 + draw(0.2), draw(3.0));
        body.omega.vector = Vector3::new(draw(1.0), draw(1.0), draw(1.0));
        body.rotor_speed_rad_s[..4].fill_with(|| 1500.0 + draw(300.0));
        let mut state = plant.initial_state(body, 0.9);
        let mut command = [0.0; MAX_ROTORS];
        command[..4].fill_with(|| 0.55 + draw(0.1));
        let wind = In::new(Vector3::new(draw(1.0), draw(1.0), draw(0.3)));
        for _ in 0..50 {
            plant.step(&mut state, &command, [1.0, 0.9], wind);
        }
        let jacobian = plant.jacobian(&state, &command, [1.0, 0.9], wind).unwrap();
        let after = |variable: usize, by: f64| {
            let mut state = state;
            state.body = moved(&state.body, variable, by);
            plant.step(&mut state, &command, [1.0, 0.9], wind);
            state.body
        };
        for column in 0..VARIABLES {
            let numbers = difference(&after(column, STEP), &after(column, -STEP));
            for (row, number) in numbers.into_iter().enumerate() {
                let scale = jacobian.row(row).amax();
                let off = (jacobian[(row, column)] - number).abs() / scale;
                assert!(
                    off < 1e-6,
                    "{case}: {row}, {column}: {} for {number}",
                    jacobian[(row, column)]
                );
            }
        }
    }
}

#[test]
fn a_network_has_no_derivative_here() {
    let file = VehicleFile::squirrel();
    let none = Plant::new(file.vehicle, file.effects, WingPlant::None, None, 1e-3).unwrap();
    let state = none.initial_state(State::at_rest(), 1.0);
    let jacobian = none.jacobian(&state, &[0.5; MAX_ROTORS], [0.0; 2], In::zero()).unwrap();
    // In a step of a millisecond a velocity moves the vehicle by as many millimetres.
    assert!((jacobian[(0, 6)] - 1e-3).abs() < 1e-6 && (jacobian[(0, 0)] - 1.0).abs() < 1e-12);
}
