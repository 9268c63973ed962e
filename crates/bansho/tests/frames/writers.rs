//! Every file that is written is written under a policy, by `media/files/atomic.rs`: no code outside of tests creates, replaces, renames or removes files by
//! itself, other than in the places that are listed here with the reason.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// What writes, or allows writing over anything.
const WRITERS: [&str; 16] = [
    "fs::write(",
    "File::create",
    "File::options",
    "OpenOptions::new",
    "fs::copy(",
    "fs::rename(",
    "fs::hard_link(",
    "::symlink(",
    "fs::remove_file(",
    "fs::remove_dir",
    "set_permissions(",
    ".persist(",
    ".persist_noclobber(",
    "generate_to(",
    "tempfile_in(",
    "OverwritePolicy::any()",
];

/// Places that may, each with the number of times.
const ALLOWED: [(&str, &str, usize); 15] = [
    // The writer itself, which has asked the policy.
    ("media/src/files/atomic.rs", "set_permissions(", 1),
    ("media/src/files/atomic.rs", ".persist(", 1),
    ("media/src/files/atomic.rs", ".persist_noclobber(", 1),
    ("media/src/files/atomic.rs", "tempfile_in(", 1),
    // Its own unfinished files.
    ("media/src/files/atomic.rs", "fs::remove_file(", 1),
    // Files without a name.
    ("media/src/film/gif.rs", "tempfile_in(", 1),
    ("bansho/src/job/checks/outputs.rs", "tempfile_in(", 1),
    // Journals are files of a new name, which no link can have.
    ("farm/src/journal.rs", "OpenOptions::new", 1),
    // The index of an earlier run, which the policy allows to replace.
    ("bansho/src/job/streaks/mod.rs", "fs::remove_file(", 1),
    // A scene is saved where the user says, who is asked before another file is replaced.
    ("studio/src/document/files/mod.rs", "OverwritePolicy::any()", 2),
    // The studio's own files in its own folder, without following links.
    ("studio/src/document/files/autosave.rs", "OverwritePolicy::any()", 1),
    ("studio/src/session/settings_store.rs", "OverwritePolicy::any()", 1),
    // Locks, whose contents stay.
    ("studio/src/document/files/autosave.rs", "OpenOptions::new", 1),
    ("studio/src/document/files/autosave.rs", "fs::remove_file(", 6),
    // Examples are embedded when the program is built.
    ("example_scenes/build.rs", "fs::write(", 1),
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, name) = (entry.path(), entry.file_name().into_string().unwrap());
        let is_for_tests =
            ["tests", "tests.rs", "testing.rs", "benches", "examples", "target"].contains(&name.as_str());
        if is_for_tests {
            continue;
        }
        if path.is_dir() {
            sources(&path, found);
        } else if name.ends_with(".rs") {
            found.push(path);
        }
    }
}

/// The code of a file without the module of its tests and without comments.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let code =
        text.split("\n#[cfg(test)]\nmod ").next().unwrap().split("\n#[cfg(test)]\npub(crate) mod ").next().unwrap();
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    // The writer that asks the policy.
    lines.map(|line| format!("{}\n", line.replace("AtomicFile::create(", "AtomicFile("))).collect()
}

#[test]
fn nothing_is_written_but_under_a_policy() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut files = Vec::new();
    sources(crates, &mut files);
    assert!(files.len() > 300, "{}", files.len());
    let mut problems = Vec::new();
    for file in files {
        let (name, code) = (file.strip_prefix(crates).unwrap().to_str().unwrap().replace('\\', "/"), code(&file));
        for writer in WRITERS {
            let count = code.matches(writer).count();
            let allowed = ALLOWED.iter().find(|(file, allowed, _)| (*file, *allowed) == (name.as_str(), writer));
            let allowed = allowed.map_or(0, |(.., count)| *count);
            if count != allowed {
                problems.push(format!("{name}: `{writer}` {count} times; allowed: {allowed}"));
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}
