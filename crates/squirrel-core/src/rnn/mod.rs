//! Small recurrent networks that fly: fixed sizes, no allocation, no panic, the same bits wherever
//! they run.
//!
//! A network computes with [lanes](crate::lane): one `f32` in flight, a register of them in
//! training; one tanh for all.
//! - [`elman`]: the two-layer recurrent network of the paper, over a window or step by step.
//! - [`mlp`]: a network without memory.
//! - [`head`]: from the two outputs of the paper's network to a force on the wing, and the flow
//!   that it needs.
//! - [`parnn`]: network and head together, the force model that TWCC asks.
//!
//! Training (`squirrel-nn`) runs the code of this module on registers of windows, so that what was
//! trained is what flies.

pub mod elman;
pub mod head;
pub mod mlp;
pub mod parnn;
