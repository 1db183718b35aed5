//! How far an import is: bytes worked through, of all files.

use std::cell::Cell;
use std::io::{self, Read};

/// Bytes between two calls of the watcher.
const STEP_BYTES: u64 = 1 << 20;

/// Counts bytes and tells a watcher now and then.
pub(super) struct Meter<'a> {
    done: Cell<u64>,
    told: Cell<u64>,
    total: u64,
    watch: &'a dyn Fn(u64, u64),
}

impl<'a> Meter<'a> {
    /// * `total` - bytes of all files
    /// * `watch` - gets the bytes done and the total
    pub(super) fn new(total: u64, watch: &'a dyn Fn(u64, u64)) -> Self {
        Self { done: Cell::new(0), told: Cell::new(0), total, watch }
    }

    pub(super) fn add(&self, bytes: usize) {
        let done = self.done.get() + bytes as u64;
        self.done.set(done);
        if done - self.told.get() >= STEP_BYTES {
            self.told.set(done);
            (self.watch)(done.min(self.total), self.total);
        }
    }
}

/// A reader whose bytes are counted.
pub(super) struct Metered<'a, R> {
    inner: R,
    meter: &'a Meter<'a>,
}

impl<'a, R> Metered<'a, R> {
    pub(super) fn new(inner: R, meter: &'a Meter<'a>) -> Self {
        Self { inner, meter }
    }
}

impl<R: Read> Read for Metered<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.meter.add(count);
        Ok(count)
    }
}
