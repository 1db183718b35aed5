//! Flight logs as arrays.

use crate::error;
use crate::interrupt::interruptible;
use crate::kept::{broken, reduced};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyIterator, PyList, PyTuple};
use pyo3_stub_gen::derive::{gen_stub_pyclass, gen_stub_pyfunction, gen_stub_pymethods};
use squirrel_log::LogError;
use squirrel_log::import::Reading;
use squirrel_sim::flight::Metrics;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Read a log, whoever wrote it.
///
/// Logs of squirrel, of PX4 (ULog), ArduPilot (dataflash), Betaflight and INAV (blackbox), Crazyflies
/// (micro-SD) and ROS 2 bags of known types (MCAP) say themselves what their channels are; others
/// need a map.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     The log.
/// map : str or os.PathLike, optional
///     Import map (TOML) from columns to channels, or the name of a built-in one: ``nanobench``,
///     ``crazypad``, ``arpl``.
/// topics : list of str, optional
///     Topics of a ROS 2 bag to take where several say the same.
///
/// Returns
/// -------
/// FlightLog
///
/// Raises
/// ------
/// OSError
///     A file cannot be read.
/// ValueError
///     One line that names the file and what is wrong with it.
///
/// Examples
/// --------
/// >>> import squirrel, tempfile, pathlib
/// >>> path = pathlib.Path(tempfile.mkdtemp()) / "hover.mcap"
/// >>> squirrel.simulate(scenario="hover").write(path)
/// >>> squirrel.read_log(path)["gnss.position_ned_m"].shape[1]
/// 3
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[pyo3(signature = (path, *, map = None, topics = None))]
pub(crate) fn read_log(
    py: Python<'_>,
    path: PathBuf,
    map: Option<PathBuf>,
    topics: Option<Vec<String>>,
) -> PyResult<FlightLog> {
    let log = interruptible(py, move |_| {
        // A map says what it is; else it may be one of our own.
        if map.is_none() && !path.is_dir() {
            match squirrel_log::FlightLog::read(&path) {
                Err(LogError::NotMcap { .. } | LogError::Foreign { .. }) => {}
                own => return own.map_err(|e| error::log(&e)),
            }
        }
        let reading = Reading::new(&[path], map.as_deref(), &topics.unwrap_or_default());
        let read = reading.and_then(|reading| reading.import(&|_, _| {}));
        read.map(|(log, _)| log).map_err(|e| error::import(&e))
    })??;
    FlightLog::new(log, None)
}

/// A flight: sources (``imu``, ``gnss``, ``control.inner``, ...) with a time axis each, and their
/// channels as arrays.
///
/// An array is the caller's own, one copy of a column of the log. Files hold their samples row by
/// row, compressed, so that there is nothing in them to look at in place.
///
/// Examples
/// --------
/// >>> import squirrel
/// >>> log = squirrel.simulate(scenario="hover")
/// >>> log["imu.omega_body_rad_s"].shape == (log.time_s("imu").size, 3)
/// True
#[gen_stub_pyclass]
#[pyclass(frozen, module = "squirrel._squirrel", mapping)]
#[derive(Debug)]
pub(crate) struct FlightLog {
    pub(crate) log: Arc<squirrel_log::FlightLog>,
    /// As JSON.
    metrics: Option<String>,
}

/// A log as pickle keeps it: metadata, sources, metrics as JSON.
type Parts<'py> = (BTreeMap<String, String>, BTreeMap<String, Kept<'py>>, Option<String>);

/// A source as pickle keeps it: times, and channels with their widths.
type Kept<'py> = (Bound<'py, PyArray1<f64>>, BTreeMap<String, (usize, Bound<'py, PyArray1<f64>>)>);

impl FlightLog {
    pub(crate) fn new(log: squirrel_log::FlightLog, metrics: Option<Metrics>) -> PyResult<Self> {
        let metrics = metrics.map(|metrics| serde_json::to_string(&metrics)).transpose();
        Ok(Self { log: Arc::new(log), metrics: metrics.map_err(error::value)? })
    }

    /// What pickle kept.
    pub(crate) fn again(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let broken = |_: PyErr| broken("FlightLog");
        let state: Result<Parts<'_>, PyErr> = state.extract();
        let (metadata, kept, metrics) = state.map_err(broken)?;
        let mut log = squirrel_log::FlightLog { metadata, sources: BTreeMap::new() };
        for (name, (time_s, channels)) in kept {
            let time_s = time_s.to_vec().map_err(|e| broken(error::value(e)))?;
            let mut source = squirrel_log::Source { time_s, channels: BTreeMap::new() };
            for (channel, (width, values)) in channels {
                let values = values.to_vec().map_err(|e| broken(error::value(e)))?;
                if width == 0 || Some(values.len()) != source.time_s.len().checked_mul(width) {
                    return Err(broken(error::value("width")));
                }
                source.channels.insert(channel, squirrel_log::Channel { width, values });
            }
            log.sources.insert(name, source);
        }
        Ok(Self { log: Arc::new(log), metrics })
    }

    fn source(&self, name: &str) -> PyResult<&squirrel_log::Source> {
        self.log.sources.get(name).ok_or_else(|| {
            let names: Vec<&str> = self.log.sources.keys().map(String::as_str).collect();
            PyKeyError::new_err(format!(
                "source {name}: not in this log, which has {}",
                names.join(", ")
            ))
        })
    }
}

#[gen_stub_pymethods]
#[pymethods]
impl FlightLog {
    /// Read a flight log.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     MCAP file that squirrel wrote; `squirrel.read_log` reads others, too.
    ///
    /// Returns
    /// -------
    /// FlightLog
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be read.
    /// ValueError
    ///     One line that names the file and what is wrong with it: not a flight log, truncated, changed since it was written.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = interruptible(py, move |_| squirrel_log::FlightLog::read(&path))?;
        Self::new(read.map_err(|e| error::log(&e))?, None)
    }

    /// Write the log as MCAP; the file appears under its name only when it is whole.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File to write.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The disk refuses.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let log = Arc::clone(&self.log);
        interruptible(py, move |_| log.write(&path))?.map_err(|e| error::log(&e))
    }

    /// Full names of all channels.
    ///
    /// Returns
    /// -------
    /// list of str
    fn keys(&self) -> Vec<String> {
        let channels = |(source, of): (&String, &squirrel_log::Source)| {
            of.channels.keys().map(|channel| format!("{source}.{channel}")).collect::<Vec<_>>()
        };
        self.log.sources.iter().flat_map(channels).collect()
    }

    /// Names of the sources, each of which has a time axis.
    #[getter]
    fn sources(&self) -> Vec<String> {
        self.log.sources.keys().cloned().collect()
    }

    /// Times of the samples of a source.
    ///
    /// Parameters
    /// ----------
    /// source : str
    ///     One of `sources`.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (samples,)
    ///     s, increasing.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     The log lacks the source.
    fn time_s<'py>(&self, py: Python<'py>, source: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_slice(py, &self.source(source)?.time_s))
    }

    fn __getitem__<'py>(
        &self,
        py: Python<'py>,
        channel: &str,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let Some((time_s, found)) = self.log.channel(channel) else {
            return Err(PyKeyError::new_err(format!("{channel}: not in this log")));
        };
        let numbers = PyArray1::from_slice(py, &found.values);
        if found.width == 1 {
            return Ok(numbers.to_dyn().clone());
        }
        Ok(numbers.reshape([time_s.len(), found.width])?.to_dyn().clone())
    }

    fn __contains__(
        &self,
        #[gen_stub(override_type(type_repr = "object"))] channel: &Bound<'_, PyAny>,
    ) -> bool {
        channel.extract::<String>().is_ok_and(|channel| self.log.channel(&channel).is_some())
    }

    #[gen_stub(override_return_type(type_repr = "typing.Iterator[str]", imports = ("typing")))]
    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        PyList::new(py, self.keys())?.try_iter()
    }

    fn __len__(&self) -> usize {
        self.log.sources.values().map(|source| source.channels.len()).sum()
    }

    /// What the log says of the flight: vehicle, arm, scenario, seed, version.
    #[getter]
    fn metadata(&self) -> BTreeMap<String, String> {
        self.log.metadata.clone()
    }

    /// What the flight amounted to (``rmse_m``, ``height_lost_m``, ...); None of a log that was
    /// read.
    #[getter]
    #[gen_stub(override_return_type(type_repr = "flight.Metrics | None", imports = ("squirrel.flight")))]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let read = |text| py.import("json")?.call_method1("loads", (text,));
        self.metrics.as_ref().map(read).transpose()
    }

    /// A source as a pandas data frame, which must be installed.
    ///
    /// Parameters
    /// ----------
    /// source : str
    ///     One of `sources`.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame
    ///     Index ``time_s``; a channel of several numbers a sample has a column each: ``omega_body_rad_s_0``.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     The log lacks the source.
    #[gen_stub(override_return_type(type_repr = "typing.Any", imports = ("typing")))]
    fn to_pandas<'py>(&self, py: Python<'py>, source: &str) -> PyResult<Bound<'py, PyAny>> {
        let frame = extra(py, "pandas", "to_pandas")?
            .getattr("DataFrame")?
            .call1((self.columns(py, source)?,))?;
        frame.call_method1("set_index", ("time_s",))
    }

    /// A source as a polars data frame, which must be installed.
    ///
    /// Parameters
    /// ----------
    /// source : str
    ///     One of `sources`.
    ///
    /// Returns
    /// -------
    /// polars.DataFrame
    ///     Columns as for pandas, ``time_s`` the first of them.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     The log lacks the source.
    #[gen_stub(override_return_type(type_repr = "typing.Any", imports = ("typing")))]
    fn to_polars<'py>(&self, py: Python<'py>, source: &str) -> PyResult<Bound<'py, PyAny>> {
        extra(py, "polars", "to_polars")?.getattr("DataFrame")?.call1((self.columns(py, source)?,))
    }

    #[gen_stub(override_return_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let sources = PyDict::new(py);
        for (name, source) in &self.log.sources {
            let channels = PyDict::new(py);
            for (channel, found) in &source.channels {
                channels
                    .set_item(channel, (found.width, PyArray1::from_slice(py, &found.values)))?;
            }
            sources.set_item(name, (PyArray1::from_slice(py, &source.time_s), channels))?;
        }
        reduced(py, "FlightLog", (self.log.metadata.clone(), sources, self.metrics.clone()))
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

    fn _repr_html_(own: &Bound<'_, Self>) -> PyResult<String> {
        own.py().import("squirrel._html")?.call_method1("log", (own,))?.extract()
    }

    fn __repr__(&self) -> String {
        let of = |key: &str| self.log.metadata.get(key).map_or("unknown", String::as_str);
        format!("<FlightLog of {}, arm {}: {} channels>", of("vehicle"), of("arm"), self.__len__())
    }
}

impl FlightLog {
    /// One-dimensional columns by name, `time_s` first.
    fn columns<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
        let source = self.source(name)?;
        let columns = PyDict::new(py);
        columns.set_item("time_s", PyArray1::from_slice(py, &source.time_s))?;
        for (channel, found) in &source.channels {
            for k in 0..found.width {
                let label =
                    if found.width == 1 { channel.clone() } else { format!("{channel}_{k}") };
                let numbers = found.values.iter().skip(k).step_by(found.width).copied();
                columns.set_item(label, PyArray1::from_iter(py, numbers))?;
            }
        }
        Ok(columns)
    }
}

/// Rows of equal width as an array.
pub(crate) fn table<T: numpy::Element>(
    py: Python<'_>,
    numbers: Vec<T>,
    width: usize,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let rows = numbers.len() / width;
    PyArray1::from_vec(py, numbers).reshape([rows, width])
}

/// A package that squirrel can do without.
///
/// # Errors
/// `ModuleNotFoundError` that names the extra to install.
fn extra<'py>(py: Python<'py>, package: &str, method: &str) -> PyResult<Bound<'py, PyModule>> {
    let module = format!("FlightLog.{method}");
    py.import("squirrel._extra")?.call_method1("needed", (module, package, package))?;
    py.import(package)
}
