//! Turns vectors and attitudes of foreign frames into NED and FRD.
//!
//! World frames: `ned` (north, east, down), `enu` (east, north, up), `nwu` (north, west, up). Body
//! frames: `frd` (forward, right, down), `flu` (forward, left, up). Each pair differs by half a
//! turn, so vectors only swap and flip their numbers.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Quaternion;
use serde::Deserialize;

/// World frame of a foreign log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum World {
    Ned,
    Enu,
    Nwu,
}

/// Body frame of a foreign log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Body {
    Frd,
    Flu,
}

/// Order of the four numbers of a foreign quaternion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Order {
    Wxyz,
    Xyzw,
}

/// Which way a foreign quaternion turns vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Direction {
    WorldFromBody,
    BodyFromWorld,
}

/// All that must be known to read a foreign quaternion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct AttitudeFrame {
    pub(super) order: Order,
    pub(super) direction: Direction,
    pub(super) world: World,
    pub(super) body: Body,
}

impl World {
    /// A vector of this frame in NED.
    pub(super) fn to_ned(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self {
            World::Ned => [x, y, z],
            World::Enu => [y, x, -z],
            World::Nwu => [x, -y, -z],
        }
    }

    fn q_ned_from_world(self) -> Quaternion<f64> {
        match self {
            World::Ned => Quaternion::identity(),
            World::Enu => Quaternion::new(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0),
            World::Nwu => Quaternion::new(0.0, 1.0, 0.0, 0.0),
        }
    }
}

impl Body {
    /// A vector of this frame in FRD.
    pub(super) fn to_frd(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self {
            Body::Frd => [x, y, z],
            Body::Flu => [x, -y, -z],
        }
    }

    fn q_body_from_frd(self) -> Quaternion<f64> {
        match self {
            Body::Frd => Quaternion::identity(),
            Body::Flu => Quaternion::new(0.0, 1.0, 0.0, 0.0),
        }
    }
}

impl AttitudeFrame {
    /// `q_ned_from_body` (FRD), not normalised, of four numbers as the foreign log orders them.
    pub(super) fn q_ned_from_body(self, file: [f64; 4]) -> Quaternion<f64> {
        let [a, b, c, d] = file;
        let q = match self.order {
            Order::Wxyz => Quaternion::new(a, b, c, d),
            Order::Xyzw => Quaternion::new(d, a, b, c),
        };
        let q_world_from_body = match self.direction {
            Direction::WorldFromBody => q,
            Direction::BodyFromWorld => q.conjugate(),
        };
        self.world.q_ned_from_world() * q_world_from_body * self.body.q_body_from_frd()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    /// The quaternion route and the vector route must agree in every combination of frames.
    #[test]
    fn a_forward_vector_lands_at_the_same_place_by_quaternion_and_by_vector() {
        let q = UnitQuaternion::from_euler_angles(0.3, -0.7, 2.1);
        let c = q.quaternion();
        let inverse = c.conjugate();
        for world in [World::Ned, World::Enu, World::Nwu] {
            for body in [Body::Frd, Body::Flu] {
                for (file, order, direction) in [
                    ([c.w, c.i, c.j, c.k], Order::Wxyz, Direction::WorldFromBody),
                    ([c.i, c.j, c.k, c.w], Order::Xyzw, Direction::WorldFromBody),
                    (
                        [inverse.w, inverse.i, inverse.j, inverse.k],
                        Order::Wxyz,
                        Direction::BodyFromWorld,
                    ),
                ] {
                    let frame = AttitudeFrame { order, direction, world, body };
                    let ned_from_frd = UnitQuaternion::from_quaternion(frame.q_ned_from_body(file));
                    let v_body = Vector3::new(0.2, -1.0, 0.5);
                    let by_vector = world.to_ned((q * v_body).into());
                    let by_quaternion = ned_from_frd * Vector3::from(body.to_frd(v_body.into()));
                    assert!((Vector3::from(by_vector) - by_quaternion).norm() < 1e-12, "{frame:?}");
                }
            }
        }
    }

    #[test]
    fn each_world_axis_has_its_place_in_ned() {
        assert_eq!(World::Enu.to_ned([1.0, 2.0, 3.0]), [2.0, 1.0, -3.0]);
        assert_eq!(World::Nwu.to_ned([1.0, 2.0, 3.0]), [1.0, -2.0, -3.0]);
        assert_eq!(World::Ned.to_ned([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
        assert_eq!(Body::Flu.to_frd([1.0, 2.0, 3.0]), [1.0, -2.0, -3.0]);
        assert_eq!(Body::Frd.to_frd([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    }
}
