//! One formula, one place: what is written in each of these files is written in no other, and who
//! needs it calls it.
//!
//! A formula is known by a piece of its text or by a constant that only it has. Comments and tests
//! do not count.
#![allow(clippy::unwrap_used, reason = "tests")]

mod repository;

use repository::{crates, product, products, root};
use std::collections::BTreeMap;
use std::fs;

/// Formula, pieces of its text without spaces, and where it stands.
const FORMULAS: [(&str, &[&str], &str); 38] = [
    ("drag of the airframe", &["linear[i]*flow.velocity[i]"], "core/src/aero/mod.rs"),
    (
        "flat plate",
        &["L::of(-AIR_DENSITY_KG_M3)*", "self.per_square*flow.speed", "L::of(0.56)+"],
        "core/src/aero/flat_plate.rs",
    ),
    (
        "thrust and moment of rotors",
        &["square*thrust[0]", "square*roll["],
        "core/src/dynamics/rotors.rs",
    ),
    ("rotor lag", &["gap*gap.where_positive"], "core/src/dynamics/rotors.rs"),
    (
        "rigid body",
        &["cross(omega,&times(inertia,omega))", "w*p+j*r-k*q"],
        "core/src/dynamics/body.rs",
    ),
    ("rotation matrix", &["ww+ii-jj-kk"], "core/src/lane/vector.rs"),
    ("membrane", &["steady-state.fast_camber", "c2*(c2+l)+l2"], "core/src/aero/membrane.rs"),
    (
        "battery",
        &["current*self.r1_ohm", "torque_coefficient*speed*speed*speed"],
        "core/src/dynamics/battery.rs",
    ),
    ("servo", &["target-(target-moved)*keep"], "core/src/dynamics/servo.rs"),
    ("exponential of lanes", &["0.041_666_294_947_198_99"], "core/src/lane/functions.rs"),
    (
        "quaternion law",
        &["omega_e[i]*(eta*sign)", "cr*cp*cy+sr*sp*sy"],
        "core/src/control/backstepping/quaternion.rs",
    ),
    (
        "command filter",
        &["gap*poles.stiffness-self.rate[i]*poles.damping"],
        "core/src/control/command_filter.rs",
    ),
    (
        "integral of the error",
        &["integral[i]+error[i]*dt_s"],
        "core/src/control/backstepping/mod.rs",
    ),
    (
        "yaw to turn to",
        &["wrap(commanded_rad-measured_rad)"],
        "core/src/control/backstepping/mod.rs",
    ),
    ("Euler kinematics", &["cr*cp*roll-sr*sp*pitch"], "core/src/control/backstepping/mod.rs"),
    ("mixer", &["w_i*a[i]+w_j*a[j]", "s*tilt[i]+u*self.collective[i]"], "core/src/control/mix.rs"),
    ("what effects do to a wrench", &["numbers.thrust_factor("], "core/src/dynamics/mod.rs"),
    ("added_mass", &["added_mass_kg*at.inverse_mass"], "core/src/dynamics/mod.rs"),
    ("angular_damping", &["size(*rate)*self.quadratic"], "core/src/effects/angular_damping.rs"),
    ("axial_inflow", &["self.quadratic*w*size(w)"], "core/src/effects/axial_inflow.rs"),
    ("battery_sag", &["self.load_gain*(load-"], "core/src/effects/battery_sag.rs"),
    ("cg_offset", &["cross(&self.offset_m,&at.force)"], "core/src/effects/cg_offset.rs"),
    ("constant_wind", &["ln(height_m.upper("], "core/src/effects/constant_wind.rs"),
    (
        "flapping_moment",
        &["(u*u+v*v).root()*self.per_scale"],
        "core/src/effects/flapping_moment.rs",
    ),
    (
        "ground_effect",
        &["L::of(1.0/16.0)", "self.radius_m/height_m"],
        "core/src/effects/ground_effect.rs",
    ),
    ("linear_drag", &["-x*u,"], "core/src/effects/linear_drag.rs"),
    ("payload_swing", &["v*self.decay+x*self.stiffness"], "core/src/effects/payload_swing.rs"),
    ("quadratic_drag", &["self.per_square[i]*at.flow"], "core/src/effects/quadratic_drag.rs"),
    ("induced speed", &["v*v*flow-square*square"], "core/src/aero/induced.rs"),
    ("rotor_gyro_torque", &["q*spin*self.inertia"], "core/src/effects/rotor_gyro_torque.rs"),
    ("rotor_wash", &["covered*(own[side]-pressure)"], "core/src/effects/rotor_wash.rs"),
    ("thrust_misalignment", &["at.thrust_n*x"], "core/src/effects/thrust_misalignment.rs"),
    (
        "translational_lift",
        &["one+across*L::of(SATURATION)"],
        "core/src/effects/translational_lift.rs",
    ),
    ("vortex_ring", &["self.gain*bump("], "core/src/effects/vortex_ring.rs"),
    ("wing_asymmetry", &["left*self.loss[0]"], "core/src/effects/wing_asymmetry.rs"),
    ("wing_membrane", &["flow.speed*per_speed).lower("], "core/src/effects/wing_membrane.rs"),
    (
        "wing_moment",
        &["self.upstream_m*(L::of(1.0)-sine)/in_plane"],
        "core/src/effects/wing_moment.rs",
    ),
    ("wing_tangential", &["spread*speed+tilted"], "core/src/effects/wing_tangential.rs"),
];

/// Files in which the density of the air becomes a force: one a law.
const DENSITY: [&str; 11] = [
    "core/src/aero/flat_plate.rs",
    "core/src/aero/induced.rs",
    "core/src/effects/quadratic_drag.rs",
    "core/src/effects/rotor_wash.rs",
    "core/src/effects/wing_tangential.rs",
    "core/src/math.rs",
    "core/src/vehicle/parameters.rs",
    "sim/src/plant/membrane.rs",
    // Other simulators are told it, and coefficients of propellers are over it.
    "sim/src/vehicle_file/export/ardupilot.rs",
    "sim/src/vehicle_file/export/mjcf.rs",
    "sim/src/vehicle_file/new/sizes.rs",
];

/// What a file calls, without spaces, instead of writing it again.
const CALLS: [(&str, &[&str]); 10] = [
    (
        "batch/src/dynamics.rs",
        &["derivative(&airframe", "whole::step::<", "whole::air::<", "servo.lead(", "packs.step("],
    ),
    ("batch/src/battery.rs", &["pack.discharge(", "pack.settle("]),
    (
        "batch/src/autopilot.rs",
        &[
            "filter.step(",
            "Target::from_euler(",
            "yaw_target(",
            "integrated(",
            ".torque(q,",
            "mixer.mix(",
        ],
    ),
    (
        "sim/src/plant/mod.rs",
        &["dynamics::derivative(", "membrane.evaluate(", "lead_servos(", "battery.step("],
    ),
    ("sim/src/plant/servo.rs", &["servo.lead_one("]),
    ("sim/src/plant/side_by_side.rs", &["whole::felt::<"]),
    (
        "core/src/dynamics/mod.rs",
        &["aero::drag(", "rotors::wrench(", "body::acceleration(", "with_effects("],
    ),
    (
        "core/src/dynamics/lanes.rs",
        &["drag(&airframe.linear_drag", "thrust_and_moment(", "lag_rate(", "body::acceleration("],
    ),
    (
        "core/src/dynamics/whole.rs",
        &["drag(&airframe", "membrane.evaluate(", "plate.normal_forces(", "with_effects("],
    ),
    ("plan/src/trajectory/model.rs", &["aero::drag(", "plate("]),
];

/// Code of all crates without blanks, by path.
fn code() -> BTreeMap<String, String> {
    let mut all = BTreeMap::new();
    for path in crates().iter().flat_map(|package| products(&package.join("src"))) {
        let text = fs::read_to_string(&path).unwrap();
        let code: String = product(&text).into_iter().flat_map(str::split_whitespace).collect();
        let name = path.strip_prefix(root().join("crates")).unwrap().to_str().unwrap();
        all.insert(name.replace("squirrel-", ""), code);
    }
    all
}

/// Files that hold a piece of text.
fn holding<'a>(all: &'a BTreeMap<String, String>, piece: &str) -> Vec<&'a str> {
    all.iter().filter(|(_, code)| code.contains(piece)).map(|(path, _)| path.as_str()).collect()
}

#[test]
fn each_formula_stands_in_one_file() {
    let all = code();
    for (formula, pieces, home) in FORMULAS {
        for piece in pieces {
            assert_eq!(holding(&all, piece), [home], "{formula}: {piece}");
        }
    }
}

#[test]
fn every_effect_with_an_equation_is_on_the_list() {
    for path in products(&root().join("crates/squirrel-core/src/effects")) {
        let name = path.file_stem().unwrap().to_str().unwrap();
        if fs::read_to_string(&path).unwrap().contains("Acts<L> for Numbers<L>") {
            assert!(FORMULAS.iter().any(|(formula, ..)| *formula == name), "{name}");
        }
    }
}

#[test]
fn the_density_of_air_is_asked_where_a_law_of_the_air_stands() {
    let all = code();
    let strangers = holding(&all, "AIR_DENSITY_KG_M3");
    let strangers: Vec<&str> =
        strangers.into_iter().filter(|path| !DENSITY.contains(path)).collect();
    assert!(strangers.is_empty(), "{strangers:?}");
}

#[test]
fn batch_plant_and_plan_call_them() {
    let all = code();
    for (file, calls) in CALLS {
        for call in calls {
            assert!(all[file].contains(call), "{file} does not call {call}");
        }
    }
}
