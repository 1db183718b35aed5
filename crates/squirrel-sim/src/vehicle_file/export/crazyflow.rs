//! crazyflow (TU Munich), first-principles dynamics: a table of parameters as its `params.toml` has
//! them, body FLU, rotor speeds in rpm.

use super::flat::Flat;
use super::{Axes, Keeps, Pulls, digits};
use std::f64::consts::TAU;
use std::fmt::Write;

pub(super) const KEEPS: Keeps = Keeps {
    rotors_apart: true,
    lags: 2,
    linear: Axes::Each,
    quadratic: Axes::None,
    pulls: Pulls::AtCentreOfMass,
    axial: false,
    lift: false,
    flapping: false,
    wind: false,
    tilt: false,
    gyro: true,
    damping: false,
};

/// # Errors
/// Another number of rotors than four.
pub(super) fn text(flat: &Flat, keeps: &Keeps) -> Result<String, String> {
    if flat.rotors.len() != 4 {
        return Err(format!("{}: {} rotors: crazyflow has four", flat.name, flat.rotors.len()));
    }
    let per_rpm = TAU / 60.0;
    let square = per_rpm * per_rpm;
    let j = &flat.inertia_kg_m2;
    let mut out = String::new();
    let _ = writeln!(
        out,
        "# For crazyflow/dynamics/first_principles/params.toml: body FLU (x ahead, y left, z up), SI, rpm. Made by\n\
         # `squirrel vehicle export --to crazyflow`. L is 1 m: the rows of the mixing matrix are in m.\n\
         [{}]\nmass = {}",
        // A key of TOML has no points in it.
        super::plain_name(&flat.name).replace('.', "_"),
        digits(flat.mass_kg)
    );
    let row = |values: &[f64]| values.iter().map(|x| digits(*x)).collect::<Vec<_>>().join(", ");
    // y and z turn over.
    let sign = [1.0, -1.0, -1.0];
    let _ = writeln!(out, "J = [");
    for r in 0..3 {
        let _ = writeln!(out, "    [{}],", row(&[0, 1, 2].map(|c| sign[r] * sign[c] * j[(r, c)])));
    }
    let top = |thrust: f64| thrust * flat.speed_max_rad_s().powi(2);
    let weakest = flat.rotors.iter().map(|r| r.thrust).fold(f64::INFINITY, f64::min);
    let _ = writeln!(out, "]\nthrust_min = 0.0\nthrust_max = {}\nL = 1.0", digits(top(weakest)));
    let _ = writeln!(out, "prop_inertia = {}", digits(flat.rotor_inertia));
    let alike = |of: &dyn Fn(usize) -> f64| (0..4).all(|i| of(i) == of(0));
    let mut curve = |key: &str, of: &dyn Fn(usize) -> f64| {
        if alike(of) {
            let _ = writeln!(out, "{key} = [0.0, 0.0, {}]", digits(square * of(0)));
        } else {
            // One row a rotor, which its dynamics take.
            let rows: Vec<String> =
                (0..4).map(|i| format!("[0.0, 0.0, {}]", digits(square * of(i)))).collect();
            let _ = writeln!(out, "{key} = [{}]", rows.join(", "));
        }
    };
    curve("rpm2thrust", &|i| flat.rotors[i].thrust);
    curve("rpm2torque", &|i| flat.rotors[i].torque);
    let [up, down] = keeps.lag_of(flat).map(|lag| 1.0 / lag.max(1e-4));
    let _ = writeln!(out, "rotor_dyn_coef = [{}, 0.0, {}, 0.0]", digits(up), digits(down));
    // Roll, pitch and yaw of a force along z up at (x, y) FLU: y, -x, and the reaction.
    let rows = [
        [0, 1, 2, 3].map(|i| -flat.rotors[i].position[1]),
        [0, 1, 2, 3].map(|i| -flat.rotors[i].position[0]),
        [0, 1, 2, 3].map(|i| -flat.rotors[i].yaw_sign),
    ];
    let _ = writeln!(out, "mixing_matrix = [");
    for values in rows {
        let _ = writeln!(out, "    [{}],", row(&values));
    }
    let _ = writeln!(out, "]\ndrag_matrix = [");
    let linear = keeps.linear_of(flat);
    for r in 0..3 {
        let values = [0, 1, 2].map(|c| if r == c { -linear[r] } else { 0.0 });
        let _ = writeln!(out, "    [{}],", row(&values));
    }
    let _ = writeln!(out, "]");
    Ok(out)
}
