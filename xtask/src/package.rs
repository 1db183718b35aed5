//! Everything that is published, made and looked at as who installs it would: crates, wheels, and
//! the sources of the Python package. CI has the wheel's tests and `crates`; the rest compiles the
//! workspace several times over and is for who releases.

use crate::run::{call, cargo, output, path_after, root, target_directory};
use crate::{python, zig};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What is published on crates.io, in the order in which it can be.
const CRATES: [&str; 11] = [
    "squirrel-vehicles",
    "squirrel-core",
    "squirrel-log",
    "squirrel-report",
    "squirrel-sim",
    "squirrel-batch",
    "squirrel-nn",
    "squirrel-plan",
    "squirrel-gap",
    "squirrel-study",
    "squirrel-cli",
];
/// Pythons that the wheel is for.
const PYTHONS: [&str; 4] = ["3.11", "3.12", "3.13", "3.14"];
/// Linux machines, by Rust's name of them; the glibc that their wheels ask for is zig's to give.
const MACHINES: [&str; 2] = ["x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu"];
const MANYLINUX: &str = "manylinux_2_28";
/// What an installed wheel has to do.
const TRY: &str =
    "import squirrel; print(squirrel.simulate(scenario='hover').metrics['rmse_m'] < 1.0)";

/// A part of the chore: its word, and how.
type Part = (&'static str, fn() -> Result<(), String>);

/// `cargo xtask package`.
///
/// # Errors
/// A part that is not there, or the first that fails.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    let parts: [Part; 5] = [
        ("crates", crates),
        ("sdist", sdist),
        ("wheels", wheels),
        ("installs", installs),
        ("sdist-builds", sdist_builds),
    ];
    let known = parts.map(|(name, _)| name);
    if let Some(no) = arguments.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(format!("part = {no}: must be {}", known.join(", ")));
    }
    for (name, part) in parts {
        if arguments.is_empty() || arguments.iter().any(|asked| asked == name) {
            eprintln!("\n==> {name}");
            part()?;
        }
    }
    Ok(())
}

/// Crates as they would be uploaded: of files that are all there, with what crates.io asks for.
pub(crate) fn crates() -> Result<(), String> {
    let mut package = cargo()?;
    // What is not committed is seen by the tests; this is about what a package holds.
    package.args(["package", "--locked", "--allow-dirty", "--no-verify", "--quiet"]);
    call(package.args(CRATES.iter().flat_map(|name| ["-p", name])))
}

/// The environment with what makes packages, and the folder that they go to.
fn place() -> Result<(PathBuf, PathBuf), String> {
    let (folder, venv) = zig::environment()?;
    Ok((venv, folder.join("dist")))
}

fn maturin(venv: &Path, command: &str, dist: &Path) -> Result<Command, String> {
    let mut maturin = Command::new(python::program(venv, "maturin"));
    maturin.current_dir(root()?).args([command, "--manifest-path"]);
    maturin.arg("crates/squirrel-py/Cargo.toml").arg("--out").arg(dist);
    Ok(maturin)
}

/// The newest file in a folder whose name ends so.
fn newest(dist: &Path, end: &str) -> Result<PathBuf, String> {
    let at = |error: std::io::Error| format!("{}: {error}", dist.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(dist).map_err(at)? {
        let path = entry.map_err(at)?.path();
        if path.to_string_lossy().ends_with(end) {
            files.push((path.metadata().and_then(|is| is.modified()).map_err(at)?, path));
        }
    }
    let newest = files.into_iter().max().map(|(_, path)| path);
    newest.ok_or_else(|| format!("{}: holds nothing that ends in {end}", dist.display()))
}

fn looked_at(venv: &Path, file: &Path) -> Result<(), String> {
    call(Command::new(python::program(venv, "twine")).args(["check", "--strict"]).arg(file))
}

fn sdist() -> Result<(), String> {
    let (venv, dist) = place()?;
    call(&mut maturin(&venv, "sdist", &dist)?)?;
    looked_at(&venv, &newest(&dist, ".tar.gz")?)
}

/// Wheels for machines with an old glibc, by zig, in a target folder of their own: other builds do
/// not wait for them.
fn wheels() -> Result<(), String> {
    let (venv, dist) = place()?;
    let target = dist.with_file_name("target");
    for machine in MACHINES {
        call(Command::new("rustup").args(["target", "add", machine]))?;
        let mut maturin = maturin(&venv, "build", &dist)?;
        maturin.args(["--release", "--locked", "--quiet", "--compression-level", "9", "--zig"]);
        maturin.args(["--target", machine, "--compatibility", MANYLINUX]);
        // zig is found as a module of the Python that is first.
        let python = python::program(&venv, "python");
        let programs: Vec<&Path> = python.parent().into_iter().collect();
        call(maturin.env("PATH", path_after(&programs)?).env("CARGO_TARGET_DIR", &target))?;
        let name = machine.split('-').next().unwrap_or(machine);
        looked_at(&venv, &newest(&dist, &format!("{MANYLINUX}_{name}.whl"))?)?;
    }
    Ok(())
}

/// The wheel of this machine in an empty environment of each Python that uv can fetch.
fn installs() -> Result<(), String> {
    let (venv, dist) = place()?;
    let wheel = newest(&dist, &format!("_{}.whl", std::env::consts::ARCH))
        .or_else(|_| newest(&target_directory()?.join("wheel/dist"), ".whl"))?;
    let uv = python::program(&venv, "uv");
    for version in PYTHONS {
        let home = dist.with_file_name(format!("python{version}"));
        if let Err(error) = call(
            Command::new(&uv).args(["venv", "--quiet", "--clear", "--python", version]).arg(&home),
        ) {
            eprintln!("Python {version}: cannot be had ({error})");
            continue;
        }
        let own = python::program(&home, "python");
        call(
            Command::new(&uv).args(["pip", "install", "--quiet", "--python"]).arg(&own).arg(&wheel),
        )?;
        match output(Command::new(&own).args(["-c", TRY])).as_deref() {
            Some("True") => eprintln!("Python {version}: {} flies", wheel.display()),
            _ => return Err(format!("Python {version}: {} does not fly", wheel.display())),
        }
    }
    Ok(())
}

/// The sources of the Python package, built by pip where nothing else is.
fn sdist_builds() -> Result<(), String> {
    let (venv, dist) = place()?;
    let source = newest(&dist, ".tar.gz")?;
    let home = dist.with_file_name("from-sdist");
    python::environment(&home, "wheel==0.47.0")?;
    let mut pip = Command::new(python::program(&home, "python"));
    pip.args(["-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir"]).arg(&home).arg(source);
    // As on another machine: none of what was built here.
    call(pip.env("CARGO_TARGET_DIR", home.join("target")))?;
    looked_at(&venv, &newest(&home, ".whl")?)
}
