//! Whether every frame has its plate, checked before anything is drawn.

use bansho_base::{host::assets::AssetError, parameters::ProblemKind};
use bansho_render::{CompiledScene, RenderError};

use crate::job::{error::JobError, scene_file::SceneFile};

/// Checks that a numbered plate has a file for each of the frames `numbers`, that each of them is whole as far as its structure tells, and that all have the
/// same size. A plate of a single picture was checked with the scene.
///
/// # Errors
/// The first file that is missing, damaged or of another size, with the position of its key in the scene.
pub(crate) fn check(scene: &SceneFile, compiled: &CompiledScene, numbers: &[i64]) -> Result<(), JobError> {
    let plate = &compiled.scene().plate;
    for (key, path) in [("plate.image", &plate.image), ("plate.depth", &plate.depth)] {
        let Some(path) = path.as_ref().filter(|path| path.0.contains('#')) else { continue };
        let at_key = |message: String| scene.error_at(key, ProblemKind::Conflict(message));
        let missing = |number: i64| compiled.assets().find(&path.0, number).err();
        if let Some((first, count, error)) = first_of(numbers, missing) {
            return Err(at_key(message(&error, first, count, numbers.len(), "have none")));
        }
        let layers = plate.layers();
        let read = |number: i64| {
            let size = compiled.assets().check_whole(&path.0, number)?;
            if size.is_some() {
                return Ok(size);
            }
            // Only decoding tells.
            Ok(Some(match key {
                "plate.image" => {
                    let picture = compiled.assets().picture_layers(&path.0, number, &layers)?;
                    [picture.color.width(), picture.color.height()]
                }
                _ => {
                    let depth = compiled.assets().depth(&path.0, number, plate.depth_layer.as_deref())?;
                    [depth.values.width(), depth.values.height()]
                }
            }))
        };
        let sizes: Vec<_> = numbers.iter().map(|&number| (number, read(number))).collect();
        let damaged = sizes.iter().filter_map(|(number, size)| Some((*number, size.as_ref().err()?)));
        let count = damaged.clone().count();
        if let Some((first, error)) = damaged.clone().next() {
            return Err(at_key(message(error, first, count, numbers.len(), "cannot be read")));
        }
        check_sizes(sizes.into_iter().filter_map(|(number, size)| Some((number, size.ok()??)))).map_err(at_key)?;
    }
    Ok(())
}

/// The first of the frames with an error, their number, and the error.
fn first_of(numbers: &[i64], error: impl Fn(i64) -> Option<AssetError>) -> Option<(i64, usize, AssetError)> {
    let (first, found) = numbers.iter().find_map(|&number| Some((number, error(number)?)))?;
    let count = numbers.iter().filter(|number| error(**number).is_some()).count();
    Some((first, count, found))
}

/// Checks that all frames of a plate have the size of the first: a camera takes all in one.
fn check_sizes(mut sizes: impl Iterator<Item = (i64, [usize; 2])>) -> Result<(), String> {
    let Some((first, [width, height])) = sizes.next() else { return Ok(()) };
    match sizes.find(|(_, size)| *size != [width, height]) {
        None => Ok(()),
        Some((other, [other_width, other_height])) => Err(format!(
            "the plate of frame {other} has {other_width} x {other_height} pixels, and that of frame {first} {width} x {height}; allowed: one size for all frames"
        )),
    }
}

fn message(error: &AssetError, first: i64, count: usize, frames: usize, fault: &str) -> String {
    match count {
        1 => format!("{error}; it is the plate of frame {first}"),
        _ => format!("{error}; it is the plate of frame {first}, and {count} of the {frames} frames {fault}"),
    }
}

/// Adds the position in the scene to the error of a plate that was damaged or removed during the job. Other errors are unchanged.
pub(crate) fn with_position(scene: &SceneFile, error: JobError) -> JobError {
    match error {
        JobError::Render(RenderError::Plate(error)) => scene.error_at(&format!("plate.{}", error.key), error.kind),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_of_another_size_is_named_with_the_first() {
        assert_eq!(check_sizes([].into_iter()), Ok(()));
        assert_eq!(check_sizes((1..9).map(|number| (number, [32, 18]))), Ok(()));
        let told = check_sizes((1..9).map(|number| (number, if number < 6 { [32, 18] } else { [16, 9] }))).unwrap_err();
        assert!(told.contains("frame 6 has 16 x 9 pixels, and that of frame 1 32 x 18"), "{told}");
    }
}
