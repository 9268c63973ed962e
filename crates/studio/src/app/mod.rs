//! The window: panels over one [`Session`]. It holds no formulas of any phenomenon.

mod aurora;
#[cfg(target_arch = "wasm32")]
mod browser;
mod chooser;
mod curve_editor;
mod files;
mod gesture;
mod hands;
mod icon;
mod inspector;
mod keyed;
mod menu;
mod problems;
mod question;
mod scene_panel;
mod session;
mod shortcuts;
mod status;
#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests;
mod text_panel;
mod timeline;
mod value;
mod viewport;

use std::time::Duration;

use eframe::egui;

pub use self::session::{AssetsOf, Session};
use self::{aurora::AuroraEditor, files::Files, scene_panel::Subject, text_panel::TextPanel, viewport::Viewport};

/// The kind of phenomenon whose shapes are drawn.
const KIND_WITH_SHAPES: &str = "aurora";

/// The whole window.
pub struct Studio {
    session: Session,
    subject: Subject,
    viewport: Viewport,
    aurora: AuroraEditor,
    text: TextPanel,
    files: Files,
    shows: Shows,
}

/// Which parts of the window are open.
#[derive(Clone, Copy, Debug, Default)]
struct Shows {
    text: bool,
    shortcuts: bool,
}

impl Studio {
    /// A window on `session`. `home` is where the studio keeps recent files and unsaved work; without it, nothing is kept.
    pub fn new(session: Session, home: Option<std::path::PathBuf>) -> Self {
        let subject = Subject::first_of(&session.document);
        Self {
            session,
            subject,
            viewport: Viewport::default(),
            aurora: AuroraEditor::default(),
            text: TextPanel::default(),
            files: Files::new(home),
            shows: Shows::default(),
        }
    }

    /// What it works on.
    pub fn session(&mut self) -> &mut Session {
        &mut self.session
    }

    /// Shows everything and takes in what hands do.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        self.take_shortcuts(ui.ctx());
        self.files.tend(ui, &mut self.session);
        egui::Panel::top("menu").show(ui, |ui| self.menu(ui));
        egui::Panel::bottom("status").show(ui, |ui| status::show(ui, &mut self.session, &self.files));
        egui::Panel::bottom("timeline").show(ui, |ui| timeline::show(ui, &mut self.session));
        self.side_panels(ui);
        if let (KIND_WITH_SHAPES, Some(index)) = (self.subject.key, self.subject.index) {
            egui::Panel::bottom("aurora").resizable(true).default_size(420.0).show(ui, |ui| {
                self.aurora.show(ui, &mut self.session, index);
            });
        }
        egui::CentralPanel::default().show(ui, |ui| self.viewport.show(ui, &mut self.session));
        if self.shows.shortcuts {
            shortcuts::window(ui.ctx(), &mut self.shows.shortcuts);
        }
        self.end_gestures(ui);
        self.update(ui);
    }

    fn side_panels(&mut self, ui: &mut egui::Ui) {
        if let Some(jump) = problems::show(ui, &self.session) {
            self.shows.text = true;
            self.text.jump_to(jump);
        }
        egui::Panel::left("scene").default_size(200.0).show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| scene_panel::show(ui, &mut self.session, &mut self.subject));
        });
        if self.shows.text {
            egui::Panel::right("text").default_size(380.0).show(ui, |ui| self.text.show(ui, &mut self.session));
        }
        egui::Panel::right("inspector").default_size(330.0).show(ui, |ui| {
            egui::ScrollArea::vertical()
                .auto_shrink(false)
                .show(ui, |ui| inspector::show(ui, &mut self.session, &self.subject));
        });
    }

    /// When everything is let go, what was done is one step of the history.
    fn end_gestures(&mut self, ui: &egui::Ui) {
        let typing = ui.ctx().egui_wants_keyboard_input();
        if !ui.input(|input| input.pointer.any_down()) && !typing {
            self.session.document.seal();
        }
    }

    fn update(&mut self, ui: &egui::Ui) {
        let now = ui.input(|input| input.time);
        let hands = ui.input(|input| input.pointer.any_down()) && ui.ctx().dragged_id().is_some();
        if let Some(sleep_s) = self.session.update(now, self.viewport.pixels(), hands) {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(sleep_s));
        }
    }
}

impl eframe::App for Studio {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
    }

    fn on_exit(&mut self) {
        self.files.end();
    }

    #[cfg(target_arch = "wasm32")]
    fn as_any_mut(&mut self) -> Option<&mut dyn std::any::Any> {
        Some(&mut *self)
    }
}
