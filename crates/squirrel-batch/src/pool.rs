//! Threads that live as long as their batch.
//!
//! Starting a thread costs more than a step of thousands of vehicles, and so does waking one that
//! sleeps. A thread that has run out of work therefore spins a while before it parks, and the
//! caller takes its share of the work instead of waiting. The work lies in chunks behind a mutex
//! each, which nobody ever waits for: a chunk is claimed by number first.

use std::hint::spin_loop;
use std::io;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::{self, JoinHandle};

/// Stack of a thread: an optimised step needs a few kilobytes, one that is not some megabytes.
const STACK_BYTES: usize = 16 << 20;

/// Looks at the ticket before a thread parks: about a millisecond, longer than what usually happens
/// between two steps.
const SPINS: usize = 20_000;
/// Looks of the caller at what is left before it yields: who still holds a chunk may need this very
/// core.
const CALLER_SPINS: usize = 500;

/// Chunks `C`, and threads that do jobs `J` on them.
#[derive(Debug)]
pub struct Pool<C, J> {
    shared: Arc<Shared<C, J>>,
    threads: Vec<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared<C, J> {
    chunks: Vec<Mutex<C>>,
    work: fn(&mut C, J),
    /// What to do; none to end.
    job: Mutex<Option<J>>,
    /// Number of the job in the high half, next chunk that nobody has claimed in the low half. One
    /// number, so that a thread that comes late cannot claim a chunk of a job that it has not read.
    ticket: AtomicU64,
    /// Chunks of this job that are done.
    done: AtomicUsize,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().expect("no job panics")
}

fn job_number(ticket: u64) -> u32 {
    (ticket >> 32) as u32
}

impl<C, J: Copy> Shared<C, J> {
    fn claim(&self, job: u32) -> Option<usize> {
        let mut ticket = self.ticket.load(Ordering::Acquire);
        loop {
            let chunk = ticket as u32 as usize;
            if job_number(ticket) != job || chunk >= self.chunks.len() {
                return None;
            }
            let taken = self.ticket.compare_exchange_weak(
                ticket,
                ticket + 1,
                Ordering::AcqRel,
                Ordering::Acquire,
            );
            match taken {
                Ok(_) => return Some(chunk),
                Err(now) => ticket = now,
            }
        }
    }

    /// All that is left of a job.
    fn help(&self, number: u32, job: J) {
        while let Some(chunk) = self.claim(number) {
            (self.work)(&mut lock(&self.chunks[chunk]), job);
            self.done.fetch_add(1, Ordering::Release);
        }
    }

    /// The number of the first job after `seen`.
    fn wait(&self, seen: u32) -> u32 {
        for _ in 0..SPINS {
            let number = job_number(self.ticket.load(Ordering::Acquire));
            if number != seen {
                return number;
            }
            spin_loop();
        }
        loop {
            let number = job_number(self.ticket.load(Ordering::Acquire));
            if number != seen {
                return number;
            }
            thread::park();
        }
    }

    fn serve(&self) {
        let mut seen = 0;
        loop {
            seen = self.wait(seen);
            let job = *lock(&self.job);
            let Some(job) = job else { return };
            self.help(seen, job);
        }
    }
}

impl<C: Send + 'static, J: Copy + Send + 'static> Pool<C, J> {
    /// * `threads` - that work, the caller among them; more than there are chunks are not started
    /// * `work` - what a job does to a chunk; must not panic
    ///
    /// # Errors
    /// A thread cannot be started.
    pub fn new(chunks: Vec<C>, threads: usize, work: fn(&mut C, J)) -> io::Result<Self> {
        let helpers = threads.min(chunks.len()).saturating_sub(1);
        let shared = Arc::new(Shared {
            chunks: chunks.into_iter().map(Mutex::new).collect(),
            work,
            job: Mutex::new(None),
            ticket: AtomicU64::new(0),
            done: AtomicUsize::new(0),
        });
        let mut pool = Self { shared, threads: Vec::new() };
        for _ in 0..helpers {
            let shared = Arc::clone(&pool.shared);
            let thread =
                thread::Builder::new().name("squirrel-batch".into()).stack_size(STACK_BYTES);
            pool.threads.push(thread.spawn(move || shared.serve())?);
        }
        Ok(pool)
    }

    /// Threads that were started, the caller not among them.
    pub fn threads(&self) -> usize {
        self.threads.len()
    }

    /// Does a job on every chunk, by the caller alone.
    pub fn run_alone(&mut self, job: J) {
        for chunk in &self.shared.chunks {
            (self.shared.work)(&mut lock(chunk), job);
        }
    }

    /// Does a job on every chunk, by all threads.
    pub fn run(&mut self, job: J) {
        if self.threads.is_empty() {
            return self.run_alone(job);
        }
        let number = self.announce(Some(job));
        self.shared.help(number, job);
        let mut spins = 0;
        while self.shared.done.load(Ordering::Acquire) < self.shared.chunks.len() {
            spins += 1;
            if spins < CALLER_SPINS { spin_loop() } else { thread::yield_now() }
        }
    }

    /// A chunk; nobody works on it while the pool is not running.
    pub fn chunk(&self, number: usize) -> MutexGuard<'_, C> {
        lock(&self.shared.chunks[number])
    }
}

impl<C, J> Pool<C, J> {
    /// Makes a job known under a new number. The one before is done, or was never taken.
    fn announce(&self, job: Option<J>) -> u32 {
        // Ending must not panic: a poisoned job is replaced like any other.
        *self.shared.job.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = job;
        self.shared.done.store(0, Ordering::Relaxed);
        let number = job_number(self.shared.ticket.load(Ordering::Relaxed)).wrapping_add(1);
        self.shared.ticket.store(u64::from(number) << 32, Ordering::Release);
        for thread in &self.threads {
            thread.thread().unpark();
        }
        number
    }
}

impl<C, J> Drop for Pool<C, J> {
    fn drop(&mut self) {
        self.announce(None);
        for thread in self.threads.drain(..) {
            // A thread that panicked has said so on its own.
            drop(thread.join());
        }
    }
}
