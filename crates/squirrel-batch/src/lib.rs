//! Many vehicles at once: rigid body, rotors with lag, drag, wind; wings, battery, gusts and
//! effects where vehicles have them; each vehicle with numbers of its own.
//!
//! Sixteen vehicles lie side by side (`rows`), and the equations of `squirrel_core::dynamics` run
//! on registers of them ([`squirrel_sim::simd`], `dynamics`), on as many threads as asked for
//! ([`pool`]). All steps of a call are done block by block, so that a block stays in the processor
//! for all of them. What a vehicle does depends on nothing but itself: the same bits in a batch of
//! any size, at any place in it, on any registers, on any number of threads, in one call or in
//! many, and the numbers of `squirrel_core::dynamics` in the same scalar.
//!
//! [`Batch::new`] takes airframes and flies the base model. [`Batch::with`] takes whole vehicles
//! ([`BatchVehicle`]): flat wings and membranes with their servos, batteries (`battery`), effects,
//! gusts (`air`) and late commands (`extra`), with the equations of [`squirrel_sim::plant::Plant`],
//! which `squirrel_core` has once for both. What no vehicle of the batch has is not computed. A wing
//! that is a network, and effects that act on sensors or stamps (accel_bias, accel_scale,
//! clock_skew, clock_step, compass_current, gnss_latency, gyro_scale, heading_bias), are refused.
//!
//! - [`Batch`]: vehicles side by side, in one scalar, of up to so many rotors
//! - [`BatchVehicle`]: one of them, with all that it may have
//! - `Block`: sixteen of them, a register or more; `Chunk`: blocks that a thread takes at once
//! - `AnyBatch`, in `squirrel-py`: a batch of any scalar and any number of rotors
//!
//! ```
//! use squirrel_batch::{Batch, Settings};
//! use squirrel_sim::vehicle_file::VehicleFile;
//!
//! let vehicle = VehicleFile::squirrel().vehicle.cast::<f32>()?;
//! let mut batch: Batch<f32> = Batch::new(&[vehicle; 100], Settings::default())?;
//! batch.command(&[0.8; 100 * 4])?; // four rotors each, in the unit that the vehicle declares
//! batch.step(1000);
//! assert!(batch.state(7)?.position.vector.z < 0.0, "climbs");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod access;
mod air;
mod autopilot;
mod battery;
mod dynamics;
mod error;
mod exchange;
mod extra;
mod memory;
pub mod pool;
mod rows;
pub mod task;
mod vehicle;

pub use autopilot::{Autopilot, SetPoint, Tuned};
pub use error::BatchError;
pub use vehicle::BatchVehicle;

use dynamics::{Advance, AdvanceWhole};
use exchange::{Chunk, Job, do_job};
use extra::Extra;
use nalgebra::convert;
use pool::Pool;
use rows::{Block, Drive, Tuning};
use squirrel_core::aero::flat_plate;
use squirrel_core::dynamics::State;
use squirrel_core::dynamics::whole::FLAT;
use squirrel_core::effects::{Prepared, Swing};
use squirrel_core::math::real;
use squirrel_core::vehicle::{MAX_ROTORS, Vehicle};
use squirrel_sim::plant::{MembraneParameters, ServoParameters, WingPlant};
use squirrel_sim::simd::{BLOCK, Path, Paths};
use vehicle::Fitted;

/// Blocks that a thread takes at once: little enough to share out evenly, enough to be worth
/// claiming.
const CHUNK: usize = 4;
/// Vehicles that are made between two looks at whether anybody still waits.
const LOOK: usize = 1024;
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
    pool: Pool<Chunk<T, ROTORS>, Job<T, ROTORS>>,
    vehicles: usize,
    fitted: Fitted,
    settings: Settings,
    work: Work<T, ROTORS>,
    autopilot: Option<(Flown<T, ROTORS>, Autopilot)>,
}

/// What a call asks for.
#[derive(Debug, Clone, Copy)]
struct Call {
    settings: Settings,
    steps: usize,
}

/// Takes the steps of a call. Pointers, so that programs do not carry what they do not fly.
type Work<T, const ROTORS: usize> = fn(&mut [Block<T, ROTORS>], Call);
/// The same, with an autopilot in between.
type Flown<T, const ROTORS: usize> = fn(&mut [Block<T, ROTORS>], Work<T, ROTORS>, Call, Autopilot);

/// Steps of the base model. Never inlined, as [`whole`] and `flown`: only then does a crate above use
/// what is compiled here.
#[inline(never)]
fn plain<T: Paths, const ROTORS: usize>(blocks: &mut [Block<T, ROTORS>], call: Call) {
    let Settings { dt_s, scheme, path, .. } = call.settings;
    T::run(path, Advance { blocks, scheme, dt_s: convert(dt_s), steps: call.steps });
}

/// Steps of whole vehicles.
#[inline(never)]
fn whole<T: Paths, const ROTORS: usize>(blocks: &mut [Block<T, ROTORS>], call: Call) {
    if blocks.first().is_none_or(|block| block.extra.is_none()) {
        return plain(blocks, call);
    }
    let Settings { dt_s, scheme, path, .. } = call.settings;
    T::run(path, AdvanceWhole(Advance { blocks, scheme, dt_s: convert(dt_s), steps: call.steps }));
}

/// What nearly everybody flies, compiled into this crate. All else of a batch is compiled by each
/// program, test and bench that has one; these are long, and many: for each scheme, wing and
/// register.
#[allow(dead_code, reason = "it is there to be compiled")]
static COMPILED: ([Work<f32, 4>; 2], Flown<f32, 4>, [Work<f64, 4>; 2]) =
    ([plain, whole], autopilot::flown, [plain, whole]);

/// Where a vehicle is: chunk, block in it, column.
fn place(vehicle: usize) -> (usize, usize, usize) {
    let block = vehicle / BLOCK;
    (block / CHUNK, block % CHUNK, vehicle % BLOCK)
}

impl<T: Paths, const ROTORS: usize> Batch<T, ROTORS> {
    /// Vehicles at rest at the origin, level, rotors stopped and told to stay so, in calm air.
    ///
    /// * `vehicles` - with what effects change once, see `Effects::alter`; rotors beyond
    ///   `rotor_count` are not there
    ///
    /// # Errors
    /// No vehicle, one with more than `ROTORS` rotors, a step that is not positive or longer than
    /// twice a rotor time constant, no threads.
    pub fn new(vehicles: &[Vehicle<T>], settings: Settings) -> Result<Self, BatchError> {
        let kinds: Vec<usize> = (0..vehicles.len()).collect();
        Self::new_of_kinds(&kinds, vehicles, settings, &mut || true)
    }

    /// As [`Self::new`], of vehicles that may be many and alike.
    ///
    /// * `kinds` - of each vehicle, its place in `vehicles`
    /// * `go_on` - asked now and then
    ///
    /// # Errors
    /// As [`Self::new`]; `go_on` says no.
    ///
    /// # Panics
    /// A kind that is not there.
    pub fn new_of_kinds(
        kinds: &[usize],
        vehicles: &[Vehicle<T>],
        settings: Settings,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Self, BatchError> {
        let drives: Vec<Drive<T>> = kinds.iter().map(|kind| Drive::new(&vehicles[*kind])).collect();
        let mut batch = Self::empty(&drives, Fitted::all(&[])?, None, settings, plain, go_on)?;
        for (number, kind) in kinds.iter().enumerate() {
            if number % LOOK == 0 && !go_on() {
                return Err(BatchError::Interrupted);
            }
            batch.put(number, &vehicles[*kind], &Tuning::none())?;
        }
        Ok(batch)
    }

    /// As [`Self::new`], of whole vehicles: wings folded, batteries full, loads hanging. What the
    /// batch has a place for is what any of them has.
    ///
    /// # Errors
    /// As [`Self::new`]; a wing that is a network, flat wings beside membranes, an effect that does
    /// not act in a batch, effects that leave no airframe.
    pub fn with(members: &[BatchVehicle], settings: Settings) -> Result<Self, BatchError> {
        Self::with_room(members.len(), members, settings)
    }

    /// As [`Self::with`], of `count` vehicles, in turn those of `members`; there is room for any of
    /// these at any place.
    ///
    /// # Errors
    /// As [`Self::with`].
    pub fn with_room(
        count: usize,
        members: &[BatchVehicle],
        settings: Settings,
    ) -> Result<Self, BatchError> {
        let kinds: Vec<usize> = (0..members.len()).cycle().take(count).collect();
        Self::of_kinds(&kinds, members, settings, &mut || true)
    }

    /// As [`Self::with`], of vehicles that may be many and alike; there is room for any of
    /// `members` at any place.
    ///
    /// * `kinds` - of each vehicle, its place in `members`
    /// * `go_on` - asked now and then
    ///
    /// # Errors
    /// As [`Self::with`], of the first vehicle of a kind; `go_on` says no.
    ///
    /// # Panics
    /// A kind that is not there.
    pub fn of_kinds(
        kinds: &[usize],
        members: &[BatchVehicle],
        settings: Settings,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Self, BatchError> {
        let first = |kind: usize| kinds.iter().position(|own| *own == kind).unwrap_or(kind);
        let fitted = Fitted::all(members).map_err(|error| error.of(first))?;
        let mut own = Vec::with_capacity(members.len());
        for (kind, member) in members.iter().enumerate() {
            own.push(Drive::new(&airframe(kind, member).map_err(|error| error.of(first))?.0));
        }
        let drives: Vec<Drive<T>> = kinds.iter().map(|kind| own[*kind]).collect();
        let vehicle = members.first().map(|member| &member.vehicle);
        let mut batch = Self::empty(&drives, fitted, vehicle, settings, whole, go_on)?;
        for (number, kind) in kinds.iter().enumerate() {
            if number % LOOK == 0 && !go_on() {
                return Err(BatchError::Interrupted);
            }
            batch.refit(number, &members[*kind])?;
            batch.reset(number, &State::at_rest())?;
        }
        Ok(batch)
    }

    fn empty(
        drives: &[Drive<T>],
        fitted: Fitted,
        vehicle: Option<&Vehicle<f64>>,
        settings: Settings,
        work: Work<T, ROTORS>,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Self, BatchError> {
        const { assert!(ROTORS >= 1 && ROTORS <= MAX_ROTORS) };
        let dt_s = settings.dt_s;
        // In the scalar of the batch: what is positive in f64 may be nothing in f32.
        let dt = convert::<f64, T>(dt_s);
        if !(dt.is_finite() && dt > convert(0.0)) {
            return Err(BatchError::Step { dt_s });
        }
        if drives.is_empty() {
            return Err(BatchError::Empty);
        }
        if settings.threads == 0 {
            return Err(BatchError::NoThreads);
        }
        let mut block = Block::empty();
        if let Some(vehicle) = vehicle.filter(|_| !fitted.is_plain()) {
            block.extra = Some(Box::new(Extra::empty(&fitted, vehicle)));
        }
        let each = BLOCK * CHUNK;
        let chunks = drives.chunks(each).enumerate();
        let chunks = chunks.map(|(number, drives)| {
            let stops = (number * each).is_multiple_of(LOOK) && !go_on();
            let chunk = Chunk::new(number * each, &block, drives);
            if stops { Err(BatchError::Interrupted) } else { Ok(chunk) }
        });
        let pool = Pool::new(chunks.collect::<Result<_, _>>()?, settings.threads, do_job)?;
        Ok(Self { pool, vehicles: drives.len(), fitted, settings, work, autopilot: None })
    }

    /// Vehicles in it.
    #[allow(clippy::len_without_is_empty, reason = "never empty")]
    pub fn len(&self) -> usize {
        self.vehicles
    }

    /// How it runs.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Another airframe for one vehicle; it keeps its motion, its rotors their targets, and its
    /// wings, battery and effects.
    ///
    /// # Errors
    /// As [`Self::new`]; or there is no such vehicle.
    pub fn replace(&mut self, number: usize, vehicle: &Vehicle<T>) -> Result<(), BatchError> {
        self.check(number)?;
        self.put(number, vehicle, &Tuning::none())
    }

    /// Another vehicle in the place of one; it keeps its motion, and its rotors and servos their
    /// targets. Its battery is not charged and its air does not change before [`Self::reset`] and
    /// [`Self::set_air`].
    ///
    /// # Errors
    /// As [`Self::with`]; something that the batch has no place for; no such vehicle.
    pub fn refit(&mut self, number: usize, member: &BatchVehicle) -> Result<(), BatchError> {
        self.check(number)?;
        let present = self.fitted.fits(member, number)?;
        let (vehicle, whole) = airframe::<T>(number, member)?;
        let effects = &member.effects;
        self.put(number, &vehicle, &Tuning::between(&member.vehicle, &whole, effects))?;
        let (chunk, block, lane) = place(number);
        let dt_s = self.settings.dt_s;
        let mut chunk = self.pool.chunk(chunk);
        let Some(extra) = &mut chunk.blocks[block].extra else { return Ok(()) };
        // It may be the first in a form of an effect that others have.
        extra.present = extra.present.or(present);
        let own = whole.parameters().wing;
        let still = ServoParameters {
            dead_time_s: 0.0,
            rate_max_per_s: f64::INFINITY,
            time_constant_s: 0.0,
        };
        let (plate, membrane, servo) = match &member.wing {
            WingPlant::Flat { wing, servo } => (Some(*wing), None, servo),
            WingPlant::Membrane { membrane, servo } => (own, Some(*membrane.parameters()), servo),
            WingPlant::None | WingPlant::Parnn { .. } => (own, None, &still),
        };
        // Without wings in the plant there is nothing that air could push, but effects still see
        // the declared wing.
        let plate = if self.fitted.wing == FLAT && matches!(member.wing, WingPlant::None) {
            None
        } else {
            plate
        };
        let none = flat_plate::Pair::all(0.0);
        extra.plate.put(lane, &plate.as_ref().map_or(none, flat_plate::Pair::new).map(real));
        let gain = if membrane.is_some() { 1.0 } else { 0.0 };
        let mut numbers = membrane.unwrap_or_else(|| MembraneParameters::new(0.01, 0.1)).numbers();
        numbers.force_scale *= gain;
        extra.membrane.put(lane, &numbers.map(real));
        extra.servo.put(lane, &servo.over(effects.wing_extra_time_constant_s(), dt_s).map(real));
        extra.effects.put(lane, &Prepared::new(effects, &whole).map(real));
        let swing = effects.pendulum().map_or(Swing::all(0.0), |load| load.over(dt_s));
        extra.swing.put(lane, &swing.map(real));
        for (i, row) in extra.spin.iter_mut().enumerate() {
            row[lane] = convert(whole.rotors().get(i).map_or(0.0, |rotor| -rotor.yaw_sign));
        }
        extra.latency_steps[lane] = (effects.command_latency_s() / dt_s).round() as u64;
        if let Some(packs) = &mut extra.packs {
            let p = &whole.parameters().propulsion;
            let torque = convert(p.torque_coefficient_n_m_s2);
            packs.put(lane, member.battery.as_ref(), p.reference_voltage_v, torque, dt_s);
        }
        Ok(())
    }

    fn put(
        &mut self,
        number: usize,
        vehicle: &Vehicle<T>,
        tuning: &Tuning<T>,
    ) -> Result<(), BatchError> {
        let p = vehicle.parameters();
        if p.rotor_count > ROTORS {
            return Err(BatchError::Rotors {
                vehicle: number,
                rotors: p.rotor_count,
                places: ROTORS,
            });
        }
        let dt_s = self.settings.dt_s;
        for (key, tau) in [
            ("time_constant_up_s", p.propulsion.time_constant_up_s + tuning.lag_s[0]),
            ("time_constant_down_s", p.propulsion.time_constant_down_s + tuning.lag_s[1]),
        ] {
            let time_constant_s = nalgebra::try_convert(tau).unwrap_or(f64::NAN);
            if time_constant_s > 0.0 && dt_s > 2.0 * time_constant_s {
                return Err(BatchError::TimeConstant {
                    vehicle: number,
                    dt_s,
                    key,
                    time_constant_s,
                });
            }
        }
        let (chunk, block, lane) = place(number);
        let mut chunk = self.pool.chunk(chunk);
        chunk.drives[block * BLOCK + lane] = Drive::new(vehicle);
        chunk.blocks[block].put_vehicle(lane, vehicle, tuning);
        Ok(())
    }

    fn check(&self, vehicle: usize) -> Result<(), BatchError> {
        let vehicles = self.len();
        if vehicle < vehicles { Ok(()) } else { Err(BatchError::NoVehicle { vehicle, vehicles }) }
    }
}

/// The airframe with what effects change once, in the batch's scalar and as it is.
fn airframe<T: Paths>(
    number: usize,
    member: &BatchVehicle,
) -> Result<(Vehicle<T>, Vehicle<f64>), BatchError> {
    let fail = |problem| BatchError::Airframe { vehicle: number, problem };
    let altered = member.effects.alter(&member.vehicle).map_err(fail)?;
    // A cast declares the vehicle anew, without what effects did to its rotors: `Tuning` has that.
    Ok((altered.cast().map_err(fail)?, altered))
}

fn shape(what: &'static str, given: usize, needed: usize) -> Result<(), BatchError> {
    if given == needed { Ok(()) } else { Err(BatchError::Shape { what, given, needed }) }
}
