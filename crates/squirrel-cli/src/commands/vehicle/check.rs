//! `squirrel vehicle check`: the numbers of a file.

use crate::output::{self, Table, say};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_sim::vehicle_file::{Means, Provenance, VehicleFile};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Options of the command.
#[derive(Debug, clap::Args)]
pub(crate) struct Check {
    /// Vehicle file.
    file: PathBuf,
    /// Write the numbers here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// Longer values, such as a table of voltages, are cut in print; the JSON has them whole.
const VALUE_WIDTH: usize = 32;

#[derive(Serialize)]
struct Checked<'a> {
    vehicle: &'a str,
    sound: bool,
    means: Means,
    numbers: BTreeMap<&'a str, &'a Provenance>,
}

impl Check {
    pub(crate) fn run(&self) -> Result<(), String> {
        let Self { file, json } = self;
        Paths::default().vehicle("FILE", [file]).writes("--json", json).check()?;
        let vehicle = VehicleFile::load(file).map_err(|e| e.to_string())?;
        let means = vehicle.means().map_err(|e| format!("{}: {e}", file.display()))?;
        say(&format!(
            "{}: sound. {} rotors, {:.3} kg\n",
            vehicle.name,
            vehicle.vehicle.rotors().len(),
            vehicle.vehicle.parameters().mass_kg,
        ));
        in_words(&means).print();
        say("");
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
        let result = Checked { vehicle: &vehicle.name, sound: true, means, numbers };
        output::write_json(json.as_deref(), &result)
    }
}

/// What the numbers mean together.
pub(super) fn in_words(means: &Means) -> Table {
    let mut table = Table::new(&["what", "size"]);
    let mut row = |what: &str, size: String| table.row(vec![what.to_owned(), size]);
    row("command of a rotor in hover", format!("{:.3}", means.hover_command));
    row("thrust over weight", format!("{:.2}", means.thrust_to_weight));
    row("induced speed in hover", format!("{:.2} m/s", means.hover_induced_speed_m_s));
    row("drag at 7 m/s", format!("{:.2} N", means.drag_at_7_m_s_n));
    if let Some(force) = means.wing_force_at_30_deg_n {
        row("wings at 7 m/s and 30 deg", format!("{force:.2} N"));
    }
    if let Some(download) = means.wing_download_in_hover_n {
        row("wash on spread wings in hover", format!("{download:.2} N down"));
    }
    row("roll authority about hover", format!("{:.3} N m", means.roll_authority_n_m));
    row("pitch authority about hover", format!("{:.3} N m", means.pitch_authority_n_m));
    row("yaw authority about hover", format!("{:.3} N m", means.yaw_authority_n_m));
    table
}
