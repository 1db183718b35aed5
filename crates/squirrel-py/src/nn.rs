//! Learned models of the wing force.

use crate::arguments::{Array32, Numbers, rows};
use crate::error::{self, value};
use crate::gap::named;
use crate::interrupt::{interruptible, look};
use crate::json;
use crate::kept::{broken, reduced};
use crate::log::table;
use crate::scalars;
use crate::state::check_attitudes;
use crate::vehicle::{Vehicle, or_squirrel};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use pyo3_stub_gen::derive::{gen_stub_pyclass, gen_stub_pyfunction, gen_stub_pymethods};
use squirrel_core::rnn::parnn::{INPUTS, WINDOW};
use squirrel_nn::NnError;
use squirrel_nn::labels;
use squirrel_nn::model::Model as Kind;
use squirrel_nn::train::{Epoch, Settings, Trainer};
use squirrel_nn::trained::Trained;
use squirrel_nn::windows::{Window, Windows};
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A trained model of the force on spread wings: its parameters, and where they come from.
#[gen_stub_pyclass]
#[pyclass(frozen, module = "squirrel._squirrel")]
pub(crate) struct Model {
    trained: Trained,
    history: Vec<Epoch>,
}

impl Model {
    /// What pickle kept.
    pub(crate) fn again(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let broken = || broken("Model");
        let state: Result<(String, Bound<'_, PyBytes>, String), _> = state.extract();
        let (card, bytes, history) = state.map_err(|_: PyErr| broken())?;
        let card = serde_json::from_str(&card).map_err(|_| broken())?;
        let history = serde_json::from_str(&history).map_err(|_| broken())?;
        let (numbers, rest) = bytes.as_bytes().as_chunks::<4>();
        let parameters = numbers.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        let trained = Trained::of(card, parameters).map_err(|e| error::nn(&e))?;
        if rest.is_empty() { Ok(Self { trained, history }) } else { Err(broken()) }
    }
}

#[gen_stub_pymethods]
#[pymethods]
impl Model {
    /// Write a safetensors file; it appears under its name only when it is whole.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File to write. A vehicle file may name it: ``wing.parnn_weights``.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The disk refuses.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        self.trained.save(&path).map_err(|e| error::nn(&e))
    }

    /// Parameters by name.
    ///
    /// Returns
    /// -------
    /// dict of str to ndarray of float32
    ///     Matrices are (inputs, outputs): ``y = x @ weight + bias``.
    #[gen_stub(override_return_type(type_repr = "dict[str, numpy.typing.NDArray[numpy.float32]]", imports = ("numpy", "numpy.typing")))]
    fn tensors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let tensors = PyDict::new(py);
        let mut left = self.trained.parameters();
        for (name, shape) in self.trained.card.model.tensors() {
            let (numbers, rest) = left.split_at(shape.iter().product());
            tensors.set_item(name, PyArray1::from_slice(py, numbers).reshape(shape)?)?;
            left = rest;
        }
        Ok(tensors)
    }

    /// The same model with other parameters, as something else trained them.
    ///
    /// Parameters
    /// ----------
    /// tensors : dict of str to ndarray of float32
    ///     Names and shapes of `tensors()`.
    ///
    /// Returns
    /// -------
    /// Model
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A tensor is missing or unknown, of another dtype or shape, or not finite.
    fn with_tensors(&self, tensors: BTreeMap<String, Array32<'_>>) -> PyResult<Self> {
        let named = self.trained.card.model.tensors();
        if let Some(name) = tensors.keys().find(|name| named.iter().all(|(own, _)| own != name)) {
            return Err(value(format!("tensors: {name}: the model has no such tensor")));
        }
        let mut parameters = Vec::new();
        for (name, shape) in named {
            let Some(array) = tensors.get(name) else {
                return Err(value(format!("tensors: {name}: missing")));
            };
            let shape: Vec<_> = shape.into_iter().map(Some).collect();
            parameters
                .extend_from_slice(rows::<f32>(name, &array.0, &shape, Numbers::Finite)?.numbers());
        }
        let trained = self.trained.with_parameters(parameters).map_err(|e| error::nn(&e))?;
        Ok(Self { trained, history: Vec::new() })
    }

    /// Where the weights come from: model, vehicle, area, what was flown in training, seed,
    /// figures.
    #[getter]
    #[gen_stub(override_return_type(type_repr = "dict[str, typing.Any]", imports = ("typing")))]
    fn card<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json(py, &self.trained.card)
    }

    /// Root mean squared errors of each epoch, N, shape (epochs, 2): over the training windows
    /// while the weights moved, and over the validation windows after it (NaN where there are
    /// none). Empty for a model that was loaded.
    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let numbers = self
            .history
            .iter()
            .flat_map(|e| [e.training.sqrt(), e.validation.map_or(f64::NAN, f64::sqrt)]);
        table(py, numbers.collect(), 2)
    }

    #[gen_stub(override_return_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let bytes: Vec<u8> =
            self.trained.parameters().iter().flat_map(|x| x.to_le_bytes()).collect();
        let card = serde_json::to_string(&self.trained.card).map_err(value)?;
        let history = serde_json::to_string(&self.history).map_err(value)?;
        reduced(py, "Model", (card, PyBytes::new(py, &bytes), history))
    }

    /// The same: it never changes.
    fn __copy__(own: PyRef<'_, Self>) -> PyRef<'_, Self> {
        own
    }

    /// The same: it never changes.
    fn __deepcopy__<'py>(
        own: PyRef<'py, Self>,
        #[gen_stub(override_type(type_repr = "typing.Any", imports = ("typing")))] memo: &Bound<
            'py,
            PyAny,
        >,
    ) -> PyRef<'py, Self> {
        let _ = memo;
        own
    }

    fn __repr__(&self) -> String {
        let card = &self.trained.card;
        format!(
            "<Model {} of {}: {} parameters>",
            card.model.name(),
            card.vehicle,
            self.trained.parameters().len()
        )
    }
}

/// Read weights.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     A safetensors file of squirrel.
///
/// Returns
/// -------
/// Model
///
/// Raises
/// ------
/// OSError
///     The file cannot be read.
/// ValueError
///     One line that names the file, and the tensor or field with its value.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
pub(crate) fn load(path: PathBuf) -> PyResult<Model> {
    let trained = Trained::load(&path).map_err(|e| error::nn(&e))?;
    Ok(Model { trained, history: Vec::new() })
}

/// Force of the air on the spread wings at the end of windows.
///
/// Parameters
/// ----------
/// model : Model
/// rows : ndarray of float32, shape (n, 10, 2)
///     What the network sees at 10 Hz, oldest first: speed over 10 m/s, angle of attack in rad.
/// velocity_body_m_s : ndarray of float32, shape (n, 3)
///     At the last row, relative to what `rows` were made with.
/// q_ned_from_body_wxyz : ndarray of float32, shape (n, 4), optional
///     Attitude at the last row; only the model ``vanilla``, which speaks NED, asks for it.
///
/// Returns
/// -------
/// ndarray of float32, shape (n, 3)
///     N, body frame.
///
/// Raises
/// ------
/// ValueError
///     Names the argument, what was expected and what came.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[pyo3(signature = (model, *, rows, velocity_body_m_s, q_ned_from_body_wxyz = None))]
pub(crate) fn forward<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    rows: Array32<'py>,
    velocity_body_m_s: Array32<'py>,
    q_ned_from_body_wxyz: Option<Array32<'py>>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let trained = &model.get().trained;
    let seen =
        self::rows::<f32>("rows", &rows.0, &[None, Some(WINDOW), Some(INPUTS)], Numbers::Finite)?;
    let n = Some(seen.numbers().len() / (WINDOW * INPUTS));
    let velocity = self::rows::<f32>(
        "velocity_body_m_s",
        &velocity_body_m_s.0,
        &[n, Some(3)],
        Numbers::Finite,
    )?;
    let name = "q_ned_from_body_wxyz";
    let attitude = q_ned_from_body_wxyz
        .map(|q| self::rows::<f32>(name, &q.0, &[n, Some(4)], Numbers::Finite))
        .transpose()?;
    match &attitude {
        Some(attitude) => check_attitudes(name, attitude.numbers(), 4, 0)?,
        None if trained.card.model == Kind::VanillaNed => {
            return Err(value(format!("{name}: missing; the model vanilla speaks NED")));
        }
        None => {}
    }
    let window = |(i, rows): (usize, &[f32])| Window {
        rows: std::array::from_fn(|k| std::array::from_fn(|j| rows[k * INPUTS + j])),
        velocity_body_m_s: velocity.row(i),
        q_ned_from_body_wxyz: attitude.as_ref().map_or([1.0, 0.0, 0.0, 0.0], |q| q.row(i)),
        label_body_n: [0.0; 3],
        truth_body_n: None,
    };
    let windows: Vec<Window> =
        seen.numbers().chunks_exact(WINDOW * INPUTS).enumerate().map(window).collect();
    let mut forces = Vec::with_capacity(windows.len());
    for some in windows.chunks(WINDOWS_A_LOOK) {
        forces.extend(py.detach(|| trained.forces_body_n(some)));
        look(py)?;
    }
    table(py, forces.into_flattened(), 3)
}

/// Windows between two looks at Ctrl-C: some hundredths of a second. A block of registers divides
/// it, so that the bits are those of all at once.
const WINDOWS_A_LOOK: usize = 4096;

/// Windows of all flights; Ctrl-C ends it between two of them.
fn windows_of(
    py: Python<'_>,
    vehicle: &VehicleFile,
    flights: &Bound<'_, PyDict>,
) -> PyResult<Windows> {
    let mut all = Windows::new();
    for flight in named("flights", flights) {
        look(py)?;
        let (name, log) = flight?;
        let log = &log.get().log;
        let found =
            py.detach(|| labels::windows(vehicle, &name, log)).map_err(|e| error::nn(&e))?;
        all.push(&name, &found).map_err(|e| error::nn(&e))?;
    }
    Ok(all)
}

/// What models learn from: windows of flights, with the force that was there at their end.
///
/// Parameters
/// ----------
/// flights : dict of str to FlightLog
///     By name.
/// vehicle : Vehicle, optional
///     That flew; the paper's squirrel if left out.
///
/// Returns
/// -------
/// dict of str to ndarray of float32
///     ``rows`` (n, 10, 2) and ``velocity_body_m_s`` (n, 3), ``q_ned_from_body_wxyz`` (n, 4) as `forward` takes them, ``label_body_n`` (n, 3) by the
///     accelerometer, ``truth_body_n`` (n, 3) where a simulator knows it and NaN elsewhere.
///
/// Raises
/// ------
/// ValueError
///     One line that names the flight, and the channel that it lacks or that cannot be.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[pyo3(signature = (flights, *, vehicle = None))]
#[gen_stub(override_return_type(type_repr = "dict[str, numpy.typing.NDArray[numpy.float32]]", imports = ("numpy", "numpy.typing")))]
pub(crate) fn windows<'py>(
    py: Python<'py>,
    #[gen_stub(override_type(type_repr = "dict[str, FlightLog]"))] flights: &Bound<'py, PyDict>,
    vehicle: Option<&Bound<'py, Vehicle>>,
) -> PyResult<Bound<'py, PyDict>> {
    let windows = windows_of(py, &or_squirrel(vehicle), flights)?;
    let all = windows.all();
    let array = |numbers: Vec<f32>, shape: &[usize]| -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        PyArray1::from_vec(py, numbers).reshape(shape)
    };
    let n = all.len();
    let out = PyDict::new(py);
    out.set_item(
        "rows",
        array(
            all.iter().flat_map(|w| w.rows.into_iter().flatten()).collect(),
            &[n, WINDOW, INPUTS],
        )?,
    )?;
    out.set_item(
        "velocity_body_m_s",
        array(all.iter().flat_map(|w| w.velocity_body_m_s).collect(), &[n, 3])?,
    )?;
    out.set_item(
        "q_ned_from_body_wxyz",
        array(all.iter().flat_map(|w| w.q_ned_from_body_wxyz).collect(), &[n, 4])?,
    )?;
    out.set_item(
        "label_body_n",
        array(all.iter().flat_map(|w| w.label_body_n).collect(), &[n, 3])?,
    )?;
    let truth = all.iter().flat_map(|w| w.truth_body_n.unwrap_or([f32::NAN; 3]));
    out.set_item("truth_body_n", array(truth.collect(), &[n, 3])?)?;
    Ok(out)
}

/// Train a model of the wing force on flights. Ctrl-C ends it.
///
/// Parameters
/// ----------
/// flights : dict of str to FlightLog
///     By name.
/// model : str
///     ``parnn`` (the paper's), ``parnn_window_1``, ``vanilla``, ``vanilla_body``, ``vanilla_plane``, ``flat_plate`` or ``scaled_flat_plate``.
/// vehicle : Vehicle, optional
///     That flew; the paper's squirrel if left out.
/// validation : sequence of str, optional
///     Names of flights that are not trained on: the weights of the epoch that is best on them are kept, and training stops when they
///     get no better for `patience` epochs.
/// epochs, batch, rate, clip, patience, seed
///     Passes over the windows at most; windows a step; first rate of Adam; longest gradient, N^2; of first weights and order.
///
/// Returns
/// -------
/// Model
///     With its `Model.history`. Equal arguments give equal bits.
///
/// Raises
/// ------
/// ValueError
///     One line that names the argument, the flight or the channel.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[pyo3(signature = (flights, *, model = "parnn", vehicle = None, validation = None, epochs = 800, batch = 256, rate = 3e-3, clip = 5.0, patience = 200, seed = 0))]
pub(crate) fn train(
    py: Python<'_>,
    #[gen_stub(override_type(type_repr = "dict[str, FlightLog]"))] flights: &Bound<'_, PyDict>,
    model: &str,
    vehicle: Option<&Bound<'_, Vehicle>>,
    validation: Option<Vec<String>>,
    #[pyo3(from_py_with = scalars::epochs)] epochs: usize,
    #[pyo3(from_py_with = scalars::batch)] batch: usize,
    #[pyo3(from_py_with = scalars::rate)] rate: f64,
    #[pyo3(from_py_with = scalars::clip)] clip: f64,
    #[pyo3(from_py_with = scalars::patience)] patience: usize,
    #[pyo3(from_py_with = scalars::seed)] seed: u64,
) -> PyResult<Model> {
    let fail = |e: NnError| error::nn(&e);
    let kind: Kind = model.parse().map_err(fail)?;
    if batch == 0 {
        return Err(value("batch = 0: must be at least 1"));
    }
    if flights.is_empty() {
        return Err(value("flights: none given"));
    }
    let vehicle = or_squirrel(vehicle);
    let validation = validation.unwrap_or_default();
    let held_out: Vec<&str> = validation.iter().map(String::as_str).collect();
    let split = windows_of(py, &vehicle, flights)?.split(&held_out);
    let (training, validation) = split.map_err(|e| value(format!("validation: {e}")))?;
    let settings = Settings { epochs, batch, rate, clip, patience, seed };
    let area_m2 = labels::plate_area_m2(&vehicle);
    let trained = interruptible(py, move |stop| {
        let mut trainer =
            Trainer::new(kind, &vehicle.name, area_m2, &training, &validation, settings)?;
        while trainer.epoch()?.is_some() {
            stop.check();
        }
        Ok::<_, NnError>(Model { trained: trainer.best(), history: trainer.history().to_vec() })
    })?;
    trained.map_err(fail)
}
