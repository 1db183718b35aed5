//! `squirrel vehicle check`: the numbers of a file.

use crate::output::{self, Table, say};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::margins::{AxisMargins, WARN_BELOW_RAD};
use squirrel_sim::vehicle_file::{Hovering, Means, Provenance, StepAnswer, VehicleFile};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Options of the command.
#[derive(Debug, clap::Args)]
pub(crate) struct Check {
    /// Vehicle file, or the name of a bundled vehicle.
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
    /// Roll, pitch, yaw; absent without gains.
    margins: Option<[AxisMargins; 3]>,
    /// Answers to a step of roll and of pitch, measured in the plant.
    steps: Option<[StepAnswer; 2]>,
    numbers: BTreeMap<&'a str, &'a Provenance>,
}

impl Check {
    pub(crate) fn run(&self) -> Result<(), String> {
        let Self { file, json } = self;
        Paths::default().vehicle("FILE", [file]).writes("--json", json).check()?;
        let vehicle = VehicleFile::find(file).map_err(|e| e.to_string())?;
        let at = |e: String| format!("{}: {e}", file.display());
        let means = vehicle.means().map_err(at)?;
        flies(&vehicle).map_err(at)?;
        say(&format!(
            "{}: sound. {} rotors, {:.3} kg\n",
            vehicle.name,
            vehicle.vehicle.rotors().len(),
            vehicle.vehicle.parameters().mass_kg,
        ));
        in_words(&means).print();
        say("");
        let margins = vehicle.margins();
        let steps = if margins.is_some() {
            let hovering = Hovering::new(&vehicle).map_err(at)?;
            Some([hovering.clone().answer(0), hovering.answer(1)])
        } else {
            None
        };
        if let (Some(margins), Some(steps)) = (&margins, &steps) {
            margins_in_words(margins, steps).print();
            for axis in margins.iter().filter(|axis| axis.nominal.phase_margin_rad < WARN_BELOW_RAD)
            {
                say(&format!(
                    "{} has {:.0} deg of phase margin: below {:.0} late rotors or a late gyro make it oscillate",
                    axis.axis,
                    axis.nominal.phase_margin_rad.to_degrees(),
                    WARN_BELOW_RAD.to_degrees(),
                ));
            }
            say("");
        }
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
        let result =
            Checked { vehicle: &vehicle.name, sound: true, means, margins, steps, numbers };
        output::write_json(json.as_deref(), &result)
    }
}

/// That it flies for a moment, where it has a flight code: numbers of which each can be may together
/// be none.
fn flies(vehicle: &VehicleFile) -> Result<(), String> {
    if vehicle.control.is_none() {
        return Ok(());
    }
    let scenario = Scenario { duration_s: 0.5, ..Scenario::find("hover")? };
    let (vehicle, integrator) = (vehicle.clone(), Integrator::Rk4);
    let setup = Setup { vehicle, arm: Arm::Pc, scenario, integrator };
    setup.fly(false, |_| {}).map(drop).map_err(|e| e.to_string())
}

/// The attitude loop: how far it is from oscillating, and how it follows.
fn margins_in_words(margins: &[AxisMargins], steps: &[StepAnswer]) -> Table {
    let mut table = Table::new(&[
        "attitude loop",
        "crossover rad/s",
        "phase margin deg",
        "at twice the lag",
        "M_s",
        "bears delay ms",
        "step rises in s",
        "overshoots %",
    ]);
    for (i, axis) in margins.iter().enumerate() {
        let step = |of: fn(&StepAnswer) -> String| steps.get(i).map_or("-".to_owned(), of);
        table.row(vec![
            axis.axis.to_owned(),
            format!("{:.1}", axis.nominal.crossover_rad_s),
            format!("{:.0}", axis.nominal.phase_margin_rad.to_degrees()),
            format!("{:.0}", axis.twice_the_lag.phase_margin_rad.to_degrees()),
            format!("{:.2}", axis.nominal.sensitivity_peak),
            format!("{:.0}", 1e3 * axis.nominal.delay_margin_s),
            step(|step| format!("{:.2}", step.rise_s)),
            step(|step| format!("{:.0}", 100.0 * step.overshoot)),
        ]);
    }
    table
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
