//! Writing safetensors files of `f32` with one metadata record; [`Contents`](super::Contents) reads
//! them.

use super::{RECORD, WeightsError};
use safetensors::Dtype;
use safetensors::tensor::TensorView;
use serde::Serialize;
use squirrel_log::files::write_whole;
use std::path::Path;

/// A named tensor to write.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor<'a> {
    /// Name.
    pub name: String,
    /// Shape.
    pub shape: Vec<usize>,
    /// As many numbers as the shape says, row by row.
    pub numbers: &'a [f32],
}

/// Writes a file, under a temporary name first. Equal tensors and records give equal bytes.
///
/// # Errors
/// A number is not finite, a tensor is of another shape than its numbers, or the disk refuses.
pub fn write(
    path: &Path,
    record: &impl Serialize,
    tensors: &[Tensor<'_>],
) -> Result<(), WeightsError> {
    let file = path.display().to_string();
    let format =
        |problem: String| WeightsError::Format { file: path.display().to_string(), problem };
    let text = serde_json::to_string(record)
        .map_err(|e| WeightsError::Metadata { file: file.clone(), problem: e.to_string() })?;
    let bytes: Vec<Vec<u8>> =
        tensors.iter().map(|t| t.numbers.iter().flat_map(|x| x.to_le_bytes()).collect()).collect();
    let mut views = Vec::with_capacity(tensors.len());
    for (tensor, bytes) in tensors.iter().zip(&bytes) {
        if let Some(index) = tensor.numbers.iter().position(|x| !x.is_finite()) {
            let (tensor, value) = (tensor.name.clone(), tensor.numbers[index]);
            return Err(WeightsError::NotFinite { file, tensor, index, value });
        }
        let view = TensorView::new(Dtype::F32, tensor.shape.clone(), bytes);
        views.push((tensor.name.as_str(), view.map_err(|e| format(e.to_string()))?));
    }
    let metadata = [(RECORD.to_owned(), text)].into_iter().collect();
    let content =
        safetensors::serialize(views, Some(metadata)).map_err(|e| format(e.to_string()))?;

    write_whole(path, &content).map_err(|error| WeightsError::Io { file, error })
}
