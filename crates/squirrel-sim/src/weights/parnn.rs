//! The paper's network from its file, ready to fly.

use super::{Card, Contents, WeightsError};
use squirrel_core::rnn::elman::Elman;
use squirrel_core::rnn::parnn::{HIDDEN, INPUTS, Parnn};
use std::fmt::Write;
use std::path::Path;

/// The only model that flies.
const MODEL: &str = "parnn";
/// Outputs of its network.
const OUTPUTS: usize = 2;
/// Names and shapes in the order of [`Elman::tensors`]; matrices are `[inputs, outputs]`.
const TENSORS: [(&str, &[usize]); 8] = [
    ("first.input", &[INPUTS, HIDDEN]),
    ("first.hidden", &[HIDDEN, HIDDEN]),
    ("first.bias", &[HIDDEN]),
    ("second.input", &[HIDDEN, HIDDEN]),
    ("second.hidden", &[HIDDEN, HIDDEN]),
    ("second.bias", &[HIDDEN]),
    ("output.weight", &[HIDDEN, OUTPUTS]),
    ("output.bias", &[OUTPUTS]),
];

/// A trained paRNN and the bytes of the file that it is from, which a flight log carries along.
#[derive(Debug, Clone, PartialEq)]
pub struct ParnnWeights {
    parnn: Parnn,
    bytes: Vec<u8>,
}

impl ParnnWeights {
    /// Reads a file.
    ///
    /// # Errors
    /// The disk refuses, or as [`ParnnWeights::parse`].
    pub fn load(path: &Path) -> Result<Self, WeightsError> {
        let file = path.display().to_string();
        match squirrel_log::files::read(path) {
            Ok(bytes) => Self::parse(&file, bytes),
            Err(error) => Err(WeightsError::Io { file, error }),
        }
    }

    /// Of the bytes of a file.
    ///
    /// * `file` - what errors call it
    ///
    /// # Errors
    /// One line that names the file, and the tensor or the field with its value: not a safetensors
    /// file, another model, a tensor that is missing, unknown, of another shape or not finite,
    /// metadata that does not fit the flight code.
    pub fn parse(file: &str, bytes: Vec<u8>) -> Result<Self, WeightsError> {
        let mut contents = Contents::parse(file.to_owned(), &bytes)?;
        let card: Card<String> = contents.record()?;
        if card.model != MODEL {
            let reason = format!("of all models only \"{MODEL}\" flies");
            return Err(contents.field("model", &card.model, &reason));
        }
        card.check(&contents)?;
        let mut net = Elman::<INPUTS, HIDDEN, OUTPUTS>::filled(0.0);
        for (tensor, (name, shape)) in net.tensors_mut().into_iter().zip(TENSORS) {
            tensor.copy_from_slice(&contents.take(name, shape)?);
        }
        contents.finish()?;
        let parnn = Parnn { net, area_m2: card.area_m2, domain: card.domain };
        parnn
            .check()
            .map_err(|problem| WeightsError::Parameter { file: file.to_owned(), problem })?;
        Ok(Self { parnn, bytes })
    }

    /// What flies.
    pub fn parnn(&self) -> &Parnn {
        &self.parnn
    }

    /// The file as text, two hexadecimal digits a byte.
    pub fn to_hex(&self) -> String {
        let mut text = String::with_capacity(2 * self.bytes.len());
        for byte in &self.bytes {
            let _ = write!(text, "{byte:02x}");
        }
        text
    }

    /// Of what [`ParnnWeights::to_hex`] made.
    ///
    /// * `file` - what errors call it
    ///
    /// # Errors
    /// Not two hexadecimal digits a byte, or as [`ParnnWeights::parse`].
    pub fn from_hex(file: &str, text: &str) -> Result<Self, WeightsError> {
        let digit = |c: u8| char::from(c).to_digit(16).and_then(|d| u8::try_from(d).ok());
        let (pairs, rest) = text.as_bytes().as_chunks::<2>();
        let bytes: Option<Vec<u8>> =
            pairs.iter().map(|[high, low]| Some(16 * digit(*high)? + digit(*low)?)).collect();
        match bytes {
            Some(bytes) if rest.is_empty() => Self::parse(file, bytes),
            _ => Err(WeightsError::Format {
                file: file.to_owned(),
                problem: "must be two hexadecimal digits a byte".to_owned(),
            }),
        }
    }
}
