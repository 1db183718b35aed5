//! The paper's flat wing: `f = -rho sin(alpha) A |v|^2 n = -rho A |v| (n . v) n` (paper, eq. 4 and
//! 5).
//!
//! A normal-force coefficient of `2 sin(alpha)` on `1/2 rho |v|^2 A`; no tangential part. `v` is
//! relative to the air here (the paper takes the ground velocity; docs/equations.md T6).
//!
//! It is what the paper believes. Measured plates of aspect ratio 1 (docs/guide/wing.md) have about
//! as much up to 15 deg, as much or up to a third more at 20 to 37 deg, then a stall that it lacks,
//! and little more than half of it broadside: 1.06 to 1.18 instead of 2.

use crate::aero::{Air, Airflow, BodyWrench};
use crate::frames::{Body, Frame, In, Wrench};
use crate::lane::Lane;
use crate::lane::functions::size;
use crate::lane::vector::{dot, scaled};
use crate::math::{AIR_DENSITY_KG_M3, Real, real};
use crate::numbers;
use crate::vehicle::Wing;
use nalgebra::Vector3;

/// Force of the air on the plate, N, in the frame of its arguments.
///
/// * `velocity` - velocity relative to the air, m/s
/// * `normal` - unit vector along body z (down)
/// * `area_m2` - plate area
#[inline(always)]
pub fn force<F: Frame, T: Real>(velocity: In<F, T>, normal: In<F, T>, area_m2: T) -> In<F, T> {
    In::new(Vector3::from(plate(&velocity.vector.into(), &normal.vector.into(), area_m2)))
}

/// [`force`] on lanes.
#[inline(always)]
pub fn plate<L: Lane>(velocity: &[L; 3], normal: &[L; 3], area_m2: L) -> [L; 3] {
    let impedance = impedance(area_m2, dot(velocity, velocity).root());
    scaled(normal, impedance * dot(normal, velocity))
}

/// `-rho A |v|`, N s/m: times a speed through the plate it is the plate's force.
#[inline(always)]
pub fn impedance<L: Lane>(area_m2: L, speed: L) -> L {
    L::of(-AIR_DENSITY_KG_M3) * area_m2 * speed
}

/// Normal force coefficient of a plate behind whose edges the flow has separated, over that
/// broadside: `sin a (1 / (0.56 + 0.44 |sin a|) - 0.41) / 0.59`, Hoerner's for an infinite plate
/// with Lindenburg's term for a short one (docs/guide/wing.md).
///
/// * `sine` - of the angle of attack, with its sign
#[inline(always)]
pub fn separated<L: Lane>(sine: L) -> L {
    let edge = L::of(1.0) / (L::of(0.56) + L::of(0.44) * size(sine)) - L::of(0.41);
    L::of(1.0 / 0.59) * sine * edge
}

/// Wrench of a left and a right plate.
///
/// * `deployment` - left, right, 0..1
#[inline(always)]
pub fn wing_pair<T: Real>(wing: &Wing<T>, air: &Air<T>, deployment: [T; 2]) -> Wrench<Body, T> {
    let pair = Pair::new(wing);
    pair.wrench(pair.normal_forces(&Airflow::from(air), &deployment)).into()
}

numbers! {
    /// A flat plate on each side.
    Pair {
        /// `1/2 rho S c_N`, N s^2/m^2; 0 for no wing.
        per_square,
        /// Distance of each side's centre from the x axis, m.
        arm_m,
        /// How far ahead of the centre of mass the centres are, m.
        ahead_m
    }
}

impl<T: Real> Pair<T> {
    /// Of a vehicle's wings.
    #[inline(always)]
    pub fn new(wing: &Wing<T>) -> Self {
        let per_square =
            real::<T>(0.5 * AIR_DENSITY_KG_M3) * wing.area_per_side_m2 * wing.normal_force_slope;
        Self { per_square, arm_m: wing.lateral_arm_m, ahead_m: wing.longitudinal_arm_m }
    }
}

impl<L: Lane> Pair<L> {
    /// Forces along -z of a left and a right plate, N: `N = 1/2 rho S c_N |v| w`, with `w` the z
    /// component of the air's velocity at that side, so that roll and pitch are damped.
    ///
    /// * `deployment` - left, right, 0..1
    #[inline(always)]
    pub fn normal_forces(&self, flow: &Airflow<L>, deployment: &[L; 2]) -> [L; 2] {
        let slope = self.per_square * flow.speed;
        let roll_down = flow.omega[0] * self.arm_m;
        let down = flow.velocity[2] - flow.omega[1] * self.ahead_m;
        [slope * (down - roll_down) * deployment[0], slope * (down + roll_down) * deployment[1]]
    }

    /// Wrench of forces along -z at `x = ahead`, `y = -+ arm`, left and right, N.
    #[inline(always)]
    pub fn wrench(&self, [left, right]: [L; 2]) -> BodyWrench<L> {
        let none = L::of(0.0);
        let sum = left + right;
        // (ahead, -+arm, z) x (0, 0, -N)
        BodyWrench {
            force: [none, none, none - sum],
            moment: [(left - right) * self.arm_m, sum * self.ahead_m, none],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Ned, Rotation};

    const AREA_M2: f64 = 0.04;

    #[test]
    fn opposes_motion_in_all_octants_and_attitudes() {
        for i in 0..8u8 {
            let sign = |bit: u8| if i & bit == 0 { 1.0 } else { -1.0 };
            let velocity = In::<Ned, f64>::new(Vector3::new(sign(1) * 3.0, sign(2) * 2.0, sign(4)));
            for tilt in [-0.5, 0.0, 0.5] {
                let ned_from_body = Rotation::<Ned, Body, f64>::from_euler(tilt, 0.7 * tilt, 2.0);
                let normal = ned_from_body * In::new(Vector3::z());
                let power = force(velocity, normal, AREA_M2).vector.dot(&velocity.vector);
                assert!(power < 0.0, "the plate does work on the vehicle: octant {i}, tilt {tilt}");
            }
        }
    }

    #[test]
    fn a_dropped_plate_is_pushed_up() {
        let f =
            force(In::<Ned, f64>::new(Vector3::new(0.0, 0.0, 7.0)), In::new(Vector3::z()), AREA_M2);
        assert!((f.vector.z + 1.225 * 0.04 * 49.0).abs() < 1e-12);
    }

    #[test]
    fn braking_nose_up_gives_lift_and_drag() {
        let ned_from_body = Rotation::<Ned, Body, f64>::from_euler(0.0, 0.5, 0.0);
        let normal = ned_from_body * In::new(Vector3::z());
        let f = force(In::<Ned, f64>::new(Vector3::new(7.0, 0.0, 0.0)), normal, AREA_M2).vector;
        assert!(f.x < 0.0 && f.z < 0.0, "{f:?}");
    }

    #[test]
    fn edge_on_air_does_nothing() {
        let f = force(
            In::<Body, f64>::new(Vector3::new(9.0, -3.0, 0.0)),
            In::new(Vector3::z()),
            AREA_M2,
        );
        assert_eq!(f.vector.norm(), 0.0);
    }

    #[test]
    fn the_pair_is_the_plate_and_damps_roll() {
        let wing = Wing {
            area_per_side_m2: 0.02,
            normal_force_slope: 2.0,
            lateral_arm_m: 0.1,
            longitudinal_arm_m: 0.0,
            vertical_arm_m: 0.0,
            chord_m: 0.2,
            time_constant_s: 0.1,
        };
        let velocity = In::<Body, f64>::new(Vector3::new(6.0, 1.0, 3.0));
        let mut air = Air { velocity, speed: velocity.vector.norm(), omega: In::zero() };
        let still = wing_pair(&wing, &air, [1.0; 2]);
        assert!(
            (still.force - force(velocity, In::new(Vector3::z()), AREA_M2)).vector.norm() < 1e-12
        );
        assert_eq!(still.moment.vector.norm(), 0.0);
        air.omega = In::new(Vector3::new(2.0, 0.0, 0.0));
        assert!(wing_pair(&wing, &air, [1.0; 2]).moment.vector.x < 0.0);
        air.omega = In::zero();
        assert!(wing_pair(&wing, &air, [1.0, 0.0]).moment.vector.x > 0.0, "left lift rolls right");
    }
}
