//! Branch-free arithmetic for the inner loop of the plant, two numbers at a time.
//!
//! The wing is evaluated four times a millisecond; with the platform's `tanh`, `asin` and `cbrt` it would cost more than
//! the rest of the closed loop. The functions here are straight lines of basic operations (and `sqrt`, which is exactly
//! rounded everywhere) on a [`Pair`], so that both sides of a wing share each instruction, and the bits are the same on
//! every target. Polynomials are minimax in relative error; the tests sweep each function against the standard library.

use core::f64::consts::{FRAC_PI_2, LN_2, LOG2_E};
use core::ops::{Add, Div, Mul, Sub};
use squirrel_core::math::{limit, lower, upper};

/// Left and right, element by element. On x86-64 LLVM keeps a pair in one SSE2 register.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair(pub(super) [f64; 2]);

impl Pair {
    /// The same number on both sides.
    #[inline(always)]
    pub(super) fn both(x: f64) -> Self {
        Self([x, x])
    }
    #[inline(always)]
    pub(super) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self([f(self.0[0]), f(self.0[1])])
    }
    #[inline(always)]
    pub(super) fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
    }
    #[inline(always)]
    pub(super) fn sum(self) -> f64 {
        self.0[0] + self.0[1]
    }
    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        self.map(f64::abs)
    }
    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }
    /// The larger of element and `bound`.
    #[inline(always)]
    pub(super) fn upper(self, bound: f64) -> Self {
        self.map(|x| upper(x, bound))
    }
    /// The smaller of element and `bound`.
    #[inline(always)]
    pub(super) fn lower(self, bound: f64) -> Self {
        self.map(|x| lower(x, bound))
    }
    /// Elements limited to `[low, high]`.
    #[inline(always)]
    pub(super) fn limit(self, low: f64, high: f64) -> Self {
        self.map(|x| limit(x, low, high))
    }
}

macro_rules! element_by_element {
    ($($trait:ident $method:ident $operator:tt;)*) => {$(
        impl $trait for Pair {
            type Output = Pair;
            #[inline(always)]
            fn $method(self, other: Pair) -> Pair {
                self.zip(other, |a, b| a $operator b)
            }
        }
        impl $trait<f64> for Pair {
            type Output = Pair;
            #[inline(always)]
            fn $method(self, other: f64) -> Pair {
                self.map(|a| a $operator other)
            }
        }
        impl $trait<Pair> for f64 {
            type Output = Pair;
            #[inline(always)]
            fn $method(self, other: Pair) -> Pair {
                other.map(|b| self $operator b)
            }
        }
    )*};
}
element_by_element! {
    Add add +;
    Sub sub -;
    Mul mul *;
    Div div /;
}

/// `e^x` for |x| <= 700, relative error below 6e-11; exactly 1 at 0.
#[inline(always)]
fn exp(x: Pair) -> Pair {
    // Adding 1.5 * 2^52 rounds to an integer and leaves that integer in the low bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let rounded = x * LOG2_E + ROUND;
    let power_of_two = rounded.map(|n| f64::from_bits((n.to_bits() << 52).wrapping_add(1f64.to_bits())));
    let r = x - (rounded - ROUND) * LN_2;
    let r2 = r * r;
    let low = 0.500_000_006_768_206_7 + r * 0.166_666_658_689_516_24;
    let middle = 0.041_666_294_947_198_99 + r * 0.008_333_497_072_160_372;
    let high = 0.001_394_465_963_836_813 + r * 0.000_197_903_426_467_583_04;
    power_of_two * (1.0 + (r + r2 * (low + r2 * (middle + r2 * high))))
}

/// Hyperbolic tangent, absolute error below 4e-11; exactly 0 at 0, exactly -1 or 1 beyond 20. -1 for NaN.
#[inline(always)]
pub(super) fn tanh(x: Pair) -> Pair {
    1.0 - 2.0 / (1.0 + exp(2.0 * x.limit(-20.0, 20.0)))
}

/// The angle in [0, pi/2] that has this sine and cosine, rad, absolute error below 2e-9; 0 for (0, 0).
///
/// Takes both, because the caller has both: the arc sine alone loses its digits towards 90 deg.
#[inline(always)]
pub(super) fn angle(sine: Pair, cosine: Pair) -> Pair {
    // The arc sine of the smaller of the two, which is at most sin(45 deg).
    let m = sine.zip(cosine, lower);
    let t = m * m;
    let t2 = t * t;
    let p0 = 0.166_666_210_387_971_6 + t * 0.075_027_880_005_406_35;
    let p2 = 0.044_063_777_230_506_78 + t * 0.036_137_560_418_011_58;
    let p4 = -0.008_694_689_086_504_67 + t * 0.111_854_674_160_772_31;
    let p6 = -0.141_860_824_635_768_32 + t * 0.127_066_817_961_721_6;
    let arc = m + m * t * ((p0 + t2 * p2) + t2 * t2 * (p4 + t2 * p6));
    let select =
        |side: usize| if sine.0[side] > cosine.0[side] { FRAC_PI_2 - arc.0[side] } else { arc.0[side] };
    Pair([select(0), select(1)])
}

/// Cube root of `x` in [1e-300, 1e300], relative error below 1e-13.
#[inline(always)]
pub(super) fn cbrt(x: Pair) -> Pair {
    // A third of exponent and leading bits, as a multiplication by 2^32 / 3: r = x^(-1/3) to 3.5 %.
    let r = x.map(|x| {
        let third = ((x.to_bits() >> 32) * 0x5555_5556) >> 32;
        f64::from_bits(0x553e_eaa8u64.wrapping_sub(third) << 32)
    });
    // With e = 1 - x r^3, r (1 - e)^(-1/3) would be exact; its series leaves 2e-5, then 4e-14. No division.
    let e = 1.0 - x * r * (r * r);
    let r = r + r * e * (1.0 / 3.0 + e * (2.0 / 9.0 + e * (14.0 / 81.0)));
    let e = 1.0 - x * r * (r * r);
    let r = r + r * e * (1.0 / 3.0 + e * (2.0 / 9.0));
    x * r * r
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest `error(x, f(x))` over `count` points of `x(i)`, each on both sides.
    fn worst(
        count: i32,
        x: impl Fn(f64) -> f64,
        f: impl Fn(Pair) -> Pair,
        error: impl Fn(f64, f64) -> f64,
    ) -> f64 {
        let mut worst = 0.0;
        for i in 0..=count {
            let at = x(f64::from(i) / f64::from(count));
            let both = f(Pair([at, -0.0 + at]));
            assert_eq!(both.0[0].to_bits(), both.0[1].to_bits(), "sides differ at {at}");
            let e = error(at, both.0[0]);
            assert!(e.is_finite(), "not finite at {at}");
            worst = upper(e, worst);
        }
        worst
    }

    #[test]
    fn exp_against_std() {
        let relative = |x: f64, y: f64| (y / x.exp() - 1.0).abs();
        let e = worst(2_000_000, |u| 1400.0 * u - 700.0, exp, relative);
        assert!(e < 6e-11 + 2e-13, "{e:e}");
        let e = worst(2_000_000, |u| 80.0 * u - 40.0, exp, relative);
        println!("exp relative error {e:e}");
        assert!(e < 6e-11, "{e:e}");
        assert_eq!(exp(Pair([0.0, -0.0])), Pair::both(1.0));
    }

    #[test]
    fn tanh_against_std() {
        let absolute = |x: f64, y: f64| (y - x.tanh()).abs();
        let e = worst(2_000_000, |u| 60.0 * u - 30.0, tanh, absolute);
        println!("tanh absolute error {e:e}");
        assert!(e < 4e-11, "{e:e}");
        assert_eq!(tanh(Pair::both(0.0)), Pair::both(0.0));
        assert_eq!(tanh(Pair([1e300, f64::INFINITY])), Pair::both(1.0));
        assert_eq!(tanh(Pair([f64::NEG_INFINITY, f64::NAN])), Pair::both(-1.0));
    }

    #[test]
    fn angle_against_std() {
        let by_angle = |a: Pair| angle(a.map(f64::sin), a.map(f64::cos));
        let e = worst(2_000_000, |u| u * FRAC_PI_2, by_angle, |a, y| (y - a).abs());
        println!("angle absolute error {e:e}");
        assert!(e < 2e-9, "{e:e}");
        assert_eq!(angle(Pair([0.0, 1.0]), Pair([0.0, 0.0])), Pair([0.0, FRAC_PI_2]));
        assert_eq!(angle(Pair([0.0, 1e-200]), Pair([1.0, 1.0])), Pair([0.0, 1e-200]));
    }

    #[test]
    fn cbrt_against_std() {
        let relative = |x: f64, y: f64| (y / x.cbrt() - 1.0).abs();
        let e = worst(2_000_000, |u| 10f64.powf(600.0 * u - 300.0), cbrt, relative);
        let e = upper(e, worst(2_000_000, |u| 1e-4 + 8e-4 * u, cbrt, relative));
        println!("cbrt relative error {e:e}");
        assert!(e < 1e-13, "{e:e}");
    }
}
