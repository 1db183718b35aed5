//! One flight in closed loop.

use crate::controller::{Controller, Heard};
use crate::error;
use crate::interrupt::signalled;
use crate::log::FlightLog;
use crate::policy::Policy;
use crate::scalars;
use crate::vehicle::found;
use pyo3::prelude::*;
use pyo3_stub_gen::derive::gen_stub_pyfunction;
use squirrel_core::stack::{SensorFrame, Stack, StackOutput, StackState};
use squirrel_plan::pilot;
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{FlightComputer, FlightError, Integrator, Offboard, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::Path;

/// Steps of the flight code between two looks at Ctrl-C: some milliseconds.
const STEPS_A_LOOK: u32 = 128;

/// What a log says of a vehicle whose file has no gains.
const BY_RULE: &str = "by rule: the vehicle file has no [control]";

/// The flight code in this process; Ctrl-C ends the flight.
struct Interruptible {
    stack: Stack,
    state: StackState,
    steps: u32,
    signal: Option<PyErr>,
    /// A Python function that flies.
    heard: Option<Heard>,
}

impl FlightComputer for Interruptible {
    fn step(&mut self, frame: &SensorFrame) -> Result<(StackOutput, u32), FlightError> {
        self.steps = self.steps.wrapping_add(1);
        if self.steps.is_multiple_of(STEPS_A_LOOK)
            && let Err(signal) = signalled()
        {
            self.signal = Some(signal);
            return Err(FlightError("interrupted".to_owned()));
        }
        if self.heard.as_ref().is_some_and(Heard::is_over) {
            return Err(FlightError("the controller raised".to_owned()));
        }
        let mut output = self.stack.step(&mut self.state, frame);
        if let Some(heard) = &self.heard {
            heard.replace(&mut output);
        }
        Ok((output, self.state.mission.encounters))
    }
}

/// A scenario by name or file, with what the call says of it.
pub(crate) fn scenario(
    name: &str,
    seed: Option<u64>,
    thrust_to_weight: Option<f64>,
) -> PyResult<Scenario> {
    if Path::new(name).extension().is_some_and(|e| e == "toml")
        && let Err(e) = std::fs::metadata(name)
    {
        return Err(error::system(e.kind(), format!("{name}: {e}")));
    }
    if let Some(ratio) = thrust_to_weight
        && !(ratio > 1.0 && ratio <= 100.0)
    {
        return Err(error::value(format!("thrust_to_weight = {ratio}: must be > 1 and <= 100")));
    }
    let mut scenario = Scenario::find(name).map_err(error::value)?;
    scenario.seed = seed.unwrap_or(scenario.seed);
    scenario.thrust_to_weight = thrust_to_weight.or(scenario.thrust_to_weight);
    scenario.check().map_err(|e| error::value(format!("scenario {name}: {e}")))?;
    Ok(scenario)
}

/// Fly one scenario in closed loop: plant, sensors and flight code.
///
/// Parameters
/// ----------
/// vehicle : Vehicle, str or os.PathLike, optional
///     What flies, or its file, or the name of a bundled vehicle; the paper's squirrel if left out. One without ``[control]`` flies by gains by rule, those of ``squirrel vehicle new``,
///     and the log's metadata say so (``gains``).
/// scenario : str
///     ``hover``, ``avoid``, ``steer``, ``track``, ``forest``, ``excite_calm``, ``excite_normal``, ``excite_rich``, ``random_spread``, or
///     the path of a scenario file (.toml).
/// arm : str, optional
///     Who flies: ``pc``, ``pc_wings_open``, ``wiic_no_wings``, ``phantom``, ``twcc_flat``, ``twcc_parnn``, ``twcc_oracle``,
///     ``twcc_plus``, ``pc_plus``; if left out, ``twcc_flat``, or ``pc`` with a policy.
/// seed : int, optional
///     Of everything random; the scenario's own if left out.
/// thrust_to_weight : float, optional
///     Largest collective thrust over weight; overrides vehicle and scenario.
/// estimator : str, optional
///     Who tells the flight code attitude, velocity and position: ``eskf``, ``mekf``, ``mahony``, ``rkf_mtf``, ``rkf_stf``, ``kalman``,
///     ``external``, ``oracle`` (the truth); the vehicle's own if left out.
/// integrator : str
///     ``rk4`` (rapier near contact) or ``rapier`` (throughout, first order).
/// policy : Policy, optional
///     Flies instead of the arm's outer loop: asked 50 times a second, its commands go to the flight code as an offboard computer's.
///
/// controller : callable, optional
///     A function that flies instead of the arm's outer loop, ``controller(sight, time_s)``. ``sight`` is a dict of float32 arrays of what the
///     flight code knows: ``position_ned_m``, ``velocity_ned_m_s``, ``q_ned_from_body_wxyz``, ``omega_body_rad_s``,
///     ``specific_force_body_m_s2``, and of the scenario ``reference_position_ned_m``, ``reference_velocity_ned_m_s``,
///     ``reference_acceleration_ned_m_s2``. First asked once all of that is known. What it raises ends the flight and is raised.
/// controller_hz : int
///     How often it is asked; a divisor of 300, the rate of the flight code.
/// controller_commands : str
///     What it returns. ``attitude``: four numbers, collective thrust (N), roll and pitch (rad), wings (0 folded, 1 spread); the flight
///     code's inner loop flies them. ``rotors``: a command for each rotor in the vehicle's unit, then one for the wings; they replace
///     those of the flight code, and `squirrel replay` of such a log finds others.
///
/// Returns
/// -------
/// FlightLog
///     With `FlightLog.metrics`. Equal arguments give equal bits, with a controller as far as it answers equally.
///
/// Raises
/// ------
/// OSError
///     The scenario file cannot be read.
/// ValueError
///     One line that names the argument or field, and the value.
///
/// Examples
/// --------
/// >>> import squirrel
/// >>> log = squirrel.simulate(scenario="avoid", arm="twcc_flat", seed=3)
/// >>> log["truth.position_ned_m"].shape[1]
/// 3
///
/// A controller of four lines: hold height, level.
///
/// >>> def hold(sight, time_s):
/// ...     down, sinking = sight["position_ned_m"][2], sight["velocity_ned_m_s"][2]
/// ...     thrust_n = 5.4 + 4.0 * (down - sight["reference_position_ned_m"][2]) + 4.0 * sinking
/// ...     return thrust_n, 0.0, 0.0, 0.0
/// >>> log = squirrel.simulate(scenario="hover", controller=hold, controller_hz=50)
/// >>> log.metadata["controller"]
/// 'a Python function commands attitude at 50 Hz'
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
#[pyo3(signature = (*, vehicle = None, scenario = "avoid", arm = None, seed = None, thrust_to_weight = None, estimator = None, integrator = "rk4", policy = None, controller = None, controller_hz = 50, controller_commands = "attitude"))]
pub(crate) fn simulate(
    py: Python<'_>,
    #[gen_stub(override_type(type_repr = "Vehicle | builtins.str | os.PathLike[builtins.str] | None", imports = ("builtins", "os")))]
    #[pyo3(from_py_with = found)]
    vehicle: Option<VehicleFile>,
    #[gen_stub(override_type(type_repr = "flight.Scenario | builtins.str", imports = ("squirrel.flight", "builtins")))]
    scenario: &str,
    #[gen_stub(override_type(type_repr = "flight.Arm | None", imports = ("squirrel.flight")))]
    arm: Option<&str>,
    #[pyo3(from_py_with = scalars::seed)] seed: Option<u64>,
    #[pyo3(from_py_with = scalars::thrust_to_weight)] thrust_to_weight: Option<f64>,
    #[gen_stub(override_type(type_repr = "flight.Estimator | None", imports = ("squirrel.flight")))]
    estimator: Option<&str>,
    #[gen_stub(override_type(type_repr = "flight.Integrator", imports = ("squirrel.flight")))]
    integrator: &str,
    policy: Option<&Bound<'_, Policy>>,
    #[gen_stub(override_type(
        type_repr = "collections.abc.Callable[[dict[str, numpy.typing.NDArray[numpy.float32]], builtins.float], collections.abc.Sequence[builtins.float] | numpy.typing.NDArray[numpy.float32] | numpy.typing.NDArray[numpy.float64]] | None",
        imports = ("collections.abc", "numpy", "numpy.typing", "builtins")
    ))]
    controller: Option<Bound<'_, PyAny>>,
    #[pyo3(from_py_with = scalars::controller_hz)] controller_hz: u64,
    #[gen_stub(override_type(type_repr = "flight.Commands", imports = ("squirrel.flight")))]
    controller_commands: &str,
) -> PyResult<FlightLog> {
    if controller.is_some() && policy.is_some() {
        return Err(error::value("controller: flies alone, without policy"));
    }
    let is_outside = policy.is_some() || controller.is_some();
    let by_default = if is_outside { Arm::Pc } else { Arm::TwccFlat };
    let mut vehicle = vehicle.unwrap_or_else(VehicleFile::squirrel);
    if let Some(name) = estimator {
        vehicle.estimator = Estimator::parse(name).map_err(|_| {
            let known = Estimator::ALL.map(Estimator::name).join(", ");
            error::value(format!("estimator = {name}: no such estimator; known are {known}"))
        })?;
    }
    let by_rule = vehicle.control.is_none();
    if by_rule {
        vehicle = vehicle.with_gains_by_rule().map_err(|e| error::vehicle(&e))?;
    }
    let setup = Setup {
        vehicle,
        arm: arm.map_or(Ok(by_default), Arm::parse).map_err(error::value)?,
        scenario: self::scenario(scenario, seed, thrust_to_weight)?,
        integrator: Integrator::parse(integrator).map_err(error::value)?,
    };
    let stack = setup.stack().map_err(error::value)?;
    let policy = policy.map(|policy| policy.get().weights.clone());
    let controller = controller
        .map(|function| Controller::new(&function, controller_hz, controller_commands, &setup))
        .transpose()?;
    let heard = controller.as_ref().map(Controller::heard);
    let mut pilot: Option<Box<dyn Offboard + Send>> = match controller {
        Some(controller) => Some(Box::new(controller)),
        None => pilot::offboard(&setup, &stack, policy).map_err(error::value)?,
    };
    let mut computer = Interruptible {
        stack,
        state: StackState::default(),
        steps: 0,
        signal: None,
        heard: heard.clone(),
    };
    let flown = py.detach(|| {
        let pilot = pilot.as_mut().map(|pilot| &mut **pilot as &mut dyn Offboard);
        setup.fly_on(&mut computer, pilot, true, |_| {})
    });
    if let Some(signal) = computer.signal {
        return Err(signal);
    }
    if let Some(raised) = heard.as_ref().and_then(Heard::raised) {
        return Err(raised);
    }
    let flight = flown.map_err(error::value)?;
    let mut log = flight.log.ok_or_else(|| error::value("the flight was not logged"))?;
    if by_rule {
        log.metadata.insert("gains".to_owned(), BY_RULE.to_owned());
    }
    FlightLog::new(log, Some(flight.metrics))
}
