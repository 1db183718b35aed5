//! How vehicles lie in memory: sixteen side by side, one row a number.
//!
//! Each structure is used twice: on rows, of [`BLOCK`] vehicles in memory, and on registers, of as many as one of them holds.

use super::BODY_NUMBERS;
use super::autopilot::Autopilots;
use super::extra::{Command, Extra};
use super::simd::{BLOCK, Paths, Register};
use nalgebra::{Matrix3, Quaternion, Vector3};
use squirrel_core::dynamics::{self, RotorDrive, State};
use squirrel_core::effects::{Acting, Effects};
use squirrel_core::frames::{Body, In, Ned, Wrench};
use squirrel_core::lane::Lane;
use squirrel_core::lane::{Row, load, put, store, take};
use squirrel_core::math::{limit, real};
use squirrel_core::vehicle::{CommandKind, MAX_ROTORS, Propulsion, Vehicle};

/// Rigid body and rotor speeds, in the units and frames of [`State`]; as a rate, the derivative of each.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion<L, const ROTORS: usize> {
    pub(super) position: [L; 3],
    pub(super) velocity: [L; 3],
    /// w x y z.
    pub(super) attitude: [L; 4],
    pub(super) omega: [L; 3],
    pub(super) rotor_speed: [L; ROTORS],
}

/// What does not change in flight, SI.
#[derive(Debug, Clone, Copy)]
pub(super) struct Airframe<L, const ROTORS: usize> {
    pub(super) inverse_mass: L,
    /// By columns, as its inverse.
    pub(super) inertia: [[L; 3]; 3],
    pub(super) inertia_inverse: [[L; 3]; 3],
    pub(super) linear_drag: [L; 3],
    /// `1/2 rho C_d A`.
    pub(super) quadratic_drag: L,
    /// Over speed squared.
    pub(super) thrust: [L; ROTORS],
    pub(super) roll: [L; ROTORS],
    pub(super) pitch: [L; ROTORS],
    pub(super) yaw: [L; ROTORS],
    /// Inverse time constants of rotor speed, speeding up and slowing down, 1/s; 0 for no lag.
    pub(super) inverse_lag: [L; 2],
}

/// What is held from call to call.
#[derive(Debug, Clone, Copy)]
pub(super) struct Held<L, const ROTORS: usize> {
    pub(super) wind: [L; 3],
    pub(super) target_speed: [L; ROTORS],
}

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

    /// Speed at full command, rad/s, where a command is a part of it and there are as many rotors as places.
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
    pub(super) fn between(declared: &Vehicle<f64>, altered: &Vehicle<f64>, effects: &Effects<f64>) -> Self {
        let mut out = Self { lag_s: effects.rotor_extra_time_constant_s().map(real), ..Self::none() };
        for (i, factors) in out.rotor.iter_mut().enumerate().take(declared.rotors().len()) {
            let (now, before) = (rotor_alone(altered, i), rotor_alone(declared, i));
            let ratio = |now: f64, before: f64| real(if before == 0.0 { 1.0 } else { now / before });
            *factors = [
                ratio(now.force.vector.z, before.force.vector.z),
                ratio(now.moment.vector.z, before.moment.vector.z),
            ];
        }
        out
    }
}

/// What rotor `i` gives over speed squared, whatever was changed of it since the vehicle was declared.
fn rotor_alone<S: Paths>(vehicle: &Vehicle<S>, i: usize) -> Wrench<Body, S> {
    let mut state = State::at_rest();
    state.rotor_speed_rad_s[i] = real(1.0);
    let held = dynamics::Held {
        drive: RotorDrive::holding(state.rotor_speed_rad_s),
        wind: In::zero(),
        deployment: [real(0.0); 2],
        tether_force: In::zero(),
    };
    let calm = Acting::new(&Effects::none(), vehicle);
    dynamics::wrench(vehicle, &calm, &state, &held, |_| Wrench::zero())
}

/// Sixteen vehicles. Aligned so that no load of a row touches two lines of the cache.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Block<S: Copy, const ROTORS: usize> {
    pub(super) motion: Motion<Row<S>, ROTORS>,
    pub(super) airframe: Airframe<Row<S>, ROTORS>,
    pub(super) held: Held<Row<S>, ROTORS>,
    /// Columns with a vehicle, the first ones.
    pub(super) vehicles: usize,
    /// Some rotors have no lag.
    pub(super) lagless: bool,
    /// Speed of the rotors at full command, rad/s, where a command is a part of it and there is a rotor in every place; NaN elsewhere.
    full_speed: Row<S>,
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
    pub(super) fn starts<L: Register<Element = S>>(&self) -> impl Iterator<Item = usize> + use<L, S, ROTORS> {
        (0..self.vehicles.div_ceil(L::WIDTH)).map(|group| group * L::WIDTH)
    }
}

#[inline(always)]
fn load_columns<L: Register>(rows: &[[Row<L::Element>; 3]; 3], start: usize) -> [[L; 3]; 3] {
    [load(&rows[0], start), load(&rows[1], start), load(&rows[2], start)]
}

impl<L: Register, const ROTORS: usize> Motion<L, ROTORS> {
    #[inline(always)]
    pub(super) fn load(rows: &Motion<Row<L::Element>, ROTORS>, start: usize) -> Self {
        Self {
            position: load(&rows.position, start),
            velocity: load(&rows.velocity, start),
            attitude: load(&rows.attitude, start),
            omega: load(&rows.omega, start),
            rotor_speed: load(&rows.rotor_speed, start),
        }
    }

    #[inline(always)]
    pub(super) fn store(&self, rows: &mut Motion<Row<L::Element>, ROTORS>, start: usize) {
        store(&self.position, &mut rows.position, start);
        store(&self.velocity, &mut rows.velocity, start);
        store(&self.attitude, &mut rows.attitude, start);
        store(&self.omega, &mut rows.omega, start);
        store(&self.rotor_speed, &mut rows.rotor_speed, start);
    }
}

impl<L: Register, const ROTORS: usize> Airframe<L, ROTORS> {
    #[inline(always)]
    pub(super) fn load(rows: &Airframe<Row<L::Element>, ROTORS>, start: usize) -> Self {
        Self {
            inverse_mass: L::load(&rows.inverse_mass[start..]),
            inertia: load_columns(&rows.inertia, start),
            inertia_inverse: load_columns(&rows.inertia_inverse, start),
            linear_drag: load(&rows.linear_drag, start),
            quadratic_drag: L::load(&rows.quadratic_drag[start..]),
            thrust: load(&rows.thrust, start),
            roll: load(&rows.roll, start),
            pitch: load(&rows.pitch, start),
            yaw: load(&rows.yaw, start),
            inverse_lag: load(&rows.inverse_lag, start),
        }
    }
}

impl<L: Register, const ROTORS: usize> Held<L, ROTORS> {
    #[inline(always)]
    pub(super) fn load(rows: &Held<Row<L::Element>, ROTORS>, start: usize) -> Self {
        Self { wind: load(&rows.wind, start), target_speed: load(&rows.target_speed, start) }
    }
}

impl<S: Paths, const ROTORS: usize> Block<S, ROTORS> {
    /// Columns without a vehicle: nothing moves, nothing pulls, and no number ever becomes slow or infinite.
    pub(super) fn empty() -> Self {
        let none = [<S as Lane>::of(0.0); BLOCK];
        let one = [real::<S>(1.0); BLOCK];
        Self {
            motion: Motion {
                position: [none; 3],
                velocity: [none; 3],
                attitude: [one, none, none, none],
                omega: [none; 3],
                rotor_speed: [none; ROTORS],
            },
            airframe: Airframe {
                inverse_mass: none,
                inertia: [[none; 3]; 3],
                inertia_inverse: [[none; 3]; 3],
                linear_drag: [none; 3],
                quadratic_drag: none,
                thrust: [none; ROTORS],
                roll: [none; ROTORS],
                pitch: [none; ROTORS],
                yaw: [none; ROTORS],
                inverse_lag: [one; 2],
            },
            held: Held { wind: [none; 3], target_speed: [none; ROTORS] },
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
        let inverse = |tau: S| if tau > zero { real::<S>(1.0) / tau } else { zero };
        let columns = |m: &Matrix3<S>| -> [[S; 3]; 3] { (*m).into() };
        let rows = &mut self.airframe;
        rows.inverse_mass[lane] = vehicle.inverse_mass();
        let (inertia, inverse_inertia) = (columns(&p.inertia_kg_m2), columns(vehicle.inertia_inverse()));
        for c in 0..3 {
            put(&mut rows.inertia[c], lane, inertia[c]);
            put(&mut rows.inertia_inverse[c], lane, inverse_inertia[c]);
        }
        put(&mut rows.linear_drag, lane, p.drag.linear_n_s_per_m.into());
        rows.quadratic_drag[lane] = p.drag.per_square();
        for i in 0..ROTORS {
            let Wrench { force, moment } = rotor_alone(vehicle, i);
            let [thrust, torque] = extra.rotor[i];
            rows.thrust[i][lane] = (zero - force.vector.z) * thrust;
            rows.roll[i][lane] = moment.vector.x * thrust;
            rows.pitch[i][lane] = moment.vector.y * thrust;
            rows.yaw[i][lane] = moment.vector.z * torque;
        }
        rows.inverse_lag[0][lane] = inverse(p.propulsion.time_constant_up_s + extra.lag_s[0]);
        rows.inverse_lag[1][lane] = inverse(p.propulsion.time_constant_down_s + extra.lag_s[1]);
        self.lagless = rows.inverse_lag.as_flattened().contains(&zero);
        self.full_speed[lane] = Drive::new(vehicle).full_speed::<ROTORS>().unwrap_or(real(f64::NAN));
        self.commands_are_parts = self.full_speed[..self.vehicles].iter().all(S::is_finite);
        for i in p.rotor_count..ROTORS {
            self.motion.rotor_speed[i][lane] = zero;
            self.held.target_speed[i][lane] = zero;
        }
    }

    /// The motion in column `lane`, rotors only where there are any.
    pub(super) fn put_state(&mut self, lane: usize, state: &State<S>, drive: &Drive<S>) {
        let q = &state.attitude;
        let rows = &mut self.motion;
        put(&mut rows.position, lane, state.position.vector.into());
        put(&mut rows.velocity, lane, state.velocity.vector.into());
        put(&mut rows.attitude, lane, [q.w, q.i, q.j, q.k]);
        put(&mut rows.omega, lane, state.omega.vector.into());
        put(&mut rows.rotor_speed, lane, core::array::from_fn(|i| drive.only(i, state.rotor_speed_rad_s[i])));
    }

    /// The motion in column `lane`.
    pub(super) fn state(&self, lane: usize) -> State<S> {
        let rows = &self.motion;
        let [w, x, y, z] = take(&rows.attitude, lane);
        let mut rotor_speed_rad_s = [<S as Lane>::of(0.0); MAX_ROTORS];
        rotor_speed_rad_s[..ROTORS].copy_from_slice(&take(&rows.rotor_speed, lane));
        State {
            position: In::new(Vector3::from(take(&rows.position, lane))),
            velocity: In::new(Vector3::from(take(&rows.velocity, lane))),
            attitude: Quaternion::new(w, x, y, z),
            omega: In::new(Vector3::from(take(&rows.omega, lane))),
            rotor_speed_rad_s,
        }
    }

    /// Motions of the first vehicles, one after the other, as [`super::Batch::write_states`] orders them.
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

    /// Targets of the rotors of the first vehicles from their commands, one vehicle after the other.
    pub(super) fn command(&mut self, commands: &[S], drives: &[Drive<S>]) {
        let is_late =
            self.extra.as_ref().is_some_and(|extra| extra.latency_steps.iter().any(|steps| *steps > 0));
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
                Some(extra) if extra.latency_steps[lane] > 0 => extra.send(lane, Command::Rotors(targets)),
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
