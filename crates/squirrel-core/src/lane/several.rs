//! Several lanes side by side: what is computed alike of each rotor of one vehicle, and shares its
//! instructions or at least the wait for them. Roots and divisions take several times as long as
//! they keep the processor busy.
//!
//! Unlike in [`vector`](super::vector), there are closures in here: they end up in the function that
//! was compiled for the registers, too. Batches whose rotors blow on wings take 0.70 (AVX2) and 0.78
//! (AVX-512) of the time that rotor after rotor took; written out without closures they were 3 %
//! faster, and a single vehicle a fifth slower.

use super::Lane;
use core::array::from_fn;
use core::ops::{Add, Div, Mul, Sub};

/// A number, or a register, of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Several<L, const N: usize>(pub [L; N]);

macro_rules! operator {
    ($trait:ident $method:ident) => {
        impl<L: Lane, const N: usize> $trait for Several<L, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(from_fn(|i| self.0[i].$method(other.0[i])))
            }
        }
    };
}
operator!(Add add);
operator!(Sub sub);
operator!(Mul mul);
operator!(Div div);

impl<L: Lane, const N: usize> Several<L, N> {
    /// The same lane in each place.
    #[inline(always)]
    pub fn all(lane: L) -> Self {
        // Not `[lane; N]`, as in `Portable::splat`.
        Self(from_fn(|_| lane))
    }
    /// Two of each lane.
    #[inline(always)]
    fn two(self, f: impl Fn(L) -> (L, L)) -> (Self, Self) {
        let both = self.0.map(f);
        (Self(both.map(|(one, _)| one)), Self(both.map(|(_, other)| other)))
    }
}

impl<L: Lane, const N: usize> Lane for Several<L, N> {
    type Element = L::Element;
    #[inline(always)]
    fn splat(element: L::Element) -> Self {
        Self::all(L::splat(element))
    }
    #[inline(always)]
    fn of(constant: f64) -> Self {
        Self::all(L::of(constant))
    }
    #[inline(always)]
    fn lower(self, bound: Self) -> Self {
        Self(from_fn(|i| self.0[i].lower(bound.0[i])))
    }
    #[inline(always)]
    fn upper(self, bound: Self) -> Self {
        Self(from_fn(|i| self.0[i].upper(bound.0[i])))
    }
    #[inline(always)]
    fn root(self) -> Self {
        Self(self.0.map(L::root))
    }
    #[inline(always)]
    fn where_positive(self, then: Self, otherwise: Self) -> Self {
        Self(from_fn(|i| self.0[i].where_positive(then.0[i], otherwise.0[i])))
    }
    #[inline(always)]
    fn any_positive(self) -> bool {
        self.0.iter().fold(false, |any, lane| any | lane.any_positive())
    }
    #[inline(always)]
    fn nearest_and_power_of_two(self) -> (Self, Self) {
        self.two(L::nearest_and_power_of_two)
    }
    #[inline(always)]
    fn mantissa_and_exponent(self) -> (Self, Self) {
        self.two(L::mantissa_and_exponent)
    }
    #[inline(always)]
    fn inverse_cube_root_guess(self) -> Self {
        Self(self.0.map(L::inverse_cube_root_guess))
    }
    #[inline(always)]
    fn activation(self) -> Self {
        Self(self.0.map(L::activation))
    }
}
