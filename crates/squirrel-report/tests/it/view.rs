//! The scene of flights: its numbers are the log's, what a log lacks is said, and no name in a log
//! becomes part of the page.

use super::flight::check;
use super::support::{OBSTACLES, fly, heading, views};
use serde_json::Value;
use squirrel_log::FlightLog;
use squirrel_report::flight::{render as report, render_with_scene};
use squirrel_report::view::{Body, RotorShape, Scene, ViewFlight, WingShape, render, scene};

/// A cross of four rotors, with the wings of the squirrel.
fn body() -> Body {
    let hubs = [[0.085, -0.085], [-0.085, -0.085], [-0.085, 0.085], [0.085, 0.085]];
    let spin = [1.0, -1.0, 1.0, -1.0];
    let rotor = |([x, y], spin): ([f64; 2], f64)| RotorShape {
        hub_body_m: [x, y, 0.0],
        spin,
        radius_m: 0.05,
    };
    Body {
        rotors: hubs.into_iter().zip(spin).map(rotor).collect(),
        wing: Some(WingShape::new(0.02, 0.2, [0.0, 0.09, 0.02])),
        height_m: 0.025,
        weight_n: Some(5.37),
    }
}

fn view<'a>(name: &str, log: &'a FlightLog) -> ViewFlight<'a> {
    ViewFlight {
        name: name.to_owned(),
        log,
        body: body(),
        rotors: None,
        obstacles: OBSTACLES.to_vec(),
        notes: Vec::new(),
    }
}

fn page(scene: &Scene) -> String {
    render("a title", &[("vehicle".to_owned(), "squirrel".to_owned())], scene)
}

/// The data of a page, as a browser has it.
fn data(html: &str) -> Value {
    let begun = html.split("<script type=\"application/json\" id=\"scene\">").nth(1).unwrap();
    serde_json::from_str(begun.split("</script>").next().unwrap()).unwrap()
}

/// Rows of a track of the page, as its script reads them.
fn rows(data: &Value, flight: usize, name: &str) -> Vec<Vec<f64>> {
    let track = &data["flights"][flight]["tracks"][name];
    let width = track["width"].as_u64().unwrap() as usize;
    let step = track["step"].as_f64().unwrap();
    let mut sums = vec![0_i64; width];
    let deltas = track["deltas"].as_array().unwrap();
    let number = |(k, delta): (usize, &Value)| {
        delta.as_i64().map_or(f64::NAN, |delta| {
            sums[k % width] += delta;
            sums[k % width] as f64 * step
        })
    };
    let flat: Vec<f64> = deltas.iter().enumerate().map(number).collect();
    flat.chunks_exact(width).map(<[f64]>::to_vec).collect()
}

#[test]
fn numbers_of_the_scene_are_those_of_the_log() {
    let log = fly(7.0, true, 6.0);
    let html = page(&scene(&[view("twcc_flat", &log)]).unwrap());
    let data = data(&html);
    let clock = &data["flights"][0]["clock"];
    assert_eq!([clock["rate_hz"].as_f64(), clock["begin_s"].as_f64()], [Some(50.0), Some(0.0)]);
    let mut most_open = 0.0_f64;
    for (name, channel, step) in [
        ("position", "truth.position_ned_m", 1e-3),
        ("attitude", "truth.q_ned_from_body_wxyz", 1e-4),
        ("velocity", "truth.velocity_ned_m_s", 1e-3),
        ("deployment", "wing.deployment", 1e-3),
        ("thrust", "control.inner.thrust_n", 1e-3),
    ] {
        let rows = rows(&data, 0, name);
        assert_eq!(rows.len(), 301, "{name}");
        assert_eq!(data["flights"][0]["tracks"][name]["from"], channel);
        // The log has 300 samples a second: each sixth is an instant of the scene.
        let (times, logged) = log.channel(channel).unwrap();
        for (k, row) in rows.iter().enumerate() {
            assert!((times[6 * k] - k as f64 / 50.0).abs() < 1e-9);
            for (a, b) in row.iter().zip(logged.row(6 * k)) {
                assert!((a - b).abs() <= 0.501 * step, "{name} {k}: {a} is {b} in the log");
            }
            if name == "deployment" {
                most_open = most_open.max(row[0]);
            }
        }
    }
    assert!(most_open > 0.95, "{most_open}: the wings of this flight open");
    // Folded, opening and open are at hand, with the deployment of the log.
    let moments = data["flights"][0]["moments"].as_array().unwrap();
    let named: Vec<&str> = moments[..3].iter().map(|m| m["what"].as_str().unwrap()).collect();
    assert_eq!(named, ["folded", "opening", "open"]);
    let (_, deployment) = log.channel("wing.deployment").unwrap();
    for moment in moments {
        let t = moment["time_s"].as_f64().unwrap();
        let row = deployment.row((t * 300.0).round() as usize);
        let mean = f64::midpoint(row[0], row[1]);
        assert!((moment["deployment"].as_f64().unwrap() - mean).abs() < 1e-3, "{t}: {mean}");
    }
}

#[test]
fn the_page_is_small_needs_no_network_and_is_the_same_again() {
    let logs = [fly(7.0, true, 20.0), fly(5.2, false, 20.0)];
    let make = || page(&scene(&[view("twcc_flat", &logs[0]), view("pc", &logs[1])]).unwrap());
    let html = make();
    assert!(html.len() < 700_000, "{} bytes for two flights of 20 s", html.len());
    // The name of SVG is no address.
    let text = html.replace("http://www.w3.org/2000/svg", "");
    check(&html);
    for word in ["src=", "http:", "https:", "@import", "url(", "fetch(", "XMLHttp", "import("] {
        assert!(!text.contains(word), "{word}");
    }
    assert_eq!(html, make());
    std::fs::write(std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("view.html"), html)
        .unwrap();
}

#[test]
fn a_long_flight_is_thinned_and_says_so() {
    let mut log = fly(5.2, false, 1.0);
    let times: Vec<f64> = (0..60_000).map(|k| f64::from(k) * 0.02).collect();
    let truth = log.sources.get_mut("truth").unwrap();
    for (name, channel) in &mut truth.channels {
        let row =
            if name == "q_ned_from_body_wxyz" { vec![1.0, 0.0, 0.0, 0.0] } else { vec![1.5; 3] };
        channel.values = row.repeat(times.len());
    }
    truth.time_s = times;
    let scene = scene(&[view("long", &log)]).unwrap();
    assert_eq!((scene.flights[0].clock.rate_hz, scene.flights[0].clock.count), (5.0, 6_000));
    let html = page(&scene);
    assert!(html.contains("long: 6000 instants at 5 Hz"));
    assert!(html.len() < 2_000_000, "{}", html.len());
}

/// Triangles and draw calls are stated, and are those of the pieces that the page has.
#[test]
fn triangles_and_draw_calls_are_counted_and_stated() {
    let log = fly(7.0, true, 6.0);
    let html = page(&scene(&[view("a", &log), view("b", &log)]).unwrap());
    let data = data(&html);
    let (mut triangles, mut calls) = (0, 0);
    for flight in data["flights"].as_array().unwrap() {
        let pieces = flight["pieces"].as_array().unwrap();
        for piece in pieces {
            let mesh = &data["meshes"][piece["mesh"].as_str().unwrap()];
            triangles += mesh.as_array().unwrap().len() / 9;
        }
        // Two lines of 301 points, and the ground.
        triangles += 2 * 2 * 300 + 2;
        calls += pieces.len() + 2 + 1;
    }
    assert_eq!(data["triangles"].as_u64(), Some(triangles as u64));
    assert_eq!(data["draw_calls"].as_u64(), Some(calls as u64));
    assert!(html.contains(&format!("{triangles} triangles in {calls} draw calls a frame")));
    assert!(triangles < 10_000 && calls < 200, "{triangles} triangles, {calls} calls");
}

#[test]
fn wings_rotors_arrows_and_obstacles_are_among_the_pieces() {
    let log = fly(7.0, true, 6.0);
    let mut with_force = log.clone();
    let truth = with_force.sources.get_mut("truth").unwrap();
    let position = truth.channels["position_ned_m"].clone();
    for name in ["wing_force_body_n", "wind_ned_m_s"] {
        truth.channels.insert(name.to_owned(), position.clone());
    }
    let html = page(&scene(&[view("a", &with_force)]).unwrap());
    let data = data(&html);
    let on: Vec<&str> = data["flights"][0]["pieces"]
        .as_array()
        .unwrap()
        .iter()
        .map(|piece| piece["on"].as_str().unwrap())
        .collect();
    for frame in
        ["body", "rotor.3", "left.front", "right.skin", "right.edge", "shadow", "reference"]
    {
        assert!(on.contains(&frame), "{frame}: {on:?}");
    }
    for arrow in ["thrust", "wing_force", "weight", "wind", "velocity"] {
        let both = [format!("{arrow}.shaft.0"), format!("{arrow}.head.0")];
        assert!(both.iter().all(|piece| on.contains(&piece.as_str())), "{arrow}");
        assert!(html.contains(&format!("name=\"arrow\" value=\"{arrow}\"")), "{arrow}");
    }
    assert_eq!(on.iter().filter(|frame| **frame == "world").count(), OBSTACLES.len());
}

#[test]
fn an_attitude_alone_is_shown_at_the_origin() {
    let full = fly(7.0, true, 3.0);
    let mut log = FlightLog::default();
    let truth = &full.sources["truth"];
    let source = log.source_mut("attitude");
    source.time_s.clone_from(&truth.time_s);
    let attitude = truth.channels["q_ned_from_body_wxyz"].clone();
    source.channels.insert("q_ned_from_body_wxyz".to_owned(), attitude);
    let scene = scene(&[view("bare", &log)]).unwrap();
    let html = page(&scene);
    assert!(html.contains("bare: the log has no position: the vehicle stays at the origin."));
    for lack in
        ["wings are drawn folded", "rotors stand still", "no arrows of thrust", "no arrow of wind"]
    {
        assert!(html.contains(lack), "{lack}");
    }
    let data = data(&html);
    assert!(data["flights"][0]["tracks"]["position"].is_null());
    assert_eq!(rows(&data, 0, "attitude").len(), 151);
    assert!(scene.ground_m > 0.0, "below the vehicle");
}

#[test]
fn what_has_neither_position_nor_attitude_is_no_scene() {
    let full = fly(7.0, true, 1.0);
    let mut log = full.clone();
    log.sources.remove("truth");
    let (flight, problem) = scene(&[view("a", &full), view("b", &log)]).unwrap_err();
    assert_eq!(flight, 1);
    assert!(problem.starts_with("has no attitude (truth.q_ned_from_body_wxyz"), "{problem}");
    assert!(!problem.contains('\n'));
    // Nor has one whose numbers are none.
    let truth = log.sources.entry("truth".to_owned()).or_default();
    truth.time_s = vec![f64::NAN, f64::INFINITY];
    let channel = squirrel_log::Channel { width: 3, values: vec![f64::NAN; 6] };
    truth.channels.insert("position_ned_m".to_owned(), channel);
    assert!(scene(&[view("a", &log)]).is_err());
    log.sources.get_mut("truth").unwrap().time_s = vec![0.0, 1.0];
    assert!(scene(&[view("a", &log)]).is_err());
}

#[test]
fn commands_stand_in_for_wings_that_are_not_measured() {
    let mut log = fly(7.0, true, 6.0);
    log.sources.get_mut("wing").unwrap().channels.remove("deployment");
    let scene = scene(&[view("a", &log)]).unwrap();
    assert_eq!(scene.flights[0].tracks["deployment"].from, "wing.command");
    assert!(page(&scene).contains("a: wings are drawn as commanded"));
}

#[test]
fn flights_that_share_no_time_begin_together() {
    let (one, mut other) = (fly(7.0, true, 3.0), fly(5.2, false, 2.0));
    for source in other.sources.values_mut() {
        source.time_s.iter_mut().for_each(|t| *t += 1e5);
    }
    let apart = scene(&[view("a", &one), view("b", &other)]).unwrap();
    assert!(apart.moved);
    assert!((apart.range_s[0] - 0.0).abs() < 1e-9 && (apart.range_s[1] - 3.0).abs() < 1e-6);
    assert!((apart.flights[1].shift_s - 1e5).abs() < 1e-6);
    assert!(page(&apart).contains("share no time"));
    let same = scene(&[view("a", &one), view("b", &one)]).unwrap();
    assert!(!same.moved && same.flights[1].shift_s == 0.0);
}

#[test]
fn names_of_a_log_stay_text() {
    let log = fly(7.0, true, 1.0);
    let hostile = "</script><img src=x onerror=alert(1)>\"'&\u{2028}";
    let mut flight = view(hostile, &log);
    flight.notes.push(format!("{hostile}: a note"));
    let scene = scene(&[flight]).unwrap();
    let html = render(hostile, &[(hostile.to_owned(), hostile.to_owned())], &scene);
    assert!(!html.contains("<img"), "a name became an element");
    // The scene's own script, that of the page, and no other end.
    assert_eq!(html.matches("</script>").count(), 2);
    assert_eq!(data(&html)["flights"][0]["name"], hostile, "and is whole in the data");
}

#[test]
fn the_report_of_flights_has_the_scene_beside_its_charts() {
    let logs = [fly(5.2, false, 6.0), fly(7.0, true, 6.0)];
    let names = ["pc", "twcc_flat"];
    let flights: Vec<_> = names.iter().zip(&logs).map(|(name, log)| view(name, log)).collect();
    let scene = scene(&flights).unwrap();
    let views = views(&logs);
    let (with, without) =
        (render_with_scene(&heading(), &views, &scene), report(&heading(), &views));
    check(&with);
    assert_eq!(data(&with), data(&page(&scene)));
    assert!(!without.contains("<canvas") && with.matches("<canvas").count() == 1);
    assert_eq!(with.matches("<svg").count(), without.matches("<svg").count());
    assert!(with.len() < without.len() + 300_000, "{} and {}", with.len(), without.len());
}
