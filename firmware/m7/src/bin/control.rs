//! Nothing but control, for who estimates by himself: what it takes of flash and stack, and the
//! proof that it cannot panic.
//!
//! The panic handler calls a function that does not exist. Where the linker finds a way from there
//! to a panic it must resolve that name, and fails. It is not run; the flight code's constants are
//! hidden from the compiler, so that it cannot leave out what these would not need.

#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use squirrel_core::stack::{SensorFrame, Stack, StackOutput, StackState};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn a_panic_can_be_reached_from_control() -> !;
    }
    // SAFETY: it is never called; a program in which it could be does not link.
    unsafe { a_panic_can_be_reached_from_control() }
}

static STACK: Option<Stack> = None;

/// The stack analysis starts here.
#[inline(never)]
fn squirrel_control(stack: &Stack, state: &mut StackState, frame: &SensorFrame) -> StackOutput {
    stack.control(state, frame)
}

#[entry]
fn main() -> ! {
    let mut state = StackState::default();
    loop {
        if let Some(stack) = black_box(&STACK) {
            black_box(squirrel_control(stack, &mut state, &black_box(SensorFrame::empty(0))));
        }
    }
}
