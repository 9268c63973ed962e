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
    document::{files, named_files},
    session::{Session, folder},
};

/// Why a scene cannot be saved in another folder.
#[derive(Debug, thiserror::Error)]
pub(super) enum SaveAsError {
    /// A file that must lie beside the scene cannot be written.
    #[error(transparent)]
    Media(#[from] MediaError),
    /// Its paths lead elsewhere from there, and cannot be changed.
    #[error(
        "the scene names files, and their paths cannot be made right for another folder: {0}; mend the text, or undo first"
    )]
    Edit(#[from] EditError),
}

/// The scene's text as it must be in the file `to`, where all paths of it lead to the same files. The scene itself stays as it is.
///
/// # Errors
/// A file that must lie beside the scene cannot be written, or a path must be changed in a text that is no TOML.
pub(super) fn with_moved_paths(session: &Session, to: &Path) -> Result<Arc<str>, SaveAsError> {
    let before = folder(session.path.as_deref()).to_path_buf();
    let after = folder(Some(to)).to_path_buf();
    let mut operations = Vec::new();
    for (place, name) in named_files(session.document.values()) {
        if Path::new(&name).is_absolute() {
            continue;
        }
        let bundled_file = if session.path.is_none() { session.bundled_file(&name) } else { None };
        let new = match bundled_file {
            Some(bytes) => write_bundled_file(&name, bytes, &after)?,
            None => path_from_new_folder(&name, &before, &after),
        };
        if new != name {
            operations.push(Operation::Set { path: place, value: Value::Text(new) });
        }
    }
    let text = session.document.text();
    Ok(if operations.is_empty() { text.clone() } else { operation::apply(text, &operations)?.into() })
}

/// Writes `bytes` as `name` into `folder`, or under a free name where another file has that; what it is called there.
fn write_bundled_file(name: &str, bytes: &[u8], folder: &Path) -> Result<String, MediaError> {
    let (stem, ending) = name.split_at(name.rfind('.').unwrap_or(name.len()));
    let file = files::write_beside(|which| folder.join(format!("{stem}{which}{ending}")), bytes)?;
    let own = file.strip_prefix(folder).unwrap_or(&file);
    Ok(own.to_string_lossy().replace('\\', "/"))
}

/// What a scene in `after` calls the file that one in `before` calls `name`; the same where there is no such file.
fn path_from_new_folder(name: &str, before: &Path, after: &Path) -> String {
    let old = before.join(name);
    let whole = |folder: &Path| {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        // The scene's new folder may have to be made yet.
        folder.canonicalize().or_else(|_| std::path::absolute(folder)).ok()
    };
    // The file itself may be one of many, by a pattern.
    let found =
        old.parent().zip(old.file_name()).filter(|(folder, _)| folder.as_os_str().is_empty() || folder.is_dir());
    let Some((file, after)) = found.and_then(|(folder, file)| Some((whole(folder)?.join(file), whole(after)?))) else {
        return name.to_owned();
    };
    relative_path(&file, &after).to_string_lossy().replace('\\', "/")
}

/// The way from `folder` to `file`, both whole; `file` itself where they share nothing but a root.
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
    fn ways_lead_up_and_down_or_are_whole() {
        let way = |file: &str, folder: &str| relative_path(Path::new(file), Path::new(folder));
        assert_eq!(way("/a/b/c.png", "/a/b"), Path::new("c.png"));
        assert_eq!(way("/a/plates/c.png", "/a/b/d"), Path::new("../../plates/c.png"));
        assert_eq!(way("/a/c.png", "/b"), Path::new("/a/c.png"));
    }

    #[test]
    fn what_is_write_bundled_file_spoils_no_other_file() {
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
