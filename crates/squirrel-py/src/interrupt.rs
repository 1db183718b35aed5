//! Calls that take long and that Ctrl-C ends at once.
//!
//! Python's handlers run only in the thread that called, when it looks. Loops of our own look every
//! so many turns ([`look`], [`now_and_then`]), loops of a library ask whether to go on
//! ([`watched`]); where neither can be, the caller waits and looks while another thread works
//! ([`interruptible`]).

use pyo3::prelude::*;
use pyo3_stub_gen::derive::gen_stub_pyfunction;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Between two looks of a caller that waits.
const LOOK: Duration = Duration::from_millis(20);
/// Turns of a loop between two looks: each takes some microseconds.
pub(crate) const TURNS_A_LOOK: usize = 1024;
/// Of the thread that works: what the one that called would have had.
const STACK_BYTES: usize = 8 << 20;

/// Looks at signals so far.
static LOOKS: AtomicU64 = AtomicU64::new(0);

/// Looks at signals so far, for tests.
#[gen_stub_pyfunction(module = "squirrel._squirrel")]
#[pyfunction]
pub(crate) fn looks() -> u64 {
    LOOKS.load(Ordering::Relaxed)
}

/// Lets Python's handlers run.
///
/// # Errors
/// What a handler raises.
pub(crate) fn look(py: Python<'_>) -> PyResult<()> {
    LOOKS.fetch_add(1, Ordering::Relaxed);
    py.check_signals()
}

/// [`look`], in some turns of a loop.
///
/// # Errors
/// What a handler raises.
#[inline]
pub(crate) fn now_and_then(py: Python<'_>, turn: usize) -> PyResult<()> {
    if turn % TURNS_A_LOOK == TURNS_A_LOOK - 1 { look(py) } else { Ok(()) }
}

/// What Python's own handler of a signal raises, where the interpreter's lock is free.
pub(crate) fn signalled() -> PyResult<()> {
    Python::attach(look)
}

/// Work of a library that asks now and then whether it should go on; the interpreter's lock is free
/// meanwhile.
///
/// # Errors
/// What a handler raised.
pub(crate) fn watched<T: Send, E: Send>(
    py: Python<'_>,
    work: impl FnOnce(&mut dyn FnMut() -> bool) -> Result<T, E> + Send,
) -> PyResult<Result<T, E>> {
    let mut signal = None;
    let out = py.detach(|| {
        work(&mut || match signalled() {
            Ok(()) => true,
            Err(raised) => {
                signal = Some(raised);
                false
            }
        })
    });
    signal.map_or(Ok(out), Err)
}

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
        if let Err(signal) = look(py) {
            stop.0.store(true, Ordering::Relaxed);
            return Err(signal);
        }
    }
}
