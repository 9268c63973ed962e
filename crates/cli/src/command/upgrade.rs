//! `bansho upgrade`

use bansho::{
    base::host::printable::printable,
    job::SceneFile,
    media::files::atomic,
    scene::{FORMAT, edit},
};

use crate::{args::UpgradeArgs, output::print};

/// Rewrites a scene in place, atomically.
pub(crate) fn run(args: &UpgradeArgs) -> anyhow::Result<()> {
    let scene = SceneFile::read(&args.scene)?;
    let upgraded = match edit::upgrade(&scene.text) {
        Ok(upgraded) => upgraded,
        Err(error) => {
            // The parser reports the same problem with its position.
            scene.parse()?;
            return Err(error.into());
        }
    };
    let name = args.scene.display().to_string();
    let name = printable(&name);
    match upgraded {
        None => Ok(print(&format!("{name}: already has format {FORMAT}; unchanged\n"))?),
        Some(text) => {
            atomic::write_bytes(&args.scene, text.as_bytes()).map_err(bansho::job::JobError::from)?;
            Ok(print(&format!("{name}: rewritten for format {FORMAT}; comments are kept\n"))?)
        }
    }
}
