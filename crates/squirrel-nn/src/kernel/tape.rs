//! One register of windows forwards and backwards in time.
//!
//! With `d2[t]` and `d1[t]` the derivatives of the loss by the sums of the neurons of both layers:
//!
//! ```text
//! d2[t] = (Wo y' [t last] + W2h d2[t+1])  (1 - h2[t]^2)        y' = derivative by the output
//! d1[t] = (W2x d2[t] + W1h d1[t+1]) (1 - h1[t]^2)
//! W2x' = sum_t h1[t] d2[t]^T      W2h' = sum_t h2[t-1] d2[t]^T     b2' = sum_t d2[t]      and so for the first layer
//! ```
//!
//! Both passes run in time; the sums over time come after them, a tile of weights at once, so that
//! a tile stays in registers.

use super::Net;
use super::simd::Register;
use squirrel_core::rnn::elman::{Hidden, Recurrent};
use squirrel_core::rnn::parnn::{HIDDEN, INPUTS};

/// What the backward pass needs of the forward pass, and what both have in common.
pub(super) struct Tape<L, const STEPS: usize> {
    inputs: [[L; INPUTS]; STEPS],
    first: [[L; HIDDEN]; STEPS],
    second: [[L; HIDDEN]; STEPS],
    first_pull: [[L; HIDDEN]; STEPS],
    second_pull: [[L; HIDDEN]; STEPS],
}

impl<L: Register, const STEPS: usize> Tape<L, STEPS> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        let layer = [[L::of(0.0); HIDDEN]; STEPS];
        Self {
            inputs: [[L::of(0.0); INPUTS]; STEPS],
            first: layer,
            second: layer,
            first_pull: layer,
            second_pull: layer,
        }
    }

    /// The outputs after the last step.
    #[inline(always)]
    pub(super) fn forward<const OUT: usize>(
        &mut self,
        net: &Net<L::Element, OUT>,
        inputs: [[L; INPUTS]; STEPS],
    ) -> [L; OUT] {
        self.inputs = inputs;
        let mut hidden = Hidden::new();
        for t in 0..STEPS {
            net.step(&mut hidden, &self.inputs[t]);
            self.first[t] = hidden.first;
            self.second[t] = hidden.second;
        }
        net.read(&hidden)
    }

    /// Adds the gradient to `sum`.
    ///
    /// * `pull` - derivative of the loss by each output
    #[inline(always)]
    pub(super) fn backward<const OUT: usize>(
        &mut self,
        net: &Net<L::Element, OUT>,
        pull: &[L; OUT],
        sum: &mut Net<L, OUT>,
    ) {
        let mut to_first = [L::of(0.0); HIDDEN];
        let mut to_second = [L::of(0.0); HIDDEN];
        pull_back(&mut to_second, &net.output.weight, pull);
        for t in (0..STEPS).rev() {
            self.second_pull[t] = through_tanh(&to_second, &self.second[t]);
            pull_back(&mut to_first, &net.second.input, &self.second_pull[t]);
            self.first_pull[t] = through_tanh(&to_first, &self.first[t]);
            to_first = [L::of(0.0); HIDDEN];
            pull_back(&mut to_first, &net.first.hidden, &self.first_pull[t]);
            to_second = [L::of(0.0); HIDDEN];
            pull_back(&mut to_second, &net.second.hidden, &self.second_pull[t]);
        }
        outer::<L, HIDDEN, OUT, 4, 1>(&mut sum.output.weight, &self.second[STEPS - 1..], &[*pull]);
        for o in 0..OUT {
            sum.output.bias[o] = sum.output.bias[o] + pull[o];
        }
        layer::<L, INPUTS, 2>(&mut sum.first, &self.inputs, &self.first, &self.first_pull);
        layer::<L, HIDDEN, 4>(&mut sum.second, &self.first, &self.second, &self.second_pull);
    }
}

/// `sums += weight pulls`: what the outputs ask of the inputs.
#[inline(always)]
fn pull_back<L: Register, const IN: usize, const OUT: usize>(
    sums: &mut [L; IN],
    weight: &[[L::Element; OUT]; IN],
    pulls: &[L; OUT],
) {
    for o in 0..OUT {
        for i in 0..IN {
            sums[i] = sums[i] + L::splat(weight[i][o]) * pulls[o];
        }
    }
}

/// Times the derivative of tanh, by its value.
#[inline(always)]
fn through_tanh<L: Register, const N: usize>(pulls: &[L; N], values: &[L; N]) -> [L; N] {
    let one = L::splat(nalgebra::convert(1.0));
    let mut through = *pulls;
    for n in 0..N {
        through[n] = pulls[n] * (one - values[n] * values[n]);
    }
    through
}

/// Gradients of one layer from all steps. There is no state before the first step.
#[inline(always)]
fn layer<L: Register, const IN: usize, const ROWS: usize>(
    sum: &mut Recurrent<IN, HIDDEN, L>,
    inputs: &[[L; IN]],
    states: &[[L; HIDDEN]],
    pulls: &[[L; HIDDEN]],
) {
    outer::<L, IN, HIDDEN, ROWS, 2>(&mut sum.input, inputs, pulls);
    outer::<L, HIDDEN, HIDDEN, 4, 2>(&mut sum.hidden, states, &pulls[1..]);
    for pull in pulls {
        for n in 0..HIDDEN {
            sum.bias[n] = sum.bias[n] + pull[n];
        }
    }
}

/// `sum += sum over steps of values[t] pulls[t]^T`, in tiles of `ROWS` x `COLUMNS` that divide the
/// matrix. Steps that only one of the two has are left out.
#[inline(always)]
fn outer<
    L: Register,
    const IN: usize,
    const OUT: usize,
    const ROWS: usize,
    const COLUMNS: usize,
>(
    sum: &mut [[L; OUT]; IN],
    values: &[[L; IN]],
    pulls: &[[L; OUT]],
) {
    const { assert!(IN.is_multiple_of(ROWS) && OUT.is_multiple_of(COLUMNS)) };
    for row in (0..IN).step_by(ROWS) {
        for column in (0..OUT).step_by(COLUMNS) {
            let mut tile = [[L::of(0.0); COLUMNS]; ROWS];
            for (value, pull) in values.iter().zip(pulls) {
                for r in 0..ROWS {
                    for c in 0..COLUMNS {
                        tile[r][c] = tile[r][c] + value[row + r] * pull[column + c];
                    }
                }
            }
            for r in 0..ROWS {
                for c in 0..COLUMNS {
                    sum[row + r][column + c] = sum[row + r][column + c] + tile[r][c];
                }
            }
        }
    }
}
