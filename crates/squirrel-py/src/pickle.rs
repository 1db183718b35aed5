//! Objects as `pickle` takes them, and `copy.deepcopy` with it: what each is made of, and one
//! function that makes it again.

use crate::batch::Batch;
use crate::control::{Backstepping, Twcc};
use crate::error::value;
use crate::log::FlightLog;
use crate::nn::Model;
use crate::policy::Policy;
use crate::stack::Stack;
use crate::task::Tasks;
use crate::vehicle::Vehicle;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use pyo3_stub_gen::derive::gen_stub_pyfunction;
use squirrel_core::stack::wire::{Reader, Wire, Writer};

/// Where a value's bytes may begin to need room.
const ROOM: usize = 4096;

/// What `__reduce__` returns.
pub(crate) fn reduced<'py, T>(
    py: Python<'py>,
    class: &'static str,
    state: T,
) -> PyResult<Bound<'py, PyTuple>>
where
    T: IntoPyObject<'py, Target = PyTuple, Output = Bound<'py, PyTuple>>,
    T::Error: Into<PyErr>,
{
    let again = py.import("squirrel._squirrel")?.getattr("_again")?;
    let state = state.into_pyobject(py).map_err(Into::into)?;
    (again, (class, state)).into_pyobject(py)
}

/// Make an object of what its ``__reduce__`` said; for pickle.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[gen_stub(override_return_type(type_repr = "typing.Any", imports = ("typing")))]
pub(crate) fn _again<'py>(
    py: Python<'py>,
    class: &str,
    #[gen_stub(override_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    state: &Bound<'py, PyTuple>,
) -> PyResult<Py<PyAny>> {
    let made = |object: PyResult<Bound<'py, PyAny>>| object.map(Bound::unbind);
    match class {
        "Vehicle" => made(Ok(Bound::new(py, Vehicle::again(state)?)?.into_any())),
        "FlightLog" => made(Ok(Bound::new(py, FlightLog::again(state)?)?.into_any())),
        "Policy" => made(Ok(Bound::new(py, Policy::again(state)?)?.into_any())),
        "Model" => made(Ok(Bound::new(py, Model::again(state)?)?.into_any())),
        "Batch" => made(Ok(Bound::new(py, Batch::again(state)?)?.into_any())),
        "Stack" => made(Ok(Bound::new(py, Stack::again(state)?)?.into_any())),
        "Backstepping" => made(Ok(Bound::new(py, Backstepping::again(state)?)?.into_any())),
        "Twcc" => made(Ok(Bound::new(py, Twcc::again(state)?)?.into_any())),
        "Tasks" => made(Ok(Bound::new(py, Tasks::again(state)?)?.into_any())),
        other => Err(value(format!("class = {other}: not one of squirrel's"))),
    }
}

/// What a pickle of another version says.
pub(crate) fn broken(class: &str) -> PyErr {
    value(format!("pickle of a {class}: damaged, or of another version of squirrel"))
}

/// Appends the bytes of a value of the flight code.
pub(crate) fn put(bytes: &mut Vec<u8>, wire: &impl Wire) {
    let start = bytes.len();
    let mut room = ROOM;
    loop {
        bytes.resize(start + room, 0);
        let mut writer = Writer::new(&mut bytes[start..]);
        wire.put(&mut writer);
        if let Some(length) = writer.bytes().map(<[u8]>::len) {
            bytes.truncate(start + length);
            return;
        }
        room *= 2;
    }
}

/// Takes a value of the flight code.
pub(crate) fn take<T: Wire>(class: &str, from: &mut Reader<'_>) -> PyResult<T> {
    T::take(from).ok_or_else(|| broken(class))
}

/// Takes as many values as are left.
pub(crate) fn take_rest<T: Wire>(class: &str, from: &mut Reader<'_>) -> PyResult<Vec<T>> {
    let mut all = Vec::new();
    while !from.is_empty() {
        all.push(take(class, from)?);
    }
    Ok(all)
}
