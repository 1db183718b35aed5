//! What people and machines see: tables on stdout, talk on stderr, files that are whole or absent.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is where the program speaks")]

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use squirrel_log::files;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{ErrorKind, IsTerminal, Write};
use std::path::Path;
use std::sync::Mutex;

/// What stdout refused first.
static REFUSED: Mutex<Option<String>> = Mutex::new(None);

/// A result line on stdout.
pub(crate) fn say(line: &str) {
    let mut stdout = std::io::stdout();
    note(writeln!(stdout, "{}", plain(line)).and_then(|()| stdout.flush()));
}

/// Keeps what stdout refused. A closed pipe (`squirrel | head`) is not an error of ours.
pub(crate) fn note(printed: std::io::Result<()>) {
    if let Err(e) = printed
        && e.kind() != ErrorKind::BrokenPipe
        && let Ok(mut refused) = REFUSED.lock()
    {
        refused.get_or_insert_with(|| e.to_string());
    }
}

/// Whether all that was said since the last time has gone out.
///
/// # Errors
/// A full disk behind stdout, and its like.
pub(crate) fn said() -> Result<(), String> {
    let refused = REFUSED.lock().ok().and_then(|mut refused| refused.take());
    refused.map_or(Ok(()), |e| Err(format!("stdout: {e}")))
}

/// A line for people on stderr.
pub(crate) fn talk(line: &str) {
    let _ = writeln!(std::io::stderr(), "{}", plain(line));
}

/// The one line of an error, at most so long that it can be read.
pub(crate) fn error(problem: &str) {
    /// Characters of its begin, and of its end, which says what is wrong.
    const SHOWN: (usize, usize) = (600, 400);
    let all: Vec<char> = plain(&problem.replace('\n', " ")).chars().collect();
    let text = |part: &[char]| part.iter().collect::<String>();
    let left_out = all.len().saturating_sub(SHOWN.0 + SHOWN.1);
    if left_out == 0 {
        return talk(&format!("error: {}", text(&all)));
    }
    let (begin, end) = (text(&all[..SHOWN.0]), text(&all[all.len() - SHOWN.1..]));
    talk(&format!("error: {begin} [... {left_out} characters ...] {end}"));
}

/// A text in which names from files do nothing to a terminal: control characters, and those that
/// turn the direction of writing, are spelt out.
fn plain(text: &str) -> Cow<'_, str> {
    files::spelt_out(text, |c| files::acts(c) && c != '\n' && c != '\t')
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

/// Longest line below the header: where cells are longer, a terminal breaks them anyway.
const RULE_MAX: usize = 120;

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
                let length = widths.iter().sum::<usize>() + 2 * columns.saturating_sub(1);
                say(&"-".repeat(length.min(RULE_MAX)));
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
    files::folder(path).map_err(|e| format!("{}: {e}", path.display()))
}
