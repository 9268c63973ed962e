//! Reads the pictures of a plate, and checks that they fit together.

use std::sync::Arc;

use bansho_base::{
    host::assets::{AssetError, AssetProblem, Assets, Picture},
    parameters::{BuildError, ProblemKind},
};

use super::picture::PlateParameters;

/// The pictures of a plate in one frame.
pub struct PlatePictures {
    /// Its image.
    pub image: Arc<Picture>,
    /// A picture of the same size with a depth channel.
    pub depth: Option<Arc<Picture>>,
}

fn size(picture: &Picture) -> [usize; 2] {
    [picture.color.width(), picture.color.height()]
}

impl PlateParameters {
    /// Reads the plate of frame `frame`; `None` where the scene has none.
    ///
    /// # Errors
    /// A picture cannot be read, the depth picture has no depth channel, or has another size than the image.
    pub fn read_frame(&self, assets: &dyn Assets, frame: i64) -> Result<Option<PlatePictures>, BuildError> {
        let error = |key: &str, kind| BuildError { key: key.to_owned(), kind };
        let read =
            |key: &str, path: &str| assets.picture(path, frame).map_err(|asset_error| error(key, asset_error.into()));
        let Some(path) = &self.image else { return Ok(None) };
        let image = read("image", &path.0)?;
        let Some(path) = &self.depth else {
            let depth = image.depth.is_some().then(|| image.clone());
            return Ok(Some(PlatePictures { image, depth }));
        };
        let depth = read("depth", &path.0)?;
        if depth.depth.is_none() {
            let problem = AssetProblem::NoChannel("Z".into());
            return Err(error("depth", AssetError { path: path.0.clone(), problem }.into()));
        }
        let [[width, height], [plate_width, plate_height]] = [size(&depth), size(&image)];
        if [width, height] != [plate_width, plate_height] {
            let reason = format!(
                "{}: has {width} x {height} pixels; allowed: {plate_width} x {plate_height}, the size of the image",
                path.0
            );
            return Err(error("depth", ProblemKind::Conflict(reason)));
        }
        Ok(Some(PlatePictures { image, depth: Some(depth) }))
    }
}
