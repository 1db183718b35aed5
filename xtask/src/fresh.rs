//! What a newcomer sees: the README's two commands in a clone of HEAD that has nothing built and
//! nothing beside it.

use crate::run::{call, root};
use std::process::Command;

/// The README's commands, the main job first.
const COMMANDS: [&[&str]; 2] = [&["run", "--release"], &["xtask", "test"]];

/// What a developer's shell or CI has set and a newcomer has not.
const NOT_HIS: [&str; 5] =
    ["CI", "SQUIRREL_FLIGHTS", "SQUIRREL_PYTHON", "CARGO_TARGET_DIR", "RUSTUP_TOOLCHAIN"];

/// `cargo xtask clean-fresh`; the clone stays where a command fails.
pub(crate) fn chore(_: &[String]) -> Result<(), String> {
    let clone = std::env::temp_dir().join(format!("squirrel-fresh-{}", std::process::id()));
    call(
        Command::new("git").args(["clone", "--quiet", "--no-hardlinks"]).arg(root()?).arg(&clone),
    )?;
    for arguments in COMMANDS {
        eprintln!("\n==> cargo {} in {}", arguments.join(" "), clone.display());
        let mut command = Command::new("cargo");
        command.current_dir(&clone).args(arguments);
        for key in NOT_HIS {
            command.env_remove(key);
        }
        call(&mut command).map_err(|error| format!("{error}; see {}", clone.display()))?;
    }
    std::fs::remove_dir_all(&clone).map_err(|error| format!("{}: {error}", clone.display()))
}
