//! Runs what the pages show: commands of the shell in the order of the page, then its Python.

use super::blocks::{self, Use};
use crate::run::{path_after, root, target_directory};
use crate::{python, wheel};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Pages beside those of `docs`.
const MORE: [&str; 4] =
    ["README.md", "CONTRIBUTING.md", "SECURITY.md", "crates/squirrel-py/README.md"];

/// What pages take for there, as in a checkout.
const PARTS: [&str; 2] = ["vehicles", "tests/data/flights"];

/// Runs all pages, or one, and says how many blocks ran.
///
/// # Errors
/// Page and line of each block that does not run, or says something else than is shown.
pub(super) fn pages(program: &Path, only: Option<&str>) -> Result<String, String> {
    let root = root()?;
    let mut pages: Vec<PathBuf> = MORE.iter().map(PathBuf::from).collect();
    collect(&root, Path::new("docs"), &mut pages)?;
    pages.sort();
    pages.retain(|page| only.is_none_or(|only| page == Path::new(only)));
    if pages.is_empty() {
        return Err(format!("no page {}", only.unwrap_or_default()));
    }
    let scratch = target_directory()?.join("docs/pages");
    let (mut ran, mut wrong) = (0, Vec::new());
    for page in pages {
        let name = page.display();
        let text = fs::read_to_string(root.join(&page)).map_err(|e| format!("{name}: {e}"))?;
        let folder = scratch.join(page.to_string_lossy().replace(['/', '\\'], "-"));
        match Page::new(&root, &folder, program, &text).and_then(|place| place.run(&text)) {
            Ok(count) => ran += count,
            Err(problem) => {
                eprintln!("{name}: {problem}");
                wrong.push(format!("{name}: {}", problem.lines().next().unwrap_or_default()));
            }
        }
    }
    if wrong.is_empty() { Ok(format!("{ran} blocks ran")) } else { Err(wrong.join("; ")) }
}

/// All pages below a folder, by their paths in the repository.
fn collect(root: &Path, folder: &Path, pages: &mut Vec<PathBuf>) -> Result<(), String> {
    let at = |error: std::io::Error| format!("{}: {error}", folder.display());
    for entry in fs::read_dir(root.join(folder)).map_err(at)? {
        let entry = entry.map_err(at)?;
        let path = folder.join(entry.file_name());
        if entry.path().is_dir() {
            collect(root, &path, pages)?;
        } else if path.extension().is_some_and(|extension| extension == "md") {
            pages.push(path);
        }
    }
    Ok(())
}

/// Copies a folder with all below it.
fn copy(from: &Path, to: &Path) -> Result<(), String> {
    let at = |error: std::io::Error| format!("{}: {error}", from.display());
    fs::create_dir_all(to).map_err(at)?;
    for entry in fs::read_dir(from).map_err(at)? {
        let entry = entry.map_err(at)?;
        let name = entry.file_name();
        if entry.path().is_dir() {
            copy(&entry.path(), &to.join(name))?;
        } else {
            fs::copy(entry.path(), to.join(name)).map_err(at)?;
        }
    }
    Ok(())
}

/// Where the blocks of one page run.
struct Page<'a> {
    folder: &'a Path,
    path: OsString,
}

impl<'a> Page<'a> {
    /// An empty folder, with nothing of the repository but what the page speaks of.
    fn new(root: &Path, folder: &'a Path, program: &Path, text: &str) -> Result<Self, String> {
        let at = |error: std::io::Error| format!("{}: {error}", folder.display());
        if folder.exists() {
            fs::remove_dir_all(folder).map_err(at)?;
        }
        fs::create_dir_all(folder).map_err(at)?;
        for part in PARTS {
            if text.contains(part) {
                copy(&root.join(part), &folder.join(part))?;
            }
        }
        let venv = wheel::environment()?;
        let python = python::program(&venv, "python");
        let first: Vec<&Path> = [program, &python].iter().filter_map(|p| p.parent()).collect();
        Ok(Self { folder, path: path_after(&first)? })
    }

    /// Runs the blocks of a page; how many ran.
    fn run(&self, page: &str) -> Result<usize, String> {
        let (mut ran, mut python) = (0, String::new());
        for block in blocks::of(page)? {
            let at = |problem: String| format!("line {}: {problem}", block.line);
            match &block.purpose {
                Use::Show => continue,
                Use::Write(name) => {
                    fs::write(self.folder.join(name), &block.text)
                        .map_err(|e| at(e.to_string()))?;
                    continue;
                }
                Use::Run => drop(self.shell(&block.text).map_err(at)?),
                Use::Compare => self.compare(&block.text).map_err(at)?,
                Use::Python => {
                    // Lines keep their numbers.
                    let before = python.matches('\n').count();
                    python += &"\n".repeat(block.line.saturating_sub(before));
                    python += &block.text;
                }
            }
            ran += 1;
        }
        if !python.is_empty() {
            let mut command = Command::new(python::program(&wheel::environment()?, "python"));
            command.args(["-W", "error", "-c", &python]).env("MPLBACKEND", "agg");
            self.output(&mut command)?;
        }
        Ok(ran)
    }

    fn compare(&self, block: &str) -> Result<(), String> {
        for shown in blocks::shown(block)? {
            let said = self.shell(&shown.command)?;
            let lines: Vec<&str> = said.lines().collect();
            if !blocks::alike(&shown.output, &lines) {
                return Err(format!("`{}` says something else:\n{said}", shown.command));
            }
        }
        Ok(())
    }

    /// What commands say on both streams, in its order.
    fn shell(&self, commands: &str) -> Result<String, String> {
        let script = format!("exec 2>&1\n{commands}");
        self.output(Command::new("bash").args(["-euo", "pipefail", "-c", &script]))
    }

    fn output(&self, command: &mut Command) -> Result<String, String> {
        let command = command.current_dir(self.folder).env("PATH", &self.path);
        let output = command.output().map_err(|error| format!("does not start: {error}"))?;
        let said = [output.stdout, output.stderr].map(|s| String::from_utf8_lossy(&s).into_owned());
        if output.status.success() {
            Ok(said.concat())
        } else {
            let last = said.concat().trim_end().lines().last().unwrap_or_default().to_owned();
            Err(format!("{}: {last}\n{}", output.status, said.concat()))
        }
    }
}
