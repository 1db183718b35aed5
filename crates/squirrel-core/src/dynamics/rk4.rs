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
    let (half, sixth, third) = (dt_s * real(0.5), dt_s * real(1.0 / 6.0), dt_s * real(1.0 / 3.0));
    let mut stage = state;
    let mut next = state;
    // A loop, so that `rate` has one call and is inlined into it: a fifth faster than four calls in a row.
    for (ahead, weight) in [(half, sixth), (half, third), (dt_s, third), (T::zero(), sixth)] {
        let k = rate(&stage);
        stage = state.plus_scaled(ahead, &k);
        next = next.plus_scaled(weight, &k);
    }
    next
}
