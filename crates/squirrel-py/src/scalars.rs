//! Numbers that Python hands in: what cannot be in an argument is a `ValueError`, what is no number
//! a `TypeError`, and both name the argument.

use crate::error::value;
use crate::interrupt::now_and_then;
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::prelude::*;
use pyo3_stub_gen::{PyStubType, TypeInfo};

/// Largest number of vehicles, memories or environments that a count may ask for.
pub(crate) const COUNT_MAX: usize = 1_000_000;
/// Characters of a value in an error.
const SHOWN: usize = 40;

/// What an argument may be.
pub(crate) trait Scalar: Sized {
    fn read(name: &str, object: &Bound<'_, PyAny>) -> PyResult<Self>;
}

/// An object as an error shows it.
fn shown(object: &Bound<'_, PyAny>) -> String {
    // A number of very many digits has no text in Python.
    let text = object.repr().map_or_else(|_| "a very large number".to_owned(), |r| r.to_string());
    if text.chars().count() <= SHOWN {
        return text;
    }
    format!("{}...", text.chars().take(SHOWN).collect::<String>())
}

/// An error of the conversion, with the argument's name.
fn named(name: &str, object: &Bound<'_, PyAny>, error: PyErr, [what, range]: [&str; 2]) -> PyErr {
    let py = object.py();
    if error.is_instance_of::<PyOverflowError>(py) {
        value(format!("{name} = {}: must be {range}", shown(object)))
    } else if error.is_instance_of::<PyTypeError>(py) {
        let kind = object.get_type().name().map_or_else(|_| String::new(), |n| n.to_string());
        PyTypeError::new_err(format!("{name}: expected {what}, got {kind}"))
    } else {
        error
    }
}

macro_rules! scalar {
    ($($kind:ty, $what:literal, $range:expr;)*) => {$(
        impl Scalar for $kind {
            fn read(name: &str, object: &Bound<'_, PyAny>) -> PyResult<Self> {
                object.extract::<Self>().map_err(|e| named(name, object, e, [$what, $range]))
            }
        }
    )*};
}
scalar! {
    u32, "a whole number", "0 to 4294967295";
    u64, "a whole number", "0 to 18446744073709551615";
    usize, "a whole number", "0 to 18446744073709551615";
    f64, "a number", "finite, and at most 1.8e308";
    f32, "a number", "finite, and at most 3.4e38";
}

impl<T: Scalar> Scalar for Option<T> {
    fn read(name: &str, object: &Bound<'_, PyAny>) -> PyResult<Self> {
        if object.is_none() { Ok(None) } else { T::read(name, object).map(Some) }
    }
}

/// Functions for `from_py_with`, of the names of arguments.
macro_rules! arguments {
    ($($name:ident)*) => {$(
        pub(crate) fn $name<T: Scalar>(object: &Bound<'_, PyAny>) -> PyResult<T> {
            T::read(stringify!($name), object)
        }
    )*};
}
arguments! {
    arm_m batch capacity_ah cells clip controller_hz count deployment dt_s episode_s epochs hover_thrust_fraction index kv_rpm_per_v mass_kg num_envs patience
    pitch_inch propeller_inch rate reference_yaw_rad reserve seed speed_max_m_s step_s steps steps_per_command threads thrust_to_weight
    time_us voltage_v yaw_rad
}

/// Refuses more than there is memory for, and none.
pub(crate) fn checked_count(name: &str, count: usize) -> PyResult<usize> {
    if (1..=COUNT_MAX).contains(&count) {
        return Ok(count);
    }
    let limit = if count == 0 { "at least 1".to_owned() } else { format!("at most {COUNT_MAX}") };
    Err(value(format!("{name} = {count}: must be {limit}")))
}

/// Whole numbers that can be iterated over, an array of them among others.
#[derive(Debug, Clone)]
pub(crate) struct Indices {
    numbers: Vec<u64>,
    /// The first that cannot be, by place.
    wrong: Option<(usize, String)>,
}

impl Indices {
    /// # Errors
    /// `ValueError` that names the argument: one that is below 0 or too large.
    pub(crate) fn of(self, name: &str) -> PyResult<Vec<u64>> {
        match self.wrong {
            None => Ok(self.numbers),
            Some((at, what)) => {
                Err(value(format!("{name}[{at}] = {what}: must be 0 to 18446744073709551615")))
            }
        }
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Indices {
    type Error = PyErr;
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let py = object.py();
        let mut all = Self { numbers: Vec::new(), wrong: None };
        for (at, one) in object.try_iter()?.enumerate() {
            now_and_then(py, at)?;
            let one = one?;
            match one.extract() {
                Ok(number) => all.numbers.push(number),
                Err(error) if error.is_instance_of::<PyOverflowError>(py) => {
                    all.wrong = all.wrong.or_else(|| Some((at, shown(&one))));
                }
                Err(error) => return Err(error),
            }
        }
        Ok(all)
    }
}

impl PyStubType for Indices {
    fn type_output() -> TypeInfo {
        TypeInfo {
            name: "typing.Iterable[typing.SupportsIndex]".to_owned(),
            source_module: None,
            import: [Into::into("typing")].into(),
            type_refs: std::collections::HashMap::new(),
        }
    }
}
