//! Guidance: what to follow.
//!
//! [`trajectory`] makes the paper's reference (cubic, then straight), [`sensing`] sees obstacles,
//! [`mission`] puts them together: fly straight, see an obstacle, steer away along a new reference.
//! [`excite`] flies manoeuvres for identification.

pub mod excite;
pub mod mission;
pub mod sensing;
pub mod trajectory;
