//! Draws the frames of a job one after the other. Whichever thread of the pool is free finishes them: encodes and writes them.

use bansho_base::{
    frame::Frame,
    host::observer::{Observer, check},
};
use bansho_render::display::{DisplayFrame, DisplayOptions};

use super::{
    frame_source::FrameSource,
    in_flight::{CompletionGuard, InFlightFrames, StopOnFailure},
    snapshots::Snapshots,
};
use crate::job::{checks::memory::max_frames_with_pixels, error::JobError, observer::JobObserver};

/// What drawn frames go to.
pub(crate) trait FrameSink: Sync {
    /// Uses the frame at position `index` of the list, in any thread and any order within [`max_in_flight`](Self::max_in_flight).
    fn finish(&self, index: usize, frame: &mut Frame, observer: &dyn Observer) -> Result<(), JobError>;

    /// How many frames may be in flight at once.
    fn max_in_flight(&self) -> usize;

    /// Whether frames are written from their pixels, which are then not free for the next frame while this one is written.
    fn writes_pixels(&self) -> bool {
        false
    }
}

/// What frames go to of which only the display pixels are kept.
pub(crate) trait DisplaySink: Sync {
    /// Writes the frame at position `index` of the list, in any thread and any order within [`max_in_flight`](Self::max_in_flight).
    fn write(&self, index: usize, frame: DisplayFrame, observer: &dyn Observer) -> Result<(), JobError>;

    /// How many frames may be in flight at once.
    fn max_in_flight(&self) -> usize;
}

/// Bytes of frames that may be in flight at once, unless two frames alone are larger.
const MAX_BYTES_IN_FLIGHT: usize = 1 << 30;

/// Draws the frames `numbers` in order. A frame is drawn while earlier ones are still being compressed and written.
///
/// Runs in the caller's rayon pool, and uses no other thread.
///
/// # Errors
/// The first failure of a frame, or the observer canceled the job. Finished frames are kept.
pub(crate) fn draw_frames(
    shot: &mut dyn FrameSource,
    numbers: &[i64],
    snapshots: &Snapshots,
    sink: &dyn FrameSink,
    observer: &dyn JobObserver,
) -> Result<(), JobError> {
    let in_flight = InFlightFrames::default();
    let stop_on_failure = StopOnFailure { observer, in_flight: &in_flight };
    let (mut last, mut max_with_pixels) = (None, usize::MAX);
    let drawn = rayon::in_place_scope_fifo(|scope| {
        for (index, &number) in numbers.iter().enumerate() {
            in_flight.wait_for_pixels(max_with_pixels);
            if let Some(recycled) = in_flight.take_recycled() {
                shot.recycle(recycled);
            }
            advance(shot, last, number, snapshots, &stop_on_failure, observer)?;
            last = Some(number);
            shot.draw(&stop_on_failure)?;
            let frame = shot.read().ok_or(JobError::Cancelled)?;
            max_with_pixels = max_frames_with_pixels(bytes_of(&frame), sink.writes_pixels());
            in_flight.submit(index, in_flight_limit(bytes_of(&frame), sink.max_in_flight()));
            spawn_finish(scope, sink, &stop_on_failure, index, frame);
        }
        Ok(())
    });
    // A failed frame also cancels the drawing, whose own error is then `Cancelled`: the first failure is the one to report.
    in_flight.take_error().map_or(drawn, Err)?;
    check(observer).map_err(|_| JobError::Cancelled)
}

/// Draws the frames `numbers` in order as display pixels, strip by strip: the light of a whole frame is in memory only where it is refracted. A frame is
/// drawn while earlier ones are still being compressed and written.
///
/// Runs in the caller's rayon pool, and uses no other thread.
///
/// # Errors
/// The first failure of a frame, or the observer canceled the job. Finished frames are kept.
pub(crate) fn draw_display_frames(
    shot: &mut dyn FrameSource,
    numbers: &[i64],
    snapshots: &Snapshots,
    options: &DisplayOptions,
    sink: &dyn DisplaySink,
    observer: &dyn JobObserver,
) -> Result<(), JobError> {
    let in_flight = InFlightFrames::default();
    let stop_on_failure = StopOnFailure { observer, in_flight: &in_flight };
    let mut last = None;
    let drawn = rayon::in_place_scope_fifo(|scope| {
        for (index, &number) in numbers.iter().enumerate() {
            advance(shot, last, number, snapshots, &stop_on_failure, observer)?;
            last = Some(number);
            let frame = shot.draw_display(options, &stop_on_failure)?;
            let pixels = frame.image.width * frame.image.height;
            in_flight.submit(index, in_flight_limit(pixels * LIGHT_BYTES, sink.max_in_flight()));
            spawn_write(scope, sink, &stop_on_failure, index, frame);
        }
        Ok(())
    });
    in_flight.take_error().map_or(drawn, Err)?;
    check(observer).map_err(|_| JobError::Cancelled)
}

/// Writes a drawn frame.
fn spawn_write<'scope>(
    scope: &rayon::ScopeFifo<'scope>,
    sink: &'scope dyn DisplaySink,
    stop_on_failure: &'scope StopOnFailure,
    index: usize,
    frame: DisplayFrame,
) {
    let in_flight = stop_on_failure.in_flight;
    scope.spawn_fifo(move |_| {
        let _completion = CompletionGuard { in_flight, index };
        if !stop_on_failure.cancelled() {
            sink.write(index, frame, stop_on_failure).unwrap_or_else(|error| in_flight.fail(error));
        }
    });
}

/// Finishes a drawn frame.
fn spawn_finish<'scope>(
    scope: &rayon::ScopeFifo<'scope>,
    sink: &'scope dyn FrameSink,
    stop_on_failure: &'scope StopOnFailure,
    index: usize,
    mut frame: Frame,
) {
    let in_flight = stop_on_failure.in_flight;
    scope.spawn_fifo(move |_| {
        let _completion = CompletionGuard { in_flight, index };
        if stop_on_failure.cancelled() {
            return;
        }
        sink.finish(index, &mut frame, stop_on_failure).unwrap_or_else(|error| in_flight.fail(error));
        in_flight.recycle(index, frame);
    });
}

/// Advances to frame `number` after frame `last`. Where it is not the next one, `snapshots` shorten the way to it.
fn advance(
    shot: &mut dyn FrameSource,
    last: Option<i64>,
    number: i64,
    snapshots: &Snapshots,
    stop_on_failure: &StopOnFailure,
    observer: &dyn JobObserver,
) -> Result<(), JobError> {
    let mut told = Vec::new();
    if last.is_none_or(|last| number != last + 1) {
        told = snapshots.warm_up(shot, last, number, stop_on_failure, observer)?;
    }
    shot.advance(number, stop_on_failure)?;
    snapshots.save(shot, number, &told, stop_on_failure, observer)
}

/// How many frames whose light takes this many bytes may be in flight: one for each thread and one more, as far as memory and the sink allow.
fn in_flight_limit(bytes: usize, max: usize) -> usize {
    let max = (rayon::current_num_threads() + 1).min(max).max(2);
    (MAX_BYTES_IN_FLIGHT / bytes.max(1)).clamp(2, max)
}

/// Bytes of the pixels of a frame: color, alpha, depth and channels in single precision.
fn bytes_of(frame: &Frame) -> usize {
    let planes = 4 + usize::from(frame.depth.is_some()) + frame.channels.len();
    frame.beauty.width() * frame.beauty.height() * size_of::<f32>() * planes
}

/// Bytes of the color and the alpha of a pixel in single precision.
const LIGHT_BYTES: usize = 4 * size_of::<f32>();

#[cfg(test)]
mod tests {
    use std::{
        sync::{
            Mutex,
            atomic::{AtomicUsize, Ordering},
        },
        thread,
        time::Duration,
    };

    use super::*;
    use crate::job::{
        error::OptionError,
        testing::{CountingSource, FunctionSink, RecordingObserver},
    };

    fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
    }

    fn run(numbers: &[i64], sink: &dyn FrameSink, observer: &RecordingObserver) -> Result<(), JobError> {
        draw_frames(&mut CountingSource::new(), numbers, &Snapshots::default(), sink, observer)
    }

    #[test]
    fn every_frame_is_finished_once_with_its_index_in_any_pool() {
        for threads in [1, 2, 7] {
            let done = Mutex::new(Vec::new());
            let each = |index, number| {
                done.lock().unwrap().push((index, number));
                Ok(())
            };
            in_pool(threads, || {
                run(&[3, 4, 9, 10], &FunctionSink { each, max_in_flight: 64 }, &RecordingObserver::default())
            })
            .unwrap();
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
        in_pool(8, || run(&numbers, &FunctionSink { each, max_in_flight: WINDOW }, &RecordingObserver::default()))
            .unwrap();
        let furthest = furthest.into_inner();
        assert!((1..WINDOW).contains(&furthest), "{furthest}: frames must overlap, but stay within the window");
    }

    #[test]
    fn a_failure_stops_the_work_and_is_returned() {
        let finished = AtomicUsize::new(0);
        let each = |index, _| {
            finished.fetch_add(1, Ordering::Relaxed);
            if index == 5 { Err(OptionError::NoFrames.into()) } else { Ok(()) }
        };
        let numbers: Vec<i64> = (0..100_000).collect();
        let result =
            in_pool(2, || run(&numbers, &FunctionSink { each, max_in_flight: 8 }, &RecordingObserver::default()));
        assert!(matches!(result, Err(JobError::Option(OptionError::NoFrames))), "{result:?}");
        assert!(finished.into_inner() < 100, "drawing must stop");
    }

    #[test]
    fn cancellation_takes_effect_between_frames() {
        let observer = RecordingObserver::default();
        let finished = AtomicUsize::new(0);
        let each = |_, _| {
            if finished.fetch_add(1, Ordering::Relaxed) == 9 {
                observer.stop.store(true, Ordering::Relaxed);
            }
            Ok(())
        };
        let numbers: Vec<i64> = (0..100_000).collect();
        let result = in_pool(2, || run(&numbers, &FunctionSink { each, max_in_flight: 8 }, &observer));
        assert!(matches!(result, Err(JobError::Cancelled)), "{result:?}");
        assert!((10..100).contains(&finished.into_inner()));
    }
}
