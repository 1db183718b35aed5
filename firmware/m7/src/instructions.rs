//! Instructions by SysTick.
//!
//! Under QEMU's `-icount shift=6` an instruction takes 64 ns of virtual time, and SysTick on the
//! core clock of the mps2-an500 counts 40 ns each. So a difference of ticks is a count of
//! instructions, exact and the same in every run, up to 10 million. They are instructions, not
//! cycles: a real M7 issues up to two at once and waits for memory.

use cortex_m::peripheral::{SYST, syst::SystClkSource};

const TOP: u32 = 0x00FF_FFFF;

/// Counts the instructions of calls.
pub struct Counter {
    timer: SYST,
    of_nothing: u32,
}

impl Counter {
    /// Starts the timer, and measures what counting itself takes.
    #[must_use]
    pub fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TOP);
        timer.clear_current();
        timer.enable_counter();
        let mut counter = Self { timer, of_nothing: 0 };
        let (_, of_nothing) = counter.of(|| core::hint::black_box(0));
        counter.of_nothing = of_nothing;
        counter
    }

    /// What a call gives, and how many instructions it took.
    pub fn of<T>(&mut self, call: impl FnOnce() -> T) -> (T, u32) {
        self.timer.clear_current();
        let before = SYST::get_current();
        let result = call();
        let ticks = before.wrapping_sub(SYST::get_current()) & TOP;
        (result, ((ticks * 5 + 4) / 8).saturating_sub(self.of_nothing))
    }
}

/// Mean and worst of some counts.
#[derive(Default)]
pub struct Counts {
    calls: u64,
    sum: u64,
    worst: u32,
}

impl Counts {
    /// One more call.
    pub fn add(&mut self, count: u32) {
        self.calls += 1;
        self.sum += u64::from(count);
        self.worst = self.worst.max(count);
    }
}

/// `calls mean worst`.
impl core::fmt::Display for Counts {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} {} {}", self.calls, self.sum / self.calls.max(1), self.worst)
    }
}
