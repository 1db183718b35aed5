//! The first screen of the report: each kind of verdict has its five answers, and their numbers are
//! those of the verdict.
//!
//! The pages are written to `target/tmp/first-screen-*.html`.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use squirrel_gap::report::{
    Answer, Conditional, Errors, Evidence, FlightPanel, HeldOut, HeldOutChannel, ReportData, render,
};
use squirrel_gap::{
    Alternative, Gap, Kind, Left, NamedEffect, SetAside, Value, Verdict, first_screen, significant,
};
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;

const QUESTIONS: [&str; 5] = [
    "What is missing",
    "How sure",
    "How much better it predicts",
    "What remains",
    "What to fly next",
];

fn size(value: f64, half: f64) -> Value {
    Value::Number { value, low: value - half, high: value + half }
}

fn weak_rotor(rotor: f64, evidence_nats: f64) -> NamedEffect {
    let rotor = Value::Number { value: rotor, low: rotor, high: rotor };
    let parameters =
        BTreeMap::from([("rotor", rotor), ("thrust_loss_fraction", size(0.243, 0.0196))]);
    NamedEffect { name: "weak_rotor", form: "standard", evidence_nats, parameters }
}

fn sag() -> NamedEffect {
    let parameters = BTreeMap::from([("voltage_exponent", size(0.9, 0.0392))]);
    NamedEffect { name: "battery_sag", form: "power", evidence_nats: 84.0, parameters }
}

fn other(effects: &[NamedEffect], evidence_nats: f64) -> Alternative {
    Alternative {
        effects: effects.iter().map(|e| e.name).collect(),
        evidence_nats,
        numbers: effects.to_vec(),
    }
}

fn left(channels: Vec<&'static str>, goes_with: Option<&str>) -> Left {
    let share_left = if channels.is_empty() { 0.0 } else { 0.126 };
    Left { share_removed: 0.973, share_left, channels, goes_with: goes_with.map(str::to_owned) }
}

/// A verdict of a kind as the workflow gives it.
fn verdict(kind: Kind) -> Verdict {
    let gap = Gap {
        held_out_flights: vec!["day 2/held.mcap".to_owned()],
        before: 8.774,
        after: 1.07,
        best_rival: Some(5.31),
        removed_fraction: 0.991,
        best_rival_removed_fraction: Some(0.446),
    };
    let mut verdict = Verdict {
        verdict: kind,
        effects: vec![weak_rotor(3.0, 43.2)],
        moved: Vec::new(),
        alternatives: vec![other(&[weak_rotor(2.0, f64::NAN)], 37.2)],
        places: Vec::new(),
        goes_with: None,
        fly_next: None,
        gap: Some(gap),
        leftover: Some(left(Vec::new(), None)),
        closed_loop: Vec::new(),
        model_patch: None,
        baseline: None,
        words: "Words of the verdict. More words.".to_owned(),
        set_aside: Vec::new(),
        notes: Vec::new(),
    };
    let family = "velocity (60 % of force_body_z_n)";
    let asked = "yaw steps (yaw_torque_coeff); hovers; and weigh it (weak_rotor); \
                 `squirrel fly --scenario excite_rich` flies most of it";
    match kind {
        Kind::Named => {}
        Kind::None => (verdict.effects, verdict.alternatives) = (Vec::new(), Vec::new()),
        Kind::NamedIncomplete => {
            verdict.leftover =
                Some(left(vec!["force_body_z_n", "moment_body_x_n_m"], Some(family)));
        }
        Kind::NamedFormDiffers => {
            (verdict.effects, verdict.goes_with) = (vec![sag()], Some(family.to_owned()));
            verdict.leftover = Some(left(vec!["force_body_z_n"], Some(family)));
        }
        Kind::Ambiguous => {
            verdict.alternatives[0].evidence_nats = 40.2;
            verdict.fly_next = Some(asked.to_owned());
        }
        Kind::OutsideCatalogue => {
            verdict.goes_with = Some(family.to_owned());
            verdict.leftover = Some(left(vec!["force_body_z_n"], Some(family)));
        }
        Kind::NotIdentifiable => {
            (verdict.effects, verdict.fly_next) = (Vec::new(), Some(asked.to_owned()));
        }
        Kind::DataProblem => {
            (verdict.effects, verdict.alternatives) = (Vec::new(), Vec::new());
            (verdict.gap, verdict.leftover) = (None, None);
            verdict.set_aside = vec![aside()];
        }
    }
    verdict
}

fn aside() -> SetAside {
    SetAside {
        flight: "day 1/<b>.mcap".to_owned(),
        channel: "battery.voltage_v",
        words: "day 1/<b>.mcap: battery.voltage_v: its mean is 16000 V; is it in mV?".to_owned(),
    }
}

const KINDS: [(Kind, &str); 8] = [
    (Kind::None, "none"),
    (Kind::Named, "named"),
    (Kind::NamedIncomplete, "named_incomplete"),
    (Kind::NamedFormDiffers, "named_form_differs"),
    (Kind::Ambiguous, "ambiguous"),
    (Kind::OutsideCatalogue, "outside_catalogue"),
    (Kind::NotIdentifiable, "not_identifiable"),
    (Kind::DataProblem, "data_problem"),
];

/// The report of a verdict: evidence, one held-out channel that gains, and one flight, as far as
/// the kind has them.
fn report(verdict: &Verdict, vehicle: &VehicleFile) -> ReportData {
    let mut data = ReportData {
        title: "Gap report: squirrel".to_owned(),
        verdict: verdict.words.clone(),
        channels: vec!["specific force x".to_owned(), "specific force z".to_owned()],
        ..ReportData::default()
    };
    if verdict.verdict != Kind::DataProblem {
        data.set_aside = verdict.set_aside.iter().map(|aside| aside.words.clone()).collect();
        let wave =
            |gain: f64| (0..40).map(|k| 1.0 + gain * (1.0 + (0.4 * f64::from(k)).sin())).collect();
        let after =
            if verdict.effects.is_empty() { Vec::new() } else { vec![wave(0.01), wave(0.1)] };
        data.flights = vec![FlightPanel {
            name: "day 1/a.mcap".to_owned(),
            window_s: 1.0,
            before: vec![wave(0.02), wave(8.0)],
            after,
            ..FlightPanel::default()
        }];
        let second = Errors { nominal: 0.5, rival: 0.4, fitted: 0.125, floor: 0.1 };
        let channel = |name: &str, unit: &str| HeldOutChannel {
            name: name.to_owned(),
            unit: unit.to_owned(),
            errors: second,
            second,
            horizons: Vec::new(),
        };
        data.held_out = Some(HeldOut {
            flights: vec!["day 2/held.mcap".to_owned()],
            rival: String::new(),
            channels: vec![
                channel("velocity down", "m/s"),
                channel("specific force z", "m/s\u{b2}"),
            ],
            horizons: Vec::new(),
        });
        let whole: f64 = verdict.effects.iter().map(|e| e.evidence_nats).sum();
        data.evidence = vec![Evidence {
            name: "all".to_owned(),
            nats: whole,
            is_answer: !verdict.effects.is_empty(),
        }];
    }
    data.screen = first_screen(verdict, vehicle, &data);
    data
}

fn screen(verdict: &Verdict) -> [Answer; 5] {
    report(verdict, &VehicleFile::squirrel()).screen.try_into().unwrap()
}

fn all(answer: &Answer) -> String {
    [&answer.answer, &answer.figure, &answer.figure_note]
        .into_iter()
        .chain(&answer.sentences)
        .fold(String::new(), |text, part| text + part + "\n")
}

fn three(value: f64) -> String {
    significant(value, 3).replace('-', "\u{2212}")
}

#[test]
fn every_kind_of_verdict_answers_five_questions() {
    for (kind, name) in KINDS {
        let verdict = verdict(kind);
        let data = report(&verdict, &VehicleFile::squirrel());
        let html = render(&data);
        let out = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"))
            .join(format!("first-screen-{name}.html"));
        std::fs::write(&out, &html).unwrap();
        let begun = html.split_once("<section id=\"answers\">").unwrap().1;
        let shown = begun.split_once("</section>").unwrap().0;
        assert_eq!(
            data.screen.iter().map(|a| a.question.as_str()).collect::<Vec<_>>(),
            QUESTIONS,
            "{name}"
        );
        for answer in &data.screen {
            assert!(
                !answer.answer.is_empty()
                    && !answer.sentences.is_empty() | !answer.figure.is_empty(),
                "{name}: {answer:?}"
            );
            assert!(shown.contains(&format!("<h2>{}</h2>", answer.question)), "{name}");
            assert!(answer.sentences.iter().all(|s| s.ends_with(['.', '?'])), "{name}: {answer:?}");
            let text = all(answer);
            for bad in ["NaN", "inf ", "@", "..", "\u{2013}"] {
                assert!(!text.contains(bad), "{name}: {bad}: {text}");
            }
        }
        for bad in ["NaN", "<b>", "<script"] {
            assert!(!shown.contains(bad), "{name}: {bad}");
        }
        assert_eq!(shown.contains("<svg"), kind != Kind::DataProblem, "{name}");
    }
}

#[test]
fn each_kind_says_what_is_missing_in_its_own_words() {
    for ((kind, name), words) in KINDS.into_iter().zip([
        "Nothing",
        "Rotor 3 gives less thrust",
        "Rotor 3 gives less thrust",
        "Thrust sags with the battery",
        "One of these: rotor 3 gives less thrust",
        "Something that is not in the catalogue",
        "Nothing seen, but these flights could not show everything",
        "The logs contradict themselves",
    ]) {
        let [missing, ..] = screen(&verdict(kind));
        assert!(missing.answer.starts_with(words), "{name}: {missing:?}");
    }
    let of = |kind| screen(&verdict(kind)).map(|answer| all(&answer));
    let [missing, sure, .., next] = of(Kind::Ambiguous);
    assert!(missing.contains("Or: thrust of rotor 2 (weak_rotor)."), "{missing}");
    assert!(sure.contains("Not decided") && sure.contains("20 : 1"), "{sure}");
    assert!(sure.contains("Odds below 400 : 1 do not decide."), "{sure}");
    assert!(
        next.contains("Yaw steps (yaw_torque_coeff).\nHovers; and weigh it (weak_rotor).\n"),
        "{next}"
    );
    assert!(
        next.contains(
            "\u{201c}squirrel fly --scenario excite_rich\u{201d} flies most of it; its card"
        ),
        "{next}"
    );
    let [.., remains, _] = of(Kind::NamedIncomplete);
    for words in ["the vertical force and the roll moment", "velocity (60 % of the vertical force)"]
    {
        assert!(remains.contains(words), "{remains}");
    }
    let [missing, _, better, ..] = of(Kind::OutsideCatalogue);
    assert!(
        missing.contains("The nearest name, thrust of rotor 3 (weak_rotor), does not account"),
        "{missing}"
    );
    assert!(better.contains("With the nearest name"), "{better}");
    let [missing, ..] = of(Kind::NotIdentifiable);
    assert!(
        missing.contains("Words of the verdict.\n") && !missing.contains("More words"),
        "{missing}"
    );
    let [missing, .., next] = of(Kind::DataProblem);
    assert!(missing.contains("is it in mV?") && next.contains("import map"), "{missing}{next}");
}

/// Every number that the verdict's JSON has, as the page writes it.
#[test]
fn numbers_are_those_of_the_verdict() {
    let named = verdict(Kind::NamedIncomplete);
    let json: serde_json::Value = serde_json::to_value(&named).unwrap();
    let [missing, sure, better, remains, _] = screen(&named);
    let loss = &json["effects"][0]["parameters"]["thrust_loss_fraction"];
    let [value, low, high] = ["value", "low", "high"].map(|key| loss[key].as_f64().unwrap());
    assert_eq!(missing.figure, format!("{} %", three(100.0 * value)));
    assert_eq!(
        missing.figure_note,
        format!("thrust loss, 95 %: {} to {} %", three(100.0 * low), three(100.0 * high))
    );
    // 43.2 nats of the answer, 37.2 of the same effect at another rotor: e^6 is 400; 0.243 over its
    // deviation of 0.01.
    assert_eq!(sure.figure, "400 : 1");
    assert!(
        all(&sure).contains("thrust of rotor 2 (weak_rotor), is 400 times less likely (6.00 nats)"),
        "{sure:?}"
    );
    assert!(all(&sure).contains("weak_rotor is 24.3 standard deviations"), "{sure:?}");
    let gap = |key: &str| json["gap"][key].as_f64().unwrap();
    assert_eq!(better.figure, format!("{} \u{2192} {}", three(gap("before")), three(gap("after"))));
    assert_eq!(better.answer, format!("{:.1} % less error", 100.0 * gap("removed_fraction")));
    assert!(all(&better).contains(&format!("leaves {}.", three(gap("best_rival")))), "{better:?}");
    let mass_kg = VehicleFile::squirrel().vehicle.parameters().mass_kg;
    let [before, after] = [0.5, 0.125].map(|x| three(mass_kg * x));
    let gain = format!("error of the vertical force from {before} N to {after} N.");
    assert!(all(&better).contains(&gain), "{better:?}");
    let share = json["leftover"]["share_left"].as_f64().unwrap();
    assert_eq!(remains.figure, format!("{:.0} %", 100.0 * share));
    let removed = json["leftover"]["share_removed"].as_f64().unwrap();
    assert!(all(&remains).contains(&format!("{:.1} %", 100.0 * removed)), "{remains:?}");
}

#[test]
fn what_speaks_against_an_answer_is_said() {
    let with = |change: &dyn Fn(&mut Verdict)| {
        let mut verdict = verdict(Kind::Named);
        change(&mut verdict);
        screen(&verdict).map(|answer| all(&answer))
    };
    let gap = |change: &dyn Fn(&mut Gap)| with(&|v| change(v.gap.as_mut().unwrap()));
    let [_, _, better, ..] = gap(&|gap| gap.best_rival = Some(1.06));
    assert!(better.contains("leaves 1.06, no worse"), "{better}");
    let [_, _, better, ..] = gap(&|gap| gap.best_rival = Some(1.0));
    assert!(better.contains("leaves 1.00, which is less"), "{better}");
    let [_, _, better, ..] = gap(&|gap| (gap.before, gap.after) = (1.0, 9.0));
    assert!(better.contains("It predicts worse") && !better.contains("less error"), "{better}");
    let [.., remains, next] = gap(&|gap| gap.after = 3.5);
    assert!(next.contains("put one like them among those to fit"), "{next}");
    assert!(remains.contains("more on held-out flights\n3.50"), "{remains}");
    let [_, sure, ..] = with(&|v| v.alternatives[0].evidence_nats = 41.9);
    assert!(
        sure.contains("Fairly sure") && sure.contains("3.7 times less likely (1.30 nats)"),
        "{sure}"
    );
    let [_, sure, ..] = with(&|v| v.alternatives[0].evidence_nats = 50.0);
    assert!(sure.contains("fits these flights as well") && !sure.contains(" : 1"), "{sure}");
    let [_, sure, ..] = with(&|v| v.alternatives.clear());
    assert!(sure.contains("> 1 million : 1") && sure.contains("Leaving out weak_rotor"), "{sure}");
    let [.., next] = with(&|v| {
        v.effects[0] = NamedEffect {
            parameters: BTreeMap::from([("voltage_exponent", size(0.9, 0.5))]),
            ..sag()
        }
    });
    assert!(next.contains("(\u{b1}56 %): climbs at full thrust"), "{next}");
    let [missing, _, _, _, next] = with(&|v| {
        v.verdict = Kind::OutsideCatalogue;
        let gap = v.gap.as_mut().unwrap();
        (gap.before, gap.after) = (1.0, 9.0);
    });
    assert!(
        missing.contains("Was the vehicle changed") && next.contains("with the vehicle unchanged"),
        "{missing}{next}"
    );
}

#[test]
fn without_a_held_out_flight_the_screen_asks_for_one() {
    let mut verdict = verdict(Kind::Named);
    verdict.gap = None;
    let vehicle = VehicleFile::squirrel();
    let mut data = report(&verdict, &vehicle);
    assert!(all(&data.screen[2]).contains("cannot be re-simulated"), "{:?}", data.screen[2]);
    assert!(
        all(&data.screen[4]).contains("attitude and velocity throughout"),
        "{:?}",
        data.screen[4]
    );
    data.held_out = None;
    let screen = first_screen(&verdict, &vehicle, &data);
    assert!(
        all(&screen[2]).contains("--held-out") && all(&screen[4]).contains("held out"),
        "{screen:?}"
    );
}

/// Names that all explanations share are the answer; what each has beside them is told as what
/// remains.
#[test]
fn what_explanations_share_is_sure_and_the_rest_remains() {
    let mut verdict = verdict(Kind::NamedIncomplete);
    verdict.leftover = Some(left(Vec::new(), None));
    verdict.alternatives = vec![
        other(&[weak_rotor(3.0, f64::NAN), sag()], 50.0),
        other(&[weak_rotor(3.0, f64::NAN)], 44.0),
    ];
    let [_, sure, _, remains, _] = screen(&verdict).map(|answer| all(&answer));
    assert!(sure.contains("Very sure") && sure.contains("Leaving out weak_rotor"), "{sure}");
    assert_eq!(remains.matches("Perhaps").count(), 1, "{remains}");
    assert!(
        remains.contains("Perhaps thrust that sags with the battery (battery_sag)."),
        "{remains}"
    );
}

/// The picture is of the channel that the answer acts on, also where tolerances help another one
/// more.
#[test]
fn the_picture_is_of_the_channel_that_the_answer_acts_on() {
    let mut data = report(&verdict(Kind::Named), &VehicleFile::squirrel());
    data.flights[0].before[0].iter_mut().for_each(|x| *x *= 100.0);
    assert!(render(&data).contains("Where the answer acts: the forward force"));
    data.conditional = vec![Conditional {
        channel: data.channels[1].clone(),
        unit: String::new(),
        regressor: String::new(),
        regressor_unit: String::new(),
        bins: Vec::new(),
    }];
    assert!(render(&data).contains("Where the answer acts: the vertical force"));
    data.flights[0].after = data.flights[0].before.clone();
    assert!(render(&data).contains("Where they differ most: the forward force"));
}

/// A file that has an effect already: what it overstates is less, and the distance is from the
/// file's own number.
#[test]
fn what_the_file_has_is_what_an_effect_is_told_against() {
    let text = VehicleFile::squirrel().text + "\n[effects.battery_sag]\nvoltage_exponent = 1.0\n";
    let vehicle = VehicleFile::parse(&text, "vehicle").unwrap();
    let mut verdict = verdict(Kind::Named);
    verdict.effects = vec![sag()];
    let data = report(&verdict, &vehicle);
    let [missing, sure] = [&data.screen[0], &data.screen[1]].map(all);
    assert!(missing.starts_with("Thrust sags less with the battery\n0.900\n"), "{missing}");
    assert!(missing.contains("the file has 1.00"), "{missing}");
    // 0.9 is 0.1 below, the deviation is 0.02.
    assert!(sure.contains("battery_sag is 5.00 standard deviations"), "{sure}");
}

/// Flights that were set aside stand beside the answers, two of them in full.
#[test]
fn flights_set_aside_stand_beside_the_answers() {
    let mut verdict = verdict(Kind::Named);
    verdict.set_aside = vec![aside(); 4];
    let html = render(&report(&verdict, &VehicleFile::squirrel()));
    assert_eq!(
        html.matches("Set aside: day 1/&lt;b&gt;.mcap: battery.voltage_v: its mean").count(),
        2
    );
    assert!(html.contains("Set aside: 2 more flights."));
}
