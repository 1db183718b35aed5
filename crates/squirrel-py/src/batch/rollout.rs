//! A batch that is looked at after every command.

use super::{Batch, settings};
use crate::arguments::{ArrayAny, Float, Numbers, is_32, rows};
use crate::interrupt::look;
use crate::scalars;
use crate::vehicle::Vehicle;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3_stub_gen::derive::gen_stub_pyfunction;
use squirrel_batch::BODY_NUMBERS;

/// Fly many vehicles under given commands and keep every motion.
///
/// The dynamics are those of `Batch`, and so are the bits.
///
/// Parameters
/// ----------
/// vehicles : sequence of Vehicle
///     ``[vehicle] * n`` for n that are alike.
/// whole : bool
///     As for `Batch`: whether wings, batteries and effects fly, or the base model alone.
/// state : ndarray of float32 or float64, shape (n, 13 + rotors)
///     Where they start, as `Batch.states` gives it; its dtype is that of the flight.
/// command : ndarray of the same dtype, shape (periods, n, rotors)
///     Held for a period each.
/// wing_command : ndarray of the same dtype, shape (periods, n, 2), optional
///     Left and right, 0 folded to 1 spread; folded if left out.
/// steps_per_command : int
///     Steps of a period.
/// dt_s : float
///     Step.
/// scheme : str
///     ``rk4`` or ``euler``.
/// wind_ned_m_s : ndarray of the same dtype, shape (n, 3), optional
///     Velocity of the air, which has no gusts then, not even those of the effect ``gust``; calm if left out.
/// threads : int, optional
///     That work; as many as there are cores if left out.
///
/// Returns
/// -------
/// ndarray of the same dtype, shape (periods, n, 13 + rotors)
///     Motions at the end of each period.
///
/// Raises
/// ------
/// ValueError
///     Names the argument, what was expected and what came.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[pyo3(signature = (*, vehicles, whole = true, state, command, wing_command = None, steps_per_command = 1, dt_s = 1e-3, scheme = "rk4", wind_ned_m_s = None, threads = None))]
#[gen_stub(override_return_type(type_repr = "numpy.typing.NDArray[typing.Any]", imports = ("numpy.typing", "typing")))]
pub(crate) fn rollout<'py>(
    py: Python<'py>,
    vehicles: Vec<Bound<'py, Vehicle>>,
    whole: bool,
    state: ArrayAny<'py>,
    command: ArrayAny<'py>,
    wing_command: Option<ArrayAny<'py>>,
    #[pyo3(from_py_with = scalars::steps_per_command)] steps_per_command: usize,
    #[pyo3(from_py_with = scalars::dt_s)] dt_s: f64,
    #[gen_stub(override_type(type_repr = "flight.Scheme", imports = ("squirrel.flight")))]
    scheme: &str,
    wind_ned_m_s: Option<ArrayAny<'py>>,
    #[pyo3(from_py_with = scalars::threads)] threads: Option<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let in_32 = is_32(&state.0);
    let batch = Batch::make(py, vehicles, settings(dt_s, scheme, threads, None)?, in_32, whole)?;
    batch.reset(py, state, None)?;
    if let Some(wind) = wind_ned_m_s {
        batch.set_wind(py, wind)?;
    }
    if in_32 {
        periods::<f32>(py, &batch, &command, wing_command.as_ref(), steps_per_command)
    } else {
        periods::<f64>(py, &batch, &command, wing_command.as_ref(), steps_per_command)
    }
}

/// The motions of all periods.
fn periods<'py, T: Float>(
    py: Python<'py>,
    batch: &Batch,
    command: &ArrayAny<'py>,
    wing_command: Option<&ArrayAny<'py>>,
    steps: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let rotors = batch.lock(py)?.batch.rotors();
    let (n, width) = (batch.vehicles, BODY_NUMBERS + rotors);
    let commands =
        rows::<T>("command", &command.0, &[None, Some(n), Some(rotors)], Numbers::Finite)?;
    let count = commands.numbers().len() / (n * rotors);
    if let Some(wings) = wing_command {
        rows::<T>("wing_command", &wings.0, &[Some(count), Some(n), Some(2)], Numbers::Finite)?;
        batch.needs(batch.has_wings, "wings")?;
    }
    let out = PyArray1::<T>::zeros(py, [commands.numbers().len() / rotors * width], false);
    let out = out.reshape([count, n, width])?;
    for period in 0..count {
        let command = command.0.get_item(period)?;
        batch.command(py, ArrayAny(command))?;
        if let Some(wings) = wing_command {
            batch.command_wings(py, ArrayAny(wings.0.get_item(period)?))?;
        }
        batch.step(py, steps)?;
        let row = out.get_item(period)?;
        batch.lock(py)?.batch.states(py, Some(row))?;
        look(py)?;
    }
    Ok(out.into_any())
}
