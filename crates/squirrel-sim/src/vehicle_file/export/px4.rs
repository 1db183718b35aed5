//! PX4: parameters as QGroundControl reads them. Control allocation (`CA_*`), hover throttle and
//! thrust model, and the vehicle of simulation in hardware (`SIH_*`, a quadrotor in X).

use super::flat::Flat;
use super::{Axes, Keeps, Pulls};
use std::fmt::Write;

pub(super) const KEEPS: Keeps = Keeps {
    rotors_apart: false,
    lags: 1,
    linear: Axes::Alike,
    quadratic: Axes::None,
    pulls: Pulls::AtCentreOfMass,
    axial: false,
    lift: false,
    flapping: false,
    wind: false,
    tilt: false,
    gyro: false,
    damping: true,
};

const FLOAT: u8 = 9;
const INT32: u8 = 6;

pub(super) fn text(flat: &Flat, keeps: &Keeps) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "# {}: made by squirrel vehicle export, target px4-params.\n\
         # Vehicle-Id Component-Id Name Value Type",
        super::plain_name(&flat.name)
    );
    let mut float = |name: &str, value: f64| {
        let _ = writeln!(out, "1\t1\t{name}\t{:.9}\t{FLOAT}", value as f32);
    };
    let [thrust, torque] = flat.mean_rotor();
    let most_n = thrust * flat.speed_max_rad_s().powi(2);
    let j = &flat.inertia_kg_m2;
    let arm = |axis: usize| {
        flat.rotors.iter().map(|r| r.from_centre[axis].abs()).sum::<f64>()
            / flat.rotors.len() as f64
    };
    for (i, rotor) in flat.rotors.iter().enumerate() {
        for (key, x) in ["PX", "PY", "PZ"].iter().zip(rotor.position) {
            float(&format!("CA_ROTOR{i}_{key}"), x);
        }
        // Positive for a rotor that turns counter-clockwise.
        float(&format!("CA_ROTOR{i}_KM"), rotor.yaw_sign * rotor.torque / rotor.thrust);
        // Allocation looks at them in relation to each other; 6.5 is what nobody has set.
        float(&format!("CA_ROTOR{i}_CT"), 6.5 * rotor.thrust / thrust);
    }
    float("MPC_THR_HOVER", flat.hover_thrust_fraction().clamp(0.1, 0.8));
    float("MPC_TILTMAX_AIR", flat.tilt_max_rad.to_degrees().clamp(20.0, 89.0));
    float("THR_MDL_FAC", flat.square_fraction());
    float("SIH_MASS", flat.mass_kg);
    float("SIH_IXX", j[(0, 0)]);
    float("SIH_IYY", j[(1, 1)]);
    float("SIH_IZZ", j[(2, 2)]);
    float("SIH_IXY", j[(0, 1)]);
    float("SIH_IXZ", j[(0, 2)]);
    float("SIH_IYZ", j[(1, 2)]);
    float("SIH_T_MAX", most_n);
    float("SIH_Q_MAX", most_n * torque / thrust);
    float("SIH_L_ROLL", arm(1));
    float("SIH_L_PITCH", arm(0));
    float("SIH_KDV", keeps.linear_of(flat)[0]);
    float("SIH_KDW", flat.damping);
    float("SIH_T_TAU", keeps.lag_of(flat)[0]);
    let capacity = flat.battery.as_ref().map(|b| (b.cells, b.capacity_ah));
    if let Some((_, ah)) = capacity {
        float("BAT1_CAPACITY", 1000.0 * ah);
    }
    let mut whole = |name: &str, value: u32| {
        let _ = writeln!(out, "1\t1\t{name}\t{value}\t{INT32}");
    };
    whole("CA_AIRFRAME", 0);
    whole("CA_ROTOR_COUNT", flat.rotors.len() as u32);
    if let Some((cells, _)) = capacity {
        whole("BAT1_N_CELLS", cells);
    }
    out
}
