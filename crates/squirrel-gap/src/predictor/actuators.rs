//! Rotors and wing servos along the flights, under the logged commands: the same for every
//! hypothesis that does not touch them, which most do not, so they are kept. Those of one are kept
//! while the other's lag is looked for.

use super::Track;
use super::commands::{Clock, Commands, SNAP_S};
use super::kept::Kept;
use super::led::SETTLE_S;
use squirrel_core::dynamics::{RotorDrive, State};
use squirrel_core::effects::{Effects, Prepared, Present};
use squirrel_sim::plant::{Plant, Rotors, ServoState, lead_servos};
use std::rc::Rc;

/// The rotors of a piece.
#[derive(Default)]
pub(crate) struct RotorPath {
    /// At each moment.
    now: Vec<Rotors>,
    /// Just before the command that came at a moment, by its index, where that matters.
    pub(crate) before: Vec<(usize, Rotors)>,
}

/// The wings at one moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wings {
    pub(crate) servo: [ServoState; 2],
    /// They are folded for longer than they remember.
    pub(crate) idle: bool,
}

/// The moments of all pieces.
#[derive(Clone)]
pub(crate) struct Paths {
    strides: Vec<usize>,
    rotors: Rc<Vec<RotorPath>>,
    wings: Rc<Vec<Vec<Wings>>>,
}

impl PartialEq for Paths {
    /// Whether they are one and the same.
    fn eq(&self, other: &Self) -> bool {
        Rc::ptr_eq(&self.rotors, &other.rotors) && Rc::ptr_eq(&self.wings, &other.wings)
    }
}

/// The moments of a piece.
#[derive(Clone, Copy)]
pub(crate) struct Path<'a> {
    /// Samples of the grid from one to the next, and that of the first.
    pub(crate) stride: usize,
    pub(crate) first: usize,
    pub(crate) rotors: &'a RotorPath,
    pub(crate) wings: &'a [Wings],
}

impl Paths {
    pub(crate) fn piece(&self, piece: usize, track: &Track) -> Path<'_> {
        let stride = self.strides[piece];
        let (rotors, wings) = (&self.rotors[piece], &self.wings[piece]);
        Path { stride, first: first(track, stride), rotors, wings }
    }
}

impl<'a> Path<'a> {
    /// Number of moments.
    pub(crate) fn len(&self) -> usize {
        self.rotors.now.len()
    }
    /// The sample of the grid, the rotors and the wings of each moment.
    pub(crate) fn moments(&self) -> impl Iterator<Item = (usize, &'a Rotors, &'a Wings)> + use<'a> {
        let grid = (self.first..).step_by(self.stride);
        grid.zip(&self.rotors.now).zip(self.wings).map(|((k, rotors), wings)| (k, rotors, wings))
    }
}

/// Samples of a piece at which two plants are asked whether their rotors would do the same.
const PROBES: usize = 7;

/// Everything that the rotors depend on: what they are told at some samples, and how commands
/// arrive.
#[derive(Debug, Clone, PartialEq)]
struct RotorKey {
    strides: Vec<usize>,
    jumps: bool,
    drives: Vec<RotorDrive<f64>>,
    clock: [f64; 4],
}

/// Everything that the wings depend on: how commands arrive, and how servos lag.
#[derive(Debug, Clone, PartialEq)]
struct WingKey {
    strides: Vec<usize>,
    clock: [f64; 4],
    lag_s: [f64; 2],
}

/// The last paths of a set of flights.
#[derive(Default)]
pub(crate) struct KeptPaths {
    rotors: Kept<RotorKey, Vec<RotorPath>>,
    wings: Kept<WingKey, Vec<Vec<Wings>>>,
}

impl KeptPaths {
    /// The paths of all pieces under a plant.
    ///
    /// * `stride` - samples from one moment to the next, by piece
    pub(crate) fn of(
        &self,
        plant: &Plant,
        tracks: &[Track],
        commands: &[Commands],
        stride: impl Fn(&Track) -> usize,
    ) -> Paths {
        let strides: Vec<usize> = tracks.iter().map(stride).collect();
        let runs = plant.effects().command_clock();
        let clock = [plant.effects().command_latency_s(), runs.rate, runs.step_s, runs.at_s];
        let pieces =
            || tracks.iter().zip(&strides).map(|(t, stride)| (t, &commands[t.flight], *stride));
        let rotor_key = RotorKey {
            strides: strides.clone(),
            jumps: jumps(plant.effects()),
            drives: pieces().flat_map(|(t, commands, _)| probes(plant, t, commands)).collect(),
            clock,
        };
        let lag_s = plant.effects().wing_extra_time_constant_s();
        let wing_key = WingKey { strides: strides.clone(), clock, lag_s };
        let rotors = self.rotors.get(rotor_key, || {
            pieces().map(|(t, commands, stride)| rotors(plant, t, commands, stride)).collect()
        });
        let wings = self.wings.get(wing_key, || {
            pieces().map(|(t, commands, stride)| wings(plant, t, commands, stride)).collect()
        });
        Paths { strides, rotors, wings }
    }
}

fn first(track: &Track, stride: usize) -> usize {
    track.edge() % stride
}

/// What the rotors are told at some samples of a piece.
fn probes(plant: &Plant, track: &Track, commands: &Commands) -> [RotorDrive<f64>; PROBES] {
    std::array::from_fn(|i| {
        let k = i * (track.time_s.len() - 1) / (PROBES - 1);
        let (rotor, _) = commands.at(track.time_s[k]);
        plant.rotor_drive(&rotor, track.voltage_v[k])
    })
}

/// From each moment of a piece to the next, s, with its sample.
fn spans(track: &Track, stride: usize) -> impl Iterator<Item = (usize, [f64; 2])> {
    (first(track, stride)..track.time_s.len()).step_by(stride).map(move |k| {
        let start_s = track.time_s[k];
        (k, [start_s, start_s + stride as f64 * track.period_s])
    })
}

/// Goes through a span from command to command.
///
/// * `next_s` - time of the next one
/// * `each` - under the command of the clock, whether it is another than at the start, for a time, s
fn through<'a>(
    clock: &mut Clock<'a>,
    [start_s, end_s]: [f64; 2],
    next_s: impl Fn(&Clock<'a>) -> f64,
    mut each: impl FnMut(&Clock<'a>, bool, f64),
) {
    let mut at_s = start_s;
    while at_s < end_s - 1e-9 {
        let until_s = next_s(clock).clamp(at_s, end_s);
        each(clock, at_s > start_s, until_s - at_s);
        at_s = until_s;
        if at_s < end_s - 1e-9 {
            clock.advance_to(at_s);
        }
    }
}

/// Rotors along one piece, whose first sample has been held for a while.
fn rotors(plant: &Plant, track: &Track, commands: &Commands, stride: usize) -> RotorPath {
    let start = first(track, stride);
    let mut clock = commands.clock(plant.effects(), track.time_s[start]);
    let mut state = plant.initial_state(State::at_rest(), 1.0);
    plant.tell(&mut state, &clock.now().0, track.voltage_v[start]);
    plant.lead_rotors(&mut state, SETTLE_S);
    let (jumps, mut path) = (jumps(plant.effects()), RotorPath::default());
    path.now.reserve_exact((track.time_s.len() - start).div_ceil(stride));
    for (k, span_s) in spans(track, stride) {
        let voltage_v = track.voltage_v[k];
        if jumps && clock.next_rotor_s() <= span_s[0] + SNAP_S {
            let before = plant.tell(&mut state, &clock.now().0, voltage_v);
            path.before.push((path.now.len(), before));
        }
        clock.advance_to(span_s[0]);
        path.now.push(plant.tell(&mut state, &clock.now().0, voltage_v));
        through(&mut clock, span_s, Clock::next_rotor_s, |clock, is_new, dt_s| {
            if is_new {
                plant.tell(&mut state, &clock.now().0, voltage_v);
            }
            plant.lead_rotors(&mut state, dt_s);
        });
    }
    path
}

/// Wing servos along one piece, likewise.
fn wings(plant: &Plant, track: &Track, commands: &Commands, stride: usize) -> Vec<Wings> {
    let start = first(track, stride);
    let step_s = stride as f64 * track.period_s;
    let moments = (track.time_s.len() - start).div_ceil(stride);
    let mut servo = [ServoState::at_rest(); 2];
    let Some(over) = plant.servos() else {
        return vec![Wings { servo, idle: true }; moments];
    };
    let mut clock = commands.clock(plant.effects(), track.time_s[start]);
    lead_servos(&over(SETTLE_S), &mut servo, clock.now().1, SETTLE_S);
    let over_step = over(step_s);
    let mut wings = Vec::with_capacity(moments);
    for (_, span_s) in spans(track, stride) {
        clock.advance_to(span_s[0]);
        wings.push(Wings { servo, idle: false });
        // Mostly nothing is told, and an exponential is dear.
        if clock.next_wing_s() >= span_s[1] {
            lead_servos(&over_step, &mut servo, clock.now().1, step_s);
        } else {
            through(&mut clock, span_s, Clock::next_wing_s, |clock, _, dt_s| {
                lead_servos(&over(dt_s), &mut servo, clock.now().1, dt_s);
            });
        }
    }
    let memory = (plant.wing_memory_s() / step_s).ceil() as usize;
    let mut folded = usize::MAX;
    for moment in wings.iter_mut().rev() {
        let is_folded = moment.servo.iter().all(|servo| servo.deployment == 0.0);
        folded = if is_folded { folded.saturating_add(1) } else { 0 };
        moment.idle = folded > memory;
    }
    wings
}

/// What jumps with the commands has no bandwidth: it is asked for as often as it was measured.
pub(crate) fn stride(effects: &Effects<f64>, track: &Track) -> usize {
    if jumps(effects) { 1 } else { track.stride }
}

/// Whether moments jump with the rotors' acceleration, and that with their commands.
fn jumps(effects: &Effects<f64>) -> bool {
    Prepared::<f64>::feel_rotor_spin(Present::of(effects))
}
