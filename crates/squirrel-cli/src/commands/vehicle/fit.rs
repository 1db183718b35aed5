//! `squirrel vehicle fit`: numbers from a bench.

use crate::output::{self, Table, say};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::vehicle_file::fit::{Fitted, Stand, Swing, hover, patched, period_s, swings};
use std::path::{Path, PathBuf};

/// Options of the command.
#[derive(Debug, clap::Args)]
pub(crate) struct Fit {
    /// Vehicle file, or the name of a bundled vehicle.
    file: PathBuf,
    /// Thrust stand, CSV with columns thrust_n (or thrust_g, thrust_kgf), rotor_speed_rad_s or
    /// rotor_speed_rpm, command (0 to 1) or command_pwm_us, torque_n_m, voltage_v.
    #[arg(long)]
    bench: Option<PathBuf>,
    /// Flight log (.mcap) with a hover: its mean command carries the weight.
    #[arg(long)]
    hover: Option<PathBuf>,
    /// Bifilar pendulum: CSV with columns axis, period_s, thread_length_m, thread_distance_m; or a
    /// flight log (.mcap) of the swing, with --thread-length-m and --thread-distance-m.
    #[arg(long)]
    spin: Option<PathBuf>,
    /// Length of the threads of the swing in the log, m.
    #[arg(long, requires = "spin", requires = "thread_distance_m")]
    thread_length_m: Option<f64>,
    /// Distance of the threads, m.
    #[arg(long, requires = "spin", requires = "thread_length_m")]
    thread_distance_m: Option<f64>,
    /// Vehicle file to write.
    #[arg(long)]
    out: PathBuf,
    /// Write the numbers here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Told<'a> {
    vehicle: &'a str,
    file: String,
    residual_thrust_n: Option<f64>,
    fitted: &'a [Fitted],
}

impl Fit {
    pub(super) fn lacks(&self) -> Option<String> {
        let any = self.bench.is_some() || self.hover.is_some() || self.spin.is_some();
        (!any).then(|| "missing: one of --bench, --hover, --spin".to_owned())
    }

    pub(super) fn run(&self) -> Result<(), String> {
        Paths::default()
            .vehicle("FILE", [&self.file])
            .reads("--bench", &self.bench)
            .reads("--hover", &self.hover)
            .reads("--spin", &self.spin)
            .writes("--out", [&self.out])
            .writes("--json", &self.json)
            .check()?;
        let mut vehicle = VehicleFile::find(&self.file).map_err(|e| e.to_string())?;
        let (mut all, mut residual) = (Vec::new(), None);
        // One after the other: a hover scales what the stand has said.
        if let Some(path) = &self.bench {
            let name = name(path);
            let stand = Stand::parse(&read(path)?, &path.display().to_string())?;
            let fit = stand.fit(&vehicle, &name)?;
            residual = Some(fit.residual_n);
            take(&mut vehicle, fit.numbers, &mut all)?;
        }
        if let Some(path) = &self.hover {
            let log = FlightLog::read(path).map_err(|e| e.to_string())?;
            let numbers = hover(&vehicle, &log, &name(path))?;
            take(&mut vehicle, numbers, &mut all)?;
        }
        if let Some(path) = &self.spin {
            let fit = swings(&vehicle, &self.swings(path)?, &name(path))?;
            take(&mut vehicle, fit.numbers, &mut all)?;
        }
        output::write_file(&self.out, vehicle.text.as_bytes())?;
        let mut table = Table::new(&["field", "value", "sd", "source"]);
        let list = |values: &[f64]| {
            values.iter().map(|x| format!("{x:.4e}")).collect::<Vec<_>>().join(", ")
        };
        for fitted in &all {
            table.row(vec![
                fitted.field.clone(),
                list(&fitted.value),
                list(&fitted.sd),
                fitted.source.clone(),
            ]);
        }
        table.print();
        if let Some(residual) = residual {
            say(&format!("\nthe stand's thrust is missed by {residual:.3} N rms"));
        }
        let told = Told {
            vehicle: &vehicle.name,
            file: self.out.display().to_string(),
            residual_thrust_n: residual,
            fitted: &all,
        };
        output::write_json(self.json.as_deref(), &told)
    }

    fn swings(&self, path: &Path) -> Result<Vec<Swing>, String> {
        let is_log = path.extension().is_some_and(|e| e == "mcap");
        match (self.thread_length_m, self.thread_distance_m) {
            (Some(thread_length_m), Some(thread_distance_m)) if is_log => {
                for (option, x) in [
                    ("--thread-length-m", thread_length_m),
                    ("--thread-distance-m", thread_distance_m),
                ] {
                    if !(x.is_finite() && x > 0.0) {
                        return Err(format!("{option} {x}: must be > 0"));
                    }
                }
                let log = FlightLog::read(path).map_err(|e| e.to_string())?;
                let (axis, period_s) = period_s(&log, &path.display().to_string())?;
                let mass_kg = None;
                Ok(vec![Swing { axis, period_s, thread_length_m, thread_distance_m, mass_kg }])
            }
            _ if is_log => Err(format!(
                "{}: a log needs --thread-length-m and --thread-distance-m",
                path.display()
            )),
            _ => Swing::parse(&read(path)?, &path.display().to_string()),
        }
    }
}

fn take(
    vehicle: &mut VehicleFile,
    numbers: Vec<Fitted>,
    all: &mut Vec<Fitted>,
) -> Result<(), String> {
    let text = patched(vehicle, &numbers)?;
    *vehicle = VehicleFile::parse_with(&text, &vehicle.name, vehicle.weights.clone())
        .map_err(|e| e.to_string())?;
    all.retain(|old| !numbers.iter().any(|new| new.field == old.field));
    all.extend(numbers);
    Ok(())
}

fn name(path: &Path) -> String {
    path.file_name()
        .map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

fn read(path: &Path) -> Result<String, String> {
    squirrel_log::files::read_text(path).map_err(|e| format!("{}: {e}", path.display()))
}
