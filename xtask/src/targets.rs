//! Other people's machines: the workspace is checked for their targets. Nothing is linked or run.
//!
//! What is compiled from C on the way (zstd) is compiled by zig, which comes from PyPI and brings
//! the headers of all of them. Python's package is left out: its checks need no Python, but its
//! dependencies are those of the others.

use crate::run::{call, cargo, output, root};
use crate::zig;
use std::process::Command;

/// Rust's name and zig's.
pub(crate) const TARGETS: [(&str, &str); 3] = [
    ("aarch64-apple-darwin", "aarch64-macos"),
    ("x86_64-pc-windows-gnu", "x86_64-windows-gnu"),
    ("aarch64-unknown-linux-gnu", "aarch64-linux-gnu"),
];

/// `cargo xtask targets`.
///
/// # Errors
/// An argument that is no target of the list, one that cannot be had, or code that is not for it.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    let known = TARGETS.map(|(target, _)| target);
    if let Some(no) = arguments.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(format!("target = {no}: must be {}", known.join(", ")));
    }
    let (folder, venv) = zig::environment()?;
    for (target, of_zig) in TARGETS {
        if !(arguments.is_empty() || arguments.iter().any(|name| name == target)) {
            continue;
        }
        eprintln!("\n==> {target}");
        call(Command::new("rustup").args(["target", "add", target]))?;
        let mut check = cargo()?;
        check.current_dir(root()?);
        let [cc, ar] = zig::tools(&venv, &folder, of_zig)?;
        let key = target.replace('-', "_");
        check.env(format!("CC_{key}"), cc).env(format!("AR_{key}"), ar);
        check.args(["check", "--release", "--locked", "--workspace", "--target", target]);
        call(check.args(["--exclude", "squirrel-py", "--exclude", "xtask"]))?;
    }
    let version = output(Command::new("rustc").arg("--version")).unwrap_or_default();
    eprintln!("checked by {version}");
    Ok(())
}
