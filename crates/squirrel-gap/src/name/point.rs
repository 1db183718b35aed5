//! Where the predictor is asked: effects with a name, and everything else that may be off by its
//! tolerance.
//!
//! What may be off beside the catalogue: where each rotor sits and what torque it has, since rotors
//! of one make scatter; drag along y and z beside that along x, and where it acts; and in each
//! flight the tilt of the attitude estimate, how it leans into an acceleration, a little thrust, and
//! the zero of the barometer, which wanders.

use super::parameters::{Candidate, Catalogue};
use crate::GapError;
use crate::leftover::Usual;
use crate::predictor::{GYROSCOPE, HEIGHT_KNOTS, Hypothesis, Predictor};
use nalgebra::Vector3;
use squirrel_core::effects::{
    Declared, Effect, EffectParameter, Effects, Tolerance, WingAsymmetry, WingMembrane,
};
use squirrel_core::frames::In;
use squirrel_core::vehicle::Vehicle;
use std::collections::BTreeMap;

/// How flights of one machine differ.
#[derive(Debug, Default)]
pub(crate) struct Scatter {
    /// By effect, in the unit of its number: how much another flight may differ, one standard
    /// deviation.
    pub(crate) tolerances: BTreeMap<&'static str, f64>,
    /// What the model leaves of one.
    pub(crate) usual: Usual,
}

/// Tolerance of the tilt of an attitude estimate, rad.
const TILT_RAD: f64 = 0.006;
/// By how much an attitude estimate may lean into an acceleration that lasts, rad per m/s^2, by each
/// of two lags: together a degree at two m/s^2.
const LEVELLING_RAD_S2_PER_M: f64 = 0.007;
/// By how much thrust differs from one flight to the next, as a fraction.
pub(super) const DAY_FRACTION: f64 = 0.0015;
/// Smallest change of one rotor's torque that is worth reporting, as a fraction: its thrust shows
/// less.
const TORQUE_FRACTION: f64 = 0.03;
/// By how much torques of rotors may differ where nothing is known of them, as a fraction.
const FREE_TORQUE_FRACTION: f64 = 0.2;
/// Tolerance of the barometer's zero, m.
const HEIGHT_M: f64 = 0.2;
/// Numbers of a flight before its heights: tilt about north and east, levelling by a short
/// and a long lag, thrust.
const SHORT: usize = 5;
/// All of them.
const OF_A_FLIGHT: usize = SHORT + HEIGHT_KNOTS;

/// Fields of a vehicle file that say where the wings are: ahead, to each side, below.
pub(super) const WING_PLACE: [&str; 3] =
    ["wing.longitudinal_arm_m", "wing.lateral_arm_m", "wing.vertical_arm_m"];

/// An effect with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Member {
    /// Index of its candidate.
    pub(crate) candidate: usize,
    /// All parameters in the order of the effect.
    pub(crate) values: Vec<f64>,
}

/// Where the predictor is asked: effects that are named, and everything else inside its tolerance.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    pub(crate) members: Vec<Member>,
    /// One number a column: the catalogue's parameters, those of its airframe, then the sensors of
    /// each flight.
    pub(crate) base: Vec<f64>,
}

/// A number of the airframe, or of how its sensors are read, that no effect changes by itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Airframe {
    /// Place of a rotor along an axis, m.
    Arm { rotor: usize, axis: usize },
    /// Reaction torque of a rotor, as a fraction.
    Torque { rotor: usize },
    /// Linear drag along an axis, N s/m.
    Drag { axis: usize },
    /// Place of the wings along an axis, m: ahead, to each side, below. What the rotors blow at
    /// them goes with it.
    Wing { axis: usize },
    /// Where the frame's drag acts along an axis, m.
    DragCentre { axis: usize },
    /// How late a sensor reads, s, by its place in [`LATE`](crate::predictor::LATE): the filters of
    /// an autopilot are the same in each of its flights.
    Late { sensor: usize },
}

impl Airframe {
    fn act(self, on: &mut Hypothesis, x: f64) {
        let vehicle = &on.vehicle;
        let along = |axis: usize| {
            let mut v = Vector3::zeros();
            v[axis] = x;
            v
        };
        on.vehicle = match self {
            Self::Arm { rotor, axis } => vehicle.with_rotor_off(rotor, In::new(along(axis)), 1.0),
            Self::Torque { rotor } => vehicle.with_rotor_off(rotor, In::zero(), 1.0 + x),
            Self::Drag { axis } => vehicle.with_more_drag(along(axis)),
            Self::Wing { axis } => with_wing_off(vehicle, axis, x),
            Self::DragCentre { axis } => {
                on.drag_centre_m[axis] += x;
                return;
            }
            Self::Late { sensor } => {
                for errors in &mut on.errors {
                    errors.late_s[sensor] += x;
                }
                return;
            }
        };
    }
}

/// The vehicle with its wings elsewhere; as it is where it has none, or no file may have such ones.
fn with_wing_off(vehicle: &Vehicle<f64>, axis: usize, x: f64) -> Vehicle<f64> {
    let mut p = *vehicle.parameters();
    if let Some(wing) = &mut p.wing {
        let place =
            [&mut wing.longitudinal_arm_m, &mut wing.lateral_arm_m, &mut wing.vertical_arm_m];
        *place[axis] += x;
    }
    let factors = vehicle.rotor_factors();
    Vehicle::new(p).and_then(|own| own.with_rotor_factors(factors)).unwrap_or(*vehicle)
}

/// What a column of a [`Point`] beside the catalogue's parameters stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Other {
    Airframe,
    /// Of one flight: its attitude, or its thrust.
    Flight {
        flight: usize,
        is_thrust: bool,
    },
    Height {
        flight: usize,
    },
}

/// The hypothesis of a point, on top of the vehicle file.
///
/// # Errors
/// A mass or inertia that no body has.
pub(crate) fn hypothesis(
    predictor: &Predictor,
    catalogue: &Catalogue,
    point: &Point,
) -> Result<Hypothesis, GapError> {
    let mut all = predictor.nominal();
    for member in &point.members {
        let candidate = &catalogue.candidates[member.candidate];
        // The catalogue has one of each effect: a second weak rotor changes the vehicle's own
        // numbers.
        if all.effects.has(candidate.effect) && !is_same(&mut all.effects, candidate) {
            let mut one = Effects::none();
            if let Some(found) = one.insert(candidate.effect) {
                found.values.copy_from_slice(&member.values);
            }
            let altered = one
                .alter(&all.vehicle)
                .map_err(|problem| predictor.refused(problem.to_string()))?;
            if altered != all.vehicle {
                all.vehicle = altered;
                continue;
            }
        }
        if let Some(found) = all.effects.insert(candidate.effect) {
            found.values.copy_from_slice(&member.values);
        }
    }
    let mut sides = [0.0; 2];
    for (parameter, &x) in catalogue.parameters.iter().zip(&point.base) {
        if x == 0.0 {
            continue;
        }
        let candidate = &catalogue.candidates[parameter.candidate];
        if candidate.effect == WingAsymmetry::<f64>::NAME {
            sides[candidate.fixed[0].1 as usize] = x;
            continue;
        }
        // What changes the airframe's numbers does so in a row, so that two rotors can be weak; the
        // rest adds up, and so does what acts already.
        if all.effects.has(candidate.effect) && is_same(&mut all.effects, candidate) {
            add(&mut all.effects, candidate, parameter.slot, x);
            continue;
        }
        let mut effects = Effects::none();
        add(&mut effects, candidate, parameter.slot, x);
        let altered = effects
            .alter(&all.vehicle)
            .map_err(|problem| predictor.refused(problem.to_string()))?;
        if altered == all.vehicle {
            add(&mut all.effects, candidate, parameter.slot, x);
        } else {
            all.vehicle = altered;
        }
    }
    // A loss on both sides is a change of the gain and a loss on one side.
    if sides != [0.0; 2] {
        let of = |effect: &str| catalogue.candidates.iter().find(|c| c.effect == effect);
        let gain = match of(WingAsymmetry::<f64>::NAME) {
            Some(left) if !all.effects.has(left.effect) => {
                add(&mut all.effects, left, 1, sides[0] - sides[1]);
                -sides[1]
            }
            _ => -0.5 * (sides[0] + sides[1]),
        };
        if let Some(membrane) = of(WingMembrane::<f64>::NAME) {
            add(&mut all.effects, membrane, 0, gain);
        }
    }
    let others = &point.base[catalogue.parameters.len()..];
    for ((number, _), &x) in catalogue.airframe.iter().zip(others) {
        if x != 0.0 {
            number.act(&mut all, x);
        }
    }
    let flights = others[catalogue.airframe.len()..].chunks_exact(OF_A_FLIGHT);
    for ((errors, thrust), x) in all.errors.iter_mut().zip(&mut all.thrust).zip(flights) {
        errors.tilt_rad = [x[0], x[1]];
        errors.levelling_rad_s2_per_m = [x[2], x[3]];
        *thrust = x[4];
        errors.height_m.copy_from_slice(&x[SHORT..]);
    }
    Ok(all)
}

/// The effect that changes a number of the vehicle file.
fn behind(number: Declared) -> Option<&'static str> {
    let is_it = |p: &EffectParameter| p.tolerance == Tolerance::Declared(number);
    let has =
        |name: &&&str| Effects::<f64>::parameters(name).is_some_and(|list| list.iter().any(is_it));
    Effects::<f64>::NAMES.iter().find(has).copied()
}

/// Whether an effect that acts makes the choices of a candidate.
fn is_same(effects: &mut Effects<f64>, candidate: &Candidate) -> bool {
    effects.insert(candidate.effect).is_some_and(|found| {
        candidate.fixed.iter().all(|(slot, value)| found.values[*slot] == *value)
    })
}

fn add(effects: &mut Effects<f64>, candidate: &Candidate, slot: usize, x: f64) {
    let present = effects.has(candidate.effect);
    if let Some(found) = effects.insert(candidate.effect) {
        if !present {
            for (slot, value) in candidate.fixed.iter().chain(&candidate.shape) {
                found.values[*slot] = *value;
            }
        }
        found.values[slot] += x;
    }
}

impl Catalogue {
    /// Columns that are the same for every set of flights: all but those of sensors.
    pub(crate) fn shared_columns(&self) -> usize {
        self.parameters.len() + self.airframe.len()
    }

    /// Numbers beside the members in a [`Point`].
    pub(crate) fn columns(&self, predictor: &Predictor) -> usize {
        self.shared_columns() + OF_A_FLIGHT * predictor.names.len()
    }

    /// What a column behind those of the parameters is, and its tolerance.
    pub(crate) fn other(&self, column: usize) -> (Other, f64) {
        let index = column - self.parameters.len();
        if let Some((_, tolerance)) = self.airframe.get(index) {
            return (Other::Airframe, *tolerance);
        }
        let sensor = index - self.airframe.len();
        let flight = sensor / OF_A_FLIGHT;
        match sensor % OF_A_FLIGHT {
            0 | 1 => (Other::Flight { flight, is_thrust: false }, TILT_RAD),
            2 | 3 => (Other::Flight { flight, is_thrust: false }, LEVELLING_RAD_S2_PER_M),
            4 => (Other::Flight { flight, is_thrust: true }, self.day_fraction),
            _ => (Other::Height { flight }, HEIGHT_M),
        }
    }

    /// Whether a column is a place at which forces act that go with the members: what blows on the
    /// wings, and drag.
    pub(crate) fn goes_with_members(&self, column: usize) -> bool {
        let index = column.checked_sub(self.parameters.len());
        let number = index.and_then(|index| self.airframe.get(index));
        matches!(number, Some((Airframe::Wing { .. } | Airframe::DragCentre { .. }, _)))
    }

    /// The effect that a column changes a number of, with the smallest size of it that is worth
    /// reporting; `None` for what belongs to a flight, to the place of a rotor, or to no effect.
    pub(crate) fn group(&self, column: usize) -> Option<(&'static str, f64)> {
        if let Some(parameter) = self.parameters.get(column) {
            // What is there or not scatters by nothing.
            let scatters = parameter.tolerance > 0.0;
            return scatters
                .then_some((self.candidates[parameter.candidate].effect, parameter.smallest));
        }
        match self.airframe.get(column - self.parameters.len())?.0 {
            Airframe::Arm { .. }
            | Airframe::Wing { .. }
            | Airframe::DragCentre { .. }
            | Airframe::Late { .. } => None,
            Airframe::Torque { .. } => Some((behind(Declared::Torque)?, TORQUE_FRACTION)),
            Airframe::Drag { .. } => {
                let drag = self.parameters.iter().find(|p| p.is_behind(Declared::LinearDrag(0)))?;
                Some((self.candidates[drag.candidate].effect, drag.smallest))
            }
        }
    }

    /// Lets numbers that make moments and next to no force be as large as is plausible, and those
    /// of rotors' torques with them, and nothing else be off.
    pub(crate) fn free_moments_alone(&mut self) {
        for parameter in &mut self.parameters {
            let is_free = self.candidates[parameter.candidate].profile.is_of_moments;
            parameter.tolerance = if is_free { parameter.largest } else { 0.0 };
        }
        for (number, tolerance) in &mut self.airframe {
            *tolerance =
                if matches!(number, Airframe::Torque { .. }) { FREE_TORQUE_FRACTION } else { 0.0 };
        }
    }

    /// Takes the tolerances of one machine: its rotors and wings are where they were, and so is what
    /// the air pushes at.
    pub(crate) fn take(&mut self, scatter: &Scatter) {
        self.is_of_one_machine = true;
        self.usual = scatter.usual;
        for (number, tolerance) in &mut self.airframe {
            if matches!(
                number,
                Airframe::Arm { .. } | Airframe::Wing { .. } | Airframe::DragCentre { .. }
            ) {
                *tolerance = 0.0;
            }
        }
        for column in 0..self.shared_columns() {
            let group = self.group(column);
            let Some(sd) = group.and_then(|(effect, _)| scatter.tolerances.get(effect)) else {
                continue;
            };
            match self.parameters.get_mut(column) {
                Some(parameter) => (parameter.tolerance, parameter.spread) = (*sd, *sd),
                None => self.airframe[column - self.parameters.len()].1 = *sd,
            }
        }
    }

    /// Takes the gyroscope to be on time: where its noise is most of what is quick, a controller
    /// that feeds it back makes commands of it, and a delay that is not there fits that.
    pub(crate) fn hold_gyroscope(&mut self) {
        for (number, tolerance) in &mut self.airframe {
            if *number == (Airframe::Late { sensor: GYROSCOPE }) {
                *tolerance = 0.0;
            }
        }
    }

    /// Whether a candidate has no slope at zero, so that nothing linear holds near it.
    pub(crate) fn starts_flat(&self, candidate: usize) -> bool {
        self.candidates[candidate].profile.starts_flat()
    }

    /// Whether the slope of a candidate is another one after a few tolerances: lags and delays.
    pub(super) fn bends(&self, candidate: usize) -> bool {
        self.candidates[candidate].profile.bends()
    }

    /// Whether height is worth something: an effect of it acts.
    pub(super) fn feels_height(&self, members: &[Member]) -> bool {
        members.iter().any(|member| self.candidates[member.candidate].profile.feels_height)
    }

    /// A candidate as the vehicle file has it: zero, or the file's own numbers where it makes the
    /// same choices.
    pub(crate) fn absent(&self, predictor: &Predictor, candidate: usize) -> Member {
        let own = &self.candidates[candidate];
        let mut effects = predictor.vehicle.effects;
        let present = effects.has(own.effect);
        let mut values =
            effects.insert(own.effect).map_or_else(Vec::new, |found| found.values.to_vec());
        let same = own.fixed.iter().all(|(slot, value)| values[*slot] == *value);
        if !(present && same) {
            values.fill(0.0);
        }
        for (slot, value) in own.fixed.iter().chain(&own.shape) {
            values[*slot] = *value;
        }
        Member { candidate, values }
    }
}
