//! Frames: vectors and rotations that know what they are expressed in.
//!
//! Typed at module borders, so that a body force cannot be added to a world force by mistake;
//! inside an equation the plain nalgebra vector is taken out and named with its frame
//! (`velocity_ned`, `force_body`).
//!
//! ```
//! use squirrel_core::frames::{Body, In, Ned, Rotation};
//! use squirrel_core::nalgebra::Vector3;
//!
//! let ned_from_body = Rotation::<Ned, Body, f64>::from_euler(0.0, 0.0, core::f64::consts::FRAC_PI_2);
//! let forward: In<Body, f64> = In::new(Vector3::new(1.0, 0.0, 0.0));
//! let east: In<Ned, f64> = ned_from_body * forward;
//! assert!((east.vector.y - 1.0).abs() < 1e-12);
//! ```
//! Mixing frames does not compile:
//! ```compile_fail
//! use squirrel_core::frames::{Body, In, Ned};
//! let wrong = In::<Body, f64>::zero() + In::<Ned, f64>::zero();
//! ```

use crate::lane::vector::heading;
use crate::math::Real;
use core::marker::PhantomData;
use core::ops::{Add, Mul, Neg, Sub};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// North-East-Down, fixed to the ground, origin at the take-off point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Ned;
/// Forward-Right-Down, fixed to the airframe, origin at the centre of mass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Body;

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Ned {}
    impl Sealed for super::Body {}
}
/// A coordinate frame.
pub trait Frame: sealed::Sealed + Copy + 'static {}
impl Frame for Ned {}
impl Frame for Body {}

/// A vector whose components are expressed in frame `F`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(transparent)]
pub struct In<F, T> {
    /// The components, in the unit that the owner states.
    pub vector: Vector3<T>,
    frame: PhantomData<F>,
}

impl<F: Frame, T: Real> In<F, T> {
    /// States that the components are expressed in `F`.
    #[inline(always)]
    pub fn new(vector: Vector3<T>) -> Self {
        Self { vector, frame: PhantomData }
    }
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::new(Vector3::zeros())
    }
}

impl<F: Frame> In<F, f32> {
    /// The origin, as a constant.
    pub const ORIGIN: Self = Self { vector: Vector3::new(0.0, 0.0, 0.0), frame: PhantomData };
}

impl<F: Frame, T: Real> Default for In<F, T> {
    fn default() -> Self {
        Self::zero()
    }
}
impl<F: Frame, T: Real> Add for In<F, T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.vector + other.vector)
    }
}
impl<F: Frame, T: Real> Sub for In<F, T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.vector - other.vector)
    }
}
impl<F: Frame, T: Real> Neg for In<F, T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.vector)
    }
}
impl<F: Frame, T: Real> Mul<T> for In<F, T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        Self::new(self.vector * factor)
    }
}

/// The rotation that takes components in `From` to components in `To`:
/// `v_ned = ned_from_body * v_body`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(transparent)]
pub struct Rotation<To, From, T: Real> {
    /// The Hamilton unit quaternion of the rotation.
    pub quaternion: UnitQuaternion<T>,
    frames: PhantomData<(To, From)>,
}

impl<To: Frame, From: Frame, T: Real> Rotation<To, From, T> {
    /// States between which frames the quaternion rotates.
    #[inline(always)]
    pub fn new(quaternion: UnitQuaternion<T>) -> Self {
        Self { quaternion, frames: PhantomData }
    }
    /// Both frames aligned.
    pub fn identity() -> Self {
        Self::new(UnitQuaternion::identity())
    }
    /// From roll, pitch and yaw (intrinsic z-y-x), rad.
    pub fn from_euler(roll: T, pitch: T, yaw: T) -> Self {
        Self::new(UnitQuaternion::from_euler_angles(roll, pitch, yaw))
    }
    /// From `[w, x, y, z]`; `None` unless finite with a norm that is not zero.
    pub fn from_wxyz(wxyz: [T; 4]) -> Option<Self> {
        let q = Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
        if !q.coords.iter().all(T::is_finite) {
            return None;
        }
        UnitQuaternion::try_new(q, crate::math::real(1e-6)).map(Self::new)
    }
    /// `[w, x, y, z]`.
    pub fn wxyz(&self) -> [T; 4] {
        let q = self.quaternion;
        [q.w, q.i, q.j, q.k]
    }
    /// Roll, pitch and yaw (intrinsic z-y-x), rad.
    pub fn euler(&self) -> (T, T, T) {
        self.quaternion.euler_angles()
    }
    /// Yaw alone, rad.
    pub fn heading(&self) -> T {
        heading(&self.wxyz())
    }
    /// The rotation the other way round.
    #[inline(always)]
    pub fn inverse(self) -> Rotation<From, To, T> {
        Rotation::new(self.quaternion.inverse())
    }
}

impl<To: Frame, From: Frame, T: Real> Mul<In<From, T>> for Rotation<To, From, T> {
    type Output = In<To, T>;
    #[inline(always)]
    fn mul(self, v: In<From, T>) -> In<To, T> {
        In::new(self.quaternion * v.vector)
    }
}

/// Force and moment about the centre of mass, both expressed in `F`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench<F: Frame, T: Real> {
    /// Force, N.
    pub force: In<F, T>,
    /// Moment about the centre of mass, N m.
    pub moment: In<F, T>,
}

impl<F: Frame, T: Real> Wrench<F, T> {
    /// No force, no moment.
    #[inline(always)]
    pub fn zero() -> Self {
        Self { force: In::zero(), moment: In::zero() }
    }
    /// A force through the centre of mass.
    #[inline(always)]
    pub fn from_force(force: In<F, T>) -> Self {
        Self { force, moment: In::zero() }
    }
}

impl<F: Frame, T: Real> Add for Wrench<F, T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { force: self.force + other.force, moment: self.moment + other.moment }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vector_costs_no_more_than_its_numbers() {
        assert_eq!(core::mem::size_of::<In<Body, f32>>(), 12);
    }

    #[test]
    fn nose_up_points_the_forward_axis_at_the_sky() {
        let ned_from_body = Rotation::<Ned, Body, f64>::from_euler(0.0, 0.3, 0.0);
        let forward_ned = ned_from_body * In::new(Vector3::x());
        assert!(
            (forward_ned.vector.z + 0.3f64.sin()).abs() < 1e-12,
            "down is positive, so up is negative"
        );
    }

    #[test]
    fn the_heading_is_the_yaw_of_the_euler_angles() {
        for k in -62..=62 {
            let yaw = f64::from(k) * 0.05;
            for (roll, pitch) in [(0.0, 0.0), (0.6, -0.4), (-2.0, 1.2), (3.0, -1.5)] {
                let attitude = Rotation::<Ned, Body, f64>::from_euler(roll, pitch, yaw);
                assert!(
                    (attitude.heading() - yaw).abs() < 1e-8,
                    "{roll} {pitch} {yaw}: {}",
                    attitude.heading()
                );
            }
        }
        let up = Rotation::<Ned, Body, f64>::from_wxyz([0.5_f64.sqrt(), 0.0, 0.5_f64.sqrt(), 0.0])
            .unwrap();
        assert!(up.heading().is_finite());
    }

    #[test]
    fn a_quaternion_and_its_antipode_are_one_rotation() {
        let q = Rotation::<Ned, Body, f64>::from_euler(0.4, -0.2, 2.5);
        let antipode = Rotation::<Ned, Body, f64>::from_wxyz(q.wxyz().map(|x| -x)).unwrap();
        let v = In::new(Vector3::new(1.0, 2.0, 3.0));
        assert!(((q * v).vector - (antipode * v).vector).norm() < 1e-14);
        assert!(Rotation::<Ned, Body, f64>::from_wxyz([f64::NAN, 0.0, 0.0, 0.0]).is_none());
        assert!(Rotation::<Ned, Body, f64>::from_wxyz([0.0; 4]).is_none());
    }
}
