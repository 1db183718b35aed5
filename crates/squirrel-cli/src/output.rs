//! What people and machines see: tables on stdout, talk on stderr, files that are whole or absent.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is where the program speaks")]

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use squirrel_log::files;
use std::fmt::Write as _;
use std::io::{IsTerminal, Write};
use std::path::Path;

/// A result line on stdout.
pub(crate) fn say(line: &str) {
    // A closed pipe (`squirrel | head`) is not an error of ours.
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// A line for people on stderr.
pub(crate) fn talk(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// A progress bar on stderr; silent where nobody looks.
pub(crate) fn progress(length: u64, unit: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    let template = format!("{{msg:12}} {{bar:40}} {{pos}}/{{len}} {unit}  {{eta}}");
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style);
    }
    if !std::io::stderr().is_terminal() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    bar
}

/// A line on stderr that says what is being done; silent where nobody looks.
pub(crate) fn spinner() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}  {elapsed}") {
        bar.set_style(style);
    }
    if !std::io::stderr().is_terminal() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    bar
}

/// A table with aligned columns: columns of numbers to the right, text to the left.
pub(crate) struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    pub(crate) fn new(header: &[&str]) -> Self {
        Self::of(vec![header.iter().map(|&h| h.to_owned()).collect()])
    }
    /// The first of the rows is the header.
    pub(crate) fn of(rows: Vec<Vec<String>>) -> Self {
        Self { rows }
    }
    pub(crate) fn row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }
    pub(crate) fn print(&self) {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |c: usize| {
            self.rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let is_number = |cell: &String| {
            cell == "-" || cell.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c))
        };
        let numbers: Vec<bool> = (0..columns)
            .map(|c| self.rows[1..].iter().filter_map(|r| r.get(c)).all(is_number))
            .collect();
        for (i, row) in self.rows.iter().enumerate() {
            let mut line = String::new();
            for (c, cell) in row.iter().enumerate() {
                let (w, gap) = (widths[c], if c == 0 { "" } else { "  " });
                let _ = if numbers[c] {
                    write!(line, "{gap}{cell:>w$}")
                } else {
                    write!(line, "{gap}{cell:<w$}")
                };
            }
            say(line.trim_end());
            if i == 0 {
                say(&"-".repeat(widths.iter().sum::<usize>() + 2 * columns.saturating_sub(1)));
            }
        }
    }
}

/// Writes a file, whole or not at all.
pub(crate) fn write_file(path: &Path, content: &[u8]) -> Result<(), String> {
    files::write_whole(path, content).map_err(|e| format!("{}: {e}", path.display()))
}

/// Writes a result as JSON where `--json` asks for it.
pub(crate) fn write_json(
    path: Option<&Path>,
    result: &impl serde::Serialize,
) -> Result<(), String> {
    let Some(path) = path else { return Ok(()) };
    let mut text =
        serde_json::to_string_pretty(result).map_err(|e| format!("{}: {e}", path.display()))?;
    text.push('\n');
    write_file(path, text.as_bytes())
}

/// Makes a folder for results.
pub(crate) fn folder(path: &Path) -> Result<(), String> {
    std::fs::create_dir_all(path).map_err(|e| format!("{}: {e}", path.display()))
}
