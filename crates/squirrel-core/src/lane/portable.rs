//! Registers in plain Rust; compilers make SSE2 or NEON of them.

use super::{Lane, Register, net_tanh};
use core::ops::{Add, Div, Mul, Sub};

/// 128 bits of numbers: four `f32` or two `f64`. Also the left and the right wing of one vehicle,
/// which then share each instruction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Portable<S, const N: usize>(pub [S; N]);

macro_rules! portable {
    ($scalar:ty, $width:literal, $activation:expr, $($a:ident $b:ident $c:ident),*) => {
        portable!(@operator $scalar, $width, ($($a $b),*), Add add);
        portable!(@operator $scalar, $width, ($($a $b),*), Sub sub);
        portable!(@operator $scalar, $width, ($($a $b),*), Mul mul);
        portable!(@operator $scalar, $width, ($($a $b),*), Div div);

        impl Lane for Portable<$scalar, $width> {
            type Element = $scalar;
            #[inline(always)]
            fn splat(element: $scalar) -> Self {
                // Not `[element; N]`: that is a loop in each place, and LLVM takes a minute to be rid
                // of thousands in one function.
                $(let $a = element;)*
                Self([$($a),*])
            }
            #[inline(always)]
            fn of(constant: f64) -> Self {
                Self::splat(constant as $scalar)
            }
            #[inline(always)]
            fn lower(self, bound: Self) -> Self {
                let ([$($a),*], [$($b),*]) = (self.0, bound.0);
                Self([$($a.lower($b)),*])
            }
            #[inline(always)]
            fn upper(self, bound: Self) -> Self {
                let ([$($a),*], [$($b),*]) = (self.0, bound.0);
                Self([$($a.upper($b)),*])
            }
            #[inline(always)]
            fn root(self) -> Self {
                let [$($a),*] = self.0;
                Self([$($a.root()),*])
            }
            #[inline(always)]
            fn where_positive(self, then: Self, otherwise: Self) -> Self {
                let ([$($a),*], [$($b),*], [$($c),*]) = (self.0, then.0, otherwise.0);
                Self([$($a.where_positive($b, $c)),*])
            }
            #[inline(always)]
            fn any_positive(self) -> bool {
                let [$($a),*] = self.0;
                $($a.any_positive())|*
            }
            #[inline(always)]
            fn nearest_and_power_of_two(self) -> (Self, Self) {
                let [$(($a, $b)),*] = self.0.map(Lane::nearest_and_power_of_two);
                (Self([$($a),*]), Self([$($b),*]))
            }
            #[inline(always)]
            fn mantissa_and_exponent(self) -> (Self, Self) {
                let [$(($a, $b)),*] = self.0.map(Lane::mantissa_and_exponent);
                (Self([$($a),*]), Self([$($b),*]))
            }
            #[inline(always)]
            fn inverse_cube_root_guess(self) -> Self {
                Self(self.0.map(Lane::inverse_cube_root_guess))
            }
            #[inline(always)]
            fn activation(self) -> Self {
                $activation(self)
            }
        }

        impl Register for Portable<$scalar, $width> {
            const WIDTH: usize = $width;
            #[inline(always)]
            fn load(from: &[$scalar]) -> Self {
                let mut register = Self::of(0.0);
                register.0.copy_from_slice(&from[..$width]);
                register
            }
            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                to[..$width].copy_from_slice(&self.0);
            }
        }
    };
    (@operator $scalar:ty, $width:literal, ($($a:ident $b:ident),*), $trait:ident $method:ident) => {
        impl $trait for Portable<$scalar, $width> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let ([$($a),*], [$($b),*]) = (self.0, other.0);
                Self([$($a.$method($b)),*])
            }
        }
    };
}
portable!(f32, 4, net_tanh, a e i, b f j, c g k, d h l);
portable!(f64, 2, |x: Self| Self(x.0.map(Lane::activation)), a c e, b d f);
