//! The program `bansho`: arguments in, pictures and exit codes out. All work is done by the library.

mod args;
mod command;
mod exit;
mod flags;
mod interrupt;
mod output;
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
            // Help and version are no errors, and go to stdout.
            let told = output::heard(error.print().and_then(|()| io::stdout().flush()));
            return match told {
                Err(failed) if error.exit_code() == 0 => exit::report(&failed.into()),
                // An error that cannot be written to stderr is told by the exit code alone.
                _ => ExitCode::from(error.exit_code().clamp(0, 255) as u8),
            };
        }
    };
    match interrupt::listen().map_err(anyhow::Error::from).and_then(|()| run(&cli.command)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => exit::report(&error),
    }
}

fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::New(args) => command::new::run(args),
        Command::Check(args) => command::check::run(args),
        Command::Upgrade(args) => command::upgrade::run(args),
        Command::Schema => command::schema::run(),
        Command::Render(args) => command::render::run(args),
        Command::Flipbook(args) => command::flipbook::run(args),
        Command::Streaks(args) => command::streaks::run(args),
        Command::Simulate(args) => command::simulate::run(args),
        Command::Calibrate => command::calibrate::run(),
        Command::Studio(args) => command::studio::run(args),
        Command::Completions(args) => command::completions::run(args),
        Command::Man(args) => command::man::run(args),
    }
}
