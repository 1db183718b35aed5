//! Vehicles: what flies, as a file says it.

use crate::error;
use crate::kept::{broken, reduced};
use crate::keys::{set, table_of, to_python, to_toml};
use crate::scalars;
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyIterator, PyList, PyTuple};
use pyo3_stub_gen::derive::{gen_stub_pyclass, gen_stub_pymethods};
use squirrel_log::files::write_whole;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::vehicle_file::new::{Frame, Given, NewError, Said};
use squirrel_sim::weights::ParnnWeights;
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, Value};

/// A vehicle: airframe, rotors, wings, battery, gains, sensors and effects, checked when it is made
/// and never changed.
///
/// Keys are those of vehicle files, with the unit in the name:
/// ``mass.mass_kg``, ``rotor[0].position_body_m``, ``effects.battery_sag.voltage_exponent``.
///
/// Examples
/// --------
/// >>> import squirrel
/// >>> vehicle = squirrel.Vehicle.bundled("squirrel")
/// >>> vehicle["mass.mass_kg"]
/// 0.548
/// >>> heavier = vehicle.edited({"mass.mass_kg": 0.6})
#[gen_stub_pyclass]
#[pyclass(frozen, module = "squirrel._squirrel", mapping)]
#[derive(Debug)]
pub(crate) struct Vehicle {
    pub(crate) file: VehicleFile,
}

#[gen_stub_pymethods]
#[pymethods]
impl Vehicle {
    /// Read and check a vehicle file, and the weights that it names.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     Vehicle file (TOML).
    ///
    /// Returns
    /// -------
    /// Vehicle
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be read.
    /// ValueError
    ///     One line that names the file, the field and the value.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        Ok(Self { file: VehicleFile::load(&path).map_err(|e| error::vehicle(&e))? })
    }

    /// A vehicle that comes with the package.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     ``squirrel`` (the paper's), ``squirrel_air`` (the same with measured rotors),
    ///     ``crazyflie21_brushed``, ``crazyflie21_brushed_curve``, ``crazyflie21_datasheet`` or
    ///     ``crazyflie2_arpl``.
    ///
    /// Returns
    /// -------
    /// Vehicle
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     There is none of this name.
    #[staticmethod]
    fn bundled(name: &str) -> PyResult<Self> {
        // Not a file that cannot be read: a wrong argument.
        let file = VehicleFile::bundled(name).map_err(|e| error::value(format!("name = {e}")))?;
        Ok(Self { file })
    }

    /// A first vehicle from what its owner knows; what is not given is guessed from published machines.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     ``quad-x``, ``quad-plus``, ``hexa-x``, ``hexa-plus``, ``octo-x``, ``octo-plus`` (rotors numbered as PX4 and ArduPilot do),
    ///     ``quad-x-betaflight`` or ``quad-x-crazyflie``.
    /// mass_kg : float
    ///     Ready to fly.
    /// arm_m : float, optional
    ///     From the centre to a hub; needed where the propeller is not given.
    /// propeller_inch, pitch_inch : float, optional
    ///     Diameter and pitch of the propellers.
    /// cells : int, optional
    ///     Of the battery, in series.
    /// kv_rpm_per_v : float, optional
    ///     Speed of a motor without load over voltage.
    /// capacity_ah : float, optional
    ///     Of the battery.
    /// hover_thrust_fraction : float, optional
    ///     Thrust in hover over the most thrust.
    /// name : str
    ///     Name of the vehicle.
    ///
    /// Returns
    /// -------
    /// Vehicle
    ///     Each guessed number has its tolerance, and a source that begins with "guess".
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     One line that names what is missing, or the number that cannot be.
    ///
    /// Examples
    /// --------
    /// >>> import squirrel
    /// >>> vehicle = squirrel.Vehicle.new(frame="quad-x", mass_kg=0.75, propeller_inch=5.0)
    /// >>> vehicle["mass.mass_kg"]
    /// 0.75
    #[staticmethod]
    #[pyo3(name = "new", signature = (*, frame, mass_kg, arm_m = None, propeller_inch = None, pitch_inch = None, cells = None, kv_rpm_per_v = None, capacity_ah = None, hover_thrust_fraction = None, name = "vehicle"))]
    fn first(
        frame: &str,
        #[pyo3(from_py_with = scalars::mass_kg)] mass_kg: f64,
        #[pyo3(from_py_with = scalars::arm_m)] arm_m: Option<f64>,
        #[pyo3(from_py_with = scalars::propeller_inch)] propeller_inch: Option<f64>,
        #[pyo3(from_py_with = scalars::pitch_inch)] pitch_inch: Option<f64>,
        #[pyo3(from_py_with = scalars::cells)] cells: Option<u32>,
        #[pyo3(from_py_with = scalars::kv_rpm_per_v)] kv_rpm_per_v: Option<f64>,
        #[pyo3(from_py_with = scalars::capacity_ah)] capacity_ah: Option<f64>,
        #[pyo3(from_py_with = scalars::hover_thrust_fraction)] hover_thrust_fraction: Option<f64>,
        name: &str,
    ) -> PyResult<Self> {
        let said = |value: Option<f64>, argument: &str| {
            value.map(|value| Said { value, source: argument.to_owned() })
        };
        let given = Given {
            name: name.to_owned(),
            frame: Some(Frame::parse(frame).map_err(|e| error::value(format!("frame = {e}")))?),
            mass_kg: said(Some(mass_kg), "mass_kg"),
            arm_m: said(arm_m, "arm_m"),
            propeller_inch: said(propeller_inch, "propeller_inch"),
            pitch_inch: said(pitch_inch, "pitch_inch"),
            cells: said(cells.map(f64::from), "cells"),
            kv_rpm_per_v: said(kv_rpm_per_v, "kv_rpm_per_v"),
            capacity_ah: said(capacity_ah, "capacity_ah"),
            hover_thrust_fraction: said(hover_thrust_fraction, "hover_thrust_fraction"),
            ..Given::default()
        };
        match given.vehicle_file() {
            Ok(file) => Ok(Self { file }),
            Err(NewError::Missing(_)) => {
                Err(error::value("propeller_inch: missing; give it or arm_m"))
            }
            Err(other) => Err(error::value(other)),
        }
    }

    /// Check the text of a vehicle file.
    ///
    /// Parameters
    /// ----------
    /// text : str
    ///     TOML.
    /// name : str
    ///     What errors call it.
    ///
    /// Returns
    /// -------
    /// Vehicle
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     One line that names the field and the value.
    #[staticmethod]
    #[pyo3(signature = (text, name = "text"))]
    pub(crate) fn parse(text: &str, name: &str) -> PyResult<Self> {
        Ok(Self { file: VehicleFile::parse(text, name).map_err(|e| error::vehicle(&e))? })
    }

    /// The vehicle with other numbers, checked anew; comments and order of the text stay.
    ///
    /// Parameters
    /// ----------
    /// changes : dict of str to object
    ///     By key: number, text, truth value or (nested) list or array; None takes the key out. A number that has a deviation keeps it
    ///     and loses its source.
    ///
    /// Returns
    /// -------
    /// Vehicle
    ///     The old one stays as it was.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     One line that names the field and the value.
    fn edited(&self, changes: BTreeMap<String, Bound<'_, PyAny>>) -> PyResult<Self> {
        let mut document = self.document()?;
        for (key, new) in &changes {
            let new = if new.is_none() { None } else { Some(to_toml(key, new, 0)?) };
            set(&mut document, key, new).map_err(|why| error::value(format!("{key}: {why}")))?;
        }
        let weights = self.file.weights.clone();
        let file = VehicleFile::parse_with(&document.to_string(), &self.file.name, weights);
        Ok(Self { file: file.map_err(|e| error::vehicle(&e))? })
    }

    /// Write the vehicle file; it appears under its name only when it is whole.
    ///
    /// Weights that are not the package's own are not copied beside it.
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
    fn save(&self, path: PathBuf) -> PyResult<()> {
        write_file(&path, self.file.text.as_bytes())
    }

    /// What a careful reader still wants to know of a vehicle whose numbers are all sound, as every
    /// vehicle's are.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     Keys of numbers that the file gives without a source.
    fn validate(&self) -> Vec<String> {
        self.file.without_source().map(str::to_owned).collect()
    }

    /// Keys of all numbers.
    ///
    /// Returns
    /// -------
    /// list of str
    fn keys(&self) -> Vec<String> {
        self.file.provenance.iter().map(|(field, _)| field.clone()).collect()
    }

    /// Where a number comes from.
    ///
    /// Parameters
    /// ----------
    /// key : str
    ///     One of `keys()`.
    ///
    /// Returns
    /// -------
    /// str or None
    ///     None where the file does not say.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     The file has no number of this key.
    fn source(&self, key: &str) -> PyResult<Option<String>> {
        let found = self.file.provenance.iter().find(|(field, _)| field == key);
        found.map(|(_, p)| p.source.clone()).ok_or_else(|| PyKeyError::new_err(key.to_owned()))
    }

    #[gen_stub(override_return_type(type_repr = "typing.Any", imports = ("typing")))]
    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        let own = self.value(key)?.ok_or_else(|| PyKeyError::new_err(key.to_owned()))?;
        to_python(py, &own)
    }

    #[gen_stub(override_return_type(type_repr = "bool"))]
    fn __contains__(
        &self,
        #[gen_stub(override_type(type_repr = "object"))] key: &Bound<'_, PyAny>,
    ) -> PyResult<bool> {
        // As a dictionary: what is no text is no key.
        let Ok(key) = key.extract::<String>() else { return Ok(false) };
        Ok(self.value(&key)?.is_some())
    }

    #[gen_stub(override_return_type(type_repr = "typing.Iterator[str]", imports = ("typing")))]
    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        PyList::new(py, self.keys())?.try_iter()
    }

    fn __len__(&self) -> usize {
        self.file.provenance.len()
    }

    /// Whether the other is a vehicle of the same file and the same weights.
    fn __eq__(
        &self,
        #[gen_stub(override_type(type_repr = "object"))] other: &Bound<'_, PyAny>,
    ) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let (own, other) = (&self.file, &other.get().file);
            own.text == other.text && own.name == other.name && own.weights == other.weights
        })
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (&self.file.name, &self.file.text).hash(&mut hasher);
        hasher.finish()
    }

    #[gen_stub(override_return_type(type_repr = "tuple[typing.Any, ...]", imports = ("typing")))]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let weights = self.file.weights.as_ref().map(ParnnWeights::to_hex);
        reduced(py, "Vehicle", (&self.file.name, &self.file.text, weights))
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

    /// Name of the vehicle.
    #[getter]
    fn name(&self) -> &str {
        &self.file.name
    }

    /// Text of its file.
    #[getter]
    fn text(&self) -> &str {
        &self.file.text
    }

    /// Number of rotors.
    #[getter]
    fn rotor_count(&self) -> usize {
        self.file.vehicle.rotors().len()
    }

    /// The command of each rotor that carries the weight, in the unit of the vehicle's commands.
    #[getter]
    fn hover_command(&self) -> f64 {
        let vehicle = &self.file.vehicle;
        let share_n = vehicle.weight_n() / vehicle.rotors().len() as f64;
        vehicle.parameters().propulsion.command_for_thrust(share_n)
    }

    fn _repr_html_(own: &Bound<'_, Self>) -> PyResult<String> {
        own.py().import("squirrel._html")?.call_method1("vehicle", (own,))?.extract()
    }

    fn __repr__(&self) -> String {
        let vehicle = &self.file.vehicle;
        let (name, rotors) = (&self.file.name, vehicle.rotors().len());
        format!("<Vehicle {name}: {} kg, {rotors} rotors>", vehicle.parameters().mass_kg)
    }
}

impl Vehicle {
    /// What pickle kept.
    pub(crate) fn again(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let state: Result<(String, String, Option<String>), _> = state.extract();
        let (name, text, weights) = state.map_err(|_: PyErr| broken("Vehicle"))?;
        let weights = weights.map(|hex| ParnnWeights::from_hex(&name, &hex)).transpose();
        let weights = weights.map_err(|e| error::weights(&e))?;
        let file = VehicleFile::parse_with(&text, &name, weights);
        Ok(Self { file: file.map_err(|e| error::vehicle(&e))? })
    }

    /// The value of a key, if there is one.
    fn value(&self, key: &str) -> PyResult<Option<Value>> {
        let mut document = self.document()?;
        let Ok((table, name)) = table_of(&mut document, key, false) else { return Ok(None) };
        let Some(item) = table.get(name) else { return Ok(None) };
        let own = item.as_table_like().and_then(|long| long.get("value")).unwrap_or(item);
        Ok(own.as_value().cloned())
    }

    fn document(&self) -> PyResult<DocumentMut> {
        self.file.text.parse().map_err(error::value)
    }
}

/// The vehicle of an argument that may be left out: the paper's.
pub(crate) fn or_squirrel(vehicle: Option<&Bound<'_, Vehicle>>) -> VehicleFile {
    vehicle.map_or_else(VehicleFile::squirrel, |given| given.get().file.clone())
}

/// The vehicle of an argument that may be its file or the name of a bundled one, too.
pub(crate) fn found(object: &Bound<'_, PyAny>) -> PyResult<Option<VehicleFile>> {
    if object.is_none() {
        return Ok(None);
    }
    if let Ok(given) = object.cast::<Vehicle>() {
        return Ok(Some(given.get().file.clone()));
    }
    let path: PathBuf = object.extract().map_err(|_| {
        let kind = object.get_type().name().map_or_else(|_| String::new(), |n| n.to_string());
        PyTypeError::new_err(format!("vehicle: expected a Vehicle, a file or a name, got {kind}"))
    })?;
    VehicleFile::find(&path).map(Some).map_err(|e| error::vehicle(&e))
}

/// Writes a file, whole or not at all.
pub(crate) fn write_file(path: &Path, content: &[u8]) -> PyResult<()> {
    write_whole(path, content)
        .map_err(|e| error::system(e.kind(), format!("{}: {e}", path.display())))
}
