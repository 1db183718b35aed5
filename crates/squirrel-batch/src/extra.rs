//! What vehicles of a block have on top of the base model: wings, battery, effects, gusts, commands
//! on their way.
//!
//! Late commands, and gusts that ask how a vehicle meets them, change between steps. The steps of
//! a call are therefore cut where the next of them is due, which changes no number: a flight is the
//! same however it is cut.

use super::air::{Airs, Forecast};
use super::battery::Packs;
use super::rows::Block;
use super::vehicle::Fitted;
use nalgebra::{Vector3, try_convert};
use squirrel_core::aero::flat_plate;
use squirrel_core::aero::membrane::{Membrane, Side};
use squirrel_core::dynamics::servo::{Servo, ServoState};
use squirrel_core::effects::{Effects, PendulumState, Prepared, Present, Swing};
use squirrel_core::frames::In;
use squirrel_core::lane::{Row, put, take};
use squirrel_core::math::real;
use squirrel_core::vehicle::Vehicle;
use squirrel_sim::plant::Meeting;
use squirrel_sim::simd::{BLOCK, Paths};
use squirrel_sim::tape::{Tape, on_tape};
use std::collections::VecDeque;

/// A command for one vehicle.
#[derive(Debug, Clone, Copy)]
pub(super) enum Command<S, const ROTORS: usize> {
    /// Steady rotor speeds, rad/s.
    Rotors([S; ROTORS]),
    /// Left and right wing, 0..1.
    Wings([S; 2]),
}

/// A command on its way.
#[derive(Debug, Clone)]
struct Late<S, const ROTORS: usize> {
    due: u64,
    lane: usize,
    command: Command<S, ROTORS>,
}

impl<S: Paths, const ROTORS: usize> Late<S, ROTORS> {
    fn keep(&mut self, tape: &mut Tape<'_>) -> Option<()> {
        tape.word(&mut self.due)?;
        self.lane = tape.count(self.lane)?;
        let mut of_wings = matches!(self.command, Command::Wings(_));
        tape.flag(&mut of_wings)?;
        self.command = match (of_wings, self.command) {
            (true, Command::Wings(mut wings)) => {
                tape.reals(&mut wings)?;
                Command::Wings(wings)
            }
            (true, Command::Rotors(_)) => {
                let mut wings = [real(0.0); 2];
                tape.reals(&mut wings)?;
                Command::Wings(wings)
            }
            (false, before) => {
                let mut targets = match before {
                    Command::Rotors(targets) => targets,
                    Command::Wings(_) => [real(0.0); ROTORS],
                };
                tape.reals(&mut targets)?;
                Command::Rotors(targets)
            }
        };
        (self.lane < BLOCK).then_some(())
    }
}

/// See the module. Rows first, as in a [`Block`].
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Extra<S: Copy, const ROTORS: usize> {
    pub(super) plate: flat_plate::Pair<Row<S>>,
    pub(super) membrane: Membrane<Row<S>>,
    /// Left and right, as all that has two of a thing.
    pub(super) sides: [Side<Row<S>>; 2],
    /// Angle of attack of each side at the last step.
    pub(super) wing_angle: [Row<S>; 2],
    pub(super) servo: Servo<Row<S>>,
    pub(super) deployment: [ServoState<Row<S>>; 2],
    pub(super) effects: Prepared<Row<S>>,
    /// Signs of the rotors' spin about +z.
    pub(super) spin: [Row<S>; ROTORS],
    /// Angular velocity of the air, NED, rad/s; 0 where it does not turn.
    pub(super) air_omega: [Row<S>; 3],
    /// A load over a step; without weight where there is none.
    pub(super) swing: Swing<Row<S>>,
    pub(super) load: PendulumState<Row<S>>,
    /// `NONE`, `FLAT` or `MEMBRANE` of `dynamics::whole`, for the whole batch.
    pub(super) wing: u8,
    pub(super) present: Present,
    pub(super) packs: Option<Packs<S>>,
    pub(super) latency_steps: [u64; BLOCK],
    late: VecDeque<Late<S, ROTORS>>,
    /// Steps that the block has taken.
    pub(super) clock: u64,
    pub(super) airs: Airs,
}

impl<S: Paths, const ROTORS: usize> Extra<S, ROTORS> {
    /// With nothing in any column that is used.
    ///
    /// * `vehicle` - any, of whose numbers none matter without effects
    pub(super) fn empty(fitted: &Fitted, vehicle: &Vehicle<f64>) -> Self {
        let without_effects = Prepared::new(&Effects::none(), vehicle);
        let none = [real::<S>(0.0); BLOCK];
        let one = [real::<S>(1.0); BLOCK];
        Self {
            wing: fitted.wing,
            plate: flat_plate::Pair::all(none),
            membrane: Membrane::all(none),
            sides: [Side { attached: one, ..Side::all(none) }; 2],
            wing_angle: [none; 2],
            servo: Servo {
                rate_max_per_s: one,
                opening_s: one,
                closing_s: one,
                ..Servo::all(none)
            },
            deployment: [ServoState::all(none); 2],
            packs: (fitted.stretches > 0).then(|| Packs::empty(fitted.stretches)),
            present: fitted.present,
            effects: without_effects.map(|number| [real(number); BLOCK]),
            spin: [none; ROTORS],
            air_omega: [none; 3],
            swing: Swing::all(none),
            load: PendulumState::all(none),
            latency_steps: [0; BLOCK],
            late: VecDeque::new(),
            clock: 0,
            airs: Airs::none(),
        }
    }

    /// Everything that remembers at rest: wings folded and flat, load hanging, battery rested.
    ///
    /// * `charge` - of the battery, 0..1
    pub(super) fn rest(&mut self, lane: usize, charge: S) {
        for side in 0..2 {
            self.sides[side].put(lane, &Side::at_rest());
            self.deployment[side].put(lane, &ServoState::at_rest());
        }
        self.load.put(lane, &PendulumState::at_rest());
        put(&mut self.wing_angle, lane, [real(0.0); 2]);
        self.late.retain(|late| late.lane != lane);
        if let Some(packs) = &mut self.packs {
            packs.rest(lane, charge);
        }
    }

    /// Everything that changes between two steps.
    pub(super) fn keep(&mut self, tape: &mut Tape<'_>) -> Option<()> {
        for side in 0..2 {
            on_tape!(tape, self.sides[side])?;
            on_tape!(tape, self.deployment[side])?;
        }
        tape.rows(&mut self.wing_angle)?;
        tape.rows(&mut self.air_omega)?;
        on_tape!(tape, self.load)?;
        if let Some(packs) = &mut self.packs {
            on_tape!(tape, packs.charge)?;
        }
        tape.word(&mut self.clock)?;
        let count = tape.count(self.late.len())?;
        for number in 0..count {
            if number >= self.late.len() {
                let command = Command::Wings([real(0.0); 2]);
                self.late.push_back(Late { due: 0, lane: 0, command });
            }
            self.late[number].keep(tape)?;
        }
        self.late.truncate(count);
        self.airs.keep(tape, self.clock)
    }

    /// Sends a command, which arrives when the vehicle's latency has passed.
    pub(super) fn send(&mut self, lane: usize, command: Command<S, ROTORS>) {
        let due = self.clock.saturating_add(self.latency_steps[lane]);
        self.late.push_back(Late { due, lane, command });
    }

    /// Tells the servos of a vehicle where to go; a command that changes within the dead time
    /// replaces the one that waits.
    pub(super) fn ask_wings(&mut self, lane: usize, command: [S; 2]) {
        for (rows, command) in self.deployment.iter_mut().zip(command) {
            let mut state = rows.take(lane);
            state.ask(command, self.servo.dead_time_s[lane]);
            rows.put(lane, &state);
        }
    }
}

impl<S: Paths, const ROTORS: usize> Block<S, ROTORS> {
    /// Does what is due between two steps; steps, at most `left`, until something is due again.
    ///
    /// * `forecast` - filled with the winds of these steps that are not the one now
    pub(super) fn between(&mut self, left: u64, forecast: &mut Forecast<S>) -> u64 {
        let Some(extra) = &mut self.extra else { return left };
        let mut until = extra.clock.saturating_add(left);
        let mut arrived = Vec::new();
        extra.late.retain(|late| {
            if late.due <= extra.clock {
                arrived.push((late.lane, late.command));
            } else {
                until = until.min(late.due);
            }
            late.due > extra.clock
        });
        for (lane, command) in arrived {
            match command {
                Command::Rotors(targets) => put(&mut self.held.target_speed, lane, targets),
                Command::Wings(wings) => extra.ask_wings(lane, wings),
            }
        }
        let Extra { airs, air_omega, effects, present, clock, .. } = &mut **extra;
        let (motion, wind) = (&self.motion, self.held.wind);
        let effects_blow = Prepared::<S>::blow(*present);
        let meeting = |lane| {
            let mut through = through_air(&take(&motion.velocity, lane), &take(&wind, lane));
            if effects_blow {
                let wind =
                    effects.take(lane).wind(*present, real::<S>(0.0) - motion.position[2][lane]);
                let [north, east] = wind.map(|x| try_convert::<S, f64>(x).unwrap_or(f64::NAN));
                through -= Vector3::new(north, east, 0.0);
            }
            let down_m = try_convert::<S, f64>(motion.position[2][lane]).unwrap_or(f64::NAN);
            Meeting { through_air: In::new(through), height_m: -down_m }
        };
        let felt = [&mut self.held.wind, air_omega];
        until = airs.advance(*clock, until, felt, forecast, meeting);
        let steps = until - extra.clock;
        extra.clock = until;
        steps
    }

    /// Where the block has wings, what the vehicle in column `lane` shows of them: deployment, left
    /// and right.
    pub(super) fn deployment(&self, lane: usize) -> [S; 2] {
        self.extra.as_ref().map_or([real(0.0); 2], |extra| {
            [0, 1].map(|side| extra.deployment[side].deployment[lane])
        })
    }
}

/// Velocity through the air, m/s.
fn through_air<S: Paths>(velocity: &[S; 3], wind: &[S; 3]) -> Vector3<f64> {
    Vector3::from_fn(|i, _| try_convert::<S, f64>(velocity[i] - wind[i]).unwrap_or(f64::NAN))
}
