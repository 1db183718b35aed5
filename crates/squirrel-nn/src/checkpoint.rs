//! A trainer as a file, so that training can go on where it was broken off, to the same bits.

use crate::adam::{Adam, Decay};
use crate::error::NnError;
use crate::train::{Epoch, Settings, State, Trainer};
use crate::trained::{Card, hash_text, named, take_named};
use crate::windows::Windows;
use serde::{Deserialize, Serialize};
use squirrel_sim::weights::{self, Contents, WeightsError};
use std::path::Path;

const PARAMETERS: &str = "last.";
const BEST: &str = "best.";
const MEAN: &str = "adam.mean.";
const SQUARE: &str = "adam.square.";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    card: Card,
    settings: Settings,
    decay: Decay,
    best_epoch: usize,
    validation_hash: String,
    history: Vec<Epoch>,
}

impl Trainer {
    /// Writes a safetensors file; it appears under its name only when it is whole.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn save(&self, path: &Path) -> Result<(), NnError> {
        let State { parameters, adam, best, best_epoch, history } = &self.state;
        let record = Record {
            card: self.card.clone(),
            settings: self.settings,
            decay: adam.decay,
            best_epoch: *best_epoch,
            validation_hash: hash_text(self.validation_hash),
            history: history.clone(),
        };
        let parts =
            [(PARAMETERS, parameters), (BEST, best), (MEAN, &adam.mean), (SQUARE, &adam.square)];
        let tensors: Vec<_> = parts
            .into_iter()
            .flat_map(|(prefix, numbers)| named(self.card.model, prefix, numbers))
            .collect();
        Ok(weights::write(path, &record, &tensors)?)
    }

    /// Goes on where [`Trainer::save`] was called, on the same windows.
    ///
    /// # Errors
    /// Not such a file, damaged, or written with other windows.
    pub fn resume(path: &Path, training: &Windows, validation: &Windows) -> Result<Self, NnError> {
        let mut contents = Contents::read(path)?;
        let record: Record = contents.record()?;
        let Record { card, settings, decay, best_epoch, validation_hash, history } = record;
        card.check(&contents)?;
        for (field, then, now) in [
            ("data_hash", &card.data_hash, hash_text(training.hash())),
            ("validation_hash", &validation_hash, hash_text(validation.hash())),
        ] {
            if *then != now {
                return Err(contents
                    .field(field, then, &format!("the windows at hand have {now}"))
                    .into());
            }
        }
        if best_epoch > history.len() || history.len() > settings.epochs {
            let reason = format!("there were {} epochs", history.len());
            return Err(contents.field("best_epoch", &best_epoch, &reason).into());
        }
        let mut take = |prefix| take_named(&mut contents, card.model, prefix);
        let (parameters, best) = (take(PARAMETERS)?, take(BEST)?);
        let adam = Adam { mean: take(MEAN)?, square: take(SQUARE)?, decay };
        contents.finish()?;
        let trainer =
            Self::new(card.model, &card.vehicle, card.area_m2, training, validation, settings);
        let mut trainer = trainer.map_err(|error| match error {
            NnError::Setting { field, value, reason } => {
                let (file, reason) = (path.display().to_string(), reason.to_owned());
                WeightsError::Field { file, field, value, reason }.into()
            }
            other => other,
        })?;
        trainer.card = card;
        trainer.state = State { parameters, adam, best, best_epoch, history };
        Ok(trainer)
    }
}
