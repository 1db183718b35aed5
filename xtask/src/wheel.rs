//! `cargo xtask wheel`: the Python package, built as it is shipped and tested as it is installed.
//!
//! The wheel is built in the release profile and the target folder of everything else, which has
//! all that is below the package already: only the package itself is compiled here, and nowhere
//! else. It is installed into a virtual environment of its own. The tests then see nothing but that
//! environment: they check arguments, bits, threads, types and stubs, run the lines of the README,
//! the guide and the examples, and install the wheel once more where nothing is.

use crate::python;
use crate::run::{call, root, target_directory};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What builds and tests the wheel, what it can use where it is there, what runs notebooks, and
/// studies in parts. Tests run on two processors, most of them on one thread.
const PACKAGES: &str = "numpy==2.4.6 maturin==1.16.0 pytest==9.2.0 pytest-xdist==3.8.0 mypy==2.4.1 matplotlib==3.11.2 pandas==3.1.1 polars==2.1.0 gymnasium==1.4.0 nbclient==0.11.0 ipykernel==7.4.0 distributed==2026.8.0 ray==2.60.0";
/// Largest wheel.
const BYTES_MAX: u64 = 8_000_000;

/// `cargo xtask wheel`; arguments go to pytest. `--environment` makes what the tests need and stops.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    if arguments == ["--environment"] {
        return python::environment(&environment()?, PACKAGES).map(|_| ());
    }
    run(arguments).map(|note| eprintln!("{note}"))
}

/// The step of `cargo xtask test`.
pub(crate) fn step() -> Result<String, String> {
    run(&[])
}

/// The environment that the wheel is installed in, whether it exists yet or not.
///
/// # Errors
/// As [`target_directory`].
pub(crate) fn environment() -> Result<PathBuf, String> {
    Ok(target_directory()?.join("wheel/venv"))
}

/// Builds the wheel and installs it into its environment; the wheel.
///
/// # Errors
/// The environment, the build or the installation failed.
pub(crate) fn installed() -> Result<PathBuf, String> {
    let venv = environment()?;
    python::environment(&venv, PACKAGES)?;
    let package = root()?.join("crates/squirrel-py");
    let wheel = build(&venv, &package, &target_directory()?.join("wheel/dist"))?;
    let pip = ["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"];
    call(Command::new(python::program(&venv, "python")).args(pip).arg(&wheel))?;
    Ok(wheel)
}

fn run(arguments: &[String]) -> Result<String, String> {
    let wheel = installed()?;
    let package = root()?.join("crates/squirrel-py");
    let bytes =
        std::fs::metadata(&wheel).map_err(|error| format!("{}: {error}", wheel.display()))?.len();
    let size = format!("{:.2} MB", bytes as f64 / 1e6);
    if bytes > BYTES_MAX {
        return Err(format!(
            "{}: {size}, must be at most {} MB",
            wheel.display(),
            BYTES_MAX / 1_000_000
        ));
    }
    let python = python::program(&environment()?, "python");
    call(
        Command::new(&python)
            .current_dir(&package)
            .env("SQUIRREL_WHEEL", &wheel)
            // Drawing needs no screen, and the repository stays as it is.
            .env("MPLBACKEND", "agg")
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .args("-m pytest -q -p no:cacheprovider -n 2 --dist worksteal".split(' '))
            .args(arguments),
    )?;
    Ok(size)
}

/// Builds the wheel, the only one in its folder.
fn build(venv: &Path, package: &Path, dist: &Path) -> Result<PathBuf, String> {
    let at = |error: std::io::Error| format!("{}: {error}", dist.display());
    if dist.exists() {
        std::fs::remove_dir_all(dist).map_err(at)?;
    }
    // The release profile and the target folder are cargo's own, so that nothing is compiled that
    // is compiled already.
    let mut maturin = Command::new(python::program(venv, "maturin"));
    maturin.current_dir(root()?).args(["build", "--release", "--locked", "--quiet"]);
    maturin.args(["--compression-level", "9", "--manifest-path"]);
    maturin.arg(package.join("Cargo.toml")).arg("--out").arg(dist);
    if has_lld() {
        // Functions with the same code are kept once: 0.15 MB.
        maturin.args(["--", "-Clink-arg=-Wl,--icf=all"]);
    }
    call(&mut maturin)?;
    let mut wheels = std::fs::read_dir(dist).map_err(at)?;
    let wheel =
        wheels.next().ok_or_else(|| format!("{}: maturin has left no wheel", dist.display()))?;
    Ok(wheel.map_err(at)?.path())
}

/// Whether the compiler links with the linker that it brings along, as it does for this target
/// where there is one.
fn has_lld() -> bool {
    let target = "x86_64-unknown-linux-gnu";
    let sysroot = Command::new("rustc").args(["--print", "sysroot"]).output();
    let sysroot = sysroot.ok().and_then(|out| String::from_utf8(out.stdout).ok());
    let lld = |sysroot: String| {
        Path::new(sysroot.trim()).join(format!("lib/rustlib/{target}/bin/gcc-ld/ld.lld"))
    };
    cfg!(all(target_arch = "x86_64", target_os = "linux", target_env = "gnu"))
        && sysroot.is_some_and(|sysroot| lld(sysroot).exists())
}
