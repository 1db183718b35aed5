//! Many vehicles at once: rigid body, rotors with lag, drag, wind; each vehicle with numbers of its own.
//!
//! Sixteen vehicles lie side by side (`rows`), and the equations of `squirrel_core::dynamics` run on registers of them
//! ([`simd`], `dynamics`), on as many threads as asked for (`pool`). All steps of a call are done block by block, so that a
//! block stays in the processor for all of them. What a vehicle does depends on nothing but itself: the same bits in a batch
//! of any size, at any place in it, on any registers, on any number of threads, in one call or in many, and the numbers of
//! `squirrel_core::dynamics` in the same scalar.
//!
//! ```
//! use squirrel_sim::batch::{Batch, Settings};
//! use squirrel_sim::vehicle_file::VehicleFile;
//!
//! let vehicle = VehicleFile::squirrel().vehicle.cast::<f32>()?;
//! let mut batch: Batch<f32> = Batch::new(&[vehicle; 100], Settings::default())?;
//! batch.command(&[0.8; 100 * 4])?; // four rotors each, in the unit that the vehicle declares
//! batch.step(1000);
//! assert!(batch.state(7)?.position.vector.z < 0.0, "climbs");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod dynamics;
mod error;
mod pool;
mod rows;
pub mod simd;

pub use error::BatchError;

use dynamics::Advance;
use nalgebra::convert;
use pool::Pool;
use rows::{Block, Drive};
use simd::{BLOCK, Path, Paths};
use squirrel_core::dynamics::State;
use squirrel_core::frames::{In, Ned};
use squirrel_core::vehicle::{MAX_ROTORS, Vehicle};

/// Blocks that a thread takes at once: little enough to share out evenly, enough to be worth claiming.
const CHUNK: usize = 4;
/// Steps times vehicles below which a second thread costs more than it does.
const WORTH_THREADS: usize = 4000;
/// Numbers of a vehicle's motion in a row of [`Batch::write_states`], before those of its rotors.
pub const BODY_NUMBERS: usize = 13;

/// How steps are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// Runge-Kutta of fourth order, as the plant.
    Rk4,
    /// Explicit Euler: a quarter of the work, first order.
    Euler,
}

/// How a batch runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Step, s.
    pub dt_s: f64,
    /// How steps are taken.
    pub scheme: Scheme,
    /// Threads that work, the caller among them.
    pub threads: usize,
    /// Registers; all give the same bits.
    pub path: Path,
}

impl Default for Settings {
    /// RK4 at 1 kHz on all threads and the widest registers that there are.
    fn default() -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Self { dt_s: 1e-3, scheme: Scheme::Rk4, threads, path: Path::best() }
    }
}

/// Vehicles of up to `ROTORS` rotors that fly side by side.
#[derive(Debug)]
pub struct Batch<T: Paths, const ROTORS: usize = 4> {
    pool: Pool<Box<[Block<T, ROTORS>]>, Job>,
    drives: Vec<Drive<T>>,
    settings: Settings,
}

/// What a call asks for.
#[derive(Debug, Clone, Copy)]
struct Job {
    settings: Settings,
    steps: usize,
}

/// Takes the steps of a call.
fn work<T: Paths, const ROTORS: usize>(blocks: &mut Box<[Block<T, ROTORS>]>, job: Job) {
    let Settings { dt_s, scheme, path, .. } = job.settings;
    T::run(path, Advance { blocks, scheme, dt_s: convert(dt_s), steps: job.steps });
}

/// Where a vehicle is: chunk, block in it, column.
fn place(vehicle: usize) -> (usize, usize, usize) {
    let block = vehicle / BLOCK;
    (block / CHUNK, block % CHUNK, vehicle % BLOCK)
}

impl<T: Paths, const ROTORS: usize> Batch<T, ROTORS> {
    /// Vehicles at rest at the origin, level, rotors stopped and told to stay so, in calm air.
    ///
    /// * `vehicles` - with what effects change once, see `Effects::alter`; rotors beyond `rotor_count` are not there
    ///
    /// # Errors
    /// No vehicle, one with more than `ROTORS` rotors, a step that is not positive or longer than twice a rotor time constant,
    /// no threads.
    pub fn new(vehicles: &[Vehicle<T>], settings: Settings) -> Result<Self, BatchError> {
        const { assert!(ROTORS >= 1 && ROTORS <= MAX_ROTORS) };
        let dt_s = settings.dt_s;
        // In the scalar of the batch: what is positive in f64 may be nothing in f32.
        let dt = convert::<f64, T>(dt_s);
        if !(dt.is_finite() && dt > convert(0.0)) {
            return Err(BatchError::Step { dt_s });
        }
        if vehicles.is_empty() {
            return Err(BatchError::Empty);
        }
        if settings.threads == 0 {
            return Err(BatchError::NoThreads);
        }
        let chunks = vehicles.chunks(BLOCK * CHUNK);
        let chunks =
            chunks.map(|vehicles| vec![Block::empty(); vehicles.len().div_ceil(BLOCK)].into_boxed_slice());
        let pool = Pool::new(chunks.collect(), settings.threads, work)?;
        let drives = vehicles.iter().map(Drive::new).collect();
        let mut batch = Self { pool, drives, settings };
        for (number, vehicle) in vehicles.iter().enumerate() {
            batch.replace(number, vehicle)?;
        }
        Ok(batch)
    }

    /// Vehicles in it.
    #[allow(clippy::len_without_is_empty, reason = "never empty")]
    pub fn len(&self) -> usize {
        self.drives.len()
    }

    /// How it runs.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Another airframe for one vehicle; it keeps its motion, and its rotors their targets.
    ///
    /// # Errors
    /// As [`Self::new`]; or there is no such vehicle.
    pub fn replace(&mut self, number: usize, vehicle: &Vehicle<T>) -> Result<(), BatchError> {
        self.check(number)?;
        let p = vehicle.parameters();
        if p.rotor_count > ROTORS {
            return Err(BatchError::Rotors { vehicle: number, rotors: p.rotor_count, places: ROTORS });
        }
        let dt_s = self.settings.dt_s;
        for (key, tau) in [
            ("time_constant_up_s", p.propulsion.time_constant_up_s),
            ("time_constant_down_s", p.propulsion.time_constant_down_s),
        ] {
            let time_constant_s = nalgebra::try_convert(tau).unwrap_or(f64::NAN);
            if time_constant_s > 0.0 && dt_s > 2.0 * time_constant_s {
                return Err(BatchError::TimeConstant { vehicle: number, dt_s, key, time_constant_s });
            }
        }
        self.drives[number] = Drive::new(vehicle);
        let (chunk, block, lane) = place(number);
        self.pool.chunk(chunk)[block].put_vehicle(lane, vehicle);
        Ok(())
    }

    /// Puts one vehicle somewhere else. Its command and its wind stay.
    ///
    /// * `state` - rotor speeds only where the vehicle has rotors
    ///
    /// # Errors
    /// A number that is not finite, an attitude that is not a unit quaternion, no such vehicle.
    pub fn reset(&mut self, number: usize, state: &State<T>) -> Result<(), BatchError> {
        self.check(number)?;
        if !state.is_finite() {
            return Err(BatchError::NotFinite { what: "state", vehicle: number });
        }
        let norm = nalgebra::try_convert(state.attitude.norm()).unwrap_or(f64::NAN);
        if !((norm - 1.0).abs() < 1e-3) {
            return Err(BatchError::Attitude { vehicle: number, norm });
        }
        let (chunk, block, lane) = place(number);
        self.pool.chunk(chunk)[block].put_state(lane, state, &self.drives[number]);
        Ok(())
    }

    /// Motion of one vehicle.
    ///
    /// # Errors
    /// No such vehicle.
    pub fn state(&self, number: usize) -> Result<State<T>, BatchError> {
        self.check(number)?;
        let (chunk, block, lane) = place(number);
        Ok(self.pool.chunk(chunk)[block].state(lane))
    }

    /// Motion of all vehicles, a row each: position (NED, m), velocity (NED, m/s), attitude (body to NED, w x y z), angular
    /// rate (body, rad/s), rotor speeds (rad/s).
    ///
    /// * `rows` - [`Self::len`] times [`BODY_NUMBERS`]` + ROTORS` numbers
    ///
    /// # Errors
    /// A length that is another.
    pub fn write_states(&self, rows: &mut [T]) -> Result<(), BatchError> {
        let width = BODY_NUMBERS + ROTORS;
        shape("rows", rows.len(), self.len() * width)?;
        for (chunk, rows) in rows.chunks_mut(width * BLOCK * CHUNK).enumerate() {
            let blocks = self.pool.chunk(chunk);
            for (block, rows) in blocks.iter().zip(rows.chunks_mut(width * BLOCK)) {
                block.write_states(rows);
            }
        }
        Ok(())
    }

    /// Tells the rotors what to do from now on.
    ///
    /// * `commands` - a row of `ROTORS` numbers for each vehicle, in the unit that it declares; limited to their range, and the
    ///   least of it for NaN; not looked at where a vehicle has no rotor
    ///
    /// # Errors
    /// A length that is not [`Self::len`] times `ROTORS`.
    pub fn command(&mut self, commands: &[T]) -> Result<(), BatchError> {
        shape("commands", commands.len(), self.len() * ROTORS)?;
        let rows = commands.chunks(ROTORS * BLOCK * CHUNK).zip(self.drives.chunks(BLOCK * CHUNK));
        for (chunk, (commands, drives)) in rows.enumerate() {
            let mut blocks = self.pool.chunk(chunk);
            let rows = commands.chunks(ROTORS * BLOCK).zip(drives.chunks(BLOCK));
            for (block, (commands, drives)) in blocks.iter_mut().zip(rows) {
                block.command(commands, drives);
            }
        }
        Ok(())
    }

    /// Velocity of the air about one vehicle from now on, m/s.
    ///
    /// # Errors
    /// A number that is not finite, no such vehicle.
    pub fn set_wind(&mut self, number: usize, wind: In<Ned, T>) -> Result<(), BatchError> {
        self.check(number)?;
        if !wind.vector.iter().all(T::is_finite) {
            return Err(BatchError::NotFinite { what: "wind", vehicle: number });
        }
        let (chunk, block, lane) = place(number);
        self.pool.chunk(chunk)[block].put_wind(lane, wind);
        Ok(())
    }

    /// Flies on, commands and wind held. A vehicle that leaves all bounds becomes NaN, and none of its neighbours with it.
    pub fn step(&mut self, steps: usize) {
        let job = Job { settings: self.settings, steps };
        if self.len().saturating_mul(steps) < WORTH_THREADS {
            self.pool.run_alone(job);
        } else {
            self.pool.run(job);
        }
    }

    fn check(&self, vehicle: usize) -> Result<(), BatchError> {
        let vehicles = self.len();
        if vehicle < vehicles { Ok(()) } else { Err(BatchError::NoVehicle { vehicle, vehicles }) }
    }
}

fn shape(what: &'static str, given: usize, needed: usize) -> Result<(), BatchError> {
    if given == needed { Ok(()) } else { Err(BatchError::Shape { what, given, needed }) }
}
