//! Watches a file for changes by other programs: a thread polls its modification time and length.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, SystemTime},
};

/// Polling interval.
const POLL_INTERVAL: Duration = Duration::from_millis(700);

/// Watches one file until it is dropped.
#[derive(Debug)]
pub struct FileWatcher {
    path: PathBuf,
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    modified: AtomicBool,
    closing: AtomicBool,
}

/// Modification time and length.
fn modification_stamp(path: &Path) -> Option<(SystemTime, u64)> {
    let about = fs::metadata(path).ok()?;
    Some((about.modified().ok()?, about.len()))
}

impl FileWatcher {
    /// Starts watching `path`; `wake` is called from another thread after each modification.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(path: &Path, wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let (watched, flags) = (path.to_path_buf(), shared.clone());
        thread::Builder::new().name("watch".into()).spawn(move || {
            let mut last = modification_stamp(&watched);
            while !flags.closing.load(Ordering::Relaxed) {
                thread::sleep(POLL_INTERVAL);
                let now = modification_stamp(&watched);
                if now != last {
                    last = now;
                    flags.modified.store(true, Ordering::Relaxed);
                    wake();
                }
            }
        })?;
        Ok(Self { path: path.to_path_buf(), shared })
    }

    /// The watched file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the file was modified since the last call.
    pub fn take_modified(&self) -> bool {
        self.shared.modified.swap(false, Ordering::Relaxed)
    }
}

impl Drop for FileWatcher {
    fn drop(&mut self) {
        self.shared.closing.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn a_modification_is_reported_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        fs::write(&path, "bansho = 2\n").unwrap();
        let (sender, woken) = mpsc::channel();
        let watch = FileWatcher::start(&path, move || sender.send(()).unwrap_or_default()).unwrap();
        assert!(!watch.take_modified());
        // The thread may have polled for the first time before or after this.
        thread::sleep(Duration::from_millis(200));
        fs::write(&path, "bansho = 2 # longer\n").unwrap();
        woken.recv_timeout(Duration::from_secs(20)).unwrap();
        assert!(watch.take_modified() && !watch.take_modified());
    }
}
