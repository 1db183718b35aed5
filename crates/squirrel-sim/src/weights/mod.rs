//! Weights files: trained models as safetensors, read here because the simulator flies them.
//!
//! `squirrel-nn` trains and writes all models and reads them back with [`Contents`] and [`Card`];
//! of them only the paper's network flies ([`ParnnWeights`]). Policies ([`PolicyWeights`]) are
//! trained elsewhere. A file is tensors of `f32` and one metadata record, the JSON text `squirrel`
//! ([`Card`] for models).

mod card;
mod contents;
mod error;
mod parnn;
mod policy;
mod write;

pub use card::{Card, Normalisation, TrainedOn};
pub use contents::{Contents, RECORD};
pub use error::WeightsError;
pub use parnn::ParnnWeights;
pub use policy::PolicyWeights;
pub use write::{Tensor, write};
