//! A report as a picture, to look at it where there is no browser window.

use crate::run::{call, succeeds};
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

/// `cargo xtask report-png HTML [PNG [WIDTHxHEIGHT]]`.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    let (html, png, size) = match arguments {
        [html] => (html, PathBuf::from(html).with_extension("png"), "1200x3000"),
        [html, png] => (html, PathBuf::from(png), "1200x3000"),
        [html, png, size] => (html, PathBuf::from(png), size.as_str()),
        _ => return Err("usage: report-png HTML [PNG [WIDTHxHEIGHT]]".to_owned()),
    };
    let (width, height) = parse_size(size)
        .ok_or_else(|| format!("size '{size}' is not WIDTHxHEIGHT with 1 to 16384 pixels"))?;
    let page = Path::new(html).canonicalize().map_err(|error| format!("{html}: {error}"))?;
    let browser = BROWSERS
        .into_iter()
        .find(|name| succeeds(Command::new(name).arg("--version")))
        .ok_or("no Chromium in PATH (apt install chromium)")?;
    // Chromium succeeds without having written anything, and refuses endings that it does not know.
    let profile = std::env::temp_dir().join(format!("squirrel-chromium-{}", std::process::id()));
    let unfinished = png.with_extension("part.png");
    let drawn = call(
        Command::new(browser)
            .args(FLAGS)
            .arg(joined("--user-data-dir=", &profile))
            .arg(joined("--screenshot=", &unfinished))
            .arg(format!("--window-size={width},{height}"))
            .arg(joined("file://", &page)),
    );
    let _ = std::fs::remove_dir_all(&profile);
    drawn?;
    std::fs::rename(&unfinished, &png)
        .map_err(|error| format!("{}: {browser} drew nothing: {error}", png.display()))
}

fn joined(flag: &str, path: &Path) -> std::ffi::OsString {
    let mut text = std::ffi::OsString::from(flag);
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
    use super::parse_size;

    #[test]
    fn sizes_are_checked() {
        assert_eq!(parse_size("1200x3000"), Some((1200, 3000)));
        for wrong in ["", "1200", "x", "0x10", "10x16385", "-1x5", "1e3x5"] {
            assert_eq!(parse_size(wrong), None, "{wrong}");
        }
    }
}
