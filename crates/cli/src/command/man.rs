//! `bansho man`

use std::fs;

use anyhow::Context;
use clap::CommandFactory;

use crate::{
    args::{Cli, ManArgs},
    output::to_stdout,
};

/// Prints the main manual page, or writes one for each command.
pub(crate) fn run(args: &ManArgs) -> anyhow::Result<()> {
    let Some(folder) = &args.dir else {
        let mut page = Vec::new();
        clap_mangen::Man::new(Cli::command()).render(&mut page)?;
        return Ok(to_stdout(&String::from_utf8_lossy(&page))?);
    };
    let written = fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(Cli::command(), folder));
    written.with_context(|| format!("{}: the manual pages cannot be written", folder.display()))
}
