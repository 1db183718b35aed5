//! What an emulated Cortex-M7 needs around the flight code: files of the host over semihosting, and
//! a count of instructions.

#![no_std]

pub mod host;
pub mod instructions;
