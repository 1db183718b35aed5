//! The wind that the flight code estimates, beside that which blows: rotors that have drag show it,
//! on the truth and on estimates of cheap sensors.

use squirrel_log::FlightLog;
use squirrel_log::flight_code::WIND;
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// After so long, s, the wind is found.
const FOUND_S: f64 = 6.0;

/// Of the estimate in a flight.
#[derive(Debug, Default)]
struct Errors {
    /// Squares of the horizontal error, (m/s)^2, all and of those with wings that are not folded.
    all: Vec<f64>,
    open: Vec<f64>,
    /// Squares over the variance that the filter states, of north and east together.
    normalised: Vec<f64>,
}

fn fly(estimator: Estimator, scenario: &str, wind: [f64; 3], seed: u64) -> FlightLog {
    let mut vehicle = VehicleFile::bundled("squirrel_air").unwrap();
    vehicle.estimator = estimator;
    let mut scenario = Scenario { seed, ..Scenario::find(scenario).unwrap() };
    scenario.wind.mean_ned_m_s = wind;
    scenario.wind.gust_sigma_m_s = 0.5;
    scenario.thrust_to_weight = Some(1.5);
    let setup = Setup { vehicle, arm: Arm::TwccPlus, scenario, integrator: Integrator::Rk4 };
    setup.fly(true, |_| ()).unwrap().log.unwrap()
}

impl Errors {
    /// Adds those of a flight.
    fn look(&mut self, log: &FlightLog) {
        let channel = |source: &str, name: &str| {
            let (time_s, channel) = log.channel(&format!("{source}.{name}")).unwrap();
            let rows: Vec<&[f64]> = (0..time_s.len()).map(|i| channel.row(i)).collect();
            (time_s, rows)
        };
        let at = |(time_s, rows): &(&[f64], Vec<&[f64]>), t: f64| {
            rows[time_s.partition_point(|s| *s <= t).saturating_sub(1)].to_vec()
        };
        let (truth, wing) = (channel("truth", "wind_ned_m_s"), channel("wing", "deployment"));
        let deviation = channel(WIND, "deviation_m_s");
        let (time_s, rows) = channel(WIND, "velocity_ned_m_s");
        for (t, said) in time_s.iter().zip(rows).filter(|(t, _)| **t > FOUND_S) {
            let is = at(&truth, *t);
            let square = (said[0] - is[0]).powi(2) + (said[1] - is[1]).powi(2);
            self.all.push(square);
            if at(&wing, *t)[0] > 0.05 {
                self.open.push(square);
            }
            self.normalised.push(square / at(&deviation, *t)[0].powi(2));
        }
    }
}

fn mean(squares: &[f64]) -> f64 {
    squares.iter().sum::<f64>() / squares.len() as f64
}

/// Gusts of 0.5 m/s an axis are in the error: no filter that needs seconds follows them.
#[test]
fn the_wind_is_found_in_flight() {
    for estimator in [Estimator::Oracle, Estimator::Eskf] {
        let mut errors = Errors::default();
        for (scenario, wind) in [
            ("hover", [4.0, -3.0, 0.0]),
            ("track", [0.0, 5.0, 0.0]),
            ("avoid", [-5.0, 0.0, 0.0]),
            ("avoid", [3.0, 0.0, 0.0]),
            ("avoid", [0.0, 5.0, 0.0]),
        ] {
            errors.look(&fly(estimator, scenario, wind, 41));
        }
        let [all, open] = [&errors.all, &errors.open].map(|squares| mean(squares).sqrt());
        assert!(all < 0.7 && open < 1.0, "{estimator:?}: {all:.2} m/s, wings open {open:.2}");
        let normalised = mean(&errors.normalised);
        assert!((0.7..2.5).contains(&normalised), "{estimator:?}: {normalised:.2} of 2");
    }
}
