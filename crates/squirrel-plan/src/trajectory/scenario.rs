//! A scenario as a task: what its mission would lead along if it were followed exactly, and what
//! stands there.
//!
//! The planner knows all of it from the beginning, so a plan brakes before the turn that an
//! obstacle will bring about.

use super::model::Craft;
use super::task::{Begin, KeepOut, STEPS_MAX, Task, Wanted};
use nalgebra::{Vector2, Vector3};
use squirrel_core::frames::In;
use squirrel_core::guidance::mission::{Mission, MissionState};
use squirrel_core::guidance::sensing::Obstacle;
use squirrel_sim::scenario::Scenario;

/// Obstacles further than this from the reference have no part in the task, m.
const AROUND_M: f64 = 15.0;

impl Task {
    /// The first part of a scenario, from hovering at its start.
    ///
    /// * `spare_m` - what obstacles grow by: the vehicle's half width, and what is kept to spare
    /// * `horizon_s` - how much of it; at most its duration
    ///
    /// # Errors
    /// One line where the scenario has no path of its own, or a number cannot be used.
    pub fn of(
        scenario: &Scenario,
        craft: &Craft,
        spare_m: f64,
        horizon_s: f64,
        step_s: f64,
    ) -> Result<Self, String> {
        let mission = scenario.mission().map_err(|e| format!("{}: {e}", scenario.name))?;
        if matches!(mission, Mission::Excite(_)) {
            let name = &scenario.name;
            return Err(format!(
                "scenario = {name}: is flown for its own manoeuvres, there is nothing to plan"
            ));
        }
        for (field, x) in [("horizon_s", horizon_s), ("step_s", step_s)] {
            if !(x > 0.0 && x.is_finite()) {
                return Err(format!("{field} = {x}: must be finite and > 0"));
            }
        }
        let steps = (horizon_s.min(scenario.duration_s) / step_s).round();
        if !(2.0..=STEPS_MAX as f64).contains(&steps) {
            return Err(format!(
                "horizon_s = {horizon_s}: makes {steps} steps, must make 2 to {STEPS_MAX}"
            ));
        }
        let trunks = scenario.all_obstacles();
        let wanted = reference(&mission, &trunks, steps as usize, step_s);
        let near = |[north, east, _]: &[f64; 3]| {
            let centre = Vector2::new(*north, *east);
            wanted.iter().any(|node| (node.position.xy() - centre).norm() < AROUND_M)
        };
        let keep_out = trunks.iter().filter(|trunk| near(trunk)).map(|[north, east, radius]| {
            KeepOut { centre: Vector2::new(*north, *east), radius_m: radius + spare_m }
        });
        let begin = Begin {
            position: Vector3::new(0.0, 0.0, -scenario.height_m),
            velocity: Vector3::zeros(),
            thrust: -craft.hover(),
            spread: 0.0,
        };
        let speed_max_m_s = scenario.speed_max_m_s.unwrap_or(f64::INFINITY);
        let keep_out = keep_out.collect();
        Self::new(begin, wanted, keep_out, step_s, speed_max_m_s)
    }
}

/// What the mission leads along where it is followed exactly.
fn reference(mission: &Mission, trunks: &[[f64; 3]], steps: usize, step_s: f64) -> Vec<Wanted> {
    let obstacles: Vec<Obstacle> = trunks
        .iter()
        .enumerate()
        .map(|(i, [north, east, _])| Obstacle {
            id: i as u32,
            north_m: *north as f32,
            east_m: *east as f32,
        })
        .collect();
    let mut state = MissionState::default();
    let mut wanted = Vec::with_capacity(steps + 1);
    for k in 0..=steps {
        let time_us = (k as f64 * step_s * 1e6).round() as u64;
        let before = mission.reference(&state, time_us);
        mission.sense(&mut state, time_us, before.position, before.velocity, &obstacles);
        let now = mission.reference(&state, time_us);
        let wide = |v: In<_, f32>| v.vector.cast::<f64>();
        wanted.push(Wanted { position: wide(now.position), velocity: wide(now.velocity) });
    }
    wanted
}
