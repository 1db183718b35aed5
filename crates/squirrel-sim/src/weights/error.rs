//! Why weights cannot be read or written.

use squirrel_core::vehicle::ParameterError;

/// What is wrong; one line that names the file, the tensor or field, and the value.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WeightsError {
    /// The disk refuses.
    #[error("{file}: {error}")]
    Io {
        /// Path of the file.
        file: String,
        /// What the system says.
        error: std::io::Error,
    },
    /// Not a safetensors file, or a damaged one.
    #[error("{file}: not a whole safetensors file: {problem}")]
    Format {
        /// Path of the file.
        file: String,
        /// What its reader says.
        problem: String,
    },
    /// The metadata record is absent or does not read.
    #[error("{file}: metadata squirrel: {problem}")]
    Metadata {
        /// Path of the file.
        file: String,
        /// What is wrong.
        problem: String,
    },
    /// A field of the metadata that cannot be what it says.
    #[error("{file}: {field} = {value}: {reason}")]
    Field {
        /// Path of the file.
        file: String,
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: String,
        /// Why not.
        reason: String,
    },
    /// A number that the flight code refuses.
    #[error("{file}: {problem}")]
    Parameter {
        /// Path of the file.
        file: String,
        /// Field, value and reason.
        problem: ParameterError,
    },
    /// A tensor that the model needs is not there.
    #[error("{file}: tensor {tensor}: missing")]
    Missing {
        /// Path of the file.
        file: String,
        /// Name of the tensor.
        tensor: String,
    },
    /// A tensor that the model does not have.
    #[error("{file}: tensor {tensor}: unknown to this model")]
    Unknown {
        /// Path of the file.
        file: String,
        /// Name of the tensor.
        tensor: String,
    },
    /// A tensor of another shape.
    #[error("{file}: tensor {tensor}: shape {found:?}, must be {needed:?}")]
    Shape {
        /// Path of the file.
        file: String,
        /// Name of the tensor.
        tensor: String,
        /// Shape in the file.
        found: Vec<usize>,
        /// Shape that the model has.
        needed: Vec<usize>,
    },
    /// A tensor of other numbers than `f32`.
    #[error("{file}: tensor {tensor}: numbers of type {found}, must be F32")]
    Type {
        /// Path of the file.
        file: String,
        /// Name of the tensor.
        tensor: String,
        /// Type in the file.
        found: String,
    },
    /// A number that is none.
    #[error("{file}: tensor {tensor}[{index}] = {value}: must be finite")]
    NotFinite {
        /// Path of the file.
        file: String,
        /// Name of the tensor.
        tensor: String,
        /// Place in the tensor, row by row.
        index: usize,
        /// The value.
        value: f32,
    },
}
