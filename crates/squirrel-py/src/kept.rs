//! What pickle keeps of an object: bytes of the flight code, and a call that makes it again.

use crate::error::value;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
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
    let again = py.import("squirrel._squirrel")?.getattr("again")?;
    let state = state.into_pyobject(py).map_err(Into::into)?;
    (again, (class, state)).into_pyobject(py)
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
