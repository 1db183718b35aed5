//! The logged commands as the vehicle got them: held until the next one, late or on another clock
//! where a hypothesis says so. Measured rotor speeds stand in for commands where there are any, and
//! are neither late nor on another clock.

use crate::flight::recording::Recording;
use crate::flight::series::Series;
use squirrel_core::effects::{CommandClock, Effects};
use squirrel_core::vehicle::{MAX_ROTORS, PerRotor};

/// Commands closer than this to a sample act from that sample on, s.
pub(super) const SNAP_S: f64 = 1e-5;

/// The commands of one flight.
pub(crate) struct Commands {
    rotor: Vec<(f64, PerRotor<f64>)>,
    wing: Vec<(f64, [f64; 2])>,
    began_s: f64,
    /// Rotors have measured speeds for commands.
    rotor_speeds: bool,
    /// From one rotor command to the next, s.
    period_s: f64,
}

impl Commands {
    pub(crate) fn new(recording: &Recording) -> Self {
        let speed = recording.speed.as_ref();
        let rotor = speed.unwrap_or(&recording.rotor);
        let period_s = rotor.median_period_s();
        // A measured sample stands for the time about it, a command for that after it.
        let ahead_s = if speed.is_some() { 0.5 * period_s } else { 0.0 };
        let rotor = rotor.samples().map(|(t, u)| {
            let mut all = [0.0; MAX_ROTORS];
            all[..u.len()].copy_from_slice(u);
            (t - ahead_s, all)
        });
        let wing = recording.wing.iter().flat_map(Series::samples).map(|(t, c)| (t, [c[0], c[1]]));
        let mut wing: Vec<_> = wing.collect();
        // A log may hold a stream, or its edges alone.
        wing.dedup_by(|next, last| next.1 == last.1);
        Self {
            rotor: rotor.collect(),
            wing,
            began_s: recording.pieces[0].0,
            rotor_speeds: speed.is_some(),
            period_s,
        }
    }

    pub(crate) fn period_s(&self) -> f64 {
        self.period_s
    }

    pub(crate) fn rotor(&self) -> &[(f64, PerRotor<f64>)] {
        &self.rotor
    }

    pub(crate) fn has_wing(&self) -> bool {
        !self.wing.is_empty()
    }

    /// The commands with the last stamps before a time.
    pub(crate) fn at(&self, time_s: f64) -> (PerRotor<f64>, [f64; 2]) {
        let rotor = self.rotor.partition_point(|(t, _)| *t <= time_s + SNAP_S).saturating_sub(1);
        let wing = self.wing.partition_point(|(t, _)| *t <= time_s + SNAP_S);
        let wing = wing.checked_sub(1).map_or([0.0; 2], |i| self.wing[i].1);
        (self.rotor[rotor].1, wing)
    }

    /// A clock that runs forwards from a time.
    pub(crate) fn clock(&self, effects: &Effects<f64>, time_s: f64) -> Clock<'_> {
        // A command acts a latency after its time.
        let (runs, latency_s) = (effects.command_clock(), effects.command_latency_s());
        let mut clock = Clock { commands: self, runs, latency_s, rotor: 0, wing: 0 };
        clock.advance_to(time_s);
        clock
    }
}

/// Which command acts.
#[derive(Clone)]
pub(crate) struct Clock<'a> {
    commands: &'a Commands,
    runs: CommandClock<f64>,
    latency_s: f64,
    rotor: usize,
    wing: usize,
}

impl Clock<'_> {
    /// When a command with a stamp acts, s.
    fn acts_s(&self, stamp_s: f64) -> f64 {
        self.commands.began_s + self.runs.time_s(stamp_s - self.commands.began_s) + self.latency_s
    }
    /// When the rotors do what a sample says, s.
    fn turns_s(&self, stamp_s: f64) -> f64 {
        if self.commands.rotor_speeds { stamp_s } else { self.acts_s(stamp_s) }
    }
    pub(crate) fn advance_to(&mut self, time_s: f64) {
        let until_s = time_s + SNAP_S;
        while self
            .commands
            .rotor
            .get(self.rotor + 1)
            .is_some_and(|(stamp, _)| self.turns_s(*stamp) <= until_s)
        {
            self.rotor += 1;
        }
        while self
            .commands
            .wing
            .get(self.wing + 1)
            .is_some_and(|(stamp, _)| self.acts_s(*stamp) <= until_s)
        {
            self.wing += 1;
        }
    }
    /// Time of the next rotor command, s; infinite after the last.
    pub(super) fn next_rotor_s(&self) -> f64 {
        let next = self.commands.rotor.get(self.rotor + 1);
        next.map_or(f64::INFINITY, |(stamp, _)| self.turns_s(*stamp))
    }
    /// Likewise of the next wing command.
    pub(super) fn next_wing_s(&self) -> f64 {
        let next = self.commands.wing.get(self.wing + 1);
        next.map_or(f64::INFINITY, |(stamp, _)| self.acts_s(*stamp))
    }
    /// Means of the commands that act from one time to another, as [`Self::now`] has them; runs to
    /// the second time.
    pub(crate) fn mean(&mut self, from_s: f64, until_s: f64) -> (PerRotor<f64>, [f64; 2]) {
        self.advance_to(from_s);
        let (mut at_s, mut means) = (from_s, ([0.0; MAX_ROTORS], [0.0; 2]));
        while at_s < until_s {
            let next_s = self.next_rotor_s().min(self.next_wing_s()).min(until_s);
            let share = (next_s - at_s) / (until_s - from_s);
            let (rotor, wing) = self.now();
            let own = means.0.iter_mut().zip(rotor).chain(means.1.iter_mut().zip(wing));
            own.for_each(|(mean, command)| *mean += command * share);
            at_s = next_s;
            self.advance_to(at_s);
        }
        means
    }
    /// Rotor command in the vehicle's unit, and wing command, left and right, 0 to 1.
    pub(crate) fn now(&self) -> (PerRotor<f64>, [f64; 2]) {
        let wing = self.commands.wing.get(self.wing).map_or([0.0; 2], |(_, wing)| *wing);
        (self.commands.rotor[self.rotor].1, wing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_weighs_commands_by_how_long_they_act() {
        let commands = Commands {
            rotor: [(0.0, 0.2), (1.0, 0.6), (2.0, 1.0)].map(|(t, u)| (t, [u; MAX_ROTORS])).to_vec(),
            wing: vec![(0.0, [0.0; 2]), (1.5, [1.0, 0.0])],
            began_s: 0.0,
            rotor_speeds: false,
            period_s: 1.0,
        };
        let mut clock = commands.clock(&Effects::none(), 0.0);
        let near = |(rotor, wing): (PerRotor<f64>, [f64; 2]), u: f64, left: f64| {
            assert!(rotor.iter().all(|own| (own - u).abs() < 1e-12), "{rotor:?}");
            assert!((wing[0] - left).abs() < 1e-12 && wing[1] == 0.0, "{wing:?}");
        };
        near(clock.mean(0.0, 0.5), 0.2, 0.0);
        near(clock.mean(0.5, 2.5), (0.5 * 0.2 + 0.6 + 0.5) / 2.0, 0.5);
        // The last commands are held.
        near(clock.mean(2.5, 9.0), 1.0, 1.0);
    }
}
