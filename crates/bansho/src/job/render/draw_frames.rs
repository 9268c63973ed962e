//! The frames of a job, one after the other: drawn here, finished by whichever thread of the pool is free.

use bansho_base::{
    frame::Frame,
    host::observer::{Observer, check},
};
use bansho_render::{RenderError, Shot};

use super::in_flight::{CompletionGuard, InFlightFrames, StopOnFailure};
use crate::job::{error::JobError, observer::JobObserver, snapshots::Snapshots};

/// What frames come from: a shot, or one whose state and pictures are known in tests. See [`Shot`] for each.
pub(crate) trait FrameSource: Send {
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError>;
    fn draw(&mut self, observer: &dyn Observer) -> Result<(), RenderError>;
    fn read(&mut self) -> Option<Frame>;
    fn recycle(&mut self, recycled: Frame);
    fn snapshot(&self) -> Vec<u8>;
    fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError>;
}

impl FrameSource for Shot {
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError> {
        Self::advance(self, number, observer)
    }

    fn draw(&mut self, observer: &dyn Observer) -> Result<(), RenderError> {
        Self::draw(self, observer)
    }

    fn read(&mut self) -> Option<Frame> {
        Self::read(self)
    }

    fn recycle(&mut self, recycled: Frame) {
        Self::recycle(self, recycled);
    }

    fn snapshot(&self) -> Vec<u8> {
        Self::snapshot(self)
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError> {
        Self::restore(self, snapshot)
    }
}

/// What becomes of a drawn frame.
pub(crate) trait FrameSink: Sync {
    /// Uses the frame at position `index` of the list, in any thread and any order within [`window`](Self::window).
    fn finish(&self, index: usize, frame: &mut Frame, observer: &dyn Observer) -> Result<(), JobError>;

    /// How many frames may be under way at once.
    fn window(&self) -> usize;
}

/// Bytes of frames that may be under way at once, unless two frames alone are more.
const MEMORY_IN_FLIGHT: usize = 1 << 30;

/// Draws the frames `numbers` in order. The next is drawn while those before are still compressed and written.
///
/// Runs in the caller's rayon pool, and uses no other thread.
///
/// # Errors
/// The first failure of a frame, or the observer asked to stop. Frames that were finished stay.
pub(crate) fn draw_frames(
    shot: &mut dyn FrameSource,
    numbers: &[i64],
    snapshots: &Snapshots,
    finish: &dyn FrameSink,
    observer: &dyn JobObserver,
) -> Result<(), JobError> {
    let in_flight = InFlightFrames::default();
    let stop_on_failure = StopOnFailure { observer, in_flight: &in_flight };
    let mut last = None;
    let drawn = rayon::in_place_scope_fifo(|scope| {
        for (index, &number) in numbers.iter().enumerate() {
            let seek = last.is_none_or(|last| number != last + 1).then_some(last);
            if let Some(recycled) = in_flight.take_recycled() {
                shot.recycle(recycled);
            }
            let mut frame = draw(shot, number, seek, snapshots, &stop_on_failure, observer)?;
            last = Some(number);
            in_flight.submit(index, limit(&frame, finish));
            let (in_flight, stop_on_failure) = (&in_flight, &stop_on_failure);
            scope.spawn_fifo(move |_| {
                let _completion = CompletionGuard { in_flight, index };
                if stop_on_failure.cancelled() {
                    return;
                }
                match finish.finish(index, &mut frame, stop_on_failure) {
                    Ok(()) => in_flight.recycle(frame),
                    Err(error) => in_flight.fail(error),
                }
            });
        }
        Ok(())
    });
    // A frame that failed also stops the drawing, which then only says that it was stopped.
    in_flight.take_error().map_or(drawn, Err)?;
    check(observer).map_err(|_| JobError::Cancelled)
}

/// Draws frame `number`; `seek` holds the frame drawn before where the two are not neighbors.
fn draw(
    shot: &mut dyn FrameSource,
    number: i64,
    seek: Option<Option<i64>>,
    snapshots: &Snapshots,
    stop_on_failure: &StopOnFailure,
    observer: &dyn JobObserver,
) -> Result<Frame, JobError> {
    if let Some(last) = seek {
        snapshots.warm_up(shot, last, number, stop_on_failure, observer)?;
    }
    shot.advance(number, stop_on_failure)?;
    snapshots.keep(shot, number, stop_on_failure)?;
    shot.draw(stop_on_failure)?;
    shot.read().ok_or(JobError::Cancelled)
}

/// How many frames like this one may be under way: one for each thread and the next, as far as memory allows.
fn limit(frame: &Frame, finish: &dyn FrameSink) -> usize {
    let pixels = frame.beauty.width() * frame.beauty.height();
    let bytes = pixels * size_of::<f32>() * (5 + frame.channels.len());
    let most = (rayon::current_num_threads() + 1).min(finish.window()).max(2);
    (MEMORY_IN_FLIGHT / bytes.max(1)).clamp(2, most)
}

#[cfg(test)]
mod tests {
    use std::{
        sync::{
            Arc, Mutex,
            atomic::{AtomicUsize, Ordering},
        },
        thread,
        time::Duration,
    };

    use super::*;
    use crate::job::{
        error::Conflict,
        testing::{Counter, Finisher, Witness},
    };

    fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
    }

    fn run(numbers: &[i64], finish: &dyn FrameSink, witness: &Witness) -> Result<(), JobError> {
        let counter = Counter { steps: Arc::default() };
        draw_frames(&mut counter.shot(), numbers, &Snapshots::default(), finish, witness)
    }

    #[test]
    fn every_frame_is_finished_once_at_its_place_in_any_pool() {
        for threads in [1, 2, 7] {
            let done = Mutex::new(Vec::new());
            let each = |index, number| {
                done.lock().unwrap().push((index, number));
                Ok(())
            };
            in_pool(threads, || run(&[3, 4, 9, 10], &Finisher { each, window: 64 }, &Witness::default())).unwrap();
            let mut done = done.into_inner().unwrap();
            done.sort_unstable();
            assert_eq!(done, [(0, 3), (1, 4), (2, 9), (3, 10)]);
        }
    }

    #[test]
    fn no_frame_runs_further_ahead_of_the_oldest_than_the_window() {
        const WINDOW: usize = 3;
        let unfinished = Mutex::new((0..60).collect::<std::collections::BTreeSet<usize>>());
        let furthest = AtomicUsize::new(0);
        let each = |index: usize, _| {
            let oldest = *unfinished.lock().unwrap().first().unwrap();
            furthest.fetch_max(index - oldest, Ordering::Relaxed);
            thread::sleep(Duration::from_millis([5, 0, 1][index % 3]));
            unfinished.lock().unwrap().remove(&index);
            Ok(())
        };
        let numbers: Vec<i64> = (0..60).collect();
        in_pool(8, || run(&numbers, &Finisher { each, window: WINDOW }, &Witness::default())).unwrap();
        let furthest = furthest.into_inner();
        assert!((1..WINDOW).contains(&furthest), "{furthest}: frames must overlap, but within the window");
    }

    #[test]
    fn a_failure_stops_the_work_and_is_told() {
        let finished = AtomicUsize::new(0);
        let each = |index, _| {
            finished.fetch_add(1, Ordering::Relaxed);
            if index == 5 { Err(Conflict::NoFrames.into()) } else { Ok(()) }
        };
        let numbers: Vec<i64> = (0..100_000).collect();
        let result = in_pool(2, || run(&numbers, &Finisher { each, window: 8 }, &Witness::default()));
        assert!(matches!(result, Err(JobError::Conflict(Conflict::NoFrames))), "{result:?}");
        assert!(finished.into_inner() < 100, "it must not go on");
    }

    #[test]
    fn a_wish_to_stop_is_heard_between_frames() {
        let witness = Witness::default();
        let finished = AtomicUsize::new(0);
        let each = |_, _| {
            if finished.fetch_add(1, Ordering::Relaxed) == 9 {
                witness.stop.store(true, Ordering::Relaxed);
            }
            Ok(())
        };
        let numbers: Vec<i64> = (0..100_000).collect();
        let result = in_pool(2, || run(&numbers, &Finisher { each, window: 8 }, &witness));
        assert!(matches!(result, Err(JobError::Cancelled)), "{result:?}");
        assert!((10..100).contains(&finished.into_inner()));
    }
}
