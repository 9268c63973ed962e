//! The journals of tasks: a small file for each attempt at a task, one JSON object a line.
//!
//! A journal has durations and no times of day, since the clocks of machines differ. Frames are counted by their files, never by journals: these only tell
//! how long frames take, and why a task ended.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use bansho::media::files::input;
use serde::{Deserialize, Serialize};

/// What a journal is about: `check`, `snapshots`, `finish`, or a task by its number.
pub fn task_name(task: usize) -> String {
    format!("task-{task}")
}

/// A line of a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "lowercase")]
pub enum JournalEvent {
    /// The task begins.
    Start {
        /// The name of the machine.
        node: String,
        /// The token of its plan.
        token: String,
        /// Number of frames.
        frames: usize,
        /// Number of frames that existed already.
        kept: usize,
        /// Number of threads.
        threads: usize,
    },
    /// A frame is complete in its file.
    Frame {
        /// Its number.
        number: i64,
        /// Time since the task began, s.
        seconds: f64,
    },
    /// The task ends by itself. A task that was killed has no such line.
    End {
        /// Its exit code.
        code: u8,
        /// The error, if there was one.
        message: Option<String>,
        /// Time since it began, s.
        seconds: f64,
        /// Time of all its threads on a core, s, where the system tells it.
        cpu_seconds: Option<f64>,
    },
}

/// Writes the journal of one attempt at a task.
#[derive(Debug)]
pub struct Journal {
    file: Mutex<File>,
}

/// Largest journal that is read, bytes: a million frames.
const JOURNAL_BYTES: u64 = 128 << 20;
/// Largest number of attempts at a task.
const MAX_ATTEMPTS: usize = 10_000;

impl Journal {
    /// Begins the journal of the next attempt at task `name` in `folder`.
    ///
    /// # Errors
    /// It cannot be created.
    pub fn create(folder: &Path, name: &str) -> io::Result<Self> {
        for attempt in 0..MAX_ATTEMPTS {
            let path = folder.join(format!("{name}.{attempt}.jsonl"));
            match OpenOptions::new().append(true).create_new(true).open(&path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                opened => return Ok(Self { file: Mutex::new(opened?) }),
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }

    /// Adds a line.
    ///
    /// # Errors
    /// It cannot be written. Frames do not depend on it.
    pub fn write(&self, event: &JournalEvent) -> io::Result<()> {
        let line = format!("{}\n", serde_json::to_string(event)?);
        self.file.lock().unwrap_or_else(PoisonError::into_inner).write_all(line.as_bytes())
    }
}

/// An attempt at a task, as its journal tells it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Attempt {
    /// The name of the machine.
    pub node: String,
    /// The token of its plan.
    #[serde(skip)]
    pub token: String,
    /// Number of frames that it drew.
    pub drawn: usize,
    /// Time until the last line, s.
    pub seconds: f64,
    /// Its exit code; `None` if it did not end by itself.
    pub code: Option<u8>,
    /// Why it failed.
    pub message: Option<String>,
    /// Time of its threads, s.
    pub cpu_seconds: Option<f64>,
}

impl Attempt {
    fn read(text: &str) -> Self {
        let mut attempt = Self::default();
        // A line that was cut by a full disk or a kill is left out.
        for event in text.lines().filter_map(|line| serde_json::from_str(line).ok()) {
            match event {
                JournalEvent::Start { node, token, .. } => (attempt.node, attempt.token) = (node, token),
                JournalEvent::Frame { seconds, .. } => {
                    attempt.drawn += 1;
                    attempt.seconds = seconds;
                }
                JournalEvent::End { code, message, seconds, cpu_seconds } => {
                    (attempt.code, attempt.message) = (Some(code), message);
                    (attempt.seconds, attempt.cpu_seconds) = (seconds, cpu_seconds);
                }
            }
        }
        attempt
    }
}

/// The attempts at each task, in their order.
pub type Attempts = BTreeMap<String, Vec<Attempt>>;

/// Reads all journals of a folder; none if there is no folder. A journal that cannot be read is left out.
pub fn read(folder: &Path) -> Attempts {
    let mut journals: Vec<(String, usize, PathBuf)> = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let parts = name.strip_suffix(".jsonl").and_then(|name| name.rsplit_once('.'));
        if let Some((task, Ok(attempt))) = parts.map(|(task, attempt)| (task, attempt.parse())) {
            journals.push((task.to_owned(), attempt, entry.path()));
        }
    }
    // By number, not by name: attempt 10 comes after attempt 9.
    journals.sort();
    let mut attempts = Attempts::new();
    for (task, _, path) in journals {
        let text = input::read(&path, JOURNAL_BYTES).map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        attempts.entry(task).or_default().extend(text.map(|text| Attempt::read(&text)));
    }
    attempts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start() -> JournalEvent {
        JournalEvent::Start { node: "n1".into(), token: "t".into(), frames: 3, kept: 1, threads: 2 }
    }

    #[test]
    fn attempts_are_read_in_their_order_and_cut_lines_left_out() {
        let folder = tempfile::tempdir().unwrap();
        assert!(read(&folder.path().join("missing")).is_empty());
        for attempt in 0..11 {
            let journal = Journal::create(folder.path(), "task-7").unwrap();
            journal.write(&start()).unwrap();
            journal.write(&JournalEvent::Frame { number: 3, seconds: f64::from(attempt) }).unwrap();
        }
        let last = Journal::create(folder.path(), "task-7").unwrap();
        last.write(&start()).unwrap();
        let end =
            JournalEvent::End { code: 143, message: Some("stopped".into()), seconds: 9.5, cpu_seconds: Some(12.0) };
        last.write(&end).unwrap();
        fs::write(
            folder.path().join("task-8.0.jsonl"),
            "{\"event\":\"frame\",\"number\":1,\"seconds\":2}\n{\"event\":\"fra",
        )
        .unwrap();
        fs::write(folder.path().join("notes.txt"), "mine").unwrap();
        let attempts = read(folder.path());
        assert_eq!(attempts.len(), 2);
        let seven = &attempts["task-7"];
        let times: Vec<f64> = seven.iter().map(|attempt| attempt.seconds).collect();
        assert_eq!(times, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 9.5]);
        assert_eq!((seven[0].code, seven[11].code, seven[11].node.as_str()), (None, Some(143), "n1"));
        assert_eq!((attempts["task-8"][0].drawn, attempts["task-8"][0].code), (1, None));
    }
}
