//! What a network computes with, and the one tanh of all networks.
//!
//! A network is written once over [`Lane`]. On the target a lane is one `f32`; in training it is a register that holds one
//! number of each of several windows. Only basic operations are used, which IEEE 754 rounds in one way, and no fused
//! multiply-add, so that every element of a register has the bits that the target computes.

use crate::math::{Real, lower, upper};
use core::ops::{Add, Div, Mul, Sub};

/// One number, or one number of each of several windows.
pub trait Lane:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The scalar in which weights are stored.
    type Weight: Copy;
    /// The same number everywhere.
    fn splat(weight: Self::Weight) -> Self;
    /// Zero everywhere.
    fn zero() -> Self;
    /// The smaller of the two; `bound` where `self` is NaN.
    #[must_use]
    fn lower(self, bound: Self) -> Self;
    /// The larger of the two; `bound` where `self` is NaN.
    #[must_use]
    fn upper(self, bound: Self) -> Self;
    /// What a neuron makes of its sum: [`tanh`], and in `f64` the exact one.
    #[must_use]
    fn activation(self) -> Self;
}

/// A scalar that networks and heads can be evaluated in: `f32` in flight, `f64` where gradients are checked.
pub trait NetScalar: Real + Lane<Weight = Self> {}
impl<T: Real + Lane<Weight = T>> NetScalar for T {}

/// Where [`tanh`] is held constant: the true value is within 5 ulp of 1 from here on.
const SATURATION: f32 = 7.9;
/// Numerator over x, powers of x^2 upwards; minimax in relative error on [0, 7.9], last bits chosen by the error in `f32`.
const NUMERATOR: [f32; 5] = [1.966_426, 0.264_496_68, 7.037_843e-3, 4.330_742e-5, 3.033_843_4e-8];
/// Denominator, powers of x^2 upwards. All coefficients are positive: no cancellation.
const DENOMINATOR: [f32; 5] = [1.966_426, 0.919_971_9, 5.150_518_2e-2, 6.732_387_7e-4, 1.690_905_6e-6];

/// Hyperbolic tangent as a quotient of polynomials: within 6 ulp of the true value for every `f32`, odd, never beyond 1.
/// -tanh(7.9) for NaN, so that nothing that comes in can make a hidden state NaN.
#[inline(always)]
#[must_use]
pub fn tanh<L: Lane<Weight = f32>>(x: L) -> L {
    let x = x.upper(L::splat(-SATURATION)).lower(L::splat(SATURATION));
    let square = x * x;
    x * polynomial(&NUMERATOR, square) / polynomial(&DENOMINATOR, square)
}

#[inline(always)]
fn polynomial<L: Lane<Weight = f32>>(coefficients: &[f32; 5], x: L) -> L {
    let [c0, c1, c2, c3, c4] = *coefficients;
    let high = (L::splat(c4) * x + L::splat(c3)) * x + L::splat(c2);
    (high * x + L::splat(c1)) * x + L::splat(c0)
}

macro_rules! scalar_lane {
    ($scalar:ty, $activation:path) => {
        impl Lane for $scalar {
            type Weight = Self;
            #[inline(always)]
            fn splat(weight: Self) -> Self {
                weight
            }
            #[inline(always)]
            fn zero() -> Self {
                0.0
            }
            #[inline(always)]
            fn lower(self, bound: Self) -> Self {
                lower(self, bound)
            }
            #[inline(always)]
            fn upper(self, bound: Self) -> Self {
                upper(self, bound)
            }
            #[inline(always)]
            fn activation(self) -> Self {
                $activation(self)
            }
        }
    };
}
scalar_lane!(f32, tanh);
scalar_lane!(f64, libm::tanh);

#[cfg(test)]
mod tests {
    use super::*;

    /// Error in units of the last place of the true value.
    fn error_ulp(x: f32) -> f64 {
        let truth = libm::tanh(f64::from(x));
        let rounded = (truth as f32).abs();
        let ulp = f64::from(f32::from_bits(rounded.to_bits() + 1)) - f64::from(rounded);
        (f64::from(tanh(x)) - truth).abs() / ulp
    }

    #[test]
    fn tanh_is_within_a_few_ulp() {
        // Every 37th of the positive numbers up to 16, and all of those where it saturates.
        let coarse = (1..0x4180_0000_u32).step_by(37);
        let fine = 0x40e0_0000..0x4120_0000_u32;
        for bits in coarse.chain(fine) {
            let x = f32::from_bits(bits);
            assert!(error_ulp(x) < 6.0, "tanh({x:e}) = {:e}: {} ulp", tanh(x), error_ulp(x));
            assert!(tanh(x) <= 1.0, "tanh({x:e}) = {:e}", tanh(x));
        }
    }

    #[test]
    fn tanh_is_odd_and_total() {
        for x in [0.0, 1e-40, 1e-6, 0.3, 2.0, 7.9, 50.0, f32::MAX, f32::INFINITY] {
            assert_eq!(tanh(-x).to_bits(), (-tanh(x)).to_bits(), "{x}");
        }
        assert!(tanh(f32::NAN).abs() <= 1.0);
        assert_eq!(tanh(0.0_f32), 0.0);
        assert_eq!(tanh(f32::INFINITY), tanh(SATURATION));
    }
}
