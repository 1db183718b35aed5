//! Dual numbers: a value and its derivatives by `N` variables, carried through every operation.
//!
//! `(a + a' e) (b + b' e) = a b + (a' b + a b') e`, because `e^2 = 0`. Where a formula selects, the
//! derivative is that of the side it takes; on a kink it is the derivative from one side.

use super::Lane;
use core::ops::{Add, Div, Mul, Sub};

/// A value with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// Its derivatives.
    pub by: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A number that depends on nothing.
    // Not `always`, nor are `splat` and `of`: the zeros are a loop, which LLVM then unrolls before it
    // is a part of a step. Sums and products are `always`: so a Jacobian takes an eighth less.
    #[inline]
    pub fn constant(value: f64) -> Self {
        Self { value, by: [0.0; N] }
    }

    /// The variable of an index.
    ///
    /// # Panics
    /// If there is no such variable.
    pub fn variable(value: f64, index: usize) -> Self {
        let mut by = [0.0; N];
        by[index] = 1.0;
        Self { value, by }
    }

    /// `value` with `slope` times its own derivatives.
    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        let mut by = self.by;
        for by in &mut by {
            *by *= slope;
        }
        Self { value, by }
    }

    /// `value` with `a` times its own derivatives and `b` times those of the other.
    #[inline(always)]
    fn both(self, other: Self, value: f64, [a, b]: [f64; 2]) -> Self {
        let mut by = self.by;
        for (by, other) in by.iter_mut().zip(&other.by) {
            *by = *by * a + *other * b;
        }
        Self { value, by }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.both(other, self.value + other.value, [1.0, 1.0])
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.both(other, self.value - other.value, [1.0, -1.0])
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.both(other, self.value * other.value, [other.value, self.value])
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let (quotient, inverse) = (self.value / other.value, 1.0 / other.value);
        self.both(other, quotient, [inverse, -quotient * inverse])
    }
}

impl<const N: usize> Lane for Dual<N> {
    type Element = f64;
    const FITS_A_REGISTER: bool = false;
    #[inline]
    fn splat(element: f64) -> Self {
        Self::constant(element)
    }
    #[inline]
    fn of(constant: f64) -> Self {
        Self::constant(constant)
    }
    #[inline(always)]
    fn lower(self, bound: Self) -> Self {
        if self.value < bound.value { self } else { bound }
    }
    #[inline(always)]
    fn upper(self, bound: Self) -> Self {
        if self.value > bound.value { self } else { bound }
    }
    /// At zero the slope is infinite and is taken as none: what grows with the root of a square has
    /// a kink there.
    #[inline(always)]
    fn root(self) -> Self {
        let root = self.value.root();
        self.chain(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }
    #[inline(always)]
    fn where_positive(self, then: Self, otherwise: Self) -> Self {
        if self.value > 0.0 { then } else { otherwise }
    }
    #[inline(always)]
    fn any_positive(self) -> bool {
        self.value > 0.0
    }
    /// Both are constant between jumps.
    #[inline(always)]
    fn nearest_and_power_of_two(self) -> (Self, Self) {
        let (nearest, power) = self.value.nearest_and_power_of_two();
        (Self::constant(nearest), Self::constant(power))
    }
    /// The mantissa is the number over a power of two that is constant between jumps.
    #[inline(always)]
    fn mantissa_and_exponent(self) -> (Self, Self) {
        let (mantissa, exponent) = self.value.mantissa_and_exponent();
        (self.chain(mantissa, mantissa / self.value), Self::constant(exponent))
    }
    /// The power's own slope, so that what is made of the guess has the right one after one step.
    #[inline(always)]
    fn inverse_cube_root_guess(self) -> Self {
        let guess = self.value.inverse_cube_root_guess();
        self.chain(guess, -guess / (3.0 * self.value))
    }
    #[inline(always)]
    fn activation(self) -> Self {
        let value = self.value.activation();
        self.chain(value, 1.0 - value * value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::functions::{angle, cbrt, exp, half_turn_sine_and_cosine, ln, tanh};

    /// Every function against its derivative in closed form.
    #[test]
    fn functions_have_the_derivatives_of_the_books() {
        for k in 1..400 {
            let at = 0.003_7 * f64::from(k);
            let x = Dual::<1>::variable(at, 0);
            let sine_cosine = half_turn_sine_and_cosine(x);
            let cases = [
                ("exp", exp(x), at.exp()),
                ("ln", ln(x), 1.0 / at),
                ("tanh", tanh(x), 1.0 - at.tanh().powi(2)),
                ("cbrt", cbrt(x), at.cbrt() / (3.0 * at)),
                ("angle", angle(sine_cosine.0, sine_cosine.1), 1.0),
                ("sine", sine_cosine.0, at.cos()),
                ("cosine", sine_cosine.1, -at.sin()),
                ("root", x.root(), 0.5 / at.sqrt()),
                ("quotient", Dual::of(3.0) / x, -3.0 / (at * at)),
                ("activation", x.activation(), 1.0 - at.tanh().powi(2)),
            ];
            for (name, dual, slope) in cases {
                // What an error of 2e-9, that oscillates, has as its slope; the largest at the end
                // of a polynomial's range.
                assert!(
                    (dual.by[0] - slope).abs() < 1e-6 * slope.abs().max(1.0),
                    "{name} at {at}: {dual:?}"
                );
            }
        }
    }

    #[test]
    fn a_choice_has_the_slope_of_the_side_it_takes() {
        let (x, one) = (Dual::<2>::variable(2.0, 0), Dual::constant(1.0));
        assert_eq!((x.upper(one).by, x.lower(one).by), ([1.0, 0.0], [0.0; 2]));
        assert_eq!((one - x).where_positive(one, x).by, [1.0, 0.0]);
    }
}
