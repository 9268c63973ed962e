//! The window: panels around a viewport, which show and edit one [`Session`].

mod files;
mod layout;
mod menu;
pub(crate) mod panels;
mod shortcuts;
mod status;
#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests;
mod viewport;
pub(crate) mod widgets;

use std::time::Duration;

use eframe::egui;

pub use self::shortcuts::function_keys;
use self::{files::Files, layout::Layout, viewport::Viewport};
pub use super::session::{AssetsForFolder, Session};
use crate::{
    editors::KindEditors,
    session::{selection::Selection, settings_store::SettingsStore},
};
use panels::{inspector::Inspector, problems::ProblemAction, stages::StagesSection, text::TextPanel};
pub use widgets::picture_texture::color_image;

/// The window and its state.
pub struct Studio {
    session: Session,
    selection: Selection,
    viewport: Viewport,
    editors: KindEditors,
    stages: StagesSection,
    inspector: Inspector,
    text: TextPanel,
    files: Files,
    visible_panels: VisiblePanels,
    layout: Layout,
    /// [`Session::opened`] of the document that is shown.
    opened: u64,
    /// The widget with the keyboard focus.
    focused: Option<egui::Id>,
}

/// The size of the window when it was last closed, or the default size, points.
pub fn window_size(home: Option<&std::path::Path>) -> [f32; 2] {
    Layout::read(SettingsStore::new(home.map(Into::into))).window_size()
}

/// Which panels are open.
#[derive(Clone, Copy, Debug, Default)]
struct VisiblePanels {
    text: bool,
    shortcuts: bool,
    /// Only the picture and its tools.
    picture_only: bool,
}

impl Studio {
    /// A window that shows `session`. `home` is the folder for settings, recent files and autosaves; without it, nothing is stored.
    pub fn new(session: Session, home: Option<std::path::PathBuf>) -> Self {
        let selection = Selection::first_of(&session.document);
        let store = SettingsStore::new(home);
        let layout = Layout::read(store.clone());
        Self {
            session,
            selection,
            viewport: Viewport::default(),
            editors: KindEditors::default(),
            stages: StagesSection::default(),
            inspector: Inspector::default(),
            text: TextPanel::default(),
            files: Files::new(&store),
            visible_panels: VisiblePanels { text: layout.get("text shown", 0.0) > 0.0, ..VisiblePanels::default() },
            layout,
            opened: 0,
            focused: None,
        }
    }

    /// The open session.
    pub fn session(&mut self) -> &mut Session {
        &mut self.session
    }

    /// Whether closing now would lose unsaved work or stop rendering.
    pub fn has_unfinished_work(&self) -> bool {
        self.session.document.is_dirty() || self.files.progress().is_some()
    }

    /// Called when the window closes: stores the settings.
    pub fn on_exit(&mut self) {
        self.files.unsaved.end();
        self.layout.save();
    }

    /// Builds the user interface of one frame.
    pub fn ui(&mut self, ui: &mut egui::Ui) {
        if ui.ctx().cumulative_pass_nr() == 0 {
            self.layout.apply_theme(ui.ctx());
        }
        let (now, dragging) = time_and_dragging(ui);
        // Polled first, so that a new picture is shown in the same frame.
        self.session.poll_player(now, dragging);
        self.begin_undo_steps(ui.ctx());
        self.handle_shortcuts(ui.ctx());
        self.files.poll(ui, &mut self.session, &self.selection);
        egui::Panel::top("menu").show(ui, |ui| self.menu_ui(ui));
        egui::Panel::bottom("status").show(ui, |ui| status::status_ui(ui, &mut self.session, &mut self.files));
        egui::Panel::bottom("timeline").show(ui, |ui| panels::timeline::timeline_ui(ui, &mut self.session));
        self.reset_on_open();
        if self.visible_panels.picture_only {
            self.session.stages = None;
        } else {
            self.panels_ui(ui);
        }
        let transparent = egui::Frame::central_panel(ui.style()).fill(egui::Color32::TRANSPARENT);
        egui::CentralPanel::default()
            .frame(transparent)
            .show(ui, |ui| self.viewport.ui(ui, &mut self.session, &self.selection));
        if self.visible_panels.shortcuts {
            shortcuts::shortcuts_ui(ui.ctx(), &mut self.visible_panels.shortcuts);
        }
        self.end_undo_steps(ui);
        self.layout.record_theme(ui.ctx());
        self.layout.set("text shown", f32::from(u8::from(self.visible_panels.text)));
        self.layout.record_window_size(ui.ctx());
        self.request_frame(ui);
    }

    /// Resets the selection after a scene was opened or the selected table was removed.
    fn reset_on_open(&mut self) {
        let gone =
            self.selection.index.is_some() && self.selection.path().find(self.session.document.values()).is_none();
        if self.opened != self.session.opened || gone {
            self.opened = self.session.opened;
            self.selection = Selection::first_of(&self.session.document);
            self.editors = KindEditors::default();
        }
    }

    fn panels_ui(&mut self, ui: &mut egui::Ui) {
        self.side_panels_ui(ui);
        let selected = self.selection.phenomenon();
        if let Some(phenomenon) = selected.filter(|selected| self.editors.has_editor(selected.kind)) {
            let panel = egui::Panel::bottom(phenomenon.kind).resizable(true);
            let Self { editors, session, layout, .. } = self;
            layout.bottom_panel_ui(phenomenon.kind, panel, 420.0, ui, |ui| editors.ui(ui, session, phenomenon));
        }
    }

    fn side_panels_ui(&mut self, ui: &mut egui::Ui) {
        match panels::problems::problems_ui(ui, &self.session) {
            Some(ProblemAction::ShowInText(span)) => {
                self.visible_panels.text = true;
                self.text.jump_to(span);
            }
            Some(ProblemAction::Relink(parameter)) => self.files.ask_to_relink(ui.ctx(), &mut self.session, parameter),
            None => {}
        }
        let Self { session, selection, text, stages, inspector, layout, visible_panels, .. } = self;
        layout.side_panel_ui("scene", egui::Panel::left("scene"), 200.0, ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| panels::scene::scene_ui(ui, session, selection));
        });
        if visible_panels.text {
            layout.side_panel_ui("text", egui::Panel::right("text"), 380.0, ui, |ui| text.ui(ui, session));
        }
        layout.side_panel_ui("inspector", egui::Panel::right("inspector"), 330.0, ui, |ui| {
            session.stages = None;
            if let Some(phenomenon) = selection.phenomenon() {
                stages.ui(ui, session, phenomenon);
            }
            // Wide rows scroll. Otherwise they would widen the panel, which would widen the rows.
            egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| inspector.ui(ui, session, selection));
        });
    }

    /// Starts an undo step at a press or a change of focus: a drag, the edits in one field, or one turn of the wheel are one step.
    fn begin_undo_steps(&mut self, ctx: &egui::Context) {
        let focused = ctx.memory(egui::Memory::focused);
        let (pressed, is_down) = ctx.input(|input| (input.pointer.any_pressed(), input.pointer.any_down()));
        if pressed || (self.focused != focused && !is_down) {
            self.session.document.end_step();
        }
        self.focused = focused;
    }

    /// Ends the undo step once nothing is pressed, typed in or scrolled.
    fn end_undo_steps(&mut self, ui: &egui::Ui) {
        /// Scrolling with shorter pauses is one step, s.
        const SCROLL_PAUSE_S: f32 = 0.5;
        let typing = ui.ctx().egui_wants_keyboard_input();
        let (is_down, is_scrolling) = ui.input(|input| {
            let is_scrolling = input.is_scrolling() || input.time_since_last_scroll() < SCROLL_PAUSE_S;
            (input.pointer.any_down(), is_scrolling)
        });
        if is_down || typing {
            return;
        }
        if !is_scrolling {
            self.session.document.end_step();
        }
        // A web page is closed without notice.
        if cfg!(target_arch = "wasm32") {
            self.layout.save();
        }
    }

    fn request_frame(&mut self, ui: &egui::Ui) {
        let (now, dragging) = time_and_dragging(ui);
        if let Some(sleep_s) = self.session.advance_time(now, self.viewport.pixels(), dragging) {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(sleep_s));
        }
        self.session.wait_for_picture(now, dragging);
        self.viewport.upload_picture(ui, &self.session);
    }
}

/// The time, s, and whether something is being dragged.
fn time_and_dragging(ui: &egui::Ui) -> (f64, bool) {
    let (now, is_down) = ui.input(|input| (input.time, input.pointer.any_down()));
    (now, is_down && ui.ctx().dragged_id().is_some())
}

#[cfg(not(target_arch = "wasm32"))]
impl bansho_egui_software::App for Studio {
    fn ui(&mut self, ui: &mut egui::Ui, _wait_until_presented: &mut dyn FnMut()) {
        Self::ui(self, ui);
    }

    fn on_exit(&mut self) {
        Self::on_exit(self);
    }
}
