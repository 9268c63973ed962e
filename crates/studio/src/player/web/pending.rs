//! The requests that a page sent to its worker and that are not finished. A worker that panics terminates, and is replaced.

use std::collections::VecDeque;

use super::reply::{Reply, WorkerMessage};
use crate::{
    document::recheck,
    player::{Event, FrameRequest},
};

/// Unfinished requests.
#[derive(Default)]
pub(super) struct Pending {
    /// With their numbers, the oldest first.
    requests: VecDeque<(u64, FrameRequest)>,
    /// Number of requests so far.
    made: u64,
    /// Number of the last finished request.
    done: u64,
    /// Whether the worker terminated while idle.
    lost: bool,
}

/// What follows from received messages.
#[derive(Default)]
pub(super) struct WorkerUpdate {
    pub(super) events: Vec<Event>,
    /// Whether the worker is ready for messages.
    pub(super) ready: bool,
    /// Whether it terminated; it must be replaced, and the newest request sent again.
    pub(super) terminated: bool,
}

impl Pending {
    /// Adds a request. Returns whether its worker is alive.
    pub(super) fn push(&mut self, request: FrameRequest) -> bool {
        self.made += 1;
        self.requests.push_back((self.made, request));
        !std::mem::take(&mut self.lost)
    }

    /// The newest unfinished request, with its number.
    pub(super) fn newest(&self) -> Option<(u64, &FrameRequest)> {
        self.requests.back().map(|(number, request)| (*number, request))
    }

    pub(super) fn is_busy(&self) -> bool {
        self.done != self.made
    }

    /// Finishes all requests: there is no worker any more.
    pub(super) fn give_up(&mut self) {
        self.finish(self.made);
    }

    /// Handles the messages received since the last call. Messages after the termination are ignored.
    pub(super) fn handle_messages(&mut self, heard: Vec<WorkerMessage>) -> WorkerUpdate {
        let mut update = WorkerUpdate::default();
        for heard in heard {
            match heard {
                WorkerMessage::Reply(Reply::Ready) => update.ready = true,
                WorkerMessage::Reply(Reply::Panicked { number, message }) => {
                    update
                        .events
                        .extend(self.worker_failed(self.request_of(number).is_some().then_some(number), message));
                    update.terminated = true;
                }
                WorkerMessage::Terminated => {
                    let message = "it ended without a word, as where memory runs out".to_owned();
                    update.events.extend(self.worker_failed(None, message));
                    update.terminated = true;
                }
                WorkerMessage::Reply(reply) => update.events.extend(self.event(reply)),
            }
            if update.terminated {
                update.terminated = !self.lost;
                break;
            }
        }
        update
    }

    fn event(&mut self, reply: Reply) -> Option<Event> {
        Some(match reply {
            Reply::Checked { number, found } => {
                let request = self.request_of(number)?;
                let outcome = recheck(&request.name, &request.text, found);
                Event::Checked { revision: request.revision, outcome }
            }
            Reply::Drawn { picture } => Event::Drawn(picture),
            Reply::Stage { stage, picture } => Event::Stage(stage, picture),
            Reply::FullQualityFrame { frame, png } => Event::FullQualityFrame { number: frame, png },
            Reply::Failed { number, reason } => Event::Failed { revision: self.request_of(number)?.revision, reason },
            Reply::Done { number } => {
                self.finish(number);
                return None;
            }
            Reply::Ready | Reply::Panicked { .. } => return None,
        })
    }

    /// The worker terminated at request `number`; without a number, at the oldest. Of newer requests the newest is kept.
    fn worker_failed(&mut self, number: Option<u64>, message: String) -> Option<Event> {
        let Some(number) = number.or_else(|| self.requests.front().map(|(number, _)| *number)) else {
            self.lost = true;
            return None;
        };
        let request = self.request_of(number)?;
        let event = Event::Panicked { revision: request.revision, number: request.number, message };
        self.finish(number);
        self.requests.drain(..self.requests.len().saturating_sub(1));
        Some(event)
    }

    fn request_of(&self, number: u64) -> Option<&FrameRequest> {
        self.requests.iter().find(|(own, _)| *own == number).map(|(_, request)| request)
    }

    fn finish(&mut self, number: u64) {
        self.done = number;
        self.requests.retain(|(own, _)| *own > number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::player::{Picture, tests::request};

    const SCENE: &str = "bansho = 2\n[[flame_sheet]]\n";

    fn panicked(number: u64) -> WorkerMessage {
        WorkerMessage::Reply(Reply::Panicked { number, message: "broken on purpose".into() })
    }

    fn said(reply: Reply) -> Vec<WorkerMessage> {
        vec![WorkerMessage::Reply(reply)]
    }

    /// The frames that panicked.
    fn broken(events: &[Event]) -> Vec<Option<i64>> {
        let number = |event: &Event| match event {
            Event::Panicked { number, .. } => Some(*number),
            _ => None,
        };
        events.iter().filter_map(number).collect()
    }

    #[test]
    fn a_worker_that_panics_ends_once() {
        let mut pending = Pending::default();
        assert!(pending.push(request(SCENE, 3)));
        // A trap follows the last words, in the same moment.
        let update = pending.handle_messages(vec![panicked(1), WorkerMessage::Terminated]);
        assert_eq!((broken(&update.events), update.terminated, pending.is_busy()), (vec![Some(3)], true, false));
        assert!(pending.push(request(SCENE, 4)), "another worker is there");
        let update = pending.handle_messages(said(Reply::Done { number: 2 }));
        assert_eq!((update.events.len(), update.terminated, pending.is_busy()), (0, false, false));
    }

    #[test]
    fn what_was_wished_for_since_is_still_to_be_had() {
        let mut pending = Pending::default();
        for number in 3..6 {
            pending.push(request(SCENE, number));
        }
        let update = pending.handle_messages(vec![panicked(1), WorkerMessage::Terminated]);
        assert_eq!(broken(&update.events), [Some(3)]);
        let newest = pending.newest().map(|(number, request)| (number, request.number));
        assert_eq!((newest, pending.is_busy()), (Some((3, Some(5))), true));
        // Nobody says over which one it ended; each is blamed once at most.
        let update = pending.handle_messages(vec![WorkerMessage::Terminated]);
        assert_eq!((broken(&update.events), pending.is_busy()), (vec![Some(5)], false));
    }

    #[test]
    fn a_worker_that_ends_idle_is_replaced_when_it_is_needed() {
        let mut pending = Pending::default();
        let update = pending.handle_messages(vec![WorkerMessage::Terminated]);
        assert!(update.events.is_empty() && !update.terminated, "else one that cannot start would be started for ever");
        assert!(!pending.push(request(SCENE, 0)));
        assert_eq!(pending.newest().map(|(number, _)| number), Some(1));
        assert!(pending.push(request(SCENE, 1)), "the other one");
        pending.give_up();
        assert!(!pending.is_busy() && pending.newest().is_none());
    }

    #[test]
    fn what_a_worker_says_of_a_wish_is_passed_on() {
        let mut pending = Pending::default();
        pending.push(request(SCENE, 7));
        let picture = Picture {
            revision: pending.requests[0].1.revision,
            number: 7,
            size: [1; 2],
            scene_size: [1; 2],
            pixels: vec![[0; 4]],
            exact: true,
            draft: false,
            draw_s: 0.0,
            advance_s: 0.0,
        };
        let heard = [
            Reply::Ready,
            Reply::Checked { number: 1, found: Ok(9.5) },
            Reply::Drawn { picture: picture.clone() },
            Reply::Stage { stage: 2, picture },
            Reply::FullQualityFrame { frame: 7, png: vec![1] },
            Reply::Failed { number: 1, reason: "no room".into() },
            Reply::Failed { number: 9, reason: "of no wish".into() },
        ];
        let update = pending.handle_messages(heard.into_iter().map(WorkerMessage::Reply).collect());
        assert!(update.ready && !update.terminated && pending.is_busy());
        let [checked, drawn, stage, full_quality, failed] = &update.events[..] else {
            panic!("{} events", update.events.len())
        };
        assert!(matches!(checked, Event::Checked { outcome: Ok(plan), .. } if plan.exposure_ev100 == 9.5));
        assert!(matches!((drawn, stage), (Event::Drawn(Picture { number: 7, .. }), Event::Stage(2, _))));
        assert!(matches!((full_quality, failed), (Event::FullQualityFrame { number: 7, .. }, Event::Failed { .. })));
    }
}
