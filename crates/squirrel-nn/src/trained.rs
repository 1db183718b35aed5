//! A trained model: forces for windows, and the file that it lives in.

use crate::error::NnError;
use crate::heads::Sample;
use crate::kernel::simd;
use crate::model::{Model, network};
use crate::tensors::{self, Contents, Tensor};
use crate::windows::{Window, Windows};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use squirrel_core::rnn::parnn::{Parnn, SPEED_SCALE_M_S, WINDOW};
use std::collections::BTreeMap;
use std::path::Path;

/// Of the metadata; counts up when a field changes its meaning.
const FORMAT: u32 = 1;

/// What the inputs are in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Normalisation {
    /// The first input is speed over this, m/s. The second is the angle of attack in rad, as it is.
    pub speed_scale_m_s: f32,
    /// Rows of a window of the data, 10 a second.
    pub rows: usize,
}

/// What was flown in training; beyond it a network guesses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// Lowest and highest speed, m/s.
    pub speed_m_s: [f32; 2],
    /// Lowest and highest angle of attack, rad.
    pub alpha_rad: [f32; 2],
}

impl Domain {
    /// Of all rows of some windows; zero if there are none.
    pub(crate) fn of(windows: &[Window]) -> Self {
        let mut ranges: Option<[[f32; 2]; 2]> = None;
        for row in windows.iter().flat_map(|window| &window.rows) {
            let ranges = ranges.get_or_insert([[row[0]; 2], [row[1]; 2]]);
            for (range, x) in ranges.iter_mut().zip(row) {
                *range = [range[0].min(*x), range[1].max(*x)];
            }
        }
        let [speed, alpha_rad] = ranges.unwrap_or_default();
        Self { speed_m_s: speed.map(|s| s * SPEED_SCALE_M_S), alpha_rad }
    }
}

/// Where weights come from: the metadata of their file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Card {
    format: u32,
    /// What the weights are of.
    pub model: Model,
    /// Name of the vehicle that flew.
    pub vehicle: String,
    /// Area of the flat plate, m^2.
    pub area_m2: f32,
    /// What the inputs are in.
    pub normalisation: Normalisation,
    /// What was flown in training.
    pub domain: Domain,
    /// [`Windows::hash`] of what it was trained on, hexadecimal.
    pub data_hash: String,
    /// Of first weights and order of windows.
    pub seed: u64,
    /// What came of it, by name with unit; finite.
    pub figures: BTreeMap<String, f64>,
}

impl Card {
    pub(crate) fn new(model: Model, vehicle: &str, area_m2: f32, data: &Windows, seed: u64) -> Self {
        Self {
            format: FORMAT,
            model,
            vehicle: vehicle.to_owned(),
            area_m2,
            normalisation: Normalisation { speed_scale_m_s: SPEED_SCALE_M_S, rows: WINDOW },
            domain: Domain::of(data.all()),
            data_hash: hash_text(data.hash()),
            seed,
            figures: BTreeMap::new(),
        }
    }

    /// The code can do what the card says.
    pub(crate) fn check(&self, contents: &Contents) -> Result<(), NnError> {
        let scale = self.normalisation.speed_scale_m_s;
        if self.format != FORMAT {
            return Err(contents.field("format", &self.format, &format!("this version reads {FORMAT}")));
        }
        if scale.to_bits() != SPEED_SCALE_M_S.to_bits() {
            let reason = format!("the flight code divides by {SPEED_SCALE_M_S}");
            return Err(contents.field("normalisation.speed_scale_m_s", &scale, &reason));
        }
        if self.normalisation.rows != WINDOW {
            let reason = format!("the flight code keeps {WINDOW}");
            return Err(contents.field("normalisation.rows", &self.normalisation.rows, &reason));
        }
        if !(self.area_m2 > 0.0 && self.area_m2.is_finite()) {
            return Err(contents.field("area_m2", &self.area_m2, "must be positive"));
        }
        Ok(())
    }
}

/// A model with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Trained {
    /// Where it comes from. Figures may be added.
    pub card: Card,
    pub(crate) parameters: Vec<f32>,
}

impl Trained {
    /// All parameters in the order of [`Model::tensors`].
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// Force of the air on the wings at the end of each window, N, body frame.
    pub fn forces_body_n(&self, windows: &[Window]) -> Vec<[f32; 3]> {
        let model = self.card.model;
        let samples: Vec<Sample<f32>> = windows.iter().map(|window| model.sample(window)).collect();
        let mut forces = model.forces(simd::Path::best(), &self.parameters, self.card.area_m2, &samples);
        if model == Model::VanillaNed {
            for (force, window) in forces.iter_mut().zip(windows) {
                *force = (window.ned_from_body().inverse() * Vector3::from(*force)).into();
            }
        }
        forces
    }

    /// What flies, where the model is paRNN: to be asked with the last [`Model::window`] rows.
    pub fn parnn(&self) -> Option<Parnn> {
        matches!(self.card.model, Model::Parnn | Model::ParnnWindow1)
            .then(|| Parnn { net: network(&self.parameters), area_m2: self.card.area_m2 })
    }

    /// Writes a safetensors file: tensors by [`Model::tensors`], the card as JSON in the metadata record `squirrel`. Equal
    /// models give equal bytes. The file appears under its name only when it is whole.
    ///
    /// # Errors
    /// A parameter or figure is not finite, or the disk refuses.
    pub fn save(&self, path: &Path) -> Result<(), NnError> {
        if let Some((name, value)) = self.card.figures.iter().find(|(_, value)| !value.is_finite()) {
            return Err(NnError::Field {
                file: path.display().to_string(),
                field: "figures",
                value: format!("{name}: {value}"),
                reason: "must be finite".to_owned(),
            });
        }
        tensors::write(path, &self.card, &named(self.card.model, "", &self.parameters))
    }

    /// Reads what [`Trained::save`] wrote.
    ///
    /// # Errors
    /// Not such a file, a tensor is missing, unknown, of another shape or not finite, or the card does not fit the flight code.
    pub fn load(path: &Path) -> Result<Self, NnError> {
        let mut contents = Contents::read(path)?;
        let card: Card = contents.record()?;
        card.check(&contents)?;
        let parameters = take_named(&mut contents, card.model, "")?;
        contents.finish()?;
        Ok(Self { card, parameters })
    }
}

/// As files hold it.
pub(crate) fn hash_text(hash: u64) -> String {
    format!("{hash:016x}")
}

/// Parameters as tensors, their names behind a prefix.
pub(crate) fn named<'a>(model: Model, prefix: &str, parameters: &'a [f32]) -> Vec<Tensor<'a>> {
    let mut left = parameters;
    let mut tensors = Vec::new();
    for (name, shape) in model.tensors() {
        let (numbers, rest) = left.split_at(shape.iter().product());
        tensors.push(Tensor { name: format!("{prefix}{name}"), shape, numbers });
        left = rest;
    }
    tensors
}

/// The other way.
pub(crate) fn take_named(contents: &mut Contents, model: Model, prefix: &str) -> Result<Vec<f32>, NnError> {
    let mut parameters = Vec::with_capacity(model.parameters());
    for (name, shape) in model.tensors() {
        parameters.extend(contents.take(&format!("{prefix}{name}"), &shape)?);
    }
    Ok(parameters)
}

/// Root mean square of force errors, N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceError {
    /// Of the length of the difference: `sqrt(mean |e|^2)`.
    pub rms_n: f64,
    /// Of each body axis.
    pub axis_rms_n: [f64; 3],
}

impl ForceError {
    /// Between forces and what they should be, pairwise; zero if there are none.
    pub fn of(forces_body_n: &[[f32; 3]], reference_body_n: &[[f32; 3]]) -> Self {
        let mut square = [0.0; 3];
        for (force, reference) in forces_body_n.iter().zip(reference_body_n) {
            for axis in 0..3 {
                square[axis] += (f64::from(force[axis]) - f64::from(reference[axis])).powi(2);
            }
        }
        let count = forces_body_n.len().min(reference_body_n.len()).max(1) as f64;
        let root = |sum: f64| (sum / count).sqrt();
        Self { rms_n: root(square.iter().sum()), axis_rms_n: square.map(root) }
    }
}
