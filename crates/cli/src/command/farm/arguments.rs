//! The options of `bansho render` among the arguments of another command, as text that tasks repeat.

use std::{ffi::OsString, iter};

use bansho::job::Job;
use bansho_farm::FarmError;
use clap::{ArgMatches, Args, CommandFactory, Parser, parser::ValueSource};

use crate::{
    args::{Cli, Command, RenderArgs},
    exit::UsageError,
};

/// Options that the plan decides about, or that concern only this process.
const LEFT_OUT: [&str; 10] = [
    "contact_sheet",
    "frames",
    "resume",
    "snapshots",
    "snapshot_every",
    "threads",
    "progress",
    "stats",
    "vector_level",
    "contact_background",
];

/// The options of `bansho render` in the `arguments` of this program, whose command is `path`, such as `farm slurm`.
///
/// # Errors
/// An argument is not Unicode.
pub(super) fn of_render(arguments: impl IntoIterator<Item = OsString>, path: &[&str]) -> anyhow::Result<Vec<String>> {
    let matches = Cli::command().try_get_matches_from(arguments)?;
    let mut command = &matches;
    for name in path {
        command = command.subcommand_matches(name).ok_or_else(|| UsageError(format!("the command is not `{name}`")))?;
    }
    let render = RenderArgs::augment_args(clap::Command::new("render"));
    let (mut options, mut positional) = (Vec::new(), Vec::new());
    for argument in render.get_arguments() {
        let id = argument.get_id().as_str();
        if LEFT_OUT.contains(&id) || command.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        match argument.get_long() {
            None => positional.extend(values(command, id)?),
            Some(long) if argument.get_action().takes_values() => {
                options.extend(values(command, id)?.into_iter().map(|value| format!("--{long}={value}")));
            }
            Some(long) => options.push(format!("--{long}")),
        }
    }
    Ok(options.into_iter().chain(iter::once("--".to_owned())).chain(positional).collect())
}

/// The values of one argument, as they were given.
fn values(matches: &ArgMatches, id: &str) -> Result<Vec<String>, FarmError> {
    let mut values = Vec::new();
    for value in matches.get_raw(id).into_iter().flatten() {
        let text = value.to_str();
        let text = text.ok_or_else(|| FarmError::ControlCharacters { path: value.to_string_lossy().into_owned() })?;
        values.push(text.to_owned());
    }
    Ok(values)
}

/// The job of `bansho render` with `arguments`.
///
/// # Errors
/// The arguments are not those of this version, or the scene cannot be read.
pub(super) fn render_job(arguments: &[String]) -> anyhow::Result<Job> {
    let line = ["bansho", "render"].into_iter().chain(arguments.iter().map(String::as_str));
    match Cli::try_parse_from(line).map(|cli| cli.command) {
        Ok(Command::Render(render)) => Ok(render.job()?),
        Ok(_) => Err(UsageError("these are not options of `bansho render`".to_owned()).into()),
        Err(error) => {
            // Only what is wrong: the usage that follows is of another command.
            let text = error.to_string();
            let line = text.lines().next().unwrap_or_default();
            let message = line.strip_prefix("error: ").unwrap_or(line);
            Err(UsageError(format!("options of `bansho render`: {message}")).into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn render_options(line: &str) -> Vec<String> {
        let words = ["bansho", "farm", "slurm"].into_iter().chain(line.split(' '));
        of_render(words.map(OsString::from), &["farm", "slurm"]).unwrap()
    }

    #[test]
    fn options_of_rendering_are_repeated_as_they_were_given() {
        let line = "a.toml -o x/a.####.exr --size 8x8 --set a.b=1 --set c=2 --seed -0 --layers --frames 1-5 --threads 3 --chunk 7 --submit";
        let line = line.replace("--seed -0", "--seed 5");
        let expected =
            ["--out=x/a.####.exr", "--layers", "--size=8x8", "--seed=5", "--set=a.b=1", "--set=c=2", "--", "a.toml"];
        let mut found = render_options(&line);
        let mut sorted = expected.map(str::to_owned).to_vec();
        assert_eq!(found.split_off(found.len() - 2), sorted.split_off(6));
        found.sort();
        sorted.sort();
        assert_eq!(found, sorted);
    }

    #[test]
    fn what_is_not_given_is_not_repeated() {
        assert_eq!(render_options("a.toml"), ["--", "a.toml"]);
    }
}
