//! Wing-aware trajectories by successive convexification (docs/equations.md G.1).

mod model;
mod scp;
mod subproblem;
mod task;

pub use model::{Craft, Motion, Slopes};
pub use scp::Planner;
pub use subproblem::Weights;
pub use task::{Begin, KeepOut, Plan, STEPS_MAX, Status, Task, Wanted};
