//! One pass over the vehicles: commands go in, steps are taken, motions come out, each chunk's
//! while it is in the processor.
//!
//! The threads of a pool outlive every call, so rows cannot be lent to them: they are handed
//! addresses. [`Batch::pass`] keeps the rows borrowed until all threads are done, and every chunk
//! touches the rows of its own vehicles only. Beside [`squirrel_sim::simd`], the only module with
//! `unsafe`.

use super::rows::{Block, Drive};
use super::{Autopilot, BODY_NUMBERS, Batch, BatchError, Call, Flown, Work, shape};
use squirrel_sim::simd::{BLOCK, Paths};
use std::slice;

/// Vehicles that a thread takes at once.
#[derive(Debug)]
pub(super) struct Chunk<T: Copy, const ROTORS: usize> {
    /// Number of its first vehicle.
    first: usize,
    pub(super) blocks: Box<[Block<T, ROTORS>]>,
    pub(super) drives: Box<[Drive<T>]>,
}

impl<T: Paths, const ROTORS: usize> Chunk<T, ROTORS> {
    /// * `drives` - of its vehicles
    pub(super) fn new(first: usize, block: &Block<T, ROTORS>, drives: &[Drive<T>]) -> Self {
        let of = |drives: &[Drive<T>]| {
            let mut block = block.clone();
            block.vehicles = drives.len();
            block
        };
        Self { first, blocks: drives.chunks(BLOCK).map(of).collect(), drives: drives.into() }
    }
}

/// Where rows of all vehicles begin.
#[derive(Debug, Clone, Copy)]
struct Rows<P>(P);

// SAFETY: each stands for rows that `Batch::pass` has borrowed, and of which no two threads touch
// the same.
#[allow(unsafe_code, reason = "addresses are not sent otherwise")]
unsafe impl<T: Sync> Send for Rows<*const T> {}
// SAFETY: as above.
#[allow(unsafe_code, reason = "addresses are not sent otherwise")]
unsafe impl<T: Send> Send for Rows<*mut T> {}

/// A call, who takes its steps, and what goes in and out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Job<T: Copy, const ROTORS: usize> {
    call: Call,
    work: Work<T, ROTORS>,
    autopilot: Option<(Flown<T, ROTORS>, Autopilot)>,
    commands: Option<Rows<*const T>>,
    states: Option<Rows<*mut T>>,
}

/// What a thread does with a chunk.
pub(super) fn do_job<T: Paths, const ROTORS: usize>(
    chunk: &mut Chunk<T, ROTORS>,
    job: Job<T, ROTORS>,
) {
    let Chunk { first, blocks, drives } = chunk;
    let width = BODY_NUMBERS + ROTORS;
    if let Some(Rows(commands)) = job.commands {
        // SAFETY: `Batch::pass` has checked that there are rows of all vehicles, keeps them
        // borrowed, and nobody writes to them.
        #[allow(unsafe_code, reason = "see the module")]
        let commands =
            unsafe { slice::from_raw_parts(commands.add(*first * ROTORS), drives.len() * ROTORS) };
        let rows = commands.chunks(ROTORS * BLOCK).zip(drives.chunks(BLOCK));
        for (block, (commands, drives)) in blocks.iter_mut().zip(rows) {
            block.command(commands, drives);
        }
    }
    if job.call.steps > 0 {
        match job.autopilot {
            None => (job.work)(blocks, job.call),
            Some((flown, autopilot)) => flown(blocks, job.work, job.call, autopilot),
        }
    }
    if let Some(Rows(states)) = job.states {
        // SAFETY: as above, but that these rows are borrowed for writing; chunks have no vehicle in
        // common, and one thread at a time has a chunk.
        #[allow(unsafe_code, reason = "see the module")]
        let states =
            unsafe { slice::from_raw_parts_mut(states.add(*first * width), drives.len() * width) };
        for (block, rows) in blocks.iter().zip(states.chunks_mut(width * BLOCK)) {
            block.write_states(rows);
        }
    }
}

/// Ends the process when it is dropped: other threads may still have addresses of rows that are
/// about to go.
struct NoWayBack;

impl Drop for NoWayBack {
    fn drop(&mut self) {
        std::process::abort();
    }
}

impl<T: Paths, const ROTORS: usize> Batch<T, ROTORS> {
    /// Commands, steps and motions, where there are any, on as many threads as it is worth.
    ///
    /// # Errors
    /// Lengths that are not those of all vehicles.
    fn pass(
        &mut self,
        commands: Option<&[T]>,
        steps: usize,
        states: Option<&mut [T]>,
    ) -> Result<(), BatchError> {
        if let Some(commands) = commands {
            shape("commands", commands.len(), self.len() * ROTORS)?;
        }
        if let Some(states) = &states {
            shape("rows", states.len(), self.len() * (BODY_NUMBERS + ROTORS))?;
        }
        // Reading and writing a row takes about as long as a step.
        let work = usize::from(commands.is_some()) + usize::from(states.is_some());
        let job = Job {
            call: Call { settings: self.settings, steps },
            work: self.work,
            autopilot: self.autopilot,
            commands: commands.map(|rows| Rows(rows.as_ptr())),
            states: states.map(|rows| Rows(rows.as_mut_ptr())),
        };
        let guard = NoWayBack;
        if self.len().saturating_mul(steps.saturating_add(work)) < WORTH_THREADS {
            self.pool.run_alone(job);
        } else {
            self.pool.run(job);
        }
        std::mem::forget(guard);
        Ok(())
    }

    /// Flies on, commands and wind held. A vehicle that leaves all bounds becomes NaN, and none of
    /// its neighbours with it.
    pub fn step(&mut self, steps: usize) {
        // Without rows there is nothing to refuse.
        let _ = self.pass(None, steps, None);
    }

    /// Tells the rotors what to do from now on.
    ///
    /// * `commands` - a row of `ROTORS` numbers for each vehicle, in the unit that it declares;
    ///   limited to their range, and the least of it for NaN; not looked at where a vehicle has no
    ///   rotor
    ///
    /// # Errors
    /// A length that is not [`Self::len`] times `ROTORS`.
    pub fn command(&mut self, commands: &[T]) -> Result<(), BatchError> {
        self.pass(Some(commands), 0, None)
    }

    /// Motion of all vehicles, a row each: position (NED, m), velocity (NED, m/s), attitude (body
    /// to NED, w x y z), angular rate (body, rad/s), rotor speeds (rad/s).
    ///
    /// * `rows` - [`Self::len`] times [`BODY_NUMBERS`]` + ROTORS` numbers
    ///
    /// # Errors
    /// A length that is another.
    pub fn write_states(&mut self, rows: &mut [T]) -> Result<(), BatchError> {
        self.pass(None, 0, Some(rows))
    }

    /// [`Self::command`], [`Self::step`] and [`Self::write_states`] in one pass: the same bits, in
    /// less time where there are many vehicles and few steps.
    ///
    /// # Errors
    /// As those.
    pub fn fly(&mut self, commands: &[T], steps: usize, rows: &mut [T]) -> Result<(), BatchError> {
        self.pass(Some(commands), steps, Some(rows))
    }
}

/// Vehicles times steps, or rows, below which a second thread costs more than it does.
const WORTH_THREADS: usize = 4000;
