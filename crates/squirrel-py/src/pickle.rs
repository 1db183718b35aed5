//! Objects as `pickle` takes them, and `copy.deepcopy` with it: one function that makes each again of
//! what its `__reduce__` said (`kept`).

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

/// Make an object of what its ``__reduce__`` said; for pickle.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[gen_stub(override_return_type(type_repr = "typing.Any", imports = ("typing")))]
pub(crate) fn again<'py>(
    py: Python<'py>,
    kind: &str,
    #[gen_stub(override_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    state: &Bound<'py, PyTuple>,
) -> PyResult<Py<PyAny>> {
    let made = |object: PyResult<Bound<'py, PyAny>>| object.map(Bound::unbind);
    match kind {
        "Vehicle" => made(Ok(Bound::new(py, Vehicle::again(state)?)?.into_any())),
        "FlightLog" => made(Ok(Bound::new(py, FlightLog::again(state)?)?.into_any())),
        "Policy" => made(Ok(Bound::new(py, Policy::again(state)?)?.into_any())),
        "Model" => made(Ok(Bound::new(py, Model::again(state)?)?.into_any())),
        "Batch" => made(Ok(Bound::new(py, Batch::again(state)?)?.into_any())),
        "Stack" => made(Ok(Bound::new(py, Stack::again(state)?)?.into_any())),
        "Backstepping" => made(Ok(Bound::new(py, Backstepping::again(state)?)?.into_any())),
        "Twcc" => made(Ok(Bound::new(py, Twcc::again(state)?)?.into_any())),
        "Tasks" => made(Ok(Bound::new(py, Tasks::again(state)?)?.into_any())),
        other => Err(value(format!("kind = {other}: not one of squirrel's"))),
    }
}
