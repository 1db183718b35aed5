//! `squirrel plan` and `squirrel fly --reference` as a program.

use super::support::{Folder, json};
use squirrel_sim::scenario::Scenario;
use std::fs;

#[test]
fn a_plan_is_made_and_flown() {
    let folder = Folder::new("plan");
    let arguments = [
        "plan",
        "--scenario",
        "avoid",
        "--out",
        "p.mcap",
        "--json",
        "p.json",
        "--report",
        "p.html",
    ];
    let table = folder.succeeds(&arguments);
    assert!(
        table.contains("solved") && table.contains("flat") && table.contains("none"),
        "{table}"
    );
    let plan = || ["p.mcap", "p.json", "p.html"].map(|name| fs::read(folder.0.join(name)).unwrap());
    let first = plan();
    folder.succeeds(&arguments);
    assert!(plan() == first, "the same plan twice");
    let made = json(&folder, "p.json");
    let [with, without] = made["plans"].as_array().unwrap().as_slice() else { panic!("{made}") };
    assert_eq!((with["wing"].as_str(), without["wing"].as_str()), (Some("flat"), Some("none")));
    for key in [
        "status",
        "cost",
        "violation_m",
        "iterations",
        "rmse_m",
        "position_ned_m",
        "thrust_ned_n",
        "deployment",
    ] {
        assert!(!with[key].is_null() && !without[key].is_null(), "{key}");
    }
    assert!(with["cost"].as_f64() <= without["cost"].as_f64());
    assert_eq!(with["time_s"].as_array().unwrap().len(), 101);
    assert!(fs::read_to_string(folder.0.join("p.html")).unwrap().contains("<svg"));

    let fly = [
        "fly",
        "--scenario",
        "avoid",
        "--reference",
        "p.mcap",
        "--json",
        "f.json",
        "--out",
        "f.mcap",
    ];
    folder.succeeds(&fly);
    let flown = json(&folder, "f.json");
    let number = |key: &str| flown[key].as_f64().unwrap();
    assert!(number("rmse_m") < 0.3 && number("wings_open_s") > 0.3, "{flown}");
    // Commands from outside are inputs: the replay has them.
    folder.succeeds(&["replay", "f.mcap"]);
    // A log of a flight has a reference, too.
    folder.succeeds(&["fly", "--scenario", "hover", "--reference", "f.mcap"]);
}

#[test]
fn a_planner_is_an_arm() {
    let folder = Folder::new("planner");
    let text = folder.succeeds(&["fly", "--scenario", "hover", "--arm", "plan_wings"]);
    assert!(text.contains("plan_wings"), "{text}");
    let study = ["study", "table3", "--trials", "1", "--arms", "plan_no_wings"];
    let table = folder.succeeds(&study);
    assert!(table.contains("plan_no_wings"), "{table}");
}

#[test]
fn what_cannot_be_planned_or_followed_is_one_line() {
    let folder = Folder::new("plan-refused");
    folder.write("broken.mcap", "not a log");
    folder.succeeds(&["plan", "--scenario", "hover", "--horizon-s", "1", "--out", "p.mcap"]);
    folder.write(
        "low.toml",
        "name = \"low\"\nduration_s = 5.0\nheight_m = 25.0\n[mission]\nkind = \"hover\"\n",
    );
    let avoid = Scenario::find("avoid").unwrap();
    let thin = Scenario { solid_obstacles: true, obstacles: vec![[30.0, 0.0, 5e-4]], ..avoid };
    folder.write("thin.toml", &thin.to_toml());
    for (arguments, word) in [
        (vec!["plan", "--scenario", "thin.toml"], "thin.toml: obstacles[0] = [30, 0, 0.0005]"),
        (vec!["fly", "--scenario", "thin.toml"], "thin.toml: obstacles[0] = [30, 0, 0.0005]"),
        (
            vec!["fly", "--reference", "p.mcap", "--scenario", "hover", "--out", "none/f.mcap"],
            "none/f.mcap: ",
        ),
        (vec!["plan", "--scenario", "excite_rich"], "there is nothing to plan"),
        (vec!["plan", "--thrust-to-weight", "1.01"], "thrust_max_n"),
        (vec!["plan", "--thrust-to-weight", "nan"], "thrust_to_weight = NaN"),
        (vec!["plan", "--horizon-s", "nan"], "horizon_s = NaN"),
        (vec!["plan", "--horizon-s", "0.1"], "makes 1 steps"),
        (vec!["plan", "--step-s", "0"], "step_s = 0"),
        (vec!["plan", "--step-s", "0.001"], "steps, must make 2 to 400"),
        (vec!["plan", "--wing", "paper"], "known are flat, membrane, parnn, none"),
        (vec!["fly", "--reference", "no-such.mcap"], "no-such.mcap"),
        (
            vec!["fly", "--reference", "p.mcap", "--scenario", "excite_calm"],
            "manoeuvres of its own",
        ),
        (vec!["fly", "--reference", "p.mcap", "--scenario", "low.toml"], "begins 5.0 m from"),
        (vec!["fly", "--reference", "p.mcap", "--arm", "plan_wings"], "plans by itself"),
        (vec!["fly", "--reference", "broken.mcap"], "broken.mcap"),
    ] {
        folder.fails(&arguments, &[word]);
    }
}

/// A link to a device stands for it: were it replaced, it would be a file afterwards.
#[cfg(unix)]
#[test]
fn a_device_is_written_to_and_not_replaced() {
    let folder = Folder::new("device");
    std::os::unix::fs::symlink("/dev/null", folder.0.join("null.json")).unwrap();
    folder.succeeds(&["plan", "--scenario", "hover", "--horizon-s", "1", "--json", "null.json"]);
    assert!(fs::symlink_metadata(folder.0.join("null.json")).unwrap().file_type().is_symlink());
}
