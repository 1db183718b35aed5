//! The gap report: every panel shows its data, says what it lacks, and stays small.
//!
//! The example is written to `target/tmp/gap-report.html`; `cargo xtask report-png` draws it.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use squirrel_core::effects::Effects;
use squirrel_gap::ClosedLoop;
use squirrel_gap::report::{
    Answer, Bin, Conditional, Confusability, DomainRow, Errors, Evidence, FlightPanel, FlyNext,
    HeldOut, HeldOutChannel, Horizon, InputCorrelation, PANELS, ParameterRow, ReportData, RotorRow,
    Whiteness, render,
};

/// Reproducible, between -1 and 1.
fn noise(i: usize) -> f64 {
    let bits = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let bits = (bits ^ (bits >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (bits >> 40) as f64 / f64::from(1u32 << 23) - 1.0
}

fn flight(name: &str, windows: usize) -> FlightPanel {
    let speed_m_s: Vec<f64> = (0..windows).map(|k| 4.5 - 4.5 * (k as f64 * 0.25).cos()).collect();
    let rows = |gain: f64| {
        let row = |axis: usize| {
            let value = |k: usize| {
                1.0 + 0.3 * noise(97 * axis + k) + if axis < 2 { gain * speed_m_s[k] } else { 0.0 }
            };
            (0..windows).map(value).collect()
        };
        (0..6).map(row).collect()
    };
    FlightPanel {
        name: name.to_owned(),
        start_s: 0.0,
        window_s: 0.5,
        before: rows(0.8),
        after: rows(0.02),
        height_m: (0..windows).map(|k| 6.0 + 5.0 * (k as f64 * 0.11).sin()).collect(),
        wings: (0..windows).map(|k| f64::from(u8::from(k % 20 < 6))).collect(),
        speed_m_s,
    }
}

#[allow(clippy::too_many_lines, reason = "one example that fills every panel")]
fn example() -> ReportData {
    let names = Effects::<f64>::NAMES;
    let evidence = |(i, name): (usize, &&str)| Evidence {
        name: (*name).to_owned(),
        nats: match i {
            0 => 1234.5,
            1 => 1231.0,
            _ => 700.0 * f64::exp(-0.25 * i as f64) - 6.0,
        },
        is_answer: i == 0,
    };
    let chi_square = |i: usize, j: usize| match (i, j) {
        _ if i == j => f64::NAN,
        (0, 1) | (1, 0) => 6.875,
        (2, 12) | (12, 2) => 17.0,
        _ => 60.0 + 900.0 * noise(31 * i.min(j) + i.max(j)).abs(),
    };
    let errors = |k: f64| Errors { nominal: 9.3 * k, rival: 2.41 * k, fitted: 1.07 * k, floor: k };
    let channels = ["fx m/s\u{b2}", "fy m/s\u{b2}", "fz m/s\u{b2}", "Mx N m", "My N m", "Mz N m"];
    let bin = |k: usize| {
        let at = k as f64 - 8.0;
        let after_mean = 0.02 * noise(k);
        Bin { at, count: 400, before_mean: -0.155 * at, before_sd: 0.2, after_mean, after_sd: 0.18 }
    };
    let conditional = |channel: &str, regressor: &str| Conditional {
        channel: channel.to_owned(),
        unit: "m/s\u{b2}".to_owned(),
        regressor: regressor.to_owned(),
        regressor_unit: "m/s".to_owned(),
        bins: (0..17).map(bin).collect(),
    };
    let whiteness = |channel: &str, seed: usize| Whiteness {
        channel: channel.to_owned(),
        lag_s: 1.0 / 30.0,
        autocorrelation: (0..40)
            .map(|k| 0.5 * f64::exp(-0.5 * k as f64) + 0.04 * noise(seed + k))
            .collect(),
        inputs: ["thrust", "roll command", "pitch command"]
            .iter()
            .enumerate()
            .map(|(i, input)| InputCorrelation {
                input: (*input).to_owned(),
                values: (0..40).map(|k| 0.04 * noise(seed + 100 * (i + 1) + k)).collect(),
            })
            .collect(),
        band_99: 0.0526,
        ljung_box: 61.3,
        ljung_box_lags: 40,
        ljung_box_p: 0.0168,
    };
    let row = |name: &str, low: f64, high: f64, unit: &str| DomainRow {
        name: name.to_owned(),
        low,
        high,
        unit: unit.to_owned(),
    };
    let parameter = |effect: &str, key: &str, unit: &str, n: [f64; 6]| ParameterRow {
        effect: effect.to_owned(),
        key: key.to_owned(),
        unit: unit.to_owned(),
        value: n[0],
        low: n[1],
        high: n[2],
        smallest: n[3],
        largest: n[4],
        tolerance: n[5],
    };
    let answer = |question: &str, answer: &str, figure: &str, sentence: &str| Answer {
        question: question.to_owned(),
        answer: answer.to_owned(),
        figure: figure.to_owned(),
        figure_note: format!("note of {question}"),
        sentences: vec![sentence.to_owned()],
    };
    ReportData {
        stopped: String::new(),
        screen: vec![
            answer("What is missing", "More drag, growing with speed", "0.0851 N s/m", "Drag: 0.0823 to 0.0879 N s/m."),
            answer("How sure", "Very sure", "30 : 1", "The next best is 30 times less likely (3.50 nats)."),
            answer("How much better it predicts", "98.9 % less error", "9.30 \u{2192} 1.07", "On a flight that it never saw."),
            answer("What remains", "Nothing", "", "The answer takes away 99.1 %."),
            answer("What to fly next", "One more flight", "", "Dashes at several speeds."),
        ],
        set_aside: vec!["rich 9: imu: held for 3 s".to_owned()],
        check: None,
        title: "Gap report: squirrel, three flights".to_owned(),
        verdict: "The vehicle file lacks linear_drag: a force against the motion of 0.085 N per m/s. On a flight that was \
                  not used to find it, the error of one second of re-simulation falls from 9.3 to 1.07 times the noise \
                  floor; the best other name leaves 2.41."
            .to_owned(),
        rotors: vec![RotorRow { rotor: 3, loss: 0.221, low: 0.175, high: 0.269, usual: 0.01 }],
        domain: vec![
            row("speed", 0.0, 9.2, "m/s"),
            row("height", 0.18, 10.9, "m"),
            row("tilt", 0.0, 0.52, "rad"),
        ],
        patch_diff: "--- squirrel.toml\n+++ squirrel.toml\n+[effects.linear_drag]\n+extra_drag_n_s_per_m = 0.0851\n"
            .to_owned(),
        channels: channels.map(str::to_owned).to_vec(),
        flights: vec![flight("rich 0", 80), flight("rich 1", 80)],
        evidence: names.iter().enumerate().map(evidence).collect(),
        conditional: vec![
            conditional("fx", "forward airspeed"),
            conditional("fy", "sideways airspeed"),
        ],
        closed_loop: vec![ClosedLoop {
            flight: "avoid 4".to_owned(),
            before_ned_m: [0.31, 0.22, 1.74],
            after_ned_m: [0.12, 0.11, 0.23],
        }],
        held_out: Some(HeldOut {
            flights: vec!["normal 4".to_owned()],
            rival: "quadratic_drag".to_owned(),
            channels: ["vn", "ve", "vd", "roll", "pitch", "yaw"]
                .iter()
                .enumerate()
                .map(|(i, name)| HeldOutChannel {
                    name: (*name).to_owned(),
                    unit: if i < 3 { "m/s" } else { "rad" }.to_owned(),
                    errors: errors(0.01 * (i + 1) as f64),
                    second: errors(0.008 * (i + 1) as f64),
                    horizons: vec![Horizon { horizon_s: 0.1, errors: errors(0.01) }],
                })
                .collect(),
            horizons: (1..=10)
                .map(|k| {
                    let h = 0.2 * f64::from(k);
                    let errors = Errors { nominal: 1.0 + 5.0 * h, rival: 1.0 + 1.2 * h, fitted: 1.0 + 0.05 * h, floor: 1.0 };
                    Horizon { horizon_s: h, errors }
                })
                .collect(),
        }),
        whiteness: vec![whiteness("fx", 0), whiteness("fz", 5000)],
        parameters: vec![
            parameter("linear_drag", "extra_drag_n_s_per_m", "N s/m", [0.0851, 0.0823, 0.0879, 0.04, 0.25, 0.003]),
            parameter("thrust_coefficient", "thrust_fraction", "", [-0.061, -0.083, -0.0395, 0.04, 0.15, 0.01]),
        ],
        confusability: Some(Confusability {
            names: names.iter().map(|n| (*n).to_owned()).collect(),
            chi_square: (0..names.len()).map(|i| (0..names.len()).map(|j| chi_square(i, j)).collect()).collect(),
        }),
        fly_next: vec![
            FlyNext { why: "To separate linear_drag from quadratic_drag".to_owned(), what: "excite_rich".to_owned() },
            FlyNext { why: "To narrow mass_error".to_owned(), what: "weigh the vehicle".to_owned() },
        ],
    }
}

/// The text of one panel.
fn panel<'a>(html: &'a str, id: &str) -> &'a str {
    let start = html.find(&format!("<section id=\"{id}\">")).unwrap_or_else(|| panic!("no {id}"));
    html[start..].split_once("</section>").unwrap().0
}

/// Balanced tags, and no number in a drawing that is none.
fn check(html: &str) {
    for tag in ["section", "svg", "figure", "table", "pre", "text"] {
        assert_eq!(
            html.matches(&format!("<{tag}")).count(),
            html.matches(&format!("</{tag}>")).count(),
            "{tag}"
        );
    }
    let body = &html[html.find("<main>").unwrap()..html.find("</main>").unwrap()];
    for bad in ["NaN", "inf\"", "inf ", "1000000"] {
        let around = body.find(bad).map(|i| &body[i.saturating_sub(60)..(i + 60).min(body.len())]);
        assert_eq!(around, None, "{bad}");
    }
}

#[test]
fn every_panel_holds_its_data() {
    let html = render(&example());
    check(&html);
    let out = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("gap-report.html");
    std::fs::write(&out, &html).unwrap();
    assert_eq!(html.matches("<section id=").count(), PANELS.len());
    for (id, held) in [
        (
            "answers",
            vec![
                "<h2>What is missing</h2>",
                "More drag, growing with speed",
                "<strong>30 : 1</strong>note of How sure",
                "9.30 \u{2192} 1.07",
                "The answer takes away 99.1 %.",
                "Dashes at several speeds.",
                "Where the answer acts: fx m/s\u{b2}",
                "rich 0, root mean square",
                "Set aside: rich 9: imu: held for 3 s",
            ],
        ),
        (
            "panel-h",
            vec![
                "lacks linear_drag",
                "0 to 9.20 m/s",
                "0.180 to 10.9 m",
                "+extra_drag_n_s_per_m = 0.0851",
            ],
        ),
        (
            "panel-a",
            vec![
                "rich 0",
                "rich 1",
                "before",
                "after",
                "fx m/s",
                "Mz N m",
                "max 9.0 m/s",
                "wings",
                "height",
            ],
        ),
        ("panel-b", vec!["1234", "1231", "rival within 5 nats", "payload_swing"]),
        (
            "panel-c",
            vec!["fx against forward airspeed", "6800 samples in 17 bins", "before", "after"],
        ),
        (
            "panel-d",
            vec![
                "normal 4",
                "best rival (quadratic_drag)",
                "0.0930 m/s",
                "0.0107 m/s",
                "noise floor",
            ],
        ),
        (
            "panel-e",
            vec![
                "fx: autocorrelation",
                "Q(40) = 61.3, p = 0.0168",
                "fz: correlation with inputs",
                "roll command",
            ],
        ),
        (
            "panel-f",
            vec![
                "0.0851 [0.0823, 0.0879] N s/m",
                "thrust_coefficient.thrust_fraction",
                "\u{2212}0.0610",
            ],
        ),
        (
            "panel-g",
            vec![
                "6.9",
                "17",
                "not separated",
                "fly excite_rich",
                "wings open at",
                "weigh the vehicle",
            ],
        ),
    ] {
        let text = panel(&html, id);
        for held in held {
            assert!(text.contains(held), "{id} lacks {held}");
        }
        assert!(!text.contains("class=\"missing\""), "{id} lacks something");
    }
    assert_eq!(render(&example()), html, "the same data gives the same bytes");
}

#[test]
fn what_is_missing_is_said_in_words() {
    let html = render(&ReportData::default());
    check(&html);
    for (id, words) in [
        ("answers", "No verdict"),
        ("panel-h", "No verdict"),
        ("panel-a", "No flight"),
        ("panel-b", "No evidence"),
        ("panel-c", "No regressor"),
        ("panel-d", "No held-out flight was given"),
        ("panel-e", "No residual after the fit"),
        ("panel-f", "No parameters"),
        ("panel-g", "No confusability"),
    ] {
        assert!(panel(&html, id).contains(words), "{id}");
    }
    assert!(panel(&render(&example()), "panel-d").contains("flown again in closed loop"));
    let mut partial = example();
    partial.closed_loop.clear();
    partial.flights[0].after.clear();
    partial.flights[1].after.clear();
    partial.set_aside.clear();
    let untried = Effects::<f64>::NAMES[0];
    partial.evidence.retain(|e| e.name != untried);
    partial.conditional[0].bins.clear();
    partial.held_out.as_mut().unwrap().horizons.clear();
    partial.whiteness[0].inputs.clear();
    let html = render(&partial);
    check(&html);
    let first = panel(&html, "answers");
    assert!(
        first.contains("Where they differ most: fx")
            && first.contains("nothing was added to the model")
    );
    assert!(!first.contains("Set aside"));
    assert!(panel(&html, "panel-a").contains("nothing was added to the model"));
    assert!(panel(&html, "panel-b").contains(untried), "at its place without a bar");
    assert!(panel(&html, "panel-c").contains("fx against forward airspeed: no samples"));
    assert!(panel(&html, "panel-d").contains("No horizons"));
    assert!(!panel(&html, "panel-d").contains("closed loop"));
    assert!(panel(&html, "panel-e").contains("No inputs"));
}

#[test]
fn numbers_that_are_none_leave_gaps_and_text_is_escaped() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -f64::MAX, 0.0] {
        let mut data = example();
        let flight = &mut data.flights[0];
        flight.before[0][3] = bad;
        flight.speed_m_s[2] = bad;
        flight.after.truncate(1);
        flight.after[0].truncate(5);
        data.flights[1].window_s = bad;
        data.evidence[0].nats = bad;
        data.conditional[0].bins[0].at = bad;
        data.conditional[0].bins[1].before_sd = bad;
        let held_out = data.held_out.as_mut().unwrap();
        held_out.channels[0].errors.nominal = bad;
        held_out.horizons[3].errors.fitted = bad;
        data.whiteness[0].autocorrelation[0] = bad;
        data.whiteness[0].band_99 = bad;
        data.whiteness[1].lag_s = bad;
        data.parameters[0].largest = bad;
        data.parameters[1].high = bad;
        let confusability = data.confusability.as_mut().unwrap();
        confusability.chi_square[0][1] = bad;
        confusability.chi_square.truncate(7);
        data.domain[0].low = bad;
        data.title = "<script>alert(1)</script>".to_owned();
        data.evidence[1].name = "<b>".to_owned();
        data.screen[0].answer = "<b>".to_owned();
        data.screen[0].figure = "<b>".to_owned();
        data.screen[1].sentences[0] = "<b>".to_owned();
        data.set_aside[0] = "<b>".to_owned();
        data.flights[0].name = "<b>".to_owned();
        let html = render(&data);
        check(&html);
        assert!(!html.contains("<script>alert") && !html.contains("<b>"), "{bad}");
    }
}

#[test]
fn ten_flights_of_five_minutes_stay_below_a_megabyte_and_a_half() {
    let mut data = example();
    data.flights = (0..10).map(|i| flight(&format!("flight {i}"), 3000)).collect();
    for f in &mut data.flights {
        f.window_s = 0.1;
        // With the velocities, nine channels.
        for rows in [&mut f.before, &mut f.after] {
            rows.extend_from_within(3..);
        }
    }
    let html = render(&data);
    check(&html);
    assert!(html.len() < 1_500_000, "{} bytes", html.len());
}

/// `SQUIRREL_GAP_REPORT=report.html cargo test -p squirrel-gap --test report` checks a report that
/// something else wrote.
#[test]
fn a_report_file_has_all_panels() {
    let file = std::env::var_os("SQUIRREL_GAP_REPORT");
    let html =
        file.map_or_else(|| render(&example()), |path| std::fs::read_to_string(path).unwrap());
    check(&html);
    for id in PANELS {
        let text = panel(&html, id);
        assert!(text.contains("<svg") || text.contains("<p"), "{id} is empty");
    }
}

#[test]
fn the_data_serialises_with_null_for_what_is_unknown() {
    let mut data = example();
    data.parameters[0].high = f64::NAN;
    let json = serde_json::to_string(&data).unwrap();
    assert!(json.contains("\"high\":null") && json.contains("\"band_99\":0.0526"));
}

#[test]
fn each_rotor_has_a_line_against_good_flights() {
    let page = render(&example());
    assert!(page.contains("22.1 % of its thrust lost, 17.5 to 26.9 %; 1"), "the line of rotor 3");
}
