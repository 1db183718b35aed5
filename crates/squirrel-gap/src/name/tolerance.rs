//! How far each number may be off without a name: what the vehicle file declares, and what is known
//! of sensors and batteries.

use super::point::{Airframe, WING_PLACE};
use crate::GapError;
use crate::number::significant;
use crate::predictor::Predictor;
use squirrel_core::effects::{Declared, Timing, Tolerance};
use squirrel_sim::vehicle_file::VehicleFile;

/// Part of the smallest size worth reporting by which a thing may be off that the vehicle file has
/// no number for.
pub(super) const SHARE_OF_SMALLEST: f64 = 1.0 / 6.0;
/// Part of a sample to which times are known, one standard deviation.
const SAMPLE_SHARE: f64 = 0.1;
/// Voltage of a full cell, of one at rest, and of an empty one under load, V.
const CELL_V: [f64; 3] = [4.2, 3.8, 3.2];

/// What sensors may be off by where the vehicle file does not say: m/s^2, and a degree and a
/// quarter in rad.
const ACCEL_BIAS: (&str, f64, &str) = ("sensors.imu.accel_bias_m_s2", 0.03, "m/s^2");
/// Of scales, as fractions, what a file says is the scatter from one switching on to the next.
const GYRO_SCALE: (&str, f64) = ("sensors.imu.gyro_scale_sd", 0.01);
const ACCEL_SCALE: (&str, f64) = ("sensors.imu.accel_scale_sd", 0.003);
const HEADING: (&str, f64, &str) = ("sensors.attitude.bias_rad", 1.25_f64.to_radians(), "rad");

/// How late a log has its gyroscope and its accelerometer, one standard deviation, s: autopilots
/// filter both with corners from 30 to 80 Hz, which is 7.5 to 2.8 ms.
const LATE_S: f64 = 0.004;

/// What the vehicle file does not say and is taken instead.
pub(crate) fn notes(vehicle: &VehicleFile) -> Vec<String> {
    let silent = |field: &str| sds(vehicle, field).is_none();
    let mut notes: Vec<String> = [ACCEL_BIAS, HEADING]
        .iter()
        .filter(|(field, ..)| silent(field))
        .map(|(field, sd, unit)| {
            format!("{field}: has no sd; {} {unit} is taken", significant(*sd, 2))
        })
        .collect();
    let imu = &vehicle.sensors.imu;
    let scales = [(GYRO_SCALE, imu.gyro_scale_sd), (ACCEL_SCALE, imu.accel_scale_sd)];
    let silent_scales = scales.iter().filter(|(_, sd)| *sd == 0.0);
    notes.extend(silent_scales.map(|((field, sd), _)| format!("{field}: is 0; {sd} is taken")));
    let mut rotors =
        (0..vehicle.vehicle.rotors().len()).map(|i| format!("rotor[{i}].position_body_m"));
    if let Some(field) = rotors.find(|field| silent(field)) {
        notes.push(format!("{field}: has no sd; the rotor is taken to be where the file says"));
    }
    notes
}

/// How far the number that an effect changes may be off, one standard deviation, in the unit of the
/// effect's parameter.
pub(super) fn tolerance(
    vehicle: &VehicleFile,
    within: Tolerance,
    slot: usize,
    fixed: &[(usize, f64)],
    smallest: f64,
) -> Result<f64, GapError> {
    let none = SHARE_OF_SMALLEST * smallest;
    let declared = match within {
        Tolerance::PartOfSmallest | Tolerance::RotorAxes => return Ok(none),
        Tolerance::Nothing => return Ok(0.0),
        Tolerance::Usual(sd) => return Ok(sd),
        Tolerance::Declared(number) => number,
    };
    let p = vehicle.vehicle.parameters();
    let propulsion = &p.propulsion;
    let number = |field: &str, value: f64| Ok(deviation(vehicle, field, 0, value)?.unwrap_or(none));
    // The sd of a number that the file must give where the number is not zero, over that number.
    let fraction = |field: &str, index: usize, value: f64| {
        let sd = deviation(vehicle, field, index, value)?;
        Ok(sd.map_or(none, |sd| sd / value.abs().max(f64::MIN_POSITIVE)))
    };
    let stated = |sd: f64, fallback: f64| Ok(if sd > 0.0 { sd } else { fallback });
    let of_sensor = |field: &str, fallback: f64| {
        Ok(sds(vehicle, field).map_or(fallback, |sd| sd[slot.min(sd.len() - 1)]))
    };
    match declared {
        Declared::Mass => fraction("mass.mass_kg", 0, p.mass_kg),
        Declared::Inertia => {
            let axis = fixed.first().map_or(0, |(_, axis)| *axis as usize);
            fraction("mass.inertia_kg_m2", axis, p.inertia_kg_m2[(axis, axis)])
        }
        Declared::Thrust => {
            fraction("propulsion.thrust_coefficient_n_s2", 0, propulsion.thrust_coefficient_n_s2)
        }
        Declared::Torque => fraction(
            "propulsion.torque_coefficient_n_m_s2",
            0,
            propulsion.torque_coefficient_n_m_s2,
        ),
        Declared::RotorLag => {
            if let Some(single) = sds(vehicle, "propulsion.time_constant_s") {
                return Ok(single[0]);
            }
            let up = "propulsion.time_constant_up_s";
            let has_two = vehicle.provenance.iter().any(|(field, _)| field == up);
            number(
                if has_two { up } else { "propulsion.time_constant_s" },
                propulsion.time_constant_up_s,
            )
        }
        Declared::LinearDrag(axis) => {
            let drag = "drag.linear_n_s_per_m";
            Ok(deviation(vehicle, drag, axis, p.drag.linear_n_s_per_m[axis])?.unwrap_or(none))
        }
        Declared::AxialInflow => {
            number("propulsion.axial_inflow_s_per_m", propulsion.air.axial_inflow_s_per_m)
        }
        Declared::TranslationalLift => number(
            "propulsion.translational_lift_s2_per_m2",
            propulsion.air.translational_lift_s2_per_m2,
        ),
        Declared::FlappingMoment => number(
            "propulsion.flapping_moment_n_m_s_per_m",
            propulsion.air.flapping_moment_n_m_s_per_m,
        ),
        Declared::VortexRing => {
            number("propulsion.vortex_ring_fraction", propulsion.air.vortex_ring_fraction)
        }
        Declared::DragArea => number("drag.area_m2", p.drag.area_m2),
        Declared::WingForce => match p.wing {
            Some(wing) => fraction("wing.normal_force_slope", 0, wing.normal_force_slope),
            None => Ok(none),
        },
        Declared::WingLag => match p.wing {
            Some(wing) => number("wing.time_constant_s", wing.time_constant_s),
            None => Ok(none),
        },
        Declared::RotorPlaces => {
            let all = arms_m(vehicle, slot);
            let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
            Ok(mean.max(none))
        }
        Declared::AccelBias => of_sensor(ACCEL_BIAS.0, ACCEL_BIAS.1),
        Declared::HeadingBias => of_sensor(HEADING.0, HEADING.1),
        Declared::GyroScale => stated(vehicle.sensors.imu.gyro_scale_sd, GYRO_SCALE.1),
        Declared::AccelScale => stated(vehicle.sensors.imu.accel_scale_sd, ACCEL_SCALE.1),
    }
}

/// The declared sds of the rotors' places along an axis.
fn arms_m(vehicle: &VehicleFile, axis: usize) -> Vec<f64> {
    let rotors = 0..vehicle.vehicle.rotors().len();
    let declared = rotors.filter_map(|i| sds(vehicle, &format!("rotor[{i}].position_body_m")));
    declared.map(|sd| sd[axis.min(sd.len() - 1)]).collect()
}

/// By how much the middle of the rotors, which a centre of mass is beside, is off by itself: each
/// by its own.
pub(super) fn middle_m(vehicle: &VehicleFile, axis: usize) -> f64 {
    let all = arms_m(vehicle, axis);
    all.iter().map(|sd| sd * sd).sum::<f64>().sqrt() / all.len().max(1) as f64
}

/// The declared sd of a number; `None` where the number is zero and the file declares none.
fn deviation(
    vehicle: &VehicleFile,
    field: &str,
    index: usize,
    value: f64,
) -> Result<Option<f64>, GapError> {
    match sds(vehicle, field) {
        Some(sd) => Ok(Some(sd[index.min(sd.len() - 1)])),
        None if value == 0.0 => Ok(None),
        None => Err(GapError::Tolerance {
            vehicle: vehicle.name.clone(),
            field: field.to_owned(),
            value,
        }),
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
    let numbers =
        if numbers.len() == 9 { vec![numbers[0], numbers[4], numbers[8]] } else { numbers };
    (!numbers.is_empty()).then_some(numbers)
}

/// How well a log tells when things happen, in the unit of an effect that is about time: a part of
/// a sample, a clock's over its flight.
pub(super) fn spread_s(predictor: &Predictor, timing: Option<Timing>) -> Option<f64> {
    let period_s = predictor.tracks.iter().map(|track| track.period_s).fold(0.0, f64::max);
    match timing? {
        Timing::Latency => Some(SAMPLE_SHARE * period_s),
        Timing::ClockRate => Some(SAMPLE_SHARE * slip_ppm(predictor)),
        Timing::ClockJump => None,
    }
}

/// The skew, in millionths, at which a clock slips by one sample in the longest flight.
pub(super) fn slip_ppm(predictor: &Predictor) -> f64 {
    let period_s = predictor.tracks.iter().map(|track| track.period_s).fold(0.0, f64::max);
    let span_s = predictor
        .tracks
        .iter()
        .map(|t| t.time_s[t.time_s.len() - 1] - t.began_s)
        .fold(0.0, f64::max);
    1e6 * period_s / span_s
}

/// By how much thrust may be off, as a fraction, where the battery's voltage is not logged: it is
/// anywhere between full and empty, the voltage at which the vehicle's numbers hold may be two of
/// its sd off, and thrust goes with the square of both.
pub(super) fn unlogged_sag(predictor: &Predictor) -> f64 {
    if predictor.has_voltage() || predictor.has_rotor_speeds() {
        return 0.0;
    }
    let vehicle = predictor.vehicle;
    let reference_v = vehicle.vehicle.parameters().propulsion.reference_voltage_v;
    let [full, rest, empty] = CELL_V;
    let cells = (reference_v / rest).round().max(1.0);
    let thrust = |cell_v: f64| (cell_v * cells / reference_v).powi(2);
    let sd_v = sds(vehicle, "propulsion.reference_voltage_v").map_or(0.0, |sd| sd[0]);
    (1.0 - thrust(empty))
        .abs()
        .max((thrust(full) - 1.0).abs())
        .hypot(2.0 * 2.0 * sd_v / reference_v)
}

/// Numbers of the airframe that have a declared tolerance, where flights show them.
pub(super) fn airframe(predictor: &Predictor) -> Vec<(Airframe, f64)> {
    let vehicle = predictor.vehicle;
    let p = vehicle.vehicle.parameters();
    let mut all = Vec::new();
    if predictor.has_channel(3) {
        let torque = p.propulsion.torque_coefficient_n_m_s2;
        for rotor in 0..p.rotor_count {
            let arm = sds(vehicle, &format!("rotor[{rotor}].position_body_m"));
            for axis in 0..2 {
                all.extend(
                    arm.as_ref()
                        .map(|sd| (Airframe::Arm { rotor, axis }, sd[axis.min(sd.len() - 1)])),
                );
            }
            let sd = sds(vehicle, "propulsion.torque_coefficient_n_m_s2");
            all.extend(
                sd.filter(|_| torque > 0.0).map(|sd| (Airframe::Torque { rotor }, sd[0] / torque)),
            );
        }
    }
    let late =
        [predictor.has_channel(3) && predictor.has_gyroscope(), predictor.has_accelerometer()];
    let sensors = late.iter().enumerate().filter(|(_, is_there)| **is_there);
    all.extend(sensors.map(|(sensor, _)| (Airframe::Late { sensor }, LATE_S)));
    if p.wing.is_some() {
        for (axis, field) in WING_PLACE.iter().enumerate() {
            all.extend(sds(vehicle, field).map(|sd| (Airframe::Wing { axis }, sd[0])));
        }
    }
    if predictor.has_channel(0) {
        let drag = sds(vehicle, "drag.linear_n_s_per_m");
        for axis in 1..3 {
            all.extend(
                drag.as_ref().map(|sd| (Airframe::Drag { axis }, sd[axis.min(sd.len() - 1)])),
            );
        }
    }
    all
}
