//! Rotors and wing servos along the flights, under the logged commands: the same for every
//! hypothesis that does not touch them, which most do not, so they are kept.

use super::commands::Commands;
use super::kept::Kept;
use super::{SETTLE_S, Track};
use squirrel_core::dynamics::RotorDrive;
use squirrel_core::effects::{Effects, Prepared, Present};
use squirrel_sim::plant::{Actuators, Plant};
use std::rc::Rc;

/// One moment of a piece.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment {
    pub(crate) now: Actuators,
    /// The wings are folded for longer than they remember.
    pub(crate) idle: bool,
}

/// The moments of a piece.
pub(crate) struct Path {
    /// Samples of the grid from one to the next, and that of the first.
    pub(crate) stride: usize,
    pub(crate) first: usize,
    pub(crate) moments: Vec<Moment>,
    /// The actuators just before the command that came at a moment, by its index, where that
    /// matters.
    pub(crate) before: Vec<(usize, Actuators)>,
}

/// Samples of a piece at which two plants are asked whether their rotors would do the same.
const PROBES: usize = 7;

/// Everything that paths depend on: what rotors are told at some samples, how commands arrive, how
/// servos lag.
#[derive(Debug, Clone, PartialEq)]
struct Key {
    stride: Vec<usize>,
    jumps: bool,
    drives: Vec<RotorDrive<f64>>,
    clock: [f64; 6],
}

/// Paths of a set of flights.
#[derive(Default)]
pub(crate) struct Paths(Kept<Key, Vec<Path>>);

impl Paths {
    /// The paths of all pieces under a plant.
    ///
    /// * `stride` - samples from one moment to the next, by piece
    pub(crate) fn of(
        &self,
        plant: &Plant,
        tracks: &[Track],
        commands: &[Commands],
        stride: impl Fn(&Track) -> usize,
    ) -> Rc<Vec<Path>> {
        self.0.get(Key::new(plant, tracks, commands, &stride), || {
            tracks.iter().map(|t| path(plant, t, &commands[t.flight], stride(t))).collect()
        })
    }
}

impl Key {
    fn new(
        plant: &Plant,
        tracks: &[Track],
        commands: &[Commands],
        stride: &impl Fn(&Track) -> usize,
    ) -> Self {
        let effects = plant.effects();
        let drives = tracks.iter().flat_map(|track| {
            (0..PROBES).map(move |i| {
                let k = i * (track.time_s.len() - 1) / (PROBES - 1);
                let (rotor, _) = commands[track.flight].at(track.time_s[k]);
                plant.rotor_drive(&rotor, track.voltage_v[k])
            })
        });
        let [opening, closing] = effects.wing_extra_time_constant_s();
        let runs = effects.command_clock();
        let clock =
            [effects.command_latency_s(), runs.rate, runs.step_s, runs.at_s, opening, closing];
        Self {
            stride: tracks.iter().map(stride).collect(),
            jumps: jumps(effects),
            drives: drives.collect(),
            clock,
        }
    }
}

/// Rotors and servos along one piece, whose first sample has been held for a while.
fn path(plant: &Plant, track: &Track, commands: &Commands, stride: usize) -> Path {
    let first = track.edge() % stride;
    let mut clock = commands.clock(plant.effects(), track.time_s[first]);
    let (rotor, wing) = clock.now();
    let mut state = plant.initial_state(squirrel_core::dynamics::State::at_rest(), 1.0);
    plant.tell(&mut state, &rotor, track.voltage_v[first]);
    plant.lead_actuators(&mut state, wing, SETTLE_S);
    let mut moments = Vec::with_capacity((track.time_s.len() - first).div_ceil(stride));
    let (jumps, mut before) = (jumps(plant.effects()), Vec::new());
    for k in (first..track.time_s.len()).step_by(stride) {
        let (start_s, voltage_v) = (track.time_s[k], track.voltage_v[k]);
        let end_s = start_s + stride as f64 * track.period_s;
        if jumps && clock.next_change_s() <= start_s + super::commands::SNAP_S {
            before.push((moments.len(), plant.tell(&mut state, &clock.now().0, voltage_v)));
        }
        clock.advance_to(start_s);
        let now = plant.tell(&mut state, &clock.now().0, voltage_v);
        moments.push(Moment { now, idle: false });
        let mut at_s = start_s;
        while at_s < end_s - 1e-9 {
            let until_s = clock.next_change_s().clamp(at_s, end_s);
            plant.lead_actuators(&mut state, clock.now().1, until_s - at_s);
            at_s = until_s;
            if at_s < end_s - 1e-9 {
                clock.advance_to(at_s);
                plant.tell(&mut state, &clock.now().0, voltage_v);
            }
        }
    }
    let memory = (plant.wing_memory_s() / (stride as f64 * track.period_s)).ceil() as usize;
    let mut folded = usize::MAX;
    for moment in moments.iter_mut().rev() {
        folded = if moment.now.deployment() == [0.0; 2] { folded.saturating_add(1) } else { 0 };
        moment.idle = folded > memory;
    }
    Path { stride, first, moments, before }
}

/// What jumps with the commands has no bandwidth: it is asked for as often as it was measured.
pub(crate) fn stride(effects: &Effects<f64>, track: &Track) -> usize {
    if jumps(effects) { 1 } else { track.stride }
}

/// Whether moments jump with the rotors' acceleration, and that with their commands.
pub(crate) fn jumps(effects: &Effects<f64>) -> bool {
    Prepared::<f64>::feel_rotor_spin(Present::of(effects))
}
