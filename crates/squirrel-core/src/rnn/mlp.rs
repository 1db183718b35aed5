//! A network without memory: two layers of tanh neurons and a linear output.

use super::elman::Dense;
use crate::lane::Lane;

/// Two layers of tanh neurons and a linear output. Plain data, so that weights can be a `const`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mlp<const IN: usize, const HIDDEN: usize, const OUT: usize, T = f32> {
    /// The layer that sees the input.
    pub first: Dense<IN, HIDDEN, T>,
    /// The layer that sees the first.
    pub second: Dense<HIDDEN, HIDDEN, T>,
    /// Reads the second layer.
    pub output: Dense<HIDDEN, OUT, T>,
}

impl<const IN: usize, const HIDDEN: usize, const OUT: usize, T: Copy> Mlp<IN, HIDDEN, OUT, T> {
    /// All parameters equal.
    pub const fn filled(value: T) -> Self {
        Self {
            first: Dense { weight: [[value; HIDDEN]; IN], bias: [value; HIDDEN] },
            second: Dense { weight: [[value; HIDDEN]; HIDDEN], bias: [value; HIDDEN] },
            output: Dense { weight: [[value; OUT]; HIDDEN], bias: [value; OUT] },
        }
    }

    /// The parameters tensor by tensor: weight and bias of the first layer, of the second, of the
    /// output. Matrices row by row, a row an input.
    pub const fn tensors(&self) -> [&[T]; 6] {
        let Self { first, second, output } = self;
        [
            first.weight.as_flattened(),
            &first.bias,
            second.weight.as_flattened(),
            &second.bias,
            output.weight.as_flattened(),
            &output.bias,
        ]
    }

    /// As [`Mlp::tensors`], to write to.
    pub const fn tensors_mut(&mut self) -> [&mut [T]; 6] {
        let Self { first, second, output } = self;
        [
            first.weight.as_flattened_mut(),
            &mut first.bias,
            second.weight.as_flattened_mut(),
            &mut second.bias,
            output.weight.as_flattened_mut(),
            &mut output.bias,
        ]
    }

    /// The output for these inputs.
    #[inline(always)]
    pub fn evaluate<L: Lane<Element = T>>(&self, inputs: &[L; IN]) -> [L; OUT] {
        self.output.evaluate(&self.second.neurons(&self.first.neurons(inputs)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rnn::elman::{Elman, Recurrent};

    /// A recurrent network that remembers nothing is this one.
    #[test]
    fn it_is_the_recurrent_network_after_one_step() {
        const MLP: Mlp<2, 2, 2> = Mlp {
            first: Dense { weight: [[0.3, -0.7], [1.1, 0.2]], bias: [0.1, -0.3] },
            second: Dense { weight: [[-0.6, 0.4], [0.9, 0.8]], bias: [0.2, 0.05] },
            output: Dense { weight: [[2.0, -1.0], [0.5, 1.5]], bias: [-0.1, 0.6] },
        };
        let recurrent = |layer: Dense<2, 2>| Recurrent {
            input: layer.weight,
            hidden: [[5.0; 2]; 2],
            bias: layer.bias,
        };
        let elman = Elman {
            first: recurrent(MLP.first),
            second: recurrent(MLP.second),
            output: MLP.output,
        };
        let inputs = [0.4_f32, -1.3];
        assert_eq!(MLP.evaluate(&inputs), elman.window(&[inputs]));
        assert_ne!(MLP.evaluate(&inputs), MLP.evaluate(&[0.5, -1.3]));
    }

    #[test]
    fn tensors_are_all_parameters_once() {
        let mut net = Mlp::<3, 8, 2>::filled(0.0);
        assert_eq!(net.tensors().map(<[f32]>::len), [24, 8, 64, 8, 16, 2]);
        for (k, tensor) in net.tensors_mut().into_iter().enumerate() {
            tensor.fill(k as f32);
        }
        assert_eq!((net.first.weight[2], net.second.bias), ([0.0; 8], [3.0; 8]));
        assert_eq!((net.second.weight[7], net.output.bias), ([2.0; 8], [5.0; 2]));
    }
}
