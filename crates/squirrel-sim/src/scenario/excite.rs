//! Excitation flights: from a few numbers and a seed to the legs that the flight code flies, and to
//! words for a pilot.
//!
//! Two blocks in the order of the seed. The ladder goes down to each height of
//! [`ExciteTable::heights_m`], turns while it moves and hovers there, and climbs back. The dashes
//! go out and back along both horizontal axes, wings spread in the middle of each. The seed also
//! draws directions, the sense of turning, the moments of the wings and the multisine's phases.

use crate::setting::SettingError;
use serde::{Deserialize, Serialize};
use squirrel_core::frames::{In, Ned};
use squirrel_core::guidance::excite::{BAND_HZ, Leg, MAX_LEGS, Multisine, Programme};
use squirrel_core::guidance::mission::scramble;
use squirrel_core::math::wrap_angle;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::vehicle::ParameterError;
use std::fmt::Write as _;

/// Length of the flight, s.
pub(super) const DURATION_S: f64 = 40.0;
/// Descent to the first height and climb from the last one.
const CLIMB_S: f32 = 4.0;
const CLIMB_RAMP_S: f32 = 1.0;
/// All hovers of the ladder together, moves between them included.
const LADDER_S: f32 = 10.0;
const STEP_S: f32 = 1.0;
/// One dash, out or back.
const DASH_S: f32 = 5.5;
const DASH_RAMP_S: f32 = 2.3;
/// Heading of a dash back: speed along both body axes at once.
const DASH_YAW_RAD: f32 = 0.4;
/// Wings of a dash: open after the first speed-up, fold before the brake.
const WINGS_S: [f32; 2] = [2.2, 3.6];
const WINGS_DRAW_S: f32 = 0.2;
/// More hovers would each be shorter than the move to them.
const MAX_HEIGHTS: usize = 6;

/// Numbers of an excitation flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExciteTable {
    /// Top speed of the dashes' reference; a vehicle that follows it late rounds it off.
    pub speed_m_s: f64,
    /// Heights above the ground to hover at, in this order.
    pub heights_m: Vec<f64>,
    /// A full turn over the ladder, and dashes back at another heading; otherwise the nose stays
    /// north.
    pub turn: bool,
    /// Wings are spread in each dash; otherwise they stay folded.
    pub wings: bool,
    /// Amplitude of each line of the multisine on roll, pitch, yaw, below 3 Hz; above it falls with
    /// frequency.
    pub multisine_angle_rad: [f64; 3],
    /// Amplitude of each line of the multisine on thrust, as a share of the command.
    pub multisine_thrust_share: f64,
    /// Charge at the start of flights with an even seed; those with an odd seed start at
    /// `battery_charge`.
    pub even_seed_charge: f64,
}

impl ExciteTable {
    /// A table of the built-in scenarios; `None` for another name.
    pub(super) fn built_in(name: &str) -> Option<(f64, Self)> {
        let rich = Self {
            speed_m_s: 8.8,
            heights_m: vec![1.5, 0.9, 0.5, 0.2],
            turn: true,
            wings: true,
            multisine_angle_rad: [0.01, 0.01, 0.0015],
            multisine_thrust_share: 0.01,
            even_seed_charge: 0.5,
        };
        // Still: nothing to superpose.
        let (multisine_angle_rad, multisine_thrust_share) = ([0.0; 3], 0.0);
        match name {
            "excite_rich" => Some((10.8, rich)),
            "excite_normal" => {
                let normal = Self {
                    speed_m_s: 0.5 * rich.speed_m_s,
                    multisine_angle_rad,
                    multisine_thrust_share,
                    ..rich
                };
                Some((6.15, normal))
            }
            "excite_calm" => {
                let calm = Self {
                    speed_m_s: 1.7,
                    heights_m: vec![9.0],
                    turn: false,
                    wings: false,
                    multisine_angle_rad,
                    multisine_thrust_share,
                    ..rich
                };
                Some((11.0, calm))
            }
            _ => None,
        }
    }

    pub(super) fn check(&self) -> Result<(), SettingError> {
        if !(self.speed_m_s > 0.0 && self.speed_m_s <= 30.0) {
            return Err(SettingError::value("speed_m_s", self.speed_m_s, "must be > 0 and <= 30"));
        }
        if self.heights_m.is_empty() || self.heights_m.len() > MAX_HEIGHTS {
            let reason = format!("must be 1 to {MAX_HEIGHTS} heights");
            return Err(SettingError::value("heights_m", format!("{:?}", self.heights_m), reason));
        }
        if let Some(x) = self.heights_m.iter().find(|x| !(x.is_finite() && **x > 0.0 && **x <= 1e5))
        {
            return Err(SettingError::value("heights_m", x, "must be > 0 and <= 1e5"));
        }
        if !(0.0..=1.0).contains(&self.even_seed_charge) {
            return Err(SettingError::value(
                "even_seed_charge",
                self.even_seed_charge,
                "must be 0 to 1",
            ));
        }
        Ok(self.multisine(0).map(|_| ())?)
    }

    fn multisine(&self, seed: u32) -> Result<Multisine, ParameterError> {
        Multisine::new(
            self.multisine_angle_rad.map(|x| x as f32),
            self.multisine_thrust_share as f32,
            seed,
        )
    }

    /// What the flight code flies, from this height above the ground.
    pub(super) fn programme(&self, height_m: f64, seed: u64) -> Result<Programme, ParameterError> {
        let seed = (seed ^ (seed >> 32)) as u32;
        let draw = Draw { seed };
        let start = In::new(Vector3::new(0.0, 0.0, -height_m as f32));
        let (ladder, dashes) = (self.ladder(start, &draw), self.dashes(start, &draw));
        let legs: Vec<Leg> =
            if draw.coin(0) { [ladder, dashes].concat() } else { [dashes, ladder].concat() };
        debug_assert!(legs.len() <= MAX_LEGS);
        Programme::new(start, &legs, self.multisine(seed)?)
    }

    fn ladder(&self, start: In<Ned, f32>, draw: &Draw) -> Vec<Leg> {
        let hovers = self.heights_m.len() as f32;
        let step = if self.turn { draw.sign(1) * std::f32::consts::TAU / hovers } else { 0.0 };
        let at = |height_m: f64| In::new(Vector3::new(0.0, 0.0, -height_m as f32));
        let mut legs: Vec<Leg> = Vec::new();
        for (i, height_m) in self.heights_m.iter().enumerate() {
            let hover_s = LADDER_S / hovers;
            let (duration_s, move_s, ramp_s) = if i == 0 {
                (CLIMB_S + hover_s, CLIMB_S, CLIMB_RAMP_S)
            } else {
                (hover_s, STEP_S, 0.5 * STEP_S)
            };
            let yaw_rad = step * (i + 1) as f32;
            legs.push(Leg {
                duration_s,
                move_s,
                ramp_s,
                to: at(*height_m),
                yaw_rad,
                wings_s: [0.0; 2],
            });
        }
        let yaw_rad = step * hovers;
        legs.push(Leg {
            duration_s: CLIMB_S,
            move_s: CLIMB_S,
            ramp_s: CLIMB_RAMP_S,
            to: start,
            yaw_rad,
            wings_s: [0.0; 2],
        });
        legs
    }

    fn dashes(&self, start: In<Ned, f32>, draw: &Draw) -> Vec<Leg> {
        let length_m = self.speed_m_s as f32 * (DASH_S - DASH_RAMP_S);
        let mut axes = [Vector3::x() * draw.sign(2), Vector3::y() * draw.sign(3)];
        if draw.coin(4) {
            axes.swap(0, 1);
        }
        let mut legs = Vec::new();
        for (i, axis) in axes.iter().enumerate() {
            for back in [false, true] {
                let late = WINGS_DRAW_S * (2.0 * draw.share(5 + legs.len() as u32) - 1.0);
                let yaw =
                    if self.turn && back { draw.sign(9 + i as u32) * DASH_YAW_RAD } else { 0.0 };
                legs.push(Leg {
                    duration_s: DASH_S,
                    move_s: DASH_S,
                    ramp_s: DASH_RAMP_S,
                    to: if back { start } else { start + In::new(axis * length_m) },
                    yaw_rad: yaw,
                    wings_s: if self.wings { WINGS_S.map(|t| t + late) } else { [0.0; 2] },
                });
            }
        }
        legs
    }
}

/// The flight in words, one manoeuvre a line.
pub(super) fn card(programme: &Programme, height_m: f64) -> String {
    let mut card = String::new();
    let (mut from_s, mut from) = (0.0, Vector3::new(0.0, 0.0, -height_m));
    let mut yaw_rad = 0.0;
    for leg in programme.legs() {
        let to = leg.to.vector.map(f64::from);
        let way = to - from;
        let speed_m_s = way.norm() / f64::from(leg.move_s - leg.ramp_s);
        let mut words = if way.xy().norm() > 1.0 {
            let course = match (way.x.abs() > way.y.abs(), way.x + way.y > 0.0) {
                (true, true) => "north",
                (true, false) => "south",
                (false, true) => "east",
                (false, false) => "west",
            };
            format!(
                "dash {:.0} m {course} at {speed_m_s:.1} m/s, height {:.1} m",
                way.norm(),
                -to.z
            )
        } else {
            let verb = if way.z > 0.0 { "descend" } else { "climb" };
            format!("{verb} to {:.1} m at {speed_m_s:.1} m/s", -to.z)
        };
        if leg.duration_s > leg.move_s {
            let _ = write!(words, ", hover {:.1} s", leg.duration_s - leg.move_s);
        }
        let turn_rad = wrap_angle(leg.yaw_rad - yaw_rad);
        if turn_rad.abs() > 0.01 {
            let side = if turn_rad > 0.0 { "right" } else { "left" };
            let _ = write!(words, ", turn {:.0} deg {side} first", turn_rad.abs().to_degrees());
        }
        if leg.wings_s[1] > leg.wings_s[0] {
            let [open, fold] = leg.wings_s.map(|t| from_s + f64::from(t));
            let _ = write!(words, "; wings open at {open:.1} s, fold at {fold:.1} s");
        }
        let to_s = from_s + f64::from(leg.duration_s);
        let _ = writeln!(card, "{from_s:4.1} to {to_s:4.1} s  {words}");
        (from_s, from, yaw_rad) = (to_s, to, leg.yaw_rad);
    }
    if programme.multisine().tilt_max_rad() > 0.0 {
        let _ = writeln!(
            card,
            "throughout: sines of {} to {} Hz on roll, pitch, yaw and thrust, from the flight code; a pilot stirs the \
             sticks quickly, by a few degrees",
            BAND_HZ[0], BAND_HZ[1]
        );
    }
    card
}

/// Draws of one seed, by their number.
pub(super) struct Draw {
    pub(super) seed: u32,
}

impl Draw {
    fn bits(&self, n: u32) -> u32 {
        scramble(self.seed.wrapping_mul(0x9E37_79B9) ^ scramble(n + 1))
    }
    fn coin(&self, n: u32) -> bool {
        self.bits(n) & 1 == 1
    }
    fn sign(&self, n: u32) -> f32 {
        if self.coin(n) { 1.0 } else { -1.0 }
    }
    /// 0 to 1.
    pub(super) fn share(&self, n: u32) -> f32 {
        (self.bits(n) >> 8) as f32 / (1u32 << 24) as f32
    }
}
