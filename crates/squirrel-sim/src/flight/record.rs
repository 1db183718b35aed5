//! Recording: every input of the flight code and every term it returns, as a flight log; and the way back to frames.
//!
//! Inputs are `f32` and stored as `f64`, so that a log holds their exact bits. Sources that the flight code reads are in
//! [`INPUT_SOURCES`]; a frame is rebuilt from the samples that carry its time.

use super::{Offboard, Setup};
use crate::log::FlightLog;
use crate::plant::PlantState;
use crate::sensors::BatteryReading;
use squirrel_core::control::wing_force::ParnnTerms;
use squirrel_core::control::{AttitudeThrust, Reference};
use squirrel_core::effects::Effects;
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::guidance::sensing::Obstacle;
use squirrel_core::nalgebra::{Quaternion, Unit, Vector3};
use squirrel_core::policy::PilotCommand;
use squirrel_core::rnn::parnn::Estimate;
use squirrel_core::stack::failsafe::Failsafe;
use squirrel_core::stack::{Gnss, Imu, MAX_OBSTACLES, SensorFrame, StackOutput};

/// Sources that the flight code reads. `frame` has a sample for each step of the flight code.
pub const INPUT_SOURCES: [&str; 10] = [
    "frame",
    "imu",
    "imu_2",
    "attitude",
    "gnss",
    "baro",
    "magnetometer",
    "obstacle",
    "wing_force",
    "offboard",
];
/// Source of what the flight code believes.
pub(crate) const ESTIMATE: &str = "estimate";
/// Metadata: the weights that the vehicle's text names, so that a log replays without them at hand.
pub(crate) const PARNN_WEIGHTS: &str = "parnn_weights_hex";
/// Source of what an offboard computer follows, where that is not the mission.
pub(crate) const FOLLOWED: &str = "offboard.reference";
/// Source of what it believes besides.
const BELIEVED: &str = "offboard.believed";
/// Metadata: who estimated. A log without it is of somebody outside.
pub(crate) const ESTIMATOR: &str = "estimator";
/// Version of the log's content.
pub(crate) const FORMAT: &str = "1";

/// Channel of `offboard`: what a [`PilotCommand`] holds.
const COMMAND: &str = "roll_rad_pitch_rad_thrust_n_wing";

pub(super) struct Recorder {
    log: FlightLog,
    rotors: usize,
    effects: Effects<f64>,
    inputs: Inputs,
}

fn wide(v: &Vector3<f32>) -> [f64; 3] {
    [f64::from(v.x), f64::from(v.y), f64::from(v.z)]
}

impl Recorder {
    pub(super) fn new(setup: &Setup, pilot: Option<&dyn Offboard>, rotors: usize) -> Self {
        let mut log = FlightLog::default();
        let scenario = &setup.scenario;
        let vehicle = setup.vehicle.vehicle.parameters();
        let obstacles: Vec<String> = scenario.all_obstacles().iter().map(|o| format!("{o:?}")).collect();
        let thrust_max_n = setup.thrust_to_weight() * setup.vehicle.vehicle.weight_n();
        for (key, value) in [
            ("format", FORMAT.to_owned()),
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("vehicle", setup.vehicle.name.clone()),
            ("vehicle_toml", setup.vehicle.text.clone()),
            ("scenario_toml", scenario.to_toml()),
            ("arm", setup.arm.name().to_owned()),
            (ESTIMATOR, setup.vehicle.estimator.name().to_owned()),
            ("integrator", setup.integrator.name().to_owned()),
            ("seed", scenario.seed.to_string()),
            ("tilt_max_rad", vehicle.limits.tilt_max_rad.to_string()),
            ("thrust_max_n", thrust_max_n.to_string()),
            ("obstacles_json", format!("[{}]", obstacles.join(","))),
        ] {
            log.metadata.insert(key.to_owned(), value);
        }
        if let Some(weights) = &setup.vehicle.weights {
            log.metadata.insert(PARNN_WEIGHTS.to_owned(), weights.to_hex());
        }
        if let Some(pilot) = pilot {
            log.metadata.extend(pilot.facts().into_iter().map(|(key, value)| (key.to_owned(), value)));
        }
        let estimates = setup.vehicle.estimator.is_filter();
        Self { log, rotors, effects: setup.vehicle.effects, inputs: Inputs::new(estimates) }
    }

    pub(super) fn tick(
        &mut self,
        frame: &SensorFrame,
        battery: Option<BatteryReading>,
        output: &StackOutput,
        state: &PlantState,
        air: In<Ned, f64>,
        wing_force: In<Body, f64>,
    ) {
        let t = frame.time_us as f64 * 1e-6;
        self.inputs.record(&mut self.log, t, frame);
        if let Some(b) = battery {
            let rows: &[(&str, &[f64])] = &[("voltage_v", &[b.voltage_v]), ("current_a", &[b.current_a])];
            self.log.source_mut("battery").push(t, rows);
        }
        let stamp = self.effects.command_clock().stamp_s(t);
        record_output(&mut self.log, t, stamp, output, self.rotors, Some(state));
        self.plant(t, state, air, wing_force);
    }

    /// What an offboard computer follows, where that is not the mission, and what it believes besides.
    pub(super) fn followed(
        &mut self,
        time_us: u64,
        reference: Option<&Reference>,
        pilot: Option<&dyn Offboard>,
    ) {
        let t = time_us as f64 * 1e-6;
        if let Some(reference) = reference {
            record_reference(&mut self.log, FOLLOWED, t, reference);
        }
        let vectors = pilot.map(Offboard::believed).unwrap_or_default();
        let rows: Vec<(&str, &[f64])> = vectors.iter().map(|(name, v)| (*name, v.as_slice())).collect();
        if !rows.is_empty() {
            self.log.source_mut(BELIEVED).push(t, &rows);
        }
    }

    fn plant(&mut self, t: f64, state: &PlantState, air: In<Ned, f64>, wing_force: In<Body, f64>) {
        let body = &state.body;
        let log = &mut self.log;
        log.source_mut("truth").push(
            t,
            &[
                ("position_ned_m", body.position.vector.as_slice()),
                ("velocity_ned_m_s", body.velocity.vector.as_slice()),
                ("q_ned_from_body_wxyz", &body.ned_from_body().wxyz()),
                ("omega_body_rad_s", body.omega.vector.as_slice()),
                ("wing_force_body_n", wing_force.vector.as_slice()),
                ("wind_ned_m_s", air.vector.as_slice()),
                ("battery_charge", &[state.battery.charge]),
            ],
        );
    }

    pub(super) fn finish(self) -> FlightLog {
        self.log
    }
}

/// Records what the flight code was given.
pub(crate) struct Inputs {
    /// Those of the last frame: a log has them where they change.
    obstacles: Vec<Obstacle>,
    /// The flight code estimates the attitude itself and does not look at that of a frame.
    estimates: bool,
}

impl Inputs {
    /// Of a flight code that estimates the attitude itself, or does not.
    pub(crate) fn new(estimates: bool) -> Self {
        Self { obstacles: Vec::new(), estimates }
    }

    pub(crate) fn record(&mut self, log: &mut FlightLog, t: f64, frame: &SensorFrame) {
        log.source_mut("frame").push(t, &[("time_us", &[frame.time_us as f64])]);
        for (source, imu) in [("imu", frame.imu), ("imu_2", frame.imu_2)] {
            let Some(imu) = imu else { continue };
            let omega = wide(&imu.omega.vector);
            let force = wide(&imu.specific_force.vector);
            log.source_mut(source)
                .push(t, &[("omega_body_rad_s", &omega), ("specific_force_body_m_s2", &force)]);
        }
        if let Some(attitude) = frame.attitude.filter(|_| !self.estimates) {
            log.source_mut("attitude").push(t, &[("q_ned_from_body_wxyz", &attitude.wxyz().map(f64::from))]);
        }
        if let Some(gnss) = frame.gnss {
            let position = wide(&gnss.position.vector);
            let velocity = wide(&gnss.velocity.vector);
            log.source_mut("gnss").push(t, &[("position_ned_m", &position), ("velocity_ned_m_s", &velocity)]);
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

/// Records every term of one step of the flight code.
///
/// * `command_stamp` - what the clock of the commands shows at `t`, s
/// * `plant` - what rotors and wings really did, where a plant flew
pub(crate) fn record_output(
    log: &mut FlightLog,
    t: f64,
    command_stamp: f64,
    output: &StackOutput,
    rotors: usize,
    plant: Option<&PlantState>,
) {
    let command = output.rotor_command.map(f64::from);
    let wing_command = output.wing_command.map(f64::from);
    let mut rotor: Vec<(&str, &[f64])> = vec![("command", &command[..rotors])];
    let mut wing: Vec<(&str, &[f64])> = vec![("command", &wing_command)];
    let deployment = plant.map(PlantState::deployment);
    if let (Some(plant), Some(deployment)) = (plant, &deployment) {
        rotor.push(("speed_rad_s", &plant.body.rotor_speed_rad_s[..rotors]));
        wing.push(("deployment", deployment));
    }
    for (name, rows) in [("rotor", rotor), ("wing", wing)] {
        let source = log.source_mut(name);
        // Times of a log increase: what a clock that has jumped back stamps again is not written.
        if source.time_s.last().is_none_or(|last| *last < command_stamp) {
            source.push(command_stamp, &rows);
        }
    }
    record_reference(log, "reference", t, &output.reference);
    record_estimate(log, t, output);
    // A source of its own, so that a flight without a fault has the log that it always had.
    if output.failsafe != Failsafe::default() {
        let Failsafe { mode, reason } = output.failsafe;
        let rows: &[(&str, &[f64])] =
            &[("mode", &[f64::from(mode as u8)]), ("reason", &[f64::from(reason as u8)])];
        log.source_mut("control.failsafe").push(t, rows);
    }
    if let Some(outer) = &output.outer {
        if let Some(terms) = &outer.parnn {
            record_parnn(log, t, terms);
        }
        let p = &outer.position;
        let angles = |roll: f32, pitch: f32| [f64::from(roll), f64::from(pitch)];
        log.source_mut("control.outer").push(
            t,
            &[
                ("position_error_ned_m", &wide(&p.position_error.vector)),
                ("velocity_desired_ned_m_s", &wide(&p.velocity_desired.vector)),
                ("velocity_error_slope_ned_m_s2", &wide(&p.velocity_error_slope)),
                ("velocity_error_ned_m_s", &wide(&p.velocity_error.vector)),
                ("velocity_error_integral_ned_m", &wide(&p.integral)),
                ("acceleration_demand_ned_m_s2", &wide(&p.acceleration_demand.vector)),
                ("acceleration_command_ned_m_s2", &wide(&p.acceleration.vector)),
                ("request_roll_pitch_rad", &angles(p.request.roll_rad, p.request.pitch_rad)),
                ("request_thrust_n", &[f64::from(p.request.thrust_n)]),
                ("wing_force_ned_n", &wide(&outer.wing_force.vector)),
                ("angle_of_attack_rad", &[f64::from(outer.angle_of_attack_rad)]),
                ("helpful_force_n", &[f64::from(outer.wing.helpful_n)]),
                ("flag", &[f64::from(u8::from(outer.wing.flag))]),
                ("mode", &[f64::from(outer.mode as u8)]),
                ("reason", &[f64::from(outer.reason as u8)]),
                ("roll_pitch_command_rad", &angles(outer.command.roll_rad, outer.command.pitch_rad)),
                ("thrust_command_n", &[f64::from(outer.command.thrust_n)]),
                ("clamped", &[f64::from(u8::from(outer.clamped))]),
            ],
        );
    }
    if let Some(excitation) = output.inner.as_ref().and_then(|inner| inner.excitation) {
        log.source_mut("control.excitation").push(
            t,
            &[
                ("angle_rad", &wide(&excitation.attitude.angle)),
                ("rate_rad_s", &wide(&excitation.attitude.rate)),
                ("acceleration_rad_s2", &wide(&excitation.attitude.acceleration)),
                ("thrust_share", &[f64::from(excitation.thrust_share)]),
            ],
        );
    }
    if let Some(inner) = &output.inner {
        let thrusts = inner.mixer.rotor_thrust_n.map(f64::from);
        log.source_mut("control.inner").push(
            t,
            &[
                ("filter_angle_rad", &wide(&inner.filter.angle)),
                ("filter_rate_rad_s", &wide(&inner.filter.rate)),
                ("filter_acceleration_rad_s2", &wide(&inner.filter.acceleration)),
                ("thrust_demand_n", &[f64::from(inner.demand.thrust_n)]),
                ("angle_error_rad", &wide(&inner.attitude.angle_error)),
                ("rate_error_rad_s", &wide(&inner.attitude.rate_error)),
                ("integral_rad_s", &wide(&inner.attitude.integral)),
                ("gyroscopic_torque_n_m", &wide(&inner.attitude.gyroscopic_n_m)),
                ("torque_n_m", &wide(&inner.attitude.torque_n_m)),
                ("thrust_n", &[f64::from(inner.mixer.achieved.thrust_n)]),
                ("achieved_torque_n_m", &wide(&inner.mixer.achieved.torque_n_m)),
                ("roll_pitch_share", &[f64::from(inner.mixer.roll_pitch_share)]),
                ("saturated", &[f64::from(u8::from(inner.mixer.saturated))]),
                ("rotor_thrust_n", &thrusts[..rotors]),
            ],
        );
    }
}

fn record_reference(log: &mut FlightLog, source: &str, t: f64, r: &Reference) {
    log.source_mut(source).push(
        t,
        &[
            ("position_ned_m", &wide(&r.position.vector)),
            ("velocity_ned_m_s", &wide(&r.velocity.vector)),
            ("acceleration_ned_m_s2", &wide(&r.acceleration.vector)),
            ("yaw_rad", &[f64::from(r.yaw_rad)]),
        ],
    );
}

/// What is believed, and what is not as it should be.
fn record_estimate(log: &mut FlightLog, t: f64, output: &StackOutput) {
    log.source_mut("control.status")
        .push(t, &[("rejected", &[f64::from(output.rejected)]), ("health", &[f64::from(output.health.0)])]);
    if let Some(terms) = &output.navigation {
        let attitude = terms.ned_from_body.wxyz().map(f64::from);
        log.source_mut(ESTIMATE).push(
            t,
            &[
                ("q_ned_from_body_wxyz", &attitude),
                ("position_ned_m", &wide(&terms.position.vector)),
                ("velocity_ned_m_s", &wide(&terms.velocity.vector)),
                ("gyro_bias_body_rad_s", &wide(&terms.gyro_bias.vector)),
            ],
        );
        // For who reads a log as that of any autopilot.
        log.source_mut("attitude").push(t, &[("q_ned_from_body_wxyz", &attitude)]);
    }
}

/// What the network said, also where the flat plate stood in for it; NaN before its window was full.
fn record_parnn(log: &mut FlightLog, t: f64, terms: &ParnnTerms) {
    let said = |of: fn(&Estimate) -> f32| terms.estimate.as_ref().map_or(f64::NAN, |e| f64::from(of(e)));
    let force = [said(|e| e.force.vector.x), said(|e| e.force.vector.y), said(|e| e.force.vector.z)];
    log.source_mut("control.parnn").push(
        t,
        &[
            ("guard", &[f64::from(terms.guard as u8)]),
            ("alpha_w_rad", &[said(|e| e.correction.alpha_w_rad)]),
            ("gamma", &[said(|e| e.correction.gamma)]),
            ("alpha_est_rad", &[said(|e| e.alpha_est_rad)]),
            ("force_body_n", &force),
        ],
    );
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

/// The frames that a log's flight code got, in order.
///
/// # Errors
/// One line that names a channel that a frame needs and the log lacks or holds in another shape.
pub fn frames(log: &FlightLog) -> Result<Vec<SensorFrame>, String> {
    let channel = |name: &str, width: usize| match log.channel(name) {
        None => Ok(None),
        Some((_, c)) if c.width != width => {
            Err(format!("{name}: has {} numbers a sample, must have {width}", c.width))
        }
        Some((time_s, c)) => Ok(Some((Cursor { time_s, next: 0 }, c))),
    };
    let Some((times, time_us)) = log.channel("frame.time_us") else {
        return Err("frame.time_us: missing; the log was not recorded by this flight code".to_owned());
    };
    for (one, other) in [
        ("imu.omega_body_rad_s", "imu.specific_force_body_m_s2"),
        ("imu_2.omega_body_rad_s", "imu_2.specific_force_body_m_s2"),
        ("gnss.position_ned_m", "gnss.velocity_ned_m_s"),
    ] {
        if log.channel(one).is_some() && log.channel(other).is_none() {
            return Err(format!("{other}: missing, but there is {one}"));
        }
    }
    let mut imu = channel("imu.omega_body_rad_s", 3)?;
    let force = channel("imu.specific_force_body_m_s2", 3)?;
    let mut imu_2 = channel("imu_2.omega_body_rad_s", 3)?;
    let force_2 = channel("imu_2.specific_force_body_m_s2", 3)?;
    // Where the flight code estimates, an attitude in the log is its own.
    let attitude_name =
        if log.sources.contains_key(ESTIMATE) { None } else { Some("attitude.q_ned_from_body_wxyz") };
    let mut attitude = attitude_name.map_or(Ok(None), |name| channel(name, 4))?;
    let mut gnss = channel("gnss.position_ned_m", 3)?;
    let velocity = channel("gnss.velocity_ned_m_s", 3)?;
    let mut baro = channel("baro.altitude_m", 1)?;
    let mut magnetic = channel("magnetometer.field_body_ut", 3)?;
    let mut obstacle = channel("obstacle.id_north_m_east_m", 3 * MAX_OBSTACLES)?;
    let mut wing_force = channel("wing_force.as_if_spread_ned_n", 3)?;
    let mut command = channel(&format!("offboard.{COMMAND}"), 4)?;

    let narrow = |row: &[f64]| Vector3::new(row[0] as f32, row[1] as f32, row[2] as f32);
    let mut obstacles: Vec<Obstacle> = Vec::new();
    let mut all = Vec::with_capacity(times.len());
    for (t, us) in times.iter().zip(&time_us.values) {
        let mut frame = SensorFrame::empty(*us as u64);
        for (imu, force, place) in
            [(&mut imu, &force, &mut frame.imu), (&mut imu_2, &force_2, &mut frame.imu_2)]
        {
            let Some((cursor, omega)) = imu else { continue };
            let Some(i) = cursor.at(*t) else { continue };
            let force = force.as_ref().map_or(Vector3::zeros(), |(_, c)| narrow(c.row(i)));
            *place = Some(Imu { omega: In::new(narrow(omega.row(i))), specific_force: In::new(force) });
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
            frame.gnss =
                Some(Gnss { position: In::new(narrow(position.row(i))), velocity: In::new(velocity) });
        }
        if let Some((cursor, altitude)) = &mut baro
            && let Some(i) = cursor.at(*t)
        {
            frame.altitude_m = Some(altitude.row(i)[0] as f32);
        }
        if let Some((cursor, field)) = &mut magnetic
            && let Some(i) = cursor.at(*t)
        {
            frame.magnetic = Some(In::new(narrow(field.row(i))));
        }
        if let Some((cursor, rows)) = &mut obstacle
            && let Some(i) = cursor.at(*t)
        {
            let present = rows.row(i).chunks_exact(3).filter(|r| r[0] >= 0.0);
            obstacles = present
                .map(|r| Obstacle { id: r[0] as u32, north_m: r[1] as f32, east_m: r[2] as f32 })
                .collect();
        }
        frame.set_obstacles(&obstacles);
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
    let cursors = [&imu, &imu_2, &attitude, &gnss, &baro, &magnetic, &obstacle, &wing_force, &command];
    for (cursor, _) in cursors.into_iter().flatten() {
        if let Some(t) = cursor.time_s.get(cursor.next) {
            return Err(format!("an input at {t:.6} s belongs to no step of the flight code"));
        }
    }
    Ok(all)
}
