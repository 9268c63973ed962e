//! `bansho completions`

use clap::CommandFactory;

use crate::{
    args::{Cli, CompletionsArgs},
    output::to_stdout,
};

/// Prints a completion script.
pub(crate) fn run(args: &CompletionsArgs) -> anyhow::Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "bansho", &mut script);
    Ok(to_stdout(&String::from_utf8_lossy(&script))?)
}
