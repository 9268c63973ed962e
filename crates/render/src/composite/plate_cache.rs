//! The plate of the last frame, with the light of fires and lamps and in the mirror, since in most shots the plate is a single picture.

use std::sync::Arc;

use bansho_base::{
    camera::Camera,
    color,
    host::observer::{Cancelled, Observer},
    parameters::BuildError,
    phenomenon::LevelMirror,
};

use super::{
    mirror::MirroredPlate,
    plate::{self, PlateFrame},
    plate_lighting::{LitPlate, PlateLights},
};
use crate::{compiled::CompiledScene, plan::Plan};

/// The last plate, and its last reflection.
#[derive(Default)]
pub(crate) struct PlateCache {
    last: Option<(PlateKey, Arc<PlateFrame>)>,
    lit: LitPlate,
    mirrored: Option<CachedMirror>,
}

/// What a plate depends on, apart from the scene's `[plate]`.
#[derive(Clone, Copy, PartialEq)]
struct PlateKey {
    /// Of picture, depth, albedo and normals.
    digests: [Option<[u8; 32]>; 4],
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

/// The reflection of a plate.
struct CachedMirror {
    key: MirrorKey,
    /// Of the plate's light, if there is any.
    lit_version: Option<u64>,
    mirrored: MirroredPlate,
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
        let mut digests = [None; 4];
        for (digest, (key, path)) in digests.iter_mut().zip(parameters.files()) {
            let found = compiled.assets().digest(&path.0, number);
            *digest = Some(found.map_err(|error| BuildError { key: key.into(), kind: error.into() })?);
        }
        let key = PlateKey { digests, camera: plan.view(number).camera, view_transform: plan.view_transform() };
        if let Some((known, frame)) = &self.last
            && *known == key
        {
            return Ok(frame.clone());
        }
        // A plate that nothing else refers to gives its memory to the next one.
        let recycled = self.last.take().and_then(|(_, frame)| Arc::into_inner(frame));
        let frame = plate::load(plan, compiled, number, &key.camera, digests[0], recycled.unwrap_or_default())?;
        let frame = Arc::new(frame);
        self.last = Some((key, frame.clone()));
        Ok(frame)
    }

    /// The last plate in the light of fires and lamps; itself where no light falls on it.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub(crate) fn lit(&mut self, lights: &PlateLights, observer: &dyn Observer) -> Result<Arc<PlateFrame>, Cancelled> {
        match &self.last {
            Some((_, plate)) => self.lit.frame(plate.clone(), lights, observer),
            None => Ok(Arc::default()),
        }
    }

    /// The last plate, in the light that it has in `plate`, as seen in a horizontal mirror, in pixels `pixel_size` times as wide and high as those of the plate.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub(crate) fn mirrored(
        &mut self,
        plan: &Plan,
        plate: &Arc<PlateFrame>,
        mirror: LevelMirror,
        pixel_size: usize,
        observer: &dyn Observer,
    ) -> Result<Arc<PlateFrame>, Cancelled> {
        let Some((plate_key, unlit)) = &self.last else { return Ok(Arc::default()) };
        let lit_version = (!Arc::ptr_eq(unlit, plate)).then_some(self.lit.version);
        let exposure_scale = plan.exposure_scale();
        let key = MirrorKey { plate: *plate_key, mirror, exposure_scale, pixel_size };
        if let Some(cached) = &mut self.mirrored
            && cached.key == key
        {
            if cached.lit_version == lit_version {
                return Ok(cached.mirrored.frame.clone());
            }
            // Only colors have changed.
            if cached.mirrored.keeps_sources() {
                cached.mirrored.recolor(plate, exposure_scale);
                cached.lit_version = lit_version;
                return Ok(cached.mirrored.frame.clone());
            }
        }
        let keeps_sources = plate.surface.is_some();
        let mirrored =
            MirroredPlate::new(plate, &plate_key.camera, mirror, exposure_scale, pixel_size, keeps_sources, observer)?;
        let frame = mirrored.frame.clone();
        self.mirrored = Some(CachedMirror { key, lit_version, mirrored });
        Ok(frame)
    }
}
