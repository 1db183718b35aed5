//! The proof that the flight code needs no std: it is checked for the target of a Cortex-M7.
//!
//! The target's core library comes from rustup, or, where rustup cannot download, from the library
//! sources that Debian packages; Debian's own compiler must then compile them, for sources and
//! compiler have to be of one version.

use crate::run::{call, installed_on_ci, output, root, target_directory};
use std::path::{Path, PathBuf};
use std::process::Command;

const TARGET: &str = "thumbv7em-none-eabihf";
/// The firmware's workspace, below the root.
const FIRMWARE: &str = "firmware";
const PACKAGE: [&str; 5] =
    ["check", "--release", "--locked", "--package=squirrel-core", "--no-default-features"];
const DEBIAN_PACKAGES: [&str; 4] = ["rustc-web", "cargo-web", "rust-web-src", "lld"];
const DEBIAN_SOURCES: &str = "/usr/lib/rustlib/src/rust/library/core";

#[derive(Debug, PartialEq)]
enum Route {
    /// The toolchain has the target.
    Plain,
    /// Debian's compiler builds core first.
    Debian,
}

/// `cargo xtask thumb`.
pub(crate) fn chore(_: &[String]) -> Result<(), String> {
    let note = check()?;
    eprintln!("ok, {note}");
    Ok(())
}

/// Whether there is a route, before anything is built.
///
/// # Errors
/// No route on this machine.
pub(crate) fn reachable() -> Result<(), String> {
    choose(has_target, add_target, has_debian).map(|_| ())
}

/// Checks squirrel-core for the target; the note says by which route.
///
/// # Errors
/// No route on this machine, or the check failed.
pub(crate) fn check() -> Result<String, String> {
    match choose(has_target, add_target, has_debian)? {
        Route::Plain => {
            call(clean("cargo")?.args(PACKAGE).args(["--target", TARGET]))?;
            Ok("plain cargo".to_owned())
        }
        Route::Debian => {
            // A folder of its own: cargo does not notice that core comes from elsewhere.
            let folder = target_directory()?.join("thumb-debian");
            call(
                clean("/usr/bin/cargo")?
                    .envs([("RUSTC", "/usr/bin/rustc"), ("RUSTC_BOOTSTRAP", "1")])
                    .args(PACKAGE)
                    .args(["--target", TARGET, "-Zbuild-std=core", "--target-dir"])
                    .arg(folder),
            )?;
            Ok("core built from Debian's sources".to_owned())
        }
    }
}

/// Builds in the firmware's workspace for the target; the child's status, and its errors where they
/// are kept.
///
/// # Errors
/// No route on this machine.
pub(crate) fn build(arguments: &[&str], keep_errors: bool) -> Result<std::process::Output, String> {
    let route = choose(has_target, add_target, has_debian)?;
    let mut command = match route {
        Route::Plain => clean("cargo")?,
        Route::Debian => clean("/usr/bin/cargo")?,
    };
    command.current_dir(root()?.join(FIRMWARE)).args(["build", "--release", "--locked"]);
    command.arg("--target-dir").arg(folder(&route)?);
    if route == Route::Debian {
        command.envs([("RUSTC", "/usr/bin/rustc"), ("RUSTC_BOOTSTRAP", "1")]);
        // The target names rust-lld, which Debian calls otherwise.
        command.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", "ld.lld").arg("-Zbuild-std=core");
    }
    command.args(arguments);
    if !keep_errors {
        command.stderr(std::process::Stdio::inherit());
    }
    command.output().map_err(|error| format!("cargo: {error}"))
}

/// Another command of cargo in the firmware's workspace, by the toolchain that has the target;
/// `None` where there is none.
///
/// # Errors
/// As [`root`].
pub(crate) fn plain(arguments: &[&str]) -> Result<Option<Command>, String> {
    if choose(has_target, || false, || true)? != Route::Plain {
        return Ok(None);
    }
    let mut command = clean("cargo")?;
    command.current_dir(root()?.join(FIRMWARE)).args(arguments).args(["--release", "--locked"]);
    command.arg("--target-dir").arg(folder(&Route::Plain)?);
    Ok(Some(command))
}

/// Where [`build`] puts the images.
///
/// # Errors
/// As [`root`].
pub(crate) fn images() -> Result<PathBuf, String> {
    let route = choose(has_target, || false, || true)?;
    Ok(folder(&route)?.join(TARGET).join("release"))
}

/// A folder for each route: cargo does not notice that core comes from elsewhere.
fn folder(route: &Route) -> Result<PathBuf, String> {
    let target = root()?.join(FIRMWARE).join("target");
    Ok(if *route == Route::Plain { target } else { target.join("debian") })
}

/// The first route that works; later ones are not tried.
fn choose(
    has_target: impl FnOnce() -> bool,
    add_target: impl FnOnce() -> bool,
    has_debian: impl FnOnce() -> bool,
) -> Result<Route, String> {
    if has_target() || add_target() {
        Ok(Route::Plain)
    } else if has_debian() {
        Ok(Route::Debian)
    } else {
        let debian = DEBIAN_PACKAGES.join(" ");
        Err(format!(
            "no core library for {TARGET}; install it by\n    rustup target add {TARGET}\nor\n    apt install {debian}"
        ))
    }
}

/// A command that starts from the machine's default toolchain, not from what the calling cargo was
/// told.
fn clean(program: &str) -> Result<Command, String> {
    let mut command = Command::new(program);
    command.current_dir(root()?);
    for key in ["RUSTUP_TOOLCHAIN", "RUSTC", "RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS"] {
        command.env_remove(key);
    }
    Ok(command)
}

fn has_target() -> bool {
    let sysroot =
        clean("rustc").ok().and_then(|mut rustc| output(rustc.args(["--print", "sysroot"])));
    sysroot.is_some_and(|path| has_libcore(&PathBuf::from(path)))
}

fn has_libcore(sysroot: &Path) -> bool {
    let folder = sysroot.join("lib/rustlib").join(TARGET).join("lib");
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    entries.flatten().any(|entry| entry.file_name().to_string_lossy().starts_with("libcore-"))
}

fn add_target() -> bool {
    clean("rustup").is_ok_and(|mut rustup| call(rustup.args(["target", "add", TARGET])).is_ok())
}

/// Whether Debian's packages are there. Where nobody can be asked, on CI as root, they are
/// installed.
fn has_debian() -> bool {
    let there = || {
        Path::new(DEBIAN_SOURCES).is_dir()
            && ["/usr/bin/cargo", "/usr/bin/rustc"].iter().all(|path| Path::new(path).exists())
    };
    there() || (installed_on_ci(&DEBIAN_PACKAGES) && there())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn untried() -> bool {
        panic!("a route after one that works")
    }

    #[test]
    fn the_first_route_that_works_is_taken() {
        assert_eq!(choose(|| true, untried, untried), Ok(Route::Plain));
        assert_eq!(choose(|| false, || true, untried), Ok(Route::Plain));
        assert_eq!(choose(|| false, || false, || true), Ok(Route::Debian));
    }

    #[test]
    fn without_a_route_both_commands_are_named() {
        let error = choose(|| false, || false, || false).unwrap_err();
        assert!(error.contains("rustup target add thumbv7em-none-eabihf"), "{error}");
        assert!(error.contains("apt install rustc-web cargo-web rust-web-src lld"), "{error}");
    }

    #[test]
    fn the_child_does_not_inherit_the_calling_toolchain() {
        // The variable of the test's own cargo; `clean` needs nothing else from it.
        let command = clean("cargo").unwrap();
        let removed: Vec<_> =
            command.get_envs().filter(|(_, value)| value.is_none()).map(|(key, _)| key).collect();
        assert_eq!(removed, ["CARGO_ENCODED_RUSTFLAGS", "RUSTC", "RUSTFLAGS", "RUSTUP_TOOLCHAIN"]);
    }

    #[test]
    fn a_sysroot_without_the_target_has_no_libcore() {
        let sysroot =
            std::env::temp_dir().join(format!("squirrel-xtask-sysroot-{}", std::process::id()));
        let folder = sysroot.join("lib/rustlib").join(TARGET).join("lib");
        assert!(!has_libcore(&sysroot));
        std::fs::create_dir_all(&folder).unwrap();
        assert!(!has_libcore(&sysroot), "an empty folder is what a broken-off install leaves");
        std::fs::write(folder.join("libcore-0123456789abcdef.rlib"), "").unwrap();
        assert!(has_libcore(&sysroot));
        std::fs::remove_dir_all(&sysroot).unwrap();
    }
}
