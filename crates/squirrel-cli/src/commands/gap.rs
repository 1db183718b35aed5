//! `squirrel gap`: where simulation and measurement disagree, what is missing, and what adding it
//! is worth.

mod check;

use crate::output::{self, Table, say, talk};
use crate::paths::Paths;
use crate::paths::log_files;
use squirrel_gap::{
    Baseline, ClosedLoop, Flights, GapError, Kind, Moved, NamedEffect, Patched, RotorHealth, Value,
    Verdict, Workflow, significant,
};
use squirrel_log::{FlightLog, files};
use squirrel_sim::scenario::pilot_card;
use squirrel_sim::vehicle_file::VehicleFile;
use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

/// What the steps write into the folder of `--out`.
const FIND: &str = "find.json";
const VERDICT: &str = "verdict.json";
const CHECK: &str = "check.json";
const CHECK_PAGE: &str = "check.html";
const REPORT: &str = "report.html";

/// Steps of the gap workflow.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Gap {
    /// Before any verdict: whether the data agree with themselves, from which size on the flights
    /// show each effect, and what to fly.
    Check(Looked),
    /// Residual force and moment of measured flights against a vehicle, per channel and window,
    /// ranked.
    Find(Given),
    /// Which effect the vehicle file lacks.
    Name(Given),
    /// A new vehicle file with the missing effect in it.
    Add {
        #[command(flatten)]
        flights: Given,
        /// Add this effect, of an answer that is a set of them or not sure enough to be added by
        /// itself.
        #[arg(long, value_name = "NAME")]
        effect: Option<String>,
        /// Write the file's own numbers, too, where these flights have them, inside their
        /// tolerances; also where no effect is missing.
        #[arg(long, conflicts_with = "effect")]
        fit: bool,
        /// Print the patch and write nothing.
        #[arg(long)]
        dry_run: bool,
    },
    /// What the missing effect is worth on held-out flights, re-simulated.
    Shrink(Given),
    /// All of it, from the check on, with a report.
    Run {
        #[command(flatten)]
        flights: Given,
        /// Write the file's own numbers, too, where these flights have them, inside their
        /// tolerances; also where no effect is missing.
        #[arg(long)]
        fit: bool,
    },
}

/// What is looked at before any verdict.
#[derive(Debug, clap::Args)]
pub(crate) struct Looked {
    /// Vehicle file, or the name of a bundled vehicle.
    #[arg(long)]
    vehicle: PathBuf,
    /// Flight logs, or folders of them, from which effects are to be named.
    #[arg(long, required = true, num_args = 1..)]
    flights: Vec<PathBuf>,
    /// Flight logs, or folders of them, for the proof: their data alone are looked at.
    #[arg(long, num_args = 1..)]
    held_out: Vec<PathBuf>,
    /// Good flights of the same machine, or folders of them: what could be shown of what has
    /// changed since.
    #[arg(long, num_args = 1..)]
    baseline: Vec<PathBuf>,
    /// Folder for the result and its page.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write the result here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// What every other step is given.
#[derive(Debug, clap::Args)]
pub(crate) struct Given {
    /// Vehicle file, or the name of a bundled vehicle.
    #[arg(long)]
    vehicle: PathBuf,
    /// Flight logs, or folders of them, that the explanation is fitted to.
    #[arg(long, required = true, num_args = 1..)]
    flights: Vec<PathBuf>,
    /// Flight logs, or folders of them, that it never sees.
    #[arg(long, num_args = 1..)]
    held_out: Vec<PathBuf>,
    /// Good flights of the same machine, or folders of them: the vehicle's numbers become theirs,
    /// and what is named is what has changed since.
    #[arg(long, num_args = 1..)]
    baseline: Vec<PathBuf>,
    /// Folder for what is written.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write the result here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

impl Gap {
    pub(crate) fn run(&self) -> Result<(), String> {
        match self {
            Self::Check(flights) => flights.run(),
            Self::Find(flights) => flights.find(),
            Self::Name(flights) => flights.name(),
            Self::Add { flights, effect, fit, dry_run } => {
                flights.add(effect.as_deref(), *fit, *dry_run)
            }
            Self::Shrink(flights) => flights.shrink(),
            Self::Run { flights, fit } => flights.everything(*fit),
        }
    }
}

impl Looked {
    fn run(&self) -> Result<(), String> {
        let kept = self.out.as_ref().map(|folder| folder.join(CHECK));
        let mut paths = Paths::default()
            .vehicle("--vehicle", [&self.vehicle])
            .flights("--flights", &self.flights)?
            .flights("--held-out", &self.held_out)?
            .flights("--baseline", &self.baseline)?
            .writes_json(self.json.as_ref(), kept.as_ref());
        if let Some(folder) = &self.out {
            paths = paths.writes_into(folder, [CHECK_PAGE, CHECK]);
        }
        paths.check()?;
        let vehicle = VehicleFile::find(&self.vehicle).map_err(|e| e.to_string())?;
        let (flights, held_out) = (logs(&self.flights)?, logs(&self.held_out)?);
        let own = fitted(&vehicle, &self.baseline)?;
        let found = looked(&vehicle, own.as_ref(), &flights, &held_out)?;
        check::show(&found);
        notes(&found.notes);
        if let Some(folder) = &self.out {
            output::folder(folder)?;
            output::write_json(Some(&folder.join(CHECK)), &found)?;
            let path = folder.join(CHECK_PAGE);
            let page = squirrel_gap::report::render_check(&vehicle.name, &found);
            output::write_file(&path, page.as_bytes())?;
            say(&format!("report: {}", path.display()));
        }
        output::write_json(self.json.as_deref(), &found)
    }
}

/// What a machine's own good flights make of its file; none where there are no such flights.
fn fitted(vehicle: &VehicleFile, good: &[PathBuf]) -> Result<Option<Baseline>, String> {
    if good.is_empty() {
        return Ok(None);
    }
    let good = logs(good)?;
    telling(|tell| Baseline::fit(vehicle, &good, tell)).map(Some)
}

/// Long work that tells what it is at.
fn telling<T>(work: impl FnOnce(&dyn Fn(&str)) -> Result<T, GapError>) -> Result<T, String> {
    let bar = output::spinner();
    let done = work(&|what| {
        bar.set_message(what.to_owned());
        bar.inc(1);
    });
    bar.finish_and_clear();
    done.map_err(|e| e.to_string())
}

/// What flights are worth before any verdict.
///
/// * `own` - the same machine as it flew when it flew well, where that is known
fn looked(
    vehicle: &VehicleFile,
    own: Option<&Baseline>,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
) -> Result<squirrel_gap::Check, String> {
    telling(|tell| match own {
        Some(own) => squirrel_gap::check_since(own, flights, held_out, tell),
        None => squirrel_gap::check(vehicle, flights, held_out, tell),
    })
}

impl Given {
    /// Whether a step may begin that writes these files into the folder, the last of them what
    /// `--json` has, too.
    fn check(&self, names: &[&OsStr]) -> Result<(), String> {
        let reads = Paths::default()
            .vehicle("--vehicle", [&self.vehicle])
            .flights("--flights", &self.flights)?;
        let kept = self.out.as_ref().zip(names.last()).map(|(folder, name)| folder.join(name));
        let mut paths = reads
            .flights("--held-out", &self.held_out)?
            .flights("--baseline", &self.baseline)?
            .writes_json(self.json.as_ref(), kept.as_ref());
        if let Some(folder) = &self.out {
            paths = paths.writes_into(folder, names);
        }
        paths.check()
    }

    fn read(&self) -> Result<(VehicleFile, Flights, Flights), String> {
        let vehicle = VehicleFile::find(&self.vehicle).map_err(|e| e.to_string())?;
        Ok((vehicle, logs(&self.flights)?, logs(&self.held_out)?))
    }

    fn diagnose(&self) -> Result<Workflow, String> {
        let (vehicle, flights, held_out) = self.read()?;
        let own = fitted(&vehicle, &self.baseline)?;
        Self::diagnosed(vehicle, own.as_ref(), flights, held_out)
    }

    fn diagnosed(
        vehicle: VehicleFile,
        own: Option<&Baseline>,
        flights: Flights,
        held_out: Flights,
    ) -> Result<Workflow, String> {
        telling(|tell| match own {
            Some(own) => Workflow::diagnose_since(own, flights, held_out, tell),
            None => Workflow::diagnose(vehicle, &[], flights, held_out, tell),
        })
    }

    fn find(&self) -> Result<(), String> {
        self.check(&[FIND.as_ref()])?;
        let (declared, flights, held_out) = self.read()?;
        let all = [flights, held_out].concat();
        let own = fitted(&declared, &self.baseline)?;
        let vehicle = own.as_ref().map_or(&declared, |own| &own.vehicle);
        let finding = squirrel_gap::find(vehicle, &all).map_err(|e| e.to_string())?;
        let triple = |x: &[f64; 3]| x.map(|v| format!("{v:.4e}")).join("  ");
        say(&format!(
            "residual force, body x y z:   {}  N rms",
            triple(&finding.residual.force_body_rms_n)
        ));
        say(&format!(
            "residual moment, body x y z:  {}  N m rms\n",
            triple(&finding.residual.moment_body_rms_n_m)
        ));
        places(&finding.places);
        notes(&finding.notes);
        if let Some(folder) = &self.out {
            output::folder(folder)?;
            output::write_json(Some(&folder.join(FIND)), &finding)?;
        }
        output::write_json(self.json.as_deref(), &finding)
    }

    fn name(&self) -> Result<(), String> {
        self.check(&[VERDICT.as_ref()])?;
        let found = self.diagnose()?;
        show(&found.diagnosis.verdict);
        self.write(&found.diagnosis.verdict)
    }

    fn shrink(&self) -> Result<(), String> {
        if self.held_out.is_empty() {
            return Err(
                "--held-out: none given; shrink needs flights that the fit never sees".to_owned()
            );
        }
        self.check(&[REPORT.as_ref(), VERDICT.as_ref()])?;
        let mut found = self.diagnose()?;
        let patched = found.patched(false)?.ok();
        if let Some(patched) = &patched {
            fly_again(&mut found, patched)?;
        }
        show(&found.diagnosis.verdict);
        self.report(&found, patched.as_ref())?;
        self.write(&found.diagnosis.verdict)
    }

    fn add(&self, effect: Option<&str>, fit: bool, dry_run: bool) -> Result<(), String> {
        let earlier = if dry_run {
            self.check(&[])?;
            None
        } else {
            self.patch_path()?;
            self.check(&[&self.patch_name(), VERDICT.as_ref()])?;
            self.earlier_patch()?
        };
        let mut found = self.diagnose()?;
        show(&found.diagnosis.verdict);
        let patched = match effect {
            Some(effect) => Ok(found.with_effect(effect)?),
            None => found.patched(fit)?,
        };
        if dry_run {
            if let Ok(patched) = &patched {
                say(&squirrel_gap::difference(&found.vehicle().text, &patched.text));
            }
            output::write_json(self.json.as_deref(), &found.diagnosis.verdict)?;
        } else {
            match &patched {
                Ok(patched) => self.patch(&patched.text, &mut found.diagnosis.verdict)?,
                Err(_) => remove(earlier)?,
            }
            self.write(&found.diagnosis.verdict)?;
        }
        patched.map(drop)
    }

    fn everything(&self, fit: bool) -> Result<(), String> {
        self.patch_path()?;
        self.check(&[&self.patch_name(), REPORT.as_ref(), VERDICT.as_ref()])?;
        let earlier = self.earlier_patch()?;
        let (vehicle, flights, held_out) = self.read()?;
        // Whatever it finds, the verdict is what it would be without.
        let own = fitted(&vehicle, &self.baseline)?;
        let check = looked(&vehicle, own.as_ref(), &flights, &held_out).ok();
        let mut found = Self::diagnosed(vehicle, own.as_ref(), flights, held_out)?;
        if let Some(check) = &check {
            talk(&check.words);
        }
        found.check = check;
        let patched = found.patched(fit)?;
        if let Ok(patched) = &patched {
            fly_again(&mut found, patched)?;
        }
        show(&found.diagnosis.verdict);
        match &patched {
            Ok(patched) => self.patch(&patched.text, &mut found.diagnosis.verdict)?,
            Err(why) => {
                say(why);
                remove(earlier)?;
            }
        }
        self.report(&found, patched.as_ref().ok())?;
        self.write(&found.diagnosis.verdict)
    }

    /// Writes the report, if there is a folder for it.
    fn report(&self, found: &Workflow, patched: Option<&Patched>) -> Result<(), String> {
        let Some(folder) = &self.out else { return Ok(()) };
        output::folder(folder)?;
        let path = folder.join(REPORT);
        output::write_file(&path, found.report(patched).as_bytes())?;
        say(&format!("report: {}", path.display()));
        Ok(())
    }

    /// Where the patched vehicle file goes; asked for before the work, which it would be a pity to
    /// lose.
    fn patch_path(&self) -> Result<PathBuf, String> {
        let folder = self
            .out
            .as_deref()
            .ok_or("--out: none given; a folder is needed for what is written")?;
        Ok(folder.join(self.patch_name()))
    }

    fn patch_name(&self) -> OsString {
        let mut name = self.vehicle.file_name().unwrap_or_default().to_owned();
        if VehicleFile::is_bundled(&self.vehicle) {
            name.push(".toml");
        }
        name
    }

    /// The patched vehicle file of an earlier run, which goes where this one patches nothing: it
    /// would be taken for a part of the new answer.
    ///
    /// # Errors
    /// There is a file that no run has made.
    fn earlier_patch(&self) -> Result<Option<PathBuf>, String> {
        let path = self.patch_path()?;
        if !path.is_file() {
            return Ok(None);
        }
        let text = files::read_text(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        // Whatever is patched names the flights that its number is from.
        if ["source = \"gap", "source = 'gap"].iter().any(|mark| text.contains(mark)) {
            return Ok(Some(path));
        }
        Err(format!(
            "--out: {}: is there, and not of an earlier run; the patched vehicle goes there, give another folder",
            path.display()
        ))
    }

    /// Writes the patched vehicle file.
    fn patch(&self, text: &str, verdict: &mut Verdict) -> Result<(), String> {
        let path = self.patch_path()?;
        if let Some(folder) = &self.out {
            output::folder(folder)?;
        }
        output::write_file(&path, text.as_bytes())?;
        verdict.model_patch = Some(path.display().to_string());
        let names: Vec<&str> = verdict.effects.iter().map(|effect| effect.name).collect();
        let what = if squirrel_gap::nothing_to_add(verdict).is_none() {
            format!("vehicle with {}", names.join(" and "))
        } else {
            "vehicle with its numbers as these flights have them".to_owned()
        };
        say(&format!("{what}: {}", path.display()));
        Ok(())
    }

    fn write(&self, verdict: &Verdict) -> Result<(), String> {
        if let Some(folder) = &self.out {
            output::folder(folder)?;
            output::write_json(Some(&folder.join(VERDICT)), verdict)?;
        }
        output::write_json(self.json.as_deref(), verdict)
    }
}

/// Removes what an earlier run has left.
fn remove(earlier: Option<PathBuf>) -> Result<(), String> {
    let Some(path) = earlier else { return Ok(()) };
    std::fs::remove_file(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    talk(&format!("removed {}: of an earlier run", path.display()));
    Ok(())
}

/// Flies held-out flights again with the effects added.
fn fly_again(found: &mut Workflow, patched: &Patched) -> Result<(), String> {
    let bar = output::spinner();
    bar.set_message("flying in closed loop");
    let flown = found.fly_again(patched);
    bar.finish_and_clear();
    flown.map_err(|e| e.to_string())
}

/// Logs by path; a folder stands for the logs in it.
fn logs(paths: &[PathBuf]) -> Result<Flights, String> {
    log_files(paths)?
        .iter()
        .map(|path| {
            let log = FlightLog::read_where(path, |source| squirrel_gap::SOURCES.contains(&source));
            Ok((path.display().to_string(), log.map_err(|e| e.to_string())?))
        })
        .collect()
}

fn places(places: &[squirrel_gap::find::Place]) {
    let mut table =
        Table::new(&["flight", "from s", "to s", "channel", "x noise", "share %", "condition"]);
    for w in places.iter().take(10) {
        table.row(vec![
            w.flight.clone(),
            format!("{:.2}", w.t0_s),
            format!("{:.2}", w.t1_s),
            w.channel.to_owned(),
            format!("{:.1}", w.noise),
            format!("{:.1}", 100.0 * w.share),
            w.condition.clone(),
        ]);
    }
    table.print();
}

fn notes(notes: &[String]) {
    for note in notes {
        talk(&format!("note: {note}"));
    }
}

fn show(verdict: &Verdict) {
    say(&format!("{}\n", verdict.words));
    if !verdict.effects.is_empty() {
        effects(&verdict.effects);
    }
    if !verdict.moved.is_empty() {
        moved(&verdict.moved, verdict.effects.is_empty());
    }
    if let Some(since) = &verdict.baseline {
        rotors(&since.rotors);
    }
    if !verdict.alternatives.is_empty() {
        let mut table = Table::new(&["other explanation", "nats"]);
        for other in &verdict.alternatives {
            table.row(vec![other.effects.join(" + "), format!("{:.1}", other.evidence_nats)]);
        }
        table.print();
        say("");
    }
    places(&verdict.places);
    if !verdict.closed_loop.is_empty() {
        say("");
        closed_loop(&verdict.closed_loop);
    }
    if verdict.verdict == Kind::NotIdentifiable
        && let Some(card) = pilot_card("excite_rich")
    {
        say(&format!("\nwhat to fly:\n{card}"));
    }
    notes(&verdict.notes);
}

/// How each rotor is against the good flights.
fn rotors(all: &[RotorHealth]) {
    let mut table = Table::new(&["rotor", "thrust lost %", "low", "high", "usual sd %"]);
    for health in all {
        let Value::Number { value, low, high } = health.thrust_loss_fraction else { continue };
        let mut row = vec![health.rotor.to_string()];
        row.extend([value, low, high, health.usual].map(|x| format!("{:.1}", 100.0 * x)));
        table.row(row);
    }
    if !all.is_empty() {
        table.print();
        say("");
    }
}

/// What moved with the effects: their numbers hold with these. Or what moved without any.
fn moved(all: &[Moved], alone: bool) {
    let what = if alone { "moved beyond its tolerance" } else { "moved with them" };
    let mut table = Table::new(&[what, "value", "sd", "tolerance"]);
    for number in all {
        let mut row = vec![number.name.clone()];
        row.extend([number.value, number.sd, number.tolerance].map(|x| significant(x, 3)));
        table.row(row);
    }
    table.print();
    say("");
}

/// Root mean square of simulated less measured position.
fn closed_loop(flights: &[ClosedLoop]) {
    let head = ["flown again", "model", "north m", "east m", "down m"];
    let mut table = Table::new(&head);
    for flight in flights {
        for (model, error) in
            [("nominal", flight.before_ned_m), ("with the effects", flight.after_ned_m)]
        {
            let mut row = vec![flight.flight.clone(), model.to_owned()];
            row.extend(error.map(|x| significant(x, 3)));
            table.row(row);
        }
    }
    table.print();
}

fn effects(effects: &[NamedEffect]) {
    let mut table = Table::new(&["effect", "form", "nats", "parameter", "value", "low", "high"]);
    for effect in effects {
        for (key, value) in &effect.parameters {
            let numbers = match value {
                Value::Choice { value, .. } => {
                    [(*value).to_owned(), "-".to_owned(), "-".to_owned()]
                }
                Value::Number { value, low, high } => {
                    [value, low, high].map(|x| significant(*x, 4))
                }
            };
            let mut row = vec![
                effect.name.to_owned(),
                effect.form.to_owned(),
                format!("{:.1}", effect.evidence_nats),
                (*key).to_owned(),
            ];
            row.extend(numbers);
            table.row(row);
        }
    }
    table.print();
    say("");
}
