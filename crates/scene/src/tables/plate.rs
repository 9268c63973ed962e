//! The pictures of a plate, which must belong together.

use std::sync::Arc;

use bansho_base::{
    host::assets::{AssetError, AssetProblem, Assets, Picture},
    parameters::{BuildError, ProblemKind},
};

use super::picture::PlateParameters;

/// What a plate shows in one frame.
pub struct PlatePictures {
    /// Its image.
    pub image: Arc<Picture>,
    /// A picture of the same size that has depth.
    pub depth: Option<Arc<Picture>>,
}

fn size(picture: &Picture) -> [usize; 2] {
    [picture.color.width(), picture.color.height()]
}

impl PlateParameters {
    /// Reads the plate of frame `frame`; `None` where the scene has none.
    ///
    /// # Errors
    /// A picture cannot be had, the depth has no depth, or is of another size than the image.
    pub fn read_frame(&self, assets: &dyn Assets, frame: i64) -> Result<Option<PlatePictures>, BuildError> {
        let fault = |key: &str, kind| BuildError { key: key.to_owned(), kind };
        let read = |key: &str, path: &str| assets.picture(path, frame).map_err(|error| fault(key, error.into()));
        let Some(path) = &self.image else { return Ok(None) };
        let image = read("image", &path.0)?;
        let Some(path) = &self.depth else {
            let depth = image.depth.is_some().then(|| image.clone());
            return Ok(Some(PlatePictures { image, depth }));
        };
        let depth = read("depth", &path.0)?;
        if depth.depth.is_none() {
            let problem = AssetProblem::NoChannel("Z".into());
            return Err(fault("depth", AssetError { path: path.0.clone(), problem }.into()));
        }
        let [[width, height], [plate_width, plate_height]] = [size(&depth), size(&image)];
        if [width, height] != [plate_width, plate_height] {
            let reason = format!(
                "{}: has {width} x {height} pixels; allowed: {plate_width} x {plate_height}, as many as the image",
                path.0
            );
            return Err(fault("depth", ProblemKind::Conflict(reason)));
        }
        Ok(Some(PlatePictures { image, depth: Some(depth) }))
    }
}
