//! Clearance is what a look at every tree gives, and is_near warns in time.
#![cfg(feature = "rapier")]

use super::world_fixture::{SIZE_BODY_M, open_field, thrown, vehicle};
use proptest::prelude::*;
use squirrel_core::dynamics::State;
use squirrel_core::frames::{In, Ned, Wrench};
use squirrel_core::nalgebra::Vector3;
use squirrel_sim::world::{Contact, Cylinder, World, WorldParameters};

fn cylinders(span_m: f64) -> impl Strategy<Value = Vec<Cylinder>> {
    let one = (-span_m..span_m, -span_m..span_m, 0.01..2.0, 0.1..20.0).prop_map(
        |(north_m, east_m, radius_m, height_m)| Cylinder { north_m, east_m, radius_m, height_m },
    );
    prop::collection::vec(one, 0..200)
}

/// Distance from a point to every solid, without a grid: along the surface's own cylindrical
/// coordinates.
fn by_hand(parameters: &WorldParameters, p: Vector3<f64>, horizon_m: f64) -> f64 {
    let to_solid = parameters.obstacles.iter().map(|c| {
        let axis = (p.x - c.north_m).hypot(p.y - c.east_m);
        let nearest_height = (-p.z).clamp(0.0, c.height_m);
        (axis - axis.min(c.radius_m)).hypot(-p.z - nearest_height)
    });
    let to_ground = parameters.ground.then_some((-p.z).max(0.0));
    let radius_m = 0.5 * Vector3::from(SIZE_BODY_M).norm();
    (to_solid.chain(to_ground).fold(f64::INFINITY, f64::min) - radius_m).min(horizon_m)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn clearance_is_what_a_look_at_every_tree_gives(
        obstacles in prop_oneof![cylinders(5.0), cylinders(60.0), cylinders(2000.0)],
        ground: bool,
        positions in prop::collection::vec((-80.0..80.0, -80.0..80.0, -25.0..2.0), 20),
        horizon_m in prop_oneof![0.0..0.3, 0.3..30.0, Just(1e4), Just(f64::INFINITY)],
    ) {
        let parameters = WorldParameters { obstacles, ground, ..open_field() };
        let world = World::new(&vehicle(), &parameters).unwrap();
        for (x, y, z) in positions {
            let p = Vector3::new(x, y, z);
            let clearance_m = world.clearance(In::<Ned, f64>::new(p), horizon_m);
            let expected_m = by_hand(&parameters, p, horizon_m);
            prop_assert!(
                clearance_m == expected_m || (clearance_m - expected_m).abs() < 1e-9,
                "{clearance_m} m, by hand {expected_m} m"
            );
        }
    }

    #[test]
    fn what_is_not_near_touches_nothing_in_the_next_step(
        obstacles in cylinders(4.0),
        position in (-6.0..6.0, -6.0..6.0, -4.0..-0.1),
        velocity in prop::array::uniform3(-20.0..20.0),
        attitude in prop::array::uniform3(-3.0..3.0),
        dt_s in 1e-4..1e-2,
    ) {
        let mut world = World::new(&vehicle(), &WorldParameters { obstacles, ..open_field() }).unwrap();
        let mut state = thrown(0.0, velocity, attitude);
        state.position = In::new(Vector3::new(position.0, position.1, position.2));
        let contact = world.step(&state, &Wrench::zero(), dt_s).unwrap().1;
        prop_assert!(world.is_near(&state, dt_s) || contact == Contact::default());
    }
}

#[test]
fn far_away_and_no_number_at_all() {
    let obstacles = vec![Cylinder { north_m: 10.0, east_m: 0.0, radius_m: 1.0, height_m: 5.0 }];
    let world = World::new(&vehicle(), &WorldParameters { obstacles, ..open_field() }).unwrap();
    let at = |x, y, z| In::<Ned, f64>::new(Vector3::new(x, y, z));
    assert_eq!(world.clearance(at(1e300, -1e300, -1e300), 5.0), 5.0);
    assert_eq!(world.clearance(at(f64::NEG_INFINITY, 0.0, -100.0), 5.0), 5.0);
    assert!(world.clearance(at(f64::NAN, 0.0, -100.0), 5.0).is_nan());
    let lost = State { position: at(0.0, f64::NAN, -100.0), ..State::at_rest() };
    assert!(world.is_near(&lost, 1e-3), "so that step can say what is wrong");
    let high = State { position: at(0.0, 0.0, -100.0), ..State::at_rest() };
    assert!(!world.is_near(&high, 1e-3));
}
