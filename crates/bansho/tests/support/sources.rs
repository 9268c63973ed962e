//! Tables of the book's pages, and items of the workspace's sources that they name.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::{
    fs,
    path::{Path, PathBuf},
};

const CRATES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The folder of the sources of a crate.
pub(crate) fn crate_source(in_crate: &str) -> PathBuf {
    Path::new(CRATES).join(in_crate).join("src")
}

pub(crate) fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The cells of a table's row; `\|` is part of a cell.
pub(crate) fn cells(row: &str) -> Vec<String> {
    let row = row.replace("\\|", "\u{0}");
    row.trim().trim_matches('|').split('|').map(|cell| cell.trim().replace('\u{0}', "|")).collect()
}

/// Whether an item exists: in the file of the module that its path names, or anywhere in the crate if that file re-exports it.
pub(crate) fn exists(in_crate: &str, path: &str) -> bool {
    let mut segments: Vec<&str> = path.split("::").collect();
    let mut in_crate = in_crate;
    if let Some(other) = segments[0].strip_prefix("bansho_") {
        in_crate = other;
        segments.remove(0);
    }
    let root = crate_source(in_crate);
    let Some((file, items)) = split_module(&root, &segments) else { return false };
    let source = read(&file);
    if items.iter().all(|item| declares(&source, item)) {
        return true;
    }
    let is_exported = items.first().is_some_and(|item| re_exports(&source, item));
    let sources: Vec<String> = rust_files(&root).iter().map(|file| read(file)).collect();
    is_exported && items.iter().all(|item| sources.iter().any(|source| declares(source, item)))
}

/// The file of the longest module path with which the segments begin, and the items after it.
fn split_module<'a>(root: &Path, segments: &'a [&'a str]) -> Option<(PathBuf, &'a [&'a str])> {
    (0..segments.len()).rev().find_map(|count| {
        let folder = segments[..count].iter().fold(root.to_owned(), |path, segment| path.join(segment));
        let mut files = vec![folder.join("mod.rs"), folder.with_extension("rs")];
        if count == 0 {
            files = vec![root.join("lib.rs")];
        }
        files.into_iter().find(|file| file.is_file()).map(|file| (file, &segments[count..]))
    })
}

/// Whether a source declares an item of that name.
fn declares(source: &str, name: &str) -> bool {
    ["fn", "struct", "enum", "trait", "const", "static", "type"]
        .iter()
        .any(|kind| has_words(source, &format!("{kind} {name}")))
}

/// Whether a source re-exports a name.
fn re_exports(source: &str, name: &str) -> bool {
    let uses = source.split(';').filter_map(|statement| statement.split_once("pub").map(|(_, rest)| rest));
    uses.filter(|statement| statement.contains("use ")).any(|statement| has_words(statement, name))
}

/// Whether a text contains the words, not as part of longer ones.
pub(crate) fn has_words(text: &str, words: &str) -> bool {
    let is_part_of_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    text.match_indices(words).any(|(start, _)| {
        let before = text[..start].chars().next_back();
        let after = text[start + words.len()..].chars().next();
        !before.is_some_and(is_part_of_word) && !after.is_some_and(is_part_of_word)
    })
}

/// All source files below a folder.
pub(crate) fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let paths = entries.map(|entry| entry.unwrap_or_else(|error| panic!("{}: {error}", folder.display())).path());
    paths
        .flat_map(|path| if path.is_dir() { rust_files(&path) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .collect()
}
