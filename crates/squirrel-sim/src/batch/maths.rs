//! Functions on registers that the wings, the battery and the effects need: straight lines of basic operations.
//!
//! The operations and their order are those of the plant's own functions, so that in f64 the bits are the plant's, too.

use super::simd::{Bits, Lanes};
use core::f64::consts::{FRAC_PI_2, LN_2, LOG2_E, SQRT_2, TAU};
use squirrel_core::math::real;

/// A number that stands on all places of a register.
#[inline(always)]
pub(super) fn all<L: Lanes>(x: f64) -> L {
    L::splat(real(x))
}

/// Absolute value.
#[inline(always)]
pub(super) fn size<L: Lanes>(x: L) -> L {
    x.upper(L::zero() - x)
}

/// 1 or, where `x` is below zero, -1.
#[inline(always)]
pub(super) fn sign<L: Lanes>(x: L) -> L {
    (L::zero() - x).where_positive(all(-1.0), all(1.0))
}

/// Limited to `[low, high]`; `low` where `x` is NaN.
#[inline(always)]
pub(super) fn limit<L: Lanes>(x: L, low: L, high: L) -> L {
    x.upper(low).lower(high)
}

/// `e^x`, relative error below 6e-11 or, in f32, a few units of the last place; of -80 or 80 for what is beyond.
#[inline(always)]
pub(super) fn exp<L: Lanes>(x: L) -> L {
    let x = limit(x, all(-80.0), all(80.0));
    let round = L::splat(<L::Weight as Bits>::ROUND);
    let rounded = x * all(LOG2_E) + round;
    let r = x - (rounded - round) * all(LN_2);
    let r2 = r * r;
    let low = all::<L>(0.500_000_006_768_206_7) + r * all(0.166_666_658_689_516_24);
    let middle = all::<L>(0.041_666_294_947_198_99) + r * all(0.008_333_497_072_160_372);
    let high = all::<L>(0.001_394_465_963_836_813) + r * all(0.000_197_903_426_467_583_04);
    rounded.power_of_two() * (all::<L>(1.0) + (r + r2 * (low + r2 * (middle + r2 * high))))
}

/// Natural logarithm of `x`; of 1e-30 for what is below.
#[inline(always)]
pub(super) fn ln<L: Lanes>(x: L) -> L {
    let (mantissa, exponent) = x.upper(all(1e-30)).mantissa_and_exponent();
    let one = all::<L>(1.0);
    let beyond = mantissa - all(SQRT_2);
    let mantissa = beyond.where_positive(mantissa * all(0.5), mantissa);
    let exponent = beyond.where_positive(exponent + one, exponent);
    // ln m = 2 artanh z; |z| <= 0.172, so that eleven terms leave 1e-17.
    let z = (mantissa - one) / (mantissa + one);
    let z2 = z * z;
    let mut sum = all::<L>(1.0 / 21.0);
    let mut n = 19;
    while n > 0 {
        sum = sum * z2 + all(1.0 / f64::from(n));
        n -= 2;
    }
    exponent * all(LN_2) + z * sum * all(2.0)
}

/// Hyperbolic tangent, absolute error below 4e-11 or, in f32, 2e-7.
#[inline(always)]
pub(super) fn tanh<L: Lanes>(x: L) -> L {
    let limited = limit(x, all(-20.0), all(20.0));
    all::<L>(1.0) - all::<L>(2.0) / (all::<L>(1.0) + exp(all::<L>(2.0) * limited))
}

/// The angle in [0, pi/2] that has this sine and cosine, rad, absolute error below 2e-9 or, in f32, 2e-7; 0 for (0, 0).
#[inline(always)]
pub(super) fn angle<L: Lanes>(sine: L, cosine: L) -> L {
    let m = sine.lower(cosine);
    let t = m * m;
    let t2 = t * t;
    let p0 = all::<L>(0.166_666_210_387_971_6) + t * all(0.075_027_880_005_406_35);
    let p2 = all::<L>(0.044_063_777_230_506_78) + t * all(0.036_137_560_418_011_58);
    let p4 = all::<L>(-0.008_694_689_086_504_67) + t * all(0.111_854_674_160_772_31);
    let p6 = all::<L>(-0.141_860_824_635_768_32) + t * all(0.127_066_817_961_721_6);
    let arc = m + m * t * ((p0 + t2 * p2) + t2 * t2 * (p4 + t2 * p6));
    (sine - cosine).where_positive(all::<L>(FRAC_PI_2) - arc, arc)
}

/// Cube root of a positive normal number, relative error below 1e-13 or, in f32, 3e-7.
#[inline(always)]
pub(super) fn cbrt<L: Lanes>(x: L) -> L {
    let one = all::<L>(1.0);
    let r = x.inverse_cube_root_guess();
    let e = one - x * r * (r * r);
    let r = r + r * e * (all::<L>(1.0 / 3.0) + e * (all::<L>(2.0 / 9.0) + e * all(14.0 / 81.0)));
    let e = one - x * r * (r * r);
    let r = r + r * e * (all::<L>(1.0 / 3.0) + e * all(2.0 / 9.0));
    x * r * r
}

/// An angle in [-pi, pi], rad, as [`squirrel_core::math::wrap_angle`] but for the sign of half a turn.
#[inline(always)]
pub(super) fn wrap<L: Lanes>(x: L) -> L {
    let round = L::splat(<L::Weight as Bits>::ROUND);
    let turns = (x * all(1.0 / TAU) + round) - round;
    x - turns * all(TAU)
}

/// Sine and cosine of an angle in [-pi/2, pi/2], absolute error below 7e-11 or, in f32, 2e-7.
#[inline(always)]
pub(super) fn half_turn_sine_and_cosine<L: Lanes>(x: L) -> (L, L) {
    let t = x * x;
    let (mut sine, mut cosine) = (all::<L>(1.0), all::<L>(1.0));
    let mut n = 7;
    while n > 0 {
        let k = 2.0 * f64::from(n);
        // Taylor's series from its far end, to the powers 15 and 14.
        sine = all::<L>(1.0) - sine * t * all(1.0 / (k * (k + 1.0)));
        cosine = all::<L>(1.0) - cosine * t * all(1.0 / (k * (k - 1.0)));
        n -= 1;
    }
    (x * sine, cosine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::simd::{BLOCK, Kernel, Path, Paths};
    use core::f64::consts::PI;

    /// Results of every function, a row each, for sixteen arguments.
    struct Table<S>([S; BLOCK]);

    impl<S: Paths> Kernel<S> for Table<S> {
        type Output = [[S; BLOCK]; 8];

        #[inline(always)]
        fn run<L: Lanes<Weight = S>>(self) -> Self::Output {
            let mut out = [self.0; 8];
            for start in (0..BLOCK).step_by(L::WIDTH) {
                let x = L::load(&self.0[start..]);
                let fraction = x / (x + all(1.0));
                let cosine = (all::<L>(1.0) - fraction * fraction).root();
                let (half_sine, half_cosine) = half_turn_sine_and_cosine((fraction - all(0.5)) * all(PI));
                let results = [
                    exp(L::zero() - x),
                    ln(x),
                    tanh(x - all(3.0)),
                    angle(fraction, cosine),
                    cbrt(x),
                    half_sine,
                    half_cosine,
                    wrap(x * all(0.25) - all(4.0)),
                ];
                for (row, result) in out.iter_mut().zip(results) {
                    result.store(&mut row[start..]);
                }
            }
            out
        }
    }

    fn truth(x: f64) -> [f64; 8] {
        let half = (x / (x + 1.0) - 0.5) * PI;
        let turned = 0.25 * x - 4.0;
        [
            (-x).exp(),
            x.ln(),
            (x - 3.0).tanh(),
            (x / (x + 1.0)).asin(),
            x.cbrt(),
            half.sin(),
            half.cos(),
            turned - (turned / TAU).round() * TAU,
        ]
    }

    fn every_function<S: Paths>(tolerance: f64) {
        for step in 0..4000_u32 {
            let x: [S; BLOCK] = core::array::from_fn(|i| {
                real(10_f64.powf(-4.0 + 5.5 * (f64::from(step) * 16.0 + i as f64) / 64_000.0))
            });
            let rows = S::run(Path::available()[0], Table(x));
            for path in Path::available() {
                assert!(S::run(path, Table(x)) == rows, "{}", path.name());
            }
            for (i, x) in x.iter().enumerate() {
                let truth = truth(nalgebra::try_convert(*x).unwrap());
                for (number, (row, truth)) in rows.iter().zip(truth).enumerate() {
                    let y: f64 = nalgebra::try_convert(row[i]).unwrap();
                    assert!(
                        (y - truth).abs() < tolerance * truth.abs().max(0.1),
                        "{number} at {x}: {y} for {truth}"
                    );
                }
            }
        }
    }

    #[test]
    fn every_function_is_right_and_the_same_on_every_path() {
        every_function::<f32>(6e-6);
        every_function::<f64>(1e-8);
    }
}
