//! Specific force and angular rates of a flight: of the IMU, or of what else a log has.
//!
//! | what is logged | specific force |
//! |---|---|
//! | `imu.specific_force_body_m_s2` | itself |
//! | `imu.acceleration_ned_m_s2`, attitude | `R^T (a - g)`: an accelerometer that a flight controller has turned into the world |
//! | position or velocity, attitude | differences behind a low-pass ([`smoother`](super::smoother)) |
//!
//! Where roll and yaw are logged and pitch is not, pitch is where thrust must point for the vehicle
//! to move as it did, which is what estimators that know no drag believe: `tan(pitch) = a_x / a_z`
//! of `a = v' - g`, along the heading.
//!
//! Where yaw is missing, too, the vehicle is taken to have held one heading ([`heading`]), and only
//! what lasts is looked at.
//!
//! Rates are the gyroscope's, or differences of the attitude. One corner serves forces and moments
//! of all flights that are looked at together, the lowest that one of them needs, so that their
//! residuals are alike.

use super::filter::CUTOFF_HZ;
use super::heading::{self, Held};
use super::series::{Series, common};
use super::smoother::{self, Differences};
use crate::GapError;
use crate::number::significant;
use nalgebra::{UnitQuaternion, Vector3};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_log::FlightLog;

const FORCE: &str = "imu.specific_force_body_m_s2";
const RATES: &str = "imu.omega_body_rad_s";
pub(super) const ATTITUDE: &str = "attitude.q_ned_from_body_wxyz";
const ROLL: &str = "attitude.roll_rad";
const PITCH: &str = "attitude.pitch_rad";
const YAW: &str = "attitude.yaw_rad";
pub(super) const VELOCITY: &str = "gnss.velocity_ned_m_s";
pub(super) const POSITION: &str = "gnss.position_ned_m";
pub(super) const ROTOR_SPEED: &str = "rotor.speed_rad_s";
/// Metadata that only flights of the simulator have.
const SIMULATED: &str = "scenario_toml";
/// Samples of rotor speeds to a period of the corner, at least.
const SPEEDS_OF_CUTOFF: f64 = 4.0;
/// Accelerometer in the world less gravity.
const TURNED: &str = "imu.acceleration_ned_m_s2";

/// What a log says of the motion, and what the rest can be had from.
pub(crate) struct Sources {
    force: Option<Series>,
    rates: Option<Series>,
    pub(super) attitude: Option<Series>,
    pub(super) velocity: Option<Series>,
    pub(super) position: Option<Series>,
    pub(super) differences: Derived,
}

/// What was differentiated, for want of an IMU.
#[derive(Debug, Clone, Default)]
pub(crate) struct Derived {
    pub(crate) force: Option<Differences>,
    pub(crate) rates: Option<Differences>,
    /// What pitch comes from.
    pub(crate) pitch: Option<Differences>,
    /// The heading that stands in for yaw.
    pub(crate) heading: Option<Held>,
    /// The accelerometer was turned into the world by an estimate that used it.
    pub(crate) turned: bool,
    /// What the noise of attitudes makes of gravity, m/s^2, one standard deviation of a sample of
    /// the force.
    pub(crate) lean: Vector3<f64>,
}

/// Forces and rates, whatever they come from.
pub(crate) struct Inertial {
    pub(crate) force: Series,
    pub(crate) rates: Series,
    pub(crate) velocity: Option<Series>,
    pub(crate) notes: Vec<String>,
}

impl Sources {
    /// # Errors
    /// [`GapError`]: nothing that forces or rates could be had from, or a channel that cannot be.
    pub(crate) fn read(flight: &str, log: &FlightLog) -> Result<Self, GapError> {
        let optional = |channel, width| Series::read(flight, log, channel, width);
        let (velocity, position) = (optional(VELOCITY, 3)?, optional(POSITION, 3)?);
        let neither =
            |channel, instead| GapError::Neither { flight: flight.to_owned(), channel, instead };
        let mut differences = Derived::default();
        let mut attitude = optional(ATTITUDE, 4)?;
        if let Some(attitude) = &attitude {
            attitude.check_rotations(flight)?;
        } else if let Some(roll) = optional(ROLL, 1)? {
            let logged_pitch = optional(PITCH, 1)?;
            let from = match &velocity {
                Some(velocity) => smoother::force_source(flight, None, Some(velocity))?,
                None => None,
            };
            // Twice the corner of forces: what passes them is hardly touched.
            let accelerations = from.as_ref().zip(velocity.as_ref()).map(|(from, velocity)| {
                smoother::accelerations(from, velocity, CUTOFF_HZ.min(2.0 * from.cutoff_hz))
            });
            let mut yaw = optional(YAW, 1)?;
            // An accelerometer of the body needs no heading.
            if yaw.is_none() && log.channel(FORCE).is_none() {
                differences.heading = accelerations.as_ref().and_then(|a| heading::held(&roll, a));
                yaw = differences.heading.and_then(|held| held_all_along(held, &roll));
            }
            if let Some(yaw) = yaw {
                let pitch = logged_pitch.or_else(|| {
                    differences.pitch = from;
                    accelerations.and_then(|accelerations| pitch_of_thrust(&accelerations, &yaw))
                });
                let pitch = pitch.ok_or_else(|| {
                    neither(ATTITUDE, "attitude.pitch_rad or gnss.velocity_ned_m_s")
                })?;
                attitude = of_angles(&roll, &pitch, &yaw);
            }
        }
        let mut force = optional(FORCE, 3)?;
        if force.is_none() {
            let instead = "gnss.position_ned_m, gnss.velocity_ned_m_s or imu.acceleration_ned_m_s2 \
                with attitude.q_ned_from_body_wxyz";
            let turned = optional(TURNED, 3)?;
            let attitude = attitude.as_ref().ok_or_else(|| neither(FORCE, instead))?;
            if let Some(turned) = turned {
                force = turned_back(&turned, attitude);
                differences.turned = force.is_some();
            }
            if force.is_none() {
                let from = smoother::force_source(flight, position.as_ref(), velocity.as_ref())?;
                let from = from.ok_or_else(|| neither(FORCE, instead))?;
                let more = (attitude.median_period_s() / from.period_s()).sqrt();
                let tilt = smoother::attitude_white(attitude) * (GRAVITY_M_S2 * more);
                differences.lean = Vector3::new(tilt.y, tilt.x, 0.0);
                differences.force = Some(from);
            }
        }
        let rates = optional(RATES, 3)?;
        if rates.is_none() {
            let attitude = attitude.as_ref().ok_or_else(|| neither(RATES, ATTITUDE))?;
            let mut from = smoother::rate_source(flight, attitude)?;
            if let Some(pitch) = &differences.pitch {
                from.add_noise(&pitch.leaning(from.period_s()));
            }
            differences.rates = Some(from);
        }
        Ok(Self { force, rates, attitude, velocity, position, differences })
    }

    /// Highest corner at which there is more motion than noise, Hz.
    pub(crate) fn cutoff_hz(&self) -> f64 {
        let all = [&self.differences.force, &self.differences.rates, &self.differences.pitch];
        all.into_iter().flatten().map(|d| d.cutoff_hz).fold(CUTOFF_HZ, f64::min)
    }

    /// Forces and rates behind a corner.
    pub(super) fn inertial(&mut self, flight: &str, cutoff_hz: f64) -> Result<Inertial, GapError> {
        let corner = significant(cutoff_hz, 2);
        let short = |channel| GapError::TooShort {
            flight: flight.to_owned(),
            channel,
            usable_s: 0.0,
            least_s: 1.0,
            cut: String::new(),
        };
        let (mut notes, mut velocity) = (Vec::new(), None);
        if let Some(held) = self.differences.heading {
            let [heading, sd] =
                [held.heading_rad, held.sd_rad].map(|x| significant(x.to_degrees(), 2));
            notes.push(format!(
                "{flight}: {YAW}: missing; the vehicle is taken to have held one heading, {heading} deg (sd {sd}), at which its roll makes its acceleration; what is quick about z cannot be judged"
            ));
        }
        if self.differences.pitch.is_some() {
            notes.push(format!(
                "{flight}: {ATTITUDE}: missing; roll and heading are taken, pitch is where thrust must point for the logged velocity, below {corner} Hz"
            ));
        }
        if self.differences.turned {
            notes.push(format!(
                "{flight}: {FORCE}: missing; forces are those of {TURNED}, turned back by the attitude, below {corner} Hz"
            ));
        }
        let force = match (self.force.take(), &self.differences.force, &self.attitude) {
            (None, Some(from), Some(attitude)) => {
                let source = if from.channel == POSITION { &self.position } else { &self.velocity };
                let source = source.as_ref().ok_or_else(|| short(FORCE))?;
                let noise = significant(from.passed(cutoff_hz), 2);
                notes.push(format!(
                    "{flight}: {FORCE}: missing; forces are those of {} differentiated, below {corner} Hz, with noise of {noise} m/s^2",
                    from.channel
                ));
                if self.velocity.is_none() {
                    velocity = Series::computed(VELOCITY, 3, smoother::velocity(source, cutoff_hz));
                    notes.push(format!(
                        "{flight}: {VELOCITY}: missing; that of {POSITION} is taken"
                    ));
                }
                let rows = smoother::specific_force(from, source, attitude, cutoff_hz);
                Series::computed(FORCE, 3, rows).ok_or_else(|| short(from.channel))?
            }
            (force, ..) => force.ok_or_else(|| short(FORCE))?,
        };
        let rates = match (self.rates.take(), &self.differences.rates, &self.attitude) {
            (None, Some(from), Some(attitude)) => {
                let noise = significant(from.passed(cutoff_hz), 2);
                notes.push(format!(
                    "{flight}: {RATES}: missing; rates are those of {ATTITUDE}, below {corner} Hz, with noise of {noise} rad/s^2 in their derivative; faster moments cannot be judged"
                ));
                let rows = smoother::rates(from, attitude, cutoff_hz);
                Series::computed(RATES, 3, rows).ok_or_else(|| short(ATTITUDE))?
            }
            (rates, ..) => rates.ok_or_else(|| short(RATES))?,
        };
        Ok(Inertial { force, rates, velocity, notes })
    }
}

/// Measured rotor speeds. A flight of the simulator has those of its plant: they are truth, and no
/// sensor gave them.
pub(super) fn rotor_speed(
    flight: &str,
    log: &FlightLog,
    rotors: usize,
) -> Result<Option<Series>, GapError> {
    if log.metadata.contains_key(SIMULATED) {
        return Ok(None);
    }
    Series::read(flight, log, ROTOR_SPEED, rotors)
}

/// What is the same for all flights that are looked at together, so that their residuals are alike.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Common {
    /// Corner of the filter, the lowest that one of them needs, Hz.
    pub(crate) cutoff_hz: f64,
    /// Rotors turn as fast as was measured in every flight, whatever they were told.
    pub(crate) rotor_speeds: bool,
}

impl Common {
    /// # Errors
    /// As [`Sources::read`], or rotor speeds that cannot be.
    pub(crate) fn of(flights: &[(String, FlightLog)], rotors: usize) -> Result<Self, GapError> {
        let mut own = Self { cutoff_hz: CUTOFF_HZ, rotor_speeds: true };
        for (flight, log) in flights {
            own.cutoff_hz = own.cutoff_hz.min(Sources::read(flight, log)?.cutoff_hz());
        }
        for (flight, log) in flights {
            let speeds = rotor_speed(flight, log, rotors)?;
            let is_fast = |speeds: &Series| {
                1.0 / speeds.median_period_s() >= SPEEDS_OF_CUTOFF * own.cutoff_hz
            };
            own.rotor_speeds &= speeds.as_ref().is_some_and(is_fast);
        }
        Ok(own)
    }
}

/// Pitch, rad, at which thrust alone makes an acceleration along the heading.
fn pitch_of_thrust((time_s, accelerations): &(Vec<f64>, Vec<f64>), yaw: &Series) -> Option<Series> {
    let pitch = time_s.iter().zip(accelerations.chunks_exact(3)).map(|(t, a)| {
        let (sin, cos) = yaw.angle(*t).sin_cos();
        let (along, down) = (a[0] * cos + a[1] * sin, a[2] - GRAVITY_M_S2);
        (-along).atan2(-down)
    });
    let pitch = pitch.collect();
    Series::computed(PITCH, 1, (time_s.clone(), pitch))
}

/// One heading for as long as there is a roll.
fn held_all_along(held: Held, roll: &Series) -> Option<Series> {
    let spans = roll.spans();
    let (first, last) = (spans.first()?, spans.last()?);
    Series::computed(YAW, 1, (vec![first.0, last.1], vec![held.heading_rad; 2]))
}

/// The attitude at the times of the pitch at which the other angles exist.
fn of_angles(roll: &Series, pitch: &Series, yaw: &Series) -> Option<Series> {
    let exists = common(&roll.spans(), &yaw.spans());
    let inside = |t: f64| exists.iter().any(|span| (span.0..=span.1).contains(&t));
    let (mut time_s, mut values) = (Vec::new(), Vec::new());
    for (t, pitch) in pitch.samples().filter(|(t, _)| inside(*t)) {
        let yaw = yaw.angle(t);
        let q = UnitQuaternion::from_euler_angles(roll.number(t), pitch[0], yaw);
        time_s.push(t);
        values.extend([q.w, q.i, q.j, q.k]);
    }
    Series::computed(ATTITUDE, 4, (time_s, values))
}

/// What an accelerometer felt whose readings were turned into the world and lost gravity there.
fn turned_back(turned: &Series, attitude: &Series) -> Option<Series> {
    let gravity = Vector3::new(0.0, 0.0, GRAVITY_M_S2);
    let exists = attitude.spans();
    let (mut time_s, mut values) = (Vec::new(), Vec::new());
    for (t, row) in turned.samples() {
        if exists.iter().any(|span| (span.0..=span.1).contains(&t)) {
            let q = UnitQuaternion::new_normalize(attitude.rotation(t));
            let felt = q.inverse_transform_vector(&(Vector3::from_column_slice(row) - gravity));
            time_s.push(t);
            values.extend_from_slice(felt.as_slice());
        }
    }
    Series::computed(FORCE, 3, (time_s, values))
}
