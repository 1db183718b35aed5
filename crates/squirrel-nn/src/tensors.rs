//! Safetensors files of `f32` with one metadata record, the JSON text `squirrel`.
//!
//! One record, because the format keeps metadata in a hash map: several would stand in another order in every file.

use crate::error::NnError;
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;

const RECORD: &str = "squirrel";

/// A named tensor to write.
pub(crate) struct Tensor<'a> {
    pub(crate) name: String,
    pub(crate) shape: Vec<usize>,
    pub(crate) numbers: &'a [f32],
}

/// Writes a file, under a temporary name first.
pub(crate) fn write(path: &Path, record: &impl Serialize, tensors: &[Tensor<'_>]) -> Result<(), NnError> {
    let file = path.display().to_string();
    let format = |problem: String| NnError::Format { file: path.display().to_string(), problem };
    let text = serde_json::to_string(record)
        .map_err(|e| NnError::Metadata { file: file.clone(), problem: e.to_string() })?;
    let bytes: Vec<Vec<u8>> =
        tensors.iter().map(|t| t.numbers.iter().flat_map(|x| x.to_le_bytes()).collect()).collect();
    let mut views = Vec::with_capacity(tensors.len());
    for (tensor, bytes) in tensors.iter().zip(&bytes) {
        if let Some(index) = tensor.numbers.iter().position(|x| !x.is_finite()) {
            let (tensor, value) = (tensor.name.clone(), tensor.numbers[index]);
            return Err(NnError::NotFinite { file, tensor, index, value });
        }
        let view = TensorView::new(Dtype::F32, tensor.shape.clone(), bytes);
        views.push((tensor.name.as_str(), view.map_err(|e| format(e.to_string()))?));
    }
    let metadata = [(RECORD.to_owned(), text)].into_iter().collect();
    let content = safetensors::serialize(views, Some(metadata)).map_err(|e| format(e.to_string()))?;

    let mut unfinished = path.as_os_str().to_owned();
    unfinished.push(".unfinished");
    let written = std::fs::write(&unfinished, content).and_then(|()| std::fs::rename(&unfinished, path));
    written.map_err(|error| {
        // Nothing half-written stays behind; that the removal may fail too adds nothing to the first error.
        let _ = std::fs::remove_file(&unfinished);
        NnError::Io { file, error }
    })
}

/// A file in memory. Tensors are taken out one by one; what is left at the end does not belong.
#[derive(Debug)]
pub(crate) struct Contents {
    pub(crate) file: String,
    text: String,
    tensors: BTreeMap<String, (Vec<usize>, Vec<f32>)>,
}

impl Contents {
    /// Reads a file.
    pub(crate) fn read(path: &Path) -> Result<Self, NnError> {
        let file = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|error| NnError::Io { file: file.clone(), error })?;
        Self::parse(file, &bytes)
    }

    fn parse(file: String, bytes: &[u8]) -> Result<Self, NnError> {
        let format =
            |e: safetensors::SafeTensorError| NnError::Format { file: file.clone(), problem: e.to_string() };
        let parsed = SafeTensors::deserialize(bytes).map_err(format)?;
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(format)?;
        let text = header.metadata().as_ref().and_then(|records| records.get(RECORD)).cloned();
        let text =
            text.ok_or_else(|| NnError::Metadata { file: file.clone(), problem: "missing".to_owned() })?;
        // Sorted, so that of several problems the same is named every time.
        let views: BTreeMap<String, TensorView<'_>> = parsed.tensors().into_iter().collect();
        let mut tensors = BTreeMap::new();
        for (tensor, view) in views {
            if view.dtype() != Dtype::F32 {
                return Err(NnError::Type { file, tensor, found: format!("{:?}", view.dtype()) });
            }
            let numbers =
                view.data().as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect::<Vec<_>>();
            if let Some(index) = numbers.iter().position(|x| !x.is_finite()) {
                let value = numbers[index];
                return Err(NnError::NotFinite { file, tensor, index, value });
            }
            tensors.insert(tensor, (view.shape().to_vec(), numbers));
        }
        Ok(Self { file, text, tensors })
    }

    /// The metadata record.
    pub(crate) fn record<R: DeserializeOwned>(&self) -> Result<R, NnError> {
        serde_json::from_str(&self.text)
            .map_err(|e| NnError::Metadata { file: self.file.clone(), problem: e.to_string() })
    }

    /// Takes a tensor of this shape.
    pub(crate) fn take(&mut self, tensor: &str, needed: &[usize]) -> Result<Vec<f32>, NnError> {
        let (file, tensor) = (self.file.clone(), tensor.to_owned());
        let Some((found, numbers)) = self.tensors.remove(&tensor) else {
            return Err(NnError::Missing { file, tensor });
        };
        if found != needed {
            return Err(NnError::Shape { file, tensor, found, needed: needed.to_vec() });
        }
        Ok(numbers)
    }

    /// All tensors have been taken.
    pub(crate) fn finish(self) -> Result<(), NnError> {
        match self.tensors.into_keys().next() {
            Some(tensor) => Err(NnError::Unknown { file: self.file, tensor }),
            None => Ok(()),
        }
    }

    /// A field of the record that cannot be.
    pub(crate) fn field(&self, field: &'static str, value: &dyn Display, reason: &str) -> NnError {
        let (value, reason) = (value.to_string(), reason.to_owned());
        NnError::Field { file: self.file.clone(), field, value, reason }
    }
}
