//! Plays recorded sensor frames through the flight code and says the hash of every output.
//!
//! `play VECTORS` where the file is one of `squirrel export-vectors`. One line a sequence:
//! `sequence STEPS HASH same|differs@STEP`, then a name and `CALLS MEAN WORST` instructions each of
//!
//! - `inner`, `outer`: `Stack::control` without and with the outer loop
//! - `inertial`, `aided`: the estimator where only inertial units spoke, and where anything else
//!   did, too
//! - `whole`: `Stack::step`, all of these
//!
//! Each frame is flown twice, whole and in parts, and both must say the same.

#![no_std]
#![no_main]

use core::fmt::Write;
use cortex_m_rt::entry;
use squirrel_core::estimate::navigator::Navigated;
use squirrel_core::stack::wire::{
    HASH_START, Header, RECORD_MAX, Reader, Record, SETUP, Wire, hash, written,
};
use squirrel_core::stack::{SensorFrame, Stack, StackOutput, StackState};
use squirrel_m7::host::{File, argument, exit};
use squirrel_m7::instructions::{Counter, Counts};

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    if let Some(mut out) = File::create(b"/dev/stdout\0") {
        let _ = writeln!(out, "{info}");
    }
    exit(false)
}

/// One setup and its frames.
struct Sequence {
    stack: Stack,
    state: StackState,
    state_of_parts: StackState,
    steps: u32,
    hash: u64,
    differs_at: Option<u32>,
    inner: Counts,
    outer: Counts,
    inertial: Counts,
    aided: Counts,
    whole: Counts,
}

impl Sequence {
    fn new(stack: &Stack) -> Self {
        Self {
            stack: *stack,
            state: StackState::default(),
            state_of_parts: StackState::default(),
            steps: 0,
            hash: HASH_START,
            differs_at: None,
            inner: Counts::default(),
            outer: Counts::default(),
            inertial: Counts::default(),
            aided: Counts::default(),
            whole: Counts::default(),
        }
    }

    fn step(&mut self, counter: &mut Counter, frame: &SensorFrame, expected: u64) -> Option<()> {
        let (output, count) = counter.of(|| one_step(&self.stack, &mut self.state, frame));
        self.whole.add(count);
        let before = self.hash;
        self.hash = written(&output, |bytes| hash(before, bytes))?;
        let of_parts = self.parts(counter, frame);
        let is_same = written(&of_parts, |bytes| hash(before, bytes))? == self.hash;
        if !(is_same && self.hash == expected) && self.differs_at.is_none() {
            self.differs_at = Some(self.steps);
        }
        self.steps += 1;
        Some(())
    }

    fn parts(&mut self, counter: &mut Counter, frame: &SensorFrame) -> StackOutput {
        let (stack, state) = (&self.stack, &mut self.state_of_parts);
        let (navigated, to_navigate) = counter.of(|| navigate(stack, state, frame));
        let (mut output, to_control) = counter.of(|| control(stack, state, &navigated.frame));
        let ((), to_watch) = counter.of(|| watch(stack, state, &navigated, &mut output));
        let is_aided =
            frame.gnss.is_some() || frame.altitude_m.is_some() || frame.magnetic.is_some();
        let estimator = if is_aided { &mut self.aided } else { &mut self.inertial };
        estimator.add(to_navigate + to_watch);
        let loops = if output.outer.is_some() { &mut self.outer } else { &mut self.inner };
        loops.add(to_control);
        output
    }

    fn report(&self, out: &mut File) -> Option<()> {
        write!(out, "sequence {} {:016x} ", self.steps, self.hash).ok()?;
        match self.differs_at {
            None => write!(out, "same"),
            Some(step) => write!(out, "differs@{step}"),
        }
        .ok()?;
        write!(out, " inner {} outer {}", self.inner, self.outer).ok()?;
        writeln!(out, " inertial {} aided {} whole {}", self.inertial, self.aided, self.whole).ok()
    }
}

// Functions of their own, as a task of a real board would call them.

#[inline(never)]
fn one_step(stack: &Stack, state: &mut StackState, frame: &SensorFrame) -> StackOutput {
    stack.step(state, frame)
}

#[inline(never)]
fn navigate(stack: &Stack, state: &mut StackState, frame: &SensorFrame) -> Navigated {
    stack.navigate(state, frame)
}

#[inline(never)]
fn control(stack: &Stack, state: &mut StackState, frame: &SensorFrame) -> StackOutput {
    stack.control(state, frame)
}

#[inline(never)]
fn watch(stack: &Stack, state: &mut StackState, navigated: &Navigated, output: &mut StackOutput) {
    stack.watch(state, navigated, output);
}

/// Whether every output was the host's; `None` where the file is not what it should be.
fn play(counter: &mut Counter) -> Option<bool> {
    let mut out = File::create(b"/dev/stdout\0")?;
    let mut path = [0; 256];
    let mut vectors = File::open(argument(&mut path)?)?;
    let mut head = [0; Header::LENGTH];
    let header = vectors.read(&mut head).then(|| Header::take(&mut Reader::new(&head)))??;
    writeln!(out, "memory stack {} state {}", size_of::<Stack>(), size_of::<StackState>()).ok()?;
    let mut buffer = [0; RECORD_MAX];
    let (mut sequence, mut sequences, mut frames, mut same) = (None::<Sequence>, 0, 0, true);
    let mut finish = |sequence: &Option<Sequence>| {
        sequence.as_ref().map_or(Some(()), |done| {
            same &= done.differs_at.is_none();
            done.report(&mut out)
        })
    };
    while let Some(record) = vectors.record(&mut buffer) {
        if cfg!(feature = "changed-constant") && record.first() == Some(&SETUP) {
            // The lowest bit of the mass.
            *record.get_mut(1)? ^= 1;
        }
        match Record::take(&mut Reader::new(record))? {
            Record::Setup(stack) => {
                finish(&sequence)?;
                sequence = Some(Sequence::new(&stack));
                sequences += 1;
            }
            Record::Frame(frame, expected) => {
                sequence.as_mut()?.step(counter, &frame, expected)?;
                frames += 1;
            }
        }
    }
    finish(&sequence)?;
    // A file that breaks off is not a flight that went well.
    (header == Header { sequences, frames }).then_some(same)
}

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else { exit(false) };
    let mut counter = Counter::new(peripherals.SYST);
    match play(&mut counter) {
        Some(same) => exit(same),
        None => panic!("the vectors cannot be read, or break off"),
    }
}
