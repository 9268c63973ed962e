//! The plate and its reflection of the last frame, since in most shots the plate is a single picture.

use std::sync::Arc;

use bansho_base::{
    camera::Camera,
    color,
    host::observer::{Cancelled, Observer},
    parameters::BuildError,
    phenomenon::LevelMirror,
};

use super::{
    mirror,
    plate::{self, PlateFrame},
};
use crate::{compiled::CompiledScene, plan::Plan};

/// The last plate, and its last reflection.
#[derive(Default)]
pub(crate) struct PlateCache {
    last: Option<(PlateKey, Arc<PlateFrame>)>,
    mirrored: Option<(MirrorKey, Arc<PlateFrame>)>,
}

/// What a plate depends on, apart from the scene's `[plate]`.
#[derive(Clone, Copy, PartialEq)]
struct PlateKey {
    /// Of picture and depth.
    digests: [Option<[u8; 32]>; 2],
    /// Its lens determines the convention of depth.
    camera: Camera,
    view_transform: color::View,
}

/// What the reflection of a plate depends on, apart from the plan.
#[derive(Clone, Copy, PartialEq)]
struct MirrorKey {
    plate: PlateKey,
    mirror: LevelMirror,
    exposure_scale: f32,
    pixel_size: usize,
}

impl PlateCache {
    /// The plate of frame `number`.
    ///
    /// # Errors
    /// The picture or its depth cannot be read.
    pub(crate) fn frame(
        &mut self,
        compiled: &CompiledScene,
        plan: &Plan,
        number: i64,
    ) -> Result<Arc<PlateFrame>, BuildError> {
        let parameters = &plan.scene.plate;
        if parameters.image.is_none() {
            return Ok(Arc::default());
        }
        let mut digests = [None; 2];
        let paths = [("image", &parameters.image), ("depth", &parameters.depth)];
        for (digest, (key, path)) in digests.iter_mut().zip(paths) {
            let Some(path) = path else { continue };
            let found = compiled.assets().digest(&path.0, number);
            *digest = Some(found.map_err(|error| BuildError { key: key.into(), kind: error.into() })?);
        }
        let key = PlateKey { digests, camera: plan.view(number).camera, view_transform: plan.view_transform() };
        if let Some((known, frame)) = &self.last
            && *known == key
        {
            return Ok(frame.clone());
        }
        let frame = Arc::new(plate::load(plan, compiled.assets().as_ref(), number, &key.camera)?);
        self.last = Some((key, frame.clone()));
        Ok(frame)
    }

    /// The last plate as seen in a horizontal mirror, in pixels `pixel_size` times as wide and high as those of the plate.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub(crate) fn mirrored(
        &mut self,
        plan: &Plan,
        mirror: LevelMirror,
        pixel_size: usize,
        observer: &dyn Observer,
    ) -> Result<Arc<PlateFrame>, Cancelled> {
        let Some((plate_key, plate)) = &self.last else { return Ok(Arc::default()) };
        let key = MirrorKey { plate: *plate_key, mirror, exposure_scale: plan.exposure_scale(), pixel_size };
        if let Some((known, frame)) = &self.mirrored
            && *known == key
        {
            return Ok(frame.clone());
        }
        let seen = mirror::mirrored(plate, &plate_key.camera, mirror, key.exposure_scale, pixel_size, observer)?;
        let frame = Arc::new(seen);
        self.mirrored = Some((key, frame.clone()));
        Ok(frame)
    }
}
