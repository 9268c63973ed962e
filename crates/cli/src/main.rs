//! The program `bansho`: the command line of the library `bansho`.

mod args;
mod command;
mod exit;
mod flags;
mod interrupt;
mod output;
mod plot;
mod progress;
mod stats;

use std::{
    io::{self, Write},
    process::ExitCode,
};

use clap::Parser;

use crate::args::{Cli, Command};

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are not errors, and go to stdout.
            let printed = output::ignore_broken_pipe(error.print().and_then(|()| io::stdout().flush()));
            return match printed {
                Err(failed) if error.exit_code() == 0 => exit::report(&failed.into()),
                // If an error cannot be written to stderr, only the exit code reports it.
                _ => ExitCode::from(error.exit_code().clamp(0, 255) as u8),
            };
        }
    };
    match interrupt::install_handlers().map_err(anyhow::Error::from).and_then(|()| run(&cli.command)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => exit::report(&error),
    }
}

fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::New(args) => command::new::run(args),
        Command::Check(args) => command::check::run(args),
        Command::Schema => command::generated::run_schema(),
        Command::Render(args) => command::render(args),
        Command::Farm(args) => command::farm::run(args),
        Command::Flipbook(args) => command::flipbook(args),
        Command::Streaks(args) => command::streaks(args),
        Command::Simulate(args) => command::simulate(args),
        Command::Calibrate => command::calibrate(),
        Command::Plot(args) => command::plot::run(args),
        Command::Studio(args) => command::studio::run(args),
        Command::Completions(args) => command::generated::run_completions(args),
        Command::Man(args) => command::generated::run_man(args),
    }
}
