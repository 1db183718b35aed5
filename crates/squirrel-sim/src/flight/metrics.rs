//! What a flight amounted to.

use super::integrator::Contact;
use super::surroundings::Surroundings;
use crate::plant::PlantState;
use crate::scenario::Scenario;
use serde::Serialize;
use squirrel_core::control::Reference;
use squirrel_core::control::twcc::Mode;
use squirrel_core::estimate::navigator::Health;
use squirrel_core::frames::{Body, In};
use squirrel_core::nalgebra::{Vector2, Vector3};
use squirrel_core::stack::failsafe::FailsafeReason;
use squirrel_core::stack::{SensorFrame, StackOutput};

/// Figures of one flight, over the measured window; over the whole flight where the window's
/// encounter never came, `encounters` being 0.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Metrics {
    /// Root mean square of the distance to the reference, m.
    pub rmse_m: f64,
    /// The same without height, m.
    pub rmse_horizontal_m: f64,
    /// Root mean square of the distance to the reference by satellite fix and barometer, as they
    /// arrive, m; absent without either.
    pub rmse_measured_m: Option<f64>,
    /// Largest sink below the reference height, m.
    pub height_lost_m: f64,
    /// Of that, what was lost before the first of [`Self::flags`], m.
    pub height_lost_unflagged_m: f64,
    /// Largest climb above the reference height, m.
    pub height_gained_m: f64,
    /// Time with wings more than half spread, s.
    pub wings_open_s: f64,
    /// Time in which WIIC flew, s.
    pub wiic_s: f64,
    /// Smallest distance to the surface of an obstacle, m; negative inside; absent without
    /// obstacles.
    pub clearance_m: Option<f64>,
    /// Horizontal way of the whole flight until it touched something, m.
    pub path_m: f64,
    /// Where it was then from the start, north and east, m.
    pub displacement_m: [f64; 2],
    /// Mean voltage of the battery, V.
    pub voltage_mean_v: f64,
    /// Length of the measured window, s.
    pub window_s: f64,
    /// Obstacles that were avoided, or tried to.
    pub encounters: u32,
    /// Time of the first contact with ground or an obstacle, s.
    pub contact_s: Option<f64>,
    /// Speed with which it was met, m/s.
    pub contact_speed_m_s: Option<f64>,
    /// A command to a rotor or wing was not finite at any time.
    pub not_finite: bool,
    /// Largest tilt of the whole flight, rad.
    pub tilt_max_rad: f64,
    /// What the flight code found not to be as it should, in the order of [`Health::NAMES`], and
    /// why its failsafe acted; from the first of the scenario's faults on, where there is one,
    /// until it turns over or touches something.
    #[serde(serialize_with = "names")]
    pub flags: Flags,
}

/// What was reported at any time in a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flags {
    /// Health.
    pub health: Health,
    /// Reasons of the failsafe; a bit each.
    reasons: u16,
}

impl Flags {
    /// Names of everything that was reported.
    pub fn names(self) -> Vec<String> {
        let bit = |bits: u16, i: usize| bits >> i & 1 == 1;
        let health = Health::NAMES.iter().enumerate().filter(|(i, _)| bit(self.health.0, *i));
        let reasons =
            FailsafeReason::ALL.iter().filter(|reason| bit(self.reasons, **reason as usize));
        health
            .map(|(_, name)| (*name).to_owned())
            .chain(reasons.map(|r| r.name().to_owned()))
            .collect()
    }
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "the shape that serde calls")]
fn names<S: serde::Serializer>(flags: &Flags, to: S) -> Result<S::Ok, S::Error> {
    flags.names().serialize(to)
}

/// A vehicle that tilts further has turned over, rad.
const OVER_RAD: f64 = 1.6;

impl Metrics {
    /// Whether the vehicle turned over, left the numbers, or met anything.
    ///
    /// * `landing_m_s` - who meets the ground no faster has landed; 0 where nobody should
    pub fn is_lost(&self, landing_m_s: f64) -> bool {
        let hit = self.contact_speed_m_s.is_some_and(|speed| speed > landing_m_s);
        hit || self.tilt_max_rad > OVER_RAD || self.not_finite
    }
}

/// Collects [`Metrics`].
pub(super) struct Meter<'a> {
    scenario: &'a Scenario,
    from: Option<[Vector2<f64>; 2]>,
    start_us: Option<u64>,
    last_us: u64,
    over: bool,
    sums: Sums,
    altitude_m: Option<f32>,
    mode: Mode,
    faults_from_s: f64,
    metrics: Metrics,
}

/// What is summed up over the measured window.
#[derive(Default)]
struct Sums {
    samples: u64,
    square: f64,
    square_horizontal: f64,
    fixes: u64,
    square_measured: f64,
    volt: f64,
    wings_us: u64,
    wiic_us: u64,
}

impl<'a> Meter<'a> {
    pub(super) fn new(scenario: &'a Scenario) -> Self {
        let metrics = Metrics {
            rmse_m: 0.0,
            rmse_horizontal_m: 0.0,
            rmse_measured_m: None,
            height_lost_m: 0.0,
            height_lost_unflagged_m: 0.0,
            height_gained_m: 0.0,
            wings_open_s: 0.0,
            wiic_s: 0.0,
            clearance_m: None,
            path_m: 0.0,
            displacement_m: [0.0; 2],
            voltage_mean_v: 0.0,
            window_s: 0.0,
            encounters: 0,
            contact_s: None,
            contact_speed_m_s: None,
            not_finite: false,
            tilt_max_rad: 0.0,
            flags: Flags::default(),
        };
        let first =
            scenario.faults.values().map(|fault| fault.start_s).fold(f64::INFINITY, f64::min);
        Self {
            scenario,
            from: None,
            start_us: None,
            last_us: 0,
            over: false,
            sums: Sums::default(),
            altitude_m: None,
            mode: Mode::Primary,
            faults_from_s: if first.is_finite() { first } else { 0.0 },
            metrics,
        }
    }

    /// * `reference` - what is followed
    /// * `encounters` - so far
    pub(super) fn tick(
        &mut self,
        state: &PlantState,
        frame: &SensorFrame,
        output: &StackOutput,
        reference: &Reference,
        encounters: u32,
        obstacles: &mut Surroundings,
    ) {
        let time_us = frame.time_us;
        self.altitude_m = frame.altitude_m.or(self.altitude_m);
        let step_us = time_us - self.last_us;
        self.last_us = time_us;
        self.metrics.encounters = encounters;
        let mut commands = output.rotor_command.iter().chain(&output.wing_command);
        self.metrics.not_finite |= !commands.all(|command| command.is_finite());
        // What is reported once a vehicle has turned over or lies on the ground warns nobody.
        let is_flying = self.metrics.contact_s.is_none() && self.metrics.tilt_max_rad < OVER_RAD;
        if is_flying && time_us as f64 * 1e-6 >= self.faults_from_s {
            self.metrics.flags.health.0 |= output.health.0;
            if output.failsafe.reason != FailsafeReason::None {
                self.metrics.flags.reasons |= 1 << output.failsafe.reason as u16;
            }
        }
        let down = (state.body.ned_from_body() * In::<Body, f64>::new(Vector3::z())).vector.z;
        self.metrics.tilt_max_rad = self.metrics.tilt_max_rad.max(down.clamp(-1.0, 1.0).acos());
        if let Some(outer) = &output.outer {
            self.mode = outer.mode;
        }
        let at = state.body.position.vector;
        self.pass(at.xy(), obstacles);
        let windowed = self.scenario.measured_window_s > 0.0;
        if self.start_us.is_none() && windowed && encounters > 0 {
            self.begin(time_us);
        }
        let elapsed_s = (time_us - self.start_us.unwrap_or(0)) as f64 * 1e-6;
        if self.start_us.is_some() && elapsed_s > self.scenario.measured_window_s {
            self.over = true;
            return;
        }
        let error = at - reference.position.vector.cast::<f64>();
        let sums = &mut self.sums;
        sums.samples += 1;
        sums.square += error.norm_squared();
        sums.square_horizontal += error.xy().norm_squared();
        if let (Some(fix), Some(altitude_m)) = (&frame.gnss, self.altitude_m) {
            let at = Vector3::new(fix.position.vector.x, fix.position.vector.y, -altitude_m);
            sums.fixes += 1;
            sums.square_measured += f64::from((at - reference.position.vector).norm_squared());
        }
        sums.volt += state.battery.voltage_v;
        self.metrics.window_s = elapsed_s;
        self.metrics.height_lost_m = self.metrics.height_lost_m.max(error.z);
        if self.metrics.flags == Flags::default() {
            self.metrics.height_lost_unflagged_m = self.metrics.height_lost_m;
        }
        self.metrics.height_gained_m = self.metrics.height_gained_m.max(-error.z);
        if state.deployment().iter().sum::<f64>() > 1.0 {
            sums.wings_us += step_us;
        }
        if self.mode == Mode::WingsOpen {
            sums.wiic_us += step_us;
        }
    }

    /// The window begins: what was before does not count.
    fn begin(&mut self, time_us: u64) {
        self.start_us = Some(time_us);
        self.sums = Sums::default();
        self.metrics.height_lost_m = 0.0;
        self.metrics.height_lost_unflagged_m = 0.0;
        self.metrics.height_gained_m = 0.0;
    }

    /// What it passes, and how far it has come.
    fn pass(&mut self, at: Vector2<f64>, obstacles: &mut Surroundings) {
        for (_, [north, east, radius]) in obstacles.near(at) {
            let square = (north - at.x).powi(2) + (east - at.y).powi(2);
            let near =
                self.metrics.clearance_m.map_or(f64::INFINITY, |clearance| clearance + radius);
            if square < near.max(0.0).powi(2) {
                self.metrics.clearance_m = Some(square.sqrt() - radius);
            }
        }
        self.way(at);
    }

    /// How far it has come; a flight through a forest ends where it has come through, or has
    /// touched something.
    fn way(&mut self, at: Vector2<f64>) {
        let [start, before] = self.from.unwrap_or([at; 2]);
        self.from = Some([start, at]);
        if self.metrics.contact_s.is_none() {
            self.metrics.path_m += (at - before).norm();
            self.metrics.displacement_m = (at - start).into();
        }
        let come_through =
            |path_m| self.metrics.contact_s.is_some() || self.metrics.path_m >= path_m;
        self.over |=
            self.scenario.forest.as_ref().is_some_and(|forest| come_through(forest.path_m));
    }

    /// * `speed_m_s` - before it
    pub(super) fn contact(&mut self, contact: Contact, speed_m_s: f64) {
        if contact == Contact::Touching && self.metrics.contact_s.is_none() {
            self.metrics.contact_s = Some(self.last_us as f64 * 1e-6);
            self.metrics.contact_speed_m_s = Some(speed_m_s);
        }
    }

    /// The measured window has passed.
    pub(super) fn is_over(&self) -> bool {
        self.over
    }

    pub(super) fn finish(mut self) -> Metrics {
        let sums = self.sums;
        let n = sums.samples.max(1) as f64;
        self.metrics.rmse_m = (sums.square / n).sqrt();
        self.metrics.rmse_horizontal_m = (sums.square_horizontal / n).sqrt();
        self.metrics.rmse_measured_m =
            (sums.fixes > 0).then(|| (sums.square_measured / sums.fixes as f64).sqrt());
        self.metrics.voltage_mean_v = sums.volt / n;
        self.metrics.wings_open_s = sums.wings_us as f64 * 1e-6;
        self.metrics.wiic_s = sums.wiic_us as f64 * 1e-6;
        self.metrics
    }
}
