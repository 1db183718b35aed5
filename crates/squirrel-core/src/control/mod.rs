//! Control: from a reference to rotor commands.
//!
//! Outer loop, 10 Hz ([`twcc`]): [`position`] (the paper's PC) asks for angles and thrust,
//! [`wing_force`] estimates what spread wings would do, [`woeg`] says whether that would help,
//! [`wiic`] takes over where the angles are at their limit. Or [`plus`], which chooses angles,
//! thrust and wings together. Or [`follow`], outside of the step, on a plan. Inner loop, 300 Hz:
//! [`command_filter`] smooths the 10 Hz steps, [`backstepping`] turns attitude error into torque,
//! [`lead`] makes up for a part of the rotors' lag, [`mixer`] turns thrust and torque into rotor
//! thrusts, by the rule in [`mix`]; [`supply`] is what the battery leaves of them.

pub mod backstepping;
pub mod command_filter;
pub mod follow;
pub mod lead;
pub mod mix;
pub mod mixer;
pub mod plus;
pub mod position;
pub mod supply;
pub mod twcc;
pub mod wiic;
pub mod wing_force;
pub mod woeg;

pub use crate::command::{AttitudeThrust, Reference};
