//! The bench against programs that answer without looking.
#![cfg(unix)]

use hidden_effects::bench::{self, Plan};
use hidden_effects::case::Set;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

/// A folder of one test, removed at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path =
            std::env::temp_dir().join(format!("hidden-effects-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A left-over in the temporary folder is no reason to fail.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A program that writes a fixed verdict into the folder after `--out`, if every file that it is
/// given exists.
fn program(folder: &Path, verdict: &str) -> PathBuf {
    let script = format!(
        "#!/bin/sh\nset -e\nwhile [ $# -gt 0 ]; do case \"$1\" in\n--out) test -d \"$2\"; json=\"$2/verdict.json\"; shift 2;;\n\
         --vehicle|--held-out) test -f \"$2\"; shift 2;;\n\
         --baseline) test -f \"$2\"; test -f \"$3\"; echo \"$2\" >> '{good}'; shift 3;;\n\
         --json) json=\"$2\"; shift 2;;\n\
         *.mcap) test -f \"$1\"; shift;;\n*) shift;;\nesac; done\necho '{verdict}' > \"$json\"\n",
        good = folder.join("good").display()
    );
    let path = folder.join("program");
    std::fs::write(&path, script).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    path
}

fn plan(folder: &Folder, verdict: &str) -> Plan {
    Plan {
        squirrel: program(&folder.0, verdict),
        cases: vec![(Set::None, 0), (Set::Single, 7), (Set::Outside, 2)],
        seed: 5,
        folder: folder.0.join("bench"),
        keep: false,
        check: false,
    }
}

/// One test: a script that is being written while another thread starts a process cannot be started
/// itself.
#[test]
fn programs_that_answer_without_looking_are_seen_through() {
    says_none();
    guesses_then_fails();
    new_sets();
}

/// Right where nothing is hidden.
fn says_none() {
    let folder = Folder::new("none");
    let plan = plan(&folder, r#"{"verdict": "none"}"#);
    let outcomes = bench::run(&plan).unwrap();
    let right: Vec<bool> = outcomes.iter().map(|outcome| outcome.first_right).collect();
    assert_eq!(right, [true, false, false], "{outcomes:?}");
    assert!(outcomes.iter().all(|outcome| outcome.failure.is_none() && outcome.seconds > 0.0));
    let summary = bench::summarise(plan.seed, outcomes);
    assert_eq!(summary.sets["none"].first_right, 1.0);
    assert_eq!(summary.hidden["tether"].first_right, 0.0);
    let left: Vec<_> = std::fs::read_dir(plan.folder.join("cases")).unwrap().collect();
    assert!(left.is_empty(), "cases are not kept: {left:?}");
}

/// What the new sets make of a program that says nothing and of one that guesses; good flights are
/// given where they are.
fn new_sets() {
    let folder = Folder::new("new");
    let sets =
        [Set::Estimates, Set::Sensors, Set::Capture, Set::Overstated, Set::Misfit, Set::Baseline];
    let cases: Vec<_> = sets.into_iter().flat_map(|set| [(set, 0), (set, 1)]).collect();
    let run = |verdict: &str| {
        let plan = Plan { cases: cases.clone(), ..plan(&folder, verdict) };
        bench::run(&plan).unwrap()
    };
    let half = [Set::Estimates, Set::Capture, Set::Baseline];
    for outcome in run(r#"{"verdict": "none"}"#) {
        let nothing = half.contains(&outcome.set) && outcome.hidden.is_empty();
        assert_eq!((outcome.right, outcome.failure.clone()), (nothing, None), "{outcome:?}");
    }
    let guess = r#"{"verdict": "named_incomplete", "effects": [{"name": "linear_drag"}], "model_patch": "a.toml"}"#;
    for outcome in run(guess) {
        // The name of the first effect is right, but it takes a number to mend a file.
        let drag = outcome.hidden == ["linear_drag"];
        assert_eq!(outcome.right, drag && outcome.set != Set::Overstated, "{outcome:?}");
        assert!(outcome.silent_wrong != drag && outcome.patched);
        // This program has no answer to what remains beside a patch.
        assert_eq!(outcome.failure.is_some(), outcome.set == Set::Misfit, "{outcome:?}");
    }
    let good = std::fs::read_to_string(folder.0.join("good")).unwrap();
    assert_eq!(good.lines().count(), 2 * 2, "two cases of one set, asked twice");
}

/// Silently wrong; and a program that does not start is said not to.
fn guesses_then_fails() {
    let folder = Folder::new("guess");
    let guess = r#"{"verdict": "named", "effects": [{"name": "motor_lag"}]}"#;
    let mut plan = plan(&folder, guess);
    let wrong: Vec<bool> =
        bench::run(&plan).unwrap().iter().map(|outcome| outcome.silent_wrong).collect();
    assert_eq!(wrong, [true, false, true]);
    plan.squirrel = folder.0.join("nowhere");
    let failures = bench::run(&plan).unwrap();
    assert!(
        failures.iter().all(|o| o.failure.as_ref().is_some_and(|f| f.contains("nowhere"))),
        "{failures:?}"
    );
}
