//! What the residual needs of one flight: its channels, a uniform time grid, and the pieces of it
//! without gaps.

use super::density::passed_deviation;
use super::filter::{CUTOFF_HZ, DERIVATIVE_REACH, LowPass};
use super::ground;
use super::inertial::{self, ATTITUDE, Common, Derived, Inertial, ROTOR_SPEED, Sources, VELOCITY};
use super::series::{Series, Span, common};
use super::wings;
use crate::GapError;
use nalgebra::{Quaternion, Vector3};
use squirrel_core::dynamics::State;
use squirrel_core::effects::{BatterySag, Effect, Effects, Shown};
use squirrel_core::frames::In;
use squirrel_core::vehicle::{MAX_ROTORS, PerRotor};
use squirrel_log::FlightLog;
use squirrel_sim::plant::WingPlant;
use squirrel_sim::vehicle_file::VehicleFile;

/// Slowest IMU whose samples still describe what passes the filter, Hz.
const RATE_MIN_HZ: f64 = 4.0 * CUTOFF_HZ;
/// For so long a monitor of coarse steps may show a battery in flight without a change, s.
const STUCK_MIN_S: f64 = 10.0;
/// Longest step of the grid where there is no IMU: a model is asked as often, s.
const STEP_MAX_S: f64 = 0.01;
/// Shortest flight worth a number, s.
const USABLE_MIN_S: f64 = 1.0;

/// The channels of one flight.
pub(crate) struct Recording<'a> {
    pub(crate) flight: &'a str,
    /// Step of the grid: the median period of the IMU, or of what stands in for it, s.
    pub(crate) period_s: f64,
    /// Corner of the filter, Hz.
    pub(crate) cutoff_hz: f64,
    /// What forces and rates come from where the log has no IMU: they have passed the filter
    /// already.
    pub(crate) derived: Derived,
    pub(crate) filter: LowPass,
    /// Where every channel exists for longer than the filter has edges.
    pub(crate) pieces: Vec<Span>,
    /// White noise of the accelerometer, m/s^2, and of the gyroscope, rad/s, one standard
    /// deviation.
    pub(crate) imu_noise: [Vector3<f64>; 2],
    /// What the log lacks, and what was taken instead.
    pub(crate) notes: Vec<String>,
    pub(crate) rotor: Series,
    /// Measured rotor speeds, rad/s, where they are taken instead of commands.
    pub(crate) speed: Option<Series>,
    pub(crate) wing: Option<Series>,
    pub(crate) velocity: Option<Series>,
    pub(crate) position: Option<Series>,
    pub(crate) baro: Option<Series>,
    pub(super) specific_force: Series,
    pub(super) omega: Series,
    pub(super) attitude: Option<Series>,
    voltage: Option<Series>,
    reference_voltage_v: f64,
}

/// One measured sample on the grid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    /// Time in the flight, s.
    pub(crate) time_s: f64,
    /// Accelerometer, m/s^2, body frame.
    pub(crate) specific_force: Vector3<f64>,
    /// Measured velocity, attitude and angular rate; position and rotor speeds are not measured.
    pub(crate) body: State<f64>,
    /// Battery, V; the reference voltage where it is not logged or never changes.
    pub(crate) voltage_v: f64,
}

/// What is said where rotors turn as they were measured: effects that only commands show cannot be
/// seen.
fn taken_as_measured(flight: &str) -> String {
    let is_one = |name: &&&str| {
        Effects::<f64>::profile(name).is_some_and(|profile| profile.shown.has(Shown::COMMANDS))
    };
    let all: Vec<&str> = Effects::<f64>::NAMES.iter().filter(is_one).copied().collect();
    let all = match all.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => all.concat(),
    };
    format!(
        "{flight}: {ROTOR_SPEED}: measured, and taken instead of what commands make of it; {all} are not judged"
    )
}

impl<'a> Recording<'a> {
    /// * `common` - what the flight shares with those that are looked at together with it
    ///
    /// # Errors
    /// [`GapError`] with the first channel that is missing, cannot be, or leaves less than a
    /// second.
    pub(crate) fn new(
        vehicle: &VehicleFile,
        flight: &'a str,
        log: &FlightLog,
        common: Common,
    ) -> Result<Self, GapError> {
        let Common { cutoff_hz, rotor_speeds } = common;
        let parameters = vehicle.vehicle.parameters();
        let mut sources = Sources::read(flight, log)?;
        let rotor = Series::need(flight, log, "rotor.command", parameters.rotor_count).map_err(
            |e| match e {
                GapError::Width { flight, found, needed, .. } => GapError::Rotors {
                    flight,
                    log: found,
                    vehicle: vehicle.name.clone(),
                    rotors: needed,
                },
                other => other,
            },
        )?;
        let optional = |channel, width| Series::read(flight, log, channel, width);
        let logged_speed = inertial::rotor_speed(flight, log, parameters.rotor_count)?;
        let is_slow = logged_speed.is_some() && !rotor_speeds;
        let speed = logged_speed.filter(|_| rotor_speeds);
        let Inertial { force: specific_force, rates: omega, velocity, mut notes } =
            sources.inertial(flight, cutoff_hz)?;
        let Sources { attitude, velocity: logged, position, differences: derived, .. } = sources;
        let velocity = velocity.or(logged);
        let baro = optional("baro.altitude_m", 1)?;
        let voltage = optional("battery.voltage_v", 1)?;
        let long = voltage.as_ref().filter(|voltage| voltage.duration_s() >= STUCK_MIN_S);
        let stuck_at_v = long.and_then(Series::only_number);
        let voltage = voltage.filter(|_| stuck_at_v.is_none());
        let has_wings = vehicle.wing != WingPlant::None;
        let wing = if has_wings { optional("wing.command", 2)? } else { None };

        for (channel, series) in [(ATTITUDE, &attitude), (VELOCITY, &velocity)] {
            if series.is_none() {
                notes.push(format!(
                    "{flight}: {channel}: missing; drag is that of zero velocity over ground"
                ));
            }
        }
        if speed.is_some() {
            notes.push(taken_as_measured(flight));
        } else if is_slow {
            notes.push(format!(
                "{flight}: {ROTOR_SPEED}: not taken; it is too slow, or another flight lacks it"
            ));
        }
        if voltage.is_none() && speed.is_none() {
            let reference = parameters.propulsion.reference_voltage_v;
            // A battery that flies changes: a monitor that does not says nothing of it.
            let what = stuck_at_v.map_or_else(
                || "missing".to_owned(),
                |volt| format!("{volt} V in every sample, a monitor that is stuck"),
            );
            notes.push(if vehicle.effects.has(BatterySag::<f64>::NAME) {
                format!(
                    "{flight}: battery.voltage_v: {what}; battery_sag is that of the reference voltage, {reference} V"
                )
            } else {
                format!("{flight}: battery.voltage_v: {what}; thrust may be that of any charge")
            });
        }
        if baro.is_none() && position.is_none() {
            notes.push(format!(
                "{flight}: baro.altitude_m, gnss.position_ned_m: missing; what depends on height cannot be seen"
            ));
        }
        if has_wings && wing.is_none() {
            notes.push(format!("{flight}: wing.command: missing; the wings are taken as folded"));
        }

        let mut period_s = specific_force.median_period_s();
        if derived.force.is_some() {
            period_s = period_s.min(STEP_MAX_S);
        }
        let rate_hz = 1.0 / period_s;
        if rate_hz < RATE_MIN_HZ {
            let (flight, channel) = (flight.to_owned(), specific_force.channel);
            return Err(GapError::Rate { flight, channel, rate_hz, least_hz: RATE_MIN_HZ });
        }
        let imu_noise = noise_of(&derived, cutoff_hz, [&specific_force, &omega]);
        let mut recording = Self {
            flight,
            period_s,
            cutoff_hz,
            derived,
            imu_noise,
            filter: LowPass::new(rate_hz, cutoff_hz),
            pieces: vec![(f64::NEG_INFINITY, f64::INFINITY)],
            notes,
            rotor,
            speed,
            wing,
            velocity,
            position,
            baro,
            specific_force,
            omega,
            attitude,
            voltage,
            reference_voltage_v: parameters.propulsion.reference_voltage_v,
        };
        recording.pieces = recording.usable()?;
        let touches = ground::touches(&recording, Vector3::from(vehicle.size_body_m));
        if !touches.is_empty() {
            let free = ground::outside(&touches);
            recording.pieces =
                recording.usable_with(&recording.pieces, "time off the ground", &free)?;
            recording.notes.push(ground::note(flight, &touches));
        }
        recording.leave_out_open_wings()?;
        Ok(recording)
    }

    /// Leaves out time in which nobody knows what blows on open wings.
    fn leave_out_open_wings(&mut self) -> Result<(), GapError> {
        let open = self.wing.as_ref().map(wings::open).unwrap_or_default();
        if open.is_empty() || self.attitude.is_some() && self.velocity.is_some() {
            return Ok(());
        }
        let folded = ground::outside(&open);
        self.pieces = self.usable_with(&self.pieces, "time with folded wings", &folded)?;
        self.notes.push(format!(
            "{}: time with open wings is left out: what they do depends on attitude and velocity",
            self.flight
        ));
        Ok(())
    }

    /// The spans in which every channel exists, without those that the filter eats.
    fn usable(&self) -> Result<Vec<Span>, GapError> {
        let streams = [Some(&self.specific_force), Some(&self.omega), Some(&self.rotor)];
        let optional = [self.attitude.as_ref(), self.velocity.as_ref(), self.speed.as_ref()];
        let mut spans = vec![(f64::NEG_INFINITY, f64::INFINITY)];
        for series in streams.into_iter().chain(optional).flatten() {
            spans = self.usable_with(&spans, series.channel, &series.spans())?;
        }
        // Some logs hold only the edges of the wing command.
        if let Some(wing) = &self.wing {
            spans = self.usable_with(&spans, wing.channel, &[(wing.start_s(), f64::INFINITY)])?;
        }
        Ok(spans)
    }

    /// What one more channel leaves of the spans.
    fn usable_with(
        &self,
        spans: &[Span],
        channel: &'static str,
        exists: &[Span],
    ) -> Result<Vec<Span>, GapError> {
        let mut left = common(spans, exists);
        let cut = self.cut(&left);
        left.retain(|span| self.samples_usable(*span) > 0);
        let usable: usize = left.iter().map(|span| self.samples_usable(*span)).sum();
        let usable_s = usable as f64 * self.period_s;
        if usable_s < USABLE_MIN_S {
            let (flight, least_s) = (self.flight.to_owned(), USABLE_MIN_S);
            return Err(GapError::TooShort { flight, channel, usable_s, least_s, cut });
        }
        Ok(left)
    }

    /// How gaps cut a flight, for an error.
    fn cut(&self, pieces: &[Span]) -> String {
        if pieces.len() < 2 {
            return String::new();
        }
        let longest_s = pieces.iter().map(|(start_s, end_s)| end_s - start_s).fold(0.0, f64::max);
        format!(
            "; gaps cut the flight into {} pieces, the longest of {longest_s:.3} s, and each loses {:.3} s at either end",
            pieces.len(),
            self.edge() as f64 * self.period_s
        )
    }

    /// Height over ground at a time, m, by barometer or else by position; `None` if the log has
    /// neither.
    pub(super) fn height_m(&self, time_s: f64) -> Option<f64> {
        match (&self.baro, &self.position) {
            (Some(baro), _) => Some(baro.number(time_s)),
            (None, Some(position)) => Some(-position.vector(time_s).z),
            (None, None) => None,
        }
    }

    /// Samples at each end of a piece that have no residual.
    pub(crate) fn edge(&self) -> usize {
        self.filter.reach() + DERIVATIVE_REACH
    }

    fn samples(&self, (start_s, end_s): Span) -> usize {
        // The slack keeps a last sample that rounding has put behind the end.
        ((end_s - start_s) / self.period_s + 1e-6) as usize + 1
    }

    fn samples_usable(&self, span: Span) -> usize {
        self.samples(span).saturating_sub(2 * self.edge())
    }

    /// The measured samples of one piece.
    pub(crate) fn grid(&self, piece: Span) -> Vec<Sample> {
        (0..self.samples(piece)).map(|k| self.sample(piece.0 + k as f64 * self.period_s)).collect()
    }

    /// The measured sample at a time.
    pub(crate) fn sample(&self, time_s: f64) -> Sample {
        let attitude = self.attitude.as_ref().map(|q| q.rotation(time_s));
        // Without both, the velocity through the air in the body frame is not known.
        let velocity =
            attitude.and(self.velocity.as_ref()).map_or(Vector3::zeros(), |v| v.vector(time_s));
        let body = State {
            velocity: In::new(velocity),
            attitude: attitude.unwrap_or(Quaternion::identity()),
            omega: In::new(self.omega.vector(time_s)),
            ..State::at_rest()
        };
        let voltage_v =
            self.voltage.as_ref().map_or(self.reference_voltage_v, |v| v.number(time_s));
        Sample { time_s, specific_force: self.specific_force.vector(time_s), body, voltage_v }
    }

    /// The rotor command in force at a time, in the vehicle's unit; measured speeds, rad/s, where
    /// they are taken.
    pub(crate) fn rotor_command(&self, time_s: f64) -> PerRotor<f64> {
        let mut command = [0.0; MAX_ROTORS];
        let held = match &self.speed {
            // A sample stands for the time about it, not for that after it.
            Some(speed) => speed.held(time_s + 0.5 * speed.median_period_s()),
            None => self.rotor.held(time_s),
        };
        for (place, u) in command.iter_mut().zip(held) {
            *place = *u;
        }
        command
    }

    /// Whether the log has an attitude.
    pub(crate) fn has_attitude(&self) -> bool {
        self.attitude.is_some()
    }
    /// Whether the log has a battery voltage that changes.
    pub(crate) fn has_voltage(&self) -> bool {
        self.voltage.is_some()
    }
}

/// White noise of accelerometer and gyroscope, one standard deviation.
fn noise_of(derived: &Derived, cutoff_hz: f64, [force, omega]: [&Series; 2]) -> [Vector3<f64>; 2] {
    // Behind the filter nothing is white; what is left of the noise is as large.
    let of_force = derived.force.as_ref().map(|from| from.passed(cutoff_hz));
    let of_rates = derived.rates.as_ref().map(|from| from.passed_rate(cutoff_hz));
    [
        of_force.map_or_else(|| passed_deviation(force), Vector3::repeat),
        of_rates.map_or_else(|| passed_deviation(omega), Vector3::repeat),
    ]
}
