//! `squirrel view`: the scene of a flight of each arm has the log's numbers, and whatever a log is,
//! it is a page or one line.

use super::support::{Folder, MAP, SQUIRREL, json};
use serde_json::Value;
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use std::fs;

/// The scene of a page.
fn scene(folder: &Folder, name: &str) -> Value {
    let html = fs::read_to_string(folder.0.join(name)).unwrap();
    let begun = html.split("<script type=\"application/json\" id=\"scene\">").nth(1).unwrap();
    serde_json::from_str(begun.split("</script>").next().unwrap()).unwrap()
}

/// Rows of a track, as the page's script makes them.
fn rows(track: &Value) -> Vec<Vec<f64>> {
    let width = track["width"].as_u64().unwrap() as usize;
    let step = track["step"].as_f64().unwrap();
    let mut sums = vec![0_i64; width];
    let numbers = track["deltas"].as_array().unwrap().iter().enumerate().map(|(k, delta)| {
        sums[k % width] += delta.as_i64().unwrap();
        sums[k % width] as f64 * step
    });
    numbers.collect::<Vec<_>>().chunks_exact(width).map(<[f64]>::to_vec).collect()
}

/// How far a scene is from its log at instants that both have, in steps of the scene.
fn steps_off(flight: &Value, log: &FlightLog, name: &str) -> f64 {
    let track = &flight["tracks"][name];
    let (times, channel) = log.channel(track["from"].as_str().unwrap()).unwrap();
    let (step, mut compared, mut most) = (track["step"].as_f64().unwrap(), 0, 0.0_f64);
    for (k, row) in rows(track).iter().enumerate() {
        let t = flight["clock"]["begin_s"].as_f64().unwrap()
            + k as f64 / flight["clock"]["rate_hz"].as_f64().unwrap();
        let after = times.partition_point(|x| *x < t - 1e-6);
        if times.get(after).is_none_or(|x| (x - t).abs() > 2e-6) {
            continue;
        }
        let logged = channel.row(after);
        // A quaternion and its negative are one attitude.
        let dot: f64 = row.iter().zip(logged).map(|(a, b)| a * b).sum();
        let sign = if name == "attitude" { dot.signum() } else { 1.0 };
        let off = row.iter().zip(logged).map(|(a, b)| (sign * a - b).abs() / step);
        most = off.fold(most, f64::max);
        compared += 1;
    }
    assert!(compared > 100, "{name}: {compared} instants in common");
    most
}

#[test]
fn each_arm_has_a_scene_with_the_numbers_of_its_log() {
    let folder = Folder::new("view_arms");
    for arm in Arm::all() {
        let name = arm.name();
        let [log, html, figures] =
            ["mcap", "html", "json"].map(|ending| format!("{name}.{ending}"));
        folder.succeeds(&[
            "fly",
            "--arm",
            name,
            "--scenario",
            "avoid",
            "--seed",
            "3",
            "--out",
            &log,
        ]);
        let said = folder.succeeds(&["view", &log, "--out", &html, "--json", &figures]);
        let bytes = fs::metadata(folder.0.join(&html)).unwrap().len();
        assert!(bytes < 2_000_000, "{name}: {bytes} bytes");

        let figures = json(&folder, &figures);
        assert_eq!(figures["bytes"].as_u64(), Some(bytes));
        let (triangles, calls) = (&figures["triangles"], &figures["draw_calls"]);
        assert!(said.contains(&format!("{triangles} triangles in {calls} draw calls")), "{said}");
        assert!(triangles.as_u64().unwrap() < 20_000 && calls.as_u64().unwrap() < 150);

        let log = FlightLog::read(&folder.0.join(&log)).unwrap();
        let scene = scene(&folder, &html);
        let flight = &scene["flights"][0];
        assert_eq!(flight["name"], name);
        assert_eq!(flight["lacks"].as_array().map(Vec::len), Some(0), "{}", flight["lacks"]);
        for track in
            ["position", "attitude", "velocity", "deployment", "rotor_speed", "wing_force", "wind"]
        {
            let off = steps_off(flight, &log, track);
            assert!(off < 0.51, "{name}: {track} is {off} steps off");
        }
        // Where wings open from folded on, the three instants are there.
        let (_, wings) = log.channel("wing.deployment").unwrap();
        let opens = wings.values.iter().any(|d| *d > 0.96) && wings.values[0] < 0.02;
        let moments = flight["moments"].as_array().unwrap();
        assert!(!opens || moments.len() >= 3, "{name}: {moments:?}");
    }
}

#[test]
fn rotors_and_wings_are_where_the_vehicle_file_has_them() {
    let folder = Folder::new("view_body");
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "hover", "--out", "f.mcap"]);
    folder.succeeds(&["view", "f.mcap", "--out", "v.html"]);
    let body = &scene(&folder, "v.html")["flights"][0]["body"];
    let hubs: Vec<&Value> =
        body["rotors"].as_array().unwrap().iter().map(|r| &r["hub_body_m"]).collect();
    assert_eq!(hubs[0], &serde_json::json!([0.085, -0.085, 0.0]));
    // The first turns clockwise seen from above.
    assert_eq!(body["rotors"][0]["spin"], 1.0);
    let near = |x: &Value, number: f64| (x.as_f64().unwrap() - number).abs() < 1e-9;
    let wing = &body["wing"];
    assert!(
        near(&wing["chord_m"], 0.2)
            && near(&wing["span_m"], 0.1)
            && near(&wing["root_body_m"][1], 0.04)
    );
    // Arrows of thrust are what the rotors' speeds make: in hover they carry the weight.
    let scene = scene(&folder, "v.html");
    let thrust = rows(&scene["flights"][0]["tracks"]["thrust"]);
    let sum: f64 = thrust[thrust.len() - 1].iter().sum();
    assert!((sum / body["weight_n"].as_f64().unwrap() - 1.0).abs() < 0.05, "{sum} N");
}

#[test]
fn the_report_of_a_flight_has_its_scene() {
    let folder = Folder::new("view_report");
    let fly = ["fly", "--arm", "twcc_plus", "--scenario", "avoid", "--seed", "3"];
    folder.succeeds(&[&fly[..], &["--out", "f.mcap", "--report", "r.html"]].concat());
    let log = FlightLog::read(&folder.0.join("f.mcap")).unwrap();
    let scene = scene(&folder, "r.html");
    for track in ["position", "attitude", "deployment"] {
        let off = steps_off(&scene["flights"][0], &log, track);
        assert!(off < 0.51, "{track} is {off} steps off");
    }
    let bytes = fs::metadata(folder.0.join("r.html")).unwrap().len();
    assert!(bytes < 500_000, "{bytes} bytes");
}

#[test]
fn two_flights_stand_side_by_side() {
    let folder = Folder::new("view_two");
    for arm in ["pc", "twcc_plus"] {
        let log = format!("{arm}.mcap");
        folder.succeeds(&[
            "fly",
            "--arm",
            arm,
            "--scenario",
            "avoid",
            "--seed",
            "3",
            "--out",
            &log,
        ]);
    }
    let said = folder.succeeds(&[
        "view",
        "pc.mcap",
        "twcc_plus.mcap",
        "--out",
        "v.html",
        "--json",
        "v.json",
    ]);
    assert!(said.contains("pc ") && said.contains("twcc_plus"), "{said}");
    let flights = &json(&folder, "v.json")["flights"];
    assert_eq!(flights.as_array().map(Vec::len), Some(2));
    assert_eq!(scene(&folder, "v.html")["moved"], false);
    let html = fs::read_to_string(folder.0.join("v.html")).unwrap();
    assert!(html.contains("side by side") && html.len() < 2_000_000);
    // Names tell flights of one arm apart.
    fs::copy(folder.0.join("pc.mcap"), folder.0.join("again.mcap")).unwrap();
    folder.succeeds(&["view", "pc.mcap", "again.mcap", "--out", "w.html"]);
    let again = scene(&folder, "w.html");
    assert_eq!([&again["flights"][0]["name"], &again["flights"][1]["name"]], ["pc", "again"]);
}

#[test]
fn a_foreign_log_with_an_attitude_alone_is_a_page() {
    let folder = Folder::new("view_foreign");
    let map = MAP.replace(
        "\"imu.omega_body_rad_s\" = { columns = [\"gx\", \"gy\", \"gz\"], body = \"frd\" }",
        "\"attitude.q_ned_from_body_wxyz\" = { columns = [\"w\", \"x\", \"y\", \"z\"], order = \"wxyz\", world = \"ned\", body = \"frd\", direction = \"world_from_body\" }",
    );
    folder.write("map.toml", &map);
    let line = |k: u32| format!("{},0.8,0.6,0,0\n", 100.0 + f64::from(k) * 0.1);
    folder.write("f.csv", &("t,w,x,y,z\n".to_owned() + &(0..20).map(line).collect::<String>()));
    folder.succeeds(&["import", "--map", "map.toml", "f.csv", "--out", "f.mcap"]);
    folder.succeeds(&["view", "f.mcap", "--out", "v.html", "--json", "v.json"]);
    let lacks = json(&folder, "v.json")["flights"][0]["lacks"].to_string();
    for lack in ["stand-in", "stays at the origin", "rotors stand still", "no arrows of thrust"] {
        assert!(lacks.contains(lack), "{lack}: {lacks}");
    }
    let attitude = rows(&scene(&folder, "v.html")["flights"][0]["tracks"]["attitude"]);
    assert!((attitude[5][0] - 0.8).abs() < 1e-4 && (attitude[5][1] - 0.6).abs() < 1e-4);
    assert_eq!(scene(&folder, "v.html")["flights"][0]["tracks"]["thrust"], Value::Null);
    // With its vehicle file it is drawn as it is.
    folder.write("v.toml", SQUIRREL);
    folder.succeeds(&["view", "f.mcap", "--vehicle", "v.toml", "--out", "w.html"]);
    let html = fs::read_to_string(folder.0.join("w.html")).unwrap();
    assert!(!html.contains("stand-in") && html.contains("wings are drawn folded"));
}

#[test]
fn what_cannot_be_viewed_is_one_line_and_no_file() {
    let folder = Folder::new("view_errors");
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "hover", "--out", "f.mcap"]);
    folder.write("map.toml", MAP);
    folder.write("f.csv", "t,gx,gy,gz\n0,1,2,3\n0.1,1,2,3\n");
    folder.succeeds(&["import", "--map", "map.toml", "f.csv", "--out", "gyro.mcap"]);
    folder.write("v.toml", SQUIRREL);
    folder.write("broken.toml", "name = 3");
    folder.fails(
        &["view", "gyro.mcap", "--out", "v.html"],
        &["gyro.mcap: has no attitude", "truth."],
    );
    folder.fails(
        &["view", "f.mcap", "gyro.mcap", "--out", "v.html"],
        &["gyro.mcap: has no attitude"],
    );
    folder.fails(&["view", "none.mcap", "--out", "v.html"], &["none.mcap"]);
    folder.fails(&["view", "f.csv", "--out", "v.html"], &["f.csv"]);
    folder.fails(&["view", "f.mcap", "--out", "f.mcap"], &["--out f.mcap", "FLIGHT f.mcap"]);
    folder.fails(
        &["view", "f.mcap", "--vehicle", "v.toml", "--out", "v.html", "--json", "v.toml"],
        &["--json v.toml", "--vehicle v.toml"],
    );
    folder.fails(
        &["view", "f.mcap", "--out", "v.html", "--json", "v.html"],
        &["--json v.html", "each result needs a file of its own"],
    );
    folder.fails(&["view", "f.mcap", "--out", "no/such/v.html"], &["no/such"]);
    folder.fails(
        &["view", "f.mcap", "--vehicle", "broken.toml", "--out", "v.html"],
        &["broken.toml, line 1"],
    );
    for usage in [&["view", "--out", "v.html"][..], &["view", "f.mcap"]] {
        assert_eq!(folder.run(usage).status.code(), Some(2));
    }
    assert_eq!(folder.run(&["view", "a", "b", "c", "--out", "v.html"]).status.code(), Some(2));
}

#[test]
fn what_a_log_says_of_itself_stays_text() {
    let folder = Folder::new("view_hostile");
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "hover", "--out", "f.mcap"]);
    let mut log = FlightLog::read(&folder.0.join("f.mcap")).unwrap();
    let hostile = "</script><img src=x onerror=alert(1)>";
    for key in ["arm", "vehicle", "seed", "vehicle_toml", "estimator"] {
        log.metadata.insert(key.to_owned(), hostile.to_owned());
    }
    log.write(&folder.0.join("g.mcap")).unwrap();
    folder.succeeds(&["view", "g.mcap", "--out", "v.html"]);
    let html = fs::read_to_string(folder.0.join("v.html")).unwrap();
    assert!(!html.contains("<img"));
    assert_eq!(scene(&folder, "v.html")["flights"][0]["name"], hostile);
    // Its vehicle cannot be read, which is said, and a stand-in with its rotors flies.
    assert!(html.contains("metadata vehicle_toml") && html.contains("stand-in"));
    assert_eq!(
        scene(&folder, "v.html")["flights"][0]["body"]["rotors"].as_array().unwrap().len(),
        4
    );
}

#[test]
fn rotors_without_a_speed_turn_as_commanded() {
    let folder = Folder::new("view_commands");
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "hover", "--out", "f.mcap"]);
    let mut log = FlightLog::read(&folder.0.join("f.mcap")).unwrap();
    log.sources.get_mut("rotor").unwrap().channels.remove("speed_rad_s");
    log.write(&folder.0.join("g.mcap")).unwrap();
    folder.succeeds(&["view", "g.mcap", "--out", "v.html"]);
    let scene = scene(&folder, "v.html");
    let flight = &scene["flights"][0];
    assert!(
        flight["lacks"].to_string().contains("rotors turn as commanded"),
        "{}",
        flight["lacks"]
    );
    let (_, command) = log.channel("rotor.command").unwrap();
    let (speed, thrust) =
        (rows(&flight["tracks"]["rotor_speed"]), rows(&flight["tracks"]["thrust"]));
    // The squirrel's commands are shares of 3000 rad/s, of which the thrust is 5.4 N.
    for k in [50, 200, 400] {
        let share = command.row(6 * k)[2];
        assert!((speed[k][2] - 3000.0 * share).abs() < 0.51, "{share}: {} rad/s", speed[k][2]);
        assert!((thrust[k][2] - 5.4 * share * share).abs() < 1e-3, "{share}: {} N", thrust[k][2]);
    }
}
