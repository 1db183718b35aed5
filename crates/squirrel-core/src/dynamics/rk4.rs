//! Classical Runge-Kutta of fourth order, for any state that can be added and scaled.

use crate::lane::Lane;
use crate::math::Real;

/// A state whose rate has the same shape.
pub trait VectorSpace<T>: Copy {
    /// `self + h * rate`.
    #[must_use]
    fn plus_scaled(&self, h: T, rate: &Self) -> Self;
}

/// Time ahead to where each next rate is taken, and weight of each in the step, both s.
pub type Stages<L, const STAGES: usize> = [[L; 2]; STAGES];

/// The stages of Runge and Kutta's fourth order.
#[inline(always)]
pub fn runge_kutta<L: Lane>(dt: L) -> Stages<L, 4> {
    let (half, sixth, third) = (dt * L::of(0.5), dt * L::of(1.0 / 6.0), dt * L::of(1.0 / 3.0));
    [[half, sixth], [half, third], [dt, third], [L::of(0.0), sixth]]
}

/// One step of length `dt_s`; inputs of `rate` are held over the step.
#[inline(always)]
pub fn rk4<T: Real, S: VectorSpace<T>>(state: S, dt_s: T, rate: impl Fn(&S) -> S) -> S {
    let mut stage = state;
    let mut next = state;
    // A loop, so that `rate` has one call and is inlined into it: a fifth faster than four calls in
    // a row.
    for [ahead, weight] in runge_kutta(dt_s) {
        let k = rate(&stage);
        stage = state.plus_scaled(ahead, &k);
        next = next.plus_scaled(weight, &k);
    }
    next
}
