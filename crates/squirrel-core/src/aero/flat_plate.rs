//! The paper's flat wing: `f = -rho sin(alpha) A |v|^2 n = -rho A |v| (n . v) n` (paper, eq. 4 and 5).
//!
//! A normal-force coefficient of `2 sin(alpha)` on `1/2 rho |v|^2 A`; no tangential part. `v` is relative to the air here
//! (the paper takes the ground velocity; EQUATIONS T6).

use crate::frames::{Frame, In};
use crate::math::{AIR_DENSITY_KG_M3, Real, real};

/// Force of the air on the plate, N, in the frame of its arguments.
///
/// * `velocity` - velocity relative to the air, m/s
/// * `normal` - unit vector along body z (down)
/// * `area_m2` - plate area
#[inline(always)]
pub fn force<F: Frame, T: Real>(velocity: In<F, T>, normal: In<F, T>, area_m2: T) -> In<F, T> {
    let (v, n) = (velocity.vector, normal.vector);
    In::new(n * (-real::<T>(AIR_DENSITY_KG_M3) * area_m2 * v.norm() * n.dot(&v)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Body, Ned, Rotation};
    use nalgebra::Vector3;

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
        let f = force(In::<Ned, f64>::new(Vector3::new(0.0, 0.0, 7.0)), In::new(Vector3::z()), AREA_M2);
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
        let f = force(In::<Body, f64>::new(Vector3::new(9.0, -3.0, 0.0)), In::new(Vector3::z()), AREA_M2);
        assert_eq!(f.vector.norm(), 0.0);
    }
}
