//! Moving air about the vehicles of a block: steady wind and gusts, in the numbers of
//! [`squirrel_sim::plant::Wind`].
//!
//! Air moves between steps, at the rate of the flight code. Gusts that do not ask how fast a
//! vehicle meets them are known beforehand: a [`Forecast`] hands them to the steps, which then need
//! not be cut where air moves.

use squirrel_core::frames::{In, Ned};
use squirrel_core::lane::{Row, put};
use squirrel_core::math::real;
use squirrel_sim::flight::CONTROL_RATE_HZ;
use squirrel_sim::plant::{Meeting, Wind};
use squirrel_sim::simd::{BLOCK, Paths};
use squirrel_sim::tape::Tape;

/// Winds that a forecast has room for.
const AHEAD: usize = 16;

/// Air of its own of each vehicle that has some, and when it moved last.
#[derive(Debug, Clone)]
pub(super) struct Airs {
    of: Vec<Vec<Wind>>,
    /// Some of it turns.
    turning: bool,
    /// Moves so far, and the block's clock at the last.
    ticks: u64,
    clock: u64,
    dt_s: f64,
}

/// Winds to come, each with the step that it is there from, counted from now.
#[derive(Debug)]
pub(super) struct Forecast<S> {
    winds: [(u64, [Row<S>; 3]); AHEAD],
    known: usize,
}

impl<S: Paths> Forecast<S> {
    pub(super) fn empty() -> Self {
        Self { winds: [(0, [[real(0.0); BLOCK]; 3]); AHEAD], known: 0 }
    }

    /// In their order.
    pub(super) fn winds(&self) -> &[(u64, [Row<S>; 3])] {
        &self.winds[..self.known]
    }
}

impl Airs {
    pub(super) fn none() -> Self {
        Self { of: vec![Vec::new(); BLOCK], turning: false, ticks: 0, clock: 0, dt_s: 0.0 }
    }

    pub(super) fn any(&self) -> bool {
        self.of.iter().any(|airs| !airs.is_empty())
    }

    /// Other air about a vehicle. The first that moves finds its clock where it were if there had
    /// always been some.
    ///
    /// * `clock` - steps that the block has taken
    pub(super) fn put(&mut self, lane: usize, airs: Vec<Wind>, clock: u64, dt_s: f64) {
        self.dt_s = dt_s;
        if !self.any() && clock > 0 {
            let per_step = self.per_step();
            let mut tick = (clock as f64 * per_step + 1e-6) as u64;
            while tick > 0 && due(tick, per_step) >= clock {
                tick -= 1;
            }
            self.clock = due(tick, per_step);
            self.ticks = (self.clock as f64 * per_step + 1e-6) as u64 + 1;
        }
        self.of[lane] = airs;
        self.turning = self.of.iter().flatten().any(|air| air.angular_velocity().is_some());
    }

    /// Velocity of the air about a vehicle that has air of its own, m/s.
    pub(super) fn velocity<S: Paths>(&self, lane: usize) -> Option<In<Ned, S>> {
        let airs = &self.of[lane];
        let sum = airs.iter().fold(In::<Ned, f64>::zero(), |sum, air| sum + air.velocity());
        (!airs.is_empty()).then(|| In::new(sum.vector.map(real)))
    }

    /// Whether the air about any vehicle turns.
    #[inline(always)]
    pub(super) fn turn(&self) -> bool {
        self.turning
    }

    /// Angular velocity of the air about a vehicle, rad/s; 0 where it does not turn.
    pub(super) fn angular_velocity<S: Paths>(&self, lane: usize) -> In<Ned, S> {
        let turning = self.of[lane].iter().find_map(Wind::angular_velocity);
        turning.map_or_else(In::zero, |turning| In::new(turning.vector.map(real)))
    }

    /// Moves the air as far as it is due; clock, at most `until`, at which it moves again.
    ///
    /// * `clock` - of the block, now
    /// * `wind`, `air_omega` - what the vehicles feel now
    /// * `meeting` - of the vehicle in a column with its air
    pub(super) fn advance<S: Paths>(
        &mut self,
        clock: u64,
        until: u64,
        [wind, air_omega]: [&mut [Row<S>; 3]; 2],
        forecast: &mut Forecast<S>,
        meeting: impl Fn(usize) -> Meeting,
    ) -> u64 {
        forecast.known = 0;
        if !self.any() {
            return until;
        }
        if self.due() <= clock {
            self.advance_to(clock, wind, meeting);
            if self.turning {
                for lane in 0..BLOCK {
                    put(air_omega, lane, self.angular_velocity(lane).vector.into());
                }
            }
        }
        if !self.of.iter().flatten().any(Wind::asks_the_vehicle) {
            let mut to_come = *wind;
            while self.due() < until && forecast.known < AHEAD {
                // The clock of a move is a step of its own even where moves are faster than steps.
                let at = self.due().max(self.clock + 1);
                self.advance_to(at, &mut to_come, |_| Meeting {
                    through_air: In::zero(),
                    height_m: 0.0,
                });
                forecast.winds[forecast.known] = (at - clock, to_come);
                forecast.known += 1;
            }
        }
        until.min(self.due().max(clock + 1))
    }

    fn advance_to<S: Paths>(
        &mut self,
        clock: u64,
        wind: &mut [Row<S>; 3],
        meeting: impl Fn(usize) -> Meeting,
    ) {
        let passed_s = (clock - self.clock) as f64 * self.dt_s;
        for lane in 0..BLOCK {
            for air in &mut self.of[lane] {
                air.advance(passed_s, || meeting(lane));
            }
            if let Some(air) = self.velocity(lane) {
                put(wind, lane, air.vector.into());
            }
        }
        self.ticks = (clock as f64 * self.per_step() + 1e-6) as u64 + 1;
        self.clock = clock;
    }

    /// Where all of it is.
    ///
    /// * `now` - the block's clock
    pub(super) fn keep(&mut self, tape: &mut Tape<'_>, now: u64) -> Option<()> {
        tape.word(&mut self.ticks)?;
        tape.word(&mut self.clock)?;
        tape.double(&mut self.dt_s)?;
        for airs in &mut self.of {
            let count = tape.count(airs.len())?;
            for number in 0..count {
                if number >= airs.len() {
                    airs.push(Wind::blank());
                }
                airs[number].keep(tape)?;
            }
            airs.truncate(count);
        }
        self.turning = self.of.iter().flatten().any(|air| air.angular_velocity().is_some());
        (self.clock <= now).then_some(())
    }

    /// The step at which the next move is due.
    fn due(&self) -> u64 {
        due(self.ticks, self.per_step())
    }

    fn per_step(&self) -> f64 {
        self.dt_s * CONTROL_RATE_HZ as f64
    }
}

/// The first step at or after a move, as in a flight.
fn due(tick: u64, per_step: f64) -> u64 {
    ((tick as f64 - 1e-6) / per_step).ceil().max(0.0) as u64
}
