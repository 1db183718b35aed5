//! The paper's network and its rivals behind one interface: shapes, first weights, forces,
//! gradients.

use crate::error::NnError;
use crate::heads::{Corrected, Direct, Head, Plane, Sample};
use crate::kernel::simd::{Path, Paths};
use crate::kernel::{Batch, Forward, Net};
use crate::windows::Window;
use nalgebra::convert;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use squirrel_core::rnn::parnn::{HIDDEN, INPUTS, WINDOW};

/// Softplus of this is 1: an untrained paRNN is close to the flat plate.
const SOFTPLUS_ONE: f32 = 0.541_324_85;

/// A model of the force of the air on spread wings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Model {
    /// The paper's: a recurrent network corrects the flat plate (`squirrel_core::rnn::head`).
    Parnn,
    /// The same from the last row alone: what recurrence is worth.
    ParnnWindow1,
    /// The paper's rival: a recurrent network says the force in NED, though it sees speed and angle
    /// of attack only.
    VanillaNed,
    /// It says the force in the body frame.
    VanillaBody,
    /// It says coefficients along the flow in the wing and along its normal: told as much about
    /// direction as paRNN.
    VanillaPlane,
    /// The paper's flat plate; nothing is learned.
    FlatPlate,
    /// The flat plate times one number.
    ScaledFlatPlate,
}

/// What computes the outputs.
enum Kind {
    Network { outputs: usize },
    Scale,
    Nothing,
}

impl Model {
    /// All of them; the first is what ratios are taken to.
    pub const ALL: [Self; 7] = [
        Self::Parnn,
        Self::ParnnWindow1,
        Self::VanillaNed,
        Self::VanillaBody,
        Self::VanillaPlane,
        Self::FlatPlate,
        Self::ScaledFlatPlate,
    ];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Parnn => "parnn",
            Self::ParnnWindow1 => "parnn_window_1",
            Self::VanillaNed => "vanilla",
            Self::VanillaBody => "vanilla_body",
            Self::VanillaPlane => "vanilla_plane",
            Self::FlatPlate => "flat_plate",
            Self::ScaledFlatPlate => "scaled_flat_plate",
        }
    }

    /// The model of this name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|model| model.name() == name)
    }

    /// Rows of a window that it sees; 0 where it looks at the last moment alone, without a network.
    pub fn window(self) -> usize {
        match self {
            Self::ParnnWindow1 => 1,
            Self::FlatPlate | Self::ScaledFlatPlate => 0,
            _ => WINDOW,
        }
    }

    fn kind(self) -> Kind {
        match self {
            Self::Parnn | Self::ParnnWindow1 | Self::VanillaPlane => Kind::Network { outputs: 2 },
            Self::VanillaNed | Self::VanillaBody => Kind::Network { outputs: 3 },
            Self::ScaledFlatPlate => Kind::Scale,
            Self::FlatPlate => Kind::Nothing,
        }
    }

    /// Whether it is trained by gradients.
    pub(crate) fn is_network(self) -> bool {
        matches!(self.kind(), Kind::Network { .. })
    }

    /// Names and shapes of its parameters in their order. Matrices are `[inputs, outputs]`:
    /// `y = x W + b`.
    pub fn tensors(self) -> Vec<(&'static str, Vec<usize>)> {
        match self.kind() {
            Kind::Network { outputs } => vec![
                ("first.input", vec![INPUTS, HIDDEN]),
                ("first.hidden", vec![HIDDEN, HIDDEN]),
                ("first.bias", vec![HIDDEN]),
                ("second.input", vec![HIDDEN, HIDDEN]),
                ("second.hidden", vec![HIDDEN, HIDDEN]),
                ("second.bias", vec![HIDDEN]),
                ("output.weight", vec![HIDDEN, outputs]),
                ("output.bias", vec![outputs]),
            ],
            Kind::Scale => vec![("scale", vec![1])],
            Kind::Nothing => Vec::new(),
        }
    }

    /// Number of its parameters.
    pub fn parameters(self) -> usize {
        self.tensors().iter().map(|(_, shape)| shape.iter().product::<usize>()).sum()
    }

    /// Parameters to start from: weights uniform within `1 / sqrt(8)`, those of the output a tenth
    /// of it, no bias; the outputs of paRNN start at the flat plate.
    pub(crate) fn start(self, seed: u64) -> Vec<f32> {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let bound = 1.0 / (HIDDEN as f32).sqrt();
        let mut parameters = Vec::with_capacity(self.parameters());
        for (name, shape) in self.tensors() {
            let is_bias = shape.len() == 1;
            let bound = match name {
                "output.weight" => 0.1 * bound,
                _ if is_bias => 0.0,
                _ => bound,
            };
            let count = shape.iter().product();
            parameters.extend(std::iter::repeat_with(|| bound * uniform(&mut rng)).take(count));
        }
        if let (Self::Parnn | Self::ParnnWindow1, Some(gamma)) = (self, parameters.last_mut()) {
            *gamma = SOFTPLUS_ONE;
        }
        if let (Kind::Scale, Some(scale)) = (self.kind(), parameters.last_mut()) {
            *scale = 1.0;
        }
        parameters
    }

    /// A window as this model sees it: the force in the frame that it speaks.
    pub(crate) fn sample(self, window: &Window) -> Sample<f32> {
        let target =
            if self == Self::VanillaNed { window.label_ned_n() } else { window.label_body_n };
        Sample::new(window.rows, window.velocity_body_m_s, target)
    }

    /// Forces, N, in the frame that the model speaks.
    pub(crate) fn forces<S: Paths>(
        self,
        path: Path,
        parameters: &[S],
        area_m2: S,
        samples: &[Sample<S>],
    ) -> Vec<[S; 3]> {
        match self {
            Self::Parnn => {
                forces::<S, _, WINDOW, 2>(path, Corrected { area_m2 }, parameters, samples)
            }
            Self::ParnnWindow1 => {
                forces::<S, _, 1, 2>(path, Corrected { area_m2 }, parameters, samples)
            }
            Self::VanillaNed | Self::VanillaBody => {
                forces::<S, _, WINDOW, 3>(path, Direct, parameters, samples)
            }
            Self::VanillaPlane => {
                forces::<S, _, WINDOW, 2>(path, Plane { area_m2 }, parameters, samples)
            }
            Self::FlatPlate | Self::ScaledFlatPlate => {
                let scale = parameters.first().copied().unwrap_or(convert(1.0));
                let along_normal =
                    |s: &Sample<S>| s.flow.impedance(area_m2) * s.flow.normal * scale;
                samples.iter().map(|s| [convert(0.0), convert(0.0), along_normal(s)]).collect()
            }
        }
    }

    /// Mean squared error over some samples, N^2, with its derivative by the parameters; 0 where
    /// the model is no network.
    ///
    /// * `members` - which samples, not empty
    pub(crate) fn gradient<S: Paths>(
        self,
        path: Path,
        parameters: &[S],
        area_m2: S,
        samples: &[Sample<S>],
        members: &[u32],
        gradient: &mut [S],
    ) -> f64 {
        match self {
            Self::Parnn => batch::<S, _, WINDOW, 2>(
                path,
                Corrected { area_m2 },
                parameters,
                samples,
                members,
                gradient,
            ),
            Self::ParnnWindow1 => batch::<S, _, 1, 2>(
                path,
                Corrected { area_m2 },
                parameters,
                samples,
                members,
                gradient,
            ),
            Self::VanillaNed | Self::VanillaBody => {
                batch::<S, _, WINDOW, 3>(path, Direct, parameters, samples, members, gradient)
            }
            Self::VanillaPlane => batch::<S, _, WINDOW, 2>(
                path,
                Plane { area_m2 },
                parameters,
                samples,
                members,
                gradient,
            ),
            Self::FlatPlate | Self::ScaledFlatPlate => 0.0,
        }
    }

    /// The one number of the scaled flat plate, by least squares; 1 where nothing flew.
    pub(crate) fn best_scale(area_m2: f32, samples: &[Sample<f32>]) -> f32 {
        let (mut product, mut square) = (0.0, 0.0);
        for sample in samples {
            let plate = f64::from(sample.flow.impedance(area_m2) * sample.flow.normal);
            product += plate * f64::from(sample.target[2]);
            square += plate * plate;
        }
        if square > 0.0 { (product / square) as f32 } else { 1.0 }
    }
}

impl std::str::FromStr for Model {
    type Err = NnError;

    fn from_str(name: &str) -> Result<Self, NnError> {
        Self::find(name).ok_or_else(|| NnError::Setting {
            field: "model",
            value: name.to_owned(),
            reason: "must be one of parnn, parnn_window_1, vanilla, vanilla_body, vanilla_plane, flat_plate, scaled_flat_plate",
        })
    }
}

impl From<Model> for String {
    fn from(model: Model) -> Self {
        model.name().to_owned()
    }
}

impl TryFrom<String> for Model {
    type Error = NnError;

    fn try_from(name: String) -> Result<Self, NnError> {
        name.parse()
    }
}

/// Uniform in [-1, 1), from the upper 24 bits of a draw; written out so that weights do not depend
/// on a library's version.
fn uniform(rng: &mut Pcg64Mcg) -> f32 {
    use rand::Rng;
    (rng.next_u32() >> 8) as f32 / 8_388_608.0 - 1.0
}

/// Parameters in their order as a network; zero where there are too few.
pub(crate) fn network<S: Paths, const OUT: usize>(parameters: &[S]) -> Net<S, OUT> {
    let mut net = Net::filled(convert(0.0));
    let mut left = parameters.iter();
    for tensor in net.tensors_mut() {
        for (to, from) in tensor.iter_mut().zip(&mut left) {
            *to = *from;
        }
    }
    net
}

fn forces<S: Paths, H: Head<S, OUT>, const STEPS: usize, const OUT: usize>(
    path: Path,
    head: H,
    parameters: &[S],
    samples: &[Sample<S>],
) -> Vec<[S; 3]> {
    let net = network(parameters);
    let outputs = S::run(path, Forward::<_, _, STEPS, OUT> { net: &net, windows: samples });
    outputs
        .iter()
        .zip(samples)
        .map(|(outputs, sample)| head.force(outputs, &sample.flow).force)
        .collect()
}

fn batch<S: Paths, H: Head<S, OUT>, const STEPS: usize, const OUT: usize>(
    path: Path,
    head: H,
    parameters: &[S],
    samples: &[Sample<S>],
    members: &[u32],
    gradient: &mut [S],
) -> f64 {
    let net = network(parameters);
    let (loss, by_net) =
        S::run(path, Batch::<_, _, STEPS, OUT> { net: &net, head, samples, members });
    for (to, from) in gradient.iter_mut().zip(by_net.tensors().into_iter().flatten()) {
        *to = *from;
    }
    loss
}
