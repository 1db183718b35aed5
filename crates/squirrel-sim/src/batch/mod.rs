//! Many vehicles at once: the registers that they lie in.

pub mod simd;
