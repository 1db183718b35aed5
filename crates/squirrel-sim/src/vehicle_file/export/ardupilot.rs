//! ArduPilot's simulator: a frame file, `--model quad:FILE.json`; keys of `SIM_Frame.cpp`, 4.5.
//!
//! Drag there is that of a level flight at `refSpd` with a tilt of `refAngle`, of which momentum drag
//! (`mdrag_coef`, with the root of thrust times disc area) takes its part and a drag area the rest.

use super::flat::{self, Flat, SPEED_M_S};
use super::{Axes, Keeps, Pulls, digits};
use serde_json::{Map, Value, json};
use squirrel_core::math::AIR_DENSITY_KG_M3;
use std::f64::consts::PI;

pub(super) const KEEPS: Keeps = Keeps {
    rotors_apart: false,
    lags: 0,
    linear: Axes::Plane,
    quadratic: Axes::Alike,
    pulls: Pulls::AtCentreOfMass,
    axial: false,
    lift: false,
    flapping: false,
    wind: false,
    tilt: false,
    gyro: false,
    damping: false,
};

/// # Errors
/// Never but where a number is not finite.
pub(super) fn text(flat: &Flat, keeps: &Keeps) -> Result<String, String> {
    let weight_n = flat.weight_n();
    let linear = keeps.linear_of(flat)[0];
    let area = keeps.area_of(flat)[0];
    let drag_n = linear * SPEED_M_S + flat::per_square(area) * SPEED_M_S * SPEED_M_S;
    let angle = (drag_n / weight_n).atan();
    let disc_m2 = flat.rotors.len() as f64 * PI * flat.propeller_radius_m.powi(2);
    let thrust_n = weight_n / angle.cos();
    let momentum = angle.cos().powi(2) * (thrust_n * AIR_DENSITY_KG_M3 * disc_m2).sqrt();
    // Power in the air behind propellers of momentum theory, of which 0.6 of the battery's is left.
    let induced_m_s = flat.induced_m_s;
    let arm = |r: &flat::FlatRotor| r.position[0].hypot(r.position[1]);
    let arm_m = flat.rotors.iter().map(arm).sum::<f64>() / flat.rotors.len() as f64;
    let [thrust, torque] = flat.mean_rotor();
    let j = flat.inertia_kg_m2.diagonal();
    // square u^2 + (1 - square) u = hover.
    let (square, hover) = (flat.square_fraction(), flat.hover_thrust_fraction());
    let line = 1.0 - square;
    let hover_command = 2.0 * hover / (line + (line * line + 4.0 * square * hover).sqrt());
    let volts = flat.propulsion.reference_voltage_v;
    let number = |x: f64| -> Result<Value, String> {
        digits(x)
            .parse::<f64>()
            .ok()
            .and_then(serde_json::Number::from_f64)
            .map(Value::Number)
            .ok_or_else(|| format!("{}: {x} is no number that JSON has", flat.name))
    };
    let triple = |v: [f64; 3]| -> Result<Value, String> {
        Ok(Value::Array(v.into_iter().map(number).collect::<Result<_, _>>()?))
    };
    let (cells, capacity, resistance) = flat
        .battery
        .as_ref()
        .map_or((volts / 3.7, 0.0, 0.01), |b| (f64::from(b.cells), b.capacity_ah, b.r0_ohm));
    let mut frame = Map::new();
    for (key, value) in [
        ("mass", flat.mass_kg),
        ("diagonal_size", 2.0 * arm_m),
        ("refSpd", SPEED_M_S),
        ("refAngle", angle.to_degrees()),
        ("refVoltage", volts),
        ("refCurrent", weight_n * induced_m_s / (0.6 * volts)),
        ("refAlt", 0.0),
        ("refTempC", 15.0),
        ("refBatRes", resistance),
        ("maxVoltage", if flat.sags { 4.2 * cells } else { volts }),
        ("battCapacityAh", if flat.sags { capacity } else { 0.0 }),
        ("hoverThrOut", flat.hover_thrust_fraction()),
        ("propExpo", flat.square_fraction()),
        ("refRotRate", 120.0),
        ("pwmMin", 1000.0),
        ("pwmMax", 2000.0),
        ("spin_min", 0.0),
        ("spin_max", 1.0),
        // A limit of the slope of commands is no lag.
        ("slew_max", 0.0),
        ("disc_area", disc_m2),
        ("mdrag_coef", (linear / momentum).clamp(0.0, drag_n / (momentum * SPEED_M_S))),
        ("num_motors", flat.rotors.len() as f64),
    ] {
        frame.insert(key.to_owned(), number(value)?);
    }
    frame.insert("moment_inertia".to_owned(), triple(j.into())?);
    for (i, rotor) in flat.rotors.iter().enumerate() {
        let n = i + 1;
        frame.insert(format!("motor{n}_position"), triple(rotor.position)?);
        frame.insert(format!("motor{n}_vector"), triple([0.0, 0.0, -1.0])?);
        // Torque there is 0.05 of the diagonal times thrust times command: right in hover.
        let lever = 0.05 * 2.0 * arm_m * hover_command;
        frame.insert(format!("motor{n}_yaw"), number(rotor.yaw_sign * torque / (thrust * lever))?);
    }
    let mut text = serde_json::to_string_pretty(&json!(frame)).map_err(|e| e.to_string())?;
    text.push('\n');
    Ok(text)
}
