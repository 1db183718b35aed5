//! A report as a picture, to look at it where there is no browser window: any report, or that of a
//! hidden effect which is made, flown and diagnosed for it.

use crate::chores::blind_bench;
use crate::run::{call, output, programs, root, succeeds, target_directory};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// No network, no profile of the user's, no first-run pages.
const FLAGS: [&str; 9] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
];

/// What the gap report is drawn at: a desk's and a small screen.
const GAP_SIZES: [&str; 2] = ["1280x9000", "800x12000"];
/// The hidden effect whose report is drawn.
const GAP_CASE: [&str; 7] = ["make", "--set", "single", "--n", "1", "--seed", "5"];
/// Panels of a gap report.
const GAP_PANELS: std::ops::RangeInclusive<char> = 'a'..='h';

/// Measured flights whose report the README shows: fitted to, and the last one held out.
const REAL: [&str; 3] = ["B3_figure8_fast", "B8_star_slow", "B2_circle_medium"];
const REAL_PICTURE: &str = "docs/pictures/gap.png";

/// `cargo xtask report-png [HTML [PNG [WIDTHxHEIGHT]]]`; without a file, the gap report of a hidden
/// effect. `--write` draws the picture of the README anew.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    let (html, png, size) = match arguments {
        [] => return gap_report(),
        [word] if word == "--write" => return real_report(),
        [html] => (html, PathBuf::from(html).with_extension("png"), "1200x3000"),
        [html, png] => (html, PathBuf::from(png), "1200x3000"),
        [html, png, size] => (html, PathBuf::from(png), size.as_str()),
        _ => return Err("usage: report-png [HTML [PNG [WIDTHxHEIGHT]]]".to_owned()),
    };
    draw(Path::new(html), "", &png, size)
}

/// Makes a case, has the program diagnose it, checks that the report has all panels, and draws it
/// into `target/gap-report`.
fn gap_report() -> Result<(), String> {
    let (built, folder) = (blind_bench()?, target_directory()?.join("gap-report"));
    if folder.exists() {
        std::fs::remove_dir_all(&folder)
            .map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    call(Command::new(built.join("hidden-effects")).args(GAP_CASE).arg("--out").arg(&folder))?;
    let cases = folder.join("cases");
    let at = |error: std::io::Error| format!("{}: {error}", cases.display());
    let case = std::fs::read_dir(&cases)
        .map_err(at)?
        .next()
        .ok_or("no case was made")?
        .map_err(at)?
        .path();
    let mut run = Command::new(built.join("squirrel"));
    run.current_dir(&case).args(["gap", "run", "--vehicle", "vehicle.toml", "--flights", "train"]);
    call(run.args(["--held-out", "held-out", "--out"]).arg(&folder))?;
    let html = folder.join("report.html");
    let text =
        std::fs::read_to_string(&html).map_err(|error| format!("{}: {error}", html.display()))?;
    if let Some(panel) = GAP_PANELS.into_iter().find(|panel| !holds_data(&text, *panel)) {
        return Err(format!("{}: panel-{panel} is missing or lacks data", html.display()));
    }
    for size in GAP_SIZES {
        draw(&html, "", &folder.join(format!("report-{size}.png")), size)?;
    }
    eprintln!("{}", folder.display());
    Ok(())
}

/// What the README does with measured flights, and the first screen of its report.
fn real_report() -> Result<(), String> {
    let (built, folder) = (programs(&["squirrel"])?, target_directory()?.join("real-report"));
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let squirrel = || {
        let mut command = Command::new(built.join("squirrel"));
        command.current_dir(&folder);
        command
    };
    let flight = |name: &str| format!("{name}.mcap");
    for name in REAL {
        let csv = root()?.join(format!("tests/data/flights/nanobench/{name}_rep1.csv"));
        let mut import = squirrel();
        import.arg("import").arg(csv);
        call(import.args(["--map", "nanobench", "--out", &flight(name)]))?;
    }
    let [figure8, star, circle] = REAL.map(flight);
    let mut run = squirrel();
    run.args(["gap", "run", "--vehicle", "crazyflie21_brushed", "--flights", &figure8, &star]);
    call(run.args(["--held-out", &circle, "--out", "gap"]))?;
    draw(&folder.join("gap/report.html"), "", &root()?.join(REAL_PICTURE), "1280x690")
}

/// Whether a panel is there and says of nothing that it is missing.
fn holds_data(html: &str, panel: char) -> bool {
    let begun = html.split_once(&format!("<section id=\"panel-{panel}\">"));
    begun.and_then(|(_, rest)| rest.split_once("</section>")).is_some_and(|(text, _)| {
        !text.contains("class=\"missing\"") && ["<svg", "<pre"].iter().any(|tag| text.contains(tag))
    })
}

/// The first Chromium in the path.
fn browser() -> Result<&'static str, String> {
    let runs = |name: &&str| succeeds(Command::new(name).arg("--version"));
    let found = BROWSERS.into_iter().find(runs);
    found.ok_or_else(|| "no Chromium in PATH (apt install chromium)".to_owned())
}

/// The browser on a page, with a profile of its own, which is gone afterwards.
///
/// * `fragment` - what follows the address, with its `#`; empty for nothing
fn browse<T>(
    html: &Path,
    fragment: &str,
    flags: &[OsString],
    run: impl FnOnce(&mut Command) -> T,
) -> Result<T, String> {
    let page = html.canonicalize().map_err(|error| format!("{}: {error}", html.display()))?;
    let profile = std::env::temp_dir().join(format!("squirrel-chromium-{}", std::process::id()));
    let mut address = joined("file://", &page);
    address.push(fragment);
    let mut command = Command::new(browser()?);
    command.args(FLAGS).arg(joined("--user-data-dir=", &profile)).args(flags).arg(address);
    let ran = run(&mut command);
    let _ = std::fs::remove_dir_all(&profile);
    Ok(ran)
}

/// A page as text, after its scripts have run.
pub(crate) fn dom(html: &Path, fragment: &str) -> Result<String, String> {
    browse(html, fragment, &["--dump-dom".into()], output)?
        .ok_or_else(|| format!("{}{fragment}: the browser failed", html.display()))
}

/// Draws a page.
pub(crate) fn draw(html: &Path, fragment: &str, png: &Path, size: &str) -> Result<(), String> {
    let (width, height) = parse_size(size)
        .ok_or_else(|| format!("size '{size}' is not WIDTHxHEIGHT with 1 to 16384 pixels"))?;
    // Chromium succeeds without having written anything, and refuses endings that it does not know.
    let unfinished = png.with_extension("part.png");
    let window = format!("--window-size={width},{height}");
    let flags = [joined("--screenshot=", &unfinished), window.into()];
    browse(html, fragment, &flags, call)??;
    std::fs::rename(&unfinished, png)
        .map_err(|error| format!("{}: the browser drew nothing: {error}", png.display()))
}

fn joined(flag: &str, path: &Path) -> OsString {
    let mut text = OsString::from(flag);
    text.push(path);
    text
}

/// `1200x3000` to (1200, 3000).
fn parse_size(text: &str) -> Option<(u32, u32)> {
    let (width, height) = text.split_once('x')?;
    let pixels = |text: &str| text.parse().ok().filter(|n| (1..=16_384).contains(n));
    Some((pixels(width)?, pixels(height)?))
}

#[cfg(test)]
mod tests {
    use super::{holds_data, parse_size};

    #[test]
    fn sizes_are_checked() {
        assert_eq!(parse_size("1200x3000"), Some((1200, 3000)));
        for wrong in ["", "1200", "x", "0x10", "10x16385", "-1x5", "1e3x5"] {
            assert_eq!(parse_size(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_panel_that_lacks_something_is_seen() {
        let page = |inside: &str| format!("<section id=\"panel-a\">{inside}</section><svg></svg>");
        assert!(holds_data(&page("<svg></svg>"), 'a'));
        assert!(!holds_data(&page("<svg></svg>"), 'b'));
        assert!(!holds_data(&page("<p>words</p>"), 'a'));
        assert!(!holds_data(&page("<svg></svg><p class=\"missing\">No height.</p>"), 'a'));
    }
}
