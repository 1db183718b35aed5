//! The study as one HTML file: what a model is worth, how much data it needs, and every number.

use super::{ERRORS, Spread, Table2};
use squirrel_nn::model::Model;
use squirrel_report::chart::{
    Axis, ChartRow, Dot, Extent, Ink, LineChart, Range, RowChart, Series, Svg,
};
use squirrel_report::page::{self, Columns, Figure, Page};

/// The study as a page without network, the same bytes for the same study.
pub fn render(study: &Table2) -> String {
    let lead = "Models of the force of the air on spread wings, each trained on the same random flights and judged on flights \
                that it has not seen. Labels are what a flight log says of the force, truth is what the simulator knows.";
    let mut page = Page::new("Table II: what models of the wing force predict", lead);
    let fact = |name: &str, value: String| (name.to_owned(), value);
    page.facts(&[
        fact("vehicle", study.vehicle.clone()),
        fact("trials", study.trials.to_string()),
        fact("seed", study.seed.to_string()),
        fact("epochs", study.epochs.to_string()),
        fact("version", env!("CARGO_PKG_VERSION").to_owned()),
    ]);
    sets(&mut page, study);
    let longest = study.rows.iter().map(|row| row.training_s).max().unwrap_or_default();
    page.section(
        &format!("After {longest} s of training"),
        "Error to the true force with its standard deviation over the trials. The right column is the error over that of \
         paRNN, minus 1, as the paper counts it; the band is what noise alone makes of the labels.",
    );
    let tests = || study.sets.iter().filter(|set| set.set != "training");
    let figures: Vec<Figure> =
        tests().map(|set| figure(set.set, set.about, by_model(study, set.set, longest))).collect();
    page.figures(Columns::Two, &figures);
    page.section(
        "More data",
        "Error to the true force over the length of the flights that were learned from.",
    );
    let figures: Vec<Figure> =
        tests().map(|set| figure(set.set, set.about, by_data(study, set.set))).collect();
    page.figures(Columns::Two, &figures);
    page.section("Every number", "");
    numbers(&mut page, study);
    page.html()
}

/// `0.0312 ± 0.0008`; the deviation only where there are several trials.
pub(super) fn plus_minus(x: Spread, scale: f64, digits: usize) -> String {
    let mean = format!("{:.digits$}", scale * x.mean);
    x.sd.map_or_else(|| mean.clone(), |sd| format!("{mean} \u{b1} {:.digits$}", scale * sd))
}

fn figure(set: &str, about: &str, drawing: Svg) -> Figure {
    Figure { title: format!("{set}: {about}"), drawings: vec![drawing], ..Figure::default() }
}

fn row(cells: Vec<String>) -> page::Row {
    page::Row { ink: None, cells }
}

pub(super) fn head(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

fn sets(page: &mut Page, study: &Table2) {
    page.section(
        "Flights",
        "Label noise is the distance of labels from the truth; in wind it holds the drag of the airframe. The last columns are \
         paRNN's own words after the longest training, above 3 m/s: how often the angle of attack seems larger than it is, of \
         all and of those beyond 10 deg, and how much stronger the flow acts.",
    );
    let names = [
        "set",
        "flown",
        "flights a trial",
        "speed m/s",
        "force N",
        "label noise N",
        "|alpha_est| > |alpha| %",
        "beyond 10 deg %",
        "median gamma",
    ];
    let rows: Vec<page::Row> = study
        .sets
        .iter()
        .map(|set| {
            let [slow, fast] = set.speed_m_s;
            // The last of a set is that of the longest training.
            let word = study.words.iter().rfind(|word| word.set == set.set);
            let said = |spread: fn(&super::Word) -> Spread, scale: f64, digits: usize| {
                word.map(|w| plus_minus(spread(w), scale, digits)).unwrap_or_default()
            };
            row(vec![
                set.set.to_owned(),
                set.about.to_owned(),
                set.flights.to_string(),
                format!("{slow:.1} to {fast:.1}"),
                plus_minus(set.force_rms_n, 1.0, 3),
                plus_minus(set.label_noise_n, 1.0, 4),
                said(|w| w.alpha_larger_share, 100.0, 1),
                said(|w| w.alpha_larger_share_beyond_10_deg, 100.0, 1),
                said(|w| w.gamma_median, 1.0, 2),
            ])
        })
        .collect();
    page.table(&head(&names), &rows);
}

fn by_model(study: &Table2, set: &str, training_s: u32) -> Svg {
    let axis = Axis::new("RMSE to truth", "N").with_range(Range::Including(0.0, 0.0));
    let mut chart =
        RowChart::new(&format!("error of each model on {set}"), Columns::Two.width(), axis);
    let noise = study.sets.iter().find(|s| s.set == set).map_or(0.0, |s| s.label_noise_n.mean);
    for found in study.rows.iter().filter(|r| r.set == set && r.training_s == training_s) {
        let Spread { mean, sd } = found.to_truth.rmse_n;
        let place = Model::ALL.iter().position(|model| *model == found.model).unwrap_or_default();
        let (ink, sd) = (Ink::Series(place), sd.unwrap_or(0.0));
        let extent = |from: f64, to: f64, ink: Ink, name: &str| Extent {
            from,
            to,
            ink,
            name: name.to_owned(),
        };
        chart.rows.push(ChartRow {
            label: found.model.name().to_owned(),
            // Plus zero turns a rounded minus zero round.
            note: format!("{:+.0} %", (100.0 * found.to_truth.over_parnn.mean).round() + 0.0),
            bands: vec![extent(0.0, noise, Ink::Muted, "label noise")],
            intervals: vec![extent(mean - sd, mean + sd, ink, "")],
            dots: vec![Dot { at: mean, ink, name: String::new() }],
            ..ChartRow::default()
        });
    }
    chart.svg()
}

fn by_data(study: &Table2, set: &str) -> Svg {
    let y = Axis::new("RMSE to truth", "N").with_range(Range::Including(0.0, 0.0));
    let mut chart =
        LineChart::new(&format!("error over training on {set}"), Axis::new("training", "s"), y);
    chart.width = Columns::Two.width();
    chart.x.range = Range::Including(0.0, 0.0);
    for (place, model) in Model::ALL.into_iter().enumerate() {
        let rows = || study.rows.iter().filter(move |r| r.set == set && r.model == model);
        let (x, y) = rows().map(|r| (f64::from(r.training_s), r.to_truth.rmse_n.mean)).unzip();
        chart.series.push(Series::line(model.name(), Ink::Series(place), x, y));
    }
    chart.svg()
}

fn numbers(page: &mut Page, study: &Table2) {
    let names = ["training s", "set", "model", "error", "RMSE N", "x", "y", "z", "over paRNN %"];
    let mut rows = Vec::new();
    for found in &study.rows {
        for (words, error) in ERRORS {
            let error = error(found);
            let mut cells = vec![
                found.training_s.to_string(),
                found.set.to_owned(),
                found.model.name().to_owned(),
            ];
            cells.extend([words.to_owned(), plus_minus(error.rmse_n, 1.0, 4)]);
            cells.extend(error.axis_rmse_n.map(|axis| plus_minus(axis, 1.0, 4)));
            cells.push(plus_minus(error.over_parnn, 100.0, 1));
            rows.push(row(cells));
        }
    }
    page.table(&head(&names), &rows);
}
