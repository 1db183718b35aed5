//! `squirrel reach` as a program.

use super::support::{Folder, SQUIRREL, json};
use std::fs;

#[test]
fn a_sweep_is_a_table_a_json_and_a_page() {
    let folder = Folder::new("reach");
    let arguments = ["reach", "--speeds", "5,7", "--descent-deg", "0,90", "--ratios", "1.1,2"];
    let table =
        folder.succeeds(&[&arguments[..], &["--json", "r.json", "--html", "r.html"]].concat());
    // Head, rule and a row for each of eight cases, all of them aligned.
    let rows: Vec<&str> = table.lines().skip_while(|line| !line.contains("T/W")).take(10).collect();
    assert!(rows[1..].iter().all(|row| row.len() == rows[0].len()), "{table}");
    let reached = json(&folder, "r.json");
    assert_eq!(
        (reached["vehicle"].as_str(), reached["wing"].as_str()),
        (Some("squirrel"), Some("flat"))
    );
    assert_eq!((reached["tilt"].as_str(), reached["yaw_rad"].as_f64()), (Some("box"), Some(0.0)));
    let cases = reached["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 8);
    for key in [
        "upward_m_s2",
        "braking_height_free_m_s2",
        "braking_level_m_s2",
        "set_volume_m3_s6",
        "hull_volume_m3_s6",
    ] {
        let both = &cases[4][key];
        let [folded, with_wings, ratio] =
            ["folded", "with_wings", "ratio"].map(|name| both[name].as_f64().unwrap());
        assert!(
            with_wings >= folded && (ratio - with_wings / folded).abs() < 1e-12,
            "{key}: {both}"
        );
    }
    // At 7 m/s, level, T/W 1.1, as in docs/equations.md F; straight down there is nothing to brake.
    assert_eq!(
        (cases[4]["speed_m_s"].as_f64(), cases[4]["thrust_to_weight"].as_f64()),
        (Some(7.0), Some(1.1))
    );
    assert!((cases[4]["upward_m_s2"]["with_wings"].as_f64().unwrap() - 1.742).abs() < 1e-3);
    assert!(cases[7]["braking_level_m_s2"].is_null());
    let page = fs::read_to_string(folder.0.join("r.html")).unwrap();
    assert!(page.contains("class=\"chart scene\"") && page.contains("up [m/s\u{b2}]"));
    assert_eq!(folder.files(), ["r.html", "r.json"]);
}

#[test]
fn what_cannot_be_asked_is_one_line() {
    let folder = Folder::new("reach-refused");
    let cases: [(&[&str], &[&str]); 12] = [
        (&["--wing", "paper"], &["--wing = paper", "flat, membrane, parnn"]),
        (&["--tilt", "ball"], &["--tilt = ball", "box, cone"]),
        (&["--thrust-to-weight", "0"], &["--thrust-to-weight = 0", "> 0"]),
        (&["--thrust-to-weight", "NaN"], &["--thrust-to-weight = NaN"]),
        (&["--ratios", "1.1,-2"], &["--ratios = -2"]),
        (&["--velocity", "NaN,0,0"], &["--velocity = NaN", "finite"]),
        (&["--velocity", "1,2"], &["--velocity", "2 numbers"]),
        (&["--speeds=-1"], &["--speeds = -1"]),
        (&["--descent-deg", "37,91"], &["--descent-deg = 91", "-90 to 90"]),
        (&["--descent-deg", "NaN"], &["--descent-deg = NaN"]),
        (&["--yaw-rad", "inf"], &["--yaw-rad = inf"]),
        (&["--html", "nowhere/r.html"], &["nowhere/r.html"]),
    ];
    for (options, words) in cases {
        folder.fails(&[&["reach"], options].concat(), words);
    }
    let start = SQUIRREL.find("[wing]").unwrap();
    let end = SQUIRREL.find("[battery]").unwrap();
    folder.write("bare.toml", &format!("{}{}", &SQUIRREL[..start], &SQUIRREL[end..]));
    folder.fails(&["reach", "--vehicle", "bare.toml"], &["[wing]", "nothing to compare"]);
}
