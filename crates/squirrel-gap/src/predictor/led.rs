//! The plant led along a piece of a flight, and the residual of its dynamics.
//!
//! Where the plant is led to depends on the motion, on rotors and servos, and on what swings or
//! flexes; not on the numbers of most effects. So the states of a piece are kept side by side, and
//! plants that differ in such numbers are asked at all of them at once.

use super::actuators::{Path, Paths};
use super::drag_centre::DragCentre;
use super::late::delayed;
use super::{Motion, Predictor, Track};
use nalgebra::{Vector3, Vector6};
use squirrel_core::effects::Pendulum;
use squirrel_sim::plant::{Plant, PlantState, SideBySide};
use std::rc::Rc;

/// How long the first sample of a piece is held before it, so that rotors and servos start settled,
/// s.
pub(super) const SETTLE_S: f64 = 1.0;

/// Everything that the states of a piece depend on.
pub(super) struct StatesKey {
    // Held, so that nothing else comes to lie where they lie.
    motion: Rc<Motion>,
    paths: Paths,
    load: Option<Pendulum<f64>>,
    /// That blows on wings which remember it, in numbers.
    wind_m_s: [[f64; 2]; 3],
}

impl PartialEq for StatesKey {
    fn eq(&self, other: &Self) -> bool {
        Rc::ptr_eq(&self.motion, &other.motion)
            && self.paths == other.paths
            && self.load == other.load
            && self.wind_m_s == other.wind_m_s
    }
}

impl StatesKey {
    fn of(plant: &Plant, motion: &Rc<Motion>, paths: &Paths) -> Self {
        let acting = plant.acting();
        let wind = |height_m| match plant.wing_memory_s() {
            0.0 => [0.0; 2],
            _ => acting.numbers().wind(acting.present(), height_m),
        };
        Self {
            motion: Rc::clone(motion),
            paths: paths.clone(),
            load: plant.effects().pendulum(),
            wind_m_s: [1.0, 10.0, 100.0].map(wind),
        }
    }
}

/// The states of a piece, side by side.
pub(super) struct States {
    /// At each moment.
    now: SideBySide,
    /// With the rotors of just before, where [`RotorPath::before`](super::actuators::RotorPath) has
    /// them.
    before: SideBySide,
}

/// Leads the plant along a piece and shows its state at each moment of the path, with the sample of
/// the grid.
fn lead(
    plant: &Plant,
    track: &Track,
    motion: &Motion,
    path: Path<'_>,
    mut each: impl FnMut(usize, &mut PlantState),
) {
    let mut moments = path.moments().peekable();
    let Some((first, rotors, wings)) = moments.peek().copied() else { return };
    let mut state = plant.initial_state(motion.body[first], 1.0);
    plant.meet(&mut state, &motion.body[first], rotors, None);
    state.servo = wings.servo;
    let settled = state.deployment();
    plant.pass(&mut state, Some([settled; 2]), SETTLE_S);
    state.time_s = track.time_s[first] - track.began_s;
    let dt_s = path.stride as f64 * track.period_s;
    let swing = plant.effects().pendulum().map(|load| load.over(dt_s));
    while let Some((k, rotors, wings)) = moments.next() {
        // A load hangs straight down until the vehicle moves.
        let swing = swing.as_ref().filter(|_| k > first);
        plant.meet(&mut state, &motion.body[k], rotors, swing);
        state.servo = wings.servo;
        state.battery.voltage_v = track.voltage_v[k];
        each(k, &mut state);
        let now = state.deployment();
        let after = moments.peek().map_or(now, |(_, _, next)| next.servo.map(|s| s.deployment));
        plant.pass(&mut state, (!wings.idle).then_some([now, after]), dt_s);
    }
}

fn states(plant: &Plant, track: &Track, motion: &Motion, path: Path<'_>) -> States {
    let mut now = plant.side_by_side(path.len());
    let mut before = plant.side_by_side(path.rotors.before.len());
    let mut jumps = path.rotors.before.iter().peekable();
    lead(plant, track, motion, path, |k, state| {
        now.push(state);
        let moment = (k - path.first) / path.stride;
        if let Some((_, rotors)) = jumps.next_if(|(jump, _)| *jump == moment) {
            state.take_rotors(rotors);
            before.push(state);
        }
    });
    States { now, before }
}

impl Predictor<'_> {
    /// Specific force and angular acceleration, as the sensors would have them, at each moment of a
    /// piece's path.
    pub(super) fn predicted(
        &self,
        plant: &Plant,
        drag: Option<&DragCentre>,
        piece: usize,
        motion: &Rc<Motion>,
        paths: &Paths,
    ) -> Vec<Vector6<f64>> {
        let track = &self.tracks[piece];
        let path = paths.piece(piece, track);
        let states = self.states[piece]
            .get(StatesKey::of(plant, motion, paths), || states(plant, track, motion, path));
        let mut led = plant.led_at(&states.now);
        // A rotor's acceleration jumps with its command: what a sample stands for lies half before
        // and half after the jump.
        for ((moment, _), before) in path.rotors.before.iter().zip(plant.led_at(&states.before)) {
            let a = &mut led[*moment].angular_acceleration;
            *a = (*a + before.angular_acceleration) * 0.5;
        }
        let turned = drag.map(|drag| drag.turns(plant, &states.now));
        let effects = plant.effects();
        let [rate_scale, _] = track.scales(effects);
        let shown = path.moments().zip(led).enumerate().map(|(i, ((k, ..), led))| {
            let f = track.as_shown(k, led.specific_force.vector, motion, effects);
            let turned = turned.as_ref().map_or_else(Vector3::zeros, |turned| turned[i]);
            let a = (led.angular_acceleration.vector + turned).component_mul(&rate_scale);
            Vector6::new(f.x, f.y, f.z, a.x, a.y, a.z)
        });
        delayed(shown.collect(), motion.late_s, path.stride as f64 * track.period_s)
    }

    /// The plant's state at some samples of a piece, in order: led there along the measured motion.
    pub(crate) fn led_states(
        &self,
        plant: &Plant,
        piece: usize,
        motion: &Motion,
        samples: &[usize],
    ) -> Vec<PlantState> {
        let track = &self.tracks[piece];
        let paths = self.paths.of(plant, &self.tracks, &self.commands, |_| 1);
        let mut out = Vec::with_capacity(samples.len());
        lead(plant, track, motion, paths.piece(piece, track), |k, state| {
            if samples.get(out.len()) == Some(&k) {
                out.push(*state);
            }
        });
        out
    }
}

/// Residual of the dynamics of a piece.
///
/// * `predicted` - at each moment of the path
pub(super) fn dynamics(
    track: &Track,
    path: Path<'_>,
    predicted: &[Vector6<f64>],
) -> Vec<Vector6<f64>> {
    let filter = if path.stride == 1 { &track.filter } else { &track.model_filter };
    let filtered = filter.apply(predicted, track.edge() - path.first, track.every);
    track.measured.iter().zip(filtered).map(|(measured, model)| measured - model).collect()
}
