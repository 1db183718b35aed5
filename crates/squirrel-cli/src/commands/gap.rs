//! `squirrel gap`: where simulation and measurement disagree.

use crate::output::{self, Table, say, talk};
use squirrel_sim::log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::PathBuf;

/// Steps of the gap workflow.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Gap {
    /// Residual force and moment of measured flights against a vehicle, per channel and window, ranked.
    Find {
        /// Vehicle file.
        #[arg(long)]
        vehicle: PathBuf,
        /// Flight logs.
        #[arg(long, required = true, num_args = 1..)]
        flights: Vec<PathBuf>,
        /// Folder for find.json.
        #[arg(long)]
        out: Option<PathBuf>,
        /// Write the result here as JSON.
        #[arg(long)]
        json: Option<PathBuf>,
    },
}

impl Gap {
    pub(crate) fn run(&self) -> Result<(), String> {
        let Self::Find { vehicle, flights, out, json } = self;
        let vehicle = VehicleFile::load(vehicle).map_err(|e| e.to_string())?;
        let logs = flights
            .iter()
            .map(|path| Ok((path.display().to_string(), FlightLog::read(path).map_err(|e| e.to_string())?)))
            .collect::<Result<Vec<_>, String>>()?;
        let finding = squirrel_gap::find(&vehicle, &logs).map_err(|e| e.to_string())?;
        let triple = |x: &[f64; 3]| x.map(|v| format!("{v:.4e}")).join("  ");
        say(&format!("residual force, body x y z:   {}  N rms", triple(&finding.residual.force_body_rms_n)));
        say(&format!(
            "residual moment, body x y z:  {}  N m rms\n",
            triple(&finding.residual.moment_body_rms_n_m)
        ));
        let mut table = Table::new(&["flight", "from s", "to s", "channel", "share %", "condition"]);
        for w in finding.places.iter().take(10) {
            table.row(vec![
                w.flight.clone(),
                format!("{:.2}", w.t0_s),
                format!("{:.2}", w.t1_s),
                w.channel.to_owned(),
                format!("{:.1}", 100.0 * w.share),
                w.condition.clone(),
            ]);
        }
        table.print();
        for note in &finding.notes {
            talk(&format!("note: {note}"));
        }
        if let Some(folder) = out {
            output::folder(folder)?;
            output::write_json(Some(&folder.join("find.json")), &finding)?;
        }
        output::write_json(json.as_deref(), &finding)
    }
}
