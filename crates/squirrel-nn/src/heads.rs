//! From the outputs of a network to a force, with derivatives: what the models differ in.
//!
//! A head is evaluated one window at a time, in the scalar code of `squirrel-core`, so that a force
//! in training has the bits of the force in flight; against ten steps of two layers this costs
//! little.

use nalgebra::{Vector3, convert};
use squirrel_core::frames::In;
use squirrel_core::math::Real;
use squirrel_core::rnn::head::{Correction, Flow, TurnedNormal};
use squirrel_core::rnn::parnn::{INPUTS, WINDOW};

/// A window as a model sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample<S> {
    /// What the network sees, oldest first.
    pub(crate) rows: [[S; INPUTS]; WINDOW],
    /// The flow at the last row.
    pub(crate) flow: Flow<S>,
    /// The force at the last row, N, in the frame of the model.
    pub(crate) target: [S; 3],
}

impl<S> AsRef<[[S; INPUTS]]> for Sample<S> {
    fn as_ref(&self) -> &[[S; INPUTS]] {
        &self.rows
    }
}

impl<S: Real> Sample<S> {
    /// * `velocity_body_m_s` - relative to the air, at the last row
    pub(crate) fn new(
        rows: [[S; INPUTS]; WINDOW],
        velocity_body_m_s: [S; 3],
        target: [S; 3],
    ) -> Self {
        Self { rows, flow: Flow::new(In::new(Vector3::from(velocity_body_m_s))), target }
    }
}

/// A force in the frame of the model, N, and its derivative by each output.
pub(crate) struct Force<S, const OUT: usize> {
    pub(crate) force: [S; 3],
    pub(crate) by_output: [[S; 3]; OUT],
}

/// What makes a force of the outputs of a network.
pub(crate) trait Head<S: Real, const OUT: usize>: Copy {
    /// Force and derivatives.
    fn force(self, outputs: &[S; OUT], flow: &Flow<S>) -> Force<S, OUT>;

    /// Squared distance to the target, N^2, and half of its derivative by each output.
    fn loss(self, outputs: &[S; OUT], sample: &Sample<S>) -> (f64, [S; OUT]) {
        let Force { force, by_output } = self.force(outputs, &sample.flow);
        let dot = |a: &[S; 3], b: &[S; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let error = [0, 1, 2].map(|axis| force[axis] - sample.target[axis]);
        let squared = nalgebra::try_convert::<S, f64>(dot(&error, &error)).unwrap_or(f64::NAN);
        (squared, by_output.map(|by| dot(&by, &error)))
    }
}

/// The outputs are the force, N.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Direct;

impl<S: Real> Head<S, 3> for Direct {
    #[inline]
    fn force(self, outputs: &[S; 3], _: &Flow<S>) -> Force<S, 3> {
        let (one, zero) = (convert(1.0), convert(0.0));
        Force {
            force: *outputs,
            by_output: [[one, zero, zero], [zero, one, zero], [zero, zero, one]],
        }
    }
}

/// The outputs are coefficients along the wing and along its normal:
/// `f = -rho A |v|^2 (y0 e_t + y1 n)`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane<S> {
    pub(crate) area_m2: S,
}

impl<S: Real> Head<S, 2> for Plane<S> {
    #[inline]
    fn force(self, outputs: &[S; 2], flow: &Flow<S>) -> Force<S, 2> {
        let size = flow.impedance(self.area_m2) * flow.speed;
        let body = |along: S, normal: S| flow.body(along, normal).vector.into();
        Force {
            force: body(size * outputs[0], size * outputs[1]),
            by_output: [body(size, convert(0.0)), body(convert(0.0), size)],
        }
    }
}

/// The outputs correct the flat plate, `squirrel_core::rnn::head`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Corrected<S> {
    pub(crate) area_m2: S,
}

impl<S: Real> Head<S, 2> for Corrected<S> {
    /// With `f = -Q |v| sin(alpha_est) gamma n_f`: by `gamma` it is `f / gamma`; by `alpha_w` it is
    /// `-Q gamma |v| (cos(alpha_est) n_f + sin(alpha_est) (cos(beta) e_t - sin(beta) n))`, and 0
    /// where clipped.
    #[inline]
    fn force(self, outputs: &[S; 2], flow: &Flow<S>) -> Force<S, 2> {
        let (one, zero) = (convert::<f64, S>(1.0), convert(0.0));
        let correction = Correction::from_outputs(*outputs);
        let turned = TurnedNormal::new(flow, correction.alpha_w_rad);
        let [along, normal] = turned.direction;
        let plate = flow.impedance(self.area_m2) * turned.sine_m_s;
        let size = plate * correction.gamma;
        let body = |along: S, normal: S| flow.body(along, normal).vector.into();

        let share = outputs[0].activation();
        let alpha_by_output = S::frac_pi_2() * (one - share * share);
        let by_alpha = if turned.clipped {
            [zero; 3]
        } else {
            let swing = flow.impedance(self.area_m2) * correction.gamma * alpha_by_output;
            let (cosine, sine) = (turned.cosine_m_s, turned.sine_m_s);
            body(swing * (cosine * along + sine * normal), swing * (cosine * normal - sine * along))
        };
        // The logistic function, by an exponential that cannot overflow.
        let small = (-outputs[1].abs()).exp();
        let logistic = if outputs[1] < zero { small / (one + small) } else { one / (one + small) };
        let by_gamma = plate * logistic;
        Force {
            force: body(size * along, size * normal),
            by_output: [by_alpha, body(by_gamma * along, by_gamma * normal)],
        }
    }
}
