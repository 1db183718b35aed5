//! Where and by how much flights disagree with a vehicle: the residual of force and moment, in the
//! body frame.
//!
//! ```text
//! r_F = LP[ m a - F ]                               a      imu.specific_force_body_m_s2
//! r_M = LP[ J D[w] + w x J w - M ]                  w      imu.omega_body_rad_s
//! F, M = plant(Omega, v, q, w, h, V, deployment)    v, q   gnss.velocity_ned_m_s, attitude.q_ned_from_body_wxyz
//!                                                   h      baro.altitude_m, or else gnss.position_ned_m
//! Omega, deployment: the plant under u, c           u, c   rotor.command, wing.command;  V  battery.voltage_v
//! ```
//! `m` and `J` are the vehicle's. `F` and `M` are force without gravity and moment of the
//! simulator's own plant: rotors behind their lag, drag, wings behind their servos, and the effects
//! of the vehicle file, at the measured motion, height and voltage in still air; the height is
//! smoothed as `name` does it. `LP` is a zero-phase low-pass at 12 Hz (lower without an IMU) and
//! `D` a derivative, whose taps stand in `filter`; both sides pass the same `LP`, which is linear,
//! so that it is applied once, to their difference.
//!
//! **Time.** Each flight has a uniform grid with the median period `T` of the IMU. IMU, attitude
//! (normalised), velocity and voltage are on lines between their samples. Where a channel has no
//! sample for more than five of its median periods, the flight is cut; each piece starts a grid of
//! its own at its first time and is filtered on its own. The filter's edges have no residual: 0.2 s
//! and two samples at each end of a piece. The voltage is held beyond its ends.
//!
//! **Commands** are held until the next one. The plant runs in `ceil(T / 1 ms)` steps a sample by
//! the simulator's RK4; a command acts from the step nearest to its time, and the motion between
//! two samples lies on a line. Before a piece its first sample is held for 1 s, so that rotors,
//! servos and membranes start settled.
//!
//! **Numbers.** RMS values are over samples, over all flights together or for each. A place is a
//! window of one second and a channel, taken from the residual that `name` works with; places rank
//! by their rms over that of the noise which the log itself shows. A share is a place's part of the
//! sum of the squared residual of its channel over all flights.
//!
//! `tests/residual_numpy.py` computes the force again, from a CSV file and without any code of this
//! workspace.

mod places;
mod residual;

use crate::GapError;
use crate::flight::inertial::Common;
use crate::flight::recording::Recording;
use crate::predictor::Predictor;
use nalgebra::Vector6;
pub(crate) use places::places;
use serde::Serialize;
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;

/// The channels of a residual, in order.
pub const CHANNELS: [&str; 6] = [
    "force_body_x_n",
    "force_body_y_n",
    "force_body_z_n",
    "moment_body_x_n_m",
    "moment_body_y_n_m",
    "moment_body_z_n_m",
];

/// The disagreement of flights with a vehicle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// How large it is.
    pub residual: ResidualRms,
    /// Where it is: at most twenty places, the worst first.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// What the logs lack, and what was taken instead; one line each.
    pub notes: Vec<String>,
}

/// Root mean square of the residual, measured minus model, body frame (FRD).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualRms {
    /// Force over all samples, N.
    pub force_body_rms_n: [f64; 3],
    /// Moment over all samples, N m.
    pub moment_body_rms_n_m: [f64; 3],
    /// By name of the flight.
    pub per_flight: BTreeMap<String, FlightRms>,
}

/// Root mean square of the residual of one flight.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlightRms {
    /// Force, N.
    pub force_body_rms_n: [f64; 3],
    /// Moment, N m.
    pub moment_body_rms_n_m: [f64; 3],
    /// Samples on the grid that have a residual.
    pub samples: usize,
    /// What they amount to, s.
    pub duration_s: f64,
}

/// One second of one flight, seen in one channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Place {
    /// Name of the flight.
    pub flight: String,
    /// Start, s of the flight's time.
    pub t0_s: f64,
    /// End, s.
    pub t1_s: f64,
    /// One of [`CHANNELS`].
    pub channel: &'static str,
    /// How the vehicle flew there: means of what is logged. Throttle is commanded rotor speed over
    /// top speed.
    pub condition: String,
    /// Part of the channel's squared residual over all flights that lies here, 0 to 1.
    pub share: f64,
    /// Rms of the residual here over what noise alone would leave.
    pub noise: f64,
}

/// Sum of squares and number of samples.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    squared: Vector6<f64>,
    samples: usize,
}

impl Sum {
    fn add(&mut self, value: &Vector6<f64>) {
        self.squared += value.component_mul(value);
        self.samples += 1;
    }
    /// Force, N, and moment, N m.
    fn rms(&self) -> ([f64; 3], [f64; 3]) {
        let rms = self.squared.map(|squared| (squared / self.samples as f64).sqrt());
        ([rms[0], rms[1], rms[2]], [rms[3], rms[4], rms[5]])
    }
}

/// Residual force and moment of flights against a vehicle; the equations are in the [module](self).
///
/// * `flights` - name and log of each; needs `imu.*` (or position or velocity, and attitude) and
///   `rotor.command`, uses attitude, velocity, voltage and wing command
///
/// # Errors
/// [`GapError`]: a channel is missing, cannot be, or leaves less than a second of a flight; the log
/// is of a vehicle with another number of rotors; the vehicle cannot be stepped.
pub fn find(vehicle: &VehicleFile, flights: &[(String, FlightLog)]) -> Result<Finding, GapError> {
    if flights.is_empty() {
        return Err(GapError::NoFlights);
    }
    let mut total = Sum::default();
    let mut per_flight = BTreeMap::new();
    let mut notes = Vec::new();
    let common = Common::of(flights, vehicle.vehicle.rotors().len())?;
    for (flight, log) in flights {
        let recording = Recording::new(vehicle, flight, log, common)?;
        let mut sum = Sum::default();
        for piece in &recording.pieces {
            for residual in residual::residuals(vehicle, &recording, *piece)? {
                total.add(&residual);
                sum.add(&residual);
            }
        }
        let (force_body_rms_n, moment_body_rms_n_m) = sum.rms();
        let rms = FlightRms {
            force_body_rms_n,
            moment_body_rms_n_m,
            samples: sum.samples,
            duration_s: sum.samples as f64 * recording.period_s,
        };
        if per_flight.insert(flight.clone(), rms).is_some() {
            return Err(GapError::SameName { flight: flight.clone() });
        }
        notes.extend(recording.notes);
    }
    let (force_body_rms_n, moment_body_rms_n_m) = total.rms();
    let residual = ResidualRms { force_body_rms_n, moment_body_rms_n_m, per_flight };
    let predictor = Predictor::new(vehicle, flights)?;
    let places = places(&predictor, &predictor.residual(&predictor.nominal())?)?;
    Ok(Finding { residual, places, notes })
}
