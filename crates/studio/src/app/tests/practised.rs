//! The time that a practiced user needs for scene 2 of the thesis, an S that splits, starting from the default flame.

use eframe::egui::{Pos2, pos2};
use egui_kittest::{Harness, kittest::Queryable};

use super::{super::Studio, text, window};
use crate::{editors::aurora::document::AuroraDrawing, scenes::new_scene::FLAME_SHEET};

/// Times of the keystroke-level model, s (Card, Moran and Newell, "The keystroke-level model for user performance time with interactive
/// systems", 1980): mental preparation, pointing, pressing or releasing a button, and drawing, for each line of a stroke
/// and each centimeter of it. A step that the previous one prepared needs no mental preparation: the entries of an open menu, the position
/// at which a chosen tool is applied. The model is of practiced users who make no errors; the time of new users has to be measured.
const THINK_S: f64 = 1.35;
const POINT_S: f64 = 1.1;
const BUTTON_S: f64 = 0.1;
const LINE_S: f64 = 0.9;
const CENTIMETER_S: f64 = 0.16;
/// Factor of the mental preparation of a user who searches for each step; an estimate.
const SEEKING: f64 = 3.0;
/// Points per centimeter, at 96 points per inch.
const CENTIMETER: f32 = 96.0 / 2.54;

/// A simulated practiced user.
struct User {
    harness: Harness<'static, Studio>,
    thoughts: usize,
    seconds: f64,
}

impl User {
    /// Adds a mental preparation.
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
        // The user does not wait for the picture.
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

    /// A position on a plane, as fractions of its size from the north-west corner.
    fn position(&self, plane: &str, [x, y]: [f32; 2]) -> Pos2 {
        let plane = self.harness.get_by_label(plane).rect();
        pos2(plane.left() + x * plane.width(), plane.top() + y * plane.height())
    }

    fn stroke(&mut self, line: &[[f32; 2]]) {
        let line: Vec<Pos2> = line.iter().map(|&fraction| self.position("Aurora target", fraction)).collect();
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
fn a_practiced_user_makes_an_s_that_splits_in_less_than_a_minute() {
    let mut user = User { harness: window(FLAME_SHEET), thoughts: 0, seconds: 0.0 };
    user.think();
    user.click("File");
    user.click("New");
    user.click("Aurora");
    user.think();
    user.stroke(&[[0.15, 0.45], [0.5, 0.4], [0.85, 0.45]]);
    user.think();
    user.click("Add shape");
    user.think();
    user.stroke(&[[0.2, 0.62], [0.7, 0.62], [0.75, 0.52], [0.3, 0.48], [0.25, 0.38], [0.8, 0.36]]);
    user.think();
    user.click("Add shape");
    user.think();
    user.click("Split");
    // The sheet that was drawn is cut in two.
    let middle = user.position("Aurora source", [0.52, 0.5]);
    user.click_at(middle);
    user.think();
    user.click("Play");

    let session = user.harness.state_mut().session();
    assert!(session.transport.is_playing());
    let assets = session.assets().clone();
    session.document.check_now(&assets);
    assert!(session.document.error().is_none());
    let drawing = AuroraDrawing::read(session.document.values(), 0, &assets).unwrap();
    assert_eq!([0, 1, 2].map(|shape| drawing.lines(shape).len()), [1, 1, 2], "{}", text(&mut user.harness));
    assert!(
        text(&mut user.harness).contains("split = [{ sheet = 1, length_fraction = 0."),
        "{}",
        text(&mut user.harness)
    );
    assert!(user.seconds < 45.0, "{} s", user.seconds);
    // Also for a user who searches for each step.
    let seeking = user.seconds + (SEEKING - 1.0) * THINK_S * user.thoughts as f64;
    assert!(seeking < 60.0, "{seeking} s");
}
