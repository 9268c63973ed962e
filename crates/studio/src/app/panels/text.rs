//! The text editor of the scene file.

use bansho::base::parameters::Span;

use crate::session::Session;
use eframe::egui::{
    self, TextEdit, Ui,
    text::{CCursor, CCursorRange},
};

/// The panel with the text.
#[derive(Default)]
pub(crate) struct TextPanel {
    /// The bytes to select in the next frame.
    jump: Option<Span>,
    /// The time of the last edit, s, and its line.
    last_edit: Option<(f64, usize)>,
}

/// A longer pause in typing starts a new undo step, s.
const PAUSE_S: f64 = 1.0;

impl TextPanel {
    /// Selects these bytes of the text when it is shown next.
    pub(crate) fn jump_to(&mut self, span: Span) {
        self.jump = Some(span);
    }

    /// Shows the text. Typing is an undoable edit.
    pub(crate) fn ui(&mut self, ui: &mut Ui, session: &mut Session) {
        let heading = ui.heading("Text").id;
        let mut text = session.document.text().to_string();
        egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| {
            let editor = TextEdit::multiline(&mut text).code_editor().desired_width(f32::INFINITY).desired_rows(30);
            let mut output = editor.show(ui);
            *output.response = egui::Response::clone(&output.response).labelled_by(heading);
            if let Some(span) = self.jump.take() {
                let range = char_range(&text, &span);
                output.state.cursor.set_char_range(Some(range));
                output.state.store(ui.ctx(), output.response.id);
                output.response.request_focus();
                let at = output.galley.pos_from_cursor(range.primary).translate(output.galley_pos.to_vec2());
                ui.scroll_to_rect(at, Some(egui::Align::Center));
            }
            if output.response.changed() {
                let now = ui.input(|input| input.time);
                let line = changed_line(session.document.text(), &text);
                if self
                    .last_edit
                    .replace((now, line))
                    .is_none_or(|(last, last_line)| now - last > PAUSE_S || line != last_line)
                {
                    session.document.end_step();
                }
                session.document.replace("typing", &text);
            }
            if output.response.lost_focus() {
                session.document.end_step();
            }
        });
    }
}

/// The first line in which two texts differ.
fn changed_line(before: &str, after: &str) -> usize {
    before.lines().zip(after.lines()).take_while(|(one, other)| one == other).count()
}

/// The range of characters at a range of bytes of the text.
fn char_range(text: &str, span: &Span) -> CCursorRange {
    let [start, end] = [span.start, span.end].map(|byte| text.char_indices().take_while(|(at, _)| *at < byte).count());
    CCursorRange::two(CCursor::new(start), CCursor::new(end))
}
