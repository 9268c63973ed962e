//! Unsaved work outlives a crash: it is kept in a folder of the user's while it is unsaved, and offered at the next start.
//!
//! Each running studio holds a lock on a file of its own, so that a living one's work is not mistaken for a dead one's.

use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use bansho::media::{MediaError, atomic};

use super::Document;

/// Where a running studio keeps its unsaved work.
#[derive(Debug)]
pub struct Autosave {
    kept: PathBuf,
    lock: PathBuf,
    _held: File,
}

/// Unsaved work of a studio that did not end well.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recovered {
    /// The file it belongs to; empty for work that was never saved.
    pub origin: String,
    /// The text.
    pub text: String,
    /// The file that it is kept in, or the browser's name for it.
    pub(crate) kept_in: PathBuf,
}

/// Begins the first line of kept work; the origin follows.
const HEADING: &str = "# unsaved work of the studio on: ";

impl Autosave {
    /// Keeps work in `folder`, under a name that begins with `session` and that no other running studio has.
    ///
    /// # Errors
    /// The folder cannot be made or written.
    pub fn begin(folder: &Path, session: &str) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        let mut number = 0;
        loop {
            let lock = folder.join(format!("{session}-{number}.lock"));
            let held = File::create(&lock)?;
            if held.try_lock().is_ok() && !lock.with_extension("toml").exists() {
                return Ok(Self { kept: lock.with_extension("toml"), lock, _held: held });
            }
            number += 1;
        }
    }

    /// Keeps what is unsaved, or nothing where nothing is.
    ///
    /// # Errors
    /// The work cannot be written.
    pub fn keep(&self, document: &Document, origin: Option<&Path>) -> Result<(), MediaError> {
        if !document.is_dirty() {
            // Nothing kept is nothing to remove.
            let _ = fs::remove_file(&self.kept);
            return Ok(());
        }
        let origin = origin.map(|path| path.display().to_string()).unwrap_or_default();
        atomic::write_bytes(&self.kept, kept(&origin, document.text()).as_bytes())
    }

    /// Ends well: nothing is left to recover.
    pub fn end(self) {
        // What cannot be removed is offered at the next start, which does no harm.
        let _ = fs::remove_file(&self.kept);
        let _ = fs::remove_file(&self.lock);
    }
}

/// Work of `origin` as it is kept.
pub fn kept(origin: &str, text: &str) -> String {
    format!("{HEADING}{origin}\n{text}")
}

/// The work in `folder` that no running studio holds.
pub fn recoverable(folder: &Path) -> Vec<Recovered> {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml") && !is_held(path));
    files.sort();
    files.into_iter().filter_map(read).collect()
}

fn is_held(kept: &Path) -> bool {
    File::open(kept.with_extension("lock")).is_ok_and(|lock| lock.try_lock().is_err())
}

fn read(file: PathBuf) -> Option<Recovered> {
    let recovered = Recovered::of(&fs::read_to_string(&file).ok()?)?;
    Some(Recovered { kept_in: file, ..recovered })
}

impl Recovered {
    /// Work as it was [`kept`], in no file.
    pub fn of(kept: &str) -> Option<Self> {
        let (heading, text) = kept.split_once('\n')?;
        let origin = heading.strip_prefix(HEADING)?;
        Some(Self { origin: origin.to_owned(), text: text.to_owned(), kept_in: PathBuf::new() })
    }

    /// Forgets it, once it is open again or not wanted.
    pub fn forget(&self) {
        // What cannot be removed is offered again, which does no harm.
        let _ = fs::remove_file(&self.kept_in);
        let _ = fs::remove_file(self.kept_in.with_extension("lock"));
    }
}
