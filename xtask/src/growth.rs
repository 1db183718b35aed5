//! `cargo xtask growth`: time and memory of the program by the length and number of flights.
//!
//! Memory does not depend on what else the machine does, so it is held to bounds; times are shown.

use crate::run::{programs, root, target_directory};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Lengths of flights, minutes.
const MINUTES: [u32; 4] = [1, 10, 60, 120];
/// Numbers of flights of 20 s for `gap run`.
const FLIGHTS: [u32; 4] = [10, 25, 50, 100];
/// Most memory of `fly` and `replay`, whatever the flight, MB.
const STREAM_MAX_MB: f64 = 200.0;
/// Most memory of `gap run` with 50 flights, MB; more flights, in proportion.
const GAP_MAX_MB: f64 = 1000.0;
/// How far memory may lie beside the straight line of its row.
const LINEAR_MAX: f64 = 1.2;
/// Samples a second of a table that is imported.
const ROWS_HZ: u32 = 100;
/// How often memory is looked at.
const LOOK: Duration = Duration::from_millis(10);
/// Of the clock in which the system counts processor time, Hz; Linux shows it so everywhere.
const TICKS_HZ: f64 = 100.0;

const MAP: &str = r#"[[source]]
time = { column = "t", unit = "s" }
[source.channels]
"imu.omega_body_rad_s" = { columns = ["gx", "gy", "gz"], body = "frd" }
"imu.specific_force_body_m_s2" = { columns = ["ax", "ay", "az"], body = "frd" }
"#;

/// What a run took.
#[derive(Clone, Copy)]
struct Cost {
    user_s: f64,
    memory_mb: f64,
}

/// Runs of one command, by size.
struct Row {
    what: &'static str,
    unit: &'static str,
    costs: Vec<(u32, Cost)>,
}

/// `cargo xtask growth [MINUTES]`.
pub(crate) fn chore(arguments: &[String]) -> Result<(), String> {
    let longest = arguments.first().map_or(Ok(120), |text| {
        text.parse::<u32>().map_err(|_| format!("MINUTES: `{text}` is no whole number"))
    })?;
    let program = programs(&["squirrel"])?.join("squirrel");
    let folder = target_directory()?.join("growth");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let lab = Lab { program, folder };
    let mut rows = lab.lengths(longest)?;
    rows.push(lab.flights(if longest < 120 { 50 } else { 100 })?);
    std::fs::remove_dir_all(&lab.folder).map_err(|e| format!("{}: {e}", lab.folder.display()))?;
    eprint!("{}", table(&rows));
    let problems: Vec<String> = rows.iter().flat_map(beyond).collect();
    if problems.is_empty() { Ok(()) } else { Err(problems.join("; ")) }
}

/// Where the program is measured.
struct Lab {
    program: PathBuf,
    folder: PathBuf,
}

impl Lab {
    /// `fly`, `replay` and `import` by minutes.
    fn lengths(&self, longest: u32) -> Result<Vec<Row>, String> {
        let of = |what| Row { what, unit: "min", costs: Vec::new() };
        let mut rows = vec![of("fly"), of("replay"), of("import")];
        self.write("map.toml", MAP)?;
        for minutes in MINUTES.into_iter().filter(|minutes| *minutes <= longest) {
            let seconds = 60 * minutes;
            self.write(
                "s.toml",
                &format!("name = \"long\"\nduration_s = {seconds}.0\nheight_m = 30.0\n[mission]\nkind = \"circle\"\nradius_m = 6.0\nspeed_m_s = 4.0\n"),
            )?;
            self.write("rows.csv", &rows_of(seconds))?;
            let import = ["import", "--map", "map.toml", "rows.csv", "--out", "o.mcap"];
            let fly = ["fly", "--scenario", "s.toml", "--out", "f.mcap"];
            let commands: [&[&str]; 3] = [&fly, &["replay", "f.mcap"], &import];
            for (row, command) in rows.iter_mut().zip(commands) {
                row.costs.push((minutes, self.cost(command)?));
            }
        }
        Ok(rows)
    }

    /// `gap run` by flights.
    fn flights(&self, most: u32) -> Result<Row, String> {
        self.write(
            "s.toml",
            "name = \"short\"\nduration_s = 20.0\nheight_m = 30.0\n[mission]\nkind = \"circle\"\nradius_m = 6.0\nspeed_m_s = 4.0\n",
        )?;
        // Flights of a vehicle with effects that the file does not know: the whole workflow has work.
        let vehicles = root()?.join("vehicles");
        let [flown, known] = ["squirrel_air.toml", "squirrel.toml"]
            .map(|name| vehicles.join(name).display().to_string());
        let names: Vec<String> = (1..=most).map(|seed| format!("{seed}.mcap")).collect();
        for (seed, name) in (1..=most).zip(&names) {
            let seed = seed.to_string();
            let fly = ["fly", "--vehicle", &flown, "--scenario", "s.toml", "--seed", &seed];
            self.cost(&[&fly[..], &["--out", name]].concat())?;
        }
        let mut row = Row { what: "gap run", unit: "flights", costs: Vec::new() };
        for count in FLIGHTS.into_iter().filter(|count| *count <= most) {
            let flights = names.iter().take(count as usize).map(String::as_str);
            let gap = ["gap", "run", "--vehicle", &known, "--out", "gap", "--flights"];
            let command: Vec<&str> = gap.into_iter().chain(flights).collect();
            row.costs.push((count, self.cost(&command)?));
        }
        Ok(row)
    }

    fn write(&self, name: &str, text: &str) -> Result<(), String> {
        let path = self.folder.join(name);
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// Runs the program to its end.
    fn cost(&self, arguments: &[&str]) -> Result<Cost, String> {
        let before_s = children_s()?;
        let mut child = Command::new(&self.program)
            .args(arguments)
            .current_dir(&self.folder)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|e| format!("{}: {e}", self.program.display()))?;
        let status = Path::new("/proc").join(child.id().to_string()).join("status");
        let mut memory_mb = 0.0_f64;
        let ended = loop {
            // Gone with the program, which does not grow while it ends.
            if let Some(now_mb) = std::fs::read_to_string(&status).ok().and_then(|s| peak_mb(&s)) {
                memory_mb = memory_mb.max(now_mb);
            }
            if let Some(ended) = child.try_wait().map_err(|e| e.to_string())? {
                break ended;
            }
            std::thread::sleep(LOOK);
        };
        if !ended.success() {
            return Err(format!("squirrel {}: {ended}", arguments.join(" ")));
        }
        Ok(Cost { user_s: children_s()? - before_s, memory_mb })
    }
}

/// A table of so many seconds.
fn rows_of(seconds: u32) -> String {
    let mut text = String::from("t,gx,gy,gz,ax,ay,az\n");
    for i in 0..seconds * ROWS_HZ {
        let t = f64::from(i) / f64::from(ROWS_HZ);
        let _ = writeln!(text, "{t:.2},{:.5},{:.5},0.1,0.2,-0.1,-9.81", t.sin(), t.cos());
    }
    text
}

/// Largest resident memory that a process has had, MB, of its status.
fn peak_mb(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024e-6)
}

/// User time of all children that have ended, s.
fn children_s() -> Result<f64, String> {
    let text = std::fs::read_to_string("/proc/self/stat")
        .map_err(|e| format!("/proc/self/stat: {e}; memory and time are measured on Linux"))?;
    children_of(&text).ok_or_else(|| "/proc/self/stat: no time of children".to_owned())
}

/// The sixteenth number; the second is a name in brackets, which may hold anything.
fn children_of(stat: &str) -> Option<f64> {
    let (_, behind) = stat.rsplit_once(')')?;
    let ticks: f64 = behind.split_whitespace().nth(13)?.parse().ok()?;
    Some(ticks / TICKS_HZ)
}

/// Every cost of a row beside the straight line `start + slope size` that fits the row best by
/// ratio. A start below zero would make room for growth faster than the size, so there is none.
fn beside_line(row: &Row, of: fn(&Cost) -> f64) -> Vec<f64> {
    // What takes less than a tick of the system's clock counts as one.
    let points =
        || row.costs.iter().map(|(size, cost)| (f64::from(*size), of(cost).max(1.0 / TICKS_HZ)));
    // Least squares of 1 by (1, size) / cost.
    let sum = |f: fn(f64, f64) -> f64| points().map(|(n, c)| f(n, c)).sum::<f64>();
    let (one, size) = (sum(|_, c| 1.0 / c), sum(|n, c| n / c));
    let (ones, both, sizes) =
        (sum(|_, c| 1.0 / (c * c)), sum(|n, c| n / (c * c)), sum(|n, c| n * n / (c * c)));
    let determinant = ones * sizes - both * both;
    let start = (one * sizes - both * size) / determinant;
    let slope = (ones * size - both * one) / determinant;
    let (start, slope) = match (start >= 0.0, slope >= 0.0) {
        (true, true) => (start, slope),
        (false, _) => (0.0, size / sizes),
        (true, false) => (one / ones, 0.0),
    };
    points().map(|(n, c)| c / (start + slope * n)).collect()
}

fn table(rows: &[Row]) -> String {
    let mut text = format!(
        "{:<8} {:>12} {:>9} {:>12} {:>9} {:>12}\n",
        "command", "size", "user s", "beside line", "peak MB", "beside line"
    );
    for row in rows {
        let times = beside_line(row, |cost| cost.user_s);
        let memories = beside_line(row, |cost| cost.memory_mb);
        for (((size, cost), time), memory) in row.costs.iter().zip(times).zip(memories) {
            let size = format!("{size} {}", row.unit);
            let _ = writeln!(
                text,
                "{:<8} {size:>12} {:>9.2} {time:>12.2} {:>9.0} {memory:>12.2}",
                row.what, cost.user_s, cost.memory_mb
            );
        }
    }
    text
}

/// Where memory is beyond its bounds.
fn beyond(row: &Row) -> Vec<String> {
    let mut problems = Vec::new();
    let factors = beside_line(row, |cost| cost.memory_mb);
    for ((size, cost), factor) in row.costs.iter().zip(factors) {
        let most_mb = match row.what {
            "gap run" => GAP_MAX_MB * f64::from((*size).max(50)) / 50.0,
            "import" => f64::INFINITY,
            _ => STREAM_MAX_MB,
        };
        let at = format!("{} of {size} {}", row.what, row.unit);
        if cost.memory_mb > most_mb {
            problems.push(format!("{at}: {:.0} MB, at most {most_mb:.0}", cost.memory_mb));
        }
        if factor > LINEAR_MAX {
            problems.push(format!("{at}: memory is {factor:.2} times its row's straight line"));
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_system_says_is_understood() {
        assert_eq!(peak_mb("Name:\tx\nVmHWM:\t  250000 kB\nVmRSS:\t 1 kB\n"), Some(256.0));
        assert_eq!(peak_mb("Name:\tx\n"), None);
        let stat = "7 (a ) b) S 1 2 3 4 5 6 7 8 9 10 11 12 250 14 15";
        assert_eq!(children_of(stat), Some(2.5));
        assert!(children_s().is_ok());
    }

    #[test]
    fn memory_beyond_its_bounds_is_found() {
        let cost = |memory_mb| Cost { user_s: 1.0, memory_mb };
        let row = |what, costs| Row { what, unit: "min", costs };
        assert!(beyond(&row("fly", vec![(1, cost(40.0)), (10, cost(90.0))])).is_empty());
        assert_eq!(beyond(&row("replay", vec![(1, cost(40.0)), (10, cost(201.0))])).len(), 1);
        let gap = vec![(50, cost(900.0)), (100, cost(1900.0))];
        assert!(beyond(&row("gap run", gap)).is_empty());
    }

    #[test]
    fn a_line_may_start_above_zero_and_growth_faster_than_the_size_is_found() {
        let row = |of: fn(f64) -> f64| {
            let cost = |n: u32| Cost { user_s: 1.0, memory_mb: of(f64::from(n)) };
            Row { what: "import", unit: "min", costs: MINUTES.map(|n| (n, cost(n))).to_vec() }
        };
        let memory = |cost: &Cost| cost.memory_mb;
        for of in [|n| 40.0 + n, |_| 40.0, |n| 3.0 * n] {
            assert!(beside_line(&row(of), memory).iter().all(|x| (x - 1.0).abs() < 1e-9));
        }
        assert!(!beyond(&row(|n| n * n)).is_empty());
        assert!(!beyond(&row(|n| n.powf(1.2))).is_empty());
    }
}
