//! Wing-aware trajectories by successive convexification (docs/equations.md G.1).
//!
//! A [`Task`] says where a vehicle is, what it should be near to and what it must stay out of; a
//! [`Craft`] what it can do. A [`Planner`] makes a [`Plan`] of both. It always does: its [`Status`]
//! says whether every constraint holds.
//!
//! ```
//! use nalgebra::{Vector2, Vector3};
//! use squirrel_plan::trajectory::{Begin, Craft, KeepOut, Planner, RESERVE, Status, Task, Wanted};
//! use squirrel_plan::wing::WingModel;
//! use squirrel_sim::vehicle_file::VehicleFile;
//!
//! let vehicle = VehicleFile::squirrel();
//! let craft = Craft::of(&vehicle, 8.0, Some(WingModel::Flat), RESERVE)?;
//! let velocity = Vector3::new(6.0, 0.0, 0.0);
//! let begin = Begin { position: Vector3::zeros(), velocity, thrust: -craft.hover(), spread: 0.0 };
//! // Straight on for two seconds, past a trunk that stands in the way.
//! let wanted = (0..=20).map(|k| Wanted { position: velocity * (0.1 * f64::from(k)), velocity }).collect();
//! let trunk = KeepOut { centre: Vector2::new(8.0, 0.2), radius_m: 1.0 };
//! let task = Task::new(begin, wanted, vec![trunk], 0.1, f64::INFINITY)?;
//! let plan = Planner::default().plan(&craft, &task, None);
//! assert_eq!(plan.status, Status::Solved);
//! assert!(plan.track.points().iter().all(|point| (point.position.xy() - trunk.centre).norm() > 0.99));
//! # Ok::<(), String>(())
//! ```

mod model;
mod page;
mod scenario;
mod scp;
mod sides;
mod subproblem;
mod task;

pub use model::{Air, Craft, Motion, RESERVE, Slopes};
pub use page::{Shown, page};
pub use scp::Planner;
pub use subproblem::Weights;
pub use task::{Begin, KeepOut, Plan, STEPS_MAX, Status, Task, Wanted};
