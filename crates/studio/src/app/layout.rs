//! How the window is laid out, kept from one start to the next as one `key value` a line.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use bansho::media::{MediaError, atomic};
use eframe::egui::{Context, Panel, ThemePreference, Ui};

/// Sizes of the panels and what is open.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Layout {
    file: Option<PathBuf>,
    values: BTreeMap<String, f32>,
    /// What was kept last.
    kept: BTreeMap<String, f32>,
}

/// The panel at the bottom, whose size is its height.
const AURORA: &str = "aurora";

/// Under which the theme is kept: 0 as the system's, 1 dark, 2 light.
const THEME: &str = "theme";

impl Layout {
    /// The layout in `home`; the usual one where there is none.
    pub(super) fn read(home: Option<&Path>) -> Self {
        let file = home.map(|home| home.join("layout"));
        let text = file.as_deref().and_then(|file| fs::read_to_string(file).ok()).unwrap_or_default();
        let pair = |line: &str| {
            let (key, value) = line.split_once(' ')?;
            let value = value.parse().ok().filter(|value: &f32| value.is_finite() && *value >= 0.0)?;
            Some((key.to_owned(), value))
        };
        let values: BTreeMap<String, f32> = text.lines().filter_map(pair).collect();
        Self { file, kept: values.clone(), values }
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

    /// Keeps it where it changed.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn keep(&mut self) -> Result<(), MediaError> {
        let Some(file) = self.file.as_ref().filter(|_| self.values != self.kept) else { return Ok(()) };
        let lines: Vec<String> = self.values.iter().map(|(key, value)| format!("{key} {value}")).collect();
        atomic::write_bytes(file, (lines.join("\n") + "\n").as_bytes())?;
        self.kept.clone_from(&self.values);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layout_is_there_again_at_the_next_start() {
        let home = tempfile::tempdir().unwrap();
        let mut layout = Layout::read(Some(home.path()));
        assert_eq!(layout.get("inspector", 330.0), 330.0);
        layout.note("inspector", 412.3);
        layout.keep().unwrap();
        assert_eq!(Layout::read(Some(home.path())).get("inspector", 330.0), 412.0);
        fs::write(home.path().join("layout"), "inspector wide\nscene -3\ntext 1\n").unwrap();
        let damaged = Layout::read(Some(home.path()));
        assert_eq!(
            [damaged.get("inspector", 5.0), damaged.get("scene", 6.0), damaged.get("text", 0.0)],
            [5.0, 6.0, 1.0]
        );
        assert!(Layout::read(None).keep().is_ok());
    }
}
