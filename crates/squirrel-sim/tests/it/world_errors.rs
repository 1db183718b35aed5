//! What cannot be is refused by name, and the world goes on afterwards.
#![cfg(feature = "rapier")]

use super::world_fixture::{open_field, thrown, vehicle};
use proptest::prelude::*;
use squirrel_core::dynamics::State;
use squirrel_core::frames::{Body, In, Wrench};
use squirrel_core::nalgebra::{Quaternion, Vector3};
use squirrel_sim::world::{Cylinder, MAX_OBSTACLES, World, WorldError, WorldParameters};

fn refusal(change: impl Fn(&mut WorldParameters)) -> String {
    let tree = Cylinder { north_m: 5.0, east_m: 5.0, radius_m: 0.2, height_m: 8.0 };
    let mut parameters = WorldParameters { obstacles: vec![tree; 4], ..open_field() };
    change(&mut parameters);
    World::new(&vehicle(), &parameters).expect_err("refused").to_string()
}

#[test]
fn a_world_that_cannot_be_names_field_index_and_value() {
    for (text, starts) in [
        (refusal(|p| p.size_body_m[2] = 0.0), "size_body_m[2] = 0: "),
        (refusal(|p| p.size_body_m[0] = f64::NAN), "size_body_m[0] = NaN: "),
        (refusal(|p| p.obstacles[3].radius_m = -0.2), "obstacles[3].radius_m = -0.2: "),
        (refusal(|p| p.obstacles[1].height_m = f64::INFINITY), "obstacles[1].height_m = inf: "),
        (refusal(|p| p.obstacles[0].north_m = f64::NAN), "obstacles[0].north_m = NaN: "),
        (refusal(|p| p.obstacles[2].east_m = 1e300), "obstacles[2].east_m = 1"),
        (refusal(|p| p.restitution = 1.0), "restitution = 1: must be 0 to 0.5"),
        (refusal(|p| p.friction = -0.1), "friction = -0.1: "),
        (
            refusal(|p| p.obstacles = vec![p.obstacles[0]; MAX_OBSTACLES + 1]),
            "obstacles (number of entries) = 10001: ",
        ),
    ] {
        assert!(text.starts_with(starts), "{text}");
    }
}

#[test]
fn a_step_that_cannot_be_names_the_quantity_and_the_world_goes_on() {
    let mut world = World::new(&vehicle(), &open_field()).unwrap();
    let good = thrown(0.3, [1.0, 0.0, 0.0], [0.1, 0.2, 0.3]);
    let nan = In::new(Vector3::new(0.0, f64::NAN, 0.0));
    let no_force = Wrench::zero();
    let mut refused = |state: State<f64>, wrench: Wrench<Body, f64>, dt_s: f64| {
        world.step(&state, &wrench, dt_s).unwrap_err().to_string()
    };
    let nan_ned = In::new(nan.vector);
    for (text, starts) in [
        (
            refused(good, Wrench::from_force(nan), 1e-3),
            "wrench.force_body_n[1] = NaN: must be finite",
        ),
        (
            refused(good, Wrench { moment: nan, ..no_force }, 1e-3),
            "wrench.moment_body_n_m[1] = NaN",
        ),
        (
            refused(State { position: nan_ned, ..good }, no_force, 1e-3),
            "state.position_ned_m[1] = NaN",
        ),
        (
            refused(State { velocity: nan_ned, ..good }, no_force, 1e-3),
            "state.velocity_ned_m_s[1] = NaN",
        ),
        (refused(State { omega: nan, ..good }, no_force, 1e-3), "state.omega_body_rad_s[1] = NaN"),
        (
            refused(
                State { attitude: Quaternion::new(f64::INFINITY, 0.0, 0.0, 0.0), ..good },
                no_force,
                1e-3,
            ),
            "state.q_ned_from_body_wxyz[0] = inf",
        ),
        (
            refused(
                State { attitude: Quaternion::new(0.0, 0.0, 0.0, 0.0), ..good },
                no_force,
                1e-3,
            ),
            "norm of state.q_ned_from_body_wxyz = 0",
        ),
        (refused(good, no_force, 0.0), "dt_s = 0: must be > 0 and <= 1"),
        (refused(good, no_force, f64::NAN), "dt_s = NaN"),
        (refused(good, no_force, 1.1), "dt_s = 1.1: must be > 0 and <= 1"),
    ] {
        assert!(text.starts_with(starts), "{text}");
    }
    // Finite numbers that overflow inside the step: rapier drops the body without a word.
    let burst = Wrench::from_force(In::new(Vector3::new(1e308, 1e308, 0.0)));
    let overflow = world.step(&good, &burst, 1.0).unwrap_err();
    assert!(matches!(overflow, WorldError::Overflow { .. }), "{overflow}");
    assert!(overflow.to_string().contains("force"), "{overflow}");

    // After all that the world still works: it falls, lands and rests like a new one.
    let mut fresh = World::new(&vehicle(), &open_field()).unwrap();
    let (mut state, mut expected) = (good, good);
    for _ in 0..3000 {
        state = world.step(&state, &no_force, 1e-3).unwrap().0;
        expected = fresh.step(&expected, &no_force, 1e-3).unwrap().0;
    }
    assert_eq!(state, expected);
    assert!(-state.position.vector.z > 0.012);
}

#[test]
fn a_world_may_move_to_another_thread() {
    fn sends<T: Send>(_: &T) {}
    sends(&World::new(&vehicle(), &open_field()).unwrap());
}

fn huge() -> impl Strategy<Value = In<Body, f64>> {
    let number = prop_oneof![Just(0.0), -1e3..1e3, -1e18..1e18, -1e308..1e308];
    prop::array::uniform3(number).prop_map(|v| In::new(Vector3::from(v)))
}

proptest! {
    /// Whatever comes in: a finite state or an error, no panic, and the next sane step works.
    #[test]
    fn huge_numbers_give_an_error_or_a_finite_state(
        position in huge(), velocity in huge(), omega in huge(), force in huge(), moment in huge(),
        dt_s in prop_oneof![1e-4..1e-2, 0.0..1e3, Just(1e-300), Just(1e300)],
    ) {
        let tree = Cylinder { north_m: 2.0, east_m: 0.0, radius_m: 0.2, height_m: 8.0 };
        let mut world =
            World::new(&vehicle(), &WorldParameters { obstacles: vec![tree; 3], ..open_field() }).unwrap();
        let good = thrown(0.3, [1.0, 0.0, 0.0], [0.1, 0.2, 0.3]);
        let state = State {
            position: In::new(position.vector),
            velocity: In::new(velocity.vector),
            omega,
            ..good
        };
        if let Ok((next, contact)) = world.step(&state, &Wrench { force, moment }, dt_s) {
            prop_assert!(next.is_finite() && contact.impulse_n_s.is_finite(), "{next:?} {contact:?}");
        }
        let mut state = good;
        for _ in 0..500 {
            state = world.step(&state, &Wrench::zero(), 2e-3).unwrap().0;
        }
        prop_assert!((0.01..0.3).contains(&-state.position.vector.z));
    }
}
