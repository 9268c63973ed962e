//! Serves one request: checks the text if it is new, advances the shot to the frame, draws it and converts it to display pixels.

use std::{path::Path, sync::Arc};

use bansho::{
    Assets, DisplayFrame, DisplayImage, DisplayOptions, Observer, Plan, RenderError, Shot,
    base::frame::DisplayPixels,
    media::{
        MediaError,
        png::{self, PngEffort},
    },
    render::fingerprint,
};

use super::{Event, FrameRequest, Picture, snapshot_cache::SnapshotCache};
use crate::document::{Checker, PhenomenonId, PlannedScene, Revision, stages};
use web_time::Instant;

/// Why a request has no picture.
#[derive(Debug, thiserror::Error)]
pub(super) enum RequestError {
    /// No picture can be drawn, or it was stopped.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The picture cannot be encoded as a PNG.
    #[error(transparent)]
    Media(#[from] MediaError),
}

impl RequestError {
    /// Whether the observer asked to stop.
    pub(super) fn is_stop(&self) -> bool {
        matches!(self, Self::Render(RenderError::Cancelled(_)))
    }
}

/// The state that is kept between requests.
#[derive(Default)]
pub(super) struct Engine {
    /// The last check.
    checked: Option<Checked>,
    checker: Checker,
    /// The last valid scene.
    current: Option<CurrentScene>,
    shot: Option<OpenShot>,
    /// The shot of full-quality frames; each continues from the frame before.
    full_quality: Option<(PlannedScene, Shot)>,
    snapshots: SnapshotCache,
    stages: StageShots,
}

/// The inputs of a check.
struct Checked {
    revision: Revision,
    assets: Arc<dyn Assets>,
    /// Whether a draft was requested.
    draft: bool,
}

/// A valid scene, planned at its own size.
#[derive(Clone)]
struct CurrentScene {
    scene: PlannedScene,
    is_draft: bool,
}

/// An open shot, with the plan and the size that it was last planned for.
struct OpenShot {
    shot: Shot,
    scene: PlannedScene,
    size: [usize; 2],
}

impl OpenShot {
    /// Whether this is the shot of `scene`, whose plan every check makes anew.
    fn is_of(&self, scene: &PlannedScene) -> bool {
        Arc::ptr_eq(&self.scene.plan, &scene.plan)
    }
}

impl Engine {
    /// Serves `request` and reports to `emit`. Stops when `observer` cancels; another call then continues.
    ///
    /// # Errors
    /// No picture can be drawn or encoded as a PNG, or the observer asked to stop.
    pub(super) fn process(
        &mut self,
        request: &FrameRequest,
        observer: &dyn Observer,
        emit: &mut dyn FnMut(Event),
    ) -> Result<(), RequestError> {
        let draft = request.draft && !request.exact && !request.full_quality;
        let FrameRequest { name, text, assets, .. } = request;
        let is_checked = self.checked.as_ref().is_some_and(|last| {
            (last.revision, last.draft) == (request.revision, draft) && Arc::ptr_eq(&last.assets, assets)
        });
        if !is_checked {
            let drafted = if draft { self.checker.check_draft(name, text, assets) } else { None };
            let is_draft = drafted.is_some();
            let outcome = drafted.unwrap_or_else(|| self.checker.check(name, text, assets));
            self.checked = Some(Checked { revision: request.revision, assets: assets.clone(), draft });
            if let Ok(scene) = &outcome {
                self.current = Some(CurrentScene { scene: scene.clone(), is_draft });
            }
            emit(Event::Checked { revision: request.revision, outcome: outcome.map(|scene| scene.plan) });
        }
        let Some(CurrentScene { scene, is_draft }) = self.current.clone() else { return Ok(()) };
        if request.full_quality {
            let number = request.number.unwrap_or(scene.plan.frames().start);
            emit(Event::FullQualityFrame { number, png: self.full_quality_png(&scene, number, observer)? });
            return Ok(());
        }
        let picture = self.draw(&scene, request, observer)?;
        emit(Event::Drawn(Picture { draft: is_draft, ..picture }));
        if let Some(phenomenon) = request.stages {
            self.stages.set_scene(&scene, phenomenon, request);
            for (stage, opened) in self.stages.shots.iter_mut().enumerate() {
                let picture =
                    opened.draw(request, request.number.unwrap_or(scene.plan.frames().start), &mut None, observer)?;
                emit(Event::Stage(stage, picture));
            }
        }
        Ok(())
    }

    /// Discards the shots after a panic in one.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn reset_after_panic(&mut self) {
        *self = Self { checked: self.checked.take(), current: self.current.take(), ..Self::default() };
    }

    /// The full-quality frame `number` as a PNG. It continues a cancelled frame, or from the frame before.
    fn full_quality_png(
        &mut self,
        scene: &PlannedScene,
        number: i64,
        observer: &dyn Observer,
    ) -> Result<Vec<u8>, RequestError> {
        let open = self.full_quality.take().filter(|(own, _)| Arc::ptr_eq(&own.plan, &scene.plan));
        let (_, shot) = self.full_quality.insert(match open {
            Some(open) => open,
            None => (scene.clone(), Shot::open(scene.compiled.clone(), scene.plan.clone())),
        });
        shot.advance(number, observer)?;
        Ok(encode_png(&shot.draw(&still(&scene.plan), observer)?)?)
    }

    fn draw(
        &mut self,
        scene: &PlannedScene,
        request: &FrameRequest,
        observer: &dyn Observer,
    ) -> Result<Picture, RenderError> {
        let number = request.number.unwrap_or(scene.plan.frames().start);
        let size = fit_within(scene.plan.size(), request.within);
        let opened = open_or_replan(&mut self.shot, scene, size, request.exact);
        opened.draw(request, number, &mut Some(&mut self.snapshots), observer)
    }
}

impl OpenShot {
    /// Draws frame `number`, from the nearest of `snapshots` if there are any.
    fn draw(
        &mut self,
        request: &FrameRequest,
        number: i64,
        snapshots: &mut Option<&mut SnapshotCache>,
        observer: &dyn Observer,
    ) -> Result<Picture, RenderError> {
        let Self { shot, scene, size } = self;
        let began = Instant::now();
        snapshots.iter_mut().for_each(|snapshots| snapshots.seek(&scene.compiled, shot, number));
        shot.advance(number, observer)?;
        snapshots.iter_mut().for_each(|snapshots| snapshots.store(&scene.compiled, shot, number));
        let advanced = Instant::now();
        let preview = DisplayOptions { over_black: true, ..still(&scene.plan) };
        let pixels = eight_bits(shot.draw(&preview, observer)?.image);
        Ok(Picture {
            revision: request.revision,
            number,
            size: *size,
            scene_size: scene.plan.size(),
            pixels,
            exact: shot.is_exact(),
            draft: false,
            draw_s: advanced.elapsed().as_secs_f64(),
            advance_s: advanced.duration_since(began).as_secs_f64(),
        })
    }
}

/// Shots of the stages of a phenomenon.
#[derive(Default)]
struct StageShots {
    /// The scene, and the phenomenon in it.
    source: Option<(PlannedScene, PhenomenonId)>,
    shots: Vec<OpenShot>,
}

impl StageShots {
    fn set_scene(&mut self, scene: &PlannedScene, phenomenon: PhenomenonId, request: &FrameRequest) {
        let is_same =
            |(own, id): &(PlannedScene, PhenomenonId)| Arc::ptr_eq(&own.plan, &scene.plan) && *id == phenomenon;
        if self.source.as_ref().is_some_and(is_same) {
            return;
        }
        // A text with errors has no plans; the last pictures stay.
        let plans = stages::plans(&request.name, &request.text, &request.assets, phenomenon).unwrap_or_default();
        let shots = plans.into_iter().map(|scene| OpenShot {
            shot: Shot::open(scene.compiled.clone(), scene.plan.clone()),
            size: scene.plan.size(),
            scene,
        });
        self.shots = shots.collect();
        self.source = Some((scene.clone(), phenomenon));
    }
}

/// The shot of `scene` at `size`: the open one if it can continue, else a new one.
fn open_or_replan<'a>(
    slot: &'a mut Option<OpenShot>,
    scene: &PlannedScene,
    size: [usize; 2],
    exact: bool,
) -> &'a mut OpenShot {
    // A shot that went on from another scene is not that of this one, so that it does not do where exact frames are wanted.
    let usable = slot.take().filter(|opened| !exact || (opened.shot.is_exact() && opened.is_of(scene)));
    let opened = match usable {
        Some(opened) if opened.is_of(scene) && opened.size == size => opened,
        usable => {
            let (compiled, plan) = (scene.compiled.clone(), Arc::new(scene.plan.at_size(size)));
            let shot = match usable {
                None => Shot::open(compiled, plan),
                Some(mut opened) => {
                    opened.shot.replan(compiled, plan);
                    opened.shot
                }
            };
            OpenShot { shot, scene: scene.clone(), size }
        }
    };
    slot.insert(opened)
}

/// The largest size with the aspect ratio of `size` that fits `within`; never larger than `size`.
fn fit_within(size: [usize; 2], within: [usize; 2]) -> [usize; 2] {
    let [across, down] = [0, 1].map(|axis| within[axis] as f64 / size[axis] as f64);
    let scale = across.min(down).min(1.0);
    size.map(|side| ((side as f64 * scale).round() as usize).max(1))
}

/// A still as `bansho render` draws it for a PNG by default.
fn still(plan: &Plan) -> DisplayOptions {
    DisplayOptions { view: plan.display, ..DisplayOptions::default() }
}

/// The pixels of a picture with 8 bits.
fn eight_bits(image: DisplayImage) -> Vec<[u8; 4]> {
    match image.pixels {
        DisplayPixels::Eight(pixels) => pixels,
        DisplayPixels::Sixteen(pixels) => pixels.into_iter().map(|pixel| pixel.map(|code| (code >> 8) as u8)).collect(),
    }
}

/// The frame as a PNG with the default options of `bansho render`.
fn encode_png(frame: &DisplayFrame) -> Result<Vec<u8>, MediaError> {
    let DisplayOptions { depth, alpha, .. } = DisplayOptions::default();
    let fingerprint = fingerprint::of_png(frame.header.fingerprint, depth, alpha);
    png::encode(&frame.image, &fingerprint, PngEffort::default(), Path::new("still.png"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_too_large_for_a_png_is_an_error() {
        let assets: Arc<dyn Assets> = Arc::new(bansho::MemoryAssets::default());
        let scene = crate::document::check("scene", "bansho = 2\n[picture]\nsize = [8, 4]\n", &assets).unwrap();
        let options = still(&scene.plan);
        let mut shot = Shot::open(scene.compiled, scene.plan);
        let mut frame = shot.draw(&options, &bansho::Unobserved).unwrap();
        assert!(encode_png(&frame).unwrap().starts_with(b"\x89PNG"));
        let [width, height] = [png::SIDE_LIMIT + 1, 1];
        frame.image = DisplayImage { width, height, pixels: DisplayPixels::Eight(vec![[0; 4]; width]), ..frame.image };
        assert!(matches!(encode_png(&frame), Err(MediaError::Size { .. })));
    }
}
