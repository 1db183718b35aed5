//! Learned models of the force on spread wings: the paper's network and its rivals, trained by exact gradients.
//!
//! - [`windows`]: what models learn from, split by flight.
//! - [`model`]: the models behind one interface.
//! - [`train`]: Adam, cosine, early stopping, seeds; a checkpoint resumes to the same bits.
//! - [`trained`]: forces from a trained model, safetensors in and out.
//! - [`kernel`]: many windows at once, forwards and backwards, on whatever registers there are.
//!
//! The forward pass is that of `squirrel-core`, run on registers of windows, so weights fly with the bits they were trained
//! with. SI units and radians; body frame FRD, world NED.

mod adam;
mod checkpoint;
pub mod error;
mod heads;
pub mod kernel;
pub mod model;
mod tensors;
pub mod train;
pub mod trained;
pub mod windows;

pub use error::NnError;
