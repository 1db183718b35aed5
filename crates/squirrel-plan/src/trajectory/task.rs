//! What is asked of a plan, checked once, and what comes back.

use super::model::{Air, Motion};
use nalgebra::{Vector2, Vector3};
use squirrel_sim::setting::SettingError;
use squirrel_sim::track::Track;

/// Most steps of a plan.
pub const STEPS_MAX: usize = 400;

/// Where a plan begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Begin {
    /// NED, m.
    pub position: Vector3<f64>,
    /// NED, m/s.
    pub velocity: Vector3<f64>,
    /// Force of the rotors, NED, N.
    pub thrust: Vector3<f64>,
    /// Deployment of the wings, 0 folded to 1 spread.
    pub spread: f64,
}

/// What to be near to at a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// NED, m.
    pub position: Vector3<f64>,
    /// NED, m/s.
    pub velocity: Vector3<f64>,
}

/// An upright cylinder that the vehicle's centre must stay out of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeepOut {
    /// North and east of its axis, m.
    pub centre: Vector2<f64>,
    /// Radius: that of the obstacle, of the vehicle, and what is kept to spare, m.
    pub radius_m: f64,
}

/// A checked task.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    begin: Begin,
    wanted: Vec<Wanted>,
    keep_out: Vec<KeepOut>,
    step_s: f64,
    speed_max_m_s: f64,
}

fn finite(field: &str, x: &Vector3<f64>, bound: f64) -> Result<(), SettingError> {
    match x.iter().find(|x| !(x.abs() <= bound)) {
        Some(x) => Err(SettingError::value(field, x, format!("must be finite and within {bound}"))),
        None => Ok(()),
    }
}

impl Air {
    /// A steady wind that is known, NED, m/s.
    ///
    /// # Errors
    /// A number that is no wind.
    pub fn windy(wind: Vector3<f64>) -> Result<Self, SettingError> {
        finite("wind_ned_m_s", &wind, 100.0)?;
        Ok(Self { wind, ..Self::calm() })
    }
}

impl Task {
    /// Checks a task.
    ///
    /// * `wanted` - at each node, the first at the beginning
    /// * `step_s` - from node to node
    /// * `speed_max_m_s` - of the horizontal speed; infinite for no limit
    ///
    /// # Errors
    /// The first number that cannot be used, with its field.
    pub fn new(
        begin: Begin,
        wanted: Vec<Wanted>,
        keep_out: Vec<KeepOut>,
        step_s: f64,
        speed_max_m_s: f64,
    ) -> Result<Self, String> {
        finite("position_ned_m", &begin.position, 1e5)?;
        finite("velocity_ned_m_s", &begin.velocity, 100.0)?;
        finite("thrust_ned_n", &begin.thrust, 1e4)?;
        if !(0.0..=1.0).contains(&begin.spread) {
            return Err(format!("deployment = {}: must be 0 to 1", begin.spread));
        }
        if !(0.01..=1.0).contains(&step_s) {
            return Err(format!("step_s = {step_s}: must be 0.01 to 1"));
        }
        if !(3..=STEPS_MAX + 1).contains(&wanted.len()) {
            let steps = wanted.len().saturating_sub(1);
            return Err(format!("reference: has {steps} steps, must have 2 to {STEPS_MAX}"));
        }
        for (k, node) in wanted.iter().enumerate() {
            finite(&format!("reference[{k}].position_ned_m"), &node.position, 1e5)?;
            finite(&format!("reference[{k}].velocity_ned_m_s"), &node.velocity, 100.0)?;
        }
        for (i, keep) in keep_out.iter().enumerate() {
            let place = Vector3::new(keep.centre.x, keep.centre.y, 0.0);
            finite(&format!("obstacles[{i}]"), &place, 1e5)?;
            if !(keep.radius_m > 0.0 && keep.radius_m <= 100.0) {
                let r = keep.radius_m;
                return Err(format!("obstacles[{i}].radius_m = {r}: must be > 0 and <= 100"));
            }
        }
        if !(speed_max_m_s > 0.0) {
            return Err(format!("speed_max_m_s = {speed_max_m_s}: must be > 0"));
        }
        Ok(Self { begin, wanted, keep_out, step_s, speed_max_m_s })
    }

    /// Where it begins.
    pub fn begin(&self) -> &Begin {
        &self.begin
    }

    /// What to be near to.
    pub fn wanted(&self) -> &[Wanted] {
        &self.wanted
    }

    /// What to stay out of.
    pub fn keep_out(&self) -> &[KeepOut] {
        &self.keep_out
    }

    /// From node to node, s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Limit of the horizontal speed, m/s.
    pub fn speed_max_m_s(&self) -> f64 {
        self.speed_max_m_s
    }

    /// How much faster than the limit a node is, m/s; 0 below it.
    pub(crate) fn overspeed_m_s(&self, now: &Motion) -> f64 {
        (now.velocity.xy().norm() - self.speed_max_m_s).max(0.0)
    }

    /// How deep the end of a step of a path is in what it must stay out of, and its middle, m; 0
    /// outside. Nothing can be done about where a path begins.
    pub(crate) fn violation_m(&self, before: &Motion, now: &Motion) -> f64 {
        let middle = (before.position + now.position) * 0.5
            + (before.velocity - now.velocity) * (self.step_s / 8.0);
        let depth = |place: Vector2<f64>| {
            let depths =
                self.keep_out.iter().map(|keep| keep.radius_m - (place - keep.centre).norm());
            depths.fold(0.0, f64::max)
        };
        depth(now.position.xy()).max(depth(middle.xy()))
    }
}

/// How a plan ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Every constraint holds, and nothing nearby is better.
    Solved,
    /// Every constraint holds; the bound on iterations came first.
    Feasible,
    /// No way was found to hold every constraint: the plan violates them least.
    Infeasible,
}

impl Status {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::Feasible => "feasible",
            Self::Infeasible => "infeasible",
        }
    }
}

/// A plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// How it ended.
    pub status: Status,
    /// What to fly.
    pub track: Track,
    /// What it costs, without what violations cost.
    pub cost: f64,
    /// How deep it is in what it must stay out of, at worst, m.
    pub violation_m: f64,
    /// How much faster it is than it may be, at worst, m/s.
    pub overspeed_m_s: f64,
    /// Convex problems that were solved.
    pub iterations: u32,
    /// Iterations of the solver in all of them: what a plan takes, whatever machine makes it.
    pub solver_iterations: u32,
}
