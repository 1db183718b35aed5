//! Classical Runge-Kutta of fourth order, for any state that can be added and scaled.

use crate::math::{Real, real};

/// A state whose rate has the same shape.
pub trait VectorSpace<T>: Copy {
    /// `self + h * rate`.
    #[must_use]
    fn plus_scaled(&self, h: T, rate: &Self) -> Self;
}

/// One step of length `dt_s`; inputs of `rate` are held over the step.
#[inline(always)]
pub fn rk4<T: Real, S: VectorSpace<T>>(state: S, dt_s: T, rate: impl Fn(&S) -> S) -> S {
    let half = dt_s * real(0.5);
    let k1 = rate(&state);
    let k2 = rate(&state.plus_scaled(half, &k1));
    let k3 = rate(&state.plus_scaled(half, &k2));
    let k4 = rate(&state.plus_scaled(dt_s, &k3));
    let sixth = dt_s * real(1.0 / 6.0);
    let third = dt_s * real(1.0 / 3.0);
    state.plus_scaled(sixth, &k1).plus_scaled(third, &k2).plus_scaled(third, &k3).plus_scaled(sixth, &k4)
}
