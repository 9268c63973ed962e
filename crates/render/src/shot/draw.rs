//! Drawing the frame that a shot was advanced to.

use std::sync::Arc;

use bansho_base::{
    frame::{Channel, Frame, PhenomenonMetadata},
    host::observer::{self, Cancelled, Observer, Stage, StageGuard},
    image::Rect,
    phenomenon::{Prepared, strip::View, surroundings::Publication},
};

use super::{PreparationInputs, PreparedSlices, RenderError, Shot, reflection::SceneMirror};
use crate::{
    compiled::ActiveRun,
    composite::{
        background::Background,
        composition::{Composition, Outputs},
        glare::{self, PointSpread},
        hiding::HidingDepth,
        plate::PlateFrame,
    },
    context::ShotContext,
    target::{Drawing, SceneLinear, Target, WithoutGlare},
};

impl Shot {
    /// Draws the frame that the shot was advanced to, as `target` says: as scene-linear light ([`SceneLinear`]), or as display codes
    /// ([`DisplayOptions`](crate::display::DisplayOptions)).
    ///
    /// # Errors
    /// The observer asked to stop, or the plate cannot be read.
    pub fn draw<T: Target>(&mut self, target: &T, observer: &dyn Observer) -> Result<T::Frame, RenderError> {
        let mut plate = {
            let _stage = StageGuard::begin(observer, Stage::Load);
            let ShotContext { compiled, plan, .. } = &self.context;
            let plate = self.plates.frame(compiled, plan, self.number);
            plate.map_err(|error| RenderError::Plate(Box::new(error)))?
        };
        let view = self.context.plan.view_at(self.time);
        let preparing = StageGuard::begin(observer, Stage::Prepare);
        let publications = self.publications(view.shutter, observer);
        if plate.surface.is_some() {
            drop(plate);
            plate = self.lit_plate(view.shutter, &publications, observer)?;
        }
        let mirrored = match self.mirror(&view, &publications) {
            Some(SceneMirror { mirror, pixel_size, .. }) => {
                self.plates.mirrored(&self.context.plan, &plate, mirror, pixel_size, observer)?
            }
            None => Arc::default(),
        };
        drop(preparing);
        let pictures = FramePictures { plate: &plate, mirrored: &mirrored, publications: &publications };
        if let Some(spread) = PointSpread::new(self.context.plan.glare, view.camera.focal_pixels) {
            let light = self.draw_with_glare(&view, &spread, pictures, observer)?;
            let _stage = StageGuard::begin(observer, Stage::View);
            return Ok(target.of_light(light, &mut self.recycled));
        }
        let mut recycled = self.recycled.take();
        let drawn = self.draw_view(&view, pictures, target, &mut recycled, observer);
        self.recycled = recycled;
        if let Some(frame) = drawn? {
            return Ok(frame);
        }
        let whole = self.draw_view(&view.with_whole_window(), pictures, &SceneLinear, &mut None, observer)?;
        let window = crop(whole.ok_or(Cancelled)?, self.context.plan.window).ok_or(Cancelled)?;
        Ok(target.of_light(window, &mut None))
    }

    /// Draws the light of the view with the glare of the camera. It comes from around the view's window too.
    fn draw_with_glare(
        &mut self,
        view: &View,
        spread: &PointSpread,
        pictures: FramePictures,
        observer: &dyn Observer,
    ) -> Result<Frame, RenderError> {
        let mut drawn_view = glare::source_view(spread, view);
        let mut recycled = self.recycled.take();
        let drawn = self.draw_view(&drawn_view, pictures, &WithoutGlare, &mut recycled, observer)?;
        let mut light = match drawn {
            Some(light) => light,
            None => {
                drawn_view = view.with_whole_window();
                self.draw_view(&drawn_view, pictures, &WithoutGlare, &mut None, observer)?.ok_or(Cancelled)?
            }
        };
        let _stage = StageGuard::begin(observer, Stage::Draw);
        glare::add(&mut light, spread, &drawn_view, self.context.plan.layers, &mut self.pyramid);
        if drawn_view.window == view.window {
            return Ok(light.frame);
        }
        let [left, top] = [drawn_view.window.x, drawn_view.window.y];
        let window = Rect { x: view.window.x - left, y: view.window.y - top, ..view.window };
        Ok(crop(light.frame, window).ok_or(Cancelled)?)
    }

    /// Draws the view. `None` if its window is not the whole picture and light is refracted: it may come from outside the window, so the whole
    /// picture must be drawn and cropped.
    fn draw_view<T: Target>(
        &self,
        view: &View,
        FramePictures { plate, mirrored, publications }: FramePictures,
        target: &T,
        recycled: &mut Option<Frame>,
        observer: &dyn Observer,
    ) -> Result<Option<T::Frame>, RenderError> {
        let preparing = StageGuard::begin(observer, Stage::Prepare);
        let reflection = self.reflection(view, mirrored, publications, observer)?;
        let surroundings = self.surroundings(view, publications, reflection.as_ref());
        let all: Vec<usize> = (0..self.runs.len()).collect();
        let runs: Vec<&ActiveRun> = self.runs.iter().collect();
        let parts = self.exposure_parts(&all, view, &surroundings, publications);
        let inputs = PreparationInputs { view, surroundings: &surroundings, parts: &parts, is_mirrored: false };
        let PreparedSlices { slices, prepared, moments } = self.prepare(&all, inputs, observer)?;
        drop(preparing);
        let _stage = StageGuard::begin(observer, Stage::Draw);
        observer::check(observer)?;
        // Only what is behind refracting air is refracted.
        let has_background = plate.color.is_some() || self.runs.len() > 1;
        let is_whole = view.window == Rect::from_size(view.size[0], view.size[1]);
        // Also if nothing in the window is refracted: compositing in groups of slices rounds all pixels differently.
        if !is_whole && has_background && prepared.iter().any(|prepared| prepared.may_refract()) {
            // It has the size of the window, and would only take memory while the whole picture is drawn.
            *recycled = None;
            return Ok(None);
        }
        let is_refracted = has_background && prepared.iter().any(|prepared| prepared.deflection().is_some());
        let outputs = Outputs::of_plan(&self.context.plan);
        let through = HidingDepth::through(&prepared, plate, view.size);
        let composition = Composition {
            // What is nearer than refracting air is not refracted.
            outputs: Outputs {
                depth: outputs.depth || is_refracted,
                plate_apart: self.context.plan.glare > 0.0 && plate.color.is_some(),
                ..outputs
            },
            is_mirrored: false,
            observer,
            view,
            runs: &runs,
            prepared: &prepared,
            moments: &moments,
            slices: &slices,
            plate,
            hiding: &HidingDepth::new(&prepared, plate, view.size),
            through: through.as_ref(),
            background: Background::plate(plate),
            scratches: &self.scratches,
        };
        let header = self.context.header(self.number, self.time);
        let metadata = if self.context.plan.metadata { self.metadata(&prepared) } else { Vec::new() };
        let drawing = Drawing { composition: &composition, is_refracted, header, metadata };
        Ok(Some(target.draw(drawing, recycled)?))
    }

    /// The metadata of every phenomenon that has any.
    fn metadata(&self, prepared: &[Box<dyn Prepared + '_>]) -> Vec<PhenomenonMetadata> {
        let names = self.runs.iter().map(|run| run.info().name.to_owned());
        let each = names.zip(prepared.iter().map(|prepared| prepared.metadata()));
        each.filter(|(_, entries)| !entries.is_empty())
            .map(|(phenomenon, entries)| PhenomenonMetadata { phenomenon, entries })
            .collect()
    }
}

/// What a frame is drawn from, besides the state of the simulations.
#[derive(Clone, Copy)]
struct FramePictures<'a> {
    plate: &'a PlateFrame,
    /// The plate as seen in the mirror.
    mirrored: &'a PlateFrame,
    publications: &'a [Publication],
}

/// The region `window` of a plane whose rows are `width` long.
fn crop_plane(values: &[f32], width: usize, window: Rect) -> Vec<f32> {
    let mut cropped = Vec::with_capacity(window.width * window.height);
    for y in window.y..window.bottom() {
        cropped.extend_from_slice(&values[y * width + window.x..][..window.width]);
    }
    cropped
}

/// The region `window` of a whole frame.
fn crop(whole: Frame, window: Rect) -> Option<Frame> {
    let (width, beauty) = (whole.beauty.width(), whole.beauty.crop(window)?);
    let mut channels = Vec::with_capacity(whole.channels.len());
    for channel in whole.channels {
        channels.push(Channel { values: crop_plane(&channel.values, width, window), ..channel });
    }
    Some(Frame {
        beauty,
        depth: whole.depth.map(|depth| crop_plane(&depth, width, window)),
        channels,
        header: whole.header,
        opaque: whole.opaque,
        metadata: whole.metadata,
        content: Rect::from_size(window.width, window.height),
    })
}
