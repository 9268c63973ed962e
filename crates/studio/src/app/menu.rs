//! The menu bar.

use eframe::egui::{self, ThemePreference, Ui};

use super::Studio;
use crate::{
    document::files::autosave::RecoveredWork,
    scenes::new_scene::{NEW_SCENES, NewScene},
};

impl Studio {
    /// Shows the menu bar.
    pub(super) fn menu_ui(&mut self, ui: &mut Ui) {
        egui::MenuBar::new().ui(ui, |ui| {
            ui.menu_button("File", |ui| self.file_menu_ui(ui));
            ui.menu_button("Edit", |ui| self.edit_menu_ui(ui));
            ui.menu_button("View", |ui| self.view_menu_ui(ui));
            self.recover_menu_ui(ui);
            let star = if self.session.document.is_dirty() { " •" } else { "" };
            ui.weak(format!("{}{star}", self.session.document.name()));
        });
    }

    fn file_menu_ui(&mut self, ui: &mut Ui) {
        ui.menu_button("New", |ui| {
            for NewScene { name, text } in NEW_SCENES {
                if ui.button(name).clicked() {
                    self.files.open_bundled(&mut self.session, "scene", text);
                }
            }
        });
        if ui.button("Open…").clicked() {
            self.files.ask_to_open(ui.ctx(), &mut self.session);
        }
        ui.menu_button("Examples", |ui| self.examples_menu_ui(ui));
        if ui.button("Save").clicked() {
            self.files.save(&mut self.session);
        }
        self.files.menu_ui(ui, &mut self.session);
    }

    fn examples_menu_ui(&mut self, ui: &mut Ui) {
        egui::ScrollArea::vertical().show(ui, |ui| {
            for scene in bansho_example_scenes::SCENES {
                if ui.button(scene.name.replace('_', " ")).clicked() {
                    self.files.open_bundled(&mut self.session, &format!("{}.toml", scene.name), scene.text);
                }
            }
        });
    }

    fn edit_menu_ui(&mut self, ui: &mut Ui) {
        let document = &mut self.session.document;
        let undo = document.undo_label().map_or("Undo".to_owned(), |label| format!("Undo {label}"));
        if ui.add_enabled(document.undo_label().is_some(), egui::Button::new(undo)).clicked() {
            document.undo();
        }
        let redo = document.redo_label().map_or("Redo".to_owned(), |label| format!("Redo {label}"));
        if ui.add_enabled(document.redo_label().is_some(), egui::Button::new(redo)).clicked() {
            document.redo();
        }
        ui.menu_button("Undo back to", |ui| self.undo_list_ui(ui));
    }

    /// The last undo steps, newest first: a click undoes that step and all after it.
    fn undo_list_ui(&mut self, ui: &mut Ui) {
        /// Maximum number of listed steps.
        const MAX_LISTED: usize = 20;
        let document = &mut self.session.document;
        let labels: Vec<String> = document.undo_labels().take(MAX_LISTED).map(str::to_owned).collect();
        if labels.is_empty() {
            ui.weak("nothing was done");
        }
        for (number, label) in labels.iter().enumerate() {
            if ui.button(format!("{}. {label}", number + 1)).clicked() {
                for _ in 0..=number {
                    document.undo();
                }
            }
        }
    }

    fn view_menu_ui(&mut self, ui: &mut Ui) {
        ui.checkbox(&mut self.visible_panels.text, "Text");
        ui.checkbox(&mut self.visible_panels.picture_only, "Only the picture");
        ui.checkbox(&mut self.visible_panels.shortcuts, "Shortcuts");
        ui.separator();
        let mut theme = ui.ctx().options(|options| options.theme_preference);
        for (choice, name) in [
            (ThemePreference::System, "As the system"),
            (ThemePreference::Dark, "Dark"),
            (ThemePreference::Light, "Light"),
        ] {
            ui.radio_value(&mut theme, choice, name);
        }
        ui.ctx().set_theme(theme);
    }

    /// Unsaved work of a studio that crashed.
    fn recover_menu_ui(&mut self, ui: &mut Ui) {
        if self.files.unsaved.recovered.is_empty() {
            return;
        }
        ui.menu_button("Recover", |ui| {
            for recovered in self.files.unsaved.recovered.clone() {
                if ui.button(name_of(&recovered)).clicked() {
                    self.files.recover(&mut self.session, recovered);
                }
            }
            ui.separator();
            for recovered in self.files.unsaved.recovered.clone() {
                if ui.button(format!("Not wanted: {}", name_of(&recovered))).clicked() {
                    self.files.unsaved.discard(&recovered);
                }
            }
        })
        .response
        .on_hover_text("Unsaved work of a studio that did not end well");
    }
}

/// What the menu calls unsaved work: the file that it is of.
fn name_of(recovered: &RecoveredWork) -> &str {
    if recovered.origin.is_empty() { "a scene never saved" } else { &recovered.origin }
}
