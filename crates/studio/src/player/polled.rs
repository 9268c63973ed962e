//! Wishes fulfilled in slices of the caller's own thread.

use std::time::Duration;

use web_time::Instant;

use super::{Event, Player, Wish, engine::Engine, interruption::Interruption};

/// Longest stretch of simulation between two looks at what else is wanted; drawing comes on top, and
/// [`Pace`](super::Pace) keeps that as short.
const SLICE: Duration = Duration::from_millis(40);

/// Works while it is polled.
#[derive(Default)]
pub struct SlicePlayer {
    engine: Engine,
    wish: Option<Wish>,
}

impl Player for SlicePlayer {
    fn wish(&mut self, wish: Wish) {
        self.wish = Some(wish);
    }

    fn poll(&mut self) -> Vec<Event> {
        let Some(wish) = self.wish.take() else { return Vec::new() };
        let began = Instant::now();
        let slice = Interruption::new(|advancing| advancing && began.elapsed() > SLICE);
        let mut events = Vec::new();
        match self.engine.fulfil(&wish, &slice, &mut |event| events.push(event)) {
            Ok(()) => {}
            Err(error) if error.is_stop() => self.wish = Some(wish),
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
