//! Facts of contact: things come to rest, do not pass through each other, and what they gain in
//! energy by it is small.
#![cfg(feature = "rapier")]

use super::world_fixture::{SIZE_BODY_M, open_field, thrown, vehicle};
use proptest::prelude::*;
use squirrel_core::dynamics::{Held, RotorDrive, State, derivative, rk4};
use squirrel_core::effects::{Acting, Effects};
use squirrel_core::frames::{Body, In, Wrench};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::Vector3;
use squirrel_sim::world::{Contact, Cylinder, RESTITUTION_MAX, World, WorldParameters};

const HALF_THICKNESS_M: f64 = 0.5 * SIZE_BODY_M[2];

fn height_m(state: &State<f64>) -> f64 {
    -state.position.vector.z
}

fn kinetic_j(state: &State<f64>) -> f64 {
    let vehicle = vehicle();
    let p = vehicle.parameters();
    let omega = state.omega.vector;
    0.5 * (p.mass_kg * state.velocity.vector.norm_squared() + omega.dot(&(p.inertia_kg_m2 * omega)))
}

/// The lift that cancels gravity, so that what is thrown flies straight.
fn weightless(state: &State<f64>) -> Wrench<Body, f64> {
    let up = In::new(Vector3::new(0.0, 0.0, -vehicle().weight_n()));
    Wrench::from_force(state.ned_from_body().inverse() * up)
}

fn cylinder(north_m: f64, east_m: f64, radius_m: f64) -> Cylinder {
    Cylinder { north_m, east_m, radius_m, height_m: 10.0 }
}

#[test]
fn a_tilted_drop_comes_to_rest_flat_on_the_ground_and_stays() {
    for dt_s in [4e-3, 2e-3, 1e-3] {
        let mut world = World::new(&vehicle(), &open_field()).unwrap();
        let mut state = thrown(0.5, [0.0; 3], [0.4, -0.3, 1.0]);
        let mut last = Contact::default();
        let mut time_s = 0.0;
        while time_s < 5.0 {
            (state, last) = world.step(&state, &Wrench::zero(), dt_s).unwrap();
            time_s += dt_s;
            if time_s > 3.0 {
                assert!(
                    state.velocity.vector.norm() < 1e-4,
                    "{dt_s} s: {}",
                    state.velocity.vector.norm()
                );
                assert!(
                    state.omega.vector.norm() < 1e-3,
                    "{dt_s} s: {}",
                    state.omega.vector.norm()
                );
                let sunk_m = HALF_THICKNESS_M - height_m(&state);
                assert!(sunk_m.abs() < 0.3e-3, "{dt_s} s: sunk by {sunk_m} m");
            }
        }
        assert!(last.ground && last.touching && last.obstacle.is_none());
        let weight_n_s = vehicle().weight_n() * dt_s;
        assert!((last.impulse_n_s / weight_n_s - 1.0).abs() < 1e-3, "the ground bears the weight");
    }
}

#[test]
fn nothing_is_touched_before_the_fall_is_over() {
    let mut world = World::new(&vehicle(), &open_field()).unwrap();
    let mut state = thrown(1.0 + HALF_THICKNESS_M, [0.0; 3], [0.0; 3]);
    let mut time_s = 0.0;
    let dt_s = 1e-3;
    loop {
        let (next, contact) = world.step(&state, &Wrench::zero(), dt_s).unwrap();
        if contact.touching {
            break;
        }
        assert_eq!(contact, Contact::default());
        (state, time_s) = (next, time_s + dt_s);
    }
    let fall_s = (2.0 / GRAVITY_M_S2).sqrt();
    assert!((time_s - fall_s).abs() < 2.0 * dt_s, "touched after {time_s} s, not {fall_s} s");
}

#[test]
fn a_trunk_throws_back_what_hits_it_and_tells_its_index() {
    let obstacles =
        vec![cylinder(2.5, 3.0, 0.5), cylinder(2.5, 0.0, 0.5), cylinder(-2.0, 0.0, 0.5)];
    let parameters = WorldParameters { obstacles, restitution: 0.5, ..open_field() };
    let mut world = World::new(&vehicle(), &parameters).unwrap();
    let mut state = thrown(5.0, [7.0, 0.0, 0.0], [0.0; 3]);
    let before_j = kinetic_j(&state);
    let mut given = Vec::new();
    for _ in 0..400 {
        let (next, contact) = world.step(&state, &weightless(&state), 1e-3).unwrap();
        if contact.touching {
            given.push(contact);
        }
        state = next;
    }
    let total_n_s: f64 = given.iter().map(|c| c.impulse_n_s).sum();
    assert!(
        !given.is_empty() && given.iter().all(|c| c.obstacle == Some(1) && !c.ground),
        "{given:?}"
    );
    let back_m_s = -state.velocity.vector.x;
    assert!((3.3..=3.7).contains(&back_m_s), "half of 7 m/s comes back: {back_m_s}");
    let momentum_n_s = vehicle().parameters().mass_kg * (7.0 + back_m_s);
    assert!(
        (total_n_s / momentum_n_s - 1.0).abs() < 0.02,
        "{total_n_s} N s for {momentum_n_s} N s"
    );
    assert!(kinetic_j(&state) < before_j);
}

#[test]
fn a_fast_vehicle_passes_neither_ground_nor_trunk_nor_pole() {
    for attitude in [[0.0; 3], [0.3, -0.5, 1.0], [1.57, 0.0, 0.0]] {
        let mut world = World::new(&vehicle(), &open_field()).unwrap();
        let mut state = thrown(2.0, [0.0, 0.0, 20.0], attitude);
        for _ in 0..1000 {
            state = world.step(&state, &Wrench::zero(), 1e-3).unwrap().0;
            // Deeper than half the thickness and the centre of mass would be in the ground.
            assert!(height_m(&state) > 0.0, "{attitude:?}: {} m", height_m(&state));
        }
        for radius_m in [0.5, 0.01] {
            let obstacles = vec![cylinder(2.0 + radius_m, 0.0, radius_m)];
            let parameters = WorldParameters { obstacles, ..open_field() };
            let mut world = World::new(&vehicle(), &parameters).unwrap();
            let mut state = thrown(5.0, [20.0, 0.0, 0.0], attitude);
            for _ in 0..300 {
                state = world.step(&state, &weightless(&state), 1e-3).unwrap().0;
                let p = state.position.vector;
                let beside = (p.x - 2.0 - radius_m).hypot(p.y) - radius_m;
                assert!(
                    beside > 0.0,
                    "{attitude:?}: the centre of mass is {beside} m into {radius_m} m"
                );
            }
        }
    }
}

#[test]
fn two_runs_give_the_same_bits() {
    let fly = || {
        let obstacles =
            (0..50).map(|i| cylinder(1.0 + 0.5 * f64::from(i), f64::from(i % 3) - 1.0, 0.2));
        let parameters = WorldParameters { obstacles: obstacles.collect(), ..open_field() };
        let mut world = World::new(&vehicle(), &parameters).unwrap();
        let mut state = thrown(1.0, [7.0, 0.3, 0.0], [0.1, -0.2, 0.3]);
        let mut contacts = Vec::new();
        for _ in 0..3000 {
            let (next, contact) = world.step(&state, &Wrench::zero(), 1e-3).unwrap();
            contacts.push((contact.obstacle, contact.impulse_n_s.to_bits()));
            state = next;
        }
        assert!(contacts.iter().any(|c| c.0.is_some()));
        let bits = |v: Vector3<f64>| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()];
        let s = &state;
        (bits(s.position.vector), bits(s.velocity.vector), bits(s.omega.vector), contacts)
    };
    assert_eq!(fly(), fly());
}

/// The plant's rule: RK4 while nothing is near, this world otherwise.
#[test]
fn a_flight_that_changes_from_rk4_to_the_world_lands() {
    let vehicle = vehicle();
    let mut world = World::new(&vehicle, &open_field()).unwrap();
    let calm = Acting::new(&Effects::none(), &vehicle);
    let drive = RotorDrive::new(&vehicle, &calm, &[0.0; 8], 14.8);
    let free = |state: State<f64>| {
        rk4(state, 1e-3, |s| {
            let held = Held::in_still_air(drive);
            derivative(&vehicle, &calm, s, &held, |_| Wrench::zero())
        })
        .normalised()
    };
    let mut state = thrown(3.0, [1.0, 0.0, 0.0], [0.1, 0.1, 0.0]);
    let (mut by_rk4, mut by_world) = (0, 0);
    for _ in 0..5000 {
        if world.is_near(&state, 1e-3) {
            by_world += 1;
            state = world.step(&state, &Wrench::zero(), 1e-3).unwrap().0;
        } else {
            by_rk4 += 1;
            state = free(state);
        }
    }
    assert!(by_rk4 > 600 && by_world > 3000, "{by_rk4} free, {by_world} near");
    assert!((height_m(&state) - HALF_THICKNESS_M).abs() < 1e-3);
    assert!(state.velocity.vector.norm() < 1e-3);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Friction and impacts take energy. What they give back is the solver's error, and small.
    #[test]
    fn contact_adds_no_energy(
        velocity in prop::array::uniform3(-7.0..7.0),
        omega in prop::array::uniform3(-8.0..8.0),
        attitude in prop::array::uniform3(-3.0..3.0),
        restitution in 0.0..=RESTITUTION_MAX,
        friction in 0.0..1.0,
        (dt_s, tolerance) in prop::sample::select(vec![(4e-3, 0.05), (1e-3, 0.02)]),
    ) {
        let obstacles = vec![cylinder(1.0, 0.0, 0.3), cylinder(-0.9, 0.6, 0.1), cylinder(0.0, -1.0, 0.5)];
        let parameters = WorldParameters { obstacles, restitution, friction, ..open_field() };
        let mut world = World::new(&vehicle(), &parameters).unwrap();
        let mut state = thrown(0.6, velocity, attitude);
        state.omega = In::new(Vector3::from(omega));
        let energy_j = |s: &State<f64>| kinetic_j(s) + vehicle().weight_n() * height_m(s);
        let start_j = energy_j(&state);
        let mut least_j = start_j;
        for _ in 0..(2.0 / dt_s) as usize {
            state = world.step(&state, &Wrench::zero(), dt_s).unwrap().0;
            let now_j = energy_j(&state);
            prop_assert!(now_j < least_j + tolerance * start_j, "{now_j} J after {least_j} J of {start_j} J");
            least_j = least_j.min(now_j);
        }
    }
}
