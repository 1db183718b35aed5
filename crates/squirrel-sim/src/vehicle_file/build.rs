//! From the tables of a vehicle file to checked parameters. Errors are `field = value: reason`.

use super::VehicleFile;
use super::tables::{
    AngleLawName, AttitudeTable, BatteryTable, CommandName, ControlTable, EffectValue, FormName,
    InertiaValue, PlusTable, PositionTable, PropulsionTable, RotorTable, ThrustLawName,
    TiltLimitName, TriggerName, VehicleTable, WingControlTable, WingName, WingTable, WingTestName,
};
use crate::estimator::Estimator;
use crate::plant::{
    BatteryParameters, Membrane, MembraneParameters, ParnnWing, ServoParameters, WingPlant,
};
use crate::quantity::Quantity;
use crate::weights::ParnnWeights;
use squirrel_core::control::backstepping::{AttitudeForm, AttitudeGains};
use squirrel_core::control::plus::{Feels, Plus, TiltLimit};
use squirrel_core::control::position::{AngleLaw, PositionGains};
use squirrel_core::control::supply::ThrustByVoltage;
use squirrel_core::control::twcc::{Trigger, TwccParameters, WingPolicy};
use squirrel_core::control::wiic::ThrustLaw;
use squirrel_core::control::wing_force::ForceModel;
use squirrel_core::control::woeg::{WingEvents, WingTest};
use squirrel_core::effects::{EffectParameter, Effects, FORM, Kind, forms};
use squirrel_core::estimate::navigator::Navigation;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::{Matrix3, Vector3};
use squirrel_core::stack::StackParameters;
use squirrel_core::vehicle::{
    CommandKind, Drag, Limits, MAX_ROTORS, Parameters, Propulsion, Rotor, RotorAir, ThrustCurve,
    Vehicle, Wing,
};
use std::collections::BTreeMap;

type Problem = String;

/// Weights may be trained on one individual and flown on another; beyond this share of the area it
/// is another wing.
const AREA_DEVIATION: f64 = 0.1;

/// * `find` - the weights of a name in the file, where they are at hand
pub(super) fn build(
    t: VehicleTable,
    find: impl FnOnce(&str) -> Result<Option<ParnnWeights>, Problem>,
) -> Result<VehicleFile, Problem> {
    let mut rotors = [Rotor::unused(); MAX_ROTORS];
    for (place, rotor) in rotors.iter_mut().zip(&t.rotor) {
        let position = In::new(Vector3::from(rotor.position_body_m.0));
        *place = Rotor { position, yaw_sign: rotor.yaw_sign.0 };
    }
    let weights = match t.wing.as_ref().and_then(|table| table.parnn_weights.as_deref()) {
        Some(name) => find(name)?,
        None => None,
    };
    let (wing, wing_plant) = match &t.wing {
        Some(table) => wing(table, weights.as_ref())?,
        None => (None, WingPlant::None),
    };
    let parameters = Parameters {
        mass_kg: t.mass.mass_kg.0,
        inertia_kg_m2: match t.mass.inertia_kg_m2.0 {
            InertiaValue::Diagonal(moments) => Matrix3::from_diagonal(&Vector3::from(moments)),
            InertiaValue::Full(rows) => Matrix3::from_fn(|r, c| rows[r][c]),
        },
        rotors,
        rotor_count: t.rotor.len(),
        propulsion: propulsion(&t.propulsion, &rotors[..t.rotor.len().min(MAX_ROTORS)])?,
        drag: Drag {
            linear_n_s_per_m: Vector3::from(t.drag.linear_n_s_per_m.map_or([0.0; 3], |q| q.0)),
            area_m2: t.drag.area_m2.map_or(0.0, |q| q.0),
        },
        wing,
        limits: Limits {
            tilt_max_rad: t.limits.tilt_max_rad.0,
            thrust_max_n: t.limits.thrust_max_n.0,
            rotor_thrust_max_n: t.limits.rotor_thrust_max_n.map(|q| q.0),
        },
    };
    let mut vehicle = Vehicle::new(parameters).map_err(|e| e.to_string())?;
    let factors = rotor_factors(&t.rotor);
    if factors != [[1.0; MAX_ROTORS]; 2] {
        vehicle = vehicle.with_rotor_factors(factors).map_err(|e| e.to_string())?;
    }
    let size_body_m = match t.size_body_m {
        Some(size) => size.0,
        None => default_size(&vehicle),
    };
    for (i, length) in size_body_m.iter().enumerate() {
        if !(length.is_finite() && *length > 0.0) {
            return Err(format!("size_body_m[{i}] = {length}: must be finite and > 0"));
        }
    }
    let control = t.control.as_ref().map(control);
    let plus = t.control.as_ref().and_then(|control| control.plus.as_ref());
    let voltage_exponent =
        t.control.as_ref().and_then(|control| control.voltage_exponent.as_ref()).map(|n| n.0);
    let asks_download = plus.is_some_and(|plus| plus.wing_download_n.is_none());
    if let Some(gains) = &control {
        gains.attitude.check().map_err(|e| e.to_string())?;
        gains
            .twcc
            .check(vehicle.parameters().limits.thrust_max_n as f32)
            .map_err(|e| e.to_string())?;
    }
    t.sensors.check()?;
    let mut built = VehicleFile {
        name: t.name,
        text: String::new(),
        vehicle,
        size_body_m,
        wing: wing_plant,
        weights,
        battery: t.battery.map(battery).transpose()?,
        control,
        estimator: t
            .estimation
            .filter
            .as_deref()
            .map_or(Ok(Estimator::default()), Estimator::parse)?,
        sensors: t.sensors,
        effects: effects(t.effects, &vehicle)?,
        provenance: Vec::new(),
    };
    if let Some(control) = &mut built.control {
        let sag = built.effects.get_mut("battery_sag").map(|sag| sag.values[0]);
        control.thrust = ThrustByVoltage {
            exponent: voltage_exponent.or(sag).unwrap_or(0.0) as f32,
            reference_v: vehicle.parameters().propulsion.reference_voltage_v as f32,
        };
        control.thrust.check().map_err(|e| e.to_string())?;
    }
    if asks_download && built.effects.any() {
        let download_n = built.means()?.wing_download_in_hover_n;
        if let Some(plus) = built.control.as_mut().and_then(|control| control.twcc.plus.as_mut()) {
            plus.wing_download_n = download_n.unwrap_or(0.0) as f32;
        }
    }
    Ok(built)
}

/// Thrust and torque of each rotor over what the propulsion numbers give.
fn rotor_factors(rotors: &[RotorTable]) -> [[f64; MAX_ROTORS]; 2] {
    let mut factors = [[1.0; MAX_ROTORS]; 2];
    for (i, rotor) in rotors.iter().enumerate().take(MAX_ROTORS) {
        let of = |number: &Option<Quantity<f64>>| number.as_ref().map_or(1.0, |q| q.0);
        factors[0][i] = of(&rotor.thrust_fraction);
        factors[1][i] = of(&rotor.torque_fraction);
    }
    factors
}

/// A box that holds all hubs, for a vehicle that states no size.
fn default_size(vehicle: &Vehicle<f64>) -> [f64; 3] {
    let reach = |axis: usize| {
        vehicle.rotors().iter().map(|r| r.position.vector[axis].abs()).fold(0.02, f64::max)
    };
    [2.0 * reach(0), 2.0 * reach(1), 0.04]
}

fn or_zero(number: Option<&Quantity<f64>>) -> f64 {
    number.map_or(0.0, |q| q.0)
}

/// Radius of propellers whose file does not say: three quarters of what neighbours leave each
/// other, m.
fn default_propeller_radius_m(rotors: &[Rotor<f64>]) -> f64 {
    let mut apart_m = f64::INFINITY;
    for (i, rotor) in rotors.iter().enumerate() {
        for other in &rotors[..i] {
            let across = (rotor.position - other.position).vector.xy().norm();
            // Coaxial rotors share their disc.
            if across > 1e-3 {
                apart_m = apart_m.min(across);
            }
        }
    }
    if apart_m.is_finite() { 0.375 * apart_m } else { 0.1 }
}

fn propulsion(t: &PropulsionTable, rotors: &[Rotor<f64>]) -> Result<Propulsion<f64>, Problem> {
    let both = t.time_constant_s.as_ref().map(|q| q.0);
    let lag = |own: &Option<Quantity<f64>>, key: &str| {
        own.as_ref().map(|q| q.0).or(both).ok_or_else(|| {
            format!("propulsion.{key}: missing; give it, or propulsion.time_constant_s for both directions")
        })
    };
    let thrust_curve = match &t.pwm_to_thrust_n {
        Some(q) => Some(ThrustCurve::new(q.0, t.reference_voltage_v.0).map_err(|e| e.to_string())?),
        None => None,
    };
    Ok(Propulsion {
        command: match t.command {
            CommandName::SpeedFraction => CommandKind::SpeedFraction,
            CommandName::PwmUs => CommandKind::PwmMicroseconds,
            CommandName::Duty => CommandKind::Duty,
            CommandName::ThrustN => CommandKind::ThrustNewton,
        },
        speed_max_rad_s: t.speed_max_rad_s.0,
        thrust_coefficient_n_s2: t.thrust_coefficient_n_s2.0,
        torque_coefficient_n_m_s2: t.torque_coefficient_n_m_s2.0,
        time_constant_up_s: lag(&t.time_constant_up_s, "time_constant_up_s")?,
        time_constant_down_s: lag(&t.time_constant_down_s, "time_constant_down_s")?,
        propeller_radius_m: t
            .propeller_diameter_m
            .as_ref()
            .map_or_else(|| default_propeller_radius_m(rotors), |q| 0.5 * q.0),
        air: RotorAir {
            axial_inflow_s_per_m: or_zero(t.axial_inflow_s_per_m.as_ref()),
            translational_lift_s2_per_m2: or_zero(t.translational_lift_s2_per_m2.as_ref()),
            flapping_moment_n_m_s_per_m: or_zero(t.flapping_moment_n_m_s_per_m.as_ref()),
            vortex_ring_fraction: or_zero(t.vortex_ring_fraction.as_ref()),
        },
        reference_voltage_v: t.reference_voltage_v.0,
        thrust_curve,
    })
}

fn wing(
    t: &WingTable,
    weights: Option<&ParnnWeights>,
) -> Result<(Option<Wing<f64>>, WingPlant), Problem> {
    let given = [
        ("area_per_side_m2", &t.area_per_side_m2),
        ("normal_force_slope", &t.normal_force_slope),
        ("lateral_arm_m", &t.lateral_arm_m),
        ("longitudinal_arm_m", &t.longitudinal_arm_m),
        ("vertical_arm_m", &t.vertical_arm_m),
        ("chord_m", &t.chord_m),
        ("time_constant_s", &t.time_constant_s),
        ("dead_time_s", &t.dead_time_s),
        ("rate_max_per_s", &t.rate_max_per_s),
    ];
    let model = match t.model {
        Some(model @ (WingName::Flat | WingName::Membrane | WingName::Parnn)) => model,
        Some(WingName::None) | None => {
            if let Some((key, Some(q))) = given.iter().find(|(_, q)| q.is_some()) {
                return Err(format!("wing.{key} = {}: given, but wing.model names no wing", q.0));
            }
            if let Some(name) = &t.parnn_weights {
                return Err(format!(
                    "wing.parnn_weights = {name}: given, but wing.model names no wing"
                ));
            }
            return match t.membrane.first_key_value() {
                Some((key, q)) => Err(format!(
                    "wing.membrane.{key} = {}: given, but wing.model names no wing",
                    q.0
                )),
                None => Ok((None, WingPlant::None)),
            };
        }
    };
    let need = |key: &str, q: &Option<Quantity<f64>>| match q {
        Some(q) => Ok(q.0),
        None => Err(format!("wing.{key}: missing; a wing needs it")),
    };
    let area_per_side_m2 = need("area_per_side_m2", &t.area_per_side_m2)?;
    let chord = t.chord_m.as_ref().or_else(|| t.membrane.get("chord_m"));
    let wing = Wing {
        area_per_side_m2,
        normal_force_slope: need("normal_force_slope", &t.normal_force_slope)?,
        lateral_arm_m: need("lateral_arm_m", &t.lateral_arm_m)?,
        longitudinal_arm_m: or_zero(t.longitudinal_arm_m.as_ref()),
        vertical_arm_m: or_zero(t.vertical_arm_m.as_ref()),
        // Twice as long as wide, where the file does not say.
        chord_m: chord.map_or_else(|| (2.0 * area_per_side_m2).sqrt(), |q| q.0),
        time_constant_s: need("time_constant_s", &t.time_constant_s)?,
    };
    let servo = ServoParameters {
        dead_time_s: or_zero(t.dead_time_s.as_ref()),
        rate_max_per_s: t.rate_max_per_s.as_ref().map_or(f64::INFINITY, |q| q.0),
        time_constant_s: wing.time_constant_s,
    };
    servo.check()?;
    let parnn = parnn_wing(t, weights, &wing)?;
    let no_membrane = |model: &str| match t.membrane.first_key_value() {
        Some((key, q)) => {
            Err(format!("wing.membrane.{key} = {}: given, but wing.model is \"{model}\"", q.0))
        }
        None => Ok(()),
    };
    let plant = match model {
        WingName::Flat => {
            no_membrane("flat")?;
            WingPlant::Flat { wing, servo }
        }
        WingName::Parnn => {
            no_membrane("parnn")?;
            let parnn = parnn.ok_or_else(|| match &t.parnn_weights {
                Some(name) => {
                    format!(
                        "wing.parnn_weights = {name}: not at hand; load the vehicle from its file"
                    )
                }
                None => "wing.parnn_weights: missing; wing.model = \"parnn\" needs it".to_owned(),
            })?;
            WingPlant::Parnn { parnn: Box::new(parnn), servo }
        }
        WingName::None | WingName::Membrane => {
            WingPlant::Membrane { membrane: Box::new(membrane(&t.membrane, &wing)?), servo }
        }
    };
    Ok((Some(wing), plant))
}

/// The network as a wing of this vehicle, where its weights are at hand.
fn parnn_wing(
    t: &WingTable,
    weights: Option<&ParnnWeights>,
    wing: &Wing<f64>,
) -> Result<Option<ParnnWing>, Problem> {
    let (Some(weights), Some(name)) = (weights, &t.parnn_weights) else { return Ok(None) };
    let (theirs, ours) = (weights.parnn().area_m2, 2.0 * wing.area_per_side_m2);
    if !((f64::from(theirs) - ours).abs() <= AREA_DEVIATION * ours) {
        return Err(format!(
            "wing.parnn_weights = {name}: area_m2 = {theirs}: trained on another wing; wing.area_per_side_m2 makes {ours}"
        ));
    }
    Ok(Some(ParnnWing::new(weights.parnn(), wing)))
}

/// Overrides of the membrane model's defaults.
fn membrane(
    given: &BTreeMap<String, Quantity<f64>>,
    wing: &Wing<f64>,
) -> Result<Membrane, Problem> {
    let mut table = toml::Table::new();
    for (key, q) in given {
        let is_of_the_wing = matches!(
            key.as_str(),
            "area_per_side_m2" | "lateral_arm_m" | "longitudinal_arm_m" | "vertical_arm_m"
        );
        if is_of_the_wing || key == "chord_m" && q.0 != wing.chord_m {
            return Err(format!("wing.membrane.{key} = {}: belongs into [wing]", q.0));
        }
        table.insert(key.clone(), toml::Value::Float(q.0));
    }
    table.insert("area_per_side_m2".to_owned(), toml::Value::Float(wing.area_per_side_m2));
    table.insert("lateral_arm_m".to_owned(), toml::Value::Float(wing.lateral_arm_m));
    for (key, arm_m) in
        [("longitudinal_arm_m", wing.longitudinal_arm_m), ("vertical_arm_m", wing.vertical_arm_m)]
    {
        table.insert(key.to_owned(), toml::Value::Float(arm_m));
    }
    table.insert("chord_m".to_owned(), toml::Value::Float(wing.chord_m));
    let parameters: MembraneParameters =
        table.try_into().map_err(|e: toml::de::Error| format!("wing.membrane: {}", e.message()))?;
    Membrane::new(parameters).map_err(|e| format!("wing.membrane: {e}"))
}

fn battery(t: BatteryTable) -> Result<BatteryParameters, Problem> {
    let parameters = BatteryParameters {
        cells: t.cells.0,
        capacity_ah: t.capacity_ah.0,
        r0_ohm: t.r0_ohm.0,
        r1_ohm: t.r1_ohm.0,
        tau1_s: t.tau1_s.0,
        ocv_v_of_charge: t.ocv_v_of_charge.0,
        efficiency: t.efficiency.map_or(0.7, |q| q.0),
        idle_current_a: t.idle_current_a.map_or(0.3, |q| q.0),
    };
    parameters.check()?;
    Ok(parameters)
}

fn effects(
    tables: BTreeMap<String, BTreeMap<String, EffectValue>>,
    vehicle: &Vehicle<f64>,
) -> Result<Effects<f64>, Problem> {
    let rotor_count = vehicle.rotors().len();
    let mut effects = Effects::none();
    for (name, table) in tables {
        let Some(found) = effects.insert(&name) else {
            let known = Effects::<f64>::NAMES.join(", ");
            return Err(format!("effects.{name}: no such effect; known are {known}"));
        };
        let names = forms(found.parameters);
        // Keys may depend on the form, so it is looked at first; an impossible one is refused with
        // its field below.
        let form = match table.get(FORM) {
            Some(EffectValue::Name(form)) => form.as_str(),
            _ => names.first().copied().unwrap_or_default(),
        };
        for (key, value) in &table {
            let field = format!("effects.{name}.{key} = {value}");
            let Some(i) = found.parameters.iter().position(|p| p.key == key) else {
                let known: Vec<_> = found.parameters.iter().map(|p| p.key).collect();
                return Err(format!("{field}: no such parameter; known are {}", known.join(", ")));
            };
            if names.contains(&form) && !found.parameters[i].exists_in(form) {
                let forms = found.parameters[i].forms.unwrap_or_default().join(", ");
                return Err(format!("{field}: not in the form \"{form}\", only in {forms}"));
            }
            found.values[i] = effect_value(value, found.parameters[i].kind, rotor_count)
                .map_err(|reason| format!("{field}: {reason}"))?;
            let sum = found.parameters[i].base_number(vehicle);
            if let Some((own, base)) = sum.filter(|(_, base)| base + found.values[i] < 0.0) {
                let value = found.values[i];
                return Err(format!(
                    "{field} = {value}: takes away more than there is, {own} = {base}"
                ));
            }
        }
        let needed =
            |p: &&EffectParameter| p.key != FORM && p.exists_in(form) && !table.contains_key(p.key);
        if let Some(missing) = found.parameters.iter().find(needed) {
            let why =
                missing.forms.map_or(String::new(), |_| format!("; the form \"{form}\" needs it"));
            return Err(format!("effects.{name}.{}: missing{why}", missing.key));
        }
    }
    Ok(effects)
}

fn effect_value(value: &EffectValue, kind: Kind, rotor_count: usize) -> Result<f64, Problem> {
    match (kind, value) {
        (Kind::OneOf(names), EffectValue::Name(given)) if names.contains(&given.as_str()) => {
            Ok(names.iter().position(|n| n == given).unwrap_or(0) as f64)
        }
        (Kind::OneOf(names), _) => Err(format!("must be one of {}", names.join(", "))),
        (_, EffectValue::Name(_)) => Err("must be a number".to_owned()),
        (Kind::Rotor, EffectValue::Number(q)) => {
            let number = q.0;
            if (1..=rotor_count).any(|r| r as f64 == number) {
                Ok(number)
            } else {
                Err(format!("must be a rotor's number, 1 to {rotor_count}"))
            }
        }
        (Kind::Size { signed, .. }, EffectValue::Number(q)) => match q.0 {
            x if !x.is_finite() => Err("must be finite".to_owned()),
            x if x < 0.0 && !signed => Err("must be >= 0".to_owned()),
            x => Ok(x),
        },
    }
}

fn triple(q: &Quantity<[f64; 3]>) -> Vector3<f32> {
    Vector3::from(q.0).map(|x| x as f32)
}

fn control(t: &ControlTable) -> StackParameters {
    StackParameters {
        attitude: attitude(&t.attitude),
        twcc: twcc(&t.position, &t.wing, t.plus.as_ref(), t.thrust_min_n.0 as f32),
        // A flight makes its own, from the sensors.
        navigation: Navigation::external(),
        // From the effects of the file, which are read later.
        thrust: ThrustByVoltage::CONSTANT,
    }
}

fn attitude(t: &AttitudeTable) -> AttitudeGains {
    AttitudeGains {
        form: match t.form {
            FormName::Euler => AttitudeForm::Euler,
            FormName::Quaternion => AttitudeForm::Quaternion,
        },
        c1_per_s: triple(&t.c1_per_s),
        c2_per_s: triple(&t.c2_per_s),
        lambda_per_s2: triple(&t.lambda_per_s2),
        integral_max_rad_s: t.integral_max_rad_s.0 as f32,
        rotor_lead: t.rotor_lead.as_ref().map_or(1.0, |lead| lead.0 as f32),
        filter_frequency_rad_s: t.filter_frequency_rad_s.0 as f32,
        filter_damping: t.filter_damping.0 as f32,
    }
}

fn gains(position: &PositionTable) -> PositionGains {
    PositionGains {
        position_per_s: triple(&position.position_per_s),
        velocity_per_s: triple(&position.velocity_per_s),
        integral_per_s2: triple(&position.integral_per_s2),
        derivative: triple(&position.derivative),
        velocity_feed_forward: position.velocity_feed_forward.0 as f32,
        acceleration_feed_forward: 0.0,
        approach_max_m_s2: f32::INFINITY,
        speed_max_m_s: f32::INFINITY,
        acceleration_max_horizontal_m_s2: position.acceleration_max_horizontal_m_s2.0 as f32,
        acceleration_max_vertical_m_s2: position.acceleration_max_vertical_m_s2.0 as f32,
        integral_max_m: position.integral_max_m.0 as f32,
        angle_law: match position.angle_law {
            AngleLawName::SmallAngle => AngleLaw::SmallAngle,
            AngleLawName::Exact => AngleLaw::Exact,
        },
    }
}

fn twcc(
    position: &PositionTable,
    wing: &WingControlTable,
    plus_table: Option<&PlusTable>,
    thrust_min_n: f32,
) -> TwccParameters {
    let position = gains(position);
    TwccParameters {
        position,
        wing_events: WingEvents {
            test: match wing.test {
                WingTestName::Normal => WingTest::Normal,
                WingTestName::Acceleration => WingTest::Acceleration,
            },
            open_above_n: wing.open_above_n.0 as f32,
            close_below_n: wing.close_below_n.0 as f32,
        },
        thrust_law: match wing.thrust_law {
            ThrustLawName::Literal => ThrustLaw::Literal,
            ThrustLawName::Exact => ThrustLaw::Exact,
        },
        trigger: match wing.trigger {
            TriggerName::Angle => Trigger::Angle,
            TriggerName::AngleOrThrust => Trigger::AngleOrThrust,
        },
        // The arm of a flight chooses these two.
        force_model: ForceModel::FlatPlate,
        policy: WingPolicy::Folded,
        dwell_s: wing.dwell_s.0 as f32,
        thrust_min_n,
        plus: plus_table.map(|table| plus(table, &position)),
    }
}

/// Gains that are not in the table are those of the primary controller; the reference's motion is
/// fed forward whole.
fn plus(t: &PlusTable, position: &PositionGains) -> Plus {
    Plus {
        position: PositionGains {
            velocity_feed_forward: 1.0,
            acceleration_feed_forward: 1.0,
            acceleration_max_horizontal_m_s2: t.acceleration_max_horizontal_m_s2.0 as f32,
            acceleration_max_vertical_m_s2: t.acceleration_max_vertical_m_s2.0 as f32,
            integral_max_m: t
                .integral_max_m
                .as_ref()
                .map_or(position.integral_max_m, |m| m.0 as f32),
            ..*position
        },
        delay_s: t.delay_s.0 as f32,
        vertical_weight: t.vertical_weight.0 as f32,
        height_band_m: t.height_band_m.0 as f32,
        // Files of before this number have one band.
        sink_band_m: t.sink_band_m.as_ref().unwrap_or(&t.height_band_m).0 as f32,
        thrust_share: t.thrust_share.0 as f32,
        approach_share: t.approach_share.0 as f32,
        open_above_m_s2: t.open_above_m_s2.0 as f32,
        wing_download_n: t.wing_download_n.as_ref().map_or(0.0, |n| n.0 as f32),
        feels: Feels::BodyZ,
        tilt_limit: match t.tilt_limit {
            TiltLimitName::Box => TiltLimit::Box,
            TiltLimitName::Cone => TiltLimit::Cone,
        },
    }
}
