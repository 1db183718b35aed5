//! The command line of squirrel.
//!
//! Results go to stdout, talk and progress bars to stderr, and to `--json FILE` for machines. Exit
//! codes: 0 done, 1 failed with one line that names file, field and value, 2 wrong usage.
//!
//! ```
//! let arguments = ["squirrel", "help", "fly"];
//! assert_eq!(squirrel_cli::run(arguments.map(Into::into)), 0);
//! assert_eq!(squirrel_cli::run(["squirrel", "fli"].map(Into::into)), 2);
//! ```

mod commands;
mod output;
mod paths;

use clap::{CommandFactory, Parser, Subcommand};
use std::ffi::OsString;

/// A flight stack for multirotors that change shape: flies, studies, trains, plans, and says what a
/// vehicle model lacks.
#[derive(Debug, Parser)]
#[command(
    name = "squirrel",
    version,
    disable_help_subcommand = true,
    args_conflicts_with_subcommands = true
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten, next_help_heading = "Options of the demo, without a command")]
    demo: commands::demo::Demo,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fly the paper's avoidance manoeuvre in front of a solid trunk, with its controllers and ours
    /// (the default).
    Demo(commands::demo::Demo),
    /// Fly one scenario with one controller and log it.
    Fly(commands::fly::Fly),
    /// Run an experiment with many flights.
    #[command(subcommand)]
    Study(commands::study::Studies),
    /// Train a model of the wing force on flight logs.
    Train(commands::train::Train),
    /// Show one flight, or two beside each other, as a 3-D scene on one page.
    View(commands::view::View),
    /// Run a log's inputs through the flight code again and compare every bit.
    Replay(commands::replay::Replay),
    /// Write the sensor frames of flights, and the hash of every output, for a target without
    /// files.
    ExportVectors(commands::export_vectors::ExportVectors),
    /// Turn a foreign log into a flight log, or recover a truncated one.
    Import(commands::import::Import),
    /// Find where simulation and measurement disagree.
    #[command(subcommand)]
    Gap(commands::gap::Gap),
    /// Plan a trajectory through a scenario, with wings and without.
    Plan(commands::plan::PlanCommand),
    /// What spread wings add to the accelerations that a vehicle can reach.
    Reach(commands::reach::Reach),
    /// Make, check, fit, compare and export vehicle files.
    #[command(subcommand)]
    Vehicle(commands::vehicle::VehicleCommand),
    /// Say what a command does; without one, what there is.
    Help(commands::help::Help),
}

/// Runs the program on arguments, the first of which is its name, and says its exit code: Python's
/// front end needs the number.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let program = arguments.first().map_or("squirrel".into(), |name| name.to_string_lossy());
    let program = commands::demo::quoted(&program);
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(usage) => {
            // Help and version are results; anything else is wrong usage, exit code 2.
            let code = usage.exit_code();
            output::note(usage.print());
            return match output::said() {
                Ok(()) => u8::try_from(code).unwrap_or(2),
                Err(problem) => {
                    output::error(&problem);
                    1
                }
            };
        }
    };
    let done = match cli.command.unwrap_or(Command::Demo(cli.demo)) {
        Command::Demo(demo) => demo.run(&program),
        Command::Fly(fly) => fly.run(),
        Command::Study(study) => study.run(),
        Command::Train(train) => train.run(),
        Command::View(view) => view.run(),
        Command::Replay(replay) => replay.run(),
        Command::ExportVectors(export) => export.run(),
        Command::Import(import) => import.run(),
        Command::Gap(gap) => gap.run(),
        Command::Plan(plan) => plan.run(),
        Command::Reach(reach) => reach.run(),
        Command::Vehicle(mut vehicle) => match vehicle.lacks() {
            Some(usage) => {
                output::error(&usage);
                return 2;
            }
            None => vehicle.run(),
        },
        Command::Help(help) => match help.run(Cli::command()) {
            Ok(text) => {
                output::say(text.trim_end());
                Ok(())
            }
            Err(usage) => {
                output::error(&usage);
                return 2;
            }
        },
    };
    // What was not seen was not done, whatever else went wrong.
    match done.and(output::said()) {
        Ok(()) => 0,
        Err(problem) => {
            output::error(&problem);
            1
        }
    }
}
