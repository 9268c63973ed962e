//! The scene in the mirror of one of its phenomena.

use bansho_base::{
    host::observer::{Observer, PartGuard, Stage, StagePart},
    image::{Image, Rect},
    phenomenon::{
        LevelMirror,
        strip::View,
        surroundings::{Publication, Reflection},
    },
};

use super::{PreparationInputs, PreparedSlices, RenderError, Shot};
use crate::{
    compiled::ActiveRun,
    composite::{
        background::Background,
        composition::{Composition, Outputs},
        hiding::HidingDepth,
        light_frame,
        mirror::{self, BACKDROP_SAMPLE, Mirror},
        plate::PlateFrame,
    },
};

/// The mirror of a scene.
#[derive(Clone, Copy)]
pub(super) struct SceneMirror {
    /// Index of the phenomenon that is the mirror.
    index: usize,
    pub(super) mirror: LevelMirror,
    /// Side of the pixels in which the mirrored scene is drawn, in pixels of the picture.
    pub(super) pixel_size: usize,
    /// Whether the mirrored scene is seen at all, and not only the backdrop.
    has_picture: bool,
}

impl Shot {
    /// The first mirror. The resolution of its picture is that of the whole picture, whatever the crop.
    pub(super) fn mirror(&self, view: &View, publications: &[Publication]) -> Option<SceneMirror> {
        let mut mirrors = self.runs.iter().enumerate();
        let (index, mirror) = mirrors.find_map(|(index, each)| Some((index, each.info().mirror?)))?;
        // Only drops in the air extinguish light.
        let is_raining = publications.iter().any(|publication| publication.extinction > 0.0);
        let pixel_size = mirror.roughness.pixel_size(view.camera.focal_pixels, is_raining);
        let has_picture = pixel_size.is_some();
        Some(SceneMirror { index, mirror, pixel_size: pixel_size.unwrap_or(BACKDROP_SAMPLE), has_picture })
    }

    /// The reflection in the first mirror: all other phenomena, in front of the `mirrored` plate.
    pub(super) fn reflection(
        &self,
        view: &View,
        mirrored: &PlateFrame,
        publications: &[Publication],
        observer: &dyn Observer,
    ) -> Result<Option<Mirror>, RenderError> {
        let Some(mirror) = self.mirror(view, publications) else { return Ok(None) };
        let view = view.clone().with_pixel_size(mirror.pixel_size);
        let rows = mirror::mirror_rows(&view, mirror.mirror.height);
        let view = view.mirrored(mirror.mirror.height);
        let sky = self.context.sky(view.shutter.middle());
        let backdrop = mirror::backdrop(mirrored, &view, &sky);
        if !mirror.has_picture || rows.is_empty() {
            return Ok(Some(Mirror { picture: None, backdrop }));
        }
        let window = Rect { x: 0, y: rows.start, width: view.size[0], height: rows.len() };
        let view = view.with_window(window);
        let mut image = self.mirrored_phenomena(&view, mirror.index, mirrored, publications, observer)?;
        // An invisible sky lights the ground, but is not reflected in still water.
        let is_visible = self.context.plan.scene.tables.sky(view.shutter.middle()).is_none_or(|sky| sky.is_visible);
        let part = StagePart { stage: Stage::Draw, phenomenon: None, is_mirrored: true };
        let _part = PartGuard::begin(observer, part);
        if is_visible && mirrored.color.is_some() {
            mirror::composite_sky(&mut image, &view, &sky, 1, rows.start);
        }
        let picture = Reflection { image, pixel_size: mirror.pixel_size, first_row: rows.start };
        Ok(Some(Mirror { picture: Some(picture), backdrop }))
    }

    /// All phenomena but the one with the index `mirror`, as the mirrored `view` shows them in its window.
    fn mirrored_phenomena(
        &self,
        view: &View,
        mirror: usize,
        mirrored: &PlateFrame,
        publications: &[Publication],
        observer: &dyn Observer,
    ) -> Result<Image<4>, RenderError> {
        let surroundings = self.surroundings(view, publications, None);
        let others: Vec<usize> = (0..self.runs.len()).filter(|&index| index != mirror).collect();
        let runs: Vec<&ActiveRun> = others.iter().map(|&index| &self.runs[index]).collect();
        let parts = self.exposure_parts(&others, view, &surroundings, publications);
        let inputs = PreparationInputs { view, surroundings: &surroundings, parts: &parts, is_mirrored: true };
        let PreparedSlices { slices, prepared, moments } = self.prepare(&others, inputs, observer)?;
        let composition = Composition {
            outputs: Outputs::RADIANCE,
            is_mirrored: true,
            observer,
            view,
            runs: &runs,
            prepared: &prepared,
            moments: &moments,
            slices: &slices,
            plate: mirrored,
            hiding: &HidingDepth::new(&prepared, mirrored, view.size),
            // The sky is composited behind it.
            through: None,
            background: Background::plate(mirrored),
            scratches: &self.scratches,
        };
        let header = self.context.header(self.number, self.time);
        Ok(light_frame::draw_frame(&composition, header, None)?.frame.beauty)
    }
}
