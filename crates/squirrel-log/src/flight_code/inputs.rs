//! The inputs of the flight code: recorded, and read back. A frame is rebuilt from the samples that
//! carry its time.

use super::{ESTIMATE, wide};
use crate::{Channel, FlightLog};
use squirrel_core::control::AttitudeThrust;
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::guidance::sensing::Obstacle;
use squirrel_core::nalgebra::{Quaternion, Unit, Vector3};
use squirrel_core::policy::PilotCommand;
use squirrel_core::stack::{Gnss, Imu, MAX_OBSTACLES, SensorFrame};

/// Sources that the flight code reads. `frame` has a sample for each step of the flight code.
pub const INPUT_SOURCES: [&str; 11] = [
    "frame",
    "imu",
    "imu_2",
    "attitude",
    "gnss",
    "baro",
    "magnetometer",
    "battery",
    "obstacle",
    "wing_force",
    "offboard",
];
/// Channel of `offboard`: what a [`PilotCommand`] holds.
const COMMAND: &str = "roll_rad_pitch_rad_thrust_n_wing";

/// Records what the flight code was given.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// Those of the last frame: a log has them where they change.
    obstacles: Vec<Obstacle>,
    /// The flight code estimates the attitude itself and does not look at that of a frame.
    estimates: bool,
}

impl Inputs {
    /// Of a flight code that estimates the attitude itself, or does not.
    pub fn new(estimates: bool) -> Self {
        Self { obstacles: Vec::new(), estimates }
    }

    /// Adds one frame at time `t`, s.
    pub fn record(&mut self, log: &mut FlightLog, t: f64, frame: &SensorFrame) {
        log.source_mut("frame").push(t, &[("time_us", &[frame.time_us as f64])]);
        for (source, imu) in [("imu", frame.imu), ("imu_2", frame.imu_2)] {
            let Some(imu) = imu else { continue };
            let omega = wide(&imu.omega.vector);
            let force = wide(&imu.specific_force.vector);
            log.source_mut(source)
                .push(t, &[("omega_body_rad_s", &omega), ("specific_force_body_m_s2", &force)]);
        }
        if let Some(attitude) = frame.attitude.filter(|_| !self.estimates) {
            log.source_mut("attitude")
                .push(t, &[("q_ned_from_body_wxyz", &attitude.wxyz().map(f64::from))]);
        }
        if let Some(gnss) = frame.gnss {
            let position = wide(&gnss.position.vector);
            let velocity = wide(&gnss.velocity.vector);
            log.source_mut("gnss")
                .push(t, &[("position_ned_m", &position), ("velocity_ned_m_s", &velocity)]);
        }
        if let Some(altitude) = frame.altitude_m {
            log.source_mut("baro").push(t, &[("altitude_m", &[f64::from(altitude)])]);
        }
        if let Some(field) = frame.magnetic {
            log.source_mut("magnetometer").push(t, &[("field_body_ut", &wide(&field.vector))]);
        }
        if frame.obstacles() != self.obstacles {
            self.obstacles = frame.obstacles().to_vec();
            // An id of -1 marks a place without an obstacle.
            let mut rows = [-1.0, 0.0, 0.0].repeat(MAX_OBSTACLES);
            for (row, o) in rows.chunks_exact_mut(3).zip(frame.obstacles()) {
                row.copy_from_slice(&[f64::from(o.id), f64::from(o.north_m), f64::from(o.east_m)]);
            }
            log.source_mut("obstacle").push(t, &[("id_north_m_east_m", &rows)]);
        }
        if let Some(force) = frame.wing_force {
            log.source_mut("wing_force").push(t, &[("as_if_spread_ned_n", &wide(&force.vector))]);
        }
        if let Some(PilotCommand { attitude: a, wing }) = frame.command {
            let numbers = [a.roll_rad, a.pitch_rad, a.thrust_n, wing].map(f64::from);
            log.source_mut("offboard").push(t, &[(COMMAND, &numbers)]);
        }
    }
}

/// Why a log's inputs cannot be flown again.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InputError {
    /// Not recorded by this flight code.
    #[error("frame.time_us: missing; the log was not recorded by this flight code")]
    Foreign,
    /// A channel of another shape.
    #[error("{channel}: has {found} numbers a sample, must have {must}")]
    Width {
        /// Its name.
        channel: String,
        /// Numbers a sample in the log.
        found: usize,
        /// Numbers a sample that a frame has.
        must: usize,
    },
    /// Of two channels that go together one is there.
    #[error("{missing}: missing, but there is {present}")]
    Half {
        /// The other.
        missing: &'static str,
        /// The one.
        present: &'static str,
    },
    /// A sample between two steps.
    #[error("an input at {time_s:.6} s belongs to no step of the flight code")]
    NoStep {
        /// Its time.
        time_s: f64,
    },
}

/// Walks one input source in step with the frames.
struct Cursor<'a> {
    time_s: &'a [f64],
    next: usize,
}

impl Cursor<'_> {
    /// Index of the sample with exactly this time.
    fn at(&mut self, t: f64) -> Option<usize> {
        let found = self.time_s.get(self.next).is_some_and(|x| *x == t);
        self.next += usize::from(found);
        found.then(|| self.next - 1)
    }
}

/// A quaternion, w x y z, whatever its length: to judge it is the flight code's business.
fn as_it_is(row: &[f64]) -> Rotation<Ned, Body, f32> {
    let q = Quaternion::new(row[0] as f32, row[1] as f32, row[2] as f32, row[3] as f32);
    Rotation::new(Unit::new_unchecked(q))
}

/// The number that a channel of one number a sample has at exactly this time.
fn scalar(channel: &mut Option<(Cursor<'_>, &Channel)>, t: f64) -> Option<f32> {
    let (cursor, channel) = channel.as_mut()?;
    cursor.at(t).map(|i| channel.row(i)[0] as f32)
}

/// The frames that a log's flight code got, in order.
///
/// # Errors
/// A channel that a frame needs and the log lacks or holds in another shape.
pub fn frames(log: &FlightLog) -> Result<Vec<SensorFrame>, InputError> {
    Frames::new(log.sources.contains_key(ESTIMATE)).of(log)
}

/// Frames of a log that is read in pieces.
#[derive(Debug, Clone)]
pub struct Frames {
    /// Those of the last frame.
    obstacles: Vec<Obstacle>,
    estimates: bool,
}

impl Frames {
    /// Of a flight code that estimates the attitude itself, or does not.
    pub fn new(estimates: bool) -> Self {
        Self { obstacles: Vec::new(), estimates }
    }

    /// The frames of the next piece, which has all samples of its steps.
    ///
    /// # Errors
    /// As [`frames`].
    pub fn of(&mut self, log: &FlightLog) -> Result<Vec<SensorFrame>, InputError> {
        frames_of(log, self)
    }
}

fn frames_of(log: &FlightLog, before: &mut Frames) -> Result<Vec<SensorFrame>, InputError> {
    let channel = |name: &str, width: usize| match log.channel(name) {
        None => Ok(None),
        Some((_, c)) if c.width != width => {
            Err(InputError::Width { channel: name.to_owned(), found: c.width, must: width })
        }
        Some((time_s, c)) => Ok(Some((Cursor { time_s, next: 0 }, c))),
    };
    let Some((times, time_us)) = log.channel("frame.time_us") else {
        return Err(InputError::Foreign);
    };
    for (one, other) in [
        ("imu.omega_body_rad_s", "imu.specific_force_body_m_s2"),
        ("imu_2.omega_body_rad_s", "imu_2.specific_force_body_m_s2"),
        ("gnss.position_ned_m", "gnss.velocity_ned_m_s"),
    ] {
        if log.channel(one).is_some() && log.channel(other).is_none() {
            return Err(InputError::Half { missing: other, present: one });
        }
    }
    let mut imu = channel("imu.omega_body_rad_s", 3)?;
    let force = channel("imu.specific_force_body_m_s2", 3)?;
    let mut imu_2 = channel("imu_2.omega_body_rad_s", 3)?;
    let force_2 = channel("imu_2.specific_force_body_m_s2", 3)?;
    // Where the flight code estimates, an attitude in the log is its own.
    let attitude_name = (!before.estimates).then_some("attitude.q_ned_from_body_wxyz");
    let mut attitude = attitude_name.map_or(Ok(None), |name| channel(name, 4))?;
    let mut gnss = channel("gnss.position_ned_m", 3)?;
    let velocity = channel("gnss.velocity_ned_m_s", 3)?;
    let mut baro = channel("baro.altitude_m", 1)?;
    let mut magnetic = channel("magnetometer.field_body_ut", 3)?;
    let mut voltage = channel("battery.voltage_v", 1)?;
    let mut obstacle = channel("obstacle.id_north_m_east_m", 3 * MAX_OBSTACLES)?;
    let mut wing_force = channel("wing_force.as_if_spread_ned_n", 3)?;
    let mut command = channel(&format!("offboard.{COMMAND}"), 4)?;

    let narrow = |row: &[f64]| Vector3::new(row[0] as f32, row[1] as f32, row[2] as f32);
    let obstacles = &mut before.obstacles;
    let mut all = Vec::with_capacity(times.len());
    for (t, us) in times.iter().zip(&time_us.values) {
        let mut frame = SensorFrame::empty(*us as u64);
        for (imu, force, place) in
            [(&mut imu, &force, &mut frame.imu), (&mut imu_2, &force_2, &mut frame.imu_2)]
        {
            let Some((cursor, omega)) = imu else { continue };
            let Some(i) = cursor.at(*t) else { continue };
            let force = force.as_ref().map_or(Vector3::zeros(), |(_, c)| narrow(c.row(i)));
            *place =
                Some(Imu { omega: In::new(narrow(omega.row(i))), specific_force: In::new(force) });
        }
        if let Some((cursor, q)) = &mut attitude
            && let Some(i) = cursor.at(*t)
        {
            frame.attitude = Some(as_it_is(q.row(i)));
        }
        if let Some((cursor, position)) = &mut gnss
            && let Some(i) = cursor.at(*t)
        {
            let velocity = velocity.as_ref().map_or(Vector3::zeros(), |(_, c)| narrow(c.row(i)));
            frame.gnss = Some(Gnss {
                position: In::new(narrow(position.row(i))),
                velocity: In::new(velocity),
            });
        }
        frame.altitude_m = scalar(&mut baro, *t);
        frame.battery_v = scalar(&mut voltage, *t);
        if let Some((cursor, field)) = &mut magnetic
            && let Some(i) = cursor.at(*t)
        {
            frame.magnetic = Some(In::new(narrow(field.row(i))));
        }
        if let Some((cursor, rows)) = &mut obstacle
            && let Some(i) = cursor.at(*t)
        {
            let present = rows.row(i).chunks_exact(3).filter(|r| r[0] >= 0.0);
            *obstacles = present
                .map(|r| Obstacle { id: r[0] as u32, north_m: r[1] as f32, east_m: r[2] as f32 })
                .collect();
        }
        frame.set_obstacles(obstacles);
        if let Some((cursor, force)) = &mut wing_force
            && let Some(i) = cursor.at(*t)
        {
            frame.wing_force = Some(In::new(narrow(force.row(i))));
        }
        if let Some((cursor, numbers)) = &mut command
            && let Some(i) = cursor.at(*t)
        {
            let row = numbers.row(i);
            let [roll_rad, pitch_rad, thrust_n, wing] = std::array::from_fn(|k| row[k] as f32);
            let attitude = AttitudeThrust { roll_rad, pitch_rad, thrust_n };
            frame.command = Some(PilotCommand { attitude, wing });
        }
        all.push(frame);
    }
    let cursors = [
        &imu,
        &imu_2,
        &attitude,
        &gnss,
        &baro,
        &magnetic,
        &voltage,
        &obstacle,
        &wing_force,
        &command,
    ];
    for (cursor, _) in cursors.into_iter().flatten() {
        if let Some(t) = cursor.time_s.get(cursor.next) {
            return Err(InputError::NoStep { time_s: *t });
        }
    }
    Ok(all)
}
