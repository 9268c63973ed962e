//! How the window is laid out, kept from one start to the next as one `key value` a line.

use std::collections::BTreeMap;

use eframe::egui::{Context, Panel, ThemePreference, Ui};

use crate::session::settings_store::SettingsStore;

/// Sizes of the panels and what is open.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Layout {
    store: SettingsStore,
    values: BTreeMap<String, f32>,
    /// What was kept last.
    kept: BTreeMap<String, f32>,
}

/// What it is kept as.
const NAME: &str = "layout";

/// Width and height of the window.
const WINDOW: [&str; 2] = ["window width", "window height"];

/// Smaller windows are on their way in or out, points of the screen.
const SMALLEST: f32 = 200.0;

/// The panel at the bottom, whose size is its height.
const AURORA: &str = "aurora";

/// Under which the theme is kept: 0 as the system's, 1 dark, 2 light.
const THEME: &str = "theme";

impl Layout {
    /// The layout in `store`; the usual one where there is none.
    pub(super) fn read(store: SettingsStore) -> Self {
        let text = store.read(NAME).unwrap_or_default();
        let pair = |line: &str| {
            let (key, value) = line.rsplit_once(' ')?;
            let value = value.parse().ok().filter(|value: &f32| value.is_finite() && *value >= 0.0)?;
            Some((key.to_owned(), value))
        };
        let values: BTreeMap<String, f32> = text.lines().filter_map(pair).collect();
        Self { store, kept: values.clone(), values }
    }

    /// The value of `key`, or what is usual.
    pub(super) fn get(&self, key: &str, usual: f32) -> f32 {
        self.values.get(key).copied().unwrap_or(usual)
    }

    /// Notes what it is now.
    pub(super) fn note(&mut self, key: &str, value: f32) {
        self.values.insert(key.to_owned(), value.round());
    }

    /// Shows `panel` as large as it was last, or as `usual`, and notes how large it is now.
    pub(super) fn panel(&mut self, key: &str, panel: Panel, usual: f32, ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
        let sideways = key != AURORA;
        let shown = panel.default_size(self.get(key, usual)).show(ui, add).response.rect;
        self.note(key, if sideways { shown.width() } else { shown.height() });
    }

    /// Dark unless it was chosen otherwise.
    pub(super) fn apply_theme(&self, ctx: &Context) {
        ctx.set_theme(match self.get(THEME, 1.0) as u32 {
            0 => ThemePreference::System,
            2 => ThemePreference::Light,
            _ => ThemePreference::Dark,
        });
    }

    /// Notes the theme that is chosen now.
    pub(super) fn note_theme(&mut self, ctx: &Context) {
        let theme = match ctx.options(|options| options.theme_preference) {
            ThemePreference::System => 0.0,
            ThemePreference::Dark => 1.0,
            ThemePreference::Light => 2.0,
        };
        self.note(THEME, theme);
    }

    /// How large the window was last.
    pub(super) fn window_size(&self) -> [f32; 2] {
        [self.get(WINDOW[0], 1400.0), self.get(WINDOW[1], 860.0)]
    }

    /// Notes how large the window is now, unless it fills the screen.
    pub(super) fn note_window(&mut self, ctx: &Context) {
        let (size, fills) = ctx.input(|input| {
            let viewport = input.viewport();
            let fills = viewport.maximized.unwrap_or(false) || viewport.fullscreen.unwrap_or(false);
            (input.content_rect().size(), fills)
        });
        if !fills && size.min_elem() >= SMALLEST {
            self.note(WINDOW[0], size.x);
            self.note(WINDOW[1], size.y);
        }
    }

    /// Keeps it where it changed. One that cannot be kept is the usual one at the next start.
    pub(super) fn keep(&mut self) {
        if self.values == self.kept {
            return;
        }
        let lines: Vec<String> = self.values.iter().map(|(key, value)| format!("{key} {value}\n")).collect();
        if self.store.write(NAME, &lines.concat()) {
            self.kept.clone_from(&self.values);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_layout_is_there_again_at_the_next_start() {
        let home = tempfile::tempdir().unwrap();
        let store = SettingsStore::new(Some(home.path().to_path_buf()));
        let mut layout = Layout::read(store.clone());
        assert_eq!(layout.get("inspector", 330.0), 330.0);
        assert_eq!(layout.window_size(), [1400.0, 860.0]);
        layout.note("inspector", 412.3);
        layout.note(WINDOW[0], 1000.0);
        layout.keep();
        let again = Layout::read(store.clone());
        assert_eq!((again.get("inspector", 330.0), again.window_size()), (412.0, [1000.0, 860.0]));
        fs::write(home.path().join("layout"), "inspector wide\nscene -3\ntext 1\n").unwrap();
        let damaged = Layout::read(store);
        assert_eq!(
            [damaged.get("inspector", 5.0), damaged.get("scene", 6.0), damaged.get("text", 0.0)],
            [5.0, 6.0, 1.0]
        );
        Layout::read(SettingsStore::default()).keep();
    }
}
