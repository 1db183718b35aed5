//! A safetensors file in memory.

use super::WeightsError;
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;

/// Key of the metadata record. There is one only, because the format keeps metadata in a hash map:
/// several would stand in another order in every file.
pub const RECORD: &str = "squirrel";

/// Tensors and the metadata record of a file. Tensors are taken out one by one; what is left at the
/// end does not belong.
#[derive(Debug)]
pub struct Contents {
    file: String,
    text: String,
    tensors: BTreeMap<String, (Vec<usize>, Vec<f32>)>,
}

impl Contents {
    /// Reads a file.
    ///
    /// # Errors
    /// The disk refuses, or as [`Contents::parse`].
    pub fn read(path: &Path) -> Result<Self, WeightsError> {
        let file = path.display().to_string();
        let bytes = squirrel_log::files::read(path)
            .map_err(|error| WeightsError::Io { file: file.clone(), error })?;
        Self::parse(file, &bytes)
    }

    /// Of the bytes of a file.
    ///
    /// * `file` - what errors call it
    ///
    /// # Errors
    /// Not a whole file, no metadata record, numbers of another type than `f32` or not finite.
    pub fn parse(file: String, bytes: &[u8]) -> Result<Self, WeightsError> {
        let format = |e: safetensors::SafeTensorError| WeightsError::Format {
            file: file.clone(),
            problem: e.to_string(),
        };
        let parsed = SafeTensors::deserialize(bytes).map_err(format)?;
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(format)?;
        let text = header.metadata().as_ref().and_then(|records| records.get(RECORD)).cloned();
        let text = text.ok_or_else(|| WeightsError::Metadata {
            file: file.clone(),
            problem: "missing".to_owned(),
        })?;
        // Sorted, so that of several problems the same is named every time.
        let views: BTreeMap<String, TensorView<'_>> = parsed.tensors().into_iter().collect();
        let mut tensors = BTreeMap::new();
        for (tensor, view) in views {
            if view.dtype() != Dtype::F32 {
                return Err(WeightsError::Type {
                    file,
                    tensor,
                    found: format!("{:?}", view.dtype()),
                });
            }
            let numbers = view
                .data()
                .as_chunks()
                .0
                .iter()
                .map(|b| f32::from_le_bytes(*b))
                .collect::<Vec<_>>();
            if let Some(index) = numbers.iter().position(|x| !x.is_finite()) {
                let value = numbers[index];
                return Err(WeightsError::NotFinite { file, tensor, index, value });
            }
            tensors.insert(tensor, (view.shape().to_vec(), numbers));
        }
        Ok(Self { file, text, tensors })
    }

    /// What errors call the file.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The metadata record.
    ///
    /// # Errors
    /// A field is missing, unknown or of another type.
    pub fn record<R: DeserializeOwned>(&self) -> Result<R, WeightsError> {
        serde_json::from_str(&self.text)
            .map_err(|e| WeightsError::Metadata { file: self.file.clone(), problem: e.to_string() })
    }

    /// Takes a tensor of this shape; its numbers row by row.
    ///
    /// # Errors
    /// It is not there, or of another shape.
    pub fn take(&mut self, tensor: &str, needed: &[usize]) -> Result<Vec<f32>, WeightsError> {
        let (file, tensor) = (self.file.clone(), tensor.to_owned());
        let Some((found, numbers)) = self.tensors.remove(&tensor) else {
            return Err(WeightsError::Missing { file, tensor });
        };
        if found != needed {
            return Err(WeightsError::Shape { file, tensor, found, needed: needed.to_vec() });
        }
        Ok(numbers)
    }

    /// All tensors have been taken.
    ///
    /// # Errors
    /// Names the first that has not.
    pub fn finish(self) -> Result<(), WeightsError> {
        match self.tensors.into_keys().next() {
            Some(tensor) => Err(WeightsError::Unknown { file: self.file, tensor }),
            None => Ok(()),
        }
    }

    /// A field of the record that cannot be.
    pub fn field(&self, field: &'static str, value: &dyn Display, reason: &str) -> WeightsError {
        let (value, reason) = (value.to_string(), reason.to_owned());
        WeightsError::Field { file: self.file.clone(), field, value, reason }
    }
}
