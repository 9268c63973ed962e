//! What is checked in all files of a plate, and what users should know about them.

use bansho_base::{
    host::assets::{Picture, PictureRemark},
    parameters::{BuildError, ProblemKind},
};

use super::{
    depth::{DepthDoubt, DepthFit},
    ground_fit::GroundFit,
};

/// What users should know about the pictures of a plate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlateRemark {
    /// About a file.
    #[error("`{key}`: {remark}")]
    File {
        /// The key of the file.
        key: &'static str,
        /// What is to be known.
        remark: PictureRemark,
    },
    /// The depth has another size than the image.
    #[error(
        "`depth` has {} x {} pixels and the image {} x {}: the nearest depth value is used for each pixel",
        .depth[0], .depth[1], .image[0], .image[1]
    )]
    DepthSize {
        /// Size of the depth, pixels.
        depth: [usize; 2],
        /// Size of the image, pixels.
        image: [usize; 2],
    },
    /// Albedo or normals have another size than the image.
    #[error(
        "`{key}` has {} x {} pixels and the image {} x {}: it is interpolated",
        .map[0], .map[1], .image[0], .image[1]
    )]
    MapSize {
        /// The key of the file.
        key: &'static str,
        /// Its size, pixels.
        map: [usize; 2],
        /// Size of the image, pixels.
        image: [usize; 2],
    },
    /// The depth has negative values alone.
    #[error(
        "the depth is negative, as z of a camera that looks toward -z, so its values are used without their sign: {nearest} is the nearest, {farthest} the \
         farthest"
    )]
    NegativeDepth {
        /// Largest value.
        nearest: f32,
        /// Smallest value.
        farthest: f32,
    },
    /// The depth hides nothing, or everything.
    #[error("the depth: {0}")]
    DepthDoubt(DepthDoubt),
    /// Scale and shift were found from known depths.
    #[error("`depth_known`: {0}")]
    DepthFit(DepthFit),
    /// Scale and shift were found from the ground of the scene.
    #[error("`depth_kind`: {0}")]
    GroundFit(GroundFit),
}

pub(super) fn size(picture: &Picture) -> [usize; 2] {
    [picture.color.width(), picture.color.height()]
}

/// Whether two sizes have the same shape, up to the rounding of whole pixels.
fn same_shape([width, height]: [usize; 2], [other_width, other_height]: [usize; 2]) -> bool {
    let (scaled, exact) = ((width * other_height) as f64, (other_width * height) as f64);
    let rounding = width.max(height).max(other_width).max(other_height) as f64;
    (scaled - exact).abs() <= rounding
}

pub(super) fn file_remarks(key: &'static str, remarks: &[PictureRemark]) -> impl Iterator<Item = PlateRemark> {
    remarks.iter().map(move |remark| PlateRemark::File { key, remark: remark.clone() })
}

pub(super) fn build_error(key: &str, kind: impl Into<ProblemKind>) -> BuildError {
    BuildError { key: key.to_owned(), kind: kind.into() }
}

pub(super) fn conflict(key: &str, reason: impl ToString) -> BuildError {
    build_error(key, ProblemKind::Conflict(reason.to_string()))
}

/// Checks that the file of `key` has the shape of the image.
pub(super) fn check_shape(
    key: &str,
    path: &str,
    [width, height]: [usize; 2],
    image: [usize; 2],
) -> Result<(), BuildError> {
    if same_shape([width, height], image) {
        return Ok(());
    }
    let turned = if [height, width] == image {
        format!(" (the image is rotated by its Exif orientation, or the {key} is)")
    } else {
        String::new()
    };
    let [image_width, image_height] = image;
    Err(conflict(
        key,
        format!(
            "{path}: has {width} x {height} pixels; allowed: {image_width} x {image_height}, the size of the image, or the \
             same aspect ratio{turned}"
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_the_same_up_to_whole_pixels() {
        for (depth, image) in [([518, 388], [4000, 3000]), ([384, 256], [3000, 2000]), ([2, 1], [3, 1])] {
            assert!(same_shape(depth, image), "{depth:?} {image:?}");
        }
        for (depth, image) in [([3000, 4000], [4000, 3000]), ([518, 518], [4000, 3000]), ([640, 480], [1920, 1080])] {
            assert!(!same_shape(depth, image), "{depth:?} {image:?}");
        }
    }
}
