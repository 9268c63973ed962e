//! How long hands take for scene 2 of the thesis, an S that splits, from the flame that the studio begins with.

use eframe::egui::{Pos2, pos2};
use egui_kittest::{Harness, kittest::Queryable};

use super::{super::Studio, text, window};
use crate::{editors::aurora::document::AuroraDrawing, scenes::new_scene::FLAME_SHEET};

/// Times of the keystroke-level model, s (Card, Moran and Newell, "The keystroke-level model for user performance time with interactive
/// systems", 1980): to think of the next step, to point at something, to press or let go a button, and to draw, for each line of a stroke
/// and each centimeter of it. Nobody thinks again for what the last step was made for: the entries of an open menu, the place that a tool
/// is taken up for. They are those of hands that know the way and err never; what a newcomer needs, only newcomers can tell.
const THINK_S: f64 = 1.35;
const POINT_S: f64 = 1.1;
const BUTTON_S: f64 = 0.1;
const LINE_S: f64 = 0.9;
const CENTIMETER_S: f64 = 0.16;
/// How many times as long somebody thinks who looks for each step; a guess.
const SEEKING: f64 = 3.0;
/// Points of the screen in a centimeter, at 96 to the inch.
const CENTIMETER: f32 = 96.0 / 2.54;

/// Hands that know the way, and what they did.
struct Hand {
    harness: Harness<'static, Studio>,
    thoughts: usize,
    seconds: f64,
}

impl Hand {
    /// Before what comes next.
    fn think(&mut self) {
        self.thoughts += 1;
        self.seconds += THINK_S;
    }

    fn act(&mut self, seconds: f64) {
        self.seconds += POINT_S + 2.0 * BUTTON_S + seconds;
    }

    fn press(&mut self, at: Pos2) {
        self.harness.hover_at(at);
        self.harness.step();
        self.harness.drag_at(at);
        self.harness.step();
    }

    fn release(&mut self, at: Pos2) {
        self.harness.drop_at(at);
        // Not until there is a picture: nobody waits for one.
        self.harness.run_steps(4);
    }

    fn click(&mut self, button: &str) {
        let at = self.harness.get_by_label(button).rect().center();
        self.click_at(at);
    }

    fn click_at(&mut self, at: Pos2) {
        self.press(at);
        self.release(at);
        self.act(0.0);
    }

    /// A place of a plane, as shares from its north-west corner.
    fn place(&self, plane: &str, [x, y]: [f32; 2]) -> Pos2 {
        let plane = self.harness.get_by_label(plane).rect();
        pos2(plane.left() + x * plane.width(), plane.top() + y * plane.height())
    }

    fn stroke(&mut self, line: &[[f32; 2]]) {
        let line: Vec<Pos2> = line.iter().map(|&fraction| self.place("Aurora target", fraction)).collect();
        let mut seconds = 0.0;
        self.press(line[0]);
        for pair in line.windows(2) {
            for step in 1..=4 {
                self.harness.hover_at(pair[0].lerp(pair[1], step as f32 / 4.0));
                self.harness.step();
            }
            seconds += LINE_S + CENTIMETER_S * f64::from(pair[0].distance(pair[1]) / CENTIMETER);
        }
        self.release(line[line.len() - 1]);
        self.act(seconds);
    }
}

#[test]
fn practised_hands_make_an_s_that_splits_in_less_than_a_minute() {
    let mut hand = Hand { harness: window(FLAME_SHEET), thoughts: 0, seconds: 0.0 };
    hand.think();
    hand.click("File");
    hand.click("New");
    hand.click("Aurora");
    hand.think();
    hand.stroke(&[[0.15, 0.45], [0.5, 0.4], [0.85, 0.45]]);
    hand.think();
    hand.click("Add shape");
    hand.think();
    hand.stroke(&[[0.2, 0.62], [0.7, 0.62], [0.75, 0.52], [0.3, 0.48], [0.25, 0.38], [0.8, 0.36]]);
    hand.think();
    hand.click("Add shape");
    hand.think();
    hand.click("Split");
    // The sheet that was drawn lies there already, and is cut in two.
    let middle = hand.place("Aurora source", [0.52, 0.5]);
    hand.click_at(middle);
    hand.think();
    hand.click("Play");

    let session = hand.harness.state_mut().session();
    assert!(session.transport.is_playing());
    let assets = session.assets().clone();
    session.document.check_now(&assets);
    assert!(session.document.error().is_none());
    let drawing = AuroraDrawing::read(session.document.values(), 0, &assets).unwrap();
    assert_eq!([0, 1, 2].map(|shape| drawing.lines(shape).len()), [1, 1, 2], "{}", text(&mut hand.harness));
    assert!(
        text(&mut hand.harness).contains("split = [{ sheet = 1, length_fraction = 0."),
        "{}",
        text(&mut hand.harness)
    );
    assert!(hand.seconds < 45.0, "{} s", hand.seconds);
    // Also who seeks each step.
    let seeking = hand.seconds + (SEEKING - 1.0) * THINK_S * hand.thoughts as f64;
    assert!(seeking < 60.0, "{seeking} s");
}
