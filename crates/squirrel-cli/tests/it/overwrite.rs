//! What is read is never overwritten, no two results go into one file, and what is no file is
//! written to.

#![cfg(unix)]

use super::support::{Folder, MAP, SQUIRREL};
use squirrel_core::policy::Policy;
use squirrel_sim::scenario::Scenario;
use squirrel_sim::weights::PolicyWeights;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::os::unix::fs::symlink;
use std::process::{Command, Stdio};

const PARNN: &[u8] = include_bytes!("../../../../vehicles/squirrel-parnn.safetensors");

const STUDIES: [&str; 8] =
    ["faults", "filters", "forest", "planning", "steering", "table2", "table3", "thrust"];

/// A folder with one of everything that commands read.
fn with_inputs(name: &str) -> Folder {
    let folder = Folder::new(name);
    for made in ["f", "h", "csv", "d", "d/flights", "vectors", "part1", "part2"] {
        fs::create_dir(folder.0.join(made)).unwrap();
    }
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "hover", "--out", "f/a.mcap"]);
    fs::copy(folder.0.join("f/a.mcap"), folder.0.join("h/b.mcap")).unwrap();
    folder.succeeds(&["plan", "--scenario", "hover", "--horizon-s", "1", "--out", "plan.mcap"]);
    folder.write("v.toml", SQUIRREL);
    folder.write("w.toml", &SQUIRREL.replacen("squirrel-parnn.safetensors", "w.safetensors", 1));
    fs::write(folder.0.join("w.safetensors"), PARNN).unwrap();
    folder.write("s.toml", &Scenario::find("hover").unwrap().to_toml());
    PolicyWeights::save(&Policy::filled(0.0), &folder.0.join("p.safetensors")).unwrap();
    folder.write("map.toml", MAP);
    folder.write("files.toml", &MAP.replacen("[[source]]", "[[source]]\nfile = \"f.csv\"", 1));
    for table in ["f.csv", "csv/f.csv"] {
        folder.write(table, "t,gx,gy,gz\n0,1,2,3\n0.1,1,2,3\n");
    }
    for log in ["vectors/vectors.bin", "vectors/setup-0.bin", "d/find.json", "d/report.html"] {
        fs::copy(folder.0.join("f/a.mcap"), folder.0.join(log)).unwrap();
    }
    for vehicle in STUDIES.map(|study| format!("d/{study}.csv")) {
        folder.write(&vehicle, SQUIRREL);
    }
    for vehicle in
        ["d/flights/trial-001.toml", "d/t1.toml", "d/filters_in_loop.csv", "d/verdict.json"]
    {
        folder.write(vehicle, SQUIRREL);
    }
    for more in ["image.elf", "board.bin", "part1/thrust.trials.jsonl", "part2/thrust.trials.jsonl"]
    {
        folder.write(more, "{}\n");
    }
    symlink(".", folder.0.join("here")).unwrap();
    folder
}

/// The paths of a file: two of its name, one through a folder's link, a link, a hard link.
fn paths_of(folder: &Folder, file: &str) -> Vec<String> {
    let flat = file.replace('/', "-");
    let (link, hard) = (format!("link-{flat}"), format!("hard-{flat}"));
    if !folder.0.join(&link).exists() {
        symlink(folder.0.join(file), folder.0.join(&link)).unwrap();
        fs::hard_link(folder.0.join(file), folder.0.join(&hard)).unwrap();
    }
    vec![file.to_owned(), format!("./{file}"), format!("here/{file}"), link, hard]
}

/// Runs a command with every path of a file in the place of `@`: it is refused in a line that names
/// both arguments, and changes nothing.
fn is_refused(folder: &Folder, command: &str, file: &str, arguments: [&str; 2]) {
    let before = fs::read(folder.0.join(file)).unwrap();
    for path in paths_of(folder, file) {
        let command = command.replace('@', &path);
        let words: Vec<&str> = command.split_whitespace().collect();
        folder.fails(
            &words,
            &[arguments[0], arguments[1], file, "what is read is never overwritten"],
        );
        assert!(fs::read(folder.0.join(file)).unwrap() == before, "{command}: {file} is another");
    }
}

#[test]
fn no_command_overwrites_what_it_reads() {
    let folder = with_inputs("overwrite");
    let cases = [
        ("fly --vehicle v.toml --out @", "v.toml", ["--vehicle", "--out"]),
        ("fly --vehicle v.toml --report @", "v.toml", ["--vehicle", "--report"]),
        ("fly --vehicle v.toml --json @", "v.toml", ["--vehicle", "--json"]),
        ("fly --vehicle @ --json v.toml", "v.toml", ["--vehicle", "--json"]),
        ("fly --vehicle w.toml --out @", "w.safetensors", ["wing.parnn_weights", "--out"]),
        ("fly --scenario s.toml --out @", "s.toml", ["--scenario", "--out"]),
        ("fly --scenario s.toml --report @", "s.toml", ["--scenario", "--report"]),
        ("fly --scenario s.toml --json @", "s.toml", ["--scenario", "--json"]),
        ("fly --policy p.safetensors --out @", "p.safetensors", ["--policy", "--out"]),
        ("fly --policy p.safetensors --json @", "p.safetensors", ["--policy", "--json"]),
        (
            "fly --scenario hover --reference plan.mcap --out @",
            "plan.mcap",
            ["--reference", "--out"],
        ),
        ("fly --hil qemu --hil-image image.elf --json @", "image.elf", ["--hil-image", "--json"]),
        ("plan --vehicle v.toml --out @", "v.toml", ["--vehicle", "--out"]),
        ("plan --vehicle v.toml --report @", "v.toml", ["--vehicle", "--report"]),
        ("plan --scenario s.toml --json @", "s.toml", ["--scenario", "--json"]),
        ("reach --vehicle v.toml --html @", "v.toml", ["--vehicle", "--html"]),
        ("reach --vehicle v.toml --json @", "v.toml", ["--vehicle", "--json"]),
        ("vehicle check v.toml --json @", "v.toml", ["FILE", "--json"]),
        ("vehicle check w.toml --json @", "w.safetensors", ["wing.parnn_weights", "--json"]),
        ("replay f/a.mcap --json @", "f/a.mcap", ["FLIGHT", "--json"]),
        ("replay f/a.mcap --vehicle v.toml --json @", "v.toml", ["--vehicle", "--json"]),
        ("train flat_plate --flights f/a.mcap --out @", "f/a.mcap", ["--flights", "--out"]),
        ("train flat_plate --flights f --out @", "f/a.mcap", ["--flights", "--out"]),
        ("train flat_plate --flights f --out w --report @", "f/a.mcap", ["--flights", "--report"]),
        ("train flat_plate --flights f --out w --json @", "f/a.mcap", ["--flights", "--json"]),
        ("train flat_plate --flights f --vehicle v.toml --out @", "v.toml", ["--vehicle", "--out"]),
        (
            "train flat_plate --flights f --vehicle w.toml --out @",
            "w.safetensors",
            ["weights", "--out"],
        ),
        ("import --map map.toml f.csv --out @", "f.csv", ["PATHS", "--out"]),
        ("import --map map.toml f.csv --out x --json @", "f.csv", ["PATHS", "--json"]),
        ("import --map map.toml f.csv --out @", "map.toml", ["--map", "--out"]),
        ("import --map files.toml csv --out @", "csv/f.csv", ["PATHS", "--out"]),
        ("import --recover f/a.mcap --out @", "f/a.mcap", ["PATHS", "--out"]),
        ("import --board board.bin --out @", "board.bin", ["PATHS", "--out"]),
        ("export-vectors f/a.mcap --out d --json @", "f/a.mcap", ["FLIGHTS", "--json"]),
        ("export-vectors f --out d --json @", "f/a.mcap", ["FLIGHTS", "--json"]),
        ("export-vectors @ --out vectors", "vectors/vectors.bin", ["FLIGHTS", "--out"]),
        ("export-vectors @ --out vectors", "vectors/setup-0.bin", ["FLIGHTS", "--out"]),
        ("study filters --vehicle @ --out d", "d/flights/trial-001.toml", ["--vehicle", "--out"]),
        ("study filters --vehicle @ --out d", "d/filters_in_loop.csv", ["--vehicle", "--out"]),
        ("study table2 --vehicle @ --out d", "d/t1.toml", ["--vehicle", "--out"]),
        ("study merge part1 --out m --json @", "part1/thrust.trials.jsonl", ["FOLDERS", "--json"]),
        (
            "study merge part1 part2 --out here/part2",
            "part2/thrust.trials.jsonl",
            ["FOLDERS", "--out"],
        ),
        ("study merge part1 --out m --vehicle v.toml --json @", "v.toml", ["--vehicle", "--json"]),
        ("gap find --vehicle v.toml --flights @ --out d", "d/find.json", ["--flights", "--out"]),
        (
            "gap shrink --vehicle v.toml --flights f --held-out @ --out d",
            "d/report.html",
            ["held-out", "--out"],
        ),
        (
            "gap run --vehicle v.toml --flights f --held-out @ --out d",
            "d/report.html",
            ["held-out", "--out"],
        ),
        ("gap name --vehicle @ --flights f --out d", "d/verdict.json", ["--vehicle", "--out"]),
        ("gap add --vehicle @ --flights f --out .", "v.toml", ["--vehicle", "--out"]),
        ("gap run --vehicle @ --flights f --out .", "v.toml", ["--vehicle", "--out"]),
        (
            "gap add --dry-run --vehicle v.toml --flights f --json @",
            "v.toml",
            ["--vehicle", "--json"],
        ),
    ];
    for (command, file, arguments) in cases {
        is_refused(&folder, command, file, arguments);
    }
    for step in ["find", "name", "add", "shrink", "run"] {
        let command =
            format!("gap {step} --vehicle v.toml --flights f --held-out h --out d --json @");
        for (file, argument) in
            [("v.toml", "--vehicle"), ("f/a.mcap", "--flights"), ("h/b.mcap", "--held-out")]
        {
            is_refused(&folder, &command, file, [argument, "--json"]);
        }
    }
    for study in STUDIES {
        let command = format!("study {study} --vehicle v.toml --json @");
        is_refused(&folder, &command, "v.toml", ["--vehicle", "--json"]);
        let (command, file) =
            (format!("study {study} --vehicle @ --out d"), format!("d/{study}.csv"));
        is_refused(&folder, &command, &file, ["--vehicle", "--out"]);
    }
}

#[test]
fn no_two_results_go_into_one_file() {
    let folder = with_inputs("two-results");
    folder.write("there", "");
    symlink("there", folder.0.join("link")).unwrap();
    symlink("new", folder.0.join("dangling")).unwrap();
    for (command, arguments) in [
        ("fly --out x --json x", ["--out", "--json"]),
        ("fly --out x --report ./x", ["--out", "--report"]),
        ("fly --json here/x --report x", ["--report", "--json"]),
        ("fly --json link --out there", ["--out", "--json"]),
        ("fly --json new --report dangling", ["--report", "--json"]),
        ("plan --out x --report x", ["--out", "--report"]),
        ("reach --html x --json x", ["--html", "--json"]),
        ("train flat_plate --flights f --out x --json x", ["--out", "--json"]),
        (
            "train flat_plate --flights f --out x.safetensors --report x.checkpoint.safetensors",
            ["checkpoint of --out", "--report"],
        ),
        ("import --map map.toml f.csv --out x --json x", ["--out", "--json"]),
        ("import --recover f/a.mcap --out x --json x", ["--out", "--json"]),
        ("demo --out new --json new/report.html", ["--out", "--json"]),
        ("--out new --json new/report.html", ["--out", "--json"]),
        ("export-vectors f/a.mcap --out new --json new/vectors.bin", ["--out", "--json"]),
        ("gap run --vehicle v.toml --flights f --out new --json new/v.toml", ["--out", "--json"]),
        ("study thrust --out new --json new/thrust.csv", ["--out", "--json"]),
        ("study merge part1 part2 --out new --json new/thrust.trials.jsonl", ["--out", "--json"]),
    ] {
        let words: Vec<&str> = command.split_whitespace().collect();
        folder.fails(&words, &[arguments[0], arguments[1], "each result needs a file of its own"]);
    }
    folder.succeeds(&[
        "fly",
        "--scenario",
        "hover",
        "--out",
        "/dev/null",
        "--report",
        "/dev/null",
        "--json",
        "/dev/null",
    ]);
}

/// A folder that holds an input may also hold results, of an earlier run, too: nothing of it is
/// read.
#[test]
fn what_is_not_read_may_be_written_again() {
    let folder = with_inputs("again");
    for _ in 0..2 {
        folder.succeeds(&[
            "import",
            "--map",
            "files.toml",
            "csv",
            "--out",
            "csv/x.mcap",
            "--json",
            "csv/x.json",
        ]);
        folder.succeeds(&["export-vectors", "f", "--out", "f", "--json", "f/v.json"]);
    }
}

#[test]
fn json_may_go_into_the_folder_that_is_yet_to_be_made_and_into_no_other() {
    let folder = with_inputs("new-folder");
    for (command, out) in
        [("demo", "a"), ("export-vectors f", "b"), ("study faults --trials 1", "c")]
    {
        let command = format!("{command} --out {out} --json ./{out}/j.json");
        folder.succeeds(&command.split(' ').collect::<Vec<_>>());
        assert!(folder.0.join(out).join("j.json").is_file(), "{command}");
    }
    folder
        .fails(&["study", "faults", "--out", "e", "--json", "nowhere/j.json"], &["nowhere/j.json"]);
}

/// `--json` may name the file in which the folder has the same bytes.
#[test]
fn the_figures_that_the_folder_has_too_may_be_asked_for_there() {
    let folder = with_inputs("same-json");
    folder.succeeds(&["study", "faults", "--trials", "1", "--out", "a", "--json", "a/faults.json"]);
    folder.succeeds(&["study", "faults", "--trials", "1", "--out", "b", "--json", "b.json"]);
    let read = |name: &str| fs::read(folder.0.join(name)).unwrap();
    assert_eq!(read("a/faults.json"), read("b.json"));
    assert_eq!(read("b/faults.json"), read("b.json"));
}

/// What comes through a pipe is there once.
#[test]
fn a_vehicle_may_come_through_a_pipe() {
    let folder = with_inputs("vehicle-pipe");
    let mut check = Command::new(env!("CARGO_BIN_EXE_squirrel"));
    let check =
        check.args(["vehicle", "check", "/dev/stdin", "--json", "v.json"]).current_dir(&folder.0);
    let mut check = check.stdin(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    check
        .stdin
        .take()
        .unwrap()
        .write_all(SQUIRREL.replacen("parnn_weights", "# ", 1).as_bytes())
        .unwrap();
    assert!(check.wait().unwrap().success());
}

/// What a command prints, with its JSON written to a path, on a stdout that is `into`.
fn printed(folder: &Folder, arguments: &[&str], json: &str, into: &OpenOptions) -> String {
    let stdout = into.open(folder.0.join("o.txt")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_squirrel"));
    let command =
        command.args(arguments).args(["--json", json]).current_dir(&folder.0).stdout(stdout);
    assert!(command.status().unwrap().success(), "{arguments:?} --json {json}");
    fs::read_to_string(folder.0.join("o.txt")).unwrap()
}

/// Links of the test's own lead to what is open: were one replaced, then not one of the machine.
#[test]
fn json_into_stdout_stands_where_it_was_written_and_nothing_is_lost() {
    let folder = with_inputs("stdout");
    symlink("/proc/self/fd/1", folder.0.join("to-stdout")).unwrap();
    symlink("/proc/self/fd/2", folder.0.join("to-stderr")).unwrap();
    // One writes JSON behind what it says, one before.
    for arguments in [["vehicle", "check", "v.toml"].as_slice(), &["replay", "f/a.mcap"]] {
        let said = folder.succeeds(&[arguments, &["--json", "j.json"]].concat());
        let json = fs::read_to_string(folder.0.join("j.json")).unwrap();
        let whole =
            if arguments[0] == "replay" { json.clone() + &said } else { said.clone() + &json };
        for path in ["to-stdout", "/dev/fd/1", "/proc/self/fd/1"] {
            // Into a pipe, `> o.txt`, `>> o.txt`.
            assert_eq!(folder.succeeds(&[arguments, &["--json", path]].concat()), whole, "{path}");
            let mut anew = OpenOptions::new();
            anew.write(true).create(true).truncate(true);
            assert_eq!(printed(&folder, arguments, path, &anew), whole, "{path}");
            let behind = printed(&folder, arguments, path, OpenOptions::new().append(true));
            assert_eq!(behind, whole.repeat(2), "{path}");
        }
        let output = folder.run(&[arguments, &["--json", "to-stderr"]].concat());
        assert_eq!((output.stdout, output.stderr), (said.into_bytes(), json.into_bytes()));
    }
    for link in ["to-stdout", "to-stderr"] {
        assert!(fs::symlink_metadata(folder.0.join(link)).unwrap().is_symlink(), "{link}");
    }
}

#[test]
fn a_link_stays_and_what_it_leads_to_is_written() {
    let folder = with_inputs("linked");
    symlink("d/results.json", folder.0.join("link.json")).unwrap();
    folder.write("d/results.json", "before");
    folder.succeeds(&["vehicle", "check", "v.toml", "--json", "link.json"]);
    assert!(fs::symlink_metadata(folder.0.join("link.json")).unwrap().is_symlink());
    assert!(fs::read_to_string(folder.0.join("d/results.json")).unwrap().contains("mass.mass_kg"));
}

/// Nothing is kept beside a device while a training goes on.
#[test]
fn weights_into_a_device_have_no_checkpoint() {
    let folder = with_inputs("no-checkpoint");
    symlink("/dev/null", folder.0.join("null")).unwrap();
    let scenario = Scenario { duration_s: 8.0, ..Scenario::find("random_spread").unwrap() };
    folder.write("spread.toml", &scenario.to_toml());
    folder.succeeds(&[
        "fly",
        "--arm",
        "pc_wings_open",
        "--scenario",
        "spread.toml",
        "--out",
        "g.mcap",
    ]);
    let before = folder.files();
    let train = ["train", "vanilla", "--flights", "g.mcap", "--epochs", "60", "--out", "null"];
    folder.succeeds(&train);
    assert_eq!(folder.files(), before);
    folder.fails(&[&train[..], &["--resume"]].concat(), &["--resume", "null", "checkpoint"]);
}
