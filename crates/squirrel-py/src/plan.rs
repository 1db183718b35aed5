//! What wings make reachable, and trajectories. `squirrel/plan.py` makes dataclasses of what comes
//! back.

use crate::arguments::{Array64, Numbers, rows};
use crate::error::value;
use crate::interrupt::interruptible;
use crate::json;
use crate::log::table;
use crate::scalars;
use crate::vehicle::Vehicle;
use nalgebra::{Vector2, Vector3};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyDict};
use pyo3_stub_gen::derive::gen_stub_pyfunction;
use squirrel_core::frames::In;
use squirrel_plan::reach::{Case, Question, Reach, Support, Tilt, Wings};
use squirrel_plan::trajectory::{Air, Begin, Craft, KeepOut, Planner, Task, Wanted};
use squirrel_plan::wing::{WingForce, WingModel};
use squirrel_sim::track::TrackPoint;

/// What wings make reachable, as a case in the JSON of ``squirrel reach``, and the support function
/// along directions as arrays.
///
/// * `yaw_rad` - of the box; the heading of the velocity if left out
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[gen_stub(override_return_type(type_repr = "tuple[dict[str, typing.Any], dict[str, typing.Any] | None]", imports = ("typing")))]
pub(crate) fn plan_reach<'py>(
    py: Python<'py>,
    vehicle: &Bound<'py, Vehicle>,
    velocity_ned_m_s: [f64; 3],
    #[pyo3(from_py_with = scalars::thrust_to_weight)] thrust_to_weight: Option<f64>,
    wing: String,
    tilt: String,
    #[pyo3(from_py_with = scalars::yaw_rad)] yaw_rad: Option<f64>,
    directions: Option<Array64<'py>>,
) -> PyResult<(Bound<'py, PyAny>, Option<Bound<'py, PyDict>>)> {
    let file = &vehicle.get().file;
    let (p, weight_n) = (file.vehicle.parameters(), file.vehicle.weight_n());
    let ratio = thrust_to_weight.unwrap_or(p.limits.thrust_max_n / weight_n);
    ratio_is_sound(ratio)?;
    let [north, east, _] = velocity_ned_m_s;
    let yaw_rad = yaw_rad.unwrap_or_else(|| east.atan2(north));
    let model = WingModel::parse(&wing).map_err(value)?;
    let question = Question {
        mass_kg: p.mass_kg,
        thrust_max_n: ratio * weight_n,
        velocity: In::new(Vector3::from(velocity_ned_m_s)),
        wing: WingForce::of(file, model).map_err(value)?,
        tilt: Tilt::named(&tilt, p.limits.tilt_max_rad, yaw_rad).map_err(value)?,
    };
    let directions: Option<Vec<Vector3<f64>>> = directions
        .map(|array| {
            let rows = rows::<f64>("directions", &array.0, &[None, Some(3)], Numbers::Finite)?;
            Ok::<_, PyErr>(rows.numbers().chunks_exact(3).map(Vector3::from_column_slice).collect())
        })
        .transpose()?;
    let (case, found) = interruptible(py, move |stop| {
        let reach = Reach::new(&question)?;
        let found = directions.map(|directions| {
            let both = |d: &Vector3<f64>| {
                stop.check();
                (reach.folded(In::new(*d)).value_m_s2, reach.support(In::new(*d)))
            };
            directions.iter().map(both).collect::<Vec<_>>()
        });
        stop.check();
        Ok::<_, String>((Case::of(&question)?, found))
    })?
    .map_err(value)?;
    Ok((json(py, &case)?, found.map(|found| arrays(py, &found)).transpose()?))
}

/// A support function along many directions.
fn arrays<'py>(py: Python<'py>, found: &[(f64, Support)]) -> PyResult<Bound<'py, PyDict>> {
    let numbers =
        |number: fn(&(f64, Support)) -> f64| PyArray1::from_iter(py, found.iter().map(number));
    let vectors = |vector: fn(&Support) -> Vector3<f64>| {
        table(py, found.iter().flat_map(|(_, s)| <[f64; 3]>::from(vector(s))).collect(), 3)
    };
    let arrays = PyDict::new(py);
    arrays.set_item("folded_m_s2", numbers(|(folded, _)| *folded))?;
    arrays.set_item("value_m_s2", numbers(|(_, s)| s.value_m_s2))?;
    arrays.set_item("upper_m_s2", numbers(|(_, s)| s.upper_m_s2))?;
    arrays.set_item("thrust_n", numbers(|(_, s)| s.thrust_n))?;
    arrays.set_item("normal_ned", vectors(|s| s.normal.vector)?)?;
    arrays.set_item("acceleration_ned_m_s2", vectors(|s| s.acceleration.vector)?)?;
    let spread = found.iter().map(|(_, s)| s.wings == Wings::Spread);
    arrays.set_item("spread", PyArray1::from_iter(py, spread))?;
    Ok(arrays)
}

/// Refuses a thrust over weight that no vehicle has.
fn ratio_is_sound(ratio: f64) -> PyResult<()> {
    if ratio > 0.0 && ratio <= 100.0 {
        return Ok(());
    }
    Err(value(format!("thrust_to_weight = {ratio}: must be > 0 and <= 100")))
}

/// What a task refuses, by the names of arguments: `reference[3].position_ned_m` is
/// `reference_position_ned_m[3]`.
fn named(line: &str) -> PyErr {
    let of_reference = || {
        let (at, rest) = line.strip_prefix("reference[")?.split_once("].")?;
        let (field, rest) = rest.split_once(' ')?;
        Some(format!("reference_{field}[{at}] {rest}"))
    };
    let of_obstacles = || Some(format!("obstacles_m[{}", line.strip_prefix("obstacles[")?));
    value(of_reference().or_else(of_obstacles).unwrap_or_else(|| line.to_owned()))
}

/// A trajectory: status, cost, violation, iterations, and the nodes as arrays.
///
/// * `reference_position_ned_m` - at each node, the first at the beginning
/// * `obstacles_m` - north, east and radius of upright cylinders
/// * `wing` - what is believed of the wings; none plans without them
/// * `wind_ned_m_s` - where the air moves to
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[gen_stub(override_return_type(type_repr = "tuple[dict[str, typing.Any], dict[str, typing.Any]]", imports = ("typing")))]
pub(crate) fn plan_trajectory<'py>(
    py: Python<'py>,
    vehicle: &Bound<'py, Vehicle>,
    reference_position_ned_m: Array64<'py>,
    reference_velocity_ned_m_s: Array64<'py>,
    position_ned_m: [f64; 3],
    velocity_ned_m_s: [f64; 3],
    thrust_ned_n: Option<[f64; 3]>,
    #[pyo3(from_py_with = scalars::deployment)] deployment: f64,
    obstacles_m: Array64<'py>,
    wing: Option<String>,
    #[pyo3(from_py_with = scalars::thrust_to_weight)] thrust_to_weight: Option<f64>,
    #[pyo3(from_py_with = scalars::step_s)] step_s: f64,
    #[pyo3(from_py_with = scalars::speed_max_m_s)] speed_max_m_s: f64,
    #[pyo3(from_py_with = scalars::reserve)] reserve: f64,
    wind_ned_m_s: [f64; 3],
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let file = &vehicle.get().file;
    let (p, weight_n) = (file.vehicle.parameters(), file.vehicle.weight_n());
    thrust_to_weight.map_or(Ok(()), ratio_is_sound)?;
    let thrust_max_n = thrust_to_weight.map_or(p.limits.thrust_max_n, |ratio| ratio * weight_n);
    let model = wing.as_deref().map(WingModel::parse).transpose().map_err(value)?;
    let craft = Craft::of(file, thrust_max_n, model, reserve);
    let mut craft = craft.map_err(|line| match thrust_to_weight {
        Some(ratio) if line.contains("thrust_max_n") => {
            value(format!("thrust_to_weight = {ratio}: {line}"))
        }
        _ => value(line),
    })?;
    craft.air = Air::windy(wind_ned_m_s.into()).map_err(value)?;
    let three = |name: &str, array: &Array64<'py>, count: Option<usize>| {
        let rows = rows::<f64>(name, &array.0, &[count, Some(3)], Numbers::Any)?;
        Ok::<_, PyErr>(
            rows.numbers().chunks_exact(3).map(Vector3::from_column_slice).collect::<Vec<_>>(),
        )
    };
    let positions = three("reference_position_ned_m", &reference_position_ned_m, None)?;
    let velocities =
        three("reference_velocity_ned_m_s", &reference_velocity_ned_m_s, Some(positions.len()))?;
    let keep = |o: Vector3<f64>| KeepOut { centre: Vector2::new(o.x, o.y), radius_m: o.z };
    let obstacles = three("obstacles_m", &obstacles_m, None)?.into_iter().map(keep).collect();
    let begin = Begin {
        position: position_ned_m.into(),
        velocity: velocity_ned_m_s.into(),
        thrust: thrust_ned_n.map_or_else(|| -craft.hover(), Vector3::from),
        spread: deployment,
    };
    let wanted = positions
        .into_iter()
        .zip(velocities)
        .map(|(position, velocity)| Wanted { position, velocity });
    let task = Task::new(begin, wanted.collect(), obstacles, step_s, speed_max_m_s)
        .map_err(|e| named(&e))?;
    let plan = interruptible(py, move |_| Planner::default().plan(&craft, &task, None))?;
    let facts = PyDict::new(py);
    facts.set_item("status", plan.status.name())?;
    facts.set_item("cost", plan.cost)?;
    facts.set_item("violation_m", plan.violation_m)?;
    facts.set_item("overspeed_m_s", plan.overspeed_m_s)?;
    facts.set_item("iterations", plan.iterations)?;
    let nodes = PyDict::new(py);
    let points = plan.track.points();
    nodes.set_item("time_s", PyArray1::from_slice(py, plan.track.time_s()))?;
    for (name, of) in [
        ("position_ned_m", (|point| point.position) as fn(&TrackPoint) -> Vector3<f64>),
        ("velocity_ned_m_s", |point| point.velocity),
        ("acceleration_ned_m_s2", |point| point.acceleration),
        ("thrust_ned_n", |point| point.thrust),
    ] {
        nodes.set_item(
            name,
            table(py, points.iter().flat_map(|point| <[f64; 3]>::from(of(point))).collect(), 3)?,
        )?;
    }
    nodes.set_item("deployment", PyArray1::from_iter(py, points.iter().map(|point| point.wing)))?;
    Ok((facts, nodes))
}
