//! The problems of the scene, each with its line; a click shows it in the text.

use bansho::{
    base::parameters::{ProblemKind, Span},
    scene::ValuePath,
};

use crate::session::Session;
use eframe::egui::{self, RichText, Ui};

/// What to do about a problem.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ProblemAction {
    /// Show it in the text.
    ShowInText(Span),
    /// Choose another file for one that is missing.
    Relink(ValuePath),
}

/// Shows the problems, if there are any. Returns the action that was clicked.
pub(crate) fn problems_ui(ui: &mut Ui, session: &Session) -> Option<ProblemAction> {
    let error = session.document.error()?.clone();
    let mut action = None;
    egui::Panel::bottom("problems").resizable(true).show(ui, |ui| {
        let count = error.problems.len() + error.omitted;
        let faults = if count == 1 { "1 fault".to_owned() } else { format!("{count} faults") };
        ui.strong(format!("{faults}; the last good picture stays"));
        egui::ScrollArea::vertical().max_height(120.0).show(ui, |ui| {
            for problem in &error.problems {
                let line = problem.span.as_ref().map(|span| error.position(span.start).line);
                let text = line.map_or_else(|| problem.to_string(), |line| format!("line {line}: {problem}"));
                let color = ui.visuals().error_fg_color;
                ui.horizontal_wrapped(|ui| {
                    if ui.link(RichText::new(text).color(color)).clicked() {
                        action = problem.span.clone().map(ProblemAction::ShowInText);
                    }
                    let missing = matches!(problem.kind, ProblemKind::Asset(_));
                    if missing && ui.small_button("Relink").on_hover_text("Choose another file to replace it").clicked()
                    {
                        action = Some(ProblemAction::Relink(parse_path(&problem.path)));
                    }
                });
            }
        });
    });
    action
}

/// The path of a problem's parameter, from its text.
fn parse_path(path: &str) -> ValuePath {
    path.split('.').fold(ValuePath::root(), |path, segment| match segment.parse() {
        Ok(index) => path.index(index),
        Err(_) => path.key(segment),
    })
}
