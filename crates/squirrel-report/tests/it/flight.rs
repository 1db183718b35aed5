//! The flight report: every panel is there and holds data, and no log makes it fail or lie.

use std::collections::BTreeMap;

use super::support::{ARMS, heading, logs, views};
use squirrel_log::FlightLog;
use squirrel_report::flight::{FlightView, Heading, render};

/// Channels that the report reads.
const CHANNELS: [&str; 11] = [
    "truth.position_ned_m",
    "truth.velocity_ned_m_s",
    "truth.q_ned_from_body_wxyz",
    "reference.position_ned_m",
    "reference.velocity_ned_m_s",
    "wing.deployment",
    "wing.command",
    "control.outer.flag",
    "control.outer.mode",
    "control.outer.thrust_command_n",
    "control.inner.thrust_n",
];

fn report(logs: &[FlightLog]) -> String {
    render(&heading(), &views(logs))
}

/// Title and markup of each figure.
fn figures(html: &str) -> Vec<(&str, &str)> {
    let figures = html.split("<figure>").skip(1).map(|f| f.split("</figure>").next().unwrap());
    figures.map(|f| (f.split("<h3>").nth(1).unwrap().split("</h3>").next().unwrap(), f)).collect()
}

/// Every attribute value of a kind, such as ` d="`.
fn attributes<'a>(markup: &'a str, kind: &'a str) -> impl Iterator<Item = &'a str> {
    markup.split(kind).skip(1).map(|rest| rest.split('"').next().unwrap())
}

/// Points in all paths of curves and tracks.
fn drawn_points(markup: &str) -> usize {
    let curves = markup
        .split("<path class=\"")
        .skip(1)
        .filter(|p| p.starts_with("line ") || p.starts_with("track "));
    curves.map(|p| attributes(p, " d=\"").next().unwrap().split([' ', 'M']).count() / 2).sum()
}

/// Checks that tags balance, attributes are quoted and numbers in drawings are numbers.
pub(crate) fn check(html: &str) {
    let body = html.split("<body>").nth(1).unwrap().split("<script>").next().unwrap();
    let mut open = Vec::new();
    for piece in body.split('<').skip(1) {
        let (tag, _) = piece.split_once('>').expect("a tag that ends");
        let name = tag.trim_start_matches('/').split([' ', '\n', '/']).next().unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "closing {tag}");
        } else if !tag.ends_with('/') {
            open.push(name);
        }
        assert_eq!(tag.matches('"').count() % 2, 0, "quotes in {tag}");
        for value in tag.split('"').skip(1).step_by(2).chain(piece.split('>').nth(1)) {
            for word in ["NaN", "inf", "Infinity"] {
                assert!(
                    !value.split([' ', ',']).any(|w| w.trim_matches('-') == word),
                    "{word} in {piece}"
                );
            }
        }
    }
    assert!(open.is_empty(), "unclosed {open:?}");
    for d in attributes(body, " d=\"") {
        let sane = d.chars().all(|c| c.is_ascii_digit() || " .-MLAZhe,".contains(c));
        assert!(sane && d.starts_with('M'), "path {d}");
    }
}

#[test]
fn the_report_is_one_small_file_that_needs_no_network() {
    let long = report(&logs(15.0));
    assert!(long.len() < 1_000_000, "{} bytes", long.len());
    for word in ["src=", "href=", "@import", "url(", "fetch(", "XMLHttp"] {
        assert!(!long.contains(word), "{word}");
    }
    // To look at.
    let short = logs(6.0);
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join("report.html"), report(&short)).unwrap();
    std::fs::write(folder.join("report_one_arm.html"), render(&heading(), &views(&short)[2..]))
        .unwrap();
}

#[test]
fn the_same_flights_give_the_same_bytes() {
    assert_eq!(report(&logs(6.0)), report(&logs(6.0)));
}

#[test]
fn every_panel_is_there_and_holds_data() {
    let logs = logs(6.0);
    let html = report(&logs);
    check(&html);
    assert!(!html.contains("the log lacks"));
    let mut wanted = vec!["3-D track of every arm"];
    wanted.extend(ARMS.map(|a| a.0));
    wanted.extend(["Tilt", "Collective thrust command"]);
    wanted.extend(ARMS.map(|a| a.0));
    wanted.extend(["3-D error", "Horizontal error", "Height error", "Speed"]);
    let found = figures(&html);
    assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), wanted);
    for (title, markup) in &found {
        assert!(drawn_points(markup) > 80, "{title} draws {} points", drawn_points(markup));
    }
    for (title, markup) in found.iter().filter(|f| wanted[4..6].contains(&f.0)) {
        assert!(markup.contains(">limit "), "{title} shows its limit");
    }
    for (_, markup) in &found[1..4] {
        assert_eq!(
            markup.matches("obstacle").count(),
            4,
            "two obstacles from above and from the side"
        );
        assert!(markup.contains("track v0") || markup.contains("track v2"), "speed is the colour");
    }
    let alone = render(&heading(), &views(&logs)[..1]);
    check(&alone);
    assert_eq!(figures(&alone).len(), 10);
}

#[test]
fn the_first_view_and_the_script_agree_on_what_is_drawn() {
    let html = report(&logs(6.0));
    let scene = figures(&html)[0].1;
    let solid = scene.split("class=\"solid\"").nth(1).unwrap();
    assert_eq!(solid.matches("data-c=").count(), 2, "an obstacle of all arms is drawn once");
    for path in solid.split("<path").skip(1).filter(|p| p.contains("data-p=")) {
        let drawn = attributes(path, " d=\"").next().unwrap().split(' ').count() / 2;
        let stored = attributes(path, " data-p=\"").next().unwrap().split(' ').count();
        assert_eq!(drawn, stored, "{path}");
    }
}

#[test]
fn a_missing_channel_is_named_and_the_other_arms_stay() {
    for name in CHANNELS {
        let mut logs = logs(2.0);
        let (source, channel) = name.rsplit_once('.').unwrap();
        logs[1].sources.get_mut(source).unwrap().channels.remove(channel);
        let html = report(&logs);
        check(&html);
        assert!(html.contains(&format!("twcc_flat: the log lacks {name}.")), "{name}");
        assert!(!html.contains("pc: the log lacks"), "{name}");
    }
    let html =
        report(&[const { FlightLog { metadata: BTreeMap::new(), sources: BTreeMap::new() } }; 3]);
    check(&html);
    for name in CHANNELS {
        assert_eq!(html.matches(name).count() % 3, 0, "{name}");
        assert!(html.contains(name), "{name}");
    }
}

#[test]
fn a_channel_of_the_wrong_shape_is_named_too() {
    let mut logs = logs(2.0);
    let truth = logs[0].sources.get_mut("truth").unwrap();
    truth.channels.get_mut("velocity_ned_m_s").unwrap().width = 2;
    truth.channels.get_mut("q_ned_from_body_wxyz").unwrap().values.truncate(7);
    let html = report(&logs);
    check(&html);
    assert!(
        html.contains(
            "pc: the log lacks truth.velocity_ned_m_s with 3 numbers a sample (it has 2)."
        )
    );
    assert!(
        html.contains("pc: the log lacks truth.q_ned_from_body_wxyz with 2404 numbers (it has 7).")
    );
}

#[test]
fn text_is_escaped_everywhere() {
    let logs = logs(1.0);
    let bad = "<script>alert('x')</script> & \"quoted\" \u{0}";
    let mut flights = views(&logs);
    flights[0].arm = bad;
    flights[0].summary = vec![(bad.to_owned(), bad.to_owned())];
    let heading = Heading {
        title: bad.to_owned(),
        lead: bad.to_owned(),
        facts: vec![(bad.to_owned(), bad.to_owned())],
        card: bad.to_owned(),
    };
    let html = render(&heading, &flights);
    check(&html);
    assert!(!html.contains("<script>alert") && !html.contains('\u{0}') && !html.contains("& \""));
    assert!(html.matches("&lt;script&gt;alert(&#39;x&#39;)").count() > 10);
}

#[test]
fn gaps_break_lines() {
    let whole = logs(6.0);
    let mut torn = whole.clone();
    let truth = torn[0].sources.get_mut("truth").unwrap();
    for channel in truth.channels.values_mut() {
        let (from, to) = (600 * channel.width, 660 * channel.width);
        channel.values[from..to].fill(f64::NAN);
    }
    let (whole, torn) = (report(&whole), report(&torn));
    check(&torn);
    // The curve comes before its key in the legend.
    let strokes = |html: &str, title: &str| {
        let markup = figures(html).into_iter().find(|f| f.0 == title).unwrap().1;
        let line = markup.split("<path class=\"line s0\"").nth(1).unwrap();
        attributes(line, " d=\"").next().unwrap().matches('M').count()
    };
    for title in ["Tilt", "3-D error", "Speed"] {
        assert_eq!((strokes(&whole, title), strokes(&torn, title)), (1, 2), "{title}");
    }
}

#[test]
fn broken_flights_neither_panic_nor_leave_numbers_that_are_none() {
    let set = |log: &mut FlightLog, value: f64| {
        for channel in log.sources.values_mut().flat_map(|s| s.channels.values_mut()) {
            channel.values.fill(value);
        }
    };
    for value in [
        0.0,
        1e300,
        -1e300,
        f64::MIN_POSITIVE,
        f64::MAX,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ] {
        let mut logs = logs(1.0);
        set(&mut logs[0], value);
        check(&report(&logs));
        for log in &mut logs {
            set(log, value);
        }
        check(&report(&logs));
    }
    let mut logs = logs(1.0);
    for source in logs[0].sources.values_mut() {
        source.time_s.reverse();
    }
    for source in logs[1].sources.values_mut() {
        source.time_s.fill(f64::NAN);
    }
    for source in logs[2].sources.values_mut() {
        source.time_s.truncate(1);
        source.channels.values_mut().for_each(|c| c.values.truncate(c.width));
    }
    check(&report(&logs));
    let mut flights = views(&logs);
    for (flight, bad) in flights.iter_mut().zip([f64::NAN, f64::INFINITY, 1e308]) {
        (flight.tilt_max_rad, flight.thrust_max_n) = (bad, bad);
        flight.obstacles = vec![
            [f64::NAN, 0.0, 1.0],
            [0.0, 0.0, f64::INFINITY],
            [1e300, 0.0, 1.0],
            [0.0, 0.0, -1.0],
        ];
    }
    check(&render(&heading(), &flights));
    check(&render(&Heading::default(), &[]));
}

#[test]
fn many_arms_keep_distinct_lines() {
    let logs = logs(2.0);
    let names = (0..12).map(|i| format!("arm_{i}")).collect::<Vec<_>>();
    let views = views(&logs);
    let flights: Vec<FlightView<'_>> =
        names.iter().map(|arm| FlightView { arm, ..views[0].clone() }).collect();
    let html = render(&heading(), &flights);
    check(&html);
    for i in 0..12 {
        let class = if i < 8 { format!("line s{i}") } else { format!("line s{} dash1", i - 8) };
        assert!(html.contains(&format!("class=\"{class}\"")), "{class}");
    }
}
