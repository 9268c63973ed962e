//! The session and the window with a fake player: which frames are requested, and how slow frames, drafts and panics are shown.

use std::{cell::RefCell, rc::Rc, sync::Arc};

use bansho::{Assets, MemoryAssets};
use eframe::egui::vec2;
use egui_kittest::{Harness, kittest::Queryable};

use super::{SCENE, Session, Studio, assets};
use crate::{
    document::{Document, Revision, check},
    player::{Event, FrameRequest, Picture, Player},
};

/// The requests, and the events that are reported next.
#[derive(Default)]
struct RequestSlot {
    requests: Vec<FrameRequest>,
    events: Vec<Event>,
}

/// A fake player with scripted events.
#[derive(Clone, Default)]
struct Fake(Rc<RefCell<RequestSlot>>);

impl Player for Fake {
    fn request(&mut self, request: FrameRequest) {
        self.0.borrow_mut().requests.push(request);
    }

    fn poll(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.0.borrow_mut().events)
    }

    fn is_busy(&self) -> bool {
        false
    }

    fn needs_polling(&self) -> bool {
        false
    }
}

impl Fake {
    fn last(&self) -> FrameRequest {
        self.0.borrow().requests.last().expect("a request").clone()
    }

    fn request_count(&self) -> usize {
        self.0.borrow().requests.len()
    }

    /// A phenomenon panics at frame `number` of `revision`.
    fn panic(&self, revision: Revision, number: i64) {
        let event = Event::Panicked { revision, number: Some(number), message: "broken on purpose".into() };
        self.0.borrow_mut().events.push(event);
    }

    /// Serves the last request: the scene is valid, and its picture took `draw_s`.
    fn process(&self, draw_s: f64) {
        let request = self.last();
        let nowhere: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
        let outcome = check(&request.name, &request.text, &nowhere).map(|checked| checked.plan);
        let scene_size = outcome.as_ref().map_or([64, 36], |plan| plan.size());
        let size = request.within.map(|side| side.min(640));
        let picture = Picture {
            revision: request.revision,
            number: request.number.unwrap_or_default(),
            size,
            scene_size,
            pixels: vec![[90, 60, 30, 255]; size[0] * size[1]],
            exact: request.exact,
            draft: request.draft,
            draw_s,
            advance_s: 0.0,
        };
        let checked = Event::Checked { revision: request.revision, outcome };
        self.0.borrow_mut().events.extend([checked, Event::Drawn(picture)]);
    }
}

const WINDOW: [usize; 2] = [640, 360];

fn session() -> (Session, Fake) {
    let fake = Fake::default();
    let session = Session::new(Document::new("fire.toml", SCENE), None, Box::new(fake.clone()), assets);
    (session, fake)
}

#[test]
fn previews_shrink_during_a_slow_drag() {
    let (mut session, fake) = session();
    session.update(0.0, WINDOW, false);
    assert_eq!((fake.last().within, fake.last().number), (WINDOW, None));
    fake.process(0.4);
    session.update(0.4, WINDOW, false);
    for step in 0..3 {
        session.document.replace("typing", &SCENE.replace("0.9", &format!("1.{step}")));
        session.update(1.0 + f64::from(step), WINDOW, true);
        fake.process(0.4 * fake.last().within[0] as f64 / 640.0);
    }
    session.update(5.0, WINDOW, true);
    assert!(fake.last().within[0] <= 320, "{:?}", fake.last().within);
    let wished = fake.request_count();
    session.update(5.1, WINDOW, false);
    assert_eq!((fake.last().within, fake.request_count()), (WINDOW, wished + 1), "whole once nothing is dragged");
    session.update(5.2, WINDOW, false);
    assert_eq!(fake.request_count(), wished + 1, "nothing is wished for twice");
}

#[test]
fn drafts_are_requested_unless_the_frame_must_be_exact() {
    let (mut session, fake) = session();
    session.update(0.0, WINDOW, false);
    assert!(fake.last().draft && !fake.last().exact && !fake.last().full_quality);
    fake.process(0.01);
    session.update(0.1, WINDOW, false);
    session.redraw_exact();
    assert!(fake.last().exact && fake.last().revision == session.document.revision());
    let finished = session.full_quality_request(3);
    assert!(finished.full_quality && finished.exact && !finished.draft && finished.number == Some(3));
    session.draft = false;
    session.update(0.2, WINDOW, false);
    assert!(!fake.last().draft);
}

#[test]
fn late_events_of_a_closed_document_are_ignored() {
    let (mut session, fake) = session();
    session.update(0.0, WINDOW, false);
    fake.process(0.01);
    session.open(Document::new("other.toml", SCENE.replace("frames = 10", "frames = 3")), None);
    session.go_to_time(0.1);
    session.open(Document::new("third.toml", SCENE.replace("frames = 10", "frames = 5")), None);
    session.update(0.1, WINDOW, false);
    assert!(session.picture().is_none() && session.plan().is_none());
    let revision = session.document.revision();
    fake.0.borrow_mut().events.push(Event::Panicked {
        revision: Document::new("", "").revision(),
        number: None,
        message: "late".into(),
    });
    session.update(0.2, WINDOW, false);
    assert!(!session.has_panicked() && session.notice().is_none());
    fake.process(0.01);
    session.update(0.3, WINDOW, false);
    assert_eq!(session.picture().map(|(picture, _)| picture.revision), Some(revision));
    assert_eq!(
        (session.transport.frames(), session.transport.number()),
        (0..=4, 0),
        "nobody went anywhere in this one"
    );
}

#[test]
fn frames_that_panicked_are_drawn_again_with_a_new_file() {
    let (mut session, fake) = session();
    session.update(0.0, WINDOW, false);
    let revision = session.document.revision();
    fake.panic(revision, 0);
    session.update(0.1, WINDOW, false);
    assert!(session.has_panicked());
    let wished = fake.request_count();
    session.reload_assets();
    session.update(0.2, WINDOW, false);
    assert!(!session.has_panicked() && fake.request_count() == wished + 1);
}

#[test]
fn a_frame_that_panicked_is_only_drawn_again_on_request() {
    let (mut session, fake) = session();
    session.update(0.0, WINDOW, false);
    fake.process(0.01);
    session.update(0.1, WINDOW, false);
    let revision = session.document.revision();
    let mut at = |number: i64| {
        session.transport.go_to(number);
        session.update(0.2, WINDOW, false);
        let wished = fake.last().number == Some(number);
        if number == 3 {
            fake.panic(revision, number);
        } else {
            fake.process(0.01);
        }
        session.update(0.3, WINDOW, false);
        (wished, session.has_panicked())
    };
    assert_eq!([at(3), at(4)], [(true, true), (true, false)], "of one state");
    let wished = fake.request_count();
    session.transport.go_to(3);
    session.update(0.4, WINDOW, false);
    assert!(session.has_panicked() && fake.request_count() == wished);
    session.retry();
    session.update(0.5, WINDOW, false);
    assert!(!session.has_panicked() && fake.last().number == Some(3));
}

#[test]
fn a_panic_during_a_check_affects_all_frames() {
    let (mut session, fake) = session();
    session.update(0.0, WINDOW, false);
    fake.process(0.01);
    session.update(0.1, WINDOW, false);
    session.document.replace("typing", "bansho = 2\n[[rain]]\n");
    session.update(0.2, WINDOW, false);
    fake.panic(session.document.revision(), 0);
    session.update(0.3, WINDOW, false);
    let wished = fake.request_count();
    session.transport.go_to(4);
    session.update(0.4, WINDOW, false);
    assert!(session.has_panicked() && fake.request_count() == wished);
}

#[test]
fn the_window_offers_to_retry_a_frame_that_panicked() {
    let (session, fake) = session();
    let revision = session.document.revision();
    let mut harness = Harness::builder()
        .with_size(vec2(1200.0, 800.0))
        .build_ui_state(|ui, studio: &mut Studio| studio.ui(ui), Studio::new(session, None));
    harness.run_steps(2);
    assert!(harness.query_by_label("Retry").is_none());
    fake.panic(revision, 0);
    harness.run_steps(2);
    harness.get_by_label_contains("a phenomenon panicked");
    let wished = fake.request_count();
    harness.get_by_label("Retry").click();
    harness.run_steps(2);
    assert_eq!(fake.request_count(), wished + 1);
    assert!(harness.query_by_label("Retry").is_none());
}

#[test]
fn the_window_marks_drafts_and_live_states() {
    let (session, fake) = session();
    let mut harness = Harness::builder()
        .with_size(vec2(1200.0, 800.0))
        .build_ui_state(|ui, studio: &mut Studio| studio.ui(ui), Studio::new(session, None));
    harness.run_steps(2);
    fake.process(0.01);
    harness.run_steps(2);
    harness.get_by_label("draft");
    harness.get_by_label("live state").click();
    harness.run_steps(2);
    assert!(fake.last().exact);
    fake.process(0.01);
    harness.run_steps(2);
    assert!(harness.query_by_label("live state").is_none());
}
