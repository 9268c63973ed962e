//! Keyboard shortcuts: one list, for handling and for the help window.

use eframe::egui::{self, Context, Key, KeyboardShortcut, Modifiers};

use super::Studio;

/// The action of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Undo,
    Redo,
    Save,
    Open,
    RenderStill,
    RenderShot,
    PlayPause,
    StepBack,
    StepForward,
    FirstFrame,
    Text,
    PictureOnly,
    Shortcuts,
}

/// A key combination, its action, and the action's name.
pub(super) struct Shortcut {
    pub(super) keys: KeyboardShortcut,
    pub(super) action: Action,
    pub(super) name: &'static str,
}

const fn with_command(key: Key, action: Action, name: &'static str) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::COMMAND, key), action, name }
}

const fn plain(key: Key, action: Action, name: &'static str) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::NONE, key), action, name }
}

/// All shortcuts. Longer combinations come first, since they include shorter ones.
pub(super) const SHORTCUTS: [Shortcut; 14] = [
    Shortcut {
        keys: KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z),
        action: Action::Redo,
        name: "Redo",
    },
    with_command(Key::Z, Action::Undo, "Undo"),
    with_command(Key::Y, Action::Redo, "Redo"),
    with_command(Key::S, Action::Save, "Save"),
    with_command(Key::O, Action::Open, "Open"),
    // Browsers reserve Ctrl+T.
    plain(Key::F2, Action::Text, "Show or hide the text"),
    Shortcut {
        keys: KeyboardShortcut::new(Modifiers::SHIFT, Key::F12),
        action: Action::RenderShot,
        name: "Render the shot",
    },
    plain(Key::F12, Action::RenderStill, "Render the still"),
    plain(Key::Space, Action::PlayPause, "Play or pause"),
    plain(Key::ArrowLeft, Action::StepBack, "Frame back"),
    plain(Key::ArrowRight, Action::StepForward, "Frame on"),
    plain(Key::Home, Action::FirstFrame, "First frame"),
    plain(Key::F, Action::PictureOnly, "Only the picture, or everything"),
    plain(Key::Questionmark, Action::Shortcuts, "These shortcuts"),
];

impl Studio {
    /// Performs the actions of pressed keys. While a text field has the focus, it receives the keys without modifiers.
    pub(super) fn handle_shortcuts(&mut self, ctx: &Context) {
        let typing = ctx.egui_wants_keyboard_input();
        for shortcut in &SHORTCUTS {
            let applies = !typing || shortcut.keys.modifiers.command || is_function_key(shortcut.keys.logical_key);
            if applies && ctx.input_mut(|input| pressed(input, shortcut)) {
                self.perform(ctx, shortcut.action);
            }
        }
    }

    fn perform(&mut self, ctx: &Context, action: Action) {
        if matches!(action, Action::Save | Action::Open | Action::RenderStill | Action::RenderShot) {
            self.viewport.end_wind_drag(&mut self.session);
        }
        let transport = &mut self.session.transport;
        match action {
            Action::Undo => {
                self.session.document.undo();
            }
            Action::Redo => {
                self.session.document.redo();
            }
            Action::Save => self.files.save(&mut self.session),
            Action::Open => self.files.ask_to_open(ctx, &mut self.session),
            Action::RenderStill => self.files.render_still(ctx, &mut self.session),
            Action::RenderShot => self.files.render_shot(ctx, &mut self.session),
            Action::PlayPause => transport.set_playing(!transport.is_playing()),
            Action::StepBack => transport.step(-1),
            Action::StepForward => transport.step(1),
            Action::FirstFrame => transport.go_to(*transport.range().start()),
            Action::Text => self.visible_panels.text = !self.visible_panels.text,
            Action::PictureOnly => self.visible_panels.picture_only = !self.visible_panels.picture_only,
            Action::Shortcuts => self.visible_panels.shortcuts = !self.visible_panels.shortcuts,
        }
    }
}

fn is_function_key(key: Key) -> bool {
    (Key::F1..=Key::F35).contains(&key)
}

/// The function keys among the shortcuts, as browsers call them. A web page must prevent the browser's default action for them: F12 opens
/// the developer tools.
pub fn function_keys() -> impl Iterator<Item = &'static str> {
    SHORTCUTS.iter().map(|shortcut| shortcut.keys.logical_key).filter(|key| is_function_key(*key)).map(Key::name)
}

/// Whether `shortcut` was pressed. A question mark needs Shift on many keyboards and not on others.
fn pressed(input: &mut egui::InputState, shortcut: &Shortcut) -> bool {
    let shifted = KeyboardShortcut::new(Modifiers::SHIFT, shortcut.keys.logical_key);
    input.consume_shortcut(&shortcut.keys) || (shortcut.action == Action::Shortcuts && input.consume_shortcut(&shifted))
}

/// Shows the window that lists the shortcuts.
pub(super) fn shortcuts_ui(ctx: &Context, open: &mut bool) {
    egui::Window::new("Shortcuts").open(open).resizable(false).show(ctx, |ui| {
        egui::Grid::new("shortcuts").num_columns(2).striped(true).show(ui, |ui| {
            for shortcut in &SHORTCUTS {
                ui.monospace(ctx.format_shortcut(&shortcut.keys));
                ui.label(shortcut.name);
                ui.end_row();
            }
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_shortcut_is_reserved_by_browsers() {
        // Reserved by Chromium and Firefox, with or without Shift: new window, new tab, close tab.
        let reserved = [Key::N, Key::T, Key::W];
        // Help, search, reload, address bar, caret browsing, full screen: by convention pages leave these to the browser.
        let conventional = [Key::F1, Key::F3, Key::F5, Key::F6, Key::F7, Key::F11];
        for Shortcut { keys, name, .. } in &SHORTCUTS {
            let key = keys.logical_key;
            assert!(!keys.modifiers.command || !reserved.contains(&key), "{name}");
            assert!(!conventional.contains(&key), "{name}");
        }
        assert_eq!(function_keys().collect::<Vec<_>>(), ["F2", "F12", "F12"]);
    }
}
