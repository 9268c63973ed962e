//! Reordering of the frames of a film that several threads render.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::{Mutex, PoisonError},
};

use crate::error::MediaError;

/// An encoder that appends frames to one file.
pub(crate) trait FilmEncoder: Send {
    /// A frame, encoded as far as possible without the other frames.
    type EncodedFrame: Send;

    /// Appends the next frame.
    fn append(&mut self, encoded: Self::EncodedFrame) -> Result<(), MediaError>;

    /// Completes the file and renames it. A dropped encoder leaves no file behind.
    fn finish(self) -> Result<(), MediaError>;
}

/// Accepts frames in any order within a window, and never blocks on a missing one.
pub(crate) struct ReorderBuffer<F: FilmEncoder> {
    path: PathBuf,
    frame_count: usize,
    window: usize,
    state: Mutex<ReorderState<F>>,
}

struct ReorderState<F: FilmEncoder> {
    /// `None` after an error.
    film: Option<F>,
    next: usize,
    waiting: BTreeMap<usize, F::EncodedFrame>,
}

impl<F: FilmEncoder> ReorderBuffer<F> {
    pub(crate) fn new(film: F, path: PathBuf, frame_count: usize, window: usize) -> Self {
        let state = Mutex::new(ReorderState { film: Some(film), next: 0, waiting: BTreeMap::new() });
        Self { path, frame_count, window: window.max(1), state }
    }

    /// Appends the frame at position `index`, as soon as all frames before it have been appended.
    pub(crate) fn push(&self, index: usize, encoded: F::EncodedFrame) -> Result<(), MediaError> {
        // A poisoned lock is usable: a panic can at worst leave the film incomplete, and then it is never renamed.
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let state = &mut *state;
        let Some(film) = &mut state.film else {
            return Err(MediaError::AlreadyFailed { path: self.path.clone() });
        };
        // Frames that wait are in memory, which the window bounds.
        let end = self.frame_count.min(state.next + self.window);
        if !(state.next..end).contains(&index) || state.waiting.contains_key(&index) {
            return Err(MediaError::OutOfOrder {
                path: self.path.clone(),
                index,
                next: state.next,
                window: self.window,
            });
        }
        state.waiting.insert(index, encoded);
        while let Some(encoded) = state.waiting.remove(&state.next) {
            // A film with a gap is of no use: it is dropped at once, with its temporary file.
            if let Err(error) = film.append(encoded) {
                state.film = None;
                state.waiting.clear();
                return Err(error);
            }
            state.next += 1;
        }
        Ok(())
    }

    /// Completes the film.
    pub(crate) fn finish(self) -> Result<(), MediaError> {
        let state = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        let film = state.film.ok_or(MediaError::AlreadyFailed { path: self.path.clone() })?;
        if state.next != self.frame_count {
            return Err(MediaError::FramesMissing { path: self.path, got: state.next, expected: self.frame_count });
        }
        film.finish()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    struct Record(Arc<Mutex<Vec<usize>>>);

    impl FilmEncoder for Record {
        type EncodedFrame = usize;

        fn append(&mut self, encoded: usize) -> Result<(), MediaError> {
            if encoded == usize::MAX {
                return Err(MediaError::DiskFull { path: PathBuf::new() });
            }
            self.0.lock().unwrap().push(encoded);
            Ok(())
        }

        fn finish(self) -> Result<(), MediaError> {
            self.0.lock().unwrap().push(1000);
            Ok(())
        }
    }

    fn film(frames: usize, window: usize) -> (ReorderBuffer<Record>, Arc<Mutex<Vec<usize>>>) {
        let record = Arc::new(Mutex::new(Vec::new()));
        (ReorderBuffer::new(Record(record.clone()), PathBuf::from("a.gif"), frames, window), record)
    }

    #[test]
    fn frames_in_any_order_are_appended_in_order() {
        let (film, record) = film(5, 4);
        [2, 1, 0, 4, 3].into_iter().for_each(|index| film.push(index, index).unwrap());
        film.finish().unwrap();
        assert_eq!(*record.lock().unwrap(), [0, 1, 2, 3, 4, 1000]);
    }

    #[test]
    fn many_threads_give_the_same_order() {
        let (film, record) = film(200, 8);
        std::thread::scope(|scope| {
            for thread in 0..4 {
                let film = &film;
                scope.spawn(move || {
                    for index in (thread..200).step_by(4) {
                        // A thread too far ahead gets an error and tries again.
                        while film.push(index, index).is_err() {
                            std::thread::yield_now();
                        }
                    }
                });
            }
        });
        film.finish().unwrap();
        assert!(record.lock().unwrap().iter().copied().eq((0..200).chain([1000])));
    }

    #[test]
    fn frames_that_do_not_fit_are_refused() {
        let (film, _record) = film(5, 2);
        film.push(1, 1).unwrap();
        for wrong in [1, 2, 5, 9] {
            assert!(matches!(film.push(wrong, wrong), Err(MediaError::OutOfOrder { next: 0, .. })), "{wrong}");
        }
        film.push(0, 0).unwrap();
        assert!(film.push(0, 0).is_err());
        assert!(matches!(film.finish(), Err(MediaError::FramesMissing { got: 2, expected: 5, .. })));
    }

    #[test]
    fn after_a_failure_nothing_more_is_taken_or_finished() {
        let (film, record) = film(3, 3);
        assert!(matches!(film.push(0, usize::MAX), Err(MediaError::DiskFull { .. })));
        assert!(matches!(film.push(0, 0), Err(MediaError::AlreadyFailed { .. })));
        assert!(matches!(film.finish(), Err(MediaError::AlreadyFailed { .. })));
        assert!(record.lock().unwrap().is_empty());
    }
}
