//! The airframe of the world's tests: the squirrel's mass and rotors with an inertia that is not
//! diagonal.

use squirrel_core::dynamics::State;
use squirrel_core::frames::{In, Rotation};
use squirrel_core::nalgebra::{Matrix3, Vector3};
use squirrel_core::vehicle::Vehicle;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::world::WorldParameters;
use std::sync::OnceLock;

pub(crate) const SIZE_BODY_M: [f64; 3] = [0.276, 0.373, 0.025];

pub(crate) fn vehicle() -> Vehicle<f64> {
    // Read once: it is asked for in every step of some tests.
    static VEHICLE: OnceLock<Vehicle<f64>> = OnceLock::new();
    *VEHICLE.get_or_init(|| {
        let mut parameters = *VehicleFile::squirrel().vehicle.parameters();
        parameters.inertia_kg_m2 = Matrix3::new(
            3.22e-3, 2.0e-4, -1.0e-4, 2.0e-4, 4.68e-3, 1.5e-4, -1.0e-4, 1.5e-4, 7.72e-3,
        );
        Vehicle::new(parameters).expect("the fixture is a possible airframe")
    })
}

/// A world with ground and nothing else.
pub(crate) fn open_field() -> WorldParameters {
    WorldParameters {
        size_body_m: SIZE_BODY_M,
        obstacles: Vec::new(),
        ground: true,
        restitution: 0.3,
        friction: 0.6,
    }
}

/// Height over ground, m; velocity, m/s; roll, pitch and yaw, rad.
#[allow(dead_code)] // Not every test file throws the vehicle.
pub(crate) fn thrown(
    height_m: f64,
    velocity: [f64; 3],
    [roll, pitch, yaw]: [f64; 3],
) -> State<f64> {
    State {
        position: In::new(Vector3::new(0.0, 0.0, -height_m)),
        velocity: In::new(Vector3::from(velocity)),
        attitude:
            Rotation::<squirrel_core::frames::Ned, squirrel_core::frames::Body, f64>::from_euler(
                roll, pitch, yaw,
            )
            .quaternion
            .into_inner(),
        ..State::at_rest()
    }
}
