//! Verdict, evidence, parameters, and what could be confused.

use super::{DomainRow, Evidence, ReportData, RotorRow, WIDTH, figure, lacking, quantity};
use squirrel_core::effects::Effects;
use squirrel_report::chart::{
    Axis, ChartRow, Dot, Extent, Ink, Level, Matrix, Range, RowChart, drawable,
};
use squirrel_report::page::{Columns, Figure, Page, Row};
use squirrel_sim::scenario::pilot_card;

/// Hypotheses this close to the best one are not decided.
const RIVAL_NATS: f64 = 5.0;
/// Chi-square below which a pair is not separated (3 standard deviations), and below which it is
/// only weakly.
const SEPARATED_CHI_SQUARE: [f64; 2] = [9.0, 25.0];

pub(super) fn verdict(page: &mut Page, data: &ReportData) {
    page.panel("panel-h", "Verdict", "", |page| {
        if data.verdict.is_empty() {
            page.missing("No verdict was given.");
        } else {
            page.text(&data.verdict);
        }
        if !data.rotors.is_empty() {
            let line = |r: &RotorRow| {
                let [loss, low, high, usual] = [r.loss, r.low, r.high, r.usual].map(|x| figure(100.0 * x));
                let health = format!(
                    "{loss} % of its thrust lost, {low} to {high} %; {usual} % is usual from flight to flight"
                );
                (format!("rotor {}", r.rotor), health)
            };
            page.facts(&data.rotors.iter().map(line).collect::<Vec<_>>());
        }
        if data.domain.is_empty() {
            page.missing("No use domain was given: where the answer holds is not known.");
        } else {
            let range = |d: &DomainRow| format!("{} to {}", figure(d.low), quantity(d.high, &d.unit));
            let facts = data.domain.iter().map(|d| (format!("holds for {}", d.name), range(d)));
            page.facts(&facts.collect::<Vec<_>>());
        }
        if data.patch_diff.is_empty() {
            page.missing("No model patch: the vehicle file stays as it is.");
        } else {
            page.preformatted(&data.patch_diff);
        }
    });
}

pub(super) fn evidence(page: &mut Page, data: &ReportData) {
    let text = "Log evidence over the vehicle as declared, in nats, of every effect by itself and of what is named. Look \
                for the distance from there to the next name: evidence within 5 nats does not decide. Names without a bar \
                have no evidence: no plausible size of them explains anything, or the vehicle lacks the part.";
    page.panel("panel-b", "Evidence", text, |page| {
        let mut known: Vec<&Evidence> = data.evidence.iter().filter(|e| drawable(e.nats)).collect();
        known.sort_by(|a, b| b.nats.total_cmp(&a.nats).then_with(|| a.name.cmp(&b.name)));
        let Some(first) = known.first() else {
            lacking(page, data, "No evidence was given: no hypothesis was tried.");
            return;
        };
        let answer = known.iter().find(|e| e.is_answer);
        let best = answer.unwrap_or(first).nats;
        let mut chart =
            RowChart::new("evidence of each hypothesis", WIDTH, Axis::new("log evidence", "nats"));
        // Ends where the data ends: the next tick below a small negative would squeeze what
        // matters.
        let lowest = known.last().map_or(0.0, |e| e.nats.min(0.0));
        chart.x.range = Range::Exact(lowest, first.nats.max(1.0));
        for e in &known {
            let (ink, name) = match answer {
                Some(_) if e.is_answer => (Ink::Series(0), "named"),
                Some(_) if e.nats >= best - RIVAL_NATS => (Ink::Highlight, "rival within 5 nats"),
                _ => (Ink::Muted, ""),
            };
            chart.rows.push(ChartRow {
                label: e.name.clone(),
                note: figure(e.nats),
                bars: vec![Extent { from: 0.0, to: e.nats, ink, name: name.to_owned() }],
                ..ChartRow::default()
            });
        }
        for name in
            Effects::<f64>::NAMES.iter().filter(|name| known.iter().all(|e| e.name != **name))
        {
            chart.rows.push(ChartRow {
                label: (*name).to_owned(),
                note: "\u{2013}".to_owned(),
                ..ChartRow::default()
            });
        }
        page.figures(Columns::One, &[Figure { drawings: vec![chart.svg()], ..Figure::default() }]);
    });
}

pub(super) fn parameters(page: &mut Page, data: &ReportData) {
    let text = "Estimate and 95 % interval, each over its largest plausible size. Look for intervals that reach into the \
                tolerance of the vehicle, or beyond 1.";
    page.panel("panel-f", "Parameters", text, |page| {
        if data.parameters.is_empty() {
            lacking(page, data, "No parameters: no effect was named.");
            return;
        }
        let axis = Axis::new("size over largest plausible size", "")
            .with_range(Range::Including(-0.2, 1.0));
        let mut chart = RowChart::new("parameters with intervals", WIDTH, axis);
        for p in &data.parameters {
            let share = |x: f64| x / p.largest;
            let band = |from: f64, to: f64, ink: Ink, name: &str| Extent {
                from: share(from),
                to: share(to),
                ink,
                name: name.to_owned(),
            };
            let sign = if p.value < 0.0 { -1.0 } else { 1.0 };
            chart.rows.push(ChartRow {
                label: format!("{}.{}", p.effect, p.key),
                note: format!(
                    "{} [{}, {}] {}",
                    figure(p.value),
                    figure(p.low),
                    figure(p.high),
                    p.unit
                ),
                bands: vec![
                    band(sign * p.smallest, sign * p.largest, Ink::Series(2), "plausible"),
                    band(-p.tolerance, p.tolerance, Ink::Limit, "tolerance of the vehicle"),
                ],
                intervals: vec![band(p.low, p.high, Ink::Series(0), "")],
                dots: vec![Dot {
                    at: share(p.value),
                    ink: Ink::Series(0),
                    name: "estimate with 95 % interval".to_owned(),
                }],
                ..ChartRow::default()
            });
        }
        page.figures(Columns::One, &[Figure { drawings: vec![chart.svg()], ..Figure::default() }]);
        let head = ["parameter", "estimate", "95 % interval", "plausible size", "tolerance"]
            .map(str::to_owned);
        let range = |low: f64, high: f64| format!("{} to {}", figure(low), figure(high));
        let rows = data.parameters.iter().map(|p| Row {
            ink: None,
            cells: vec![
                format!("{}.{}", p.effect, p.key),
                figure(p.value),
                range(p.low, p.high),
                range(p.smallest, p.largest),
                figure(p.tolerance),
            ],
        });
        page.table(&head, &rows.collect::<Vec<_>>());
    });
}

pub(super) fn confusability(page: &mut Page, data: &ReportData) {
    let text = "Chi-square by which the smallest reportable size of the effect of a row stands out while that of the column \
                floats. Marked pairs can be taken for each other in these flights, whatever was named.";
    page.panel("panel-g", "What could be confused, and what to fly", text, |page| {
        match &data.confusability {
            Some(c) if !c.names.is_empty() => {
                let [not, weakly] = SEPARATED_CHI_SQUARE;
                let level = |below: f64, bin: usize, name: &str| Level { below, bin, name: name.to_owned() };
                let matrix = Matrix {
                    label: "chi-square between effects".to_owned(),
                    names: c.names.clone(),
                    values: c.chi_square.clone(),
                    levels: vec![
                        level(not, 8, "not separated (below 9)"),
                        level(weakly, 3, "weakly (below 25)"),
                    ],
                };
                page.figures(Columns::One, &[Figure { drawings: vec![matrix.svg()], ..Figure::default() }]);
            }
            _ => {
                lacking(
                    page,
                    data,
                    "No confusability was given: what these flights cannot tell apart is not known.",
                );
            }
        }
        if data.fly_next.is_empty() && data.stopped.is_empty() {
            page.text("No further flight is asked for.");
        }
        for next in &data.fly_next {
            match pilot_card(&next.what) {
                Some(card) => {
                    page.text(&format!("{}: fly {}.", next.why, next.what));
                    page.preformatted(&card);
                }
                None => page.text(&format!("{}: {}.", next.why, next.what)),
            }
        }
    });
}
