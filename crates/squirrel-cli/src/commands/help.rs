//! `squirrel help`: what `--help` says, of one command or, as Markdown, of all of them.

use clap::{Arg, Command};
use std::fmt::Write as _;

/// Options of the help.
#[derive(Debug, clap::Args)]
pub(crate) struct Help {
    /// The command, as `study thrust`.
    command: Vec<String>,
    /// All commands and options as Markdown, as they stand in the guide.
    #[arg(long, conflicts_with = "command")]
    markdown: bool,
}

impl Help {
    /// The text; wrong usage where there is no such command.
    pub(crate) fn run(&self, mut program: Command) -> Result<String, String> {
        program.build();
        if self.markdown {
            return Ok(markdown(&program));
        }
        let mut command = &mut program;
        for word in &self.command {
            command = command
                .find_subcommand_mut(word)
                .ok_or_else(|| format!("help: no command `{}`", self.command.join(" ")))?;
        }
        Ok(command.render_long_help().to_string())
    }
}

/// All of a built program.
fn markdown(program: &Command) -> String {
    let mut text = format!(
        "# Commands\n\n\
         Every command of squirrel {} with all of its options. This page is what `squirrel help --markdown` prints: the words are those of\n\
         `--help`, which each command has. Results go to stdout and to `--json FILE`, talk and progress to stderr. Exit code 0 is done, 1 is\n\
         failed with one line that names file, field and value, 2 is wrong usage.\n",
        program.get_version().unwrap_or_default()
    );
    section(program, 2, &mut text);
    text
}

/// A command, then those below it.
fn section(command: &Command, level: usize, text: &mut String) {
    let name = command.get_bin_name().unwrap_or(command.get_name());
    let usage = command.clone().render_usage().to_string();
    let usage = usage.strip_prefix("Usage: ").unwrap_or(&usage);
    let usage: Vec<&str> = usage.lines().map(str::trim).collect();
    let about = command.get_long_about().or(command.get_about());
    let about = about.map(ToString::to_string).unwrap_or_default();
    let _ = write!(
        text,
        "\n{} {name}\n\n{}\n\n```text\n{}\n```\n",
        "#".repeat(level),
        prose(&about),
        usage.join("\n")
    );
    let subcommands: Vec<&Command> =
        command.get_subcommands().filter(|command| !command.is_hide_set()).collect();
    if !subcommands.is_empty() {
        text.push_str("\n| command | does |\n|---|---|\n");
        for below in &subcommands {
            let about = below.get_about().map(ToString::to_string).unwrap_or_default();
            let name = below.get_bin_name().unwrap_or(below.get_name());
            let link = name.replace(' ', "-");
            let _ = writeln!(text, "| [`{}`](#{link}) | {} |", below.get_name(), cell(&about));
        }
    }
    for (heading, arguments) in headed(command) {
        let _ = write!(text, "\n| {} | meaning |\n|---|---|\n", heading.to_lowercase());
        for argument in arguments {
            let _ = writeln!(
                text,
                "| `{}` | {} |",
                called(argument).replace('|', "\\|"),
                cell(&meaning(argument))
            );
        }
    }
    for below in subcommands {
        section(below, (level + 1).min(4), text);
    }
}

/// Arguments under the headings of `--help`, in its order; what every command has is left out.
fn headed(command: &Command) -> Vec<(String, Vec<&Arg>)> {
    let mut groups: Vec<(String, Vec<&Arg>)> = Vec::new();
    let shown =
        |arg: &&Arg| !arg.is_hide_set() && !["help", "version"].contains(&arg.get_id().as_str());
    let (places, options): (Vec<&Arg>, Vec<&Arg>) =
        command.get_arguments().filter(shown).partition(|arg| arg.is_positional());
    for (default, arguments) in [("Argument", places), ("Option", options)] {
        for argument in arguments {
            let heading = argument.get_help_heading().unwrap_or(default);
            match groups.iter_mut().find(|(name, _)| name == heading) {
                Some((_, group)) => group.push(argument),
                None => groups.push((heading.to_owned(), vec![argument])),
            }
        }
    }
    groups
}

/// `-s, --seed <SEED>`
fn called(argument: &Arg) -> String {
    match (argument.get_short(), argument.is_positional()) {
        (Some(short), false) => format!("-{short}, {argument}"),
        _ => argument.to_string(),
    }
}

/// Its help, its default and what it may be.
fn meaning(argument: &Arg) -> String {
    let help = argument.get_long_help().or(argument.get_help());
    let mut text = help.map(ToString::to_string).unwrap_or_default();
    if argument.get_action().takes_values() {
        let values = argument.get_possible_values();
        let names: Vec<&str> = values
            .iter()
            .filter(|v| !v.is_hide_set())
            .map(clap::builder::PossibleValue::get_name)
            .collect();
        let defaults: Vec<_> =
            argument.get_default_values().iter().map(|v| v.to_string_lossy()).collect();
        let more = !names.is_empty() || !defaults.is_empty() || argument.is_required_set();
        if more && !text.ends_with(['.', '?']) {
            text.push('.');
        }
        if !names.is_empty() {
            let _ = write!(text, " One of {}.", names.join(", "));
        }
        if !defaults.is_empty() {
            let _ = write!(text, " Default: `{}`.", defaults.join(" "));
        }
        if argument.is_required_set() {
            text.push_str(" Required.");
        }
    }
    text
}

/// Text of a table's cell.
fn cell(text: &str) -> String {
    prose(text).replace('\n', " ").replace('|', "\\|")
}

/// Help as Markdown: what Markdown would take for its own outside of code stays as it is.
fn prose(text: &str) -> String {
    let part = |(i, part): (usize, &str)| {
        if i % 2 == 1 { part.to_owned() } else { part.replace('<', "&lt;").replace('*', "\\*") }
    };
    text.split('`').enumerate().map(part).collect::<Vec<_>>().join("`")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Cli;
    use clap::CommandFactory;

    /// Options of a text, as they come.
    fn options(text: &str, begin: &str) -> Vec<String> {
        let lines = text.lines().filter_map(|line| line.trim_start().strip_prefix(begin));
        let lines = lines.filter(|line| line.starts_with('-'));
        let words = lines.filter_map(|line| line.split("--").nth(1));
        let names = words.map(|rest| {
            rest.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '-').collect()
        });
        names.filter(|name| name != "help" && name != "version").collect()
    }

    fn each(command: &Command, look: &mut impl FnMut(&Command)) {
        look(command);
        command.get_subcommands().for_each(|below| each(below, look));
    }

    #[test]
    fn every_command_has_the_options_of_its_help_in_their_order() {
        let mut program = Cli::command();
        program.build();
        let mut count = 0;
        each(&program, &mut |command| {
            let mut text = String::new();
            section(command, 2, &mut text);
            let own = text.split("\n### ").next().unwrap_or_default();
            let own = own.split("\n#### ").next().unwrap_or_default();
            let help = command.clone().render_help().to_string();
            let wanted = options(&help, "");
            assert_eq!(options(own, "| `"), wanted, "{help}\n{own}");
            count += wanted.len();
        });
        assert!(count > 100, "{count} options");
    }

    #[test]
    fn a_command_is_found_by_its_words_and_none_is_wrong_usage() {
        let help = |words: &[&str]| {
            let command = words.iter().map(|&word| word.to_owned()).collect();
            Help { command, markdown: false }.run(Cli::command())
        };
        assert!(help(&["study", "thrust"]).unwrap().contains("Usage: squirrel study thrust"));
        assert!(help(&["study", "trust"]).unwrap_err().contains("study trust"));
    }
}
