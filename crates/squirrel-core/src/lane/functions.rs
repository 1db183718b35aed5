//! Elementary functions as straight lines of basic operations: the same on one number and on
//! registers.
//!
//! Polynomials are minimax in relative error where no series is named; the tests sweep each
//! function against the standard library. A [`Dual`](super::Dual) goes through the same lines,
//! which differentiates the polynomial: its derivatives are as exact as the values, or nearly.

use super::Lane;
use core::f64::consts::{FRAC_PI_2, LN_2, LOG2_E, SQRT_2, TAU};

/// Absolute value.
#[inline(always)]
pub fn size<L: Lane>(x: L) -> L {
    x.upper(L::of(0.0) - x)
}

/// 1 or, where `x` is below zero, -1.
#[inline(always)]
pub fn sign<L: Lane>(x: L) -> L {
    (L::of(0.0) - x).where_positive(L::of(-1.0), L::of(1.0))
}

/// Limited to `[low, high]`; `low` where `x` is NaN.
#[inline(always)]
pub fn limit<L: Lane>(x: L, low: L, high: L) -> L {
    x.upper(low).lower(high)
}

/// `e^x`, relative error below 6e-11 or, in f32, a few units of the last place; of -80 or 80 for
/// what is beyond.
#[inline(always)]
pub fn exp<L: Lane>(x: L) -> L {
    let x = limit(x, L::of(-80.0), L::of(80.0));
    let (nearest, power_of_two) = (x * L::of(LOG2_E)).nearest_and_power_of_two();
    let r = x - nearest * L::of(LN_2);
    let r2 = r * r;
    let low = L::of(0.500_000_006_768_206_7) + r * L::of(0.166_666_658_689_516_24);
    let middle = L::of(0.041_666_294_947_198_99) + r * L::of(0.008_333_497_072_160_372);
    let high = L::of(0.001_394_465_963_836_813) + r * L::of(0.000_197_903_426_467_583_04);
    power_of_two * (L::of(1.0) + (r + r2 * (low + r2 * (middle + r2 * high))))
}

/// Natural logarithm of `x`; of 1e-30 for what is below.
#[inline(always)]
pub fn ln<L: Lane>(x: L) -> L {
    let (mantissa, exponent) = x.upper(L::of(1e-30)).mantissa_and_exponent();
    let one = L::of(1.0);
    let beyond = mantissa - L::of(SQRT_2);
    let mantissa = beyond.where_positive(mantissa * L::of(0.5), mantissa);
    let exponent = beyond.where_positive(exponent + one, exponent);
    // ln m = 2 artanh z; |z| <= 0.172, so that eleven terms leave 1e-17.
    let z = (mantissa - one) / (mantissa + one);
    let z2 = z * z;
    let mut sum = L::of(1.0 / 21.0);
    let mut n = 19;
    while n > 0 {
        sum = sum * z2 + L::of(1.0 / f64::from(n));
        n -= 2;
    }
    exponent * L::of(LN_2) + z * sum * L::of(2.0)
}

/// Hyperbolic tangent, absolute error below 4e-11 or, in f32, 2e-7; exactly 0 at 0, exactly -1 or 1
/// beyond 20; -1 for NaN.
#[inline(always)]
pub fn tanh<L: Lane>(x: L) -> L {
    let limited = limit(x, L::of(-20.0), L::of(20.0));
    L::of(1.0) - L::of(2.0) / (L::of(1.0) + exp(L::of(2.0) * limited))
}

/// The angle in [0, pi/2] that has this sine and cosine, rad, absolute error below 2e-9 or, in f32,
/// 2e-7; 0 for (0, 0).
///
/// Takes both, because the caller has both: the arc sine alone loses its digits towards 90 deg.
#[inline(always)]
pub fn angle<L: Lane>(sine: L, cosine: L) -> L {
    // The arc sine of the smaller of the two, which is at most sin(45 deg).
    let m = sine.lower(cosine);
    let t = m * m;
    let t2 = t * t;
    let p0 = L::of(0.166_666_210_387_971_6) + t * L::of(0.075_027_880_005_406_35);
    let p2 = L::of(0.044_063_777_230_506_78) + t * L::of(0.036_137_560_418_011_58);
    let p4 = L::of(-0.008_694_689_086_504_67) + t * L::of(0.111_854_674_160_772_31);
    let p6 = L::of(-0.141_860_824_635_768_32) + t * L::of(0.127_066_817_961_721_6);
    let arc = m + m * t * ((p0 + t2 * p2) + t2 * t2 * (p4 + t2 * p6));
    (sine - cosine).where_positive(L::of(FRAC_PI_2) - arc, arc)
}

/// Cube root of a positive normal number, relative error below 1e-13 or, in f32, 3e-7.
#[inline(always)]
pub fn cbrt<L: Lane>(x: L) -> L {
    let one = L::of(1.0);
    let r = x.inverse_cube_root_guess();
    // With e = 1 - x r^3, r (1 - e)^(-1/3) would be exact; its series leaves 2e-5, then 4e-14. No
    // division.
    let e = one - x * r * (r * r);
    let r = r + r * e * (L::of(1.0 / 3.0) + e * (L::of(2.0 / 9.0) + e * L::of(14.0 / 81.0)));
    let e = one - x * r * (r * r);
    let r = r + r * e * (L::of(1.0 / 3.0) + e * L::of(2.0 / 9.0));
    x * r * r
}

/// An angle in [-pi, pi], rad, as [`wrap_angle`](crate::math::wrap_angle) but for the sign of half
/// a turn; 0 for what is beyond a million or no number.
#[inline(always)]
pub fn wrap<L: Lane>(x: L) -> L {
    let (turns, _) = (x * L::of(1.0 / TAU)).nearest_and_power_of_two();
    (L::of(1e6) - size(x)).where_positive(x - turns * L::of(TAU), L::of(0.0))
}

/// Sine and cosine of half an angle, whole turns taken off before: both may have the other sign.
#[inline(always)]
pub fn sine_and_cosine_of_half<L: Lane>(angle: L) -> (L, L) {
    half_turn_sine_and_cosine(wrap(angle) * L::of(0.5))
}

/// Sine and cosine of an angle in [-pi/2, pi/2], absolute error below 7e-11 or, in f32, 2e-7.
#[inline(always)]
pub fn half_turn_sine_and_cosine<L: Lane>(x: L) -> (L, L) {
    let (t, one) = (x * x, L::of(1.0));
    // Taylor's series from its far end, to the powers 15 and 14. No loop: what does not unroll it
    // would divide in flight.
    let sine = series(series(series(series(one, t, 210.0), t, 156.0), t, 110.0), t, 72.0);
    let sine = series(series(series(sine, t, 42.0), t, 20.0), t, 6.0);
    let cosine = series(series(series(series(one, t, 182.0), t, 132.0), t, 90.0), t, 56.0);
    let cosine = series(series(series(cosine, t, 30.0), t, 12.0), t, 2.0);
    (x * sine, cosine)
}

/// One term more of an alternating series.
#[inline(always)]
fn series<L: Lane>(sum: L, t: L, over: f64) -> L {
    L::of(1.0) - sum * t * L::of(1.0 / over)
}

/// Where [`net_tanh`] is held constant: the true value is within 5 ulp of 1 from here on.
const SATURATION: f32 = 7.9;
/// Numerator over x, powers of x^2 upwards; minimax in relative error on [0, 7.9], last bits chosen
/// by the error in `f32`.
const NUMERATOR: [f32; 5] = [1.966_426, 0.264_496_68, 7.037_843e-3, 4.330_742e-5, 3.033_843_4e-8];
/// Denominator, powers of x^2 upwards. All coefficients are positive: no cancellation.
const DENOMINATOR: [f32; 5] =
    [1.966_426, 0.919_971_9, 5.150_518_2e-2, 6.732_387_7e-4, 1.690_905_6e-6];

/// The hyperbolic tangent of the networks, a quotient of polynomials: within 6 ulp of the true
/// value for every `f32`, odd, never beyond 1. -tanh(7.9) for NaN, so that nothing that comes in
/// can make a hidden state NaN.
#[inline(always)]
#[must_use]
pub fn net_tanh<L: Lane<Element = f32>>(x: L) -> L {
    let x = x.upper(L::splat(-SATURATION)).lower(L::splat(SATURATION));
    let square = x * x;
    x * polynomial(&NUMERATOR, square) / polynomial(&DENOMINATOR, square)
}

#[inline(always)]
fn polynomial<L: Lane<Element = f32>>(coefficients: &[f32; 5], x: L) -> L {
    let [c0, c1, c2, c3, c4] = *coefficients;
    let high = (L::splat(c4) * x + L::splat(c3)) * x + L::splat(c2);
    (high * x + L::splat(c1)) * x + L::splat(c0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::Portable;
    use crate::math::upper;

    type Pair = Portable<f64, 2>;

    /// Largest `error(x, f(x))` over `count` points of `x(i)`, of one number and of a register.
    fn worst(
        count: i32,
        x: impl Fn(f64) -> f64,
        (one, pair): (impl Fn(f64) -> f64, impl Fn(Pair) -> Pair),
        error: impl Fn(f64, f64) -> f64,
    ) -> f64 {
        let mut worst = 0.0;
        for i in 0..=count {
            let at = x(f64::from(i) / f64::from(count));
            let y = one(at);
            let Portable(both) = pair(Portable([at, -0.0 + at]));
            assert_eq!(both.map(f64::to_bits), [y.to_bits(); 2], "a register differs at {at}");
            let e = error(at, y);
            assert!(e.is_finite(), "not finite at {at}");
            worst = upper(e, worst);
        }
        worst
    }

    #[test]
    fn exp_against_std() {
        let relative = |x: f64, y: f64| (y / x.exp() - 1.0).abs();
        let e = worst(2_000_000, |u| 160.0 * u - 80.0, (exp, exp), relative);
        assert!(e < 6e-11, "{e:e}");
        assert_eq!([exp(0.0), exp(-0.0)], [1.0; 2]);
    }

    #[test]
    fn ln_against_std() {
        let absolute = |x: f64, y: f64| (y - x.ln()).abs();
        let e = worst(1_000_000, |u| 10_f64.powf(60.0 * u - 30.0), (ln, ln), absolute);
        assert!(e < 1e-13, "{e:e}");
        assert_eq!(ln(1.0), 0.0);
    }

    #[test]
    fn tanh_against_std() {
        let absolute = |x: f64, y: f64| (y - x.tanh()).abs();
        let e = worst(2_000_000, |u| 60.0 * u - 30.0, (tanh, tanh), absolute);
        assert!(e < 4e-11, "{e:e}");
        assert_eq!([tanh(0.0), tanh(1e300), tanh(f64::INFINITY)], [0.0, 1.0, 1.0]);
        assert_eq!([tanh(f64::NEG_INFINITY), tanh(f64::NAN)], [-1.0; 2]);
    }

    #[test]
    fn angle_against_std() {
        let one = |a: f64| angle(a.sin(), a.cos());
        let pair = |a: Pair| angle(Portable(a.0.map(f64::sin)), Portable(a.0.map(f64::cos)));
        let e = worst(2_000_000, |u| u * FRAC_PI_2, (one, pair), |a, y| (y - a).abs());
        assert!(e < 2e-9, "{e:e}");
        assert_eq!(
            [angle(0.0, 0.0), angle(1.0, 0.0), angle(1e-200, 1.0)],
            [0.0, FRAC_PI_2, 1e-200]
        );
    }

    #[test]
    fn cbrt_against_std() {
        let relative = |x: f64, y: f64| (y / x.cbrt() - 1.0).abs();
        let e = worst(2_000_000, |u| 10f64.powf(600.0 * u - 300.0), (cbrt, cbrt), relative);
        let e = upper(e, worst(2_000_000, |u| 1e-4 + 8e-4 * u, (cbrt, cbrt), relative));
        assert!(e < 1e-13, "{e:e}");
    }

    #[test]
    fn sine_and_cosine_against_std() {
        let sine = |x: f64, y: f64| (y - x.sin()).abs();
        let cosine = |x: f64, y: f64| (y - x.cos()).abs();
        let by = |u: f64| (u - 0.5) * core::f64::consts::PI;
        let first =
            (|x: f64| half_turn_sine_and_cosine(x).0, |x: Pair| half_turn_sine_and_cosine(x).0);
        let second =
            (|x: f64| half_turn_sine_and_cosine(x).1, |x: Pair| half_turn_sine_and_cosine(x).1);
        assert!(worst(1_000_000, by, first, sine) < 7e-11);
        assert!(worst(1_000_000, by, second, cosine) < 7e-11);
    }

    /// To the bit inside half a turn; beyond it both take off the same turns.
    #[test]
    fn wrapping_is_what_flight_code_does_with_one_angle() {
        for k in -400_000..400_000 {
            let x = k as f32 * 7.8539e-6;
            assert_eq!(wrap(x).to_bits(), x.to_bits(), "{x}");
            let turned = x * 5.0 + 0.1;
            let same = (wrap(turned) - crate::math::wrap_angle(turned)).abs();
            assert!(same == 0.0 || (same - TAU as f32).abs() < 1e-6, "{turned}");
        }
        assert_eq!([f32::NAN, f32::INFINITY, -1e7].map(wrap), [0.0; 3]);
    }

    #[test]
    fn half_an_angle_of_any_turn_is_the_same_rotation() {
        for k in -3000..3000 {
            let angle = f64::from(k) * 0.01;
            let (sine, cosine) = sine_and_cosine_of_half(angle);
            let (half_sine, half_cosine) = (angle * 0.5).sin_cos();
            assert!((sine * half_sine + cosine * half_cosine).abs() > 1.0 - 1e-9, "{angle}");
            assert!((sine * half_cosine - cosine * half_sine).abs() < 1e-9, "{angle}");
        }
    }

    /// Error in units of the last place of the true value.
    fn error_ulp(x: f32) -> f64 {
        let truth = libm::tanh(f64::from(x));
        let rounded = (truth as f32).abs();
        let ulp = f64::from(f32::from_bits(rounded.to_bits() + 1)) - f64::from(rounded);
        (f64::from(net_tanh(x)) - truth).abs() / ulp
    }

    #[test]
    fn the_networks_tanh_is_within_a_few_ulp() {
        // Every 37th of the positive numbers up to 16, and all of those where it saturates.
        let coarse = (1..0x4180_0000_u32).step_by(37);
        let fine = 0x40e0_0000..0x4120_0000_u32;
        for bits in coarse.chain(fine) {
            let x = f32::from_bits(bits);
            assert!(error_ulp(x) < 6.0, "tanh({x:e}) = {:e}: {} ulp", net_tanh(x), error_ulp(x));
            assert!(net_tanh(x) <= 1.0, "tanh({x:e}) = {:e}", net_tanh(x));
        }
    }

    #[test]
    fn the_networks_tanh_is_odd_and_total() {
        for x in [0.0, 1e-40, 1e-6, 0.3, 2.0, 7.9, 50.0, f32::MAX, f32::INFINITY] {
            assert_eq!(net_tanh(-x).to_bits(), (-net_tanh(x)).to_bits(), "{x}");
        }
        assert!(net_tanh(f32::NAN).abs() <= 1.0);
        assert_eq!(net_tanh(0.0_f32), 0.0);
        assert_eq!(net_tanh(f32::INFINITY), net_tanh(SATURATION));
    }
}
