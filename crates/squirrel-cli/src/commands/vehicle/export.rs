//! `squirrel vehicle export`: a file for another simulator.

use crate::output::{self, Table, say, talk};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::vehicle_file::export::{Exported, Target, export};
use std::path::PathBuf;

/// Options of the command.
#[derive(Debug, clap::Args)]
pub(crate) struct Export {
    /// Vehicle file, one that `gap add` has changed, too; or the name of a bundled vehicle.
    file: PathBuf,
    /// sdf (Gazebo), ardupilot-json, px4-params, mjcf (MuJoCo), rotorpy, crazyflow.
    #[arg(long, value_parser = Target::parse)]
    to: Target,
    /// File to write.
    #[arg(long)]
    out: PathBuf,
    /// Write what is lost here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Told<'a> {
    vehicle: &'a str,
    file: String,
    #[serde(flatten)]
    exported: &'a Exported,
}

impl Export {
    pub(super) fn run(&self) -> Result<(), String> {
        Paths::default()
            .vehicle("FILE", [&self.file])
            .writes("--out", [&self.out])
            .writes("--json", &self.json)
            .check()?;
        let vehicle = VehicleFile::find(&self.file).map_err(|e| e.to_string())?;
        let exported = export(&vehicle, self.to)?;
        output::write_file(&self.out, exported.text.as_bytes())?;
        for lost in &exported.lost {
            let size = lost.size.map_or(String::new(), |[hover, forward]| {
                format!(
                    "; it makes {:.3e} N, {:.3e} N m in hover, {:.3e} N, {:.3e} N m at 5 m/s",
                    hover.force_n, hover.moment_n_m, forward.force_n, forward.moment_n_m
                )
            });
            talk(&format!("{} cannot express {}: {}{size}", self.to.name(), lost.what, lost.why));
        }
        say(&format!("{}: written to {}\n", vehicle.name, self.out.display()));
        let mut table = Table::new(&["error that remains", "N", "N m"]);
        let remains = &exported.remains;
        for (what, error) in [
            ("hover", remains.hover),
            ("5 m/s ahead", remains.forward_5_m_s),
            ("5 m/s to the side", remains.sideways_5_m_s),
            ("climb of 2 m/s", remains.climb_2_m_s),
        ] {
            let cell = |x: f64| if x == 0.0 { "0".to_owned() } else { format!("{x:.3e}") };
            table.row(vec![what.to_owned(), cell(error.force_n), cell(error.moment_n_m)]);
        }
        table.print();
        let told = Told {
            vehicle: &vehicle.name,
            file: self.out.display().to_string(),
            exported: &exported,
        };
        output::write_json(self.json.as_deref(), &told)
    }
}
