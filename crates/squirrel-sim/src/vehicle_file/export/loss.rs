//! What a target cannot express, and the error that remains.

use super::flat::{self, Flat, SPEED_M_S};
use super::{Axes, Keeps, Pulls};
use crate::vehicle_file::VehicleFile;
use serde::Serialize;
use squirrel_core::effects::{Effects, forms};

/// How far off a force and a moment are, each the length of the difference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Error {
    /// N.
    pub force_n: f64,
    /// N m.
    pub moment_n_m: f64,
}

/// Where errors are told: rotors at their speed of hover, level, in still air.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Remains {
    /// At rest.
    pub hover: Error,
    /// At 5 m/s along body x.
    pub forward_5_m_s: Error,
    /// At 5 m/s along body y.
    pub sideways_5_m_s: Error,
    /// Climbing with 2 m/s.
    pub climb_2_m_s: Error,
}

/// One thing that a target has not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Lost {
    /// Effect or field of the vehicle file.
    pub what: String,
    /// What becomes of it.
    pub why: String,
    /// How large it is in hover and at 5 m/s along body x; `None` for what is no force: times,
    /// sensors, and what comes with manoeuvres.
    pub size: Option<[Error; 2]>,
}

const REST: [f64; 3] = [0.0; 3];
const FORWARD: [f64; 3] = [SPEED_M_S, 0.0, 0.0];
const SIDEWAYS: [f64; 3] = [0.0, SPEED_M_S, 0.0];
const CLIMB: [f64; 3] = [0.0, 0.0, -2.0];

/// Effects that are in the numbers of every target.
const IN_NUMBERS: [&str; 5] =
    ["mass_error", "inertia_error", "thrust_coefficient", "yaw_torque_coeff", "cg_offset"];

fn difference(a: [[f64; 3]; 2], b: [[f64; 3]; 2]) -> Error {
    let length =
        |i: usize| (0..3).map(|axis| (a[i][axis] - b[i][axis]).powi(2)).sum::<f64>().sqrt();
    // Rounding is no error of a model.
    let clean = |x: f64, of: [f64; 3]| {
        let scale = of.iter().map(|x| x * x).sum::<f64>().sqrt();
        if x < 1e-9 * scale.max(1e-6) { 0.0 } else { x }
    };
    Error { force_n: clean(length(0), a[0]), moment_n_m: clean(length(1), a[0]) }
}

/// Force and moment of what a target has, body FRD.
fn target_wrench(flat: &Flat, keeps: &Keeps, velocity: [f64; 3]) -> [[f64; 3]; 2] {
    let wind = if keeps.wind { [flat.wind[0], flat.wind[1], 0.0] } else { [0.0; 3] };
    // Level, nose to the north: body and world agree.
    let air = [0, 1, 2].map(|axis| velocity[axis] - wind[axis]);
    let across = air[0].hypot(air[1]);
    let speed = across.hypot(air[2]);
    let square = flat.hover_rad_s * flat.hover_rad_s;
    let factor = 1.0
        + if keeps.axial { flat.axial * air[2] } else { 0.0 }
        + if keeps.lift { flat.lift * across * across } else { 0.0 };
    let [mean_thrust, mean_torque] = flat.mean_rotor();
    let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
    for rotor in &flat.rotors {
        let (thrust, torque) = if keeps.rotors_apart {
            (rotor.thrust, rotor.torque)
        } else {
            (mean_thrust, mean_torque)
        };
        let thrust = thrust * square * factor;
        force[2] -= thrust;
        moment[0] -= rotor.position[1] * thrust;
        moment[1] += rotor.position[0] * thrust;
        moment[2] += rotor.yaw_sign * torque * square;
        if keeps.tilt {
            force[0] -= thrust * flat.tilt[0];
            force[1] -= thrust * flat.tilt[1];
        }
    }
    let (linear, area) = (keeps.linear_of(flat), keeps.area_of(flat));
    let line = [0, 1, 2].map(|axis| -linear[axis] * air[axis]);
    let square = [0, 1, 2].map(|axis| -flat::per_square(area[axis]) * speed * air[axis]);
    let count = flat.rotors.len() as f64;
    let hubs =
        [0, 1, 2].map(|axis| flat.rotors.iter().map(|r| r.position[axis]).sum::<f64>() / count);
    let centre = flat.cg.map(|x| -x);
    let [at_line, at_square] = match keeps.pulls {
        Pulls::AtCentreOfMass => [[0.0; 3]; 2],
        Pulls::AtCentre => [centre, centre],
        Pulls::LinearAtHubs => [hubs, [0.0; 3]],
    };
    for (place, drag) in [(at_line, line), (at_square, square)] {
        let [x, y, z] = place;
        let about =
            [y * drag[2] - z * drag[1], z * drag[0] - x * drag[2], x * drag[1] - y * drag[0]];
        for axis in 0..3 {
            force[axis] += drag[axis];
            moment[axis] += about[axis];
        }
    }
    if keeps.flapping {
        moment[0] -= flat.flapping * air[1];
        moment[1] += flat.flapping * air[0];
    }
    [force, moment]
}

pub(super) fn remains(flat: &Flat, keeps: &Keeps) -> Remains {
    let at =
        |velocity| difference(flat.plant_wrench(velocity), target_wrench(flat, keeps, velocity));
    Remains {
        hover: at(REST),
        forward_5_m_s: at(FORWARD),
        sideways_5_m_s: at(SIDEWAYS),
        climb_2_m_s: at(CLIMB),
    }
}

pub(super) fn lost(file: &VehicleFile, flat: &Flat, keeps: &Keeps) -> Result<Vec<Lost>, String> {
    let mut lost = Vec::new();
    for name in Effects::<f64>::NAMES.iter().filter(|name| file.effects.has(name)) {
        if let Some(why) = of_effect(file, keeps, name) {
            lost.push(Lost { what: format!("effects.{name}"), why, size: size(file, flat, name)? });
        }
    }
    of_file(file, flat, keeps, &mut lost);
    Ok(lost)
}

/// What becomes of an effect that a target has not; `None` where it has it.
fn of_effect(file: &VehicleFile, keeps: &Keeps, name: &str) -> Option<String> {
    let form = flat::form(&file.effects, name);
    let left_out = || Some("left out".to_owned());
    let at_5 = || Some(format!("form \"{form}\": right at 5 m/s, straight elsewhere"));
    match name {
        _ if IN_NUMBERS.contains(&name) => None,
        "motor_lag" => match keeps.lags {
            0 => left_out(),
            1 if form == "asymmetric" => Some("one lag for up and down: the mean".to_owned()),
            _ => None,
        },
        "weak_rotor" if keeps.rotors_apart => None,
        "weak_rotor" => Some("all rotors alike: their mean".to_owned()),
        "linear_drag" => match (keeps.linear, form) {
            (Axes::None, _) => left_out(),
            (_, "at_rotors") if keeps.pulls != Pulls::LinearAtHubs => {
                Some("acts at the centre of mass: damps no turning".to_owned())
            }
            (Axes::Alike, "isotropic" | "") => Some("acts along z, too".to_owned()),
            (Axes::Each, _) | (_, "isotropic" | "at_rotors" | "") => None,
            _ => Some("one number for x and y: the mean".to_owned()),
        },
        "quadratic_drag" => match (keeps.quadratic, form) {
            (Axes::None, _) if keeps.linear == Axes::None => left_out(),
            (Axes::None, _) => Some("linear drag instead, right at 5 m/s".to_owned()),
            (Axes::Each, _) | (_, "isotropic" | "") => None,
            _ => Some("one number for x and y: the mean".to_owned()),
        },
        "axial_inflow" if keeps.axial && form != "quadratic" => None,
        "axial_inflow" if keeps.axial => Some("only what is linear in speed".to_owned()),
        "translational_lift" if keeps.lift && matches!(form, "quadratic" | "at_rotors") => None,
        "translational_lift" if keeps.lift => at_5(),
        "flapping_moment" if keeps.flapping && form != "saturating" => None,
        "flapping_moment" if keeps.flapping => at_5(),
        "constant_wind" if keeps.wind && form != "log_profile" => None,
        "thrust_misalignment" if keeps.tilt => None,
        "rotor_gyro_torque" if keeps.gyro => None,
        "angular_damping" if keeps.damping && form != "quadratic" => None,
        _ => left_out(),
    }
}

/// What an effect alone does to force and moment.
fn size(file: &VehicleFile, flat: &Flat, name: &str) -> Result<Option<[Error; 2]>, String> {
    let rest = flat::plant(file, &flat::without(&file.effects, name))?;
    let at = |velocity| {
        let without = flat::wrench(&rest, velocity, flat.hover_rad_s, flat.rotors.len());
        difference(flat.plant_wrench(velocity), without)
    };
    let both = [at(REST), at(FORWARD)];
    let any = both.iter().any(|error| error.force_n > 0.0 || error.moment_n_m > 0.0);
    Ok(any.then_some(both))
}

/// What a target has not of the file itself.
fn of_file(file: &VehicleFile, flat: &Flat, keeps: &Keeps, lost: &mut Vec<Lost>) {
    let mut say = |is: bool, what: &str, why: &str| {
        if is {
            lost.push(Lost { what: what.to_owned(), why: why.to_owned(), size: None });
        }
    };
    let p = file.vehicle.parameters();
    let air = &p.propulsion.air;
    say(p.wing.is_some(), "wing", "left out: as with folded wings");
    let [up, down] = [p.propulsion.time_constant_up_s, p.propulsion.time_constant_down_s];
    say(
        keeps.lags == 0 && up.max(down) > 0.0,
        "propulsion.time_constant_s",
        "left out: rotors answer at once",
    );
    say(
        keeps.lags == 1 && up != down,
        "propulsion.time_constant_up_s, _down_s",
        "one lag for up and down: the mean",
    );
    say(
        air.axial_inflow_s_per_m != 0.0 && !keeps.axial,
        "propulsion.axial_inflow_s_per_m",
        "left out",
    );
    say(
        air.translational_lift_s2_per_m2 != 0.0,
        "propulsion.translational_lift_s2_per_m2",
        if keeps.lift { "right at 5 m/s" } else { "left out" },
    );
    say(
        air.flapping_moment_n_m_s_per_m != 0.0 && !keeps.flapping,
        "propulsion.flapping_moment_n_m_s_per_m",
        "left out",
    );
    let is_central = |name: &str| {
        let known = forms(Effects::<f64>::parameters(name).unwrap_or_default());
        file.effects.has(name)
            && known.contains(&"at_rotors")
            && flat::form(&file.effects, name) != "at_rotors"
    };
    let own = [
        air.axial_inflow_s_per_m,
        air.translational_lift_s2_per_m2,
        air.flapping_moment_n_m_s_per_m,
        p.drag.linear_n_s_per_m.norm(),
    ];
    say(
        keeps.pulls == Pulls::LinearAtHubs
            && flat.acts_at_rotors
            && (own.iter().any(|number| *number != 0.0)
                || Effects::<f64>::NAMES.iter().any(|name| is_central(name))),
        "drag, inflow, lift and flapping at the centre of mass",
        "at the hubs, too, as the effects that are there: damp turning",
    );
    say(air.vortex_ring_fraction != 0.0, "propulsion.vortex_ring_fraction", "left out");
    let factors = file.vehicle.rotor_factors();
    say(
        factors.iter().flatten().any(|factor| *factor != 1.0) && !keeps.rotors_apart,
        "rotor[].thrust_fraction, torque_fraction",
        "all rotors alike: their mean",
    );
    let [x, y, z] = p.drag.linear_n_s_per_m.into();
    let kept = keeps.linear.of([x, y, z]);
    say(
        kept != [x, y, z],
        "drag.linear_n_s_per_m",
        match keeps.linear {
            Axes::None => "left out",
            Axes::Plane => "one number for x and y, none along z",
            _ => "one number for the axes",
        },
    );
    say(
        p.drag.area_m2 != 0.0 && keeps.quadratic == Axes::None,
        "drag.area_m2",
        if keeps.linear == Axes::None { "left out" } else { "linear drag instead, right at 5 m/s" },
    );
    say(
        flat.rotors
            .iter()
            .any(|rotor| (rotor.position[2] - flat.rotors[0].position[2]).abs() > 1e-9),
        "rotor[].position_body_m[2]",
        "kept, where the target takes heights",
    );
}
