//! `RotorPy` (Folk, Paulos, Kumar 2023): a module with the dictionary `quad_params`, body FLU.
//!
//! Rotor drag there goes with rotor speed and acts at the hubs, so that it damps rotation, as the forms
//! `at_rotors` of effects do. Of a vehicle without one the numbers are right at the speed of hover, and
//! the module's class `Vehicle` leaves the damping out.

use super::flat::Flat;
use super::{Axes, Keeps, Pulls, digits, flat};
use std::fmt::Write;

pub(super) const KEEPS: Keeps = Keeps {
    rotors_apart: false,
    lags: 1,
    linear: Axes::PlaneAndZ,
    quadratic: Axes::Each,
    pulls: Pulls::LinearAtHubs,
    axial: true,
    lift: true,
    flapping: true,
    wind: false,
    tilt: false,
    gyro: false,
    damping: false,
};

/// What follows the numbers.
const CLASS: &str = r#"

class Vehicle(Multirotor):
    """As squirrel flies it: gravity is 9.80665 m/s^2."""

    def __init__(self, **options):
        super().__init__(quad_params, **options)
        self.g = 9.80665
        self.weight = np.array([0.0, 0.0, -self.mass * self.g])
"#;

/// And what follows it where nothing acts at the hubs.
const UNDAMPED: &str = r"
    # Rotor drag does not damp rotation.
    def compute_body_wrench(self, body_rates, rotor_speeds, body_airspeed_vector):
        return super().compute_body_wrench(np.zeros(3), rotor_speeds, body_airspeed_vector)
";

/// # Errors
/// Another number of rotors than four.
pub(super) fn text(flat: &Flat, keeps: &Keeps) -> Result<String, String> {
    if flat.rotors.len() != 4 {
        return Err(format!("{}: {} rotors: RotorPy has four", flat.name, flat.rotors.len()));
    }
    let [thrust, torque] = flat.mean_rotor();
    let count = flat.rotors.len() as f64;
    let all_speeds = count * flat.hover_rad_s;
    let hover_n = thrust * flat.hover_rad_s * flat.hover_rad_s;
    let linear = keeps.linear_of(flat);
    let c_d = keeps.area_of(flat).map(flat::per_square);
    let j = &flat.inertia_kg_m2;
    let mut out = String::new();
    let _ = writeln!(
        out,
        "# {}, for RotorPy: body FLU (x ahead, y left, z up), SI. Made by `squirrel vehicle export --to rotorpy`.\n\
         import numpy as np\nfrom rotorpy.vehicles.multirotor import Multirotor\n\nquad_params = {{",
        super::plain_name(&flat.name)
    );
    let mut line = |key: &str, value: f64| {
        let _ = writeln!(out, "    '{key}': {},", digits(value));
    };
    line("mass", flat.mass_kg);
    line("Ixx", j[(0, 0)]);
    line("Iyy", j[(1, 1)]);
    line("Izz", j[(2, 2)]);
    // y and z turn over.
    line("Ixy", -j[(0, 1)]);
    line("Ixz", -j[(0, 2)]);
    line("Iyz", j[(1, 2)]);
    line("c_Dx", c_d[0]);
    line("c_Dy", c_d[1]);
    line("c_Dz", c_d[2]);
    line("k_eta", thrust);
    line("k_m", torque);
    line("k_d", linear[0] / all_speeds);
    line("k_z", linear[2] / all_speeds + hover_n * flat.axial / flat.hover_rad_s);
    line("k_h", hover_n * flat.lift);
    // Nose up is about +y in FRD, about -y here.
    line("k_flap", -flat.flapping / all_speeds);
    line("tau_m", keeps.lag_of(flat)[0].max(1e-4));
    line("rotor_speed_min", 0.0);
    line("rotor_speed_max", flat.speed_max_rad_s());
    line("motor_noise_std", 0.0);
    line("rotor_radius", flat.propeller_radius_m);
    // RotorPy looks at none of these.
    line("hover_rotor_speed", flat.hover_rad_s);
    let _ = writeln!(out, "    'num_rotors': {},\n    'rotor_pos': {{", flat.rotors.len());
    for (i, rotor) in flat.rotors.iter().enumerate() {
        let [x, y, z] = rotor.position;
        let (x, y, z) = (digits(x), digits(-y), digits(-z));
        let _ = writeln!(out, "        'r{}': np.array([{x}, {y}, {z}]),", i + 1);
    }
    // Torque about down is against torque about up.
    let directions: Vec<String> =
        flat.rotors.iter().map(|r| format!("{}", -r.yaw_sign as i64)).collect();
    let _ = writeln!(
        out,
        "    }},\n    'rotor_directions': np.array([{}]),\n    'rI': np.array([0.0, 0.0, 0.0]),\n}}",
        directions.join(", ")
    );
    out.push_str(CLASS);
    if !flat.acts_at_rotors {
        out.push_str(UNDAMPED);
    }
    Ok(out)
}
