//! Wishes fulfilled in slices of the window's own thread, where there is no other.

use std::time::Duration;

use bansho::{Observer, RenderError, Stage};
use std::sync::atomic::{AtomicBool, Ordering};
use web_time::Instant;

use super::{Event, Player, Wish, engine::Engine};

/// Longest stretch of simulation between two pictures of the window; drawing comes on top, and [`Pace`](super::Pace)
/// keeps that as short.
const SLICE: Duration = Duration::from_millis(40);

/// Works while it is polled.
#[derive(Default)]
pub struct SlicePlayer {
    engine: Engine,
    wish: Option<Wish>,
}

/// Stops a simulation, which goes on where it stands, when its slice is over; never a drawing, which would be lost.
struct Slice {
    began: Instant,
    advancing: AtomicBool,
}

impl Observer for Slice {
    fn begin(&self, stage: Stage) {
        if stage == Stage::Advance {
            self.advancing.store(true, Ordering::Relaxed);
        }
    }

    fn end(&self, stage: Stage) {
        if stage == Stage::Advance {
            self.advancing.store(false, Ordering::Relaxed);
        }
    }

    fn cancelled(&self) -> bool {
        self.advancing.load(Ordering::Relaxed) && self.began.elapsed() > SLICE
    }
}

impl Player for SlicePlayer {
    fn wish(&mut self, wish: Wish) {
        self.wish = Some(wish);
    }

    fn poll(&mut self) -> Vec<Event> {
        let Some(wish) = self.wish.take() else { return Vec::new() };
        let slice = Slice { began: Instant::now(), advancing: AtomicBool::new(false) };
        let mut events = Vec::new();
        match self.engine.fulfil(&wish, &slice, &mut |event| events.push(event)) {
            Ok(()) => {}
            Err(RenderError::Cancelled(_)) => self.wish = Some(wish),
            Err(error) => events.push(Event::Failed { revision: wish.revision, reason: error.to_string() }),
        }
        events
    }

    fn is_busy(&self) -> bool {
        self.wish.is_some()
    }

    fn waits_for_poll(&self) -> bool {
        self.is_busy()
    }
}
