//! A Python module that says what the stubs of squirrel are. An extension module as squirrel
//! itself, because a program would have to link Python: `tests/test_stubs.py` loads it and
//! compares.

use pyo3::prelude::*;

/// Prints the stubs.
#[pymodule]
mod stubs {
    use super::{PyResult, pyfunction};
    use pyo3::exceptions::PyValueError;

    /// Text of `_squirrel.pyi`.
    #[pyfunction]
    fn text() -> PyResult<String> {
        let info = _squirrel::stub_info().map_err(|e| PyValueError::new_err(e.to_string()))?;
        let module = info.modules.get("squirrel._squirrel");
        module
            .map(ToString::to_string)
            .ok_or_else(|| PyValueError::new_err("squirrel._squirrel is not there"))
    }
}
