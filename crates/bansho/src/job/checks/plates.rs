//! Whether every frame has its plate, checked before anything is drawn.

use bansho_base::{
    host::assets::{AssetError, Picture},
    parameters::ProblemKind,
};
use bansho_render::{CompiledScene, RenderError};

use crate::job::{error::JobError, scene_file::SceneFile};

/// Checks that a numbered plate has a file for each of the frames `numbers`, that each of them is whole as far as its structure tells, and that all have the
/// same size. A plate of a single picture was checked with the scene.
///
/// # Errors
/// The first file that is missing, damaged or of another size, with the position of its key in the scene.
pub(crate) fn check(scene: &SceneFile, compiled: &CompiledScene, numbers: &[i64]) -> Result<(), JobError> {
    let plate = &compiled.scene().plate;
    for (key, path) in plate.files().filter(|(_, path)| path.0.contains('#')) {
        check_files(compiled, key, &path.0, numbers)
            .map_err(|message| scene.error_at(&format!("plate.{key}"), ProblemKind::Conflict(message)))?;
    }
    Ok(())
}

/// Checks the files of the plate at `key`, one for each frame: first that none is missing, which takes little time.
fn check_files(compiled: &CompiledScene, key: &str, path: &str, numbers: &[i64]) -> Result<(), String> {
    let missing = numbers.iter().filter_map(|&number| Some((number, compiled.assets().find(path, number).err()?)));
    let missing: Vec<(i64, AssetError)> = missing.collect();
    if let Some((first, error)) = missing.first() {
        return Err(message(error, *first, missing.len(), numbers.len(), "have none"));
    }
    let (mut sizes, mut damaged) = (Vec::new(), Vec::new());
    for &number in numbers {
        match plate_size(compiled, key, path, number) {
            Ok(size) => sizes.push((number, size)),
            Err(error) => damaged.push((number, error)),
        }
    }
    if let Some((first, error)) = damaged.first() {
        return Err(message(error, *first, damaged.len(), numbers.len(), "cannot be read"));
    }
    check_sizes(sizes.into_iter())
}

/// Width and height of the plate at `key` in frame `number`, pixels, if its file is whole.
fn plate_size(compiled: &CompiledScene, key: &str, path: &str, number: i64) -> Result<[usize; 2], AssetError> {
    let (assets, plate) = (compiled.assets(), &compiled.scene().plate);
    if let Some(size) = assets.check_whole(path, number)? {
        return Ok(size);
    }
    // Only decoding tells.
    let size = |picture: &Picture| [picture.color.width(), picture.color.height()];
    Ok(match key {
        "depth" => {
            let depth = assets.depth(path, number, plate.depth_layer.as_deref())?;
            [depth.values.width(), depth.values.height()]
        }
        "normal" => {
            let normals = assets.normals(path, number)?;
            [normals.values.width(), normals.values.height()]
        }
        "albedo" => size(&*assets.picture(path, number)?),
        _ => size(&*assets.picture_layers(path, number, &plate.layers())?),
    })
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

/// What is wrong with the plate of the first frame with such a fault, and in how many frames.
fn message(error: &AssetError, first: i64, count: usize, frames: usize, fault: &str) -> String {
    match count {
        1 => format!("{error}; it is the plate of frame {first}"),
        _ => format!("{error}; it is the plate of frame {first}, and {count} of the {frames} frames {fault}"),
    }
}

/// Adds the position in the scene to the error of a plate that was damaged or removed during the job. Other errors are unchanged.
pub(crate) fn with_position(scene: &SceneFile, error: JobError) -> JobError {
    match error {
        JobError::Frame { number, source } => with_position(scene, *source).in_frame(number),
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
