//! One inertial measurement out of one unit or two.
//!
//! Two units that agree are averaged. Where they differ by more than noise, the one that left what
//! both said before is doubted until they have agreed again for 0.3 s; with two units nothing else
//! can tell who is wrong. A unit that is silent, or that hangs while the other moves, does not
//! count. What the units constantly differ by is learnt and halved between them, so that nothing
//! jumps when one of them goes. A unit that is alone may spike: what no vehicle turns or feels from
//! one sample to the next is replaced by the sample before.

use crate::frame::Imu;
use crate::frames::{Body, In};
use nalgebra::Vector3;

/// Units differ by more than noise beyond this rate, rad/s.
const APART_RAD_S: f32 = 0.4;
/// And beyond this specific force, m/s^2: a spinning rotor shakes one more than the other.
const APART_M_S2: f32 = 15.0;
/// How long a unit stays doubted after the last difference, us.
const HOLD_US: u32 = 300_000;
/// Time in which a constant difference is learnt, s.
const LEARN_S: f32 = 2.0;
/// Identical samples after which a unit hangs, if the other changes.
const HANGS: u16 = 10;
/// And after which it does if there is no other to tell: a third of a second at 300 Hz.
const HANGS_ALONE: u16 = 100;
const TURNING_RAD_S: f32 = 1e-3;
/// From one sample to the next, of a unit that is alone: rad/s and m/s^2.
const SPIKE_RAD_S: f32 = 15.0;
const SPIKE_M_S2: f32 = 150.0;
/// Samples that may be replaced in a row.
const SPIKES: u8 = 5;
/// Beyond this time between samples anything may have happened, us.
const SPIKE_GAP_US: u32 = 20_000;

/// What is known of one unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Unit {
    pub(crate) last: Option<Imu>,
    pub(crate) repeats: u16,
    /// Doubted for this long still, us.
    pub(crate) doubted_us: u32,
    pub(crate) silent_us: u32,
}

impl Unit {
    fn hear(&mut self, reading: Option<Imu>, elapsed_us: u32) {
        self.doubted_us = self.doubted_us.saturating_sub(elapsed_us);
        if reading.is_none() {
            self.silent_us = self.silent_us.saturating_add(elapsed_us);
        } else {
            self.repeats = if reading == self.last { self.repeats.saturating_add(1) } else { 0 };
            (self.last, self.silent_us) = (reading, 0);
        }
    }
}

/// Listens to the units of one vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Voter {
    pub(crate) units: [Unit; 2],
    /// First unit less the second.
    pub(crate) difference: Difference,
    pub(crate) voted: Option<Imu>,
    pub(crate) since_us: u32,
    pub(crate) spikes: u8,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Difference {
    pub(crate) omega: Vector3<f32>,
    pub(crate) force: Vector3<f32>,
}

impl Default for Difference {
    fn default() -> Self {
        Self { omega: Vector3::zeros(), force: Vector3::zeros() }
    }
}

impl Difference {
    fn between(a: &Imu, b: &Imu) -> Self {
        Self {
            omega: a.omega.vector - b.omega.vector,
            force: a.specific_force.vector - b.specific_force.vector,
        }
    }

    fn less(&self, other: &Self) -> Self {
        Self { omega: self.omega - other.omega, force: self.force - other.force }
    }

    /// Part of what is allowed, squared.
    fn size(&self) -> f32 {
        self.omega.norm_squared() / (APART_RAD_S * APART_RAD_S)
            + self.force.norm_squared() / (APART_M_S2 * APART_M_S2)
    }
}

impl Voter {
    /// The measurement to believe; `None` where no unit spoke.
    ///
    /// * `readings` - of the units in this step, finite
    /// * `elapsed_us` - since the step before
    pub fn vote(&mut self, readings: [Option<Imu>; 2], elapsed_us: u32) -> Option<Imu> {
        for (unit, reading) in self.units.iter_mut().zip(readings) {
            unit.hear(reading, elapsed_us);
        }
        self.since_us = self.since_us.saturating_add(elapsed_us);
        let [first, second] = self.units.map(|unit| unit.repeats >= HANGS);
        let readings = match readings {
            [Some(_), Some(_)] if first != second => {
                [readings[0].filter(|_| !first), readings[1].filter(|_| !second)]
            }
            _ => readings,
        };
        let voted = match readings {
            [Some(a), Some(b)] => self.of_two(&a, &b, elapsed_us),
            [Some(a), None] => self.alone(&a, -0.5),
            [None, Some(b)] => self.alone(&b, 0.5),
            [None, None] => return None,
        };
        (self.voted, self.since_us) = (Some(voted), 0);
        Some(voted)
    }

    /// Whether each unit is left out: it spoke once, and is silent, hangs or is doubted now.
    pub fn left_out(&self) -> [bool; 2] {
        let hangs = self.units.map(|unit| unit.repeats >= HANGS);
        let out = |i: usize| {
            let unit = &self.units[i];
            let alone = unit.repeats >= HANGS && !hangs[1 - i] && self.units[1 - i].last.is_some();
            unit.last.is_some() && (unit.doubted_us > 0 || unit.silent_us > SPIKE_GAP_US || alone)
        };
        [out(0), out(1)]
    }

    /// Whether every unit that ever spoke repeats itself bit for bit although it says that the
    /// vehicle turns, or weighs nothing.
    pub fn hangs(&self) -> bool {
        let mut spoken = self
            .units
            .iter()
            .filter_map(|unit| unit.last.map(|imu| (unit.repeats, imu)))
            .peekable();
        spoken.peek().is_some()
            && spoken.all(|(repeats, imu)| {
                let is_turning = imu.omega.vector.norm_squared() > TURNING_RAD_S * TURNING_RAD_S;
                repeats >= HANGS_ALONE
                    && (is_turning || imu.specific_force.vector == Vector3::zeros())
            })
    }

    fn of_two(&mut self, a: &Imu, b: &Imu, elapsed_us: u32) -> Imu {
        let difference = Difference::between(a, b);
        let apart = difference.less(&self.difference);
        // Where they agree as they are, what was learnt is wrong.
        if apart.size() > 1.0 && difference.size() > 1.0 {
            let doubted = match self.units.map(|unit| unit.doubted_us > 0) {
                [true, false] => 0,
                [false, true] => 1,
                _ => self.stranger(a, b),
            };
            self.units[doubted].doubted_us = HOLD_US;
        } else if self.units.iter().all(|unit| unit.doubted_us == 0) {
            let share = crate::math::lower(elapsed_us as f32 * 1e-6 / LEARN_S, 1.0);
            self.difference.omega += apart.omega * share;
            self.difference.force += apart.force * share;
        }
        match self.units.map(|unit| unit.doubted_us > 0) {
            [true, false] => self.alone(b, 0.5),
            [false, true] => self.alone(a, -0.5),
            _ => Imu {
                omega: In::new((a.omega.vector + b.omega.vector) * 0.5),
                specific_force: In::new((a.specific_force.vector + b.specific_force.vector) * 0.5),
            },
        }
    }

    /// The unit that is further from what was believed last.
    fn stranger(&self, a: &Imu, b: &Imu) -> usize {
        let Some(last) = &self.voted else { return 1 };
        let [from_a, from_b] = [a, b].map(|unit| Difference::between(unit, last).size());
        usize::from(from_b > from_a)
    }

    /// One unit, with its share of what the two differ by.
    fn alone(&mut self, unit: &Imu, share: f32) -> Imu {
        let own = |v: In<Body, f32>, difference: Vector3<f32>| {
            // Exactly what it said where there is no second one.
            if difference == Vector3::zeros() { v } else { In::new(v.vector + difference * share) }
        };
        let imu = Imu {
            omega: own(unit.omega, self.difference.omega),
            specific_force: own(unit.specific_force, self.difference.force),
        };
        let Some(last) = self.voted.filter(|_| self.since_us <= SPIKE_GAP_US) else { return imu };
        let jump = Difference::between(&imu, &last);
        let is_spike = jump.omega.norm_squared() > SPIKE_RAD_S * SPIKE_RAD_S
            || jump.force.norm_squared() > SPIKE_M_S2 * SPIKE_M_S2;
        if is_spike && self.spikes < SPIKES {
            self.spikes += 1;
            return last;
        }
        self.spikes = 0;
        imu
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_US: u32 = 3333;

    fn imu(rate: f32) -> Imu {
        Imu {
            omega: In::new(Vector3::new(rate, 0.0, 0.0)),
            specific_force: In::new(Vector3::new(0.0, 0.0, -9.8 - 0.01 * rate)),
        }
    }

    /// A flight that turns this way and that; the second unit has a bias.
    fn reading(k: u32) -> [Option<Imu>; 2] {
        let rate = (k as f32 * 0.03).sin();
        [Some(imu(rate)), Some(imu(rate + 0.1))]
    }

    fn error(voted: Option<Imu>, k: u32) -> f32 {
        // The mean's bias is half of the second unit's.
        voted.unwrap().omega.vector.x - (k as f32 * 0.03).sin() - 0.05
    }

    /// Flies ten seconds well, then with a fault; the largest jump, and who was left out when.
    fn flown(fault: impl Fn(u32, [Option<Imu>; 2]) -> [Option<Imu>; 2]) -> (f32, [bool; 2]) {
        let (mut voter, mut worst, mut out) = (Voter::default(), 0.0_f32, [false; 2]);
        for k in 0..6000 {
            let heard = if k >= 3000 { fault(k, reading(k)) } else { reading(k) };
            let voted = voter.vote(heard, STEP_US);
            if k >= 3000 {
                worst = worst.max(error(voted, k).abs());
                let left = voter.left_out();
                out = [out[0] || left[0], out[1] || left[1]];
            } else {
                assert_eq!(voter.left_out(), [false; 2], "{k}");
            }
        }
        (worst, out)
    }

    #[test]
    fn a_unit_that_goes_takes_nothing_along() {
        for dead in 0..2 {
            let (worst, out) = flown(|_, mut heard| {
                heard[dead] = None;
                heard
            });
            assert!(worst < 0.01, "{worst}");
            assert_eq!(out, [dead == 0, dead == 1]);
        }
    }

    #[test]
    fn the_unit_that_jumps_or_hangs_is_the_one_that_is_left_out() {
        for bad in 0..2 {
            let jump = flown(|_, mut heard| {
                heard[bad] = heard[bad].map(|unit| imu(unit.omega.vector.x + 1.5));
                heard
            });
            let spikes = flown(|k, mut heard| {
                if k % 50 == 0 {
                    heard[bad] = Some(imu(35.0));
                }
                heard
            });
            let hangs = flown(|_, mut heard| {
                heard[bad] = reading(2999)[bad];
                heard
            });
            for (what, (worst, out), bar) in
                [("jump", jump, 0.01), ("spikes", spikes, 0.01), ("hangs", hangs, 0.25)]
            {
                assert!(worst < bar, "{what} of {bad}: {worst}");
                assert_eq!(out, [bad == 0, bad == 1], "{what}");
            }
        }
    }

    #[test]
    fn a_unit_that_is_alone_says_what_it_says_but_for_spikes() {
        let mut voter = Voter::default();
        for k in 0..1000 {
            let truth = imu((k as f32 * 0.03).sin());
            let spike = k % 100 == 99;
            let heard = if spike { imu(30.0) } else { truth };
            let voted = voter.vote([Some(heard), None], STEP_US).unwrap();
            let before = imu(((k as f32 - 1.0) * 0.03).sin());
            assert_eq!(voted, if spike { before } else { truth }, "{k}");
        }
        assert_eq!(voter.vote([None, None], STEP_US), None);
    }

    /// A rate that stays is no spike for long: a vehicle that hit something really turns.
    #[test]
    fn what_stays_is_believed() {
        let mut voter = Voter::default();
        voter.vote([Some(imu(0.0)), None], STEP_US);
        let believed: Vec<bool> = (0..10)
            .map(|k| voter.vote([Some(imu(40.0 + k as f32)), None], STEP_US).unwrap() != imu(0.0))
            .collect();
        assert_eq!(believed.iter().filter(|b| !**b).count(), usize::from(SPIKES), "{believed:?}");
    }
}
