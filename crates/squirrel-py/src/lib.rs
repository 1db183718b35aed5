//! Python bindings: `import squirrel`.
//!
//! The functions of the crates below as Python sees them, batched over the first axis of NumPy
//! arrays; nothing is computed here. Arrays are checked where they come in (`arguments`), errors
//! are squirrel's own lines as Python's exceptions (`error`), and whatever takes long runs without
//! the interpreter's lock.
//!
//! ```python
//! import squirrel
//!
//! log = squirrel.simulate(scenario="avoid", arm="twcc_plus", seed=1)
//! print(log.metrics["height_lost_m"])
//! ```
//!
//! `docs/guide/python-examples.md` has an example of every name, and each of them runs in CI.

#![allow(clippy::doc_link_with_quotes, reason = "examples in docstrings are Python")]
#![allow(
    clippy::needless_pass_by_value,
    reason = "arguments come from Python, which hands them over"
)]
#![allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]

mod arguments;
mod batch;
mod control;
mod controller;
mod dynamics;
mod error;
mod flight;
mod gap;
mod interrupt;
mod kept;
mod keys;
mod log;
mod nn;
mod pickle;
mod plan;
mod policy;
mod scalars;
mod stack;
mod state;
mod task;
mod terms;
mod vehicle;

use pyo3::prelude::*;
use pyo3_stub_gen::StubInfo;
use pyo3_stub_gen::derive::gen_stub_pyfunction;
use pyo3_stub_gen::pyproject::StubGenConfig;
use std::ffi::OsString;
use std::path::PathBuf;

/// A result as Python's own objects, by way of JSON.
fn json<'py>(py: Python<'py>, result: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(result).map_err(error::value)?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Run the command line.
///
/// Parameters
/// ----------
/// arguments : list of str
///     The first is the name of the program.
///
/// Returns
/// -------
/// int
///     Exit code: 0 done, 1 failed, 2 wrong usage.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
fn program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| squirrel_cli::run(arguments))
}

/// The compiled part of squirrel; import `squirrel` instead.
#[pymodule]
mod _squirrel {
    #[pymodule_export]
    use super::batch::Batch;
    #[pymodule_export]
    use super::batch::rollout::rollout;
    #[pymodule_export]
    use super::control::{Backstepping, Twcc};
    #[pymodule_export]
    use super::dynamics::{derivative, rk4_step};
    #[pymodule_export]
    use super::flight::simulate;
    #[pymodule_export]
    use super::gap::{gap_check, gap_diagnose, gap_effects, gap_find};
    #[pymodule_export]
    use super::interrupt::looks;
    #[pymodule_export]
    use super::log::{FlightLog, read_log};
    #[pymodule_export]
    use super::nn::{Model, forward, load, train, windows};
    #[pymodule_export]
    use super::pickle::again;
    #[pymodule_export]
    use super::plan::{plan_reach, plan_trajectory};
    #[pymodule_export]
    use super::policy::Policy;
    #[pymodule_export]
    use super::program;
    #[pymodule_export]
    use super::stack::Stack;
    #[pymodule_export]
    use super::stubs;
    #[pymodule_export]
    use super::task::Tasks;
    #[pymodule_export]
    use super::vehicle::Vehicle;

    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "Python's name")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}

pyo3_stub_gen::module_variable!("squirrel._squirrel", "__version__", String);
pyo3_stub_gen::export_verbatim!("squirrel._squirrel", "__version__");

/// Text of `_squirrel.pyi`, for the test that holds the file to the code. Here, because only the
/// crate that declares them finds its own declarations; only where the sources are.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
fn stubs() -> PyResult<String> {
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let name = "squirrel._squirrel";
    StubInfo::from_project_root(name.to_owned(), here, true, StubGenConfig::default())
        .map_err(error::value)?
        .modules
        .get(name)
        .map(ToString::to_string)
        .ok_or_else(|| error::value(format!("{name} is not there")))
}
