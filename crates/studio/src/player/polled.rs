//! A player without threads, which works in time slices whenever it is polled.

use std::time::Duration;

use web_time::Instant;

use super::{Event, FrameRequest, Player, engine::Engine, interruption::Interruption};

/// Longest simulation time per poll. Drawing is added to it; [`PreviewScale`](super::PreviewScale) keeps that about as short.
const TIME_SLICE: Duration = Duration::from_millis(40);

/// A player that works while it is polled.
#[derive(Default)]
pub struct PolledPlayer {
    engine: Engine,
    request: Option<FrameRequest>,
}

impl Player for PolledPlayer {
    fn request(&mut self, request: FrameRequest) {
        self.request = Some(request);
    }

    fn poll(&mut self) -> Vec<Event> {
        let Some(request) = self.request.take() else { return Vec::new() };
        let began = Instant::now();
        let slice = Interruption::new(|advancing| advancing && began.elapsed() > TIME_SLICE);
        let mut events = Vec::new();
        match self.engine.process(&request, &slice, &mut |event| events.push(event)) {
            Ok(()) => {}
            Err(error) if error.is_stop() => self.request = Some(request),
            Err(error) => events.push(Event::Failed { revision: request.revision, reason: error.to_string() }),
        }
        events
    }

    fn is_busy(&self) -> bool {
        self.request.is_some()
    }

    fn needs_polling(&self) -> bool {
        self.is_busy()
    }
}
