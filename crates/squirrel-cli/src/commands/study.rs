//! `squirrel study`: experiments with many flights. What they are is in `squirrel_study::STUDIES`;
//! here they get their options.

mod merge;

use super::{COMMIT, vehicle};
use crate::output::{self, Table, say, talk};
use crate::paths::Paths;
use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Args as _, Command, FromArgMatches, value_parser};
use indicatif::ProgressBar;
use squirrel_log::files::Lock;
use squirrel_sim::arm::Arm;
use squirrel_sim::scenario::Conditions;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::STUDIES;
use squirrel_study::campaign::Plan;
use squirrel_study::journal::{Keep, Part, Progress, Shard, check_trials, locked};
use squirrel_study::study::{Arms, Found, Shown, Study, Timed, Work};
use squirrel_study::until::Until;
use std::path::PathBuf;
use std::time::Instant;

/// An experiment that is asked for, or a merge of parts of one.
#[derive(Debug)]
pub(crate) enum Studies {
    Fly(Flown),
    Merge(merge::Options),
}

/// An experiment and its options.
#[derive(Debug)]
pub(crate) struct Flown {
    study: &'static Study,
    trials: u32,
    /// Its own options.
    own: ArgMatches,
    common: Common,
    /// Fly nothing: all trials are there.
    merged: bool,
}

/// Shows people how far a study is.
#[derive(Debug)]
struct Bar(ProgressBar);

impl Progress for Bar {
    fn ahead(&self, steps: u64) {
        self.0.inc_length(steps);
    }

    fn done(&self, steps: u64) {
        self.0.inc(steps);
    }
}

/// What every experiment is told.
#[derive(Debug, clap::Args)]
struct Common {
    /// Seed of all trials.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Vehicle file, or the name of a bundled vehicle; squirrel if left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// Folder for the figures as CSV and JSON, and for what else there is to look at; it keeps the
    /// trials, so that a study that was stopped goes on.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write the figures here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Fly a part of the trials only, K/N, into an --out of its own; `squirrel study merge` puts
    /// the parts together.
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Stop as soon as every 95 % interval reaches at most so far to either side, in percent of the
    /// figure and with the sign, as 5%, or in points where that is below 1; --trials is the most.
    /// Looks after 16 trials, 32 and so on, and leaves the bytes of a study of that many. Needs
    /// --out.
    #[arg(long, value_name = "PERCENT")]
    until: Option<Until>,
}

const MERGE: &str = "merge";

impl clap::Subcommand for Studies {
    fn augment_subcommands(command: Command) -> Command {
        let merge = merge::Options::augment_args(Command::new(MERGE))
            .about("Put the parts of a study together that were flown with --shard");
        let mut all: Vec<Command> = STUDIES.iter().map(options).chain([merge]).collect();
        all.sort_by(|a, b| a.get_name().cmp(b.get_name()));
        command.subcommands(all)
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        name == MERGE || STUDIES.iter().any(|study| study.name == name)
    }
}

/// A study as a command.
fn options(study: &'static Study) -> Command {
    let value = |name: &'static str| {
        Arg::new(name).long(name).value_name(name.replace('-', "_").to_uppercase())
    };
    let (trials, what) = study.trials;
    let trials = value("trials").help(what).default_value(trials.to_string());
    let mut command = Command::new(study.name).arg(trials.value_parser(value_parser!(u32)));
    for choice in study.options {
        let option = value(choice.name).help(choice.help).default_value(choice.default.to_string());
        command = command.arg(if choice.whole {
            option.value_parser(value_parser!(usize))
        } else {
            option.value_parser(value_parser!(f64))
        });
    }
    if let Arms::Asked(arms) = study.arms {
        let left_out = if arms == Arm::ALONE { "all".to_owned() } else { names(arms).join(", ") };
        let help = format!(
            "Arms to fly beside the reference, separated by commas; {left_out} if left out"
        );
        command = command.arg(value("arms").help(help).value_delimiter(','));
    }
    if study.days {
        let names = Conditions::ALL.map(Conditions::name);
        let help = "What the day brings: nothing (calm), or wind with turbulence, battery sag and \
                    late fixes (outdoors)";
        command =
            command.arg(value("conditions").help(help).default_value(names[0]).value_parser(names));
    }
    // The arguments bring an `about` of their own.
    Common::augment_args(command).about(study.about)
}

fn names(arms: &[Arm]) -> Vec<&'static str> {
    arms.iter().map(|arm| arm.name()).collect()
}

impl FromArgMatches for Studies {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let Some((name, matches)) = matches.subcommand() else {
            return Err(clap::Error::new(ErrorKind::MissingSubcommand));
        };
        let Some(study) = STUDIES.iter().find(|study| study.name == name) else {
            return merge::Options::from_arg_matches(matches).map(Self::Merge);
        };
        Ok(Self::Fly(Flown {
            study,
            trials: matches.get_one("trials").copied().unwrap_or(study.trials.0),
            own: matches.clone(),
            common: Common::from_arg_matches(matches)?,
            merged: false,
        }))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Studies {
    pub(crate) fn run(&self) -> Result<(), String> {
        match self {
            Self::Fly(flown) => flown.run(None),
            Self::Merge(merge) => merge.run(),
        }
    }
}

impl Flown {
    /// * `lock` - of a merge that has locked the folder
    fn run(&self, lock: Option<&Lock>) -> Result<(), String> {
        let mut plan = self.plan()?;
        let own = self.study.options.iter().map(|choice| {
            let value = || self.own.get_one::<f64>(choice.name).copied();
            let count = || self.own.get_one(choice.name).map(|n: &usize| *n as f64);
            if choice.whole { count() } else { value() }.unwrap_or(choice.default)
        });
        let own: Vec<f64> = own.collect();
        let part = match self.common.shard {
            _ if self.merged => Part::Merged,
            Some(shard) => Part::Shard(shard),
            None => Part::All,
        };
        let bar = Bar(output::progress(0, self.study.unit));
        let folder = self.common.out.as_deref();
        // Until its figures are written, too; a merge has it already.
        let own_lock = match folder.filter(|_| !self.merged) {
            Some(folder) => Some(locked(folder).map_err(|e| e.to_string())?),
            None => None,
        };
        let lock = own_lock.as_ref().or(lock);
        let rounds: Vec<u32> = match self.common.until {
            Some(_) => Until::rounds(self.trials).collect(),
            None => vec![self.trials],
        };
        let mut found = Ok(None);
        for trials in rounds {
            plan.trials = trials;
            let command = self.command(&plan, &own);
            let keep = Keep {
                folder,
                part,
                command: &command,
                commit: COMMIT,
                progress: Some(&bar),
                lock,
            };
            found = (self.study.fly)(&plan, &own, &keep);
            let (Some(until), Ok(Some(now))) = (self.common.until, &found) else { break };
            let (is_met, widest) = until.is_met(&now.json).map_err(|e| e.to_string())?;
            let percent = 100.0 * widest;
            talk(&format!("{trials} trials: the widest interval reaches {percent:.1} %"));
            if is_met {
                break;
            }
        }
        bar.0.finish_and_clear();
        if let Some(found) = found.map_err(|e| e.to_string())? {
            return self.end(&found);
        }
        if let (Some(shard), Some(folder)) = (self.common.shard, &self.common.out) {
            talk(&format!(
                "part {shard} is in {}; `squirrel study merge` puts the parts together",
                folder.display()
            ));
        }
        Ok(())
    }

    /// What is asked of the study.
    fn plan(&self) -> Result<Plan, String> {
        let asked = self.own.try_get_many::<String>("arms").ok().flatten().unwrap_or_default();
        let arms: Vec<Arm> = asked.map(|name| Arm::parse(name)).collect::<Result<_, _>>()?;
        let vehicle = self.begin()?;
        let arms = match self.study.arms {
            Arms::Asked(all) if arms.is_empty() => {
                let (known, missing): (Vec<Arm>, Vec<Arm>) =
                    all.iter().partition(|arm| arm.is_known_to(&vehicle));
                if !missing.is_empty() {
                    let missing = names(&missing).join(", ");
                    talk(&format!(
                        "{} does not have what they need: {missing} left out",
                        vehicle.name
                    ));
                }
                known
            }
            Arms::Asked(_) => arms,
            Arms::Fixed(arms) => arms.to_vec(),
        };
        let conditions = match self.own.try_get_one::<String>("conditions") {
            Ok(Some(name)) => Conditions::parse(name)?,
            _ => Conditions::Calm,
        };
        let (trials, seed) = (self.trials, self.common.seed);
        Ok(Plan { vehicle, arms, trials, seed, conditions })
    }

    /// The vehicle, once it is known that results can be written: nobody wants to learn that
    /// afterwards.
    fn begin(&self) -> Result<VehicleFile, String> {
        let (Common { vehicle: file, out, json, shard, .. }, name) =
            (&self.common, self.study.name);
        if shard.is_some() && json.is_some() {
            return Err(
                "--json: a part of a study has no figures; merge the parts first".to_owned()
            );
        }
        if self.common.until.is_some() && (shard.is_some() || out.is_none()) {
            return Err(if shard.is_some() {
                "--until: a part of a study has no intervals; it goes without --shard".to_owned()
            } else {
                "--until: needs a folder that keeps what was flown; give --out".to_owned()
            });
        }
        check_trials(self.trials).map_err(|e| e.to_string())?;
        let kept = out.as_ref().map(|folder| folder.join(format!("{name}.json")));
        let paths = Paths::default().vehicle("--vehicle", file);
        let mut paths = paths.writes_json(json.as_ref(), kept.as_ref());
        if let Some(folder) = out {
            let names =
                ["csv", "json", "html", "trials.jsonl"].map(|kind| format!("{name}.{kind}"));
            paths = paths
                .writes_into(folder, names.into_iter().chain((self.study.others)(self.trials)));
        }
        paths.check()?;
        let vehicle = vehicle(file.as_deref())?;
        if let Some(folder) = out {
            output::folder(folder)?;
        }
        Ok(vehicle)
    }

    /// The arguments that describe a study, without those that say where it is flown.
    fn command(&self, plan: &Plan, own: &[f64]) -> Vec<String> {
        let mut words = vec![
            self.study.name.to_owned(),
            format!("--seed={}", plan.seed),
            format!("--trials={}", plan.trials),
        ];
        if let Arms::Asked(_) = self.study.arms {
            words.push(format!("--arms={}", names(&plan.arms).join(",")));
        }
        if plan.conditions != Conditions::Calm {
            words.push(format!("--conditions={}", plan.conditions.name()));
        }
        let own = self.study.options.iter().zip(own);
        words.extend(own.map(|(choice, value)| format!("--{}={value}", choice.name)));
        words
    }

    /// Shows and writes what was found.
    fn end(&self, found: &Found) -> Result<(), String> {
        for shown in &found.shown {
            match shown {
                Shown::Line(line) => say(line),
                Shown::Table(rows) => Table::of(rows.clone()).print(),
            }
        }
        found.timed.as_ref().map(time);
        let name = self.study.name;
        if let Some(folder) = &self.common.out {
            let kept = |file: &str, text: &str| {
                let path = folder.join(file);
                output::folder(path.parent().unwrap_or(folder))?;
                output::write_file(&path, text.as_bytes())?;
                Ok::<PathBuf, String>(path)
            };
            let csv = kept(&format!("{name}.csv"), &found.csv)?;
            kept(&format!("{name}.json"), &found.json)?;
            talk(&format!("wrote {}", csv.display()));
            for (file, text) in &found.others {
                kept(file, text)?;
            }
            if let Some(page) = &found.page {
                talk(&format!("wrote {}", kept(&format!("{name}.html"), page)?.display()));
            }
        }
        self.common
            .json
            .as_ref()
            .map_or(Ok(()), |path| output::write_file(path, found.json.as_bytes()))
    }
}

/// How long work takes on one core of this machine, ms.
#[allow(clippy::disallowed_methods, reason = "how long it takes is the question")]
fn time(timed: &Timed) {
    say(&format!("\n{}\n", timed.words));
    let mut table = Table::new(&[&timed.columns[..], &["median", "p90", "longest"]].concat());
    for (place, work) in &timed.rows {
        let took = |piece: &Work| {
            let begin = Instant::now();
            piece();
            begin.elapsed().as_secs_f64() * 1e3
        };
        let mut took_ms: Vec<f64> = work.iter().map(took).collect();
        took_ms.sort_by(f64::total_cmp);
        let at = |share: f64| took_ms[((took_ms.len() - 1) as f64 * share).round() as usize];
        let mut cells = place.clone();
        cells.extend([0.5, 0.9, 1.0].map(|share| format!("{:.1}", at(share))));
        table.row(cells);
    }
    table.print();
}
