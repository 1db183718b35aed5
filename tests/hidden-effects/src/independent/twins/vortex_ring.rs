//! A vehicle that sinks into its own wake loses thrust: that of all rotors times `1 - k s f`.
//!
//! ```text
//! x = w / v_h                                 descent through the air over the induced speed of hover
//! s = (1 - ((x - 1.25) / 0.6)^2)^2            inside, else 0; form `early`: 1.0 and 0.7
//! f = max(0, 1 - V_a^2 / v_h^2)               air across the rotors blows the ring away
//! v_h = sqrt(m g / (2 rho A))                 discs of all propellers
//! ```

use super::Sight;
use crate::airframe::AIR_DENSITY_KG_M3;
use crate::catalogue::{Entry, HiddenEffect, Kind, entry, signed};
use nalgebra::Vector3;

pub(crate) const ENTRY: Entry =
    entry("vortex_ring", Kind::Lift, &["early"], &[signed("gain", 0.05, 0.3)]).flown_by(acts, &[2]);

fn acts(effect: &HiddenEffect, at: &Sight) -> [Vector3<f64>; 2] {
    let loss = effect.number("gain") * ring(effect.form == "early", at);
    at.thrust_wrench.map(|pushed| -loss * pushed)
}

/// How much of a ring there is, 0 to 1.
fn ring(early: bool, at: &Sight) -> f64 {
    let (middle, half_width) = if early { (1.0, 0.7) } else { (1.25, 0.6) };
    let discs_m2 = at.rotors.all().len() as f64 * at.disc_m2();
    let hover_squared = at.weight_n / (2.0 * AIR_DENSITY_KG_M3 * discs_m2);
    let off = (at.air_body.z / hover_squared.sqrt() - middle) / half_width;
    let shape = (1.0 - off * off).max(0.0).powi(2);
    shape * (1.0 - at.air_body.xy().norm_squared() / hover_squared).max(0.0)
}
