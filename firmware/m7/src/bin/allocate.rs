//! Plays random demands through the weighted allocation: what they take, and whether the thrusts have the host's bits.
//!
//! `allocate`: one line a kind of demand, `NAME CALLS MEAN WORST` instructions, then `hash HASH same|differs`.

#![no_std]
#![no_main]

use core::fmt::Write;
use cortex_m_rt::entry;
use squirrel_m7::draws::{Draws, EACH, EXPECTED, HASH_START, KINDS, hash};
use squirrel_m7::host::{File, exit};
use squirrel_m7::instructions::{Counter, Counts};

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    if let Some(mut out) = File::create(b"/dev/stdout\0") {
        let _ = writeln!(out, "{info}");
    }
    exit(false)
}

fn measure(counter: &mut Counter) -> Option<bool> {
    let mut out = File::create(b"/dev/stdout\0")?;
    let mut hash_of_all = HASH_START;
    for (kind, name) in KINDS.into_iter().zip(["within", "beyond", "weak", "eight"]) {
        let mut draws = Draws::new(kind);
        let allocation = draws.allocation()?;
        let mut counts = Counts::default();
        for _ in 0..EACH {
            let case = draws.case();
            let (answer, count) = counter.of(|| case.allocate(&allocation));
            counts.add(count);
            hash_of_all = hash(hash_of_all, &answer);
        }
        writeln!(out, "{name} {counts}").ok()?;
    }
    let same = hash_of_all == EXPECTED;
    writeln!(out, "hash {hash_of_all:016x} {}", if same { "same" } else { "differs" }).ok()?;
    Some(same)
}

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else { exit(false) };
    let mut counter = Counter::new(peripherals.SYST);
    exit(measure(&mut counter) == Some(true))
}
