//! Whether every frame has its plate, checked before anything is drawn.

use bansho_base::{host::assets::AssetError, parameters::ProblemKind};
use bansho_render::{CompiledScene, RenderError};

use crate::job::{error::JobError, scene_file::SceneFile};

/// Checks that a numbered plate has a file for each of the frames `numbers`. A plate of a single picture was checked with the scene.
///
/// # Errors
/// The first missing file, with the position of its key in the scene.
pub(crate) fn check(scene: &SceneFile, compiled: &CompiledScene, numbers: &[i64]) -> Result<(), JobError> {
    let plate = &compiled.scene().plate;
    for (key, path) in [("plate.image", &plate.image), ("plate.depth", &plate.depth)] {
        let Some(path) = path.as_ref().filter(|path| path.0.contains('#')) else { continue };
        let missing = |&&number: &&i64| compiled.assets().find(&path.0, number).is_err();
        let Some(first) = numbers.iter().find(missing) else { continue };
        let Err(error) = compiled.assets().find(&path.0, *first) else { continue };
        let count = numbers.iter().filter(missing).count();
        return Err(scene.error_at(key, ProblemKind::Conflict(message(&error, *first, count, numbers.len()))));
    }
    Ok(())
}

fn message(error: &AssetError, first: i64, count: usize, frames: usize) -> String {
    match count {
        1 => format!("{error}; it is the plate of frame {first}"),
        _ => format!("{error}; it is the plate of frame {first}, and {count} of the {frames} frames have none"),
    }
}

/// Adds the position in the scene to the error of a plate that was damaged or removed during the job. Other errors are unchanged.
pub(crate) fn with_position(scene: &SceneFile, error: JobError) -> JobError {
    match error {
        JobError::Render(RenderError::Plate(error)) => scene.error_at(&format!("plate.{}", error.key), error.kind),
        other => other,
    }
}
