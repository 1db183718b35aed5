//! `squirrel vehicle new`: a first file.

use super::check::in_words;
use crate::output::{self, say, talk};
use crate::paths::Paths;
use serde::Serialize;
use squirrel_sim::vehicle_file::new::{Frame, Given, LogParameters, Said};
use squirrel_sim::vehicle_file::{Means, Provenance, VehicleFile};
use std::collections::BTreeMap;
use std::io::{BufRead, IsTerminal, stdin};
use std::path::{Path, PathBuf};

/// Options of the command.
#[derive(Debug, clap::Args)]
pub(crate) struct New {
    /// Log of an autopilot whose own parameters are taken: PX4 (.ulg). What is given beside it goes
    /// first.
    #[arg(long)]
    from: Option<PathBuf>,
    /// Layout and numbering of the rotors: quad-x, quad-plus, hexa-x, hexa-plus, octo-x, octo-plus
    /// (numbered as PX4 and ArduPilot do), quad-x-betaflight, quad-x-crazyflie.
    #[arg(long, value_parser = Frame::parse)]
    frame: Option<Frame>,
    /// Mass, ready to fly, kg.
    #[arg(long, allow_negative_numbers = true)]
    mass_kg: Option<f64>,
    /// Distance from the centre to a hub, m.
    #[arg(long, allow_negative_numbers = true)]
    arm_m: Option<f64>,
    /// Diameter of the propellers, inch.
    #[arg(long, allow_negative_numbers = true)]
    propeller_inch: Option<f64>,
    /// Pitch of the propellers, inch.
    #[arg(long, allow_negative_numbers = true)]
    pitch_inch: Option<f64>,
    /// Cells of the battery in series.
    #[arg(long, allow_negative_numbers = true)]
    cells: Option<f64>,
    /// Speed of the motors without load over voltage, rpm/V.
    #[arg(long, allow_negative_numbers = true)]
    kv: Option<f64>,
    /// Capacity of the battery, Ah.
    #[arg(long, allow_negative_numbers = true)]
    capacity_ah: Option<f64>,
    /// Thrust in hover over the most thrust, 0 to 1: says more than kv and cells.
    #[arg(long, allow_negative_numbers = true)]
    hover_thrust_fraction: Option<f64>,
    /// Commands are pulses of 1000 to 2000 us, not 0 to 1.
    #[arg(long)]
    pwm: bool,
    /// Name of the vehicle; that of the file if left out.
    #[arg(long)]
    name: Option<String>,
    /// Vehicle file to write.
    #[arg(long)]
    out: PathBuf,
    /// Write the numbers here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Made<'a> {
    vehicle: &'a str,
    file: String,
    means: Means,
    numbers: BTreeMap<&'a str, &'a Provenance>,
    guessed: Vec<&'a str>,
}

impl New {
    /// Asks for what is missing where somebody sits at a terminal; says what still is.
    pub(super) fn lacks(&mut self) -> Option<String> {
        // What a log says of it comes to light when it is read.
        if self.from.is_some() {
            return self
                .mass_kg
                .is_none()
                .then(|| "--mass-kg: missing; no log says what the vehicle weighs".to_owned());
        }
        let missing = self.given(None).map(|given| given.missing()).unwrap_or_default();
        if missing.is_empty() {
            return None;
        }
        if stdin().is_terminal() {
            self.ask();
        }
        let missing = self.given(None).map(|given| given.missing()).unwrap_or_default();
        (!missing.is_empty()).then(|| {
            format!(
                "missing: {}; for example: squirrel vehicle new --frame quad-x --mass-kg 0.75 --propeller-inch 5 --out mine.toml",
                missing.join(", ")
            )
        })
    }

    fn ask(&mut self) {
        talk("An empty line leaves a number to be guessed.");
        if self.frame.is_none() {
            let names: Vec<&str> = Frame::ALL.iter().map(|(name, _)| *name).collect();
            self.frame = asked(&format!("frame ({})", names.join(", ")), Frame::parse);
        }
        let number = |text: &str| text.parse::<f64>().map_err(|_| format!("{text}: is no number"));
        for (place, question) in [
            (&mut self.mass_kg, "mass, ready to fly, kg"),
            (&mut self.propeller_inch, "propeller diameter, inch"),
            (&mut self.pitch_inch, "propeller pitch, inch"),
            (&mut self.arm_m, "centre to hub, m"),
            (&mut self.cells, "battery cells in series"),
            (&mut self.kv, "motor speed constant, rpm/V"),
        ] {
            if place.is_none() {
                *place = asked(question, number);
            }
        }
    }

    fn given(&self, log: Option<&Path>) -> Result<Given, String> {
        let said = |value: Option<f64>, option: &str| {
            value.map(|value| Said { value, source: option.to_owned() })
        };
        let stem = self.out.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let mut given = Given {
            name: self.name.clone().or(stem).unwrap_or_else(|| "vehicle".to_owned()),
            frame: self.frame,
            mass_kg: said(self.mass_kg, "--mass-kg"),
            arm_m: said(self.arm_m, "--arm-m"),
            propeller_inch: said(self.propeller_inch, "--propeller-inch"),
            pitch_inch: said(self.pitch_inch, "--pitch-inch"),
            cells: said(self.cells, "--cells"),
            kv_rpm_per_v: said(self.kv, "--kv"),
            capacity_ah: said(self.capacity_ah, "--capacity-ah"),
            hover_thrust_fraction: said(self.hover_thrust_fraction, "--hover-thrust-fraction"),
            pwm_commands: self.pwm,
            ..Given::default()
        };
        if let Some(path) = log {
            let parameters = LogParameters(log_parameters(path)?);
            parameters.fill(&mut given, &path.display().to_string())?;
        }
        Ok(given)
    }

    pub(super) fn run(&self) -> Result<(), String> {
        Paths::default()
            .reads("--from", &self.from)
            .writes("--out", [&self.out])
            .writes("--json", &self.json)
            .check()?;
        let given = self.given(self.from.as_deref())?;
        let file = given.vehicle_file().map_err(|e| e.to_string())?;
        let means = file.means().map_err(|e| format!("{}: {e}", self.out.display()))?;
        output::write_file(&self.out, file.text.as_bytes())?;
        say(&format!("{}: written to {}\n", file.name, self.out.display()));
        in_words(&means).print();
        let guessed = guessed(&file);
        say(&format!(
            "\n{} numbers are guessed, each with its tolerance: squirrel vehicle check {}",
            guessed.len(),
            self.out.display()
        ));
        let numbers: BTreeMap<&str, &Provenance> =
            file.provenance.iter().map(|(field, p)| (field.as_str(), p)).collect();
        let made = Made {
            vehicle: &file.name,
            file: self.out.display().to_string(),
            means,
            numbers,
            guessed,
        };
        output::write_json(self.json.as_deref(), &made)
    }
}

/// Fields whose source says so.
fn guessed(file: &VehicleFile) -> Vec<&str> {
    let is_guess = |p: &Provenance| p.source.as_ref().is_some_and(|s| s.starts_with("guess"));
    file.provenance.iter().filter(|(_, p)| is_guess(p)).map(|(field, _)| field.as_str()).collect()
}

/// The parameters that an autopilot wrote into its log.
fn log_parameters(path: &Path) -> Result<BTreeMap<String, f64>, String> {
    squirrel_log::import::parameters(path).map_err(|e| e.to_string())
}

/// One answer from the terminal; asked again until it can be used, `None` for an empty line.
fn asked<T>(question: &str, parse: impl Fn(&str) -> Result<T, String>) -> Option<T> {
    loop {
        talk(&format!("{question}?"));
        let mut line = String::new();
        if stdin().lock().read_line(&mut line).is_err() || line.trim().is_empty() {
            return None;
        }
        match parse(line.trim()) {
            Ok(answer) => return Some(answer),
            Err(problem) => talk(&problem),
        }
    }
}
