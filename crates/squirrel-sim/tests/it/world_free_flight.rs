//! Free flight through rapier agrees with RK4 to first order in the step. Prints the table of the
//! module's header: `cargo test -p squirrel-sim --release --test world_free_flight -- --nocapture`
#![cfg(feature = "rapier")]

use super::world_fixture::{open_field, thrown, vehicle};
use squirrel_core::aero::Air;
use squirrel_core::dynamics::{Held, RotorDrive, State, derivative, rk4, wrench};
use squirrel_core::effects::{Acting, Effects};
use squirrel_core::frames::{Body, In, Wrench};
use squirrel_core::nalgebra::Vector3;
use squirrel_sim::world::{Contact, World};

fn no_surfaces(_: &Air<f64>) -> Wrench<Body, f64> {
    Wrench::zero()
}

/// Forward at 4 m/s, rolling and yawing, with uneven thrust of about the weight; 100 m up.
fn tumbling() -> State<f64> {
    let mut state = thrown(100.0, [4.0, -1.0, 0.5], [0.2, -0.1, 0.4]);
    state.omega = In::new(Vector3::new(3.0, 0.5, 4.0));
    state.rotor_speed_rad_s = [1500.0, 1490.0, 1495.0, 1510.0, 0.0, 0.0, 0.0, 0.0];
    state
}

fn by_rk4(steps: usize) -> State<f64> {
    let vehicle = vehicle();
    let mut state = tumbling();
    let calm = Acting::new(&Effects::none(), &vehicle);
    let mut drive = RotorDrive::new(&vehicle, &calm, &[0.5; 8], 14.8);
    drive.target_rad_s = state.rotor_speed_rad_s;
    for _ in 0..steps {
        state = rk4(state, 1.0 / steps as f64, |s| {
            derivative(&vehicle, &calm, s, &Held::in_still_air(drive), no_surfaces)
        })
        .normalised();
    }
    state
}

fn by_rapier(steps: usize) -> State<f64> {
    let vehicle = vehicle();
    let mut world = World::new(&vehicle, &open_field()).expect("a possible world");
    let mut state = tumbling();
    for _ in 0..steps {
        let drive = RotorDrive::holding(state.rotor_speed_rad_s);
        let held = wrench(
            &vehicle,
            &Acting::new(&Effects::none(), &vehicle),
            &state,
            &Held::in_still_air(drive),
            no_surfaces,
        );
        let (next, contact) =
            world.step(&state, &held, 1.0 / steps as f64).expect("a possible step");
        assert_eq!(contact, Contact::default());
        state = next;
    }
    state
}

/// Attitude, rad, and position, m.
fn error(state: &State<f64>, reference: &State<f64>) -> [f64; 2] {
    let turn = reference.ned_from_body().quaternion.angle_to(&state.ned_from_body().quaternion);
    [turn, (state.position - reference.position).vector.norm()]
}

#[test]
fn rapier_agrees_with_rk4_to_first_order() {
    let reference = by_rk4(4000);
    assert!(error(&by_rk4(2000), &reference)[1] < 1e-9, "the reference has converged");
    let errors = [250, 500, 1000, 2000].map(|steps| (steps, error(&by_rapier(steps), &reference)));
    for (steps, [attitude, position]) in errors {
        println!(
            "{} ms  {:.3} deg  {:.2} mm",
            1000.0 / f64::from(steps as u32),
            attitude.to_degrees(),
            position * 1e3
        );
    }
    let [attitude, position] = errors[2].1;
    assert!(
        attitude.to_degrees() < 0.05 && position < 2e-3,
        "at 1 ms: {attitude} rad, {position} m"
    );
    for pair in errors.windows(2) {
        for (coarse, fine) in pair[0].1.iter().zip(&pair[1].1) {
            let ratio = coarse / fine;
            assert!((1.7..2.3).contains(&ratio), "halving the step divides the error by {ratio}");
        }
    }
}

/// rapier caps both by default: speed at 400 m/s, rate at 45 deg a step.
#[test]
fn neither_speed_nor_rate_is_capped() {
    let mut world = World::new(&vehicle(), &open_field()).unwrap();
    let mut state = thrown(1e4, [700.0, 0.0, 0.0], [0.0; 3]);
    state.omega = In::new(Vector3::new(0.0, 0.0, 300.0));
    let next = world.step(&state, &Wrench::zero(), 1e-2).unwrap().0;
    assert!((next.velocity.vector.x - 700.0).abs() < 1e-9, "{}", next.velocity.vector);
    // The principal axes are off the body's, so the rate precesses; its size is what a cap would
    // change.
    assert!((next.omega.vector.norm() - 300.0).abs() < 30.0, "{}", next.omega.vector);
}
