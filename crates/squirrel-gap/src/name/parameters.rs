//! What can be named: every effect of the catalogue with its choices, and how far each parameter may be off without a name.
//!
//! A parameter has two priors, both Gaussian about what the vehicle file says: its **tolerance**, the declared standard
//! deviation of the nominal number that the effect would change, and, where the effect is hypothesised, its **slab**, as wide
//! as the effect is plausible. An effect is only worth a name when the flights ask for more than the tolerance.

use super::point::{Airframe, Member};
use crate::GapError;
use crate::leftover::Slack;
use crate::predictor::Predictor;
use squirrel_core::effects::{EffectParameter, Effects, FORM, Kind};
use squirrel_sim::plant::WingPlant;
use squirrel_sim::vehicle_file::VehicleFile;

/// Part of the smallest size worth reporting by which a thing may be off that the vehicle file has no number for.
const SHARE_OF_SMALLEST: f64 = 1.0 / 6.0;
/// Part of a sample to which times are known, one standard deviation: it is held for all of it.
const SAMPLE_SHARE: f64 = 0.29;
/// Width of the slab over the largest plausible size.
pub(crate) const SLAB_OF_LARGEST: f64 = 0.6;
/// Effects that are known by their moments, and by what moving air does; without these channels nothing is said of them.
const MOMENTS: [&str; 6] = [
    "angular_damping",
    "cg_offset",
    "flapping_moment",
    "inertia_error",
    "rotor_gyro_torque",
    "yaw_torque_coeff",
];
const DRAG: [&str; 9] = [
    "accel_bias",
    "added_mass",
    "axial_inflow",
    "constant_wind",
    "linear_drag",
    "payload_swing",
    "quadratic_drag",
    "thrust_misalignment",
    "translational_lift",
];

/// One number of one effect.
#[derive(Debug, Clone)]
pub(crate) struct Parameter {
    pub(crate) candidate: usize,
    /// Place in the effect's list of parameters.
    pub(crate) slot: usize,
    pub(crate) key: &'static str,
    pub(crate) smallest: f64,
    pub(crate) largest: f64,
    pub(crate) signed: bool,
    /// Standard deviation of the spike.
    pub(crate) tolerance: f64,
    /// Standard deviation of the slab.
    pub(crate) slab: f64,
    /// By how much the number that the effect adds to is off by itself, one standard deviation: flights show only the sum.
    pub(crate) spread: f64,
}

/// One effect, with its choices made: which rotor, which axis, which side.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub(crate) effect: &'static str,
    /// Slots with a fixed value, and slots where a search starts.
    pub(crate) fixed: Vec<(usize, f64)>,
    /// Indices of its parameters in [`Catalogue::parameters`] that act by themselves, from zero.
    pub(crate) parameters: Vec<usize>,
    /// Slots that only a refinement moves, with where they start.
    pub(crate) shape: Vec<(usize, f64)>,
}

/// Everything that can be named on a vehicle.
pub(crate) struct Catalogue {
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) parameters: Vec<Parameter>,
    /// Numbers of the airframe beside them, with their tolerances.
    pub(crate) airframe: Vec<(Airframe, f64)>,
}

impl Catalogue {
    /// * `payload_lengths_m` - at which a slung load is looked for: its frequency is not linear in anything
    ///
    /// # Errors
    /// The vehicle file lacks a tolerance that is needed.
    pub(crate) fn new(predictor: &Predictor, payload_lengths_m: &[f64]) -> Result<Self, GapError> {
        let vehicle = predictor.vehicle;
        let unseen = |name: &str| {
            (MOMENTS.contains(&name) && !predictor.has_channel(3))
                || (DRAG.contains(&name) && !predictor.has_channel(0))
        };
        let mut all = Self { candidates: Vec::new(), parameters: Vec::new(), airframe: airframe(predictor) };
        for name in Effects::<f64>::NAMES {
            if *name == "gust"
                || unseen(name)
                || (vehicle.wing == WingPlant::None && name.starts_with("wing_"))
            {
                continue;
            }
            let list = Effects::<f64>::parameters(name).unwrap_or_default();
            for fixed in choices(list, vehicle.vehicle.rotors().len()) {
                if *name == "payload_swing" {
                    for length_m in payload_lengths_m {
                        all.add(vehicle, name, list, fixed.clone(), &[("length_m", *length_m)])?;
                    }
                } else {
                    all.add(vehicle, name, list, fixed, &[])?;
                }
            }
        }
        for parameter in &mut all.parameters {
            let effect = all.candidates[parameter.candidate].effect;
            parameter.spread = match timing_s(predictor, effect) {
                Some(spread) => spread,
                // What has no declared number has none to be off.
                None if parameter.tolerance == SHARE_OF_SMALLEST * parameter.smallest => 0.0,
                None => parameter.tolerance,
            };
        }
        Ok(all)
    }

    /// By how much the number that a member's slot adds to is off by itself, one standard deviation.
    pub(crate) fn spread(&self, member: &Member, slot: usize) -> f64 {
        let own = |p: &&Parameter| p.candidate == member.candidate && p.slot == slot;
        self.parameters.iter().find(own).map_or(0.0, |p| p.spread)
    }

    /// Tolerances of what has no number of its own.
    ///
    /// * `timing_s` - by how much commands may act beside their time
    /// * `thrust_fraction` - by how much thrust may drift in a flight
    pub(crate) fn slack(&self, timing_s: f64, thrust_fraction: f64) -> Slack {
        let of = |key: &str| self.parameters.iter().find(|p| p.key == key).map_or(0.0, |p| p.tolerance);
        Slack { lever_m: of("cg_x_m"), timing_s, thrust_fraction, drag_n_s_per_m: of("extra_drag_n_s_per_m") }
    }

    fn add(
        &mut self,
        vehicle: &VehicleFile,
        effect: &'static str,
        list: &'static [EffectParameter],
        fixed: Vec<(usize, f64)>,
        shape: &[(&str, f64)],
    ) -> Result<(), GapError> {
        let standard = list.iter().find_map(|p| match p.kind {
            Kind::OneOf(names) if p.key == FORM => Some(names[0]),
            _ => None,
        });
        let standard = standard.unwrap_or_default();
        let (candidate, mut own, mut started) = (self.candidates.len(), Vec::new(), Vec::new());
        for (slot, parameter) in list.iter().enumerate() {
            let Kind::Size { smallest, largest, signed } = parameter.kind else { continue };
            if !parameter.exists_in(standard) {
                continue;
            }
            if let Some((_, start)) = shape.iter().find(|(key, _)| *key == parameter.key) {
                started.push((slot, *start));
                continue;
            }
            own.push(self.parameters.len());
            self.parameters.push(Parameter {
                candidate,
                slot,
                key: parameter.key,
                smallest,
                largest,
                signed,
                tolerance: tolerance(vehicle, effect, slot, &fixed, smallest)?,
                slab: SLAB_OF_LARGEST * largest,
                spread: 0.0,
            });
        }
        self.candidates.push(Candidate { effect, fixed, parameters: own, shape: started });
        Ok(())
    }
}

/// How well a log tells when things happen, in the unit of an effect that is about time: a part of a sample, a clock's over
/// its flight.
fn timing_s(predictor: &Predictor, effect: &str) -> Option<f64> {
    let track = predictor.tracks.first()?;
    let sample_s = SAMPLE_SHARE * track.period_s;
    match effect {
        "actuation_latency" | "gnss_latency" => Some(sample_s),
        "clock_skew" => Some(1e6 * sample_s / (track.period_s * track.time_s.len() as f64)),
        _ => None,
    }
}

/// Voltage of a full cell, of one at rest, and of an empty one under load, V.
const CELL_V: [f64; 3] = [4.2, 3.8, 3.2];

/// By how much thrust may be off, as a fraction, where the battery's voltage is not logged: it is anywhere between full and
/// empty, the voltage at which the vehicle's numbers hold may be two of its sd off, and thrust goes with the square of both.
pub(super) fn unlogged_sag(predictor: &Predictor) -> f64 {
    if predictor.has_voltage() {
        return 0.0;
    }
    let vehicle = predictor.vehicle;
    let reference_v = vehicle.vehicle.parameters().propulsion.reference_voltage_v;
    let [full, rest, empty] = CELL_V;
    let cells = (reference_v / rest).round().max(1.0);
    let thrust = |cell_v: f64| (cell_v * cells / reference_v).powi(2);
    let sd_v = sds(vehicle, "propulsion.reference_voltage_v").map_or(0.0, |sd| sd[0]);
    (1.0 - thrust(empty)).abs().max((thrust(full) - 1.0).abs()).hypot(2.0 * 2.0 * sd_v / reference_v)
}

/// Numbers of the airframe that have a declared tolerance, where flights show them.
fn airframe(predictor: &Predictor) -> Vec<(Airframe, f64)> {
    let vehicle = predictor.vehicle;
    let p = vehicle.vehicle.parameters();
    let mut all = Vec::new();
    if predictor.has_channel(3) {
        let torque = p.propulsion.torque_coefficient_n_m_s2;
        for rotor in 0..p.rotor_count {
            let arm = sds(vehicle, &format!("rotor[{rotor}].position_body_m"));
            for axis in 0..2 {
                all.extend(
                    arm.as_ref().map(|sd| (Airframe::Arm { rotor, axis }, sd[axis.min(sd.len() - 1)])),
                );
            }
            let sd = sds(vehicle, "propulsion.torque_coefficient_n_m_s2");
            all.extend(sd.filter(|_| torque > 0.0).map(|sd| (Airframe::Torque { rotor }, sd[0] / torque)));
        }
    }
    if predictor.has_channel(0) {
        let drag = sds(vehicle, "drag.linear_n_s_per_m");
        for axis in 1..3 {
            all.extend(drag.as_ref().map(|sd| (Airframe::Drag { axis }, sd[axis.min(sd.len() - 1)])));
        }
    }
    all
}

/// Every way in which the choices of an effect can be made.
fn choices(list: &[EffectParameter], rotors: usize) -> Vec<Vec<(usize, f64)>> {
    let mut all = vec![Vec::new()];
    for (slot, parameter) in list.iter().enumerate() {
        let values: Vec<f64> = match parameter.kind {
            Kind::Rotor => (1..=rotors).map(|i| i as f64).collect(),
            Kind::OneOf(_) if parameter.key == FORM => vec![0.0],
            Kind::OneOf(names) => (0..names.len()).map(|i| i as f64).collect(),
            Kind::Size { .. } => continue,
        };
        all = all
            .into_iter()
            .flat_map(|made: Vec<(usize, f64)>| {
                values.iter().map(move |value| [made.clone(), vec![(slot, *value)]].concat())
            })
            .collect();
    }
    all
}

/// How far the number that an effect changes may be off, one standard deviation, in the unit of the effect's parameter.
fn tolerance(
    vehicle: &VehicleFile,
    effect: &str,
    slot: usize,
    fixed: &[(usize, f64)],
    smallest: f64,
) -> Result<f64, GapError> {
    let p = vehicle.vehicle.parameters();
    let propulsion = &p.propulsion;
    let none = SHARE_OF_SMALLEST * smallest;
    let number = |field: &str, index: usize, value: f64| deviation(vehicle, field, index, value);
    // The sd of a number that the file must give where the number is not zero, over that number.
    let fraction = |field: &str, index: usize, value: f64| {
        Ok(number(field, index, value)?.map_or(none, |sd| sd / value.abs().max(f64::MIN_POSITIVE)))
    };
    let declared = |field: &str, fallback: f64| Ok(sds(vehicle, field).map_or(fallback, |sd| sd[0]));
    Ok(match effect {
        "mass_error" => fraction("mass.mass_kg", 0, p.mass_kg)?,
        "inertia_error" => {
            let axis = fixed.first().map_or(0, |(_, axis)| *axis as usize);
            fraction("mass.inertia_kg_m2", axis, p.inertia_kg_m2[(axis, axis)])?
        }
        "thrust_coefficient" | "weak_rotor" => {
            fraction("propulsion.thrust_coefficient_n_s2", 0, propulsion.thrust_coefficient_n_s2)?
        }
        "yaw_torque_coeff" => {
            fraction("propulsion.torque_coefficient_n_m_s2", 0, propulsion.torque_coefficient_n_m_s2)?
        }
        "motor_lag" => {
            let single = sds(vehicle, "propulsion.time_constant_s");
            match single {
                Some(sd) => sd[0],
                None if vehicle.provenance.iter().any(|(f, _)| f == "propulsion.time_constant_up_s") => {
                    number("propulsion.time_constant_up_s", 0, propulsion.time_constant_up_s)?.unwrap_or(none)
                }
                None => {
                    number("propulsion.time_constant_s", 0, propulsion.time_constant_up_s)?.unwrap_or(none)
                }
            }
        }
        "linear_drag" => number("drag.linear_n_s_per_m", 0, p.drag.linear_n_s_per_m.x)?.unwrap_or(none),
        "quadratic_drag" => number("drag.area_m2", 0, p.drag.area_m2)?.unwrap_or(none),
        "wing_membrane" if slot == 0 => match p.wing {
            Some(wing) => fraction("wing.normal_force_slope", 0, wing.normal_force_slope)?,
            None => none,
        },
        "wing_asymmetry" => match p.wing {
            Some(wing) => fraction("wing.normal_force_slope", 0, wing.normal_force_slope)?,
            None => none,
        },
        "wing_servo_lag" => match p.wing {
            Some(wing) => number("wing.time_constant_s", 0, wing.time_constant_s)?.unwrap_or(none),
            None => none,
        },
        "cg_offset" => {
            let all: Vec<f64> = (0..vehicle.vehicle.rotors().len())
                .filter_map(|i| sds(vehicle, &format!("rotor[{i}].position_body_m")))
                .map(|sd| sd[slot.min(sd.len() - 1)])
                .collect();
            let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
            mean.max(none)
        }
        "accel_bias" => declared("sensors.imu.accel_bias_m_s2", 0.02)?,
        "heading_bias" => declared("sensors.attitude.bias_rad", 0.5_f64.to_radians())?,
        "constant_wind" => 0.12,
        // A vehicle carries a load or it does not; a ground effect of a small radius is none.
        "payload_swing" | "ground_effect" => 0.0,
        _ => none,
    })
}

/// The declared sd of a number; `None` where the number is zero and the file declares none.
fn deviation(vehicle: &VehicleFile, field: &str, index: usize, value: f64) -> Result<Option<f64>, GapError> {
    match sds(vehicle, field) {
        Some(sd) => Ok(Some(sd[index.min(sd.len() - 1)])),
        None if value == 0.0 => Ok(None),
        None => Err(GapError::Tolerance { vehicle: vehicle.name.clone(), field: field.to_owned(), value }),
    }
}

/// The declared sds of a field, as many as it has.
pub(crate) fn sds(vehicle: &VehicleFile, field: &str) -> Option<Vec<f64>> {
    let (_, provenance) = vehicle.provenance.iter().find(|(name, _)| name == field)?;
    let text = provenance.sd.as_ref()?;
    let numbers: Vec<f64> = text
        .split(|c: char| "[], ".contains(c))
        .filter(|part| !part.is_empty())
        .filter_map(|part| part.parse().ok())
        .collect();
    // Of a full inertia matrix, the diagonal.
    let numbers = if numbers.len() == 9 { vec![numbers[0], numbers[4], numbers[8]] } else { numbers };
    (!numbers.is_empty()).then_some(numbers)
}
