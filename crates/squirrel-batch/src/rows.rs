//! How vehicles lie in memory: sixteen side by side, one row a number.
//!
//! The structures are those of `squirrel_core::dynamics`, each used twice: on rows, of [`BLOCK`]
//! vehicles in memory, and on registers, of as many as one of them holds.

use super::BODY_NUMBERS;
use super::autopilot::Autopilots;
use super::extra::{Command, Extra};
use nalgebra::{Quaternion, Vector3};
use squirrel_core::dynamics::State;
use squirrel_core::dynamics::lanes::{Airframe, Held, Motion};
use squirrel_core::effects::Effects;
use squirrel_core::frames::{In, Ned};
use squirrel_core::lane::Lane;
use squirrel_core::lane::{Row, put, take};
use squirrel_core::math::{limit, real};
use squirrel_core::vehicle::{CommandKind, MAX_ROTORS, Propulsion, Vehicle};
use squirrel_sim::simd::{BLOCK, Paths, Register};

/// How one vehicle's commands become rotor speeds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drive<S> {
    propulsion: Propulsion<S>,
    rotors: usize,
}

impl<S: Paths> Drive<S> {
    pub(super) fn new(vehicle: &Vehicle<S>) -> Self {
        let p = vehicle.parameters();
        Self { propulsion: p.propulsion, rotors: p.rotor_count }
    }

    /// Steady rotor speeds of a command.
    pub(super) fn targets<const ROTORS: usize>(&self, command: &[S]) -> [S; ROTORS] {
        core::array::from_fn(|i| self.only(i, self.propulsion.target_speed_rad_s(command[i])))
    }

    /// Speed at full command, rad/s, where a command is a part of it and there are as many rotors
    /// as places.
    fn full_speed<const ROTORS: usize>(&self) -> Option<S> {
        let p = &self.propulsion;
        let is_part = matches!(p.command, CommandKind::SpeedFraction | CommandKind::Duty);
        (is_part && p.thrust_curve.is_none() && self.rotors == ROTORS).then_some(p.speed_max_rad_s)
    }

    /// `number` where rotor `i` is one, zero where it is not.
    pub(super) fn only(&self, i: usize, number: S) -> S {
        if i < self.rotors { number } else { <S as Lane>::of(0.0) }
    }
}

/// What effects change of the rotors once.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tuning<S> {
    /// Added to the lag, speeding up and slowing down.
    pub(super) lag_s: [S; 2],
    /// Factors on thrust and on torque of each rotor.
    pub(super) rotor: [[S; 2]; MAX_ROTORS],
}

impl<S: Paths> Tuning<S> {
    /// Nothing.
    pub(super) fn none() -> Self {
        Self { lag_s: [real(0.0); 2], rotor: [[real(1.0); 2]; MAX_ROTORS] }
    }

    /// What is between a vehicle as declared and with its effects.
    pub(super) fn between(
        declared: &Vehicle<f64>,
        altered: &Vehicle<f64>,
        effects: &Effects<f64>,
    ) -> Self {
        let mut out =
            Self { lag_s: effects.rotor_extra_time_constant_s().map(real), ..Self::none() };
        let of = |vehicle| Airframe::<f64, MAX_ROTORS>::new(vehicle, [0.0; 2]);
        let (now, before) = (of(altered), of(declared));
        let ratio = |now: f64, before: f64| real(if before == 0.0 { 1.0 } else { now / before });
        for (i, factors) in out.rotor.iter_mut().enumerate().take(declared.rotors().len()) {
            *factors = [ratio(now.thrust[i], before.thrust[i]), ratio(now.yaw[i], before.yaw[i])];
        }
        out
    }
}

/// Sixteen vehicles. Rows come first, in the order of the source: with the alignment no load of a
/// row touches two lines of the cache.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Block<S: Copy, const ROTORS: usize> {
    pub(super) motion: Motion<Row<S>, ROTORS>,
    pub(super) airframe: Airframe<Row<S>, ROTORS>,
    pub(super) held: Held<Row<S>, ROTORS>,
    /// Speed of the rotors at full command, rad/s, where a command is a part of it and there is a
    /// rotor in every place; NaN elsewhere.
    full_speed: Row<S>,
    /// Columns with a vehicle, the first ones.
    pub(super) vehicles: usize,
    /// Some rotors have no lag.
    pub(super) lagless: bool,
    /// It is so for every vehicle.
    commands_are_parts: bool,
    /// What is not part of the base model, where the batch has any of it.
    pub(super) extra: Option<Box<Extra<S, ROTORS>>>,
    /// Where something flies the vehicles.
    pub(super) autopilots: Option<Box<Autopilots<S, ROTORS>>>,
}

impl<S: Copy, const ROTORS: usize> Block<S, ROTORS> {
    /// Where registers begin between which all its vehicles are.
    #[inline(always)]
    pub(super) fn starts<L: Register<Element = S>>(
        &self,
    ) -> impl Iterator<Item = usize> + use<L, S, ROTORS> {
        (0..self.vehicles.div_ceil(L::WIDTH)).map(|group| group * L::WIDTH)
    }
}

impl<S: Paths, const ROTORS: usize> Block<S, ROTORS> {
    /// Columns without a vehicle: nothing moves, nothing pulls, and no number ever becomes slow or
    /// infinite.
    pub(super) fn empty() -> Self {
        let none = [<S as Lane>::of(0.0); BLOCK];
        let one = [real::<S>(1.0); BLOCK];
        Self {
            motion: Motion { attitude: [one, none, none, none], ..Motion::all(none) },
            airframe: Airframe { inverse_lag: [one; 2], ..Airframe::all(none) },
            held: Held::all(none),
            vehicles: BLOCK,
            lagless: false,
            full_speed: [real(f64::NAN); BLOCK],
            commands_are_parts: false,
            extra: None,
            autopilots: None,
        }
    }

    /// Another airframe in column `lane`.
    ///
    /// * `extra` - what it adds to the vehicle
    pub(super) fn put_vehicle(&mut self, lane: usize, vehicle: &Vehicle<S>, extra: &Tuning<S>) {
        let p = vehicle.parameters();
        let zero = <S as Lane>::of(0.0);
        let mut airframe = Airframe::<S, ROTORS>::new(vehicle, extra.lag_s);
        for (i, [thrust, torque]) in extra.rotor.iter().enumerate().take(ROTORS) {
            airframe.thrust[i] *= *thrust;
            airframe.roll[i] *= *thrust;
            airframe.pitch[i] *= *thrust;
            airframe.yaw[i] *= *torque;
        }
        let rows = &mut self.airframe;
        rows.put(lane, &airframe);
        self.lagless = rows.inverse_lag.as_flattened().contains(&zero);
        self.full_speed[lane] =
            Drive::new(vehicle).full_speed::<ROTORS>().unwrap_or(real(f64::NAN));
        self.commands_are_parts = self.full_speed[..self.vehicles].iter().all(S::is_finite);
        for i in p.rotor_count..ROTORS {
            self.motion.rotor_speed[i][lane] = zero;
            self.held.target_speed[i][lane] = zero;
        }
    }

    /// The motion in column `lane`, rotors only where there are any.
    pub(super) fn put_state(&mut self, lane: usize, state: &State<S>, drive: &Drive<S>) {
        let mut motion = Motion::from(state);
        motion.rotor_speed = core::array::from_fn(|i| drive.only(i, motion.rotor_speed[i]));
        self.motion.put(lane, &motion);
    }

    /// The motion in column `lane`.
    pub(super) fn state(&self, lane: usize) -> State<S> {
        let motion = self.motion.take(lane);
        let [w, x, y, z] = motion.attitude;
        let mut rotor_speed_rad_s = [<S as Lane>::of(0.0); MAX_ROTORS];
        rotor_speed_rad_s[..ROTORS].copy_from_slice(&motion.rotor_speed);
        State {
            position: In::new(Vector3::from(motion.position)),
            velocity: In::new(Vector3::from(motion.velocity)),
            attitude: Quaternion::new(w, x, y, z),
            omega: In::new(Vector3::from(motion.omega)),
            rotor_speed_rad_s,
        }
    }

    /// Motions of the first vehicles, one after the other, as [`super::Batch::write_states`] orders
    /// them.
    pub(super) fn write_states(&self, rows: &mut [S]) {
        let motion = &self.motion;
        for (lane, row) in rows.chunks_exact_mut(BODY_NUMBERS + ROTORS).enumerate() {
            let (body, rotors) = row.split_at_mut(BODY_NUMBERS);
            body[..3].copy_from_slice(&take(&motion.position, lane));
            body[3..6].copy_from_slice(&take(&motion.velocity, lane));
            body[6..10].copy_from_slice(&take(&motion.attitude, lane));
            body[10..].copy_from_slice(&take(&motion.omega, lane));
            rotors.copy_from_slice(&take(&motion.rotor_speed, lane));
        }
    }

    /// Targets of the rotors of the first vehicles from their commands, one vehicle after the
    /// other.
    pub(super) fn command(&mut self, commands: &[S], drives: &[Drive<S>]) {
        let is_late = self
            .extra
            .as_ref()
            .is_some_and(|extra| extra.latency_steps.iter().any(|steps| *steps > 0));
        if self.commands_are_parts && self.vehicles == BLOCK && !is_late {
            // What `Drive::targets` does, in an order that the compiler makes registers of.
            let (none, one) = (<S as Lane>::of(0.0), real::<S>(1.0));
            for (i, targets) in self.held.target_speed.iter_mut().enumerate() {
                for (lane, target) in targets.iter_mut().enumerate() {
                    *target = limit(commands[lane * ROTORS + i], none, one) * self.full_speed[lane];
                }
            }
            return;
        }
        for (lane, (commands, drive)) in commands.chunks_exact(ROTORS).zip(drives).enumerate() {
            let targets = drive.targets(commands);
            match &mut self.extra {
                Some(extra) if extra.latency_steps[lane] > 0 => {
                    extra.send(lane, Command::Rotors(targets));
                }
                _ => put(&mut self.held.target_speed, lane, targets),
            }
        }
    }

    /// What was just asked of the rotors comes later where commands are late.
    ///
    /// * `before` - what was asked before
    pub(super) fn delay(&mut self, before: &[Row<S>; ROTORS]) {
        let Some(extra) = &mut self.extra else { return };
        for lane in (0..BLOCK).filter(|lane| extra.latency_steps[*lane] > 0).collect::<Vec<_>>() {
            extra.send(lane, Command::Rotors(take(&self.held.target_speed, lane)));
            put(&mut self.held.target_speed, lane, take(before, lane));
        }
    }

    /// Velocity of the air about the vehicle in column `lane`, m/s.
    pub(super) fn put_wind(&mut self, lane: usize, wind: In<Ned, S>) {
        put(&mut self.held.wind, lane, wind.vector.into());
    }
}
