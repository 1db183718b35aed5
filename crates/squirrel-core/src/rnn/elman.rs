//! The recurrent network of the paper: two layers of tanh neurons that see their own last state,
//! and a linear output.
//!
//! `h1[t] = tanh(W1x x[t] + W1h h1[t-1] + b1)`, `h2[t] = tanh(W2x h1[t] + W2h h2[t-1] + b2)`,
//! `y = Wo h2[t] + bo`, `h[-1] = 0` (docs/equations.md E.2).
//!
//! Weights are stored by input: `weight[i][o]` leads from input `i` to output `o`. So the eight
//! sums of a layer grow side by side, which is what a compiler puts into vector registers. A sum
//! starts at the bias and takes inputs in order, then hidden states in order; this order is part of
//! the meaning, because the bits depend on it.

use crate::lane::Lane;

/// A linear layer, `weight[input][output]`. Plain data, so that weights can be a `const`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dense<const IN: usize, const OUT: usize, T = f32> {
    /// From input to output.
    pub weight: [[T; OUT]; IN],
    /// What an output starts from.
    pub bias: [T; OUT],
}

/// A layer that sees its own last state; [`Recurrent::step`] is its equation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recurrent<const IN: usize, const OUT: usize, T = f32> {
    /// From input to neuron.
    pub input: [[T; OUT]; IN],
    /// From the last state to neuron.
    pub hidden: [[T; OUT]; OUT],
    /// What a neuron's sum starts from.
    pub bias: [T; OUT],
}

/// Two recurrent layers and a linear output.
///
/// `T` is `f32` for weights that fly. Training also keeps gradients in this shape, in other scalars
/// and in registers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elman<const IN: usize, const HIDDEN: usize, const OUT: usize, T = f32> {
    /// The layer that sees the input.
    pub first: Recurrent<IN, HIDDEN, T>,
    /// The layer that sees the first.
    pub second: Recurrent<HIDDEN, HIDDEN, T>,
    /// Reads the second layer.
    pub output: Dense<HIDDEN, OUT, T>,
}

/// What an [`Elman`] network remembers from step to step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hidden<const HIDDEN: usize, L = f32> {
    /// State of the first layer, within [-1, 1].
    pub first: [L; HIDDEN],
    /// State of the second layer, within [-1, 1].
    pub second: [L; HIDDEN],
}

impl<const HIDDEN: usize, L: Lane> Hidden<HIDDEN, L> {
    /// Nothing seen yet.
    #[inline(always)]
    pub fn new() -> Self {
        Self { first: [L::of(0.0); HIDDEN], second: [L::of(0.0); HIDDEN] }
    }
}

impl<const HIDDEN: usize, L: Lane> Default for Hidden<HIDDEN, L> {
    fn default() -> Self {
        Self::new()
    }
}

/// `sums += weight^T values`, values in order.
#[inline(always)]
fn accumulate<const IN: usize, const OUT: usize, L: Lane>(
    sums: &mut [L; OUT],
    weight: &[[L::Element; OUT]; IN],
    values: &[L; IN],
) {
    for i in 0..IN {
        for o in 0..OUT {
            sums[o] = sums[o] + L::splat(weight[i][o]) * values[i];
        }
    }
}

#[inline(always)]
fn start<const OUT: usize, L: Lane>(bias: &[L::Element; OUT]) -> [L; OUT] {
    let mut sums = [L::of(0.0); OUT];
    for o in 0..OUT {
        sums[o] = L::splat(bias[o]);
    }
    sums
}

/// The activation of every element. A loop, because the closure of `map` is not inlined into vector
/// code.
#[inline(always)]
fn activate<const N: usize, L: Lane>(mut sums: [L; N]) -> [L; N] {
    for o in 0..N {
        sums[o] = sums[o].activation();
    }
    sums
}

impl<const IN: usize, const OUT: usize, T: Copy> Dense<IN, OUT, T> {
    /// The outputs for these inputs.
    #[inline(always)]
    pub fn evaluate<L: Lane<Element = T>>(&self, inputs: &[L; IN]) -> [L; OUT] {
        let mut sums = start(&self.bias);
        accumulate(&mut sums, &self.weight, inputs);
        sums
    }

    /// The outputs behind tanh.
    #[inline(always)]
    pub fn neurons<L: Lane<Element = T>>(&self, inputs: &[L; IN]) -> [L; OUT] {
        activate(self.evaluate(inputs))
    }
}

impl<const IN: usize, const OUT: usize, T: Copy> Recurrent<IN, OUT, T> {
    /// The next state, `tanh(input^T x + hidden^T h + bias)`.
    #[inline(always)]
    pub fn step<L: Lane<Element = T>>(&self, inputs: &[L; IN], hidden: &[L; OUT]) -> [L; OUT] {
        let mut sums = start(&self.bias);
        accumulate(&mut sums, &self.input, inputs);
        accumulate(&mut sums, &self.hidden, hidden);
        activate(sums)
    }
}

impl<const IN: usize, const HIDDEN: usize, const OUT: usize, T: Copy> Elman<IN, HIDDEN, OUT, T> {
    /// All parameters equal.
    pub const fn filled(value: T) -> Self {
        Self {
            first: Recurrent {
                input: [[value; HIDDEN]; IN],
                hidden: [[value; HIDDEN]; HIDDEN],
                bias: [value; HIDDEN],
            },
            second: Recurrent {
                input: [[value; HIDDEN]; HIDDEN],
                hidden: [[value; HIDDEN]; HIDDEN],
                bias: [value; HIDDEN],
            },
            output: Dense { weight: [[value; OUT]; HIDDEN], bias: [value; OUT] },
        }
    }

    /// The parameters tensor by tensor: input, hidden, bias of the first layer, of the second,
    /// weight and bias of the output. Matrices row by row, a row an input.
    pub const fn tensors(&self) -> [&[T]; 8] {
        let Self { first, second, output } = self;
        [
            first.input.as_flattened(),
            first.hidden.as_flattened(),
            &first.bias,
            second.input.as_flattened(),
            second.hidden.as_flattened(),
            &second.bias,
            output.weight.as_flattened(),
            &output.bias,
        ]
    }

    /// As [`Elman::tensors`], to write to.
    pub const fn tensors_mut(&mut self) -> [&mut [T]; 8] {
        let Self { first, second, output } = self;
        [
            first.input.as_flattened_mut(),
            first.hidden.as_flattened_mut(),
            &mut first.bias,
            second.input.as_flattened_mut(),
            second.hidden.as_flattened_mut(),
            &mut second.bias,
            output.weight.as_flattened_mut(),
            &mut output.bias,
        ]
    }

    /// Streaming: one step with what was remembered. The output may be read after any step.
    #[inline(always)]
    pub fn step<L: Lane<Element = T>>(&self, hidden: &mut Hidden<HIDDEN, L>, inputs: &[L; IN]) {
        hidden.first = self.first.step(inputs, &hidden.first);
        hidden.second = self.second.step(&hidden.first, &hidden.second);
    }

    /// The output for the present state.
    #[inline(always)]
    pub fn read<L: Lane<Element = T>>(&self, hidden: &Hidden<HIDDEN, L>) -> [L; OUT] {
        self.output.evaluate(&hidden.second)
    }

    /// The output after a window of inputs, oldest first, with nothing remembered from before.
    #[inline(always)]
    pub fn window<L: Lane<Element = T>>(&self, inputs: &[[L; IN]]) -> [L; OUT] {
        let mut hidden = Hidden::new();
        for row in inputs {
            self.step(&mut hidden, row);
        }
        self.read(&hidden)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::net_tanh as tanh;

    /// Any numbers of order 0.3, all different; const, as a firmware would have them.
    const NET: Elman<2, 3, 1> = Elman {
        first: Recurrent {
            input: [[0.3, -0.2, 0.5], [-0.4, 0.1, 0.7]],
            hidden: [[0.2, 0.6, -0.1], [-0.3, 0.4, 0.15], [0.25, -0.35, 0.45]],
            bias: [0.01, -0.02, 0.03],
        },
        second: Recurrent {
            input: [[-0.5, 0.3, 0.2], [0.6, -0.15, 0.1], [0.05, 0.35, -0.45]],
            hidden: [[0.12, -0.22, 0.32], [0.42, 0.52, -0.62], [-0.11, 0.21, 0.31]],
            bias: [-0.04, 0.05, -0.06],
        },
        output: Dense { weight: [[0.7], [-0.8], [0.9]], bias: [0.1] },
    };
    const INPUTS: [[f32; 2]; 4] = [[0.5, -0.1], [0.6, 0.2], [-0.3, 0.4], [0.9, -0.7]];

    /// The equations of the header, written once more with indices.
    #[test]
    fn a_window_is_the_equation() {
        let (mut h1, mut h2) = ([0.0_f32; 3], [0.0_f32; 3]);
        for x in INPUTS {
            let old = (h1, h2);
            for o in 0..3 {
                let sum = |bias: f32, terms: &[(f32, f32)]| {
                    terms.iter().fold(bias, |s, (w, v)| s + w * v)
                };
                let layer = &NET.first;
                let mut terms = vec![(layer.input[0][o], x[0]), (layer.input[1][o], x[1])];
                terms.extend((0..3).map(|i| (layer.hidden[i][o], old.0[i])));
                h1[o] = tanh(sum(layer.bias[o], &terms));
            }
            for o in 0..3 {
                let layer = &NET.second;
                let mut sum = layer.bias[o];
                for i in 0..3 {
                    sum += layer.input[i][o] * h1[i];
                }
                for i in 0..3 {
                    sum += layer.hidden[i][o] * old.1[i];
                }
                h2[o] = tanh(sum);
            }
        }
        let expected = ((0.1 + 0.7 * h2[0]) + -0.8 * h2[1]) + 0.9 * h2[2];
        assert_eq!(NET.window(&INPUTS)[0].to_bits(), expected.to_bits());
    }

    #[test]
    fn streaming_is_the_window_grown() {
        let mut hidden = Hidden::new();
        for n in 0..INPUTS.len() {
            NET.step(&mut hidden, &INPUTS[n]);
            assert_eq!(NET.read(&hidden), NET.window(&INPUTS[..=n]));
        }
        assert_eq!(NET.window::<f32>(&[]), NET.read::<f32>(&Hidden::new()));
    }

    #[test]
    fn nothing_that_comes_in_makes_nan() {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 0.0] {
            assert!(NET.window(&[[x, x], [-x, x], [1.0, 0.5]])[0].is_finite(), "{x}");
        }
    }

    #[test]
    fn tensors_are_all_parameters_once() {
        let mut net = Elman::<2, 8, 2>::filled(0.0);
        assert_eq!(net.tensors().map(<[f32]>::len), [16, 64, 8, 64, 64, 8, 16, 2]);
        for (k, tensor) in net.tensors_mut().into_iter().enumerate() {
            tensor.fill(k as f32);
        }
        assert_eq!(net.first.hidden, [[1.0; 8]; 8]);
        assert_eq!((net.second.bias, net.output.bias), ([5.0; 8], [7.0; 2]));
        assert_eq!(NET.tensors()[0][3], NET.first.input[1][0]);
    }
}
