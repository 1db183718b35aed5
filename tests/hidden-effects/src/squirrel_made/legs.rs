//! The legs of [`Further`] behind those of the programme.

use crate::further::Further;
use squirrel_core::frames::{In, Ned};
use squirrel_core::guidance::excite::{Leg, MAX_LEGS, Programme};
use squirrel_core::guidance::mission::Mission;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::stack::Stack;
use squirrel_sim::flight::Setup;

/// Heights above the start, m.
const STEP_M: f32 = 5.0;
const SINK_M: f32 = 22.0;
/// Speeds, m/s, and rates of change, m/s^2.
const STEP_M_S: f32 = 2.5;
const RISE_M_S: f32 = 6.0;
const SINK_M_S2: f32 = 5.0;
const GENTLE_M_S2: f32 = 4.0;
const DASH_M: f32 = 8.0;
const DASH_M_S: f32 = 5.0;
/// After a leg, s.
const SETTLE_S: f32 = 0.4;
const RECOVERY_S: f32 = 1.0;

/// The flight code of a setup with a longer programme.
pub(super) fn stack(setup: &Setup, further: Further) -> Result<Stack, String> {
    let stack = setup.stack().map_err(|error| error.to_string())?;
    let mission = setup.scenario.mission().map_err(|error| error.to_string())?;
    let Mission::Excite(programme) = mission else {
        return Err("the mission has no legs".to_owned());
    };
    let height_m = setup.scenario.height_m as f32;
    let start = In::new(Vector3::new(0.0, 0.0, -height_m));
    let mut all = programme.legs().to_vec();
    // The programme ends where it began.
    let mut at = Place { to: start, yaw_rad: all.last().map_or(0.0, |leg| leg.yaw_rad) };
    let room = MAX_LEGS - all.len();
    let sinking = at.descents(further);
    let mut opening = if further.opens_wings { at.openings() } else { Vec::new() };
    // The dashes, which come last, are left out where there is no place for them.
    opening.truncate(room - sinking.len());
    all.extend(opening);
    all.extend(sinking);
    let programme = Programme::new(start, &all, *programme.multisine());
    let mission = Mission::Excite(programme.map_err(|error| error.to_string())?);
    Stack::new(*stack.vehicle(), *stack.parameters(), mission).map_err(|error| error.to_string())
}

/// Where a leg begins.
#[derive(Debug, Clone, Copy)]
struct Place {
    to: In<Ned, f32>,
    yaw_rad: f32,
}

impl Place {
    /// A leg to a place beside this one, which the next starts from.
    fn leg(&mut self, by: Vector3<f32>, speed: f32, rate: f32, then_s: f32) -> Leg {
        self.to = self.to + In::new(by);
        let (ramp_s, cruise_s) = (speed / rate, by.norm() / speed);
        let move_s = (cruise_s + ramp_s).max(2.0 * ramp_s);
        Leg {
            duration_s: move_s + then_s,
            move_s,
            ramp_s,
            to: self.to,
            yaw_rad: self.yaw_rad,
            wings_s: [0.0; 2],
        }
    }

    fn descents(&mut self, further: Further) -> Vec<Leg> {
        let speeds = further.descents_m_s.into_iter().flatten();
        let down = Vector3::new(0.0, 0.0, SINK_M);
        let legs = speeds.flat_map(|speed| {
            let climb = self.leg(-down, RISE_M_S, GENTLE_M_S2, SETTLE_S);
            [climb, self.leg(down, speed as f32, SINK_M_S2, RECOVERY_S)]
        });
        legs.collect()
    }

    /// A hover, a climb, a descent, two dashes, with open wings in the middle of each.
    fn openings(&mut self) -> Vec<Leg> {
        let (up, ahead) = (Vector3::new(0.0, 0.0, -STEP_M), Vector3::new(DASH_M, 0.0, 0.0));
        let mut legs = vec![self.leg(Vector3::zeros(), 1.0, 1.0, SETTLE_S)];
        for by in [up, -up] {
            legs.push(self.leg(by, STEP_M_S, GENTLE_M_S2, SETTLE_S));
        }
        for by in [ahead, -ahead] {
            legs.push(self.leg(by, DASH_M_S, GENTLE_M_S2, SETTLE_S));
        }
        for leg in &mut legs {
            leg.wings_s = [0.3, 0.75].map(|part| part * leg.move_s);
        }
        legs
    }
}
