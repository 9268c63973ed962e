//! What is wrong with the scene, each fault with its line; clicking it leads there.

use bansho::base::parameters::Span;
use eframe::egui::{self, RichText, Ui};

use super::session::Session;

/// Shows the faults, if there are any; where in the text a clicked one lies.
pub(super) fn show(ui: &mut Ui, session: &Session) -> Option<Span> {
    let error = session.document.error()?.clone();
    let mut jump = None;
    egui::Panel::bottom("problems").resizable(true).show(ui, |ui| {
        let count = error.problems.len();
        let faults = if count == 1 { "1 fault".to_owned() } else { format!("{count} faults") };
        ui.strong(format!("{faults}; the last good picture stays"));
        egui::ScrollArea::vertical().max_height(120.0).show(ui, |ui| {
            for problem in &error.problems {
                let line = problem.span.as_ref().map(|span| error.position(span.start).0);
                let text = line.map_or_else(|| problem.to_string(), |line| format!("line {line}: {problem}"));
                let colour = ui.visuals().error_fg_color;
                if ui.link(RichText::new(text).color(colour)).clicked() {
                    jump = problem.span.clone();
                }
            }
        });
    });
    jump
}
