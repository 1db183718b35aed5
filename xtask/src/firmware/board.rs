//! The image for the real part: linted, what needs no hardware tested here, built, sized. Nothing
//! runs it.

use super::elf::Elf;
use super::{Figures, build};
use crate::run::{call, output, root};
use crate::thumb;
use std::process::Command;

const PACKAGE: &str = "--package=squirrel-h747";

/// Checks format and lints of the firmware's workspace, and tests the parts of the image that need
/// no hardware.
///
/// # Errors
/// What clippy or a test says.
pub(super) fn check() -> Result<(), String> {
    call(
        Command::new("cargo")
            .args(["fmt", "--all", "--check"])
            .current_dir(root()?.join("firmware")),
    )?;
    let host = output(Command::new("rustc").arg("-vV"));
    let host = host.as_deref().and_then(host_of).ok_or("rustc -vV: names no host")?;
    for arguments in [
        &["clippy", "--workspace"][..],
        &["clippy", PACKAGE, "--lib", "--tests", "--target", host],
        &["test", "--quiet", PACKAGE, "--lib", "--target", host],
    ] {
        let Some(mut command) = thumb::plain(arguments)? else {
            // Its compiler has no clippy, and no libraries of the host.
            eprintln!(
                "firmware: lints and tests on the host left out: core is built from Debian's sources"
            );
            return Ok(());
        };
        if arguments[0] == "clippy" {
            command.args(["--", "-D", "warnings"]);
        }
        call(&mut command)?;
    }
    eprintln!("firmware: clippy is silent, what needs no hardware is tested on the host");
    Ok(())
}

/// Builds the image; what it takes of flash, and of RAM before anything is called.
///
/// # Errors
/// It does not build.
pub(super) fn size(figures: &mut Figures) -> Result<(), String> {
    let path = build(&[PACKAGE])?.join("h747");
    let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let elf = Elf::parse(&bytes).map_err(|error| format!("{}: {error}", path.display()))?;
    let sum = |sections: &[&str]| sections.iter().map(|name| u64::from(elf.size(name))).sum();
    figures.insert("h747 image: flash, B", sum(&[".vector_table", ".text", ".rodata", ".data"]));
    figures.insert("h747 image: static RAM, B", sum(&[".data", ".bss", ".uninit"]));
    Ok(())
}

/// The host's target in what `rustc -vV` prints.
fn host_of(said: &str) -> Option<&str> {
    said.lines().find_map(|line| line.strip_prefix("host: "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_host_is_found() {
        assert_eq!(
            host_of("rustc 1.95.0\nhost: x86_64-unknown-linux-gnu\nrelease: 1"),
            Some("x86_64-unknown-linux-gnu")
        );
        assert_eq!(host_of("rustc 1.95.0"), None);
    }
}
