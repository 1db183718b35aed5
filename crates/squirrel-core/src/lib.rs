//! The flight code of squirrel: one control stack that flies in simulation, in Python and on a
//! Cortex-M7, bit for bit.
//!
//! Layers, top down. Each knows only what lies below it:
//!
//! - [`stack`]: the whole flight code as one function of (state, sensor frame); 300 Hz inside, 10
//!   Hz outside.
//! - [`estimate`]: where the vehicle is and how it stands, from noisy sensors.
//! - [`policy`]: what a learned policy sees and what its numbers mean.
//! - [`frame`]: what the sensors say at one instant.
//! - [`guidance`]: what to follow: reference trajectories, obstacle sensing.
//! - [`control`]: how to follow it: position control, wing decisions, thrust-wing coordination,
//!   attitude, mixer.
//! - [`command`]: what is asked: a reference, an attitude and a thrust.
//! - [`rnn`]: small networks, and the paper's learned wing force.
//! - [`dynamics`]: rotors, battery, servo, rigid body, RK4; whole vehicles on lanes.
//! - [`effects`]: physics that a vehicle may have on top of the base model, one file an effect.
//! - [`aero`]: drag, flat plate, membrane.
//! - [`vehicle`]: the numbers of one airframe, checked once.
//! - [`frames`], [`math`]: vectors that know their frame, and arithmetic whose bits do not depend
//!   on the target.
//! - [`lane`]: the scalar that physics and networks are written over: one number, a register of
//!   them, or a dual number.
//!
//! No allocation, no clock, no panic in a step; all memory of a controller is one plain `Copy`
//! struct. SI units and radians. World frame NED, body frame FRD, quaternions Hamilton, body to
//! world.
//!
//! ```
//! use squirrel_core::frames::{Body, In, Ned, Rotation};
//! use squirrel_core::nalgebra::Vector3;
//!
//! // Thrust acts along minus z of the body: with the nose up it pushes back.
//! let nose_up = Rotation::<Ned, Body, f64>::from_euler(0.0, 0.3, 0.0);
//! let thrust: In<Body, f64> = In::new(Vector3::new(0.0, 0.0, -1.0));
//! let force = (nose_up * thrust).vector;
//! assert!(force.x < -0.29 && force.z < -0.95);
//! ```
//!
//! `docs/embedding.md` has the whole flight code on a board in 30 lines.

#![cfg_attr(not(any(test, feature = "std")), no_std)]
#![deny(unsafe_code)]
#![cfg_attr(not(feature = "vfp"), forbid(unsafe_code))]

pub mod aero;
pub mod command;
pub mod control;
pub mod dynamics;
pub mod effects;
pub mod estimate;
pub mod frame;
pub mod frames;
pub mod guidance;
pub mod lane;
pub mod math;
pub mod policy;
pub mod rnn;
pub mod stack;
pub mod vehicle;

pub use nalgebra;
