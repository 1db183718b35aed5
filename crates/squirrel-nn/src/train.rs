//! Training: epochs of Adam over shuffled batches, until the rate is down or the validation set
//! gets no better.
//!
//! A [`Trainer`] is stepped from outside, an [`Trainer::epoch`] at a time, so that whoever calls
//! can show progress, save a checkpoint or stop. Same windows, settings and seed give the same
//! weights, on every path and whether or not training was interrupted.

use crate::adam::{Adam, clip, cosine};
use crate::error::NnError;
use crate::heads::Sample;
use crate::kernel::simd::Path;
use crate::model::Model;
use crate::trained::{Card, Trained};
use crate::windows::Windows;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};

/// How to train.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Passes over the windows at most.
    pub epochs: usize,
    /// Windows a step.
    pub batch: usize,
    /// Rate of the first step; falls along a cosine to 0 at the end of the last epoch.
    pub rate: f64,
    /// A longer gradient is shortened to this length, N^2.
    pub clip: f64,
    /// Stop after so many epochs in which the validation set got no better; only where there is
    /// one.
    pub patience: usize,
    /// Of first weights and order of windows.
    pub seed: u64,
}

/// Passes over the windows if nobody says; as in the paper.
pub const EPOCHS: usize = 800;
/// Most passes: what is more was not meant.
const EPOCHS_MAX: usize = 100_000;

impl Default for Settings {
    fn default() -> Self {
        Self { epochs: EPOCHS, batch: 256, rate: 3e-3, clip: 5.0, patience: 200, seed: 0 }
    }
}

impl Settings {
    fn check(&self) -> Result<(), NnError> {
        let refuse = |field, value: String, reason| Err(NnError::Setting { field, value, reason });
        if self.batch == 0 {
            return refuse("batch", self.batch.to_string(), "must be at least 1");
        }
        if !(1..=EPOCHS_MAX).contains(&self.epochs) {
            return refuse("epochs", self.epochs.to_string(), "must be 1 to 100000");
        }
        if !(self.rate > 0.0 && self.rate.is_finite()) {
            return refuse("rate", self.rate.to_string(), "must be positive");
        }
        if !(self.clip > 0.0 && self.clip.is_finite()) {
            return refuse("clip", self.clip.to_string(), "must be positive");
        }
        Ok(())
    }
}

/// What an epoch came to: mean squared errors, N^2.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Epoch {
    /// Over the training windows, while the weights moved.
    pub training: f64,
    /// Over the validation windows after it; absent where there are none.
    pub validation: Option<f64>,
}

/// A model on its way.
#[derive(Debug, Clone)]
pub struct Trainer {
    pub(crate) card: Card,
    pub(crate) settings: Settings,
    path: Path,
    training: Vec<Sample<f32>>,
    validation: Vec<Sample<f32>>,
    pub(crate) validation_hash: u64,
    pub(crate) state: State,
}

/// What a checkpoint holds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct State {
    pub(crate) parameters: Vec<f32>,
    pub(crate) adam: Adam,
    pub(crate) best: Vec<f32>,
    pub(crate) best_epoch: usize,
    pub(crate) history: Vec<Epoch>,
}

impl Trainer {
    /// Before the first epoch. Models without a network are ready at once.
    ///
    /// * `vehicle` - its name, for the file
    /// * `area_m2` - area of the flat plate
    /// * `validation` - may be empty: then nothing stops early and the last weights are the best
    ///
    /// # Errors
    /// A setting out of range, or no windows to train on.
    pub fn new(
        model: Model,
        vehicle: &str,
        area_m2: f32,
        training: &Windows,
        validation: &Windows,
        settings: Settings,
    ) -> Result<Self, NnError> {
        settings.check()?;
        if !(area_m2 > 0.0 && area_m2.is_finite()) {
            let value = area_m2.to_string();
            return Err(NnError::Setting { field: "area_m2", value, reason: "must be positive" });
        }
        if training.all().is_empty() {
            return Err(NnError::Empty { set: "training" });
        }
        let samples =
            |windows: &Windows| windows.all().iter().map(|w| model.sample(w)).collect::<Vec<_>>();
        let (training_samples, validation_samples) = (samples(training), samples(validation));
        let mut parameters = model.start(settings.seed);
        if model == Model::ScaledFlatPlate {
            parameters = vec![Model::best_scale(area_m2, &training_samples)];
        }
        let state = State {
            adam: Adam::new(parameters.len()),
            best: parameters.clone(),
            parameters,
            best_epoch: 0,
            history: Vec::new(),
        };
        Ok(Self {
            card: Card::new(model, vehicle, area_m2, training, settings.seed),
            settings,
            path: Path::best(),
            training: training_samples,
            validation: validation_samples,
            validation_hash: validation.hash(),
            state,
        })
    }

    /// On other registers than the fastest; the weights do not depend on it.
    #[must_use]
    pub fn on(mut self, path: Path) -> Self {
        self.path = path;
        self
    }

    /// What the epochs so far came to.
    pub fn history(&self) -> &[Epoch] {
        &self.state.history
    }

    /// How it is trained.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// All epochs are done, the validation set got no better for long enough, or there is nothing
    /// to train.
    pub fn is_done(&self) -> bool {
        let epochs = self.state.history.len();
        let stuck = !self.validation.is_empty()
            && epochs - self.state.best_epoch >= self.settings.patience.max(1);
        !self.card.model.is_network() || epochs >= self.settings.epochs || stuck
    }

    /// One pass over the training windows; none where [`Trainer::is_done`].
    ///
    /// # Errors
    /// The loss is no longer finite.
    pub fn epoch(&mut self) -> Result<Option<Epoch>, NnError> {
        if self.is_done() {
            return Ok(None);
        }
        let number = self.state.history.len() + 1;
        let training = self.pass(number);
        let validation = (!self.validation.is_empty()).then(|| self.error());
        let epoch = Epoch { training, validation };
        let loss = validation.unwrap_or(training);
        if !(training + loss).is_finite() || self.state.parameters.iter().any(|p| !p.is_finite()) {
            return Err(NnError::Diverged { model: self.card.model.name(), epoch: number, loss });
        }
        let best = self
            .state
            .history
            .get(self.state.best_epoch.wrapping_sub(1))
            .and_then(|e| e.validation);
        if validation.is_none() || best.is_none_or(|best| loss < best) {
            self.state.best.clone_from(&self.state.parameters);
            self.state.best_epoch = number;
        }
        self.state.history.push(epoch);
        Ok(Some(epoch))
    }

    /// The weights of the best epoch, that with the least validation error.
    pub fn best(&self) -> Trained {
        Trained { card: self.card.clone(), parameters: self.state.best.clone() }
    }

    /// Steps through all batches; mean of the loss over the windows.
    fn pass(&mut self, number: usize) -> f64 {
        let State { parameters, adam, .. } = &mut self.state;
        let (model, settings) = (self.card.model, &self.settings);
        let order = shuffled(self.training.len(), settings.seed, number);
        let steps_an_epoch = order.len().div_ceil(settings.batch);
        let steps = (settings.epochs * steps_an_epoch) as u64;
        let first_step = ((number - 1) * steps_an_epoch) as u64;
        let mut gradient = vec![0.0; parameters.len()];
        let mut sum = 0.0;
        for (step, members) in (first_step..).zip(order.chunks(settings.batch)) {
            let (area, samples) = (self.card.area_m2, &self.training);
            let loss = model.gradient(self.path, parameters, area, samples, members, &mut gradient);
            sum += loss * members.len() as f64;
            clip(&mut gradient, settings.clip);
            adam.step(parameters, &gradient, cosine(settings.rate, step, steps));
        }
        sum / order.len() as f64
    }

    /// Mean squared error over the validation windows, N^2.
    fn error(&self) -> f64 {
        let State { parameters, .. } = &self.state;
        let forces =
            self.card.model.forces(self.path, parameters, self.card.area_m2, &self.validation);
        let squared = forces.iter().zip(&self.validation).flat_map(|(force, sample)| {
            force.iter().zip(sample.target).map(|(f, t)| (f64::from(*f) - f64::from(t)).powi(2))
        });
        squared.sum::<f64>() / self.validation.len() as f64
    }
}

/// The windows in the order of an epoch, by Fisher and Yates; written out so that weights do not
/// depend on a library's version.
fn shuffled(count: usize, seed: u64, epoch: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count as u32).collect();
    let mut rng =
        Pcg64Mcg::seed_from_u64(seed ^ (epoch as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    for last in (1..count).rev() {
        // The upper bits of a product: uniform to within 2^-32.
        let pick = (u64::from(rng.next_u32()) * (last as u64 + 1)) >> 32;
        order.swap(last, pick as usize);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_has_every_window_once_and_changes_every_epoch() {
        let (first, second) = (shuffled(1000, 7, 1), shuffled(1000, 7, 2));
        let mut sorted = first.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().zip(0..).all(|(a, b)| *a == b));
        assert_eq!(first, shuffled(1000, 7, 1));
        assert!(first != second && first != shuffled(1000, 8, 1));
        let moved = first.iter().zip(0..).filter(|(a, b)| **a != *b).count();
        assert!(moved > 980, "{moved}");
    }
}
