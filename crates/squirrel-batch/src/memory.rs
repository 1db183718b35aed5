//! What a batch remembers as bytes: to be put aside, copied, sent and taken up again, bit for bit.
//! Vehicles and settings are not in it: whoever takes a memory up has made the batch again first.

use super::rows::Block;
use super::{Batch, BatchError, CHUNK};
use squirrel_sim::simd::{BLOCK, Paths};
use squirrel_sim::tape::{Tape, on_tape};

/// Of the bytes.
const FORMAT: usize = 1;

impl<S: Paths, const ROTORS: usize> Block<S, ROTORS> {
    /// Everything that changes between two steps.
    fn keep(&mut self, tape: &mut Tape<'_>) -> Option<()> {
        on_tape!(tape, self.motion)?;
        on_tape!(tape, self.held)?;
        if let Some(extra) = &mut self.extra {
            extra.keep(tape)?;
        }
        self.autopilots.as_mut().map_or(Some(()), |autopilots| autopilots.keep(tape))
    }
}

impl<T: Paths, const ROTORS: usize> Batch<T, ROTORS> {
    /// Motions, targets, wings, batteries, loads, air and commands on their way.
    ///
    /// * `go_on` - asked now and then
    ///
    /// # Errors
    /// `go_on` says no.
    pub fn memory(&self, go_on: &mut dyn FnMut() -> bool) -> Result<Vec<u8>, BatchError> {
        let mut bytes = Vec::new();
        let mut tape = Tape::Write(&mut bytes);
        // Writing refuses nothing.
        let _ = self.head(&mut tape);
        for chunk in 0..self.chunks() {
            for block in &mut self.pool.chunk(chunk).blocks {
                let _ = block.keep(&mut tape);
            }
            if !go_on() {
                return Err(BatchError::Interrupted);
            }
        }
        Ok(bytes)
    }

    /// Takes up what [`Self::memory`] wrote of a batch of as many vehicles, with the same step and
    /// fitted with the same. Nothing has changed where it is refused.
    ///
    /// # Errors
    /// Bytes of another batch, or too few or too many; `go_on` says no.
    pub fn restore(
        &mut self,
        memory: &[u8],
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), BatchError> {
        let mut tape = Tape::Read(memory);
        let other = "of another batch: vehicles, rotors, dtype, dt_s or what they have differ";
        self.head(&mut tape).ok_or(BatchError::Memory(other))?;
        let broken = BatchError::Memory("too short, or damaged");
        let mut all = Vec::new();
        for chunk in 0..self.chunks() {
            let mut blocks = self.pool.chunk(chunk).blocks.clone();
            for block in &mut blocks {
                if block.keep(&mut tape).is_none() {
                    return Err(broken);
                }
            }
            all.push(blocks);
            if !go_on() {
                return Err(BatchError::Interrupted);
            }
        }
        if !tape.is_over() {
            return Err(BatchError::Memory("longer than this batch's"));
        }
        for (chunk, blocks) in all.into_iter().enumerate() {
            self.pool.chunk(chunk).blocks = blocks;
        }
        Ok(())
    }

    fn chunks(&self) -> usize {
        self.len().div_ceil(BLOCK * CHUNK)
    }

    /// What both sides must have.
    fn head(&self, tape: &mut Tape<'_>) -> Option<()> {
        tape.same(FORMAT)?;
        tape.same(self.len())?;
        tape.same(ROTORS)?;
        tape.same(size_of::<T>())?;
        tape.same(usize::from(self.fitted.wing))?;
        tape.same(self.fitted.stretches)?;
        tape.same(usize::from(self.fitted.is_plain()))?;
        tape.same(usize::from(self.autopilot.is_some()))?;
        tape.same(self.settings.dt_s.to_bits() as usize)
    }
}
