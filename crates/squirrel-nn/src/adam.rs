//! Adam (Kingma and Ba 2015) with clipping of the gradient and a rate that falls along a cosine.

use serde::{Deserialize, Serialize};

const MEAN_DECAY: f64 = 0.9;
const SQUARE_DECAY: f64 = 0.999;
const EPSILON: f32 = 1e-8;

/// What the optimiser remembers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Adam {
    /// Decaying mean of the gradient.
    pub(crate) mean: Vec<f32>,
    /// Decaying mean of its square.
    pub(crate) square: Vec<f32>,
    pub(crate) decay: Decay,
}

/// How much of the first zeros is left in the means; products of the decays, because powers differ
/// between platforms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Decay {
    pub(crate) mean: f64,
    pub(crate) square: f64,
}

impl Adam {
    pub(crate) fn new(parameters: usize) -> Self {
        Self {
            mean: vec![0.0; parameters],
            square: vec![0.0; parameters],
            decay: Decay { mean: 1.0, square: 1.0 },
        }
    }

    /// One step down the gradient.
    pub(crate) fn step(&mut self, parameters: &mut [f32], gradient: &[f32], rate: f64) {
        self.decay.mean *= MEAN_DECAY;
        self.decay.square *= SQUARE_DECAY;
        let rate = (rate / (1.0 - self.decay.mean)) as f32;
        let correction = (1.0 / (1.0 - self.decay.square)) as f32;
        let (keep_mean, keep_square) = (MEAN_DECAY as f32, SQUARE_DECAY as f32);
        let (take_mean, take_square) = ((1.0 - MEAN_DECAY) as f32, (1.0 - SQUARE_DECAY) as f32);
        let memory = self.mean.iter_mut().zip(&mut self.square);
        for ((parameter, slope), (mean, square)) in parameters.iter_mut().zip(gradient).zip(memory)
        {
            *mean = keep_mean * *mean + take_mean * slope;
            *square = keep_square * *square + take_square * (slope * slope);
            *parameter -= rate * *mean / ((correction * *square).sqrt() + EPSILON);
        }
    }
}

/// Shortens a gradient to this length where it is longer.
pub(crate) fn clip(gradient: &mut [f32], longest: f64) {
    let square: f64 = gradient.iter().map(|g| f64::from(*g) * f64::from(*g)).sum();
    if square > longest * longest {
        let scale = (longest / square.sqrt()) as f32;
        for g in gradient {
            *g *= scale;
        }
    }
}

/// From `rate` at the first step to 0 after the last.
pub(crate) fn cosine(rate: f64, step: u64, steps: u64) -> f64 {
    let done = step as f64 / steps.max(1) as f64;
    0.5 * rate * (1.0 + libm::cos(core::f64::consts::PI * done))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_has_the_length_of_the_rate() {
        let (mut adam, mut parameters) = (Adam::new(2), [1.0, -2.0]);
        adam.step(&mut parameters, &[0.5, -1e-3], 0.01);
        assert!(
            (parameters[0] - 0.99).abs() < 1e-6 && (parameters[1] + 1.99).abs() < 1e-6,
            "{parameters:?}"
        );
    }

    #[test]
    fn it_finds_the_bottom_of_a_bowl() {
        let (mut adam, mut parameters) = (Adam::new(2), [3.0_f32, -1.0]);
        for step in 0..2000 {
            let slope = [2.0 * (parameters[0] - 0.5), 20.0 * (parameters[1] - 0.25)];
            adam.step(&mut parameters, &slope, cosine(0.05, step, 2000));
        }
        assert!(
            (parameters[0] - 0.5).abs() < 1e-3 && (parameters[1] - 0.25).abs() < 1e-3,
            "{parameters:?}"
        );
    }

    #[test]
    fn clipping_keeps_the_direction() {
        let mut gradient = [30.0, 40.0];
        clip(&mut gradient, 5.0);
        assert!((gradient[0] - 3.0).abs() < 1e-6 && (gradient[1] - 4.0).abs() < 1e-6);
        let mut short = [0.3, 0.4];
        clip(&mut short, 5.0);
        assert_eq!(short, [0.3, 0.4]);
    }

    #[test]
    fn the_rate_falls_to_nothing() {
        assert_eq!(cosine(0.2, 0, 10), 0.2);
        assert!((cosine(0.2, 5, 10) - 0.1).abs() < 1e-15 && cosine(0.2, 10, 10) < 1e-15);
    }
}
