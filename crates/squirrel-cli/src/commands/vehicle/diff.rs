//! `squirrel vehicle diff`: two files beside each other.

use crate::output::{self, Table, say};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::vehicle_file::diff::{Compared, Does, compare};
use std::path::PathBuf;

/// Options of the command.
#[derive(Debug, clap::Args)]
pub(crate) struct Diff {
    /// Vehicle file, or the name of a bundled vehicle.
    a: PathBuf,
    /// The other.
    b: PathBuf,
    /// Write the numbers here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Told<'a> {
    vehicles: [&'a str; 2],
    #[serde(flatten)]
    compared: &'a Compared,
}

/// A longer list is cut in print; the JSON has it whole.
const VALUE_WIDTH: usize = 40;

impl Diff {
    pub(super) fn run(&self) -> Result<(), String> {
        Paths::default()
            .vehicle("A", [&self.a])
            .vehicle("B", [&self.b])
            .writes("--json", &self.json)
            .check()?;
        let [a, b] = [&self.a, &self.b].map(|path| VehicleFile::find(path));
        let (a, b) = (a.map_err(|e| e.to_string())?, b.map_err(|e| e.to_string())?);
        let compared = compare(&a, &b)?;
        if compared.numbers.is_empty() {
            say("no number differs");
        } else {
            let mut table = Table::new(&["field", "A", "B", "in sd of A"]);
            for number in &compared.numbers {
                let text = |value: &Option<String>| match value {
                    None => "-".to_owned(),
                    Some(text) => match text.char_indices().nth(VALUE_WIDTH) {
                        Some((end, _)) => format!("{}...", &text[..end]),
                        None => text.clone(),
                    },
                };
                let in_sd = number.in_sd.map_or_else(|| "-".to_owned(), |x| format!("{x:+.1}"));
                table.row(vec![number.field.clone(), text(&number.a), text(&number.b), in_sd]);
            }
            table.print();
            say("");
            in_flight(&compared.a, &compared.b).print();
        }
        let told = Told { vehicles: [&a.name, &b.name], compared: &compared };
        output::write_json(self.json.as_deref(), &told)
    }
}

fn in_flight(a: &Does, b: &Does) -> Table {
    let mut table = Table::new(&["in flight", "A", "B", "change"]);
    let mut row = |what: &str, a: f64, b: f64, digits: usize| {
        let change =
            if a == 0.0 { "-".to_owned() } else { format!("{:+.1} %", 100.0 * (b / a - 1.0)) };
        table.row(vec![what.to_owned(), format!("{a:.digits$}"), format!("{b:.digits$}"), change]);
    };
    row("mass kg", a.mass_kg, b.mass_kg, 4);
    row("command of a rotor in hover", a.hover_command, b.hover_command, 3);
    row("thrust over weight", a.thrust_to_weight, b.thrust_to_weight, 2);
    row("drag at 7 m/s N", a.drag_at_7_m_s_n, b.drag_at_7_m_s_n, 4);
    row("roll authority rad/s^2", a.roll_authority_rad_s2, b.roll_authority_rad_s2, 1);
    row("pitch authority rad/s^2", a.pitch_authority_rad_s2, b.pitch_authority_rad_s2, 1);
    row("yaw authority rad/s^2", a.yaw_authority_rad_s2, b.yaw_authority_rad_s2, 1);
    row("moment in hover N m", a.hover_moment_n_m, b.hover_moment_n_m, 6);
    row("rotor lag s", a.rotor_lag_s, b.rotor_lag_s, 4);
    table
}
