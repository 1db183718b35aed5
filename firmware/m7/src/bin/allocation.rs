//! Nothing but the weighted allocation: what it takes of flash and stack, and the proof that it cannot panic.
//!
//! The panic handler calls a function that does not exist. Where the linker finds a way from there to a panic it must
//! resolve that name, and fails. It is not run; the airframe is hidden from the compiler.

#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use squirrel_core::control::allocation::{Allocation, AllocationTerms};
use squirrel_core::control::mixer::ThrustTorque;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::vehicle::{MAX_ROTORS, PerRotor};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn a_panic_can_be_reached_from_the_allocation() -> !;
    }
    // SAFETY: it is never called; a program in which it could be does not link.
    unsafe { a_panic_can_be_reached_from_the_allocation() }
}

static ALLOCATION: Option<Allocation> = None;

/// The stack analysis starts here.
#[inline(never)]
fn squirrel_allocation(
    allocation: &Allocation,
    demand: &ThrustTorque,
    [before, most]: &[PerRotor<f32>; 2],
) -> AllocationTerms {
    allocation.allocate(demand, before, most)
}

#[entry]
fn main() -> ! {
    let demand = ThrustTorque { thrust_n: 0.0, torque_n_m: Vector3::zeros() };
    loop {
        if let Some(allocation) = black_box(&ALLOCATION) {
            let thrusts = black_box([[0.0; MAX_ROTORS]; 2]);
            black_box(squirrel_allocation(allocation, &black_box(demand), &thrusts));
        }
    }
}
