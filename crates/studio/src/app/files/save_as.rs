//! Save As: relative paths in the scene are adjusted so that they name the same files from the new folder, and bundled files of an
//! example are written beside the scene.

use std::{
    path::{Component, Path, PathBuf},
    sync::Arc,
};

use bansho::{
    base::parameters::Value,
    media::MediaError,
    scene::{
        edit::EditError,
        operation::{self, Operation},
    },
};

use crate::{
    document::{FileReference, files, named_files},
    session::{Session, folder},
};

/// Why a scene cannot be saved in another folder.
#[derive(Debug, thiserror::Error)]
pub(super) enum SaveAsError {
    /// A bundled file cannot be written beside the scene.
    #[error(transparent)]
    Media(#[from] MediaError),
    /// Relative paths must be adjusted, but the text cannot be edited.
    #[error(
        "the scene names files, and their paths cannot be adjusted to another folder: {0}; correct the text, or undo first"
    )]
    Edit(#[from] EditError),
}

/// The scene's text for the file `to`, with relative paths adjusted so that they name the same files. The document is not changed.
///
/// # Errors
/// A bundled file cannot be written beside the scene, or a path must be adjusted in a text that is not TOML.
pub(super) fn with_moved_paths(session: &Session, to: &Path) -> Result<Arc<str>, SaveAsError> {
    let before = folder(session.path.as_deref()).to_path_buf();
    let after = folder(Some(to)).to_path_buf();
    let mut operations = Vec::new();
    for FileReference { parameter, file: name } in named_files(session.document.values()) {
        if Path::new(&name).is_absolute() {
            continue;
        }
        let bundled_file = if session.path.is_none() { session.bundled_file(&name) } else { None };
        let new = match bundled_file {
            Some(bytes) => write_bundled_file(&name, &bytes, &after)?,
            None => path_from_new_folder(&name, &before, &after),
        };
        if new != name {
            operations.push(Operation::Set { path: parameter, value: Value::Text(new) });
        }
    }
    let text = session.document.text();
    Ok(if operations.is_empty() { text.clone() } else { operation::apply(text, &operations)?.into() })
}

/// Writes `bytes` as `name` into `folder`, or under a numbered name where another file has that name. Returns the name.
fn write_bundled_file(name: &str, bytes: &[u8], folder: &Path) -> Result<String, MediaError> {
    let (stem, ending) = name.split_at(name.rfind('.').unwrap_or(name.len()));
    let file = files::write_to_free_name(|suffix| folder.join(format!("{stem}{suffix}{ending}")), bytes)?;
    let relative = file.strip_prefix(folder).unwrap_or(&file);
    Ok(relative.to_string_lossy().replace('\\', "/"))
}

/// The path from the folder `after` to the file `name` in the folder `before`; `name` itself where there is no such file.
fn path_from_new_folder(name: &str, before: &Path, after: &Path) -> String {
    let old = before.join(name);
    // The name may be a pattern of frame numbers, so only its folder is checked.
    let found =
        old.parent().zip(old.file_name()).filter(|(folder, _)| folder.as_os_str().is_empty() || folder.is_dir());
    let Some((file, after)) = found.and_then(|(folder, file)| Some((absolute(folder)?.join(file), absolute(after)?)))
    else {
        return name.to_owned();
    };
    relative_path(&file, &after).to_string_lossy().replace('\\', "/")
}

/// A folder, which may be the current one, as an absolute path.
fn absolute(folder: &Path) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    // The new folder may not exist yet.
    folder.canonicalize().or_else(|_| std::path::absolute(folder)).ok()
}

/// The relative path from `folder` to `file`, which are absolute; `file` itself where only the root is common.
fn relative_path(file: &Path, folder: &Path) -> PathBuf {
    let shared = file.components().zip(folder.components()).take_while(|(one, other)| one == other);
    let (shared, names) = shared
        .fold((0, 0), |(all, names), (own, _)| (all + 1, names + usize::from(matches!(own, Component::Normal(_)))));
    if names == 0 {
        return file.to_path_buf();
    }
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(file.components().skip(shared)).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn relative_paths_go_up_and_down_or_are_absolute() {
        let path = |file: &str, folder: &str| relative_path(Path::new(file), Path::new(folder));
        assert_eq!(path("/a/b/c.png", "/a/b"), Path::new("c.png"));
        assert_eq!(path("/a/plates/c.png", "/a/b/d"), Path::new("../../plates/c.png"));
        assert_eq!(path("/a/c.png", "/b"), Path::new("/a/c.png"));
    }

    #[test]
    fn bundled_files_replace_no_other_file() {
        let folder = tempfile::tempdir().unwrap();
        let lay = |bytes: &[u8]| write_bundled_file("plates/a.png", bytes, folder.path()).unwrap();
        assert_eq!([lay(b"one"), lay(b"one"), lay(b"two")], ["plates/a.png", "plates/a.png", "plates/a 2.png"]);
        assert_eq!(fs::read(folder.path().join("plates/a.png")).unwrap(), b"one");
        fs::write(folder.path().join("file"), "").unwrap();
        write_bundled_file("a.png", b"one", &folder.path().join("file")).unwrap_err();
    }

    #[test]
    fn files_are_found_from_another_folder_and_missing_ones_stay() {
        let folder = tempfile::tempdir().unwrap();
        let (old, new) = (folder.path().join("old/plates"), folder.path().join("new"));
        fs::create_dir_all(&old).unwrap();
        let from = |name: &str| path_from_new_folder(name, &folder.path().join("old"), &new);
        assert_eq!(from("plates/c.####.png"), "../old/plates/c.####.png");
        assert_eq!(from("nowhere/c.png"), "nowhere/c.png");
    }
}
