//! Commands that print what is generated from the descriptions of scenes and options: `bansho schema`, `completions` and `man`.

use std::path::Path;

use bansho::{
    KINDS,
    media::files::{atomic, overwrite_policy::OverwritePolicy, provenance::MANUAL_LINE},
    scene::schema::schema,
};
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
    let mut command = Cli::command().disable_help_subcommand(true);
    command.build();
    write_pages(command, folder)
}

/// Writes the manual pages of a command and of all commands in it.
fn write_pages(command: clap::Command, folder: &Path) -> anyhow::Result<()> {
    for inner in command.get_subcommands().filter(|inner| !inner.is_hide_set()).cloned() {
        write_pages(inner, folder)?;
    }
    let page = clap_mangen::Man::new(command);
    let mut text = MANUAL_LINE.as_bytes().to_vec();
    page.render(&mut text)?;
    Ok(atomic::write_bytes(&folder.join(page.get_filename()), &text, &OverwritePolicy::default())?)
}
