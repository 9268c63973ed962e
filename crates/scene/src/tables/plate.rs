//! Reads the pictures of a plate, and checks that they fit together.

use std::sync::Arc;

use bansho_base::{
    color::AlphaConvention,
    host::assets::{AssetError, AssetProblem, Assets, DepthMap, Picture, PictureAlpha, PictureLayers, PictureRemark},
    parameters::{AssetPath, BuildError},
};

use super::{
    depth::{self, DepthScale, DepthValues, KnownDepthError},
    ground_fit::{self, PlateView},
    picture::{DepthKind, PlateAlpha, PlateParameters, PlateSky},
    plate_checks::{PlateRemark, build_error, check_shape, conflict, file_remarks, size},
    plate_surfaces::PlateSurfaces,
};

/// The pictures of a plate in one frame.
pub struct PlatePictures {
    /// Its image.
    pub image: Arc<Picture>,
    /// How the alpha of the image blends.
    pub alpha: PictureAlpha,
    /// Its depth.
    pub depth: Option<PlateDepth>,
    /// The surfaces that it shows, if lights light them.
    pub surfaces: Option<PlateSurfaces>,
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

impl PlateParameters {
    /// The files that it names, with their keys.
    pub fn files(&self) -> impl Iterator<Item = (&'static str, &AssetPath)> {
        let Self { image, depth, albedo, normal, .. } = self;
        let files = [("image", image), ("depth", depth), ("albedo", albedo), ("normal", normal)];
        files.into_iter().filter_map(|(key, path)| Some((key, path.as_ref()?)))
    }

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
    /// A picture cannot be read, the depth picture has no depth, a file has another shape than the image, the known depths contradict it, scale and shift
    /// would have to be found from ground that the plate does not show, or its surfaces have no depth or impossible values.
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
        if depth.is_none() && self.sky == PlateSky::Scene {
            let message = "`sky = \"scene\"` needs a depth, from which it is known where the sky is".to_owned();
            return Err(conflict("sky", message));
        }
        let surfaces = self.read_surfaces(assets, frame, size(&image), depth.is_some(), &mut remarks)?;
        Ok(Some(PlatePictures { image, alpha, depth, surfaces, remarks }))
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
                check_shape("depth", &path.0, depth_size, size(image))?;
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

impl PlatePictures {
    /// What users should know about its pictures.
    pub fn remarks(&self) -> &[PlateRemark] {
        &self.remarks
    }
}
