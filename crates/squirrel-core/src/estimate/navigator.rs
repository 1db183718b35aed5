//! From raw sensors to what control is told: the units vote, the filter that the vehicle file chose
//! listens, and what is doubted is said.
//!
//! ```text
//! frame -> voter -> filter -> frame with attitude, rate without bias, position and velocity
//! ```
//! Filters without a motion of their own leave position and velocity to the receiver and height to
//! [`super::altitude`]. With [`Filter::External`] somebody else estimates, and frames pass as they
//! are but for the vote.

use super::altitude::{AltitudeFilter, AltitudeParameters};
use super::eskf::{AidFaults, Eskf, EskfParameters};
use super::mahony::{Mahony, MahonyParameters};
use super::mekf::{Mekf, MekfParameters};
use super::rkf::{Rkf, RkfParameters};
use super::voting::Voter;
use super::{Estimate, Estimator, STEP_MAX_S, Sensed};
use crate::frame::{Gnss, Imu, SensorFrame};
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::{GRAVITY_M_S2, lower};
use crate::vehicle::{ParameterError, not_negative, positive};
use nalgebra::Vector3;

/// Without a believed fix for so long, s, nobody knows any more where the vehicle is.
pub const LOST_S: f32 = 3.0;
/// Without one, or a word of barometer or compass, for so long, s, that sensor is not well.
const SILENT_S: f32 = 0.5;
/// Identical fixes after which a receiver hangs, if the filter does not believe them.
const HANGS: u8 = 3;

/// Who estimates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filter {
    /// Somebody outside: the frame's attitude, and its fixes as they are.
    External,
    /// Direction of gravity, the paper's.
    Rkf(RkfParameters),
    /// Complementary filter.
    Mahony(MahonyParameters),
    /// Attitude and gyro bias.
    Mekf(MekfParameters),
    /// Fifteen states, the default.
    Eskf(EskfParameters),
}

/// What a second at rest before the flight left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Attitude.
    pub ned_from_body: Rotation<Ned, Body, f32>,
    /// Mean bias of the units' gyros, rad/s.
    pub gyro_bias: In<Body, f32>,
    /// Where it stands in the mission's frame, m.
    pub position: In<Ned, f32>,
    /// What fixes there were more than that, m: the receiver's slow error, taken off every fix.
    pub fix_offset: In<Ned, f32>,
    /// What the barometer read there more than its height, m.
    pub altitude_offset_m: f32,
}

impl Start {
    /// Level at the origin, looking north, with sensors that have no error.
    pub fn at_origin() -> Self {
        Self {
            ned_from_body: Rotation::identity(),
            gyro_bias: In::zero(),
            position: In::zero(),
            fix_offset: In::zero(),
            altitude_offset_m: 0.0,
        }
    }
}

/// What a vehicle file chose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Navigation {
    /// Filter.
    pub filter: Filter,
    /// Height, for filters without a motion of their own.
    pub altitude: AltitudeParameters,
    /// Where the flight begins.
    pub start: Start,
}

/// Sensors and pushers that are not what they should be; a bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Health(pub u16);

impl Health {
    /// The first inertial unit is left out.
    pub const IMU_1_OUT: Self = Self(1);
    /// The second inertial unit is left out.
    pub const IMU_2_OUT: Self = Self(1 << 1);
    /// A measurement was no number, or larger than any flight.
    pub const NOT_A_READING: Self = Self(1 << 2);
    /// No fix for half a second, or fixes that contradict the rest.
    pub const GNSS_OUT: Self = Self(1 << 3);
    /// The barometer is silent or contradicts the rest.
    pub const BARO_OUT: Self = Self(1 << 4);
    /// The compass is silent or contradicts the rest.
    pub const COMPASS_OUT: Self = Self(1 << 5);
    /// Nobody knows any more where the vehicle is.
    pub const POSITION_LOST: Self = Self(1 << 6);
    /// The rotors carry less than they were told to.
    pub const THRUST_SHORT: Self = Self(1 << 7);
    /// Something turns the vehicle that the rotors have to hold against.
    pub const TORQUE_OFF: Self = Self(1 << 8);

    /// It hangs further over than any command asks for.
    pub const UPSET: Self = Self(1 << 9);

    /// The filter started anew at some time in this flight: fixes contradicted it for long, or its
    /// biases or its covariance were impossible.
    pub const RESTARTED: Self = Self(1 << 10);
    /// It is far below its reference with all the thrust that may be asked for, whatever the reason.
    pub const SUNK: Self = Self(1 << 11);

    /// Name of each bit, from the lowest.
    pub const NAMES: [&str; 12] = [
        "imu_1_out",
        "imu_2_out",
        "not_a_reading",
        "gnss_out",
        "baro_out",
        "compass_out",
        "position_lost",
        "thrust_short",
        "torque_off",
        "upset",
        "restarted",
        "sunk",
    ];

    /// Whether all of another's bits are set.
    #[must_use]
    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// With another's bits set, too, where `is` says so.
    #[must_use]
    pub(crate) fn with(self, other: Self, is: bool) -> Self {
        if is { Self(self.0 | other.0) } else { self }
    }
}

/// What is believed in a step, for the log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NavigationTerms {
    /// Attitude.
    pub ned_from_body: Rotation<Ned, Body, f32>,
    /// Bias of the gyro, rad/s.
    pub gyro_bias: In<Body, f32>,
    /// Position, m.
    pub position: In<Ned, f32>,
    /// Velocity, m/s.
    pub velocity: In<Ned, f32>,
}

/// The filter that listens.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(clippy::large_enum_variant, reason = "no heap, and there is one in a vehicle")]
enum Running {
    #[default]
    None,
    Rkf(Rkf),
    Mahony(Mahony),
    Mekf(Mekf),
    Eskf(Eskf),
}

impl Running {
    fn of(navigation: &Navigation) -> Self {
        let Start { ned_from_body, gyro_bias, position, .. } = navigation.start;
        match navigation.filter {
            Filter::External => Self::None,
            Filter::Rkf(p) => Self::Rkf(Rkf::new(p, ned_from_body, gyro_bias)),
            Filter::Mahony(p) => Self::Mahony(Mahony::new(p, ned_from_body, gyro_bias)),
            Filter::Mekf(p) => Self::Mekf(Mekf::new(p, ned_from_body, gyro_bias)),
            Filter::Eskf(p) => {
                Self::Eskf(Eskf::new(p, ned_from_body, gyro_bias).placed_at(position))
            }
        }
    }

    /// A step of the filter that listens, and what it believes then. Calls by name, for one through
    /// a pointer has no known stack.
    fn step(&mut self, sensed: &Sensed) -> Option<Estimate> {
        // Apart, so that the stack of one is not also that of the others.
        #[inline(never)]
        fn of(filter: &mut impl Estimator, sensed: &Sensed) -> Estimate {
            filter.step(sensed);
            filter.estimate()
        }
        Some(match self {
            Self::None => return None,
            Self::Rkf(filter) => of(filter, sensed),
            Self::Mahony(filter) => of(filter, sensed),
            Self::Mekf(filter) => of(filter, sensed),
            Self::Eskf(filter) => of(filter, sensed),
        })
    }
}

/// What came since the last inertial measurement, and waits for the next.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Waiting {
    dt_s: f32,
    gnss: Option<Gnss>,
    altitude_m: Option<f32>,
    magnetic: Option<In<Body, f32>>,
}

/// Everything of the estimate that changes in flight.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NavigationState {
    pub(crate) voter: Voter,
    running: Running,
    altitude: Option<AltitudeFilter>,
    waiting: Waiting,
    fix: Option<Gnss>,
    fix_age_s: f32,
    /// Fixes in a row that were the same, bit for bit.
    fix_repeats: u8,
    /// Since barometer and compass last spoke, s; `None` before they did.
    silent_s: [Option<f32>; 2],
    /// The inertial units repeat themselves.
    pub(crate) imu_hangs: bool,
    /// Vertical velocity, m/s, down, where it is known.
    pub(crate) descent_m_s: Option<f32>,
    /// Of the step.
    pub(crate) health: Health,
}

impl NavigationState {
    /// The default filter, where it is the one that listens.
    pub fn eskf(&self) -> Option<&Eskf> {
        if let Running::Eskf(filter) = &self.running { Some(filter) } else { None }
    }
}

/// A step of navigation: the frame that control gets, and what is logged of it.
#[derive(Debug, Clone, Copy)]
pub struct Navigated {
    /// The step's frame, estimated.
    pub frame: SensorFrame,
    pub(crate) terms: Option<NavigationTerms>,
    /// Measurements that were no numbers.
    pub(crate) rejected: u32,
    /// Since the frame before, us.
    pub(crate) elapsed_us: u32,
}

impl Navigation {
    /// Somebody outside estimates.
    pub fn external() -> Self {
        Self {
            filter: Filter::External,
            altitude: AltitudeParameters::default(),
            start: Start::at_origin(),
        }
    }

    /// # Errors
    /// The first number that cannot be used, with its field.
    pub fn check(&self) -> Result<(), ParameterError> {
        if !(self.start.gyro_bias.vector.norm() <= 1.0) {
            let size = self.start.gyro_bias.vector.norm();
            return Err(ParameterError::of(
                "estimation.start.gyro_bias_rad_s",
                size,
                "must be at most 1",
            ));
        }
        let far = self.start.position.vector + self.start.fix_offset.vector;
        if !(far.norm() + self.start.altitude_offset_m.abs() <= 1e5) {
            return Err(ParameterError::of(
                "estimation.start.position_ned_m",
                far.norm(),
                "must be within 1e5",
            ));
        }
        let turn = self.start.ned_from_body.quaternion.norm_squared();
        if !((turn - 1.0).abs() < 1e-3) {
            return Err(ParameterError::of(
                "estimation.start.ned_from_body",
                turn,
                "must be of length 1",
            ));
        }
        positive("estimation.altitude.accel_noise_m_s2", self.altitude.accel_noise_m_s2)?;
        positive("estimation.altitude.baro_noise_m", self.altitude.baro_noise_m)?;
        not_negative(
            "estimation.altitude.bias_walk_m_s2_root_s",
            self.altitude.bias_walk_m_s2_root_s,
        )?;
        match self.filter {
            Filter::External => Ok(()),
            Filter::Rkf(p) => {
                positive("estimation.rkf.gyro_noise_rad_s", p.gyro_noise_rad_s)?;
                not_negative("estimation.rkf.external_memory", p.external_memory)?;
                positive("estimation.rkf.accel_noise_m_s2", p.accel_noise_m_s2)
            }
            Filter::Mahony(p) => {
                not_negative("estimation.mahony.integral_per_s2", p.integral_per_s2)?;
                not_negative("estimation.mahony.gate_m_s2", p.gate_m_s2)?;
                positive("estimation.mahony.proportional_per_s", p.proportional_per_s)
            }
            Filter::Mekf(p) => {
                positive("estimation.mekf.gyro_noise_rad_s", p.gyro_noise_rad_s)?;
                not_negative("estimation.mekf.bias_walk_rad_s_root_s", p.bias_walk_rad_s_root_s)?;
                positive("estimation.mekf.bias_deviation_rad_s", p.bias_deviation_rad_s)?;
                positive("estimation.mekf.alone_noise_m_s2", p.alone_noise_m_s2)?;
                not_negative("estimation.mekf.gate_m_s2", p.gate_m_s2)?;
                positive("estimation.mekf.heading_noise_rad", p.heading_noise_rad)?;
                positive("estimation.mekf.fix_noise_m_s2", p.fix_noise_m_s2)
            }
            Filter::Eskf(p) => {
                positive("estimation.eskf.gyro_noise_rad_s", p.gyro_noise_rad_s)?;
                positive("estimation.eskf.accel_noise_m_s2", p.accel_noise_m_s2)?;
                not_negative("estimation.eskf.gyro_walk_rad_s_root_s", p.gyro_walk_rad_s_root_s)?;
                not_negative("estimation.eskf.accel_walk_m_s2_root_s", p.accel_walk_m_s2_root_s)?;
                positive("estimation.eskf.start_turn_rad", p.start_turn_rad)?;
                positive("estimation.eskf.start_heading_rad", p.start_heading_rad)?;
                positive("estimation.eskf.start_gyro_bias_rad_s", p.start_gyro_bias_rad_s)?;
                positive("estimation.eskf.start_accel_bias_m_s2", p.start_accel_bias_m_s2)?;
                positive("estimation.eskf.alone_noise_m_s2", p.alone_noise_m_s2)?;
                positive("estimation.eskf.gnss_position_noise_m", p.gnss_position_noise_m)?;
                positive("estimation.eskf.gnss_velocity_noise_m_s", p.gnss_velocity_noise_m_s)?;
                positive("estimation.eskf.baro_noise_m", p.baro_noise_m)?;
                positive("estimation.eskf.heading_noise_rad", p.heading_noise_rad)?;
                positive("estimation.eskf.gate", p.gate)?;
                if !(0.0..=0.3).contains(&p.gnss_latency_s) {
                    let reason = "must be 0 to 0.3";
                    return Err(ParameterError::of(
                        "estimation.eskf.gnss_latency_s",
                        p.gnss_latency_s,
                        reason,
                    ));
                }
                Ok(())
            }
        }
    }

    /// Hears a frame.
    ///
    /// * `elapsed_us` - since the frame before; 0 for the first
    pub(crate) fn step(
        &self,
        state: &mut NavigationState,
        frame: &SensorFrame,
        elapsed_us: u32,
    ) -> Navigated {
        let mut for_control = *frame;
        let rejected = for_control.drop_what_is_no_reading();
        for_control.imu = state.voter.vote([for_control.imu, for_control.imu_2], elapsed_us);
        for_control.imu_2 = None;
        let [first, second] = state.voter.left_out();
        state.imu_hangs = state.voter.hangs();
        let health = Health::default()
            .with(Health::IMU_1_OUT, first)
            .with(Health::IMU_2_OUT, second)
            .with(Health::NOT_A_READING, rejected > 0);
        state.health = health;
        if self.filter == Filter::External {
            // Control rejects and counts by itself.
            let mut as_it_was = *frame;
            as_it_was.imu = for_control.imu.or(frame.imu);
            return Navigated { frame: as_it_was, terms: None, rejected: 0, elapsed_us };
        }
        if matches!(state.running, Running::None) {
            self.begin(state);
        }
        if let Some(fix) = &mut for_control.gnss {
            fix.position = fix.position - self.start.fix_offset;
        }
        for_control.altitude_m =
            for_control.altitude_m.map(|altitude| altitude - self.start.altitude_offset_m);
        let dt_s = elapsed_us as f32 * 1e-6;
        let waiting = &mut state.waiting;
        waiting.dt_s = lower(waiting.dt_s + dt_s, STEP_MAX_S);
        if let Some(fix) = &for_control.gnss {
            let again = state.fix.as_ref() == Some(fix);
            state.fix_repeats = if again { state.fix_repeats.saturating_add(1) } else { 0 };
            // A receiver that hangs would be believed in the end, were it heard.
            let is_faulty =
                matches!(&state.running, Running::Eskf(filter) if filter.aid_faults().gnss);
            if state.fix_repeats >= HANGS && is_faulty {
                for_control.gnss = None;
            }
        }
        let [baro, compass] = &mut state.silent_s;
        for (silent_s, spoke) in
            [(baro, for_control.altitude_m.is_some()), (compass, for_control.magnetic.is_some())]
        {
            *silent_s = if spoke { Some(0.0) } else { silent_s.map(|s| lower(s + dt_s, 1e6)) };
        }
        waiting.gnss = for_control.gnss.or(waiting.gnss);
        waiting.altitude_m = for_control.altitude_m.or(waiting.altitude_m);
        waiting.magnetic = for_control.magnetic.or(waiting.magnetic);
        state.fix_age_s =
            if for_control.gnss.is_some() { 0.0 } else { lower(state.fix_age_s + dt_s, 1e6) };
        state.fix = for_control.gnss.or(state.fix);
        for_control.attitude = None;
        let Some(imu) = for_control.imu else {
            return Navigated {
                frame: for_control.without_motion(),
                terms: None,
                rejected,
                elapsed_us,
            };
        };
        let Some(terms) = self.hear(state, &imu) else {
            return Navigated {
                frame: for_control.without_motion(),
                terms: None,
                rejected,
                elapsed_us,
            };
        };
        for_control.imu = Some(Imu { omega: imu.omega - terms.gyro_bias, ..imu });
        for_control.attitude = Some(terms.ned_from_body);
        for_control.altitude_m = None;
        for_control.gnss = Some(Gnss { position: terms.position, velocity: terms.velocity })
            .filter(|_| !state.health.has(Health::POSITION_LOST));
        Navigated { frame: for_control, terms: Some(terms), rejected, elapsed_us }
    }

    /// A filter from the start. Apart, because it is built on the stack, and once in a flight.
    #[cold]
    #[inline(never)]
    fn begin(&self, state: &mut NavigationState) {
        state.running = Running::of(self);
        state.fix = Some(Gnss { position: self.start.position, velocity: In::zero() });
    }

    /// Runs the filter on an inertial measurement and what waited for it.
    fn hear(&self, state: &mut NavigationState, imu: &Imu) -> Option<NavigationTerms> {
        let Waiting { dt_s, gnss, altitude_m, magnetic } = core::mem::take(&mut state.waiting);
        let estimate =
            state.running.step(&Sensed { dt_s, imu: *imu, gnss, altitude_m, magnetic })?;
        let (position, velocity, aid_faults, time_since_fix_s) =
            if let (Some((position, velocity)), Running::Eskf(filter)) =
                (estimate.motion, &state.running)
            {
                (position, velocity, filter.aid_faults(), filter.time_since_fix_s())
            } else {
                let force = estimate.ned_from_body * imu.specific_force;
                let height = state.altitude.get_or_insert_with(|| {
                    AltitudeFilter::new(self.altitude, -self.start.position.vector.z)
                });
                height.step(force.vector.z + GRAVITY_M_S2 as f32, altitude_m, dt_s);
                let fix = state.fix.unwrap_or(Gnss { position: In::zero(), velocity: In::zero() });
                let (mut position, mut velocity) = (fix.position, fix.velocity);
                position.vector.z = -height.altitude_m();
                velocity.vector.z = -height.climb_m_s();
                (position, velocity, AidFaults::default(), state.fix_age_s)
            };
        // Where the filter leaves the numbers, control is told nothing.
        let all: Vector3<f32> = position.vector + velocity.vector + estimate.gyro_bias.vector;
        if !(crate::math::all_finite(&all)
            && estimate.ned_from_body.quaternion.norm_squared().is_finite())
        {
            state.running = Running::None;
            state.altitude = None;
            return None;
        }
        state.descent_m_s = Some(velocity.vector.z);
        let is_silent = time_since_fix_s > SILENT_S;
        let [baro_is_silent, compass_is_silent] =
            state.silent_s.map(|silent_s| silent_s.is_some_and(|s| s > SILENT_S));
        state.health = state
            .health
            .with(Health::GNSS_OUT, aid_faults.gnss || is_silent)
            .with(
                Health::RESTARTED,
                matches!(&state.running, Running::Eskf(filter) if filter.restarts() > 0),
            )
            .with(Health::BARO_OUT, aid_faults.baro || baro_is_silent)
            .with(Health::COMPASS_OUT, aid_faults.compass || compass_is_silent)
            .with(Health::POSITION_LOST, time_since_fix_s > LOST_S);
        Some(NavigationTerms {
            ned_from_body: estimate.ned_from_body,
            gyro_bias: estimate.gyro_bias,
            position,
            velocity,
        })
    }
}
