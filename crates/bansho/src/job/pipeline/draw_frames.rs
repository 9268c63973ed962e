//! Draws the frames of a job. Where they follow from each other, as in simulations, one after the other; whichever thread of the pool is free finishes them:
//! encodes and writes them. Closed forms are drawn several at a time, since what is serial within a frame leaves threads idle.

use std::sync::{Mutex, MutexGuard, PoisonError};

use bansho_base::{
    frame::{Frame, FrameHeader, PhenomenonMetadata},
    host::observer::{Observer, check},
};
use bansho_media::output::sink::FinishedPicture;
use bansho_render::{Target, display::DisplayFrame};

use super::{
    FrameSource,
    in_flight::{CommitQueue, CompletionGuard, InFlightFrames, StopOnFailure},
    snapshots::Snapshots,
};
use crate::job::{checks::memory::max_frames_with_pixels, error::JobError, observer::JobObserver};

/// What drawn frames go to.
pub(crate) trait FrameSink: Sync {
    /// What frames are drawn as.
    type Target: Target<Frame: DrawnFrame>;
    /// What is kept of a frame until it is committed.
    type Encoded: Send;

    /// What frames are drawn as.
    fn target(&self) -> &Self::Target;

    /// Encodes the frame at position `index` of the list, in any thread and any order within [`max_in_flight`](Self::max_in_flight). Nothing is
    /// written yet.
    fn encode(
        &self,
        index: usize,
        frame: &mut <Self::Target as Target>::Frame,
        observer: &dyn Observer,
    ) -> Result<Self::Encoded, JobError>;

    /// Writes an encoded frame and names it finished: in the order of the list, one after the other, and none after one that failed.
    fn commit(&self, index: usize, encoded: Self::Encoded, observer: &dyn Observer) -> Result<(), JobError>;

    /// How many frames may be in flight at once.
    fn max_in_flight(&self) -> usize;

    /// Whether frames are written from their pixels, which are then not free for the next frame while this one is written.
    fn writes_pixels(&self) -> bool {
        false
    }
}

/// A frame that was drawn, whatever its target.
pub(crate) trait DrawnFrame: Send {
    fn header(&self) -> &FrameHeader;

    fn header_mut(&mut self) -> &mut FrameHeader;

    fn metadata(&self) -> &[PhenomenonMetadata];

    /// Its pixels, for a file.
    fn picture(&self) -> FinishedPicture<'_>;

    /// Whether it consists of light.
    fn keeps_light(&self) -> bool;

    /// Bytes of the light that it was drawn from.
    fn light_bytes(&self) -> usize;

    /// That light, if the frame consists of it: the next frame is drawn into its memory.
    fn into_light(self) -> Option<Frame>;
}

impl DrawnFrame for Frame {
    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    fn metadata(&self) -> &[PhenomenonMetadata] {
        &self.metadata
    }

    fn picture(&self) -> FinishedPicture<'_> {
        FinishedPicture::Linear(self)
    }

    fn keeps_light(&self) -> bool {
        true
    }

    /// Color, alpha, depth and channels in single precision.
    fn light_bytes(&self) -> usize {
        let planes = 4 + usize::from(self.depth.is_some()) + self.channels.len();
        self.beauty.width() * self.beauty.height() * size_of::<f32>() * planes
    }

    fn into_light(self) -> Option<Frame> {
        Some(self)
    }
}

impl DrawnFrame for DisplayFrame {
    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    fn metadata(&self) -> &[PhenomenonMetadata] {
        &self.metadata
    }

    fn picture(&self) -> FinishedPicture<'_> {
        FinishedPicture::Display(&self.image, &self.header.fingerprint)
    }

    fn keeps_light(&self) -> bool {
        false
    }

    /// Color and alpha in single precision.
    fn light_bytes(&self) -> usize {
        self.image.width * self.image.height * 4 * size_of::<f32>()
    }

    fn into_light(self) -> Option<Frame> {
        None
    }
}

/// Bytes of frames that may be in flight at once, unless two frames alone are larger.
const MAX_BYTES_IN_FLIGHT: usize = 1 << 30;

/// Draws the frames `numbers` in order. A frame is drawn while earlier ones are still being compressed and written; if the source allows it, up to `drawn_at_once`
/// frames are drawn at the same time.
///
/// Runs in the caller's rayon pool, and uses no other thread.
///
/// # Errors
/// The failure of a frame, with its number, of several that of the first in the list; or the observer canceled the job. The frames before it that are finished are kept; none after it is
/// written.
pub(crate) fn draw_frames<S: FrameSource, K: FrameSink>(
    shot: &mut S,
    numbers: &[i64],
    snapshots: &Snapshots,
    drawn_at_once: usize,
    sink: &K,
    observer: &dyn JobObserver,
) -> Result<(), JobError> {
    let sources = independent_sources(shot, drawn_at_once.min(numbers.len()));
    if sources.len() > 1 {
        return draw_independent(sources, numbers, sink, observer);
    }
    let in_flight = InFlightFrames::default();
    let stop_on_failure = StopOnFailure { observer, in_flight: &in_flight };
    let commits = CommitQueue::default();
    let (mut last, mut max_with_light) = (None, usize::MAX);
    let drawn = rayon::in_place_scope_fifo(|scope| {
        for (index, &number) in numbers.iter().enumerate() {
            in_flight.wait_for_light(max_with_light);
            if let Some(recycled) = in_flight.take_recycled() {
                shot.recycle(recycled);
            }
            advance(shot, last, number, snapshots, &stop_on_failure, observer)?;
            last = Some(number);
            let frame =
                shot.draw(sink.target(), &stop_on_failure).map_err(|error| JobError::from(error).in_frame(number))?;
            let light_bytes = frame.light_bytes();
            max_with_light = max_frames_with_pixels(light_bytes, sink.writes_pixels());
            in_flight.submit(index, in_flight_limit(light_bytes, sink.max_in_flight()), frame.keeps_light());
            spawn_finish(scope, (sink, &commits), &stop_on_failure, index, frame);
        }
        Ok(())
    });
    // A failed frame also cancels the drawing, whose own error is then `Cancelled`: the first failure is the one to report.
    in_flight.take_error(numbers).map_or(drawn, Err)?;
    check(observer).map_err(|_| JobError::Cancelled)
}

/// As many sources as frames may be drawn at once, if `source` has frames that do not follow from each other.
fn independent_sources<S: FrameSource>(source: &S, count: usize) -> Vec<S> {
    if count < 2 {
        return Vec::new();
    }
    std::iter::from_fn(|| source.independent()).take(count).collect()
}

/// Draws and finishes frames, as many at once as there are sources. Each is a task of the pool, and so are its parts: a thread that waits for parts of its frame
/// takes on those of others.
fn draw_independent<S: FrameSource, K: FrameSink>(
    sources: Vec<S>,
    numbers: &[i64],
    sink: &K,
    observer: &dyn JobObserver,
) -> Result<(), JobError> {
    // A film takes frames in order, and holds back no more than its window.
    let window = sources.len().min(sink.max_in_flight()).max(1);
    let in_flight = InFlightFrames::default();
    let stop_on_failure = StopOnFailure { observer, in_flight: &in_flight };
    let (free, commits) = (Mutex::new(sources), CommitQueue::default());
    rayon::in_place_scope_fifo(|scope| {
        for (index, &number) in numbers.iter().enumerate() {
            in_flight.submit(index, window, true);
            if stop_on_failure.cancelled() {
                break;
            }
            let (in_flight, free, commits, stop_on_failure) = (&in_flight, &free, &commits, &stop_on_failure);
            scope.spawn_fifo(move |_| {
                let _completion = CompletionGuard { in_flight, index };
                // There are as many sources as frames in the window, and a frame returns its source before it leaves the window.
                let Some(mut source) = lock(free).pop() else { return };
                let encoded = draw_and_encode(&mut source, (index, number), sink, stop_on_failure);
                lock(free).push(source);
                finish(encoded, index, (sink, commits), stop_on_failure);
            });
        }
    });
    in_flight.take_error(numbers).map_or(Ok(()), Err)?;
    check(observer).map_err(|_| JobError::Cancelled)
}

/// Draws frame `number`, which is at position `index` of the list, and encodes it.
fn draw_and_encode<S: FrameSource, K: FrameSink>(
    source: &mut S,
    (index, number): (usize, i64),
    sink: &K,
    observer: &StopOnFailure,
) -> Result<K::Encoded, JobError> {
    source.advance(number, observer)?;
    let mut frame = source.draw(sink.target(), observer)?;
    let encoded = sink.encode(index, &mut frame, observer)?;
    if let Some(light) = frame.into_light() {
        source.recycle(light);
    }
    Ok(encoded)
}

/// Commits a frame once those before it are, or tells why there is none.
fn finish<K: FrameSink>(
    encoded: Result<K::Encoded, JobError>,
    index: usize,
    (sink, commits): (&K, &CommitQueue<K::Encoded>),
    observer: &StopOnFailure,
) {
    let committed = match encoded {
        Ok(encoded) => commits.push(index, encoded, |index, encoded| sink.commit(index, encoded, observer)),
        Err(error) => Err((index, error)),
    };
    if let Err((index, error)) = committed {
        observer.in_flight.fail(index, error);
    }
}

/// The sources are only pushed and popped under the lock, so they are valid even if a thread panicked.
fn lock<S>(sources: &Mutex<Vec<S>>) -> MutexGuard<'_, Vec<S>> {
    sources.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Finishes a drawn frame.
fn spawn_finish<'scope, K: FrameSink>(
    scope: &rayon::ScopeFifo<'scope>,
    (sink, commits): (&'scope K, &'scope CommitQueue<K::Encoded>),
    stop_on_failure: &'scope StopOnFailure,
    index: usize,
    mut frame: <K::Target as Target>::Frame,
) where
    <K::Target as Target>::Frame: 'scope,
{
    let in_flight = stop_on_failure.in_flight;
    scope.spawn_fifo(move |_| {
        let _completion = CompletionGuard { in_flight, index };
        if stop_on_failure.cancelled() {
            return;
        }
        let encoded = sink.encode(index, &mut frame, stop_on_failure);
        if let Some(light) = frame.into_light() {
            in_flight.recycle(index, light);
        }
        finish(encoded, index, (sink, commits), stop_on_failure);
    });
}

/// Advances to frame `number` after frame `last`. Where it is not the next one, `snapshots` shorten the way to it.
pub(crate) fn advance(
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
    shot.advance(number, stop_on_failure).map_err(|error| JobError::from(error).in_frame(number))?;
    snapshots.save(shot, number, &told, stop_on_failure, observer)
}

/// How many frames whose light takes this many bytes may be in flight: one for each thread and one more, as far as memory and the sink allow.
fn in_flight_limit(bytes: usize, max: usize) -> usize {
    let max = (rayon::current_num_threads() + 1).min(max).max(2);
    (MAX_BYTES_IN_FLIGHT / bytes.max(1)).clamp(2, max)
}

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

    /// Draws frames one after the other, or several of a closed form at once.
    fn run(
        numbers: &[i64],
        drawn_at_once: usize,
        sink: &impl FrameSink,
        observer: &RecordingObserver,
    ) -> Result<(), JobError> {
        let mut source = CountingSource::new();
        source.is_closed_form = drawn_at_once > 1;
        draw_frames(&mut source, numbers, &Snapshots::default(), drawn_at_once, sink, observer)
    }

    #[test]
    fn every_frame_is_finished_once_with_its_index_in_any_pool() {
        for (threads, drawn_at_once) in [(1, 1), (2, 1), (7, 1), (1, 3), (2, 3), (7, 3), (7, 64)] {
            let done = Mutex::new(Vec::new());
            let each = |index, number| {
                done.lock().unwrap().push((index, number));
                Ok(())
            };
            let sink = FunctionSink::new(each, 64);
            in_pool(threads, || run(&[3, 4, 9, 10], drawn_at_once, &sink, &RecordingObserver::default())).unwrap();
            let mut done = done.into_inner().unwrap();
            done.sort_unstable();
            assert_eq!(done, [(0, 3), (1, 4), (2, 9), (3, 10)], "{threads} {drawn_at_once}");
        }
    }

    #[test]
    fn no_frame_runs_further_ahead_of_the_oldest_than_the_window() {
        const WINDOW: usize = 3;
        for drawn_at_once in [1, 2, 8] {
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
            let sink = FunctionSink::new(each, WINDOW);
            in_pool(8, || run(&numbers, drawn_at_once, &sink, &RecordingObserver::default())).unwrap();
            let furthest = furthest.into_inner();
            assert!((1..WINDOW).contains(&furthest), "{furthest}: frames must overlap, but stay within the window");
        }
    }

    #[test]
    fn a_failure_stops_the_work_and_is_returned() {
        for drawn_at_once in [1, 2, 4] {
            let finished = AtomicUsize::new(0);
            let each = |index, _| {
                finished.fetch_add(1, Ordering::Relaxed);
                if index == 5 { Err(OptionError::NoFrames.into()) } else { Ok(()) }
            };
            let numbers: Vec<i64> = (7..100_000).collect();
            let sink = FunctionSink::new(each, 8);
            let result = in_pool(4, || run(&numbers, drawn_at_once, &sink, &RecordingObserver::default()));
            let error = result.unwrap_err();
            assert_eq!(error.frame(), Some(12), "{error:?}");
            assert!(matches!(error.without_frame(), JobError::Option(OptionError::NoFrames)), "{error:?}");
            let committed = sink.committed.into_inner().unwrap();
            assert!(committed.len() <= 5 && committed.iter().copied().eq(0..committed.len()), "{committed:?}");
            assert!(finished.into_inner() < 100, "drawing must stop");
        }
    }

    #[test]
    fn cancellation_takes_effect_between_frames() {
        for drawn_at_once in [1, 2] {
            let observer = RecordingObserver::default();
            let finished = AtomicUsize::new(0);
            let each = |_, _| {
                if finished.fetch_add(1, Ordering::Relaxed) == 9 {
                    observer.stop.store(true, Ordering::Relaxed);
                }
                Ok(())
            };
            let numbers: Vec<i64> = (0..100_000).collect();
            let sink = FunctionSink::new(each, 8);
            let result = in_pool(2, || run(&numbers, drawn_at_once, &sink, &observer));
            assert!(matches!(result, Err(JobError::Cancelled)), "{result:?}");
            assert!((10..100).contains(&finished.into_inner()));
        }
    }

    #[test]
    fn frames_of_a_closed_form_are_drawn_at_the_same_time() {
        let (running, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let each = |_, _| {
            most.fetch_max(running.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            thread::sleep(Duration::from_millis(5));
            running.fetch_sub(1, Ordering::SeqCst);
            Ok(())
        };
        let numbers: Vec<i64> = (0..40).collect();
        let sink = FunctionSink::new(each, 64);
        in_pool(4, || run(&numbers, 3, &sink, &RecordingObserver::default())).unwrap();
        let most = most.into_inner();
        assert!((2..=3).contains(&most), "{most} at once");
    }
}
