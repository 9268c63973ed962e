//! The layout of the window, stored as lines of `key value`.

use std::collections::BTreeMap;

use eframe::egui::{Context, Panel, ThemePreference, Ui};

use crate::session::settings_store::SettingsStore;

/// Sizes of panels and window, open panels, and the theme.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Layout {
    store: SettingsStore,
    values: BTreeMap<String, f32>,
    /// The values stored last.
    stored: BTreeMap<String, f32>,
}

/// Its name in the settings store.
const NAME: &str = "layout";

/// Width and height of the window.
const WINDOW: [&str; 2] = ["window width", "window height"];

/// Smaller window sizes are ignored, since the window is being opened or minimized. Points.
const MIN_WINDOW_SIZE: f32 = 200.0;

/// Key of the theme: 0 as the system's, 1 dark, 2 light.
const THEME: &str = "theme";

impl Layout {
    /// The layout in `store`; the default where there is none.
    pub(super) fn read(store: SettingsStore) -> Self {
        let text = store.read(NAME).unwrap_or_default();
        let mut values = BTreeMap::new();
        for (key, value) in text.lines().filter_map(|line| line.rsplit_once(' ')) {
            // A file that was edited by hand must not make panels that cannot be seen.
            if let Some(value) = value.parse().ok().filter(|value: &f32| value.is_finite() && *value >= 0.0) {
                values.insert(key.to_owned(), value);
            }
        }
        Self { store, stored: values.clone(), values }
    }

    /// The value of `key`, or the default.
    pub(super) fn get(&self, key: &str, default: f32) -> f32 {
        self.values.get(key).copied().unwrap_or(default)
    }

    /// Sets the value of `key`.
    pub(super) fn set(&mut self, key: &str, value: f32) {
        self.values.insert(key.to_owned(), value.round());
    }

    /// Shows `panel` at the left or right with its stored width, or `default`, and records its width. Points.
    pub(super) fn side_panel_ui(
        &mut self,
        key: &str,
        panel: Panel,
        default: f32,
        ui: &mut Ui,
        add: impl FnOnce(&mut Ui),
    ) {
        let shown = panel.default_size(self.get(key, default)).show(ui, add).response.rect;
        self.set(key, shown.width());
    }

    /// Shows `panel` at the bottom with its stored height, or `default`, and records its height. Points.
    pub(super) fn bottom_panel_ui(
        &mut self,
        key: &str,
        panel: Panel,
        default: f32,
        ui: &mut Ui,
        add: impl FnOnce(&mut Ui),
    ) {
        let shown = panel.default_size(self.get(key, default)).show(ui, add).response.rect;
        self.set(key, shown.height());
    }

    /// Applies the stored theme; dark by default.
    pub(super) fn apply_theme(&self, ctx: &Context) {
        ctx.set_theme(match self.get(THEME, 1.0) as u32 {
            0 => ThemePreference::System,
            2 => ThemePreference::Light,
            _ => ThemePreference::Dark,
        });
    }

    /// Records the current theme.
    pub(super) fn record_theme(&mut self, ctx: &Context) {
        let theme = match ctx.options(|options| options.theme_preference) {
            ThemePreference::System => 0.0,
            ThemePreference::Dark => 1.0,
            ThemePreference::Light => 2.0,
        };
        self.set(THEME, theme);
    }

    /// The stored size of the window.
    pub(super) fn window_size(&self) -> [f32; 2] {
        [self.get(WINDOW[0], 1400.0), self.get(WINDOW[1], 860.0)]
    }

    /// Records the size of the window, unless it is maximized.
    pub(super) fn record_window_size(&mut self, ctx: &Context) {
        let (size, is_maximized) = ctx.input(|input| {
            let viewport = input.viewport();
            let is_maximized = viewport.maximized.unwrap_or(false) || viewport.fullscreen.unwrap_or(false);
            (input.content_rect().size(), is_maximized)
        });
        if !is_maximized && size.min_elem() >= MIN_WINDOW_SIZE {
            self.set(WINDOW[0], size.x);
            self.set(WINDOW[1], size.y);
        }
    }

    /// Stores the layout if it changed. If that fails, the next start has the previous layout.
    pub(super) fn save(&mut self) {
        if self.values == self.stored {
            return;
        }
        let lines: Vec<String> = self.values.iter().map(|(key, value)| format!("{key} {value}\n")).collect();
        if self.store.write(NAME, &lines.concat()) {
            self.stored.clone_from(&self.values);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_layout_is_restored_at_the_next_start() {
        let home = tempfile::tempdir().unwrap();
        let store = SettingsStore::new(Some(home.path().to_path_buf()));
        let mut layout = Layout::read(store.clone());
        assert_eq!(layout.get("inspector", 330.0), 330.0);
        assert_eq!(layout.window_size(), [1400.0, 860.0]);
        layout.set("inspector", 412.3);
        layout.set(WINDOW[0], 1000.0);
        layout.save();
        let again = Layout::read(store.clone());
        assert_eq!((again.get("inspector", 330.0), again.window_size()), (412.0, [1000.0, 860.0]));
        fs::write(home.path().join("layout"), "inspector wide\nscene -3\ntext 1\n").unwrap();
        let damaged = Layout::read(store);
        assert_eq!(
            [damaged.get("inspector", 5.0), damaged.get("scene", 6.0), damaged.get("text", 0.0)],
            [5.0, 6.0, 1.0]
        );
        Layout::read(SettingsStore::default()).save();
    }
}
