//! zig as a C compiler for other targets, from PyPI.

use crate::python;
use crate::run::target_directory;
use std::path::{Path, PathBuf};

/// What packages are made and looked at with.
const PACKAGES: &str = "maturin==1.16.0 ziglang==0.17.1 twine==7.0.0 uv==0.13.9";

/// The folder of what is made for others, and the environment in it that has the packages.
///
/// # Errors
/// As [`python::environment`].
pub(crate) fn environment() -> Result<(PathBuf, PathBuf), String> {
    let folder = target_directory()?.join("package");
    let venv = folder.join("venv");
    python::environment(&venv, PACKAGES)?;
    Ok((folder, venv))
}

/// A compiler and an archiver for a target, as programs: what builds C asks for one word each, and
/// names the target in its own way, which zig does not know.
///
/// # Errors
/// They cannot be written.
pub(crate) fn tools(venv: &Path, folder: &Path, target: &str) -> Result<[PathBuf; 2], String> {
    let zig = format!("'{}' -m ziglang", python::program(venv, "python").display());
    let cc = format!(
        "for a; do shift; case \"$a\" in --target=*) ;; *) set -- \"$@\" \"$a\" ;; esac; done\n\
         exec {zig} cc -target {target} \"$@\""
    );
    let [cc, ar] = [("cc", cc), ("ar", format!("exec {zig} ar \"$@\""))]
        .map(|(name, text)| program(&folder.join(format!("{target}-{name}")), &text));
    Ok([cc?, ar?])
}

fn program(path: &Path, text: &str) -> Result<PathBuf, String> {
    std::fs::write(path, format!("#!/bin/sh\n{text}\n"))
        .and_then(|()| executable(path))
        .map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(path.to_owned())
}

#[cfg(unix)]
fn executable(path: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755))
}

#[cfg(not(unix))]
fn executable(_: &Path) -> std::io::Result<()> {
    Err(std::io::Error::other("packages for other machines are made on one that has sh"))
}
