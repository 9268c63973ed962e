//! `bansho upgrade`

use bansho::{
    base::host::printable::printable,
    job::SceneFile,
    media::files::atomic,
    scene::{FORMAT, edit},
};

use crate::{args::UpgradeArgs, output::to_stdout};

/// Rewrites a scene in place, whole or not at all.
pub(crate) fn run(args: &UpgradeArgs) -> anyhow::Result<()> {
    let scene = SceneFile::read(&args.scene)?;
    let upgraded = match edit::upgrade(&scene.text) {
        Ok(upgraded) => upgraded,
        Err(error) => {
            // The parser says the same with the place in the file.
            scene.parse()?;
            return Err(error.into());
        }
    };
    let name = args.scene.display().to_string();
    let name = printable(&name);
    match upgraded {
        None => Ok(to_stdout(&format!("{name}: is of format {FORMAT} already; unchanged\n"))?),
        Some(text) => {
            atomic::write_bytes(&args.scene, text.as_bytes()).map_err(bansho::job::JobError::from)?;
            Ok(to_stdout(&format!("{name}: rewritten for format {FORMAT}; comments kept\n"))?)
        }
    }
}
