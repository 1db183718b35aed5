//! Arithmetic whose bits do not depend on the target.
//!
//! `f32::min` and `f32::max` differ between x86-64 and Cortex-M7 on NaN and on the sign of zero,
//! and the platform's `sin` differs in the last bit. Flight code therefore uses the compare-select
//! helpers and the `libm` calls below.

pub use crate::lane::{Real, lower, real, sqrt, upper};
use nalgebra::Vector3;

/// Standard gravity, m/s^2.
pub const GRAVITY_M_S2: f64 = 9.80665;
/// Air density at sea level in the standard atmosphere, kg/m^3. The paper states none.
pub const AIR_DENSITY_KG_M3: f64 = 1.225;

/// `x` limited to `[low, high]`; `low` if `x` is NaN, so that a limit holds whatever comes in.
#[inline(always)]
pub fn limit<T: PartialOrd>(x: T, low: T, high: T) -> T {
    lower(upper(x, low), high)
}

/// `v` shortened to length `max` where it is longer, direction kept.
#[inline]
pub fn limit_norm<T: Real>(v: Vector3<T>, max: T) -> Vector3<T> {
    let norm = v.norm();
    if norm > max { v * (max / norm) } else { v }
}

/// A count below 2^53 as it is: a processor without 64-bit integers has an f64 that holds both
/// halves.
#[inline(always)]
pub fn whole(count: u64) -> f64 {
    f64::from((count >> 32) as u32) * 4_294_967_296.0 + f64::from(count as u32)
}

/// Sine and cosine as `libm` gives them together: the same bits, and one function on the target
/// instead of three.
pub fn sin(x: f32) -> f32 {
    libm::sincosf(x).0
}

/// See [`sin`].
pub fn cos(x: f32) -> f32 {
    libm::sincosf(x).1
}

/// Angle wrapped into (-pi, pi], rad, to within the rounding of the angle. Total: a non-finite
/// angle gives 0.
pub fn wrap_angle(angle: f32) -> f32 {
    use core::f32::consts::PI;
    if angle > -PI && angle <= PI {
        return angle;
    }
    if !angle.is_finite() {
        return 0.0;
    }
    let turns = libm::floorf((angle + PI) / (2.0 * PI));
    let wrapped = angle - turns * 2.0 * PI;
    if wrapped <= -PI { PI } else { wrapped }
}

/// True where every component is finite.
pub fn all_finite(v: &Vector3<f32>) -> bool {
    v.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_is_as_the_language_converts_it() {
        for k in 0..1_000_000_u64 {
            let count = (k * k * k).wrapping_mul(9001) >> 11;
            assert_eq!((whole(count), whole(count) as f32), (count as f64, count as f32));
        }
    }

    /// What flew with the three functions flies with the one.
    #[test]
    fn sine_and_cosine_are_the_same_together() {
        for k in -200_000..200_000 {
            let x = k as f32 * 1.7e-4 * (1.0 + (k % 97) as f32);
            assert_eq!(
                (sin(x).to_bits(), cos(x).to_bits()),
                (libm::sinf(x).to_bits(), libm::cosf(x).to_bits()),
                "{x}"
            );
        }
    }

    #[test]
    fn a_limit_holds_for_nan() {
        assert_eq!(limit(f32::NAN, -1.0, 2.0), -1.0);
        assert_eq!(limit(f32::INFINITY, -1.0, 2.0), 2.0);
        assert_eq!(limit(0.5, -1.0, 2.0), 0.5);
    }

    #[test]
    fn wrapping_keeps_the_direction() {
        for k in -3i8..=3 {
            for step in -31i8..=31 {
                let angle = f32::from(step) * 0.1;
                let turned = angle + f32::from(k) * core::f32::consts::TAU;
                assert!((wrap_angle(turned) - angle).abs() < 1e-5, "{turned}");
            }
        }
        assert_eq!(wrap_angle(f32::NAN), 0.0);
    }
}
