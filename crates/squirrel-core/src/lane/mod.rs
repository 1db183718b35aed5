//! The one scalar of the physics and of the networks.
//!
//! A formula is written once over [`Lane`]. In flight code and in the simulator a lane is one `f32`
//! or `f64`; in a batch and in training it is a register ([`Register`]) that holds one number of
//! each of several vehicles, or of several windows; in a sensitivity it is a [`Dual`]. Only basic
//! operations are used, which IEEE 754 rounds in one way, and no fused multiply-add, so that every
//! element of a register has the bits that one number has.
//!
//! There is no comparison, because elements of a register may differ in it:
//! [`Lane::where_positive`] selects.
//!
//! - [`functions`]: `exp`, `ln`, `tanh`, `cbrt` and others as straight lines of these operations
//! - [`vector`]: vectors and matrices of lanes as plain arrays
//! - `portable`: registers in plain Rust; those of a processor are in `squirrel-sim`
//! - `several`: lanes side by side, as of the rotors of one vehicle
//! - `numbers`: structures of lanes, and how they lie in memory side by side

mod dual;
pub mod functions;
mod numbers;
mod portable;
mod real;
mod several;
pub mod vector;

pub use dual::Dual;
pub use functions::net_tanh;
pub use numbers::{load, put, store, take};
pub use portable::Portable;
pub use real::{Real, lower, real, sqrt, upper};
pub use several::Several;

use core::ops::{Add, Div, Mul, Sub};

/// Numbers that lie side by side in memory. Fixed, because the order of a sum over them decides its
/// bits.
pub const BLOCK: usize = 16;

/// One number of each of a block.
pub type Row<S> = [S; BLOCK];

/// One number, one number of each of several vehicles or windows, or a number with its derivatives.
pub trait Lane:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The scalar in which it is stored.
    type Element: Copy;
    /// Whether it fits into a register. Of what does not, long formulas are functions of their own:
    /// inlined they gain nothing, and the compiler takes a minute over them.
    const FITS_A_REGISTER: bool = true;
    /// The same number everywhere.
    fn splat(element: Self::Element) -> Self;
    /// A constant.
    fn of(constant: f64) -> Self;
    /// The smaller of the two; `bound` where `self` is NaN.
    #[must_use]
    fn lower(self, bound: Self) -> Self;
    /// The larger of the two; `bound` where `self` is NaN.
    #[must_use]
    fn upper(self, bound: Self) -> Self;
    /// Square root.
    #[must_use]
    fn root(self) -> Self;
    /// `then` where a number is above zero, `otherwise` where it is not or is NaN.
    #[must_use]
    fn where_positive(self, then: Self, otherwise: Self) -> Self;
    /// Whether any number in it is above zero. For work that can be left out where none is; what is
    /// left out must be selected by the same numbers, so that no number depends on those beside it.
    fn any_positive(self) -> bool;
    /// The nearest whole number `n`, and `2^n`; for sizes up to 120.
    #[must_use]
    fn nearest_and_power_of_two(self) -> (Self, Self);
    /// Of a positive normal number `m 2^e` with `m` in `[1, 2)`: `m` and `e`.
    #[must_use]
    fn mantissa_and_exponent(self) -> (Self, Self);
    /// A third of the exponent and the leading bits of a positive normal number: its power -1/3 to
    /// 4 %.
    #[must_use]
    fn inverse_cube_root_guess(self) -> Self;
    /// What a neuron makes of its sum: [`net_tanh`], and in `f64` the exact one.
    #[must_use]
    fn activation(self) -> Self;
}

/// A register: several numbers that are computed with at once.
pub trait Register: Lane<Element: Real> {
    /// Numbers in it; a divisor of [`BLOCK`].
    const WIDTH: usize;
    /// From the first [`Self::WIDTH`] numbers.
    ///
    /// # Panics
    /// If there are fewer.
    fn load(from: &[Self::Element]) -> Self;
    /// To the first [`Self::WIDTH`] numbers.
    ///
    /// # Panics
    /// If there are fewer.
    fn store(self, to: &mut [Self::Element]);
}

/// 1.5 times the number whose last bit is one: adding it rounds to an integer.
pub const ROUND_F32: f32 = 12_582_912.0;
/// The same of f64.
pub const ROUND_F64: f64 = 6_755_399_441_055_744.0;
/// Bits of the guess of a power -1/3, as a number, for 1: four thirds of the exponent's bias.
pub const THIRDS_F32: f32 = 1_419_967_100.0;
/// See [`THIRDS_F32`].
pub const THIRD_F32: f32 = 1.0 / 3.0;

macro_rules! one_number {
    ($scalar:ident, $round:ident, $mantissa:literal, $bias:literal, $activation:path, $guess:expr) => {
        impl Lane for $scalar {
            type Element = Self;
            #[inline(always)]
            fn splat(element: Self) -> Self {
                element
            }
            #[inline(always)]
            fn of(constant: f64) -> Self {
                constant as $scalar
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
            fn root(self) -> Self {
                // The instruction, that registers have too; `libm`'s, which nalgebra takes, is a
                // call.
                #[cfg(any(test, feature = "std"))]
                {
                    $scalar::sqrt(self)
                }
                #[cfg(not(any(test, feature = "std")))]
                sqrt(self)
            }
            #[inline(always)]
            fn where_positive(self, then: Self, otherwise: Self) -> Self {
                if self > 0.0 { then } else { otherwise }
            }
            #[inline(always)]
            fn any_positive(self) -> bool {
                self > 0.0
            }
            #[inline(always)]
            fn nearest_and_power_of_two(self) -> (Self, Self) {
                let rounded = self + $round;
                // The whole number is in the low bits; shifted into the exponent, it is a power of
                // two.
                let power =
                    (rounded.to_bits() << $mantissa).wrapping_add((1.0 as $scalar).to_bits());
                (rounded - $round, Self::from_bits(power))
            }
            #[inline(always)]
            fn mantissa_and_exponent(self) -> (Self, Self) {
                let one = (1.0 as $scalar).to_bits();
                let bits = self.to_bits();
                let mantissa = Self::from_bits((bits & ((1 << $mantissa) - 1)) | one);
                // An integer in the low bits of a number whose last bit is one.
                let whole = ($round / 1.5).to_bits() | (bits >> $mantissa);
                (mantissa, Self::from_bits(whole) - ($round / 1.5 + $bias))
            }
            #[inline(always)]
            fn inverse_cube_root_guess(self) -> Self {
                $guess(self)
            }
            #[inline(always)]
            fn activation(self) -> Self {
                $activation(self)
            }
        }

        /// One number: what wider registers are compared with.
        impl Register for $scalar {
            const WIDTH: usize = 1;
            #[inline(always)]
            fn load(from: &[Self]) -> Self {
                from[0]
            }
            #[inline(always)]
            fn store(self, to: &mut [Self]) {
                to[0] = self;
            }
        }
    };
}
one_number!(f32, ROUND_F32, 23, 127.0, net_tanh, |x: f32| {
    // By numbers instead of integers: registers have no product of 32 bits by 32 bits to shift
    // down.
    f32::from_bits((THIRDS_F32 - x.to_bits().cast_signed() as f32 * THIRD_F32) as i32 as u32)
});
one_number!(f64, ROUND_F64, 52, 1023.0, libm::tanh, |x: f64| {
    let third = ((x.to_bits() >> 32) * 0x5555_5556) >> 32;
    f64::from_bits(0x553e_eaa8_u64.wrapping_sub(third) << 32)
});
