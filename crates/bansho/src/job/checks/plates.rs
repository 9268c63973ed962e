//! Whether the plate of every frame is there, found out before anything is drawn.

use bansho_base::{host::assets::AssetError, parameters::ProblemKind};
use bansho_render::{CompiledScene, RenderError};

use crate::job::{error::JobError, scene_file::SceneFile};

/// Looks whether there is a file for each of the frames `numbers` of a plate; what a single picture holds was checked with the scene.
///
/// # Errors
/// The first that is missing, at its place in the scene.
pub(crate) fn check(scene: &SceneFile, compiled: &CompiledScene, numbers: &[i64]) -> Result<(), JobError> {
    let plate = &compiled.scene().plate;
    for (key, path) in [("plate.image", &plate.image), ("plate.depth", &plate.depth)] {
        let Some(path) = path.as_ref().filter(|path| path.0.contains('#')) else { continue };
        let missing = |&&number: &&i64| compiled.assets().find(&path.0, number).is_err();
        let Some(first) = numbers.iter().find(missing) else { continue };
        let Err(error) = compiled.assets().find(&path.0, *first) else { continue };
        let count = numbers.iter().filter(missing).count();
        return Err(scene.fault(key, ProblemKind::Conflict(message(&error, *first, count, numbers.len()))));
    }
    Ok(())
}

fn message(error: &AssetError, first: i64, count: usize, of: usize) -> String {
    match count {
        1 => format!("{error}; it is the plate of frame {first}"),
        _ => format!("{error}; it is the plate of frame {first}, and {count} of the {of} frames have none"),
    }
}

/// A plate that was damaged or vanished while the work was done, at its place in the scene; any other error as it is.
pub(crate) fn located(scene: &SceneFile, error: JobError) -> JobError {
    match error {
        JobError::Render(RenderError::Plate(fault)) => scene.fault(&format!("plate.{}", fault.key), fault.kind),
        other => other,
    }
}
