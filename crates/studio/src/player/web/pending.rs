//! What a page wished for of its worker, and what came of it; a worker that panics is gone, and another takes its place.

use std::collections::VecDeque;

use super::reply::{Heard, Reply};
use crate::{
    document::recheck,
    player::{Event, Wish},
};

/// Wishes that something may still come of.
#[derive(Default)]
pub(super) struct Pending {
    /// With their numbers, the oldest first.
    wishes: VecDeque<(u64, Wish)>,
    /// How many were made.
    made: u64,
    /// The last one that nothing more comes of.
    done: u64,
    /// Whether the worker ended while nothing was wished for.
    lost: bool,
}

/// What follows from what was heard.
#[derive(Default)]
pub(super) struct News {
    pub(super) events: Vec<Event>,
    /// Whether the worker listens from now on.
    pub(super) listens: bool,
    /// Whether it is gone; another must take its place, and be told the newest wish.
    pub(super) gone: bool,
}

impl Pending {
    /// Notes a wish; whether the worker lives that it is for.
    pub(super) fn note(&mut self, wish: Wish) -> bool {
        self.made += 1;
        self.wishes.push_back((self.made, wish));
        !std::mem::take(&mut self.lost)
    }

    /// The newest wish, with its number, unless nothing more comes of it.
    pub(super) fn newest(&self) -> Option<(u64, &Wish)> {
        self.wishes.back().map(|(number, wish)| (*number, wish))
    }

    pub(super) fn is_busy(&self) -> bool {
        self.done != self.made
    }

    /// Nothing comes of anything any more.
    pub(super) fn give_up(&mut self) {
        self.finish(self.made);
    }

    /// Takes in what a worker said since the last time. Whatever comes after its end is no more than an echo of that.
    pub(super) fn take_in(&mut self, heard: Vec<Heard>) -> News {
        let mut news = News::default();
        for heard in heard {
            match heard {
                Heard::Said(Reply::Ready) => news.listens = true,
                Heard::Said(Reply::Panicked { number, message }) => {
                    news.events.extend(self.mourn(self.wish_of(number).is_some().then_some(number), message));
                    news.gone = true;
                }
                Heard::Ended => {
                    let message = "it ended without a word, as where memory runs out".to_owned();
                    news.events.extend(self.mourn(None, message));
                    news.gone = true;
                }
                Heard::Said(reply) => news.events.extend(self.event(reply)),
            }
            if news.gone {
                news.gone = !self.lost;
                break;
            }
        }
        news
    }

    fn event(&mut self, reply: Reply) -> Option<Event> {
        Some(match reply {
            Reply::Judged { number, found } => {
                let wish = self.wish_of(number)?;
                let outcome = recheck(&wish.name, &wish.text, &wish.assets, found);
                Event::Judged { revision: wish.revision, outcome }
            }
            Reply::Drawn { picture } => Event::Drawn(picture),
            Reply::Stage { stage, picture } => Event::Stage(stage, picture),
            Reply::Still { frame, png } => Event::Still { number: frame, png },
            Reply::Failed { number, reason } => Event::Failed { revision: self.wish_of(number)?.revision, reason },
            Reply::Done { number } => {
                self.finish(number);
                return None;
            }
            Reply::Ready | Reply::Panicked { .. } => return None,
        })
    }

    /// The worker is gone, over wish `number` as far as it said, else over the oldest. Of newer ones the newest may still be had.
    fn mourn(&mut self, number: Option<u64>, message: String) -> Option<Event> {
        let Some(number) = number.or_else(|| self.wishes.front().map(|(number, _)| *number)) else {
            self.lost = true;
            return None;
        };
        let wish = self.wish_of(number)?;
        let event = Event::Panicked { revision: wish.revision, number: wish.number, message };
        self.finish(number);
        self.wishes.drain(..self.wishes.len().saturating_sub(1));
        Some(event)
    }

    fn wish_of(&self, number: u64) -> Option<&Wish> {
        self.wishes.iter().find(|(own, _)| *own == number).map(|(_, wish)| wish)
    }

    fn finish(&mut self, number: u64) {
        self.done = number;
        self.wishes.retain(|(own, _)| *own > number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::player::{Picture, tests::wish};

    const SCENE: &str = "bansho = 1\n[[flame_sheet]]\n";

    fn panicked(number: u64) -> Heard {
        Heard::Said(Reply::Panicked { number, message: "broken on purpose".into() })
    }

    fn said(reply: Reply) -> Vec<Heard> {
        vec![Heard::Said(reply)]
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
        assert!(pending.note(wish(SCENE, 3)));
        // A trap follows the last words, in the same moment.
        let news = pending.take_in(vec![panicked(1), Heard::Ended]);
        assert_eq!((broken(&news.events), news.gone, pending.is_busy()), (vec![Some(3)], true, false));
        assert!(pending.note(wish(SCENE, 4)), "another worker is there");
        let news = pending.take_in(said(Reply::Done { number: 2 }));
        assert_eq!((news.events.len(), news.gone, pending.is_busy()), (0, false, false));
    }

    #[test]
    fn what_was_wished_for_since_is_still_to_be_had() {
        let mut pending = Pending::default();
        for number in 3..6 {
            pending.note(wish(SCENE, number));
        }
        let news = pending.take_in(vec![panicked(1), Heard::Ended]);
        assert_eq!(broken(&news.events), [Some(3)]);
        let newest = pending.newest().map(|(number, wish)| (number, wish.number));
        assert_eq!((newest, pending.is_busy()), (Some((3, Some(5))), true));
        // Nobody says over which one it ended; each is blamed once at most.
        let news = pending.take_in(vec![Heard::Ended]);
        assert_eq!((broken(&news.events), pending.is_busy()), (vec![Some(5)], false));
    }

    #[test]
    fn a_worker_that_ends_idle_is_replaced_when_it_is_needed() {
        let mut pending = Pending::default();
        let news = pending.take_in(vec![Heard::Ended]);
        assert!(news.events.is_empty() && !news.gone, "else one that cannot start would be started for ever");
        assert!(!pending.note(wish(SCENE, 0)));
        assert_eq!(pending.newest().map(|(number, _)| number), Some(1));
        assert!(pending.note(wish(SCENE, 1)), "the other one");
        pending.give_up();
        assert!(!pending.is_busy() && pending.newest().is_none());
    }

    #[test]
    fn what_a_worker_says_of_a_wish_is_passed_on() {
        let mut pending = Pending::default();
        pending.note(wish(SCENE, 7));
        let picture = Picture {
            revision: pending.wishes[0].1.revision,
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
            Reply::Judged { number: 1, found: Ok(9.5) },
            Reply::Drawn { picture: picture.clone() },
            Reply::Stage { stage: 2, picture },
            Reply::Still { frame: 7, png: vec![1] },
            Reply::Failed { number: 1, reason: "no room".into() },
            Reply::Failed { number: 9, reason: "of no wish".into() },
        ];
        let news = pending.take_in(heard.into_iter().map(Heard::Said).collect());
        assert!(news.listens && !news.gone && pending.is_busy());
        let [judged, drawn, stage, still, failed] = &news.events[..] else { panic!("{} events", news.events.len()) };
        assert!(matches!(judged, Event::Judged { outcome: Ok(plan), .. } if plan.exposure_ev100 == 9.5));
        assert!(matches!((drawn, stage), (Event::Drawn(Picture { number: 7, .. }), Event::Stage(2, _))));
        assert!(matches!((still, failed), (Event::Still { number: 7, .. }, Event::Failed { .. })));
    }
}
