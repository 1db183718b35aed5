//! Vehicle files: TOML in, checked vehicle, plant parameters and gains out.
//!
//! Any number may be plain or `{ value, sd, source }`. Unknown keys are refused. An error is one
//! line that names the file, the field and the value.

mod build;
mod bundled;
pub mod diff;
mod effects;
pub mod export;
pub mod fit;
mod hovering;
pub mod margins;
mod means;
pub mod new;
mod tables;

pub use crate::quantity::Provenance;
pub use effects::{ListedEffect, ListedParameter, effects_page, listed_effects};
pub use hovering::{Hovering, StepAnswer};
pub use means::Means;

use crate::estimator::Estimator;
use crate::plant::{BatteryParameters, ParnnWing, WingPlant};
use crate::sensors::SensorParameters;
use crate::weights::{ParnnWeights, WeightsError};
use squirrel_core::effects::Effects;
use squirrel_core::stack::StackParameters;
use squirrel_core::vehicle::Vehicle;
use squirrel_log::files::read_text;
use std::io;
use std::path::{Path, PathBuf};

/// The squirrel of the paper, as shipped.
pub const SQUIRREL_TOML: &str = squirrel_vehicles::SQUIRREL;

/// Everything that a vehicle file says.
#[derive(Debug, Clone)]
pub struct VehicleFile {
    /// The file's name for the vehicle.
    pub name: String,
    /// The text of the file, kept for the log.
    pub text: String,
    /// Airframe.
    pub vehicle: Vehicle<f64>,
    /// Length, width, height, m.
    pub size_body_m: [f64; 3],
    /// How the wing behaves in the simulator.
    pub wing: WingPlant,
    /// The network that `wing.parnn_weights` names; `None` where it names none, or one that was not
    /// at hand.
    pub weights: Option<ParnnWeights>,
    /// Battery; without one the voltage stays at the reference.
    pub battery: Option<BatteryParameters>,
    /// Gains; a vehicle that is only analysed needs none.
    pub control: Option<StackParameters>,
    /// Who tells the flight code how the vehicle stands and where it is.
    pub estimator: Estimator,
    /// Sensors.
    pub sensors: SensorParameters,
    /// Effects on top of the base model.
    pub effects: Effects<f64>,
    /// Every number of the file by field.
    pub provenance: Vec<(String, Provenance)>,
}

/// Why a vehicle file cannot be used; one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VehicleFileError {
    /// The file could not be read.
    #[error("{file}: {source}")]
    Read {
        /// Path as given.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not TOML, or a key, type or name that the format does not have.
    #[error("{file}, line {line}: {message} (in `{text}`)")]
    Syntax {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
        /// The line itself.
        text: String,
    },
    /// A number that cannot be.
    #[error("{file}: {problem}")]
    Field {
        /// Path as given.
        file: String,
        /// `field = value: reason`.
        problem: String,
    },
}

impl VehicleFile {
    /// Reads and checks a file, and the weights that it names: a path relative to the file's
    /// folder.
    ///
    /// # Errors
    /// One line that names the file, the field or tensor, and the value.
    pub fn load(path: &Path) -> Result<Self, VehicleFileError> {
        let file = path.display().to_string();
        let text = match read_text(path) {
            Ok(text) => text,
            Err(source) => return Err(VehicleFileError::Read { file, source }),
        };
        Self::read(&text, &file, |name| {
            match (ParnnWeights::load(&beside(path, name)), shipped(name)) {
                // The shipped ones stand in for a file that is not there, not for one that is
                // damaged.
                (Err(WeightsError::Io { error, .. }), Some(weights))
                    if error.kind() == io::ErrorKind::NotFound =>
                {
                    weights.map(Some)
                }
                (read, _) => read.map(Some),
            }
        })
    }

    /// The file of the weights that a vehicle file names; `None` where it names none, cannot be
    /// read, or is no file: a pipe is read once.
    pub fn weights_path(path: &Path) -> Option<PathBuf> {
        let path = Some(path).filter(|path| path.is_file())?;
        let table: toml::Table = read_text(path).ok()?.parse().ok()?;
        Some(beside(path, table.get("wing")?.get("parnn_weights")?.as_str()?))
    }

    /// Checks the text of a file. A text lies in no folder, so of weights only the shipped ones are
    /// at hand.
    ///
    /// * `file` - what errors call it
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(text: &str, file: &str) -> Result<Self, VehicleFileError> {
        Self::read(text, file, |name| shipped(name).transpose())
    }

    /// As [`Self::parse`], with the weights that came with the text.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse_with(
        text: &str,
        file: &str,
        weights: Option<ParnnWeights>,
    ) -> Result<Self, VehicleFileError> {
        Self::read(text, file, |_| Ok(weights))
    }

    fn read(
        text: &str,
        file: &str,
        weights: impl FnOnce(&str) -> Result<Option<ParnnWeights>, WeightsError>,
    ) -> Result<Self, VehicleFileError> {
        let syntax = |error: &toml::de::Error| {
            let place = squirrel_log::toml_text::place(text, error);
            VehicleFileError::Syntax {
                file: file.to_owned(),
                line: place.line,
                message: place.message,
                text: place.text,
            }
        };
        let tables: tables::VehicleTable = toml::from_str(text).map_err(|e| syntax(&e))?;
        let raw: toml::Table = text.parse().map_err(|e| syntax(&e))?;
        let built = crate::quantity::check(&raw).and_then(|()| {
            build::build(tables, |name| {
                weights(name).map_err(|error| format!("wing.parnn_weights = {name}: {error}"))
            })
        });
        let mut built =
            built.map_err(|problem| VehicleFileError::Field { file: file.to_owned(), problem })?;
        text.clone_into(&mut built.text);
        built.provenance = crate::quantity::provenance(&raw);
        Ok(built)
    }

    /// The shipped squirrel.
    ///
    /// # Panics
    /// Never: a test parses the shipped file.
    #[allow(clippy::expect_used, reason = "the text is part of the program and tested")]
    pub fn squirrel() -> Self {
        Self::parse(SQUIRREL_TOML, "squirrel.toml").expect("the shipped vehicle is sound")
    }

    /// The same with rotors as small propellers are measured: drag, inflow, lift in forward flight,
    /// flapping and a vortex ring. `vehicles/squirrel_air.toml`.
    ///
    /// # Panics
    /// Never: a test parses it.
    #[allow(clippy::expect_used, reason = "the text is part of the program and tested")]
    pub fn squirrel_in_air() -> Self {
        Self::parse(squirrel_vehicles::SQUIRREL_AIR, "squirrel_air.toml")
            .expect("the shipped vehicle is sound")
    }

    /// The same vehicle with wings that do what its network says: the paper's simulation, in which
    /// plant and controller agree.
    ///
    /// # Errors
    /// One line where there are no wings or no weights.
    pub fn with_learned_wing(&self) -> Result<Self, String> {
        let (Some(weights), Some(wing), Some(servo)) =
            (&self.weights, &self.vehicle.parameters().wing, self.wing.servo())
        else {
            return Err(format!("{}: wing.parnn_weights: names none that were read", self.name));
        };
        let parnn = Box::new(ParnnWing::new(weights.parnn(), wing));
        Ok(Self { wing: WingPlant::Parnn { parnn, servo }, ..self.clone() })
    }

    /// Fields whose number the file gives without a source.
    pub fn without_source(&self) -> impl Iterator<Item = &str> {
        let bare = |p: &Provenance| p.source.is_none();
        self.provenance.iter().filter(move |(_, p)| bare(p)).map(|(field, _)| field.as_str())
    }
}

/// A file that a vehicle file names.
fn beside(path: &Path, name: &str) -> PathBuf {
    path.with_file_name("").join(name)
}

/// The shipped weights, where this is their name: a copy or a patch of their vehicle's file finds
/// them wherever it lies.
fn shipped(name: &str) -> Option<Result<ParnnWeights, WeightsError>> {
    let (own, bytes) = squirrel_vehicles::SQUIRREL_PARNN;
    (name == own).then(|| ParnnWeights::parse(own, bytes.to_vec()))
}
