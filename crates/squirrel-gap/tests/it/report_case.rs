//! The report of a hidden effect, from flight to page: every panel holds data, and the data is that
//! of the verdict.
#![allow(clippy::unwrap_used, reason = "tests")]

use hidden_effects::case::{Case, Set};
use squirrel_gap::report::{PANELS, ReportData, render};
use squirrel_gap::{Diagnosis, Kind, Value, add, diagnose, picture};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::Path;

/// Where the flights are said to lie.
const FOLDER: &str = "/nobody/knows/case";

struct Found {
    vehicle: VehicleFile,
    flights: Vec<(String, FlightLog)>,
    held_out: Vec<(String, FlightLog)>,
}

impl Found {
    /// The case that `cargo xtask report-png` draws.
    fn new(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let (_, case) = Case::draw_and_make(Set::Single, 0, 5, &folder).unwrap();
        let log =
            |file: &str| (format!("{FOLDER}/{file}"), FlightLog::read(&case.join(file)).unwrap());
        Self {
            vehicle: VehicleFile::load(&case.join("vehicle.toml")).unwrap(),
            flights: vec![log("train/flight00.mcap"), log("train/flight01.mcap")],
            held_out: vec![log("held-out/flight00.mcap")],
        }
    }

    fn diagnosis(&self) -> Diagnosis {
        diagnose(&self.vehicle, &self.flights, &self.held_out, &|_| {}).unwrap()
    }

    fn picture(&self, diagnosis: &Diagnosis, patched: Option<&str>) -> ReportData {
        picture(&self.vehicle, diagnosis, &names(&self.flights), &names(&self.held_out), patched)
    }
}

fn names(logs: &[(String, FlightLog)]) -> Vec<String> {
    logs.iter().map(|(name, _)| name.clone()).collect()
}

fn panel<'a>(html: &'a str, id: &str) -> &'a str {
    let start = html.find(&format!("<section id=\"{id}\">")).unwrap_or_else(|| panic!("no {id}"));
    html[start..].split_once("</section>").unwrap().0
}

fn mean(rows: &[Vec<f64>]) -> f64 {
    let all: Vec<f64> = rows.iter().flatten().copied().filter(|x| x.is_finite()).collect();
    all.iter().sum::<f64>() / all.len() as f64
}

#[test]
fn every_panel_of_a_hidden_effect_holds_data() {
    let found = Found::new("report_case");
    let diagnosis = found.diagnosis();
    assert_eq!(diagnosis.verdict.verdict, Kind::Named, "{}", diagnosis.verdict.words);
    let text = add(&found.vehicle, &diagnosis, &names(&found.flights)).unwrap();
    let data = found.picture(&diagnosis, Some(&text));
    let html = render(&data);
    for id in PANELS {
        let text = panel(&html, id);
        assert!(text.contains("<svg") || id == "panel-h", "{id} has no picture");
        assert!(!text.contains("class=\"missing\""), "{id} lacks something");
    }
    assert!(
        !html.contains(FOLDER) && !html.contains(env!("CARGO_TARGET_TMPDIR")),
        "an absolute path"
    );
    assert_eq!(
        render(&found.picture(&found.diagnosis(), Some(&text))),
        html,
        "the same flights, the same bytes"
    );

    let effect = &diagnosis.verdict.effects[0];
    let (_, Value::Number { value, low, high }) = effect.parameters.first_key_value().unwrap()
    else {
        panic!("{effect:?}")
    };
    let row = &data.parameters[0];
    assert_eq!((row.value, row.low, row.high), (*value, *low, *high));
    for flight in &data.flights {
        assert!(mean(&flight.before) > 1.5, "{}: {}", flight.name, mean(&flight.before));
        assert!(
            (0.6..1.3).contains(&mean(&flight.after)),
            "{}: {}",
            flight.name,
            mean(&flight.after)
        );
        assert_eq!(flight.speed_m_s.len(), flight.before[0].len());
    }
    // Against a unit of the effect, the slope is the size of the effect; what is left is flat.
    let bins = &data.conditional[0].bins;
    let (first, last) = (bins.first().unwrap(), bins.last().unwrap());
    let slope =
        |of: fn(&squirrel_gap::report::Bin) -> f64| (of(last) - of(first)) / (last.at - first.at);
    let (before, after) = (slope(|b| b.before_mean), slope(|b| b.after_mean));
    assert!(
        (before / value - 1.0).abs() < 0.15 && (after / value).abs() < 0.15,
        "{before} {after} {value}"
    );
    let held_out = data.held_out.as_ref().unwrap();
    assert_eq!(held_out.channels.len(), 12);
    let second = held_out.horizons.iter().find(|h| h.horizon_s > 0.95).unwrap().errors;
    assert!(second.nominal > 2.0 * second.fitted && second.floor == 1.0, "{second:?}");
    assert_eq!(data.whiteness.len(), 6);
    for w in &data.whiteness {
        assert!(
            w.autocorrelation.iter().all(|r| r.abs() < 0.4),
            "{}: {:?}",
            w.channel,
            w.autocorrelation
        );
    }
    assert_eq!(data.evidence.iter().filter(|e| e.is_answer).count(), 1);
}

#[test]
fn logs_that_contradict_themselves_leave_the_reason_in_every_panel() {
    let mut found = Found::new("report_problem");
    for (_, log) in &mut found.flights {
        let voltage = log.source_mut("battery").channels.get_mut("voltage_v").unwrap();
        voltage.values.iter_mut().for_each(|volt| *volt *= 1e3);
    }
    let diagnosis = found.diagnosis();
    assert_eq!(diagnosis.verdict.verdict, Kind::DataProblem);
    let html = render(&found.picture(&diagnosis, None));
    let verdict = panel(&html, "panel-h");
    assert!(verdict.contains("train/flight00.mcap: battery.voltage_v: its mean"), "{verdict}");
    assert!(!html.contains(FOLDER));
    for id in PANELS.iter().filter(|id| **id != "panel-h") {
        let text = panel(&html, id);
        assert!(text.contains("contradict themselves") && !text.contains("<svg"), "{id}");
    }
}

/// A flight given twice is told in the verdict's words, by a name without its folder; the others
/// fill the panels.
#[test]
fn a_flight_that_is_set_aside_is_told_in_the_report() {
    let mut found = Found::new("report_aside");
    let twice = (format!("{FOLDER}/train/copy.mcap"), found.flights[0].1.clone());
    found.flights.push(twice);
    let diagnosis = found.diagnosis();
    assert_eq!(diagnosis.verdict.set_aside.len(), 1, "{}", diagnosis.verdict.words);
    assert_eq!(diagnosis.verdict.verdict, Kind::Named, "{}", diagnosis.verdict.words);
    let html = render(&found.picture(&diagnosis, None));
    let verdict = panel(&html, "panel-h");
    assert!(verdict.contains("1 of 4 flights were set aside: train/copy.mcap: imu."), "{verdict}");
    assert!(!html.contains(FOLDER));
}
