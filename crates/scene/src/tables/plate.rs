//! Reads the pictures of a plate, and checks that they fit together.

use std::sync::Arc;

use bansho_base::{
    color::AlphaConvention,
    host::assets::{AssetError, AssetProblem, Assets, DepthMap, Picture, PictureAlpha, PictureLayers, PictureRemark},
    parameters::{BuildError, ProblemKind},
};

use super::{
    depth::{self, DepthDoubt, DepthFit, DepthScale, DepthValues, KnownDepthError},
    ground_fit::{self, GroundFit, PlateView},
    picture::{DepthKind, PlateAlpha, PlateParameters},
};

/// The pictures of a plate in one frame.
pub struct PlatePictures {
    /// Its image.
    pub image: Arc<Picture>,
    /// How the alpha of the image blends.
    pub alpha: PictureAlpha,
    /// Its depth.
    pub depth: Option<PlateDepth>,
    remarks: Vec<PlateRemark>,
}

/// The depth of a plate in one frame.
pub struct PlateDepth {
    source: DepthSource,
    /// Width and height, pixels; the shape of the image, not always its size.
    pub size: [usize; 2],
    /// From values to meters.
    pub scale: DepthScale,
}

enum DepthSource {
    /// The depth in the image.
    Image(Arc<Picture>),
    /// A depth of its own.
    Map(Arc<DepthMap>),
}

impl PlateDepth {
    /// Values in rows, in the unit of the file.
    pub fn values(&self) -> &[f32] {
        match &self.source {
            DepthSource::Image(picture) => picture.depth.as_deref().unwrap_or_default(),
            DepthSource::Map(map) => map.values.pixels().as_flattened(),
        }
    }

    /// The value nearest to a position in an image of `image_size` pixels.
    fn value_at(&self, position: [f64; 2], image_size: [usize; 2]) -> f32 {
        let [x, y] = [0, 1].map(|axis| {
            let scaled = position[axis] * self.size[axis] as f64 / image_size[axis] as f64;
            (scaled as usize).min(self.size[axis] - 1)
        });
        self.values()[y * self.size[0] + x]
    }
}

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

fn size(picture: &Picture) -> [usize; 2] {
    [picture.color.width(), picture.color.height()]
}

/// Whether two sizes have the same shape, up to the rounding of whole pixels.
fn same_shape([width, height]: [usize; 2], [other_width, other_height]: [usize; 2]) -> bool {
    let (scaled, exact) = ((width * other_height) as f64, (other_width * height) as f64);
    let rounding = width.max(height).max(other_width).max(other_height) as f64;
    (scaled - exact).abs() <= rounding
}

fn file_remarks(key: &'static str, remarks: &[PictureRemark]) -> impl Iterator<Item = PlateRemark> {
    remarks.iter().map(move |remark| PlateRemark::File { key, remark: remark.clone() })
}

fn build_error(key: &str, kind: impl Into<ProblemKind>) -> BuildError {
    BuildError { key: key.to_owned(), kind: kind.into() }
}

fn conflict(key: &str, reason: impl ToString) -> BuildError {
    build_error(key, ProblemKind::Conflict(reason.to_string()))
}

impl PlateParameters {
    /// The layers of the image that it chooses.
    pub fn layers(&self) -> PictureLayers {
        let depth = self.depth_layer.clone().filter(|_| self.depth.is_none());
        PictureLayers { image: self.image_layer.clone(), depth }
    }

    /// Reads the image of frame `frame`; `None` where the scene has no plate.
    ///
    /// # Errors
    /// The picture cannot be read.
    pub fn read_image(&self, assets: &dyn Assets, frame: i64) -> Result<Option<Arc<Picture>>, AssetError> {
        self.image.as_ref().map(|path| assets.picture_layers(&path.0, frame, &self.layers())).transpose()
    }

    /// How the alpha of `picture` blends.
    pub fn alpha_of(&self, picture: &Picture) -> PictureAlpha {
        match (picture.alpha, self.alpha) {
            (PictureAlpha::Straight(_), PlateAlpha::Encoded) => PictureAlpha::Straight(AlphaConvention::Encoded),
            (PictureAlpha::Straight(_), PlateAlpha::Linear) => PictureAlpha::Straight(AlphaConvention::Linear),
            (alpha, _) => alpha,
        }
    }

    /// Whether scale and shift of its depth, if it has one, are found from the ground of the scene, if it has one.
    pub fn fits_ground(&self) -> bool {
        let is_stated = self.depth_scale.is_some() || self.depth_shift.is_some() || !self.depth_known.is_empty();
        self.depth_kind == DepthKind::Inverse && !is_stated
    }

    /// Reads the plate of frame `frame`, taken from `view`; `None` where the scene has none.
    ///
    /// # Errors
    /// A picture cannot be read, the depth picture has no depth, it has another shape than the image, the known depths contradict it, or scale and shift
    /// would have to be found from ground that the plate does not show.
    pub fn read_frame(
        &self,
        assets: &dyn Assets,
        frame: i64,
        view: &PlateView,
    ) -> Result<Option<PlatePictures>, BuildError> {
        let image = self.read_image(assets, frame).map_err(|error| build_error(image_key(&error), error))?;
        let Some(image) = image else { return Ok(None) };
        let alpha = self.alpha_of(&image);
        let mut remarks: Vec<PlateRemark> = file_remarks("image", &image.remarks).collect();
        if alpha != PictureAlpha::Opaque {
            remarks.extend(file_remarks("image", &[PictureRemark::AlphaUsed(alpha)]));
        }
        let depth = self.read_depth(assets, frame, &image, view, &mut remarks)?;
        if depth.is_none() && !self.depth_known.is_empty() {
            return Err(conflict("depth_known", KnownDepthError::NoDepth));
        }
        Ok(Some(PlatePictures { image, alpha, depth, remarks }))
    }

    /// Reads the depth of `image`, from its own file or from the image's.
    fn read_depth(
        &self,
        assets: &dyn Assets,
        frame: i64,
        image: &Arc<Picture>,
        view: &PlateView,
        remarks: &mut Vec<PlateRemark>,
    ) -> Result<Option<PlateDepth>, BuildError> {
        let (meters, shift) = (self.depth_scale.unwrap_or(1.0), self.depth_shift.unwrap_or(0.0));
        let scale = DepthScale { kind: self.depth_kind, meters, shift };
        let (source, depth_size) = match &self.depth {
            None if image.depth.is_none() => return Ok(None),
            None => (DepthSource::Image(image.clone()), size(image)),
            Some(path) => {
                let read = assets.depth(&path.0, frame, self.depth_layer.as_deref());
                let map = read.map_err(|error| build_error("depth", error))?;
                let depth_size = [map.values.width(), map.values.height()];
                check_shape(&path.0, depth_size, size(image))?;
                remarks.extend(file_remarks("depth", &map.remarks));
                (DepthSource::Map(map), depth_size)
            }
        };
        if depth_size != size(image) {
            remarks.push(PlateRemark::DepthSize { depth: depth_size, image: size(image) });
        }
        let mut depth = PlateDepth { source, size: depth_size, scale };
        if !self.depth_known.is_empty() {
            let size = size(image);
            let fit = depth::fit(&self.depth_known, self.depth_kind, size, |position| depth.value_at(position, size));
            let fit = fit.map_err(|error| conflict("depth_known", error))?;
            depth.scale = fit.scale();
            remarks.push(PlateRemark::DepthFit(fit));
        }
        if let Some(height) = view.ground_height.filter(|_| self.fits_ground()) {
            let fit = ground_fit::fit(depth.values(), depth.size, size(image), view, height);
            let fit = fit.map_err(|error| conflict("depth_kind", error))?;
            depth.scale = fit.scale();
            remarks.push(PlateRemark::GroundFit(fit));
        }
        let values = DepthValues::of(depth.values());
        if self.depth_kind != DepthKind::Inverse && values.are_negative() {
            depth.scale.meters = -meters;
            let [farthest, nearest] = values.range;
            remarks.push(PlateRemark::NegativeDepth { nearest, farthest });
        }
        remarks.extend(values.doubt(&depth.scale, view.camera.near).map(PlateRemark::DepthDoubt));
        Ok(Some(depth))
    }
}

/// The key that an error in reading the image belongs to.
fn image_key(error: &AssetError) -> &'static str {
    match &error.problem {
        AssetProblem::NoLayer { use_of_layer: "depth", .. } => "depth_layer",
        AssetProblem::NoLayer { .. } => "image_layer",
        _ => "image",
    }
}

fn check_shape(path: &str, [width, height]: [usize; 2], image: [usize; 2]) -> Result<(), BuildError> {
    if same_shape([width, height], image) {
        return Ok(());
    }
    let turned =
        if [height, width] == image { " (the image is rotated by its Exif orientation, or the depth is)" } else { "" };
    let [image_width, image_height] = image;
    Err(conflict(
        "depth",
        format!(
            "{path}: has {width} x {height} pixels; allowed: {image_width} x {image_height}, the size of the image, or the \
             same aspect ratio{turned}"
        ),
    ))
}

impl PlatePictures {
    /// What users should know about its pictures.
    pub fn remarks(&self) -> &[PlateRemark] {
        &self.remarks
    }
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
