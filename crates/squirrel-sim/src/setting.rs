//! Why a number or a name that a file or an option gives cannot be used.

use squirrel_core::vehicle::ParameterError;
use std::fmt::Display;

/// One line that names field, value and what was expected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingError {
    /// A value that cannot be.
    #[error("{field} = {value}: {reason}")]
    Value {
        /// Its key.
        field: String,
        /// What it is.
        value: String,
        /// What it must be, or why it cannot be.
        reason: String,
    },
    /// A name of nothing.
    #[error("{field} = {name}: no such {what}; known are {known}")]
    Name {
        /// Its key.
        field: &'static str,
        /// The name.
        name: String,
        /// What it should be a name of.
        what: &'static str,
        /// All names.
        known: String,
    },
    /// A key that is needed and not there.
    #[error("{field}: missing; {what}")]
    Missing {
        /// The key.
        field: String,
        /// What it is.
        what: &'static str,
    },
    /// A number that the flight code refuses.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

impl SettingError {
    /// A value that cannot be.
    pub fn value(field: impl Into<String>, value: impl Display, reason: impl Into<String>) -> Self {
        Self::Value { field: field.into(), value: value.to_string(), reason: reason.into() }
    }
}

impl From<SettingError> for String {
    fn from(error: SettingError) -> Self {
        error.to_string()
    }
}
