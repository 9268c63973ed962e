//! A file dialog.

use std::path::{Path, PathBuf};

use eframe::egui::{self, Ui};

/// A file dialog: a folder and a name in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct FileDialog {
    folder: PathBuf,
    name: String,
    /// The extensions of listed files.
    extensions: &'static [&'static str],
    /// The entries of the folder: folders first, then files.
    entries: Vec<Entry>,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Entry {
    Folder(String),
    File(String),
}

/// Extensions of scenes.
const SCENES: &[&str] = &[".toml"];

/// Extensions of assets: plates, drawings and meshes.
const ASSETS: &[&str] = &[".png", ".jpg", ".jpeg", ".exr", ".webp", ".tif", ".tiff", ".svg", ".svgz", ".glb", ".gltf"];

impl FileDialog {
    /// Starts in the folder of `path`, or in the working directory.
    pub(super) fn in_folder_of(path: Option<&Path>) -> Self {
        let folder = path.and_then(Path::parent).unwrap_or(Path::new("."));
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
        let mut dialog = Self { folder, name: String::new(), extensions: SCENES, entries: Vec::new() };
        dialog.read();
        dialog
    }

    /// The same dialog with an initial name.
    #[must_use]
    pub(super) fn with_name(self, name: String) -> Self {
        Self { name, ..self }
    }

    /// The same dialog for assets.
    #[must_use]
    pub(super) fn for_assets(self) -> Self {
        let mut dialog = Self { extensions: ASSETS, ..self };
        dialog.read();
        dialog
    }

    /// The chosen file. A path may be typed as the name.
    pub(super) fn path(&self) -> PathBuf {
        self.folder.join(self.name.trim())
    }

    /// Reads the entries of the folder; none where it cannot be read.
    fn read(&mut self) {
        let mut entries = Vec::new();
        for found in std::fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            let Some(name) = found.file_name().into_string().ok().filter(|name| !name.starts_with('.')) else {
                continue;
            };
            let lowercase = name.to_ascii_lowercase();
            if found.path().is_dir() {
                entries.push(Entry::Folder(name));
            } else if self.extensions.iter().any(|extension| lowercase.ends_with(extension)) {
                entries.push(Entry::File(name));
            }
        }
        entries.sort();
        self.entries = entries;
    }

    fn go_to(&mut self, folder: PathBuf) {
        self.folder = folder;
        self.read();
    }

    /// Shows the dialog. Returns whether a file was double-clicked.
    pub(super) fn ui(&mut self, ui: &mut Ui, title: &str) -> bool {
        ui.set_width(460.0);
        ui.heading(title);
        ui.horizontal(|ui| {
            let parent = self.folder.parent().map(Path::to_path_buf);
            let up = ui.add_enabled(parent.is_some(), egui::Button::new("Up"));
            if let Some(parent) = parent.filter(|_| up.on_hover_text("The folder above").clicked()) {
                self.go_to(parent);
            }
            ui.weak(self.folder.display().to_string());
        });
        let chosen =
            egui::ScrollArea::vertical().max_height(320.0).auto_shrink([false, true]).show(ui, |ui| self.list_ui(ui));
        let label = ui.label("Name").id;
        ui.add(egui::TextEdit::singleline(&mut self.name).desired_width(f32::INFINITY)).labelled_by(label);
        chosen.inner
    }

    fn list_ui(&mut self, ui: &mut Ui) -> bool {
        let (mut chosen, mut entered) = (false, None);
        for entry in &self.entries {
            match entry {
                Entry::Folder(name) => {
                    if ui.selectable_label(false, format!("{name}/")).clicked() {
                        entered = Some(self.folder.join(name));
                    }
                }
                Entry::File(name) => {
                    let response = ui.selectable_label(self.name == *name, name);
                    if response.clicked() {
                        self.name.clone_from(name);
                    }
                    chosen |= response.double_clicked();
                }
            }
        }
        if let Some(folder) = entered {
            self.go_to(folder);
        }
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_come_first_and_only_files_of_the_kind_are_listed() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("zoo")).unwrap();
        for name in ["b.toml", "a.toml", "picture.png", ".hidden.toml"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let mut dialog = FileDialog::in_folder_of(Some(&folder.path().join("b.toml")));
        let listed = [Entry::Folder("zoo".into()), Entry::File("a.toml".into()), Entry::File("b.toml".into())];
        assert_eq!(dialog.entries, listed);
        let pictures = dialog.clone().for_assets();
        assert_eq!(pictures.entries, [Entry::Folder("zoo".into()), Entry::File("picture.png".into())]);
        dialog.go_to(folder.path().join("zoo"));
        assert!(dialog.entries.is_empty());
        assert_eq!(dialog.with_name("c.toml".into()).path(), folder.path().join("zoo/c.toml"));
    }
}
