//! A trained model: forces for windows, and the file that it lives in.

use crate::error::NnError;
use crate::heads::Sample;
use crate::kernel::simd;
use crate::model::{Model, network};
use crate::windows::{Window, Windows};
use nalgebra::Vector3;
use squirrel_core::rnn::parnn::{Domain, Parnn, SPEED_SCALE_M_S};
use squirrel_sim::weights::{self, Contents, Tensor, TrainedOn, WeightsError};
use std::path::Path;

/// Where weights come from: the metadata of their file.
pub type Card = weights::Card<Model>;

impl From<&Windows> for TrainedOn {
    fn from(windows: &Windows) -> Self {
        Self { domain: domain(windows.all()), data_hash: hash_text(windows.hash()) }
    }
}

/// Of all rows of some windows; zero if there are none.
fn domain(windows: &[Window]) -> Domain {
    let mut ranges: Option<[[f32; 2]; 2]> = None;
    for row in windows.iter().flat_map(|window| &window.rows) {
        let ranges = ranges.get_or_insert([[row[0]; 2], [row[1]; 2]]);
        for (range, x) in ranges.iter_mut().zip(row) {
            *range = [range[0].min(*x), range[1].max(*x)];
        }
    }
    let [speed, alpha_rad] = ranges.unwrap_or_default();
    Domain { speed_m_s: speed.map(|s| s * SPEED_SCALE_M_S), alpha_rad }
}

/// A model with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Trained {
    /// Where it comes from. Figures may be added.
    pub card: Card,
    pub(crate) parameters: Vec<f32>,
}

impl Trained {
    /// A model of parts that were kept.
    ///
    /// # Errors
    /// Another number of parameters than the model has, or one that is not finite.
    pub fn of(card: Card, parameters: Vec<f32>) -> Result<Self, NnError> {
        let blank = Self { parameters: vec![0.0; card.model.parameters()], card };
        blank.with_parameters(parameters)
    }

    /// All parameters in the order of [`Model::tensors`].
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// The same model with other parameters, as somebody else trained them.
    ///
    /// # Errors
    /// Another number of parameters than the model has, or one that is not finite.
    pub fn with_parameters(&self, parameters: Vec<f32>) -> Result<Self, NnError> {
        let refuse =
            |value: String, reason| Err(NnError::Setting { field: "parameters", value, reason });
        if parameters.len() != self.parameters.len() {
            return refuse(
                format!("{} numbers", parameters.len()),
                "must be as many as the model has",
            );
        }
        if let Some(number) = parameters.iter().find(|number| !number.is_finite()) {
            return refuse(number.to_string(), "must be finite");
        }
        Ok(Self { card: self.card.clone(), parameters })
    }

    /// Force of the air on the wings at the end of each window, N, body frame.
    pub fn forces_body_n(&self, windows: &[Window]) -> Vec<[f32; 3]> {
        let model = self.card.model;
        let samples: Vec<Sample<f32>> = windows.iter().map(|window| model.sample(window)).collect();
        let mut forces =
            model.forces(simd::Path::best(), &self.parameters, self.card.area_m2, &samples);
        if model == Model::VanillaNed {
            for (force, window) in forces.iter_mut().zip(windows) {
                *force = (window.ned_from_body().inverse() * Vector3::from(*force)).into();
            }
        }
        forces
    }

    /// What flies, where the model is paRNN: to be asked with the last [`Model::window`] rows.
    pub fn parnn(&self) -> Option<Parnn> {
        let Card { area_m2, domain, .. } = self.card;
        matches!(self.card.model, Model::Parnn | Model::ParnnWindow1).then(|| Parnn {
            net: network(&self.parameters),
            area_m2,
            domain,
        })
    }

    /// Writes a safetensors file: tensors by [`Model::tensors`], the card as JSON in the metadata
    /// record `squirrel`. Equal models give equal bytes. The file appears under its name only when
    /// it is whole.
    ///
    /// # Errors
    /// A parameter or figure is not finite, or the disk refuses.
    pub fn save(&self, path: &Path) -> Result<(), NnError> {
        if let Some((name, value)) = self.card.figures.iter().find(|(_, value)| !value.is_finite())
        {
            let (file, value) = (path.display().to_string(), format!("{name}: {value}"));
            let reason = "must be finite".to_owned();
            return Err(WeightsError::Field { file, field: "figures", value, reason }.into());
        }
        Ok(weights::write(path, &self.card, &named(self.card.model, "", &self.parameters))?)
    }

    /// Reads what [`Trained::save`] wrote.
    ///
    /// # Errors
    /// Not such a file, a tensor is missing, unknown, of another shape or not finite, or the card
    /// does not fit the flight code.
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
pub(crate) fn take_named(
    contents: &mut Contents,
    model: Model,
    prefix: &str,
) -> Result<Vec<f32>, WeightsError> {
    let mut parameters = Vec::with_capacity(model.parameters());
    for (name, shape) in model.tensors() {
        parameters.extend(contents.take(&format!("{prefix}{name}"), &shape)?);
    }
    Ok(parameters)
}

/// Root mean square of force errors, N.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
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
