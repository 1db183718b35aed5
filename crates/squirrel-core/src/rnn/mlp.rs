//! A network without memory: two layers of tanh neurons and a linear output.

use super::elman::Dense;
use super::lane::Lane;

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
    /// The output for these inputs.
    #[inline(always)]
    pub fn evaluate<L: Lane<Weight = T>>(&self, inputs: &[L; IN]) -> [L; OUT] {
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
        let recurrent =
            |layer: Dense<2, 2>| Recurrent { input: layer.weight, hidden: [[5.0; 2]; 2], bias: layer.bias };
        let elman = Elman { first: recurrent(MLP.first), second: recurrent(MLP.second), output: MLP.output };
        let inputs = [0.4_f32, -1.3];
        assert_eq!(MLP.evaluate(&inputs), elman.window(&[inputs]));
        assert_ne!(MLP.evaluate(&inputs), MLP.evaluate(&[0.5, -1.3]));
    }
}
