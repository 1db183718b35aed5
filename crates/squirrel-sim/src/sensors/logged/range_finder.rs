//! Range finder that looks down along the body: how far it is to flat ground at the origin's
//! height.
//!
//! At height `h` and tilt `t` the beam is `d = h / cos t` long; the reading is `d + n`, with `n` of
//! the standard deviation `max(s, k d)`, in steps of the converter. There is no reading below the
//! ground, nearer or farther than the range, and beyond a tilt, where the ground sends too little
//! light back. Obstacles are not seen.

use super::super::line::{noise, quantised};
use super::super::parameters::sensor;
use super::super::table::Limit::{AboveZero, Size, Within};
use super::{Reads, Row, Truth};
use rand_pcg::Pcg64Mcg;
use squirrel_core::nalgebra::Vector3;

sensor! {
    /// Range finder; without errors and limits unless told.
    RangeFinderSensor at 100.0 Hz, DEVICES, fit;
    /// White noise, m.
    noise_m: f64 = 0.0, Size;
    /// White noise over the distance, where that is more.
    noise_share: f64 = 0.0, Within(0.0, 1.0);
    /// Nearest that it reads, m.
    min_m: f64 = 0.0, Size;
    /// Farthest that it reads, m.
    max_m: f64 = f64::INFINITY, AboveZero;
    /// Largest tilt at which it reads, rad.
    tilt_max_rad: f64 = 1.5, Within(0.0, 1.5);
    /// Step of its converter, m; 0: none.
    resolution_m: f64 = 0.0, Size;
}

/// Devices that can be bought.
static DEVICES: [&str; 1] = ["tfmini_plus"];

fn fit(p: &mut RangeFinderSensor, device: &str) {
    if device == "tfmini_plus" {
        // Benewake SJ-GU-TFmini-Plus-01 A02: 0.1 to 12 m on a white board indoors, +-5 cm up to 6 m
        // and +-1 % from there, steps of 5 mm. Taken for three standard deviations (assumed).
        (p.min_m, p.max_m) = (0.1, 12.0);
        (p.noise_m, p.noise_share) = (0.05 / 3.0, 0.01 / 3.0);
        p.resolution_m = 0.005;
        // Assumed: the datasheet has no tilt.
        p.tilt_max_rad = 0.6;
    }
}

impl Reads for RangeFinderSensor {
    fn read(&self, truth: &Truth, rng: &mut Pcg64Mcg) -> Option<Row> {
        let cos = (truth.ned_from_body.quaternion * Vector3::z()).z;
        let distance_m = -truth.position.vector.z / cos;
        // Drawn whatever comes of it, so that a dropout changes no later sample.
        let error_m = noise(rng, f64::max(self.noise_m, self.noise_share * distance_m.abs())).x;
        let reading_m = distance_m + error_m;
        let sees = cos >= self.tilt_max_rad.cos() && (self.min_m..=self.max_m).contains(&reading_m);
        sees.then(|| vec![("distance_m", quantised(reading_m, self.resolution_m))])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::Arm;
    use crate::flight::{Integrator, Setup};
    use crate::scenario::Scenario;
    use crate::sensors::{SensorParameters, Sensors};
    use crate::vehicle_file::VehicleFile;
    use squirrel_core::effects::Effects;
    use squirrel_core::frames::{In, Rotation};

    fn at(height_m: f64, roll_rad: f64) -> Truth {
        let truth = Truth::at_rest(In::new(Vector3::z() * -height_m), 0.3);
        Truth { ned_from_body: Rotation::from_euler(roll_rad, 0.0, 0.3), ..truth }
    }

    fn sensors(text: &str) -> Sensors {
        let p: SensorParameters = toml::from_str(text).unwrap();
        p.check().unwrap();
        Sensors::new(p, &Effects::none(), 3)
    }

    /// What it reads at a time, us.
    fn read(sensors: &mut Sensors, time_us: u64, truth: &Truth) -> Option<f64> {
        let logged = sensors.poll(time_us, truth).1;
        logged.into_iter().find(|(source, _)| *source == "range_finder").map(|(_, row)| row[0].1)
    }

    #[test]
    fn it_measures_along_the_body_within_its_range_and_tilt() {
        let mut ideal = sensors("[range_finder]\nmax_m = 4.0\ntilt_max_rad = 1.1");
        assert_eq!(read(&mut ideal, 0, &at(2.0, 0.0)), Some(2.0));
        // 60 deg: the beam is twice as long.
        let long = read(&mut ideal, 10_000, &at(1.5, 60.0_f64.to_radians())).unwrap();
        assert!((long - 3.0).abs() < 1e-12, "{long}");
        assert_eq!(
            read(&mut ideal, 20_000, &at(1.5, 65.0_f64.to_radians())),
            None,
            "too much tilt"
        );
        assert_eq!(read(&mut ideal, 30_000, &at(4.1, 0.0)), None, "too far");
        assert_eq!(read(&mut ideal, 40_000, &at(1.0, 180.0_f64.to_radians())), None, "on its back");
        assert_eq!(read(&mut ideal, 50_000, &at(1.0, 0.0)), Some(1.0), "it comes back");
    }

    #[test]
    fn a_device_is_late_and_as_exact_as_its_datasheet() {
        let mut device = sensors(
            "[range_finder]\ndevice = \"tfmini_plus\"\ntiming = { rate_hz = 100.0, latency_s = 0.02 }",
        );
        assert_eq!(read(&mut device, 0, &at(3.0, 0.0)), None, "under way");
        let read: Vec<f64> =
            (1..=2000).filter_map(|k| read(&mut device, k * 10_000, &at(3.0, 0.0))).collect();
        assert_eq!(read.len(), 1999, "two samples are late by two");
        let mean = read.iter().sum::<f64>() / read.len() as f64;
        let sd = (read.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / read.len() as f64).sqrt();
        assert!((mean - 3.0).abs() < 0.002 && (sd - 0.0167).abs() < 0.001, "{mean} {sd}");
        assert!(
            read.iter().all(|x| ((x / 0.005).round() - x / 0.005).abs() < 1e-9),
            "steps of 5 mm"
        );
    }

    /// The log has it and can be read back; the flight is what it was.
    #[test]
    fn a_flight_logs_it_and_does_not_hear_it() {
        let fly = |range_finder| {
            let mut vehicle = VehicleFile::squirrel();
            vehicle.sensors.logged.range_finder = range_finder;
            let mut scenario = Scenario::find("hover").unwrap();
            (scenario.height_m, scenario.duration_s) = (3.0, 2.0);
            let setup = Setup { vehicle, arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
            setup.fly(true, |_| {}).unwrap().log.unwrap()
        };
        let mut with = fly(Some(RangeFinderSensor::default()));
        let (time_s, distance) = with.channel("range_finder.distance_m").unwrap();
        assert!((195..=201).contains(&time_s.len()), "{}", time_s.len());
        assert!(distance.values.iter().all(|d| (d - 3.0).abs() < 0.5), "{:?}", distance.values);
        assert!(with.sources.remove("range_finder").is_some());
        assert_eq!(with, fly(None));
    }
}
