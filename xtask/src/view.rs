//! The scene of two flights in a browser: what the page says at three instants is what the log
//! says, and pictures of it to look at.

use crate::png;
use crate::run::{call, cargo, root, target_directory};
use std::path::Path;
use std::process::Command;

/// Who flies: wings folded throughout, and wings that open.
const ARMS: [&str; 2] = ["pc", "twcc_plus"];
const FLIGHT: [&str; 7] =
    ["fly", "--scenario", "avoid", "--seed", "3", "--thrust-to-weight", "1.25"];
/// A desk's screen and a telephone's.
const SIZES: [[u32; 2]; 2] = [[1280, 720], [400, 800]];
/// The picture of the guide: the wings just open.
const PICTURE: &str = "docs/pictures/view.png";

/// An instant of the figures: what wings were, when, and how far open.
#[derive(Debug, PartialEq)]
struct Instant {
    what: String,
    time_s: f64,
    deployment: f64,
}

/// `cargo xtask view-png [--write]`: into `target/view`; `--write` takes a new picture for the guide.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    let write = match arguments {
        [] => false,
        [only] if only == "--write" => true,
        _ => return Err("usage: view-png [--write]".to_owned()),
    };
    call(cargo()?.args(["build", "--release", "--locked", "-p", "squirrel-cli"]))?;
    let (target, folder) = (target_directory()?, target_directory()?.join("view"));
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let squirrel = |arguments: &[&str]| {
        let program = target.join("release").join("squirrel");
        call(Command::new(program).current_dir(&folder).args(arguments))
    };
    for arm in ARMS {
        let log = format!("{arm}.mcap");
        squirrel(&[&FLIGHT[..], &["--arm", arm, "--out", &log]].concat())?;
    }
    let logs = ARMS.map(|arm| format!("{arm}.mcap"));
    squirrel(&["view", &logs[0], &logs[1], "--out", "view.html", "--json", "view.json"])?;
    let (page, figures) = (folder.join("view.html"), folder.join("view.json"));
    let text = std::fs::read_to_string(&figures)
        .map_err(|error| format!("{}: {error}", figures.display()))?;
    let instants = instants(&text);
    for what in ["folded", "opening", "open"] {
        let Some(instant) = instants.iter().find(|instant| instant.what == what) else {
            return Err(format!("{}: no instant at which wings are {what}", figures.display()));
        };
        let at = format!("#t={}", instant.time_s);
        says(&png::dom(&page, &at)?, instant)?;
        for [width, height] in SIZES {
            let png = folder.join(format!("{what}-{width}.png"));
            png::draw(
                &framed(&page, &at, [width, height])?,
                "",
                &png,
                &format!("{width}x{height}"),
            )?;
        }
    }
    if write {
        let picture = root()?.join(PICTURE);
        std::fs::copy(folder.join("open-1280.png"), picture)
            .map_err(|error| format!("{PICTURE}: {error}"))?;
    }
    eprintln!("{}", folder.display());
    Ok(())
}

/// A page that shows another in a frame: windows are never as narrow as a telephone.
fn framed(page: &Path, at: &str, [width, height]: [u32; 2]) -> Result<std::path::PathBuf, String> {
    let frame = page.with_file_name("frame.html");
    let html = format!(
        "<body style=\"margin:0\"><iframe src=\"view.html{at}\" width={width} height={height} style=\"border:0;display:block\"></iframe>"
    );
    std::fs::write(&frame, html).map_err(|error| format!("{}: {error}", frame.display()))?;
    Ok(frame)
}

/// Holds what a page shows at an instant against the figures.
fn says(dom: &str, instant: &Instant) -> Result<(), String> {
    let Instant { what, time_s, deployment } = instant;
    let table = between(dom, "id=\"readings\"", "</table>").ok_or("the page has no readings")?;
    let row = table.rsplit("<tr>").next().unwrap_or_default();
    let cells: Vec<&str> =
        row.split("<td>").skip(1).filter_map(|cell| cell.split("</td>").next()).collect();
    let wings: Vec<f64> = cells
        .iter()
        .skip(1)
        .take(2)
        .filter_map(|cell| cell.split(" %").next()?.parse().ok())
        .collect();
    let mean = wings.iter().sum::<f64>() / wings.len() as f64;
    if !(wings.len() == 2 && (mean - 100.0 * deployment).abs() <= 1.0) {
        return Err(format!("{what} at {time_s} s: the log has {deployment}, the page {cells:?}"));
    }
    let count = between(dom, "id=\"count\">", "</span>").unwrap_or_default();
    let words = count.split_whitespace().filter_map(|word| word.parse::<u64>().ok());
    match words.collect::<Vec<_>>()[..] {
        [triangles, calls, most, most_calls]
            if 0 < triangles && triangles <= most && 0 < calls && calls <= most_calls =>
        {
            eprintln!("{what} at {time_s} s: {mean} % open; {count}");
            Ok(())
        }
        _ => Err(format!("{what} at {time_s} s: the page counts `{count}`")),
    }
}

fn between<'a>(text: &'a str, from: &str, to: &str) -> Option<&'a str> {
    text.split_once(from)?.1.split_once(to).map(|(inside, _)| inside)
}

/// The instants of a figures file, in its order.
fn instants(json: &str) -> Vec<Instant> {
    let number = |text: &str, key: &str| {
        let rest = text.split_once(key)?.1;
        rest.split([',', '}', '\n']).next()?.trim().parse().ok()
    };
    let found = json.split("\"what\": \"").skip(1).filter_map(|text| {
        let what = text.split('"').next()?.to_owned();
        let time_s = number(text, "\"time_s\":")?;
        Some(Instant { what, time_s, deployment: number(text, "\"deployment\":")? })
    });
    found.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(wing: &str, count: &str) -> String {
        format!(
            "<table id=\"readings\"><tr><th>left wing</th></tr><tr><td>pc</td><td>0 %, 0\u{b0}</td></tr>\
             <tr><td>b</td><td>{wing}</td><td>{wing}</td><td>7.1</td></tr></table><span id=\"count\">{count}</span>"
        )
    }

    #[test]
    fn a_page_that_shows_other_wings_or_more_triangles_is_seen() {
        let half = Instant { what: "opening".to_owned(), time_s: 5.5, deployment: 0.48 };
        let count = "10 triangles in 2 draw calls this frame; 12 in 3 with everything shown";
        assert_eq!(says(&page("48 %, 48\u{b0}", count), &half), Ok(()));
        assert!(says(&page("52 %, 52\u{b0}", count), &half).is_err());
        assert!(says(&page("\u{2013}", count), &half).is_err());
        let more = "13 triangles in 2 draw calls this frame; 12 in 3 with everything shown";
        assert!(says(&page("48 %, 48\u{b0}", more), &half).is_err());
        assert!(says(&page("48 %, 48\u{b0}", "0 triangles in 0 draw calls"), &half).is_err());
    }

    #[test]
    fn instants_are_read_in_order() {
        let json = "{\"moments\": [\n{\n\"what\": \"folded\",\n\"time_s\": 5.42,\n\"deployment\": 0.0\n},\n\
                    {\n\"what\": \"open\",\n\"time_s\": 5.6,\n\"deployment\": 0.958\n}]}";
        let instant =
            |what: &str, time_s, deployment| Instant { what: what.to_owned(), time_s, deployment };
        assert_eq!(instants(json), [instant("folded", 5.42, 0.0), instant("open", 5.6, 0.958)]);
    }
}
