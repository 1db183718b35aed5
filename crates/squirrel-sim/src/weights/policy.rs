//! A policy from its file, ready to fly; and the way there, for whoever trained it.

use super::{Contents, Tensor, WeightsError, write};
use serde::{Deserialize, Serialize};
use squirrel_core::policy::{ACTION, HIDDEN, OBSERVATION, Policy};
use squirrel_core::stack::wire::{HASH_START, hash};
use std::path::Path;

/// What the record calls a policy.
const KIND: &str = "policy";
/// Of the record, and of what observation and action mean; counts up when one of them changes.
const FORMAT: u32 = 1;
/// Names and shapes in the order of [`Policy::tensors`]; matrices are `[inputs, outputs]`.
const TENSORS: [(&str, &[usize]); 6] = [
    ("first.weight", &[OBSERVATION, HIDDEN]),
    ("first.bias", &[HIDDEN]),
    ("second.weight", &[HIDDEN, HIDDEN]),
    ("second.bias", &[HIDDEN]),
    ("output.weight", &[HIDDEN, ACTION]),
    ("output.bias", &[ACTION]),
];

/// The metadata of a policy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PolicyCard {
    kind: String,
    format: u32,
    observation: usize,
    hidden: usize,
    action: usize,
}

impl PolicyCard {
    fn ours() -> Self {
        Self {
            kind: KIND.to_owned(),
            format: FORMAT,
            observation: OBSERVATION,
            hidden: HIDDEN,
            action: ACTION,
        }
    }

    /// Names the first field that is not what flies.
    fn check(&self, contents: &Contents) -> Result<(), WeightsError> {
        let ours = Self::ours();
        if self.kind != KIND {
            return Err(contents.field("kind", &self.kind, &format!("must be \"{KIND}\"")));
        }
        if self.format != FORMAT {
            return Err(contents.field(
                "format",
                &self.format,
                &format!("this version reads {FORMAT}"),
            ));
        }
        for (field, found, needed) in [
            ("observation", self.observation, ours.observation),
            ("hidden", self.hidden, ours.hidden),
            ("action", self.action, ours.action),
        ] {
            if found != needed {
                return Err(contents.field(
                    field,
                    &found,
                    &format!("the flight code has {needed}"),
                ));
            }
        }
        Ok(())
    }
}

/// A policy and where it is from.
#[derive(Debug, Clone, PartialEq)]
pub struct PolicyWeights {
    /// What flies.
    pub policy: Policy,
    /// Name of the file, without its folder.
    pub name: String,
}

impl PolicyWeights {
    /// Reads a file.
    ///
    /// # Errors
    /// The disk refuses, or one line that names the file, and the tensor or the field with its
    /// value: not a safetensors file, no policy, one of other sizes, a tensor that is missing,
    /// unknown, of another shape or not finite.
    pub fn load(path: &Path) -> Result<Self, WeightsError> {
        let mut contents = Contents::read(path)?;
        contents.record::<PolicyCard>()?.check(&contents)?;
        let mut policy = Policy::filled(0.0);
        for (tensor, (name, shape)) in policy.tensors_mut().into_iter().zip(TENSORS) {
            tensor.copy_from_slice(&contents.take(name, shape)?);
        }
        contents.finish()?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { policy, name })
    }

    /// Writes a file that [`PolicyWeights::load`] reads. It appears under its name only when it is
    /// whole.
    ///
    /// # Errors
    /// A weight is not finite, or the disk refuses.
    pub fn save(policy: &Policy, path: &Path) -> Result<(), WeightsError> {
        let named = |(numbers, (name, shape)): (_, (&str, &[usize]))| Tensor {
            name: name.to_owned(),
            shape: shape.to_vec(),
            numbers,
        };
        let tensors: Vec<_> = policy.tensors().into_iter().zip(TENSORS).map(named).collect();
        write(path, &PolicyCard::ours(), &tensors)
    }

    /// FNV-1a of the weights in the order of the file, 16 hexadecimal digits.
    pub fn hash(&self) -> String {
        let numbers = self.policy.tensors().into_iter().flatten();
        let hash = numbers.fold(HASH_START, |before, number| hash(before, &number.to_le_bytes()));
        format!("{hash:016x}")
    }
}
