//! Learned models of the force on spread wings: the paper's network and its rivals, trained by
//! exact gradients.
//!
//! - [`labels`]: windows from a flight log.
//! - [`windows`]: what models learn from, split by flight.
//! - [`model`]: the models behind one interface.
//! - [`train`]: Adam, cosine, early stopping, seeds; a checkpoint resumes to the same bits.
//! - [`trained`]: forces from a trained model, safetensors in and out.
//! - [`kernel`]: many windows at once, forwards and backwards, on whatever registers there are.
//!
//! ```
//! # use squirrel_nn::windows::{Window, Windows};
//! # let window = Window { rows: [[0.5, 0.2]; 10], velocity_body_m_s: [4.9, 0.0, 1.0],
//! #     q_ned_from_body_wxyz: [1.0, 0.0, 0.0, 0.0], label_body_n: [0.0, 0.0, -0.3], truth_body_n: None };
//! # let mut flights = Windows::new();
//! # flights.push("monday", &[window; 20])?;
//! # flights.push("tuesday", &[window; 10])?;
//! # let file = std::env::temp_dir().join("squirrel-nn-doctest.safetensors");
//! use squirrel_nn::model::Model;
//! use squirrel_nn::train::{Settings, Trainer};
//! use squirrel_nn::trained::Trained;
//!
//! let (training, validation) = flights.split(&["tuesday"])?;
//! let settings = Settings { epochs: 20, seed: 1, ..Settings::default() };
//! let mut trainer = Trainer::new(Model::Parnn, "squirrel", 0.04, &training, &validation, settings)?;
//! while let Some(epoch) = trainer.epoch()? {
//!     assert!(epoch.training.is_finite()); // or draw it
//! }
//! trainer.best().save(&file)?;
//!
//! let flies = Trained::load(&file)?.parnn().expect("is one");
//! assert_eq!(flies.area_m2, 0.04);
//! # std::fs::remove_file(&file).expect("was there");
//! # Ok::<(), squirrel_nn::NnError>(())
//! ```
//!
//! The forward pass is that of `squirrel-core`, run on registers of windows, so weights fly with
//! the bits they were trained with. SI units and radians; body frame FRD, world NED.

mod adam;
mod checkpoint;
pub mod error;
mod heads;
pub mod kernel;
pub mod labels;
pub mod model;
pub mod train;
pub mod trained;
pub mod windows;

pub use error::NnError;
