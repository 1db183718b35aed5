//! Calls that take long and that Ctrl-C ends at once.
//!
//! Python's handlers run only in the thread that called, when it looks. It therefore waits and
//! looks, while another thread works.

use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Between two looks.
const LOOK: Duration = Duration::from_millis(20);
/// Of the thread that works: what the one that called would have had.
const STACK_BYTES: usize = 8 << 20;

/// Whether somebody still waits for the work.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Ends this thread if nobody does. To be called where a library tells its progress: it hears
    /// no answer, so the thread unwinds, which is no panic and prints nothing.
    pub(crate) fn check(&self) {
        if self.0.load(Ordering::Relaxed) {
            resume_unwind(Box::new("interrupted"));
        }
    }
}

/// Works on another thread until it is done or a signal's handler raises; the interpreter's lock is
/// free meanwhile.
///
/// # Errors
/// What the handler raised; the system gives no thread.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Stop) -> T + Send + 'static,
) -> PyResult<T> {
    let stop = Stop::default();
    let own = stop.clone();
    // Nothing is sent: it is closed when the thread ends, however that is.
    let (open, mut closed) = channel::<()>();
    let worker = thread::Builder::new().stack_size(STACK_BYTES).spawn(move || {
        let _open = open;
        work(&own)
    })?;
    loop {
        let closed = &mut closed;
        if py.detach(move || closed.recv_timeout(LOOK)) != Err(RecvTimeoutError::Timeout) {
            return worker.join().map_err(|panic| resume_unwind(panic));
        }
        if let Err(signal) = py.check_signals() {
            stop.0.store(true, Ordering::Relaxed);
            return Err(signal);
        }
    }
}
