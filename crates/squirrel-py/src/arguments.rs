//! What Python hands in, checked: an error names the argument, what was expected and what came.

use crate::error::value;
use numpy::{
    Element, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3_stub_gen::{PyStubType, TypeInfo};

/// A scalar that arrays may have.
pub(crate) trait Float: Element + Copy {
    const NAME: &'static str;
    fn is_finite(self) -> bool;
}

impl Float for f32 {
    const NAME: &'static str = "float32";
    fn is_finite(self) -> bool {
        self.is_finite()
    }
}

impl Float for f64 {
    const NAME: &'static str = "float64";
    fn is_finite(self) -> bool {
        self.is_finite()
    }
}

/// An array of another library as NumPy's, over the same memory, where it speaks DLPack; anything
/// else as it is.
///
/// # Errors
/// `TypeError`: it is on another device, or part of a gradient.
fn of_others(object: Bound<'_, PyAny>) -> PyResult<Bound<'_, PyAny>> {
    if object.is_instance_of::<PyUntypedArray>() || !object.hasattr("__dlpack__")? {
        return Ok(object);
    }
    let py = object.py();
    py.import("numpy")?.call_method1("from_dlpack", (&object,)).map_err(|error| {
        let kind = object.get_type().name().map_or_else(|_| String::new(), |n| n.to_string());
        let why = error.value(py);
        PyTypeError::new_err(format!("{kind}: must be on the CPU and detached ({why})"))
    })
}

/// Any object in an argument that must be an array; the types are for the stubs.
macro_rules! array_argument {
    ($($(#[$doc:meta])* $name:ident $type:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone)]
        pub(crate) struct $name<'py>(pub(crate) Bound<'py, PyAny>);

        impl<'a, 'py> FromPyObject<'a, 'py> for $name<'py> {
            type Error = PyErr;
            fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
                of_others(object.to_owned()).map(Self)
            }
        }

        impl PyStubType for $name<'_> {
            fn type_output() -> TypeInfo {
                TypeInfo {
                    name: $type.to_owned(),
                    source_module: None,
                    import: ["numpy", "numpy.typing"].map(|module| module.into()).into(),
                    type_refs: std::collections::HashMap::new(),
                }
            }
        }
    )*};
}

array_argument! {
    /// Of `float32`.
    Array32 "numpy.typing.NDArray[numpy.float32]";
    /// Of `float64`.
    Array64 "numpy.typing.NDArray[numpy.float64]";
    /// Of either.
    ArrayAny "numpy.typing.NDArray[numpy.float32] | numpy.typing.NDArray[numpy.float64]";
}

/// What a number in an array may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Numbers {
    Finite,
    /// Where the flight code itself refuses what is not.
    Any,
}

/// The numbers of an array, row after row.
pub(crate) struct Rows<'py, T: Float> {
    array: PyReadonlyArrayDyn<'py, T>,
    /// Where the array's own memory is not in that order.
    copy: Option<Vec<T>>,
}

impl<T: Float> Rows<'_, T> {
    pub(crate) fn numbers(&self) -> &[T] {
        match &self.copy {
            Some(copy) => copy,
            None => self.array.as_slice().unwrap_or(&[]),
        }
    }

    /// Row `i`, `N` wide.
    pub(crate) fn row<const N: usize>(&self, i: usize) -> [T; N] {
        std::array::from_fn(|k| self.numbers()[i * N + k])
    }
}

/// Numbers that are looked at at once: the processor looks at many in one go where it need not stop
/// at the first.
const LOOK: usize = 1024;

/// Checks dtype and shape of an array.
///
/// * `shape` - it must have; `None` for any length
///
/// # Errors
/// `ValueError` that names the argument.
pub(crate) fn array<'a, 'py, T: Float>(
    name: &str,
    object: &'a Bound<'py, PyAny>,
    shape: &[Option<usize>],
) -> PyResult<&'a Bound<'py, PyArrayDyn<T>>> {
    let expected =
        || format!("{name}: expected a {} array of shape {}", T::NAME, shape_text(shape));
    let Ok(array) = object.cast::<PyArrayDyn<T>>() else {
        return Err(value(format!("{}, got {}", expected(), kind(object))));
    };
    let fits = array.ndim() == shape.len()
        && array.shape().iter().zip(shape).all(|(has, must)| must.is_none_or(|must| *has == must));
    if !fits {
        return Err(value(format!("{}, got shape {}", expected(), python_shape(array.shape()))));
    }
    if !array.data().is_aligned() {
        return Err(value(format!("{name}: its numbers lie at odd addresses; hand in a copy")));
    }
    Ok(array)
}

/// Checks an array and its numbers.
///
/// # Errors
/// As [`array`]; a number that is not finite.
pub(crate) fn rows<'py, T: Float>(
    name: &str,
    object: &Bound<'py, PyAny>,
    shape: &[Option<usize>],
    numbers: Numbers,
) -> PyResult<Rows<'py, T>> {
    let array = array::<T>(name, object, shape)?;
    let array = array.try_readonly().map_err(|error| value(format!("{name}: {error}")))?;
    // A slice of an array in Fortran's order would be columns.
    let copy = (!array.is_c_contiguous()).then(|| array.as_array().iter().copied().collect());
    let rows = Rows { array, copy };
    let is_fine = |some: &[T]| some.iter().fold(true, |fine, x| fine & x.is_finite());
    if numbers == Numbers::Finite
        && !rows.numbers().chunks(LOOK).all(is_fine)
        && let Some(at) = rows.numbers().iter().position(|x| !x.is_finite())
    {
        let place = place(at, rows.array.shape());
        let what: f64 = object.get_item(place.clone())?.extract()?;
        return Err(value(format!("{name}[{}] = {what}: must be finite", join(&place.0))));
    }
    Ok(rows)
}

/// Whether an array is of `float32`; not so where it is something else altogether.
pub(crate) fn is_32(object: &Bound<'_, PyAny>) -> bool {
    object
        .cast::<PyUntypedArray>()
        .is_ok_and(|array| array.dtype().num() == numpy::dtype::<f32>(object.py()).num())
}

/// What an object is, for an error.
fn kind(object: &Bound<'_, PyAny>) -> String {
    match object.cast::<PyUntypedArray>() {
        Ok(array) => format!("{} of shape {}", array.dtype(), python_shape(array.shape())),
        Err(_) => object
            .get_type()
            .name()
            .map_or_else(|_| "something else".to_owned(), |name| name.to_string()),
    }
}

/// An index of many dimensions.
#[derive(Clone)]
struct Place(Vec<usize>);

impl<'py> IntoPyObject<'py> for Place {
    type Target = pyo3::types::PyTuple;
    type Output = Bound<'py, Self::Target>;
    type Error = PyErr;
    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        pyo3::types::PyTuple::new(py, self.0)
    }
}

fn place(mut at: usize, shape: &[usize]) -> Place {
    let mut indices: Vec<usize> = shape
        .iter()
        .rev()
        .map(|length| {
            let index = at % length;
            at /= length;
            index
        })
        .collect();
    indices.reverse();
    Place(indices)
}

fn join(numbers: &[usize]) -> String {
    numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}

fn python_shape(shape: &[usize]) -> String {
    shape_text(&shape.iter().copied().map(Some).collect::<Vec<_>>())
}

/// As Python writes a tuple; `n` where any length will do.
fn shape_text(shape: &[Option<usize>]) -> String {
    let lengths: Vec<String> =
        shape.iter().map(|n| n.map_or_else(|| "n".to_owned(), |n| n.to_string())).collect();
    format!("({}{})", lengths.join(", "), if lengths.len() == 1 { "," } else { "" })
}
