//! One wish fulfilled: the text checked where it is new, the shot brought to the frame, the frame drawn and shown.

use std::{path::Path, sync::Arc};

use bansho::{
    AlphaConvention, Assets, BitDepth, DisplayImage, Observer, RenderError, Shot, View,
    base::image::{DisplayPixels, Frame},
    display,
    media::{
        MediaError,
        png::{self, PngEffort},
    },
    render::fingerprint,
};
use web_time::Instant;

use super::{Event, Picture, Wish, states::States};
use crate::document::{Checked, Checker, Revision, stages};

/// Why a wish is not fulfilled.
#[derive(Debug, thiserror::Error)]
pub(super) enum Unfulfilled {
    /// No picture can be drawn, or it was stopped.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The picture fits no file.
    #[error(transparent)]
    Media(#[from] MediaError),
}

impl Unfulfilled {
    /// Whether the observer asked to stop.
    pub(super) fn is_stop(&self) -> bool {
        matches!(self, Self::Render(RenderError::Cancelled(_)))
    }
}

/// What is kept from one wish to the next.
#[derive(Default)]
pub(super) struct Engine {
    /// What was judged last.
    judged: Option<Judged>,
    checker: Checker,
    /// The last good scene with its plan, at the scene's own size, and whether it is a draft.
    checked: Option<(Checked, bool)>,
    shot: Option<Opened>,
    /// Of finished pictures; each goes on from the one before.
    still: Option<(Checked, Shot)>,
    states: States,
    stages: StageShots,
}

/// A state of a document, with its assets, and whether it was judged as a draft if it could be one.
struct Judged {
    revision: Revision,
    assets: Arc<dyn Assets>,
    draft: bool,
}

/// A shot, with the plan and the size that it was last planned for.
struct Opened {
    shot: Shot,
    of: Checked,
    size: [usize; 2],
}

impl Engine {
    /// Fulfils `wish` and tells `emit` what came of it. Stops when `observer` says so; another call then goes on.
    ///
    /// # Errors
    /// No picture can be drawn or made a file, or the observer asked to stop.
    pub(super) fn fulfil(
        &mut self,
        wish: &Wish,
        observer: &dyn Observer,
        emit: &mut dyn FnMut(Event),
    ) -> Result<(), Unfulfilled> {
        let draft = wish.draft && !wish.exact && !wish.still;
        let Wish { name, text, assets, .. } = wish;
        let same =
            |last: &Judged| (last.revision, last.draft) == (wish.revision, draft) && Arc::ptr_eq(&last.assets, assets);
        if !self.judged.as_ref().is_some_and(same) {
            let drafted = if draft { self.checker.check_draft(name, text, assets) } else { None };
            let is_draft = drafted.is_some();
            let outcome = drafted.unwrap_or_else(|| self.checker.check(name, text, assets));
            self.judged = Some(Judged { revision: wish.revision, assets: assets.clone(), draft });
            if let Ok(checked) = &outcome {
                self.checked = Some((checked.clone(), is_draft));
            }
            emit(Event::Judged { revision: wish.revision, outcome: outcome.map(|checked| checked.plan) });
        }
        let Some((checked, draft)) = self.checked.clone() else { return Ok(()) };
        if wish.still {
            let number = wish.number.unwrap_or(checked.plan.frames().start);
            emit(Event::Still { number, png: self.finish(&checked, number, observer)? });
            return Ok(());
        }
        let picture = self.draw(&checked, wish, observer)?;
        emit(Event::Drawn(Picture { draft, ..picture }));
        if let Some(sheet) = wish.stages {
            self.stages.turn_to(&checked, sheet, wish);
            for (stage, opened) in self.stages.shots.iter_mut().enumerate() {
                let picture =
                    opened.draw(wish, wish.number.unwrap_or(checked.plan.frames().start), &mut None, observer)?;
                emit(Event::Stage(stage, picture));
            }
        }
        Ok(())
    }

    /// Forgets the shot, as after a panic in it.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn forget(&mut self) {
        *self = Self { judged: self.judged.take(), checked: self.checked.take(), ..Self::default() };
    }

    /// The file of the finished frame `number`. Where it was stopped, or the last one ended, it goes on.
    fn finish(&mut self, checked: &Checked, number: i64, observer: &dyn Observer) -> Result<Vec<u8>, Unfulfilled> {
        let begun = self.still.take().filter(|(of, _)| Arc::ptr_eq(&of.plan, &checked.plan));
        let (_, shot) = self.still.insert(match begun {
            Some(begun) => begun,
            None => (checked.clone(), Shot::open(checked.compiled.clone(), checked.plan.clone())),
        });
        let frame = bansho::draw(shot, number, observer)?;
        let png = encoded(&frame);
        shot.recycle(frame);
        Ok(png?)
    }

    fn draw(&mut self, checked: &Checked, wish: &Wish, observer: &dyn Observer) -> Result<Picture, RenderError> {
        let number = wish.number.unwrap_or(checked.plan.frames().start);
        let size = fitted(checked.plan.size(), wish.within);
        let opened = open(&mut self.shot, checked, size, wish.exact);
        opened.draw(wish, number, &mut Some(&mut self.states), observer)
    }
}

impl Opened {
    /// Draws frame `number`, by way of the nearest of `states` where there are any.
    fn draw(
        &mut self,
        wish: &Wish,
        number: i64,
        states: &mut Option<&mut States>,
        observer: &dyn Observer,
    ) -> Result<Picture, RenderError> {
        let Self { shot, of, size } = self;
        let began = Instant::now();
        states.iter_mut().for_each(|states| states.seek(&of.compiled, shot, number));
        shot.advance(number, observer)?;
        states.iter_mut().for_each(|states| states.keep(&of.compiled, shot, number));
        let advanced = Instant::now();
        shot.draw(observer)?;
        let mut frame = shot.read().ok_or(RenderError::Cancelled(bansho::Cancelled))?;
        let pixels = shown(&mut frame);
        shot.recycle(frame);
        Ok(Picture {
            revision: wish.revision,
            number,
            size: *size,
            scene_size: of.plan.size(),
            pixels,
            exact: shot.is_exact(),
            draft: false,
            draw_s: advanced.elapsed().as_secs_f64(),
            advance_s: advanced.duration_since(began).as_secs_f64(),
        })
    }
}

/// Shots of the stages of a flame sheet.
#[derive(Default)]
struct StageShots {
    /// Of which plan and which sheet.
    of: Option<(Checked, usize)>,
    shots: Vec<Opened>,
}

impl StageShots {
    fn turn_to(&mut self, checked: &Checked, sheet: usize, wish: &Wish) {
        if self.of.as_ref().is_some_and(|(of, own)| Arc::ptr_eq(&of.plan, &checked.plan) && *own == sheet) {
            return;
        }
        // Of a text with faults there are none; the last pictures stay.
        let plans = stages::plans(&wish.name, &wish.text, &wish.assets, sheet).unwrap_or_default();
        let open =
            |of: Checked| Opened { shot: Shot::open(of.compiled.clone(), of.plan.clone()), size: of.plan.size(), of };
        self.shots = plans.into_iter().map(open).collect();
        self.of = Some((checked.clone(), sheet));
    }
}

/// The shot of a scene at `size`: the one there is where it can go on, else a new one.
fn open<'a>(slot: &'a mut Option<Opened>, checked: &Checked, size: [usize; 2], exact: bool) -> &'a mut Opened {
    let is_of = |opened: &Opened| Arc::ptr_eq(&opened.of.plan, &checked.plan);
    let usable = slot.take().filter(|opened| !exact || (opened.shot.is_exact() && is_of(opened)));
    let (compiled, plan) = (checked.compiled.clone(), || Arc::new(checked.plan.at_size(size)));
    let opened = match usable {
        None => Opened { shot: Shot::open(compiled, plan()), of: checked.clone(), size },
        Some(opened) if is_of(&opened) && opened.size == size => opened,
        Some(mut opened) => {
            opened.shot.replan(compiled, plan());
            Opened { of: checked.clone(), size, ..opened }
        }
    };
    slot.insert(opened)
}

/// The largest size of `size`'s proportions that fits `within`; `size` itself where that does.
fn fitted(size: [usize; 2], within: [usize; 2]) -> [usize; 2] {
    let ratio = |axis: usize| within[axis] as f64 / size[axis] as f64;
    let scale = ratio(0).min(ratio(1)).min(1.0);
    size.map(|side| ((side as f64 * scale).round() as usize).max(1))
}

/// The frame over black: premultiplied light over black is the light itself.
fn shown(frame: &mut Frame) -> Vec<[u8; 4]> {
    let opaque = std::mem::replace(&mut frame.opaque, true);
    let DisplayImage { pixels, .. } = display(frame, &View::DISPLAY, BitDepth::Eight, AlphaConvention::Encoded);
    frame.opaque = opaque;
    match pixels {
        DisplayPixels::Eight(pixels) => pixels,
        DisplayPixels::Sixteen(pixels) => pixels.into_iter().map(|pixel| pixel.map(|code| (code >> 8) as u8)).collect(),
    }
}

/// The frame as `bansho render` writes it unless it is told otherwise.
fn encoded(frame: &Frame) -> Result<Vec<u8>, MediaError> {
    let shown = display(frame, &View::DISPLAY, BitDepth::Eight, AlphaConvention::Encoded);
    let fingerprint = fingerprint::of_png(frame.header.fingerprint, BitDepth::Eight, AlphaConvention::Encoded);
    png::encode(&shown, &fingerprint, PngEffort::default(), Path::new("still.png"))
}

#[cfg(test)]
mod tests {
    use bansho::base::image::Image;

    use super::*;

    #[test]
    fn a_picture_that_fits_no_file_is_told_of() {
        let assets: Arc<dyn Assets> = Arc::new(bansho::MemoryAssets::default());
        let checked = crate::document::check("scene", "bansho = 1\n[picture]\nsize = [8, 4]\n", &assets).unwrap();
        let mut shot = Shot::open(checked.compiled, checked.plan);
        let mut frame = bansho::draw(&mut shot, 0, &bansho::Unobserved).unwrap();
        assert!(encoded(&frame).unwrap().starts_with(b"\x89PNG"));
        frame.beauty = Image::filled(png::SIDE_LIMIT + 1, 1, [0.0; 4]);
        assert!(matches!(encoded(&frame), Err(MediaError::Size { .. })));
    }
}
