//! `bansho streaks`

use crate::{args::StreaksArgs, progress::JobResult};

/// Writes streak textures of rain.
pub(crate) fn run(args: &StreaksArgs) -> anyhow::Result<()> {
    super::run_job(&args.work, |reporter| {
        let streaks = args.streaks().prepare()?;
        let index = streaks.run(reporter)?;
        Ok(JobResult { unit: "texture", drawn: streaks.texture_count(), kept: 0, files: vec![index] })
    })
}
