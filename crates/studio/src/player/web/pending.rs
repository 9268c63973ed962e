//! The unfinished requests of a page to its worker, and what the worker replies. A worker that panics terminates and is replaced.

use std::collections::VecDeque;

use crate::{
    document::{CheckReport, plan_from_report},
    player::{Event, FrameRequest, Picture},
};

/// A message of the worker.
pub(super) enum Reply {
    /// It is ready for messages.
    Ready,
    /// The scene of request `number` was checked.
    Checked { number: u64, report: CheckReport },
    /// A preview.
    Drawn { picture: Picture },
    /// A small picture of a stage.
    Stage { stage: usize, picture: Picture },
    /// A full-quality frame as a PNG.
    FullQualityFrame { frame: i64, png: Vec<u8> },
    /// Request `number` failed.
    Failed { number: u64, reason: String },
    /// A phenomenon panicked while request `number` was served. The worker has terminated.
    Panicked { number: u64, message: String },
    /// Request `number` is finished.
    Done { number: u64 },
}

/// What the page receives from a worker.
pub(super) enum WorkerMessage {
    Reply(Reply),
    /// It terminated: without a message, as when out of memory, or after it reported a panic.
    Terminated,
}

/// Unfinished requests.
#[derive(Default)]
pub(super) struct Pending {
    /// With their numbers, the oldest first.
    requests: VecDeque<(u64, FrameRequest)>,
    /// Number of the newest request; the first has number 1.
    newest_number: u64,
    /// Number of the last finished request.
    finished_number: u64,
    /// Whether the worker terminated while idle.
    lost: bool,
}

/// The effects of received messages.
#[derive(Default)]
pub(super) struct WorkerUpdate {
    pub(super) events: Vec<Event>,
    /// Whether the worker is ready for messages.
    pub(super) ready: bool,
    /// Whether it terminated; it must be replaced, and the newest request sent again.
    pub(super) terminated: bool,
}

impl Pending {
    /// Adds a request. Returns whether the worker is alive.
    pub(super) fn push(&mut self, request: FrameRequest) -> bool {
        self.newest_number += 1;
        self.requests.push_back((self.newest_number, request));
        !std::mem::take(&mut self.lost)
    }

    /// The newest unfinished request, with its number.
    pub(super) fn newest(&self) -> Option<(u64, &FrameRequest)> {
        self.requests.back().map(|(number, request)| (*number, request))
    }

    pub(super) fn is_busy(&self) -> bool {
        self.finished_number != self.newest_number
    }

    /// Finishes all requests: there is no worker any more.
    pub(super) fn finish_all(&mut self) {
        self.finish(self.newest_number);
    }

    /// Handles the messages received since the last call. Messages after the termination are ignored.
    pub(super) fn handle_messages(&mut self, messages: Vec<WorkerMessage>) -> WorkerUpdate {
        let mut update = WorkerUpdate::default();
        for message in messages {
            match message {
                WorkerMessage::Reply(Reply::Ready) => update.ready = true,
                WorkerMessage::Reply(Reply::Panicked { number, message }) => {
                    update
                        .events
                        .extend(self.worker_failed(self.request_of(number).is_some().then_some(number), message));
                    update.terminated = true;
                }
                WorkerMessage::Terminated => {
                    let message = "the worker ended without a message, as when memory runs out".to_owned();
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
            Reply::Checked { number, report } => {
                let request = self.request_of(number)?;
                let outcome = plan_from_report(&request.name, &request.text, report);
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
        self.finished_number = number;
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

    fn message(reply: Reply) -> Vec<WorkerMessage> {
        vec![WorkerMessage::Reply(reply)]
    }

    /// The frames that panicked.
    fn panicked_frames(events: &[Event]) -> Vec<Option<i64>> {
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
        // The trap follows the message of the panic immediately.
        let update = pending.handle_messages(vec![panicked(1), WorkerMessage::Terminated]);
        assert_eq!(
            (panicked_frames(&update.events), update.terminated, pending.is_busy()),
            (vec![Some(3)], true, false)
        );
        assert!(pending.push(request(SCENE, 4)), "another worker is there");
        let update = pending.handle_messages(message(Reply::Done { number: 2 }));
        assert_eq!((update.events.len(), update.terminated, pending.is_busy()), (0, false, false));
    }

    #[test]
    fn the_newest_request_survives_the_worker() {
        let mut pending = Pending::default();
        for number in 3..6 {
            pending.push(request(SCENE, number));
        }
        let update = pending.handle_messages(vec![panicked(1), WorkerMessage::Terminated]);
        assert_eq!(panicked_frames(&update.events), [Some(3)]);
        let newest = pending.newest().map(|(number, request)| (number, request.number));
        assert_eq!((newest, pending.is_busy()), (Some((3, Some(5))), true));
        // The message does not say at which request it ended; each request is reported as the cause at most once.
        let update = pending.handle_messages(vec![WorkerMessage::Terminated]);
        assert_eq!((panicked_frames(&update.events), pending.is_busy()), (vec![Some(5)], false));
    }

    #[test]
    fn a_worker_that_ends_idle_is_replaced_when_it_is_needed() {
        let mut pending = Pending::default();
        let update = pending.handle_messages(vec![WorkerMessage::Terminated]);
        assert!(update.events.is_empty() && !update.terminated, "else one that cannot start would be started for ever");
        assert!(!pending.push(request(SCENE, 0)));
        assert_eq!(pending.newest().map(|(number, _)| number), Some(1));
        assert!(pending.push(request(SCENE, 1)), "the other one");
        pending.finish_all();
        assert!(!pending.is_busy() && pending.newest().is_none());
    }

    #[test]
    fn replies_become_events() {
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
        let replies = [
            Reply::Ready,
            Reply::Checked { number: 1, report: Ok(9.5) },
            Reply::Drawn { picture: picture.clone() },
            Reply::Stage { stage: 2, picture },
            Reply::FullQualityFrame { frame: 7, png: vec![1] },
            Reply::Failed { number: 1, reason: "no memory".into() },
            Reply::Failed { number: 9, reason: "of no request".into() },
        ];
        let update = pending.handle_messages(replies.into_iter().map(WorkerMessage::Reply).collect());
        assert!(update.ready && !update.terminated && pending.is_busy());
        let [checked, drawn, stage, full_quality, failed] = &update.events[..] else {
            panic!("{} events", update.events.len())
        };
        assert!(matches!(checked, Event::Checked { outcome: Ok(plan), .. } if plan.exposure_ev100 == 9.5));
        assert!(matches!((drawn, stage), (Event::Drawn(Picture { number: 7, .. }), Event::Stage(2, _))));
        assert!(matches!((full_quality, failed), (Event::FullQualityFrame { number: 7, .. }, Event::Failed { .. })));
    }
}
