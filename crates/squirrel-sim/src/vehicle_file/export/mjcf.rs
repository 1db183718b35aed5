//! `MuJoCo`: a free body with an actuator a rotor, body FLU.
//!
//! The control of an actuator is the thrust of a rotor that is as its file says, N. Its lag acts on
//! thrust, not on speed, which is the same for small changes. Drag is that of a ball without mass in
//! `MuJoCo`'s fluid model: viscosity gives what is linear, density what is quadratic.

use super::flat::Flat;
use super::{Axes, Keeps, Pulls, digits};
use squirrel_core::math::{AIR_DENSITY_KG_M3, GRAVITY_M_S2};
use std::f64::consts::PI;
use std::fmt::Write;

pub(super) const KEEPS: Keeps = Keeps {
    rotors_apart: true,
    lags: 1,
    linear: Axes::Alike,
    quadratic: Axes::Alike,
    pulls: Pulls::AtCentre,
    axial: false,
    lift: false,
    flapping: false,
    wind: true,
    tilt: true,
    gyro: false,
    damping: false,
};

/// Radius of the ball that drags, m: small, so that it turns freely.
const BALL_M: f64 = 0.01;

pub(super) fn text(flat: &Flat, keeps: &Keeps) -> String {
    let name = super::plain_name(&flat.name);
    // A comment has no two hyphens in a row.
    let said = name.replace("--", "-_");
    let j = &flat.inertia_kg_m2;
    let d = digits;
    let viscosity = keeps.linear_of(flat)[0] / (6.0 * PI * BALL_M);
    // Blunt drag there has no half before the density.
    let blunt = keeps.area_of(flat)[0] / (2.0 * PI * BALL_M * BALL_M);
    let cg = [flat.cg[0], -flat.cg[1], -flat.cg[2]];
    let place = |p: [f64; 3]| format!("{} {} {}", d(p[0]), d(p[1]), d(p[2]));
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<!-- {said}: world NWU, body FLU, SI. Control: thrust of each rotor, N. Made by squirrel vehicle export, target mjcf. -->\n\
         <mujoco model=\"{name}\">\n  \
         <compiler angle=\"radian\" autolimits=\"true\"/>\n  \
         <option gravity=\"0 0 {}\" timestep=\"0.001\" integrator=\"RK4\" density=\"{}\" viscosity=\"{}\" wind=\"{}\"/>\n  \
         <worldbody>\n    \
         <body name=\"{name}\" pos=\"0 0 0\">\n      \
         <freejoint/>",
        d(-GRAVITY_M_S2),
        d(AIR_DENSITY_KG_M3),
        d(viscosity),
        place([flat.wind[0], -flat.wind[1], 0.0]),
    );
    let _ = writeln!(
        out,
        "      <inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{} {} {} {} {} {}\"/>",
        place(cg),
        d(flat.mass_kg),
        d(j[(0, 0)]),
        d(j[(1, 1)]),
        d(j[(2, 2)]),
        d(-j[(0, 1)]),
        d(-j[(0, 2)]),
        d(j[(1, 2)]),
    );
    let half = flat.size_m.map(|x| 0.5 * x);
    let _ = writeln!(
        out,
        "      <geom name=\"airframe\" type=\"box\" size=\"{}\" mass=\"0\" contype=\"0\" conaffinity=\"0\"/>\n      \
         <geom name=\"drag\" type=\"sphere\" size=\"{}\" mass=\"0\" contype=\"0\" conaffinity=\"0\" fluidshape=\"ellipsoid\" \
         fluidcoef=\"{} 0 0 0 0\"/>",
        place(half),
        d(BALL_M),
        d(blunt),
    );
    for (i, rotor) in flat.rotors.iter().enumerate() {
        let [x, y, z] = rotor.from_centre;
        let _ =
            writeln!(out, "      <site name=\"rotor{}\" pos=\"{}\"/>", i + 1, place([x, -y, -z]));
    }
    let _ = writeln!(out, "    </body>\n  </worldbody>\n  <actuator>");
    let nominal = flat.propulsion.thrust_coefficient_n_s2;
    let top = nominal * flat.speed_max_rad_s().powi(2);
    let lag = keeps.lag_of(flat)[0];
    for (i, rotor) in flat.rotors.iter().enumerate() {
        let strength = rotor.thrust / nominal;
        // Reaction about up, over nominal thrust.
        let reaction = -rotor.yaw_sign * rotor.torque / nominal;
        let tilted = [-strength * flat.tilt[0], strength * flat.tilt[1], strength];
        let dynamics = if lag > 0.0 {
            format!("dyntype=\"filterexact\" dynprm=\"{}\" ", d(lag))
        } else {
            String::new()
        };
        let _ = writeln!(
            out,
            "    <general name=\"rotor{0}\" site=\"rotor{0}\" gear=\"{1} 0 0 {2}\" {3}ctrlrange=\"0 {4}\"/>",
            i + 1,
            place(tilted),
            d(reaction),
            dynamics,
            d(top),
        );
    }
    let _ = writeln!(out, "  </actuator>\n</mujoco>");
    out
}
