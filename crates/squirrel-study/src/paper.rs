//! What follows from the paper's own numbers without a flight: its figures recomputed, and what its
//! limits allow.

use crate::statistics::gain;
use serde::Serialize;
use squirrel_core::aero::flat_plate;
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::stack::OUTER_PERIOD_US;
use squirrel_sim::flight::CONTROL_RATE_HZ;
use squirrel_sim::vehicle_file::VehicleFile;

/// Table III of the paper, RMSE in m: without wings, flat plate, paRNN.
pub const TABLE3_M: [[f64; 3]; 3] =
    [[4.7012, 4.4438, 4.8829], [4.6432, 4.3026, 4.5007], [3.9292, 4.1752, 4.2986]];
/// Mass of the silicone wings, kg (paper, section II.A).
const WINGS_KG: f64 = 0.024;
/// Speed of the forest, m/s.
const SPEED_M_S: f64 = 7.0;
/// Thrust-to-weight ratios of [`Facts::upward`].
const RATIOS: [f64; 4] = [1.1, 1.3, 2.0, 3.0];

/// Largest upward acceleration in level flight at 7 m/s, tilt up to the limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Upward {
    /// Thrust over weight.
    pub thrust_to_weight: f64,
    /// Without wings, m/s^2.
    pub wingless_m_s2: f64,
    /// With the flat plate, m/s^2.
    pub flat_m_s2: f64,
    /// The latter over the former.
    pub ratio: f64,
}

/// The facts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Facts {
    /// `mean(wingless) / mean(paRNN) - 1`: what the paper calls a gain of 13.1 %.
    pub gain: f64,
    /// `1 - mean(paRNN) / mean(wingless)`: by how much the error is smaller.
    pub reduction: f64,
    /// The gain of the flat plate over no wings.
    pub gain_flat: f64,
    /// And of paRNN over the flat plate.
    pub gain_over_flat: f64,
    /// Wings over the whole vehicle, by mass.
    pub wing_mass_share: f64,
    /// Inner steps of a tick of the outer loop.
    pub steps_per_tick: f64,
    /// Horizontal acceleration at the limit of one angle and constant height, m/s^2.
    pub level_m_s2: f64,
    /// Way to stop from 7 m/s with that, m.
    pub stop_m: f64,
    /// Share of encounters that 90.5 % of flights through seven of them need.
    pub per_encounter: f64,
    /// By ratio.
    pub upward: Vec<Upward>,
}

/// Of a vehicle with wings.
pub fn facts(vehicle: &VehicleFile) -> Facts {
    let [wingless, flat, parnn] = TABLE3_M;
    let p = vehicle.vehicle.parameters();
    let level_m_s2 = GRAVITY_M_S2 * p.limits.tilt_max_rad.tan();
    let upward = RATIOS.map(|thrust_to_weight| {
        let [wingless_m_s2, flat_m_s2] =
            [0.0, 1.0].map(|wings| upward(vehicle, thrust_to_weight, wings));
        Upward { thrust_to_weight, wingless_m_s2, flat_m_s2, ratio: flat_m_s2 / wingless_m_s2 }
    });
    Facts {
        gain: gain(&wingless, &parnn),
        reduction: 1.0 - 1.0 / (1.0 + gain(&wingless, &parnn)),
        gain_flat: gain(&wingless, &flat),
        gain_over_flat: gain(&flat, &parnn),
        wing_mass_share: WINGS_KG / p.mass_kg,
        steps_per_tick: (CONTROL_RATE_HZ * OUTER_PERIOD_US) as f64 * 1e-6,
        level_m_s2,
        stop_m: SPEED_M_S * SPEED_M_S / (2.0 * level_m_s2),
        per_encounter: 0.905_f64.powf(1.0 / 7.0),
        upward: upward.to_vec(),
    }
}

/// The best of pitch angles up to the limit, every hundredth of a degree, m/s^2.
fn upward(vehicle: &VehicleFile, thrust_to_weight: f64, wings: f64) -> f64 {
    let p = vehicle.vehicle.parameters();
    let area_m2 = p.wing.map_or(0.0, |wing| wing.area_per_side_m2 * wing.normal_force_slope);
    let thrust_n = thrust_to_weight * vehicle.vehicle.weight_n();
    let at = |share: f64| {
        let attitude =
            Rotation::<Ned, Body, f64>::from_euler(0.0, share * p.limits.tilt_max_rad, 0.0);
        let normal = attitude * In::new(Vector3::z());
        let air = flat_plate::force(
            In::<Ned, f64>::new(Vector3::x() * SPEED_M_S),
            normal,
            wings * area_m2,
        );
        (thrust_n * normal.vector.z - air.vector.z) / p.mass_kg - GRAVITY_M_S2
    };
    (-3000..=3000).map(|k| at(f64::from(k) / 3000.0)).fold(f64::NEG_INFINITY, f64::max)
}
