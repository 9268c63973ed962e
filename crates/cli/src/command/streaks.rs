//! `bansho streaks`

use crate::{args::StreaksArgs, progress};

/// Writes streak textures of rain.
pub(crate) fn run(args: &StreaksArgs) -> anyhow::Result<()> {
    super::watched(&args.work, |watcher| {
        let streaks = args.streaks().prepare()?;
        let index = streaks.run(watcher)?;
        Ok(progress::Result { what: "texture", drawn: streaks.texture_count(), kept: 0, files: vec![index] })
    })
}
