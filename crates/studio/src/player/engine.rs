//! One wish fulfilled: the text checked where it is new, the shot brought to the frame, the frame drawn and shown.

use std::sync::Arc;

use bansho::{
    Assets, Backend, BitDepth, CpuBackend, DisplayImage, Observer, Plan, RenderError, Shot, View,
    base::image::{DisplayPixels, Frame, Rect},
    display,
};
use web_time::Instant;

use super::{Event, Picture, Wish, states::States};
use crate::document::{Revision, check, check_draft};

/// What is kept from one wish to the next.
#[derive(Default)]
pub(super) struct Engine {
    /// Which state was judged with which assets, and whether as a draft if it could be one.
    judged: Option<(Revision, Arc<dyn Assets>, bool)>,
    /// The last good plan, at the scene's own size, and whether it is a draft.
    plan: Option<(Arc<Plan>, bool)>,
    shot: Option<Opened>,
    states: States,
}

/// A shot, with the plan and the size that it was last planned for.
struct Opened {
    shot: Box<dyn Shot>,
    of: Arc<Plan>,
    size: [usize; 2],
}

impl Engine {
    /// Fulfils `wish` and tells `emit` what came of it. Stops when `observer` says so; another call then goes on.
    ///
    /// # Errors
    /// No picture can be drawn, or the observer asked to stop.
    pub(super) fn fulfil(
        &mut self,
        wish: &Wish,
        observer: &dyn Observer,
        emit: &mut dyn FnMut(Event),
    ) -> Result<(), RenderError> {
        let draft = wish.draft && !wish.exact;
        let Wish { name, text, assets, .. } = wish;
        let same = |(revision, own, as_draft): &(Revision, Arc<dyn Assets>, bool)| {
            (*revision, *as_draft) == (wish.revision, draft) && Arc::ptr_eq(own, assets)
        };
        if !self.judged.as_ref().is_some_and(same) {
            let drafted = if draft { check_draft(name, text, assets) } else { None };
            let is_draft = drafted.is_some();
            let outcome = drafted.unwrap_or_else(|| check(name, text, assets));
            self.judged = Some((wish.revision, assets.clone(), draft));
            if let Ok(plan) = &outcome {
                self.plan = Some((plan.clone(), is_draft));
            }
            emit(Event::Judged { revision: wish.revision, outcome });
        }
        let Some((plan, draft)) = self.plan.clone() else { return Ok(()) };
        let picture = self.draw(&plan, wish, observer)?;
        emit(Event::Drawn(Picture { draft, ..picture }));
        Ok(())
    }

    /// Forgets the shot, as after a panic in it.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn forget(&mut self) {
        *self = Self { judged: self.judged.take(), plan: self.plan.take(), ..Self::default() };
    }

    fn draw(&mut self, plan: &Arc<Plan>, wish: &Wish, observer: &dyn Observer) -> Result<Picture, RenderError> {
        let number = wish.number.unwrap_or(plan.frames().start);
        let size = fitted(plan.size, wish.within);
        let opened = open(&mut self.shot, plan, size, wish.exact)?;
        let began = Instant::now();
        self.states.seek(plan, opened.shot.as_mut(), number);
        opened.shot.advance(number, observer)?;
        self.states.keep(plan, opened.shot.as_ref(), number);
        let advanced = Instant::now();
        opened.shot.draw(observer)?;
        let mut frame = opened.shot.read().ok_or(RenderError::Cancelled(bansho::Cancelled))?;
        let pixels = shown(&mut frame);
        let exact = opened.shot.is_exact();
        opened.shot.recycle(frame);
        Ok(Picture {
            revision: wish.revision,
            number,
            size,
            scene_size: plan.size,
            pixels,
            exact,
            draft: false,
            draw_s: advanced.elapsed().as_secs_f64(),
            advance_s: advanced.duration_since(began).as_secs_f64(),
        })
    }
}

/// The shot of `plan` at `size`: the one there is where it can go on, else a new one.
fn open<'a>(
    slot: &'a mut Option<Opened>,
    plan: &Arc<Plan>,
    size: [usize; 2],
    exact: bool,
) -> Result<&'a mut Opened, RenderError> {
    let usable = slot.take().filter(|opened| !exact || (opened.shot.is_exact() && Arc::ptr_eq(&opened.of, plan)));
    let opened = match usable {
        None => Opened { shot: CpuBackend.open(sized(plan, size))?, of: plan.clone(), size },
        Some(opened) if Arc::ptr_eq(&opened.of, plan) && opened.size == size => opened,
        Some(mut opened) => {
            opened.shot.replan(sized(plan, size))?;
            Opened { of: plan.clone(), size, ..opened }
        }
    };
    Ok(slot.insert(opened))
}

/// The plan for a window: without what lies beyond the picture, and smaller where the window is.
fn sized(plan: &Plan, size: [usize; 2]) -> Arc<Plan> {
    let mut plan = plan.clone();
    plan.scene.picture.overscan = 0;
    plan.size = size;
    plan.window = Rect::of_size(size[0], size[1]);
    Arc::new(plan)
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
    let DisplayImage { pixels, .. } = display(frame, &View::DISPLAY, BitDepth::Eight);
    frame.opaque = opaque;
    match pixels {
        DisplayPixels::Eight(pixels) => pixels,
        DisplayPixels::Sixteen(pixels) => pixels.into_iter().map(|pixel| pixel.map(|code| (code >> 8) as u8)).collect(),
    }
}
