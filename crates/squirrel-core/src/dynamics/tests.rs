use super::*;
use crate::vehicle::MAX_ROTORS;
use crate::vehicle::fixtures::squirrel;

fn acting(effects: &Effects<f64>) -> Acting<f64> {
    Acting::new(effects, &Vehicle::new(squirrel::<f64>()).unwrap())
}

fn no_surfaces(_: &Air<f64>) -> Wrench<Body, f64> {
    Wrench::zero()
}

/// A step of a vehicle without wings and effects in still air.
fn stepped(
    vehicle: &Vehicle<f64>,
    state: State<f64>,
    drive: RotorDrive<f64>,
    dt_s: f64,
) -> State<f64> {
    let none = acting(&Effects::none());
    let held = Held::in_still_air(drive);
    rk4(state, dt_s, |s| derivative(vehicle, &none, s, &held, no_surfaces))
}

#[test]
fn hover_trim_stands_still() {
    let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
    let share = vehicle.weight_n() / 4.0;
    let command = vehicle.parameters().propulsion.command_for_thrust(share);
    let drive = RotorDrive::new(&vehicle, &acting(&Effects::none()), &[command; 8], 14.8);
    let mut state = State::at_rest();
    state.rotor_speed_rad_s = drive.target_rad_s;
    for _ in 0..1000 {
        state = stepped(&vehicle, state, drive, 1e-3);
    }
    assert!(state.position.vector.norm() < 1e-9 && state.omega.vector.norm() < 1e-9);
}

#[test]
fn torque_free_tumbling_keeps_energy_and_angular_momentum() {
    let mut p = squirrel::<f64>();
    p.inertia_kg_m2 = Matrix3::from_diagonal(&Vector3::new(0.01, 0.02, 0.028));
    p.drag.area_m2 = 0.0;
    let vehicle = Vehicle::new(p).unwrap();
    let drive = RotorDrive::new(&vehicle, &acting(&Effects::none()), &[0.0; 8], 14.8);
    let mut state = State { omega: In::new(Vector3::new(3.0, 0.05, 8.0)), ..State::at_rest() };
    let invariants = |s: &State<f64>| {
        let momentum = p.inertia_kg_m2 * s.omega.vector;
        let momentum_ned = (s.ned_from_body() * In::new(momentum)).vector;
        (0.5 * s.omega.vector.dot(&momentum), momentum_ned)
    };
    let (energy, momentum_ned) = invariants(&state);
    for _ in 0..10_000 {
        state = stepped(&vehicle, state, drive, 1e-3).normalised();
    }
    let (energy_end, momentum_end) = invariants(&state);
    assert!(
        (energy_end / energy - 1.0).abs() < 1e-9,
        "energy drifted by {}",
        energy_end / energy - 1.0
    );
    assert!((momentum_end - momentum_ned).norm() / momentum_ned.norm() < 1e-9);
}

#[test]
fn rk4_is_of_fourth_order() {
    let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
    let drive = RotorDrive::new(
        &vehicle,
        &acting(&Effects::none()),
        &[0.7, 0.6, 0.72, 0.66, 0.0, 0.0, 0.0, 0.0],
        14.8,
    );
    let fly = |steps: usize| {
        let mut state =
            State { velocity: In::new(Vector3::new(3.0, -1.0, 0.5)), ..State::at_rest() };
        for _ in 0..steps {
            state = stepped(&vehicle, state, drive, 0.4 / steps as f64);
        }
        state.position.vector
    };
    let reference = fly(6400);
    let ratio = (fly(50) - reference).norm() / (fly(100) - reference).norm();
    assert!((12.0..20.0).contains(&ratio), "halving the step divides the error by {ratio}");
}

#[test]
fn an_accelerometer_at_rest_reads_minus_g_along_down() {
    let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
    let mut state = State::at_rest();
    let speed = (vehicle.weight_n() / 4.0 / 6.0e-7).sqrt();
    state.rotor_speed_rad_s = [speed, speed, speed, speed, 0.0, 0.0, 0.0, 0.0];
    let held = Held::in_still_air(RotorDrive::holding(state.rotor_speed_rad_s));
    let w = wrench(&vehicle, &acting(&Effects::none()), &state, &held, no_surfaces);
    let read = specific_force(&vehicle, &Effects::none(), state.omega, &w);
    assert!((read.vector - Vector3::new(0.0, 0.0, -GRAVITY_M_S2)).norm() < 1e-9);
}

/// The centre of mass is 10 mm ahead of the accelerometer: yawing pulls it inwards, pitching up
/// pushes it down.
#[test]
fn an_accelerometer_off_the_centre_of_mass_feels_the_rotation() {
    let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
    let mut effects = Effects::none();
    effects.insert("cg_offset").unwrap().values[0] = 0.01;
    let moment = In::new(Vector3::new(0.0, 4.68e-3 * 5.0, 0.0));
    let wrench = Wrench { force: In::zero(), moment };
    let read =
        specific_force(&vehicle, &effects, In::new(Vector3::new(0.0, 0.0, 3.0)), &wrench).vector;
    assert!((read - Vector3::new(0.09, 0.0, 0.05)).norm() < 1e-12, "{read}");
}

fn affected_by(
    name: &str,
    values: &[f64],
    state: &State<f64>,
    held: &Held<f64>,
) -> Wrench<Body, f64> {
    let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
    let mut effects = Effects::none();
    effects.insert(name).unwrap().values[..values.len()].copy_from_slice(values);
    wrench(&vehicle, &Acting::new(&effects, &vehicle), state, held, no_surfaces)
}

/// Dropped, all of `m + m_a` accelerates, but only `m` has weight: `w' = m g / (m + m_a)`, so
/// `F_z = -m_a w'`.
#[test]
fn added_mass_is_carried_along_but_not_attracted() {
    let mut state = State::at_rest();
    let held = Held::in_still_air(RotorDrive::holding([0.0; MAX_ROTORS]));
    let fall = 0.548 * GRAVITY_M_S2 / (0.548 + 0.1);
    let force = affected_by("added_mass", &[0.1], &state, &held).force.vector.z;
    assert!((force + 0.1 * fall).abs() < 1e-12, "{force}");
    // Rolling at 2 rad/s while slipping to the right at 3 m/s: the velocity along z grows by g
    // - w_x v.
    (state.omega.vector.x, state.velocity.vector.y) = (2.0, 3.0);
    let drag = wrench(
        &Vehicle::new(squirrel::<f64>()).unwrap(),
        &acting(&Effects::none()),
        &state,
        &held,
        no_surfaces,
    );
    let turned = affected_by("added_mass", &[0.1], &state, &held).force - drag.force;
    let rate = (GRAVITY_M_S2 - 6.0) / (1.0 + 0.1 / 0.548);
    assert!((turned.vector.z + 0.1 * rate).abs() < 1e-12, "{turned:?}");
    // In hover nothing accelerates.
    state = State::at_rest();
    state.rotor_speed_rad_s[..4].fill((0.548 * GRAVITY_M_S2 / 4.0 / 6.0e-7_f64).sqrt());
    let hover = affected_by("added_mass", &[0.1], &state, &held).force.vector.z;
    assert!((hover + 0.548 * GRAVITY_M_S2).abs() < 1e-9);
}

/// Rotor 1 turns clockwise seen from above, positive about +z, so speeding it up turns the
/// airframe to the left.
#[test]
fn rotors_that_speed_up_push_the_airframe_back() {
    let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
    let drive = RotorDrive::new(
        &vehicle,
        &acting(&Effects::none()),
        &[0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        14.8,
    );
    let mut state = State { omega: In::new(Vector3::new(0.5, -0.2, 0.0)), ..State::at_rest() };
    state.rotor_speed_rad_s[0] = 900.0;
    let base = wrench(
        &vehicle,
        &acting(&Effects::none()),
        &state,
        &Held::in_still_air(drive),
        no_surfaces,
    );
    let more = affected_by("rotor_gyro_torque", &[1e-5], &state, &Held::in_still_air(drive)).moment
        - base.moment;
    let by_hand = Vector3::new(0.2 * 900.0, 0.5 * 900.0, -600.0 / 0.03) * 1e-5;
    assert!((more.vector - by_hand).norm() < 1e-12, "{more:?}");
}

/// In air that turns as the airframe does nothing damps it, but its rotors are gyroscopes and
/// its axes turn as ever.
#[test]
fn air_that_turns_along_is_felt_by_surfaces_alone() {
    let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
    let mut state = State { omega: In::new(Vector3::new(0.5, -0.2, 0.3)), ..State::at_rest() };
    state.attitude =
        *nalgebra::UnitQuaternion::from_euler_angles(0.3, -0.2, core::f64::consts::FRAC_PI_2);
    state.velocity = In::new(Vector3::new(3.0, 1.0, -0.5));
    state.rotor_speed_rad_s[0] = 900.0;
    let mut held = Held::in_still_air(RotorDrive::holding(state.rotor_speed_rad_s));
    let along = Some(state.ned_from_body() * state.omega);
    assert!(air(&state, held.wind, along).omega.vector.norm() < 1e-15);
    let mut change = |name: &str, values: &[f64]| {
        held.air_omega = None;
        let before = affected_by(name, values, &state, &held);
        held.air_omega = along;
        let after = affected_by(name, values, &state, &held);
        (after.force - before.force, after.moment - before.moment)
    };
    let (_, freed) = change("angular_damping", &[1e-3, 1e-3]);
    assert!((freed.vector.x - 0.5e-3).abs() < 1e-12, "{freed:?}");
    assert_eq!(change("rotor_gyro_torque", &[1e-5]), (In::zero(), In::zero()));
    assert_eq!(change("added_mass", &[0.1]), (In::zero(), In::zero()));
    let rolled = |held: &Held<f64>| {
        let mut omega = In::zero();
        let none = acting(&Effects::none());
        wrench(&vehicle, &none, &state, held, |air| {
            omega = air.omega;
            Wrench::zero()
        });
        omega.vector.norm()
    };
    assert!(rolled(&held) < 1e-15, "wings see it, too");
}

#[test]
fn a_tether_pulls_in_the_world() {
    let mut state = State::at_rest();
    state.attitude =
        *nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.0, core::f64::consts::FRAC_PI_2);
    let mut held = Held::in_still_air(RotorDrive::holding([0.0; MAX_ROTORS]));
    // A vehicle that falls with its load feels no weight of it, but what it is swung round with.
    held.tether = Some(Tether { mass_kg: 0.1, along: [0.6, 0.0, 0.8], circling_m_s2: 20.0 });
    let pull = affected_by("payload_swing", &[0.1, 0.5], &state, &held).force.vector;
    let (along, share) = (Vector3::new(0.0, -0.6, 0.8), 1.0 / (1.0 + 0.1 / 0.548));
    assert!((pull - along * (2.0 * share)).norm() < 1e-12, "north is to the left: {pull}");
}

#[test]
fn drag_opposes_the_motion_through_the_air_not_over_ground() {
    let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
    let air = air(&State::at_rest(), In::new(Vector3::new(5.0, 0.0, 0.0)), None);
    assert!(drag(&vehicle, &air).vector.x > 0.0, "a hovering vehicle is pushed with the wind");
}
