//! Hands the commit to the program, so that logs say what flew. Absent where there is no git.

use std::path::Path;
use std::process::Command;

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if let Some(moved) = git(&["rev-parse", "--git-path", "logs/HEAD"])
        && Path::new(&moved).exists()
    {
        println!("cargo:rerun-if-changed={moved}");
    }
    if let Some(commit) = git(&["rev-parse", "HEAD"]) {
        println!("cargo:rustc-env=SQUIRREL_COMMIT={commit}");
    }
}
