//! How each controller holds where vehicle, air and battery are not what it was told: the avoidance
//! manoeuvre, measured for 18 s, with numbers drawn anew in each trial.
//!
//! The flight code has the vehicle file; what flies has a mass within 15 % of it (and its inertia
//! with it), wings within 30 % of their area, rotors that lag half to twice as long, wind of 0 to
//! 8 m/s from anywhere with gusts of up to 1 m/s, a battery from a tenth to full that sags, and one
//! of the suites of sensors. A trial has the same draw for every arm and ratio. The ratio of thrust
//! to weight is the flight code's: a vehicle that is 15 % heavier has as much less.

use crate::campaign::{self, Draw, Flown, Plan};
use crate::journal::{Journal, Keep};
use crate::sheet::{Cell, Sheet};
use crate::statistics::{Estimate, Share, gain, mean, paired};
use crate::study::{Arms, Found, Study};
use crate::wind::{Flight, MEASURED_S, measure_for_long};
use serde::Serialize;
use squirrel_core::vehicle::Vehicle;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, InProcess};
use squirrel_sim::plant::{Membrane, WingPlant};
use squirrel_sim::scenario::{Conditions, Scenario};
use squirrel_sim::sensors::{SUITES, SensorParameters};
use squirrel_sim::vehicle_file::VehicleFile;

/// On the command line.
pub const STUDY: Study = Study {
    arms: Arms::Asked(&[
        Arm::Pc,
        Arm::TwccFlat,
        Arm::TwccFlatFf,
        Arm::TwccPlus,
        Arm::PcPlus,
        Arm::Indi,
    ]),
    ..Study::new(
        "dispersion",
        "How each controller holds where mass, wings, rotors, wind, battery and sensors are not what it was told",
        (60, "Draws of vehicle and day, each flown by every arm at every thrust-to-weight ratio"),
        study,
    )
};

/// Thrust-to-weight ratios of the flight code.
const THRUST_TO_WEIGHT: [f64; 3] = [1.25, 1.5, 2.0];
/// Classes of wind, by its upper end, m/s.
const WINDS_M_S: [(&str, f64); 2] = [("0 to 4", 4.0), ("4 to 8", 8.0)];
/// A sink that the flight code must have said something of, m.
const DEEP_M: f64 = 5.0;

/// What is drawn for a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Drawn {
    /// Over the file's.
    mass: f64,
    /// Over the file's.
    wing_area: f64,
    /// Over the file's.
    rotor_lag: f64,
    wind_m_s: f64,
    /// Where it blows to, from north towards east, rad.
    wind_to_rad: f64,
    gust_sigma_m_s: f64,
    battery_charge: f64,
    suite: &'static str,
}

/// An arm at one ratio in one class of wind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Thrust-to-weight ratio of the flight code.
    pub thrust_to_weight: f64,
    /// Class of wind, m/s.
    pub wind_m_s: &'static str,
    /// Arm.
    pub arm: &'static str,
    /// Flights.
    pub flights: u32,
    /// Root mean square of the distance to the reference, m, mean of the flights.
    pub rmse_m: f64,
    /// Mean error of `twcc_plus` over the arm's, less 1, over paired flights: above 0 the arm is
    /// better.
    pub over_twcc_plus: Option<Estimate>,
    /// Mean of the deepest sinks, m.
    pub height_lost_m: f64,
    /// Deepest sink of all flights, m.
    pub height_lost_max_m: f64,
    /// Lost flights.
    pub lost: Share,
    /// Flights that sank by more than 5 m, or were lost, without any report.
    pub deep_unflagged: u32,
    /// Flights that sank by more than 5 m of which the first report came when more than half of
    /// that was lost, those without any report among them.
    pub deep_flagged_late: u32,
    /// Most height lost before a report in such flights, m.
    pub deep_before_flag_max_m: f64,
}

/// The study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dispersion {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Draws.
    pub trials: u32,
    /// Seed of all draws.
    pub seed: u64,
    /// By ratio, wind and arm.
    pub rows: Vec<Row>,
}

impl Drawn {
    fn of(seed: u64, trial: u32) -> Self {
        let mut draw = Draw::new(seed, trial);
        Self {
            mass: draw.between(0.85, 1.15),
            wing_area: draw.between(0.7, 1.3),
            rotor_lag: draw.between(-1.0, 1.0).exp2(),
            wind_m_s: draw.between(0.0, 8.0),
            wind_to_rad: draw.between(0.0, std::f64::consts::TAU),
            gust_sigma_m_s: draw.between(0.0, 1.0),
            battery_charge: draw.between(0.1, 1.0),
            suite: draw.one_of(&SUITES),
        }
    }

    /// The vehicle that flies.
    fn vehicle(&self, file: &VehicleFile) -> Result<VehicleFile, FlightError> {
        let fail = |e: squirrel_core::vehicle::ParameterError| FlightError(e.to_string());
        let mut file = file.clone();
        let mut p = *file.vehicle.parameters();
        p.mass_kg *= self.mass;
        p.inertia_kg_m2 *= self.mass;
        p.propulsion.time_constant_up_s *= self.rotor_lag;
        p.propulsion.time_constant_down_s *= self.rotor_lag;
        if let Some(wing) = &mut p.wing {
            wing.area_per_side_m2 *= self.wing_area;
        }
        match &mut file.wing {
            WingPlant::Membrane { membrane, .. } => {
                let mut numbers = *membrane.parameters();
                numbers.area_per_side_m2 *= self.wing_area;
                **membrane = Membrane::new(numbers).map_err(fail)?;
            }
            WingPlant::Flat { wing, .. } => wing.area_per_side_m2 *= self.wing_area,
            WingPlant::None | WingPlant::Parnn { .. } => {}
        }
        file.vehicle = Vehicle::new(p).map_err(fail)?;
        Ok(file)
    }

    fn scenario(&self, ratio: f64, seed: u64) -> Result<Scenario, FlightError> {
        let mut scenario = Scenario::find("avoid").map_err(FlightError)?;
        measure_for_long(&mut scenario);
        scenario.conditions = Conditions::Outdoors;
        scenario.thrust_to_weight = Some(ratio);
        let (east, north) = self.wind_to_rad.sin_cos();
        scenario.wind.mean_ned_m_s = [self.wind_m_s * north, self.wind_m_s * east, 0.0];
        scenario.wind.gust_sigma_m_s = self.gust_sigma_m_s;
        scenario.battery_charge = self.battery_charge;
        scenario.seed = seed;
        Ok(scenario)
    }
}

impl Flight {
    /// A deep sink of which nothing was said before half of it.
    fn is_deep_and_late(&self) -> bool {
        self.height_lost_m > DEEP_M && self.height_lost_unflagged_m > 0.5 * self.height_lost_m
    }
}

fn fly(plan: &Plan, arm: Arm, ratio: f64, trial: u32) -> Result<Flight, FlightError> {
    let drawn = Drawn::of(plan.seed, trial);
    let mut told = plan.setup(arm, drawn.scenario(ratio, plan.trial_seed(trial))?);
    let sensors = &mut told.vehicle.sensors;
    *sensors = SensorParameters::suite(drawn.suite).unwrap_or(*sensors);
    let mut flown = told.clone();
    flown.vehicle = drawn.vehicle(&told.vehicle)?;
    let mut computer = InProcess::new(told.stack()?);
    Ok(Flight::of(&flown.fly_on(&mut computer, None, false, |_| {})?.metrics))
}

/// Flies the study; `None` where only a part is flown here.
///
/// * `plan` - `twcc_plus` is flown in any case
///
/// # Errors
/// A vehicle that cannot fly, an arm that needs a planner, or a folder that cannot be written.
pub fn run(plan: &Plan, keep: &Keep<'_>) -> Result<Option<Dispersion>, FlightError> {
    let plan = &plan.beside(Arm::TwccPlus)?;
    if let Some(arm) = plan.arms.iter().find(|arm| arm.plans()) {
        let name = arm.name();
        return Err(FlightError(format!(
            "arms = {name}: plans on the file's numbers; not flown here"
        )));
    }
    let mut scenarios = Vec::new();
    for ratio in THRUST_TO_WEIGHT {
        let scenario = Drawn::of(plan.seed, 0).scenario(ratio, plan.seed)?;
        plan.check(&plan.vehicle, &scenario)?;
        scenarios.push(scenario);
    }
    let journal = Journal::open(keep, STUDY.name, &plan.identity(STUDY.name, &scenarios))?;
    let flown = campaign::run(plan, scenarios.len(), &journal, |arm, condition, trial| {
        fly(plan, arm, THRUST_TO_WEIGHT[condition], trial)
    })?;
    let Some(flown) = flown else { return Ok(None) };
    let winds_m_s: Vec<f64> =
        (0..plan.trials).map(|trial| Drawn::of(plan.seed, trial).wind_m_s).collect();
    let (flown, winds_m_s) = (&flown, &winds_m_s[..]);
    let rows = (0..THRUST_TO_WEIGHT.len()).flat_map(|condition| {
        (0..WINDS_M_S.len()).flat_map(move |wind| {
            plan.arms.iter().filter_map(move |arm| row(flown, winds_m_s, *arm, [condition, wind]))
        })
    });
    let vehicle = plan.vehicle.name.clone();
    Ok(Some(Dispersion { vehicle, trials: plan.trials, seed: plan.seed, rows: rows.collect() }))
}

/// `None` where no draw has such a wind.
///
/// * `winds_m_s` - of the trials
fn row(
    flown: &Flown<Flight>,
    winds_m_s: &[f64],
    arm: Arm,
    [condition, wind]: [usize; 2],
) -> Option<Row> {
    let above = if wind == 0 { 0.0 } else { WINDS_M_S[wind - 1].1 };
    let (name, below) = WINDS_M_S[wind];
    let of = |arm| -> Vec<&Flight> {
        let all = flown.of(arm, condition).into_iter().zip(winds_m_s);
        all.filter(|(_, wind)| (above..below).contains(*wind)).map(|(flight, _)| flight).collect()
    };
    let flights = of(arm);
    if flights.is_empty() {
        return None;
    }
    let figures = |all: &[&Flight], of: fn(&Flight) -> f64| -> Vec<f64> {
        all.iter().map(|flight| of(flight)).collect()
    };
    let errors = figures(&flights, |flight| flight.rmse_m);
    let ours = figures(&of(Arm::TwccPlus), |flight| flight.rmse_m);
    let sinks = figures(&flights, |flight| flight.height_lost_m);
    let late = flights.iter().filter(|flight| flight.is_deep_and_late());
    let before_flag_m = late.clone().map(|flight| flight.height_lost_unflagged_m);
    Some(Row {
        thrust_to_weight: THRUST_TO_WEIGHT[condition],
        wind_m_s: name,
        arm: arm.name(),
        flights: flights.len() as u32,
        rmse_m: mean(&errors),
        over_twcc_plus: (arm != Arm::TwccPlus).then(|| paired(&ours, &errors, gain)),
        height_lost_m: mean(&sinks),
        height_lost_max_m: sinks.iter().copied().fold(0.0, f64::max),
        lost: Share::of(flights.iter().map(|flight| flight.lost)),
        deep_unflagged: flights
            .iter()
            .filter(|flight| (flight.lost || flight.height_lost_m > DEEP_M) && !flight.flagged)
            .count() as u32,
        deep_flagged_late: late.count() as u32,
        deep_before_flag_max_m: before_flag_m.fold(0.0, f64::max),
    })
}

fn study(plan: &Plan, _: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let Some(study) = run(plan, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "The avoidance manoeuvre, measured for {MEASURED_S} s, with {} draws of vehicle and day from seed {}.",
        study.trials, study.seed
    ));
    found.say("Over twcc_plus: its mean error over the arm's, minus 1, paired, with the 95 % interval in %; above 0 the arm is better.\n");
    let mut sheet = Sheet::default();
    for row in &study.rows {
        let over = row.over_twcc_plus;
        sheet.row(&[
            ("T/W", "thrust_to_weight", Cell::Number(row.thrust_to_weight, 2)),
            ("wind m/s", "wind_m_s", Cell::Text(row.wind_m_s)),
            ("arm", "arm", Cell::Text(row.arm)),
            ("flights", "flights", Cell::Number(f64::from(row.flights), 0)),
            ("RMSE 3-D m", "rmse_m", Cell::Number(row.rmse_m, 2)),
            ("over twcc_plus", "over_low,over_high", Cell::PercentInterval(over, 1)),
            ("sink m", "height_lost_m", Cell::Number(row.height_lost_m, 2)),
            ("worst m", "height_lost_max_m", Cell::Number(row.height_lost_max_m, 2)),
            ("lost", "lost", Cell::Number(f64::from(row.lost.count), 0)),
            ("95 %", "lost_low,lost_high", Cell::PercentInterval(Some(row.lost.share), 0)),
            ("unflagged", "deep_unflagged", Cell::Number(f64::from(row.deep_unflagged), 0)),
            ("late", "deep_flagged_late", Cell::Number(f64::from(row.deep_flagged_late), 0)),
        ]);
    }
    found.csv = found.sheet(sheet);
    let better: Vec<String> = study
        .rows
        .iter()
        .filter(|row| row.over_twcc_plus.is_some_and(|over| over.low > 0.0))
        .map(|row| format!("{} at {} in {} m/s", row.arm, row.thrust_to_weight, row.wind_m_s))
        .collect();
    found.words(vec![if better.is_empty() {
        "No arm is better than twcc_plus beyond the interval.".to_owned()
    } else {
        format!("Better than twcc_plus beyond the interval: {}.", better.join(", "))
    }]);
    Ok(Some(found))
}
