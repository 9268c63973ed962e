//! Commands that print what is generated from the descriptions of scenes and options: `bansho schema`, `completions` and `man`.

use std::fs;

use anyhow::Context;
use bansho::{KINDS, scene::schema::schema};
use clap::CommandFactory;

use crate::{
    args::{Cli, CompletionsArgs, ManArgs},
    output::print,
};

/// Prints the JSON schema of scene files.
pub(crate) fn run_schema() -> anyhow::Result<()> {
    Ok(print(&format!("{:#}\n", schema(KINDS)))?)
}

/// Prints a completion script.
pub(crate) fn run_completions(args: &CompletionsArgs) -> anyhow::Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "bansho", &mut script);
    Ok(print(&String::from_utf8_lossy(&script))?)
}

/// Prints the main manual page, or writes one for each command.
pub(crate) fn run_man(args: &ManArgs) -> anyhow::Result<()> {
    let Some(folder) = &args.dir else {
        let mut page = Vec::new();
        clap_mangen::Man::new(Cli::command()).render(&mut page)?;
        return Ok(print(&String::from_utf8_lossy(&page))?);
    };
    let written = fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(Cli::command(), folder));
    written.with_context(|| format!("{}: the manual pages cannot be written", folder.display()))
}
