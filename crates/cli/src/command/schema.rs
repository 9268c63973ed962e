//! `bansho schema`

use bansho::{KINDS, scene::schema::schema};

use crate::output::to_stdout;

/// Prints the JSON schema of scene files.
pub(crate) fn run() -> anyhow::Result<()> {
    Ok(to_stdout(&format!("{:#}\n", schema(KINDS)))?)
}
