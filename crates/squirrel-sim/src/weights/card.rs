//! Where weights come from: the metadata of their file.

use super::{Contents, WeightsError};
use serde::{Deserialize, Serialize};
use squirrel_core::rnn::parnn::{Domain, SPEED_SCALE_M_S, WINDOW};
use std::collections::BTreeMap;

/// Of the metadata; counts up when a field changes its meaning.
const FORMAT: u32 = 1;

/// What the inputs are in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Normalisation {
    /// The first input is speed over this, m/s. The second is the angle of attack in rad, as it is.
    pub speed_scale_m_s: f32,
    /// Rows of a window of the data, 10 a second.
    pub rows: usize,
}

/// How a card holds a [`Domain`], which core knows without files.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Domain", deny_unknown_fields)]
struct DomainFields {
    speed_m_s: [f32; 2],
    alpha_rad: [f32; 2],
}

/// What a model was trained on.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainedOn {
    /// What was flown.
    pub domain: Domain,
    /// Hash of the windows, hexadecimal.
    pub data_hash: String,
}

/// The metadata of weights. `M` is the model: its name where only one matters, the models
/// themselves where they are trained.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Card<M> {
    format: u32,
    /// What the weights are of.
    pub model: M,
    /// Name of the vehicle that flew.
    pub vehicle: String,
    /// Area of the flat plate, m^2.
    pub area_m2: f32,
    /// What the inputs are in.
    pub normalisation: Normalisation,
    /// What was flown in training.
    #[serde(with = "DomainFields")]
    pub domain: Domain,
    /// Hash of the windows that it was trained on, hexadecimal.
    pub data_hash: String,
    /// Of first weights and order of windows.
    pub seed: u64,
    /// What came of it, by name with unit; finite.
    pub figures: BTreeMap<String, f64>,
}

impl<M> Card<M> {
    /// Before training: no figures yet.
    ///
    /// * `area_m2` - area of the flat plate
    pub fn new(
        model: M,
        vehicle: &str,
        area_m2: f32,
        data: impl Into<TrainedOn>,
        seed: u64,
    ) -> Self {
        let TrainedOn { domain, data_hash } = data.into();
        Self {
            format: FORMAT,
            model,
            vehicle: vehicle.to_owned(),
            area_m2,
            normalisation: Normalisation { speed_scale_m_s: SPEED_SCALE_M_S, rows: WINDOW },
            domain,
            data_hash,
            seed,
            figures: BTreeMap::new(),
        }
    }

    /// The code can do what the card says.
    ///
    /// * `contents` - the file that the card is of, for errors
    ///
    /// # Errors
    /// Names the first field that it cannot.
    pub fn check(&self, contents: &Contents) -> Result<(), WeightsError> {
        let scale = self.normalisation.speed_scale_m_s;
        if self.format != FORMAT {
            return Err(contents.field(
                "format",
                &self.format,
                &format!("this version reads {FORMAT}"),
            ));
        }
        if scale.to_bits() != SPEED_SCALE_M_S.to_bits() {
            let reason = format!("the flight code divides by {SPEED_SCALE_M_S}");
            return Err(contents.field("normalisation.speed_scale_m_s", &scale, &reason));
        }
        if self.normalisation.rows != WINDOW {
            let reason = format!("the flight code keeps {WINDOW}");
            return Err(contents.field("normalisation.rows", &self.normalisation.rows, &reason));
        }
        if !(self.area_m2 > 0.0 && self.area_m2.is_finite()) {
            return Err(contents.field("area_m2", &self.area_m2, "must be positive"));
        }
        Ok(())
    }
}
