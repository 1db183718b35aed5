//! `squirrel vehicle`: vehicle files.

use crate::output::{self, Table, say};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_sim::vehicle_file::{Provenance, VehicleFile};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What to do with a vehicle file.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum VehicleCommand {
    /// Check a file and show its numbers with tolerance and source.
    Check {
        /// Vehicle file.
        file: PathBuf,
        /// Write the numbers here as JSON.
        #[arg(long)]
        json: Option<PathBuf>,
    },
}

/// Longer values, such as a table of voltages, are cut in print; the JSON has them whole.
const VALUE_WIDTH: usize = 32;

#[derive(Serialize)]
struct Checked<'a> {
    vehicle: &'a str,
    sound: bool,
    numbers: BTreeMap<&'a str, &'a Provenance>,
}

impl VehicleCommand {
    pub(crate) fn run(&self) -> Result<(), String> {
        let Self::Check { file, json } = self;
        Paths::default().vehicle("FILE", [file]).writes("--json", json).check()?;
        let vehicle = VehicleFile::load(file).map_err(|e| e.to_string())?;
        let v = &vehicle.vehicle;
        say(&format!(
            "{}: sound. {} rotors, {:.3} kg, hover at {:.2} of top thrust, thrust limit {:.2} of weight\n",
            vehicle.name,
            v.rotors().len(),
            v.parameters().mass_kg,
            v.weight_n() / v.rotor_thrust_max_n() / v.rotors().len() as f64,
            v.parameters().limits.thrust_max_n / v.weight_n(),
        ));
        if let Some(weights) = &vehicle.weights {
            let [slow, fast] = weights.parnn().domain.speed_m_s;
            let [low, high] = weights.parnn().domain.alpha_rad;
            say(&format!(
                "twcc_parnn flies: its weights were trained at {slow:.2} to {fast:.2} m/s and angles of attack of {low:.2} to {high:.2} rad\n"
            ));
        }
        let mut table = Table::new(&["field", "value", "sd", "source"]);
        for (field, p) in &vehicle.provenance {
            let text = |x: &Option<String>| x.clone().unwrap_or_else(|| "-".to_owned());
            let value = match p.value.char_indices().nth(VALUE_WIDTH) {
                Some((end, _)) => format!("{}...", &p.value[..end]),
                None => p.value.clone(),
            };
            table.row(vec![field.clone(), value, text(&p.sd), text(&p.source)]);
        }
        table.print();
        let numbers: BTreeMap<&str, &Provenance> =
            vehicle.provenance.iter().map(|(field, p)| (field.as_str(), p)).collect();
        let result = Checked { vehicle: &vehicle.name, sound: true, numbers };
        output::write_json(json.as_deref(), &result)
    }
}
