//! Sums of the times of stages and of their parts, for observers. The clock is the caller's: libraries do not read it.

use std::{
    collections::HashMap,
    sync::{Mutex, PoisonError},
    thread::{self, ThreadId},
    time::Duration,
};

use super::observer::{Stage, StagePart};

/// Measures stages and their parts. Its methods are those of an [`Observer`](super::observer::Observer) with the time since any fixed instant.
///
/// - A stage within another one on the same thread pauses the clock of the outer one. A stage lasts on the thread that began it, so that the
///   stages up to [`Stage::Draw`] add up to elapsed time.
/// - A part within another one, or a stage within a part, pauses the clock of the outer part. The time of a part is the sum over the threads that
///   report it: *thread time*. What other threads do for it in parallel loops of its own is not attributed to it, and what its thread does or waits for
///   meanwhile is; with one thread, times are exact.
///
/// Frames are told apart by their stages: one ends where [`Stage::Advance`] begins after [`Stage::Draw`].
#[derive(Debug, Default)]
pub struct StageTimes {
    clocks: Mutex<Clocks>,
}

/// The time of one part.
#[derive(Clone, Debug, PartialEq)]
pub struct PartTimes {
    /// What is done.
    pub stage: Stage,
    /// Name of the phenomenon; `None` for compositing.
    pub phenomenon: Option<String>,
    /// Whether it is done for the reflection in a mirror.
    pub is_mirrored: bool,
    /// Thread time of each frame, s. The steps of the first frame include the preroll.
    pub frames: Vec<f64>,
}

#[derive(Debug, Default)]
struct Clocks {
    open: HashMap<ThreadId, OpenIntervals>,
    /// All stages, in the order of [`Stage::ALL`], of all frames.
    stages: [Duration; Stage::ALL.len()],
    /// The same for each frame, on the thread that draws it.
    frames: Vec<[f64; Stage::ALL.len()]>,
    parts: Vec<PartTimes>,
    /// Index of the frame that is advanced, prepared or drawn.
    frame: usize,
    /// Whether that frame has been drawn.
    is_drawn: bool,
}

/// What has begun on a thread and not ended, outermost first.
#[derive(Debug, Default)]
struct OpenIntervals {
    intervals: Vec<Interval>,
    /// When the times were last added up.
    since: Duration,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Interval {
    Stage(Stage),
    /// Index of [`Clocks::parts`].
    Part(usize),
}

impl StageTimes {
    /// A stage begins on this thread.
    pub fn begin(&self, stage: Stage, now: Duration) {
        self.with_clocks(|clocks| {
            if stage == Stage::Advance && clocks.is_drawn {
                (clocks.frame, clocks.is_drawn) = (clocks.frame + 1, false);
            }
            clocks.push(Interval::Stage(stage), now);
        });
    }

    /// A stage ends on this thread.
    pub fn end(&self, stage: Stage, now: Duration) {
        self.with_clocks(|clocks| {
            clocks.pop(Interval::Stage(stage), now);
            clocks.is_drawn |= stage == Stage::Draw;
        });
    }

    /// A part of a stage begins on this thread.
    pub fn begin_part(&self, part: StagePart, now: Duration) {
        self.with_clocks(|clocks| {
            let index = clocks.part_index(part);
            clocks.push(Interval::Part(index), now);
        });
    }

    /// A part of a stage ends on this thread.
    pub fn end_part(&self, part: StagePart, now: Duration) {
        self.with_clocks(|clocks| {
            let index = clocks.part_index(part);
            clocks.pop(Interval::Part(index), now);
        });
    }

    /// Time of a stage in all frames, s.
    pub fn seconds(&self, stage: Stage) -> f64 {
        self.with_clocks(|clocks| clocks.stages[stage as usize].as_secs_f64())
    }

    /// Times of the stages [`Stage::Load`] to [`Stage::Draw`] of each frame on the thread that draws it, s, in the order of [`Stage::ALL`]; others are 0.
    pub fn frames(&self) -> Vec<[f64; Stage::ALL.len()]> {
        self.with_clocks(|clocks| clocks.frames.clone())
    }

    /// The parts in the order of their first call, each with as many frames as [`frames`](Self::frames) has.
    pub fn parts(&self) -> Vec<PartTimes> {
        self.with_clocks(|clocks| {
            let mut parts = clocks.parts.clone();
            parts.iter_mut().for_each(|part| part.frames.resize(clocks.frames.len(), 0.0));
            parts
        })
    }

    fn with_clocks<T>(&self, change: impl FnOnce(&mut Clocks) -> T) -> T {
        // The sums are valid even if a thread panicked.
        change(&mut self.clocks.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Clocks {
    fn part_index(&mut self, part: StagePart) -> usize {
        let StagePart { stage, phenomenon, is_mirrored } = part;
        let index = self.parts.iter().position(|known| {
            known.phenomenon.as_deref() == phenomenon && (known.stage, known.is_mirrored) == (stage, is_mirrored)
        });
        index.unwrap_or_else(|| {
            let phenomenon = phenomenon.map(str::to_owned);
            self.parts.push(PartTimes { stage, phenomenon, is_mirrored, frames: Vec::new() });
            self.parts.len() - 1
        })
    }

    fn push(&mut self, interval: Interval, now: Duration) {
        self.add_up(now).push(interval);
    }

    fn pop(&mut self, interval: Interval, now: Duration) {
        self.add_up(now).pop_if(|innermost| *innermost == interval);
    }

    /// Adds the time since the last change on this thread to the innermost stage and, if it is within that, to the innermost part. Returns what is
    /// open.
    fn add_up(&mut self, now: Duration) -> &mut Vec<Interval> {
        let open = self.open.entry(thread::current().id()).or_default();
        let elapsed = now.saturating_sub(open.since);
        open.since = now;
        if let Some(&Interval::Part(index)) = open.intervals.last() {
            *at(&mut self.parts[index].frames, self.frame) += elapsed.as_secs_f64();
        }
        let stage = open.intervals.iter().rev().find_map(|interval| match interval {
            Interval::Stage(stage) => Some(*stage),
            Interval::Part(_) => None,
        });
        if let Some(stage) = stage {
            self.stages[stage as usize] += elapsed;
            if stage <= Stage::Draw {
                at(&mut self.frames, self.frame)[stage as usize] += elapsed.as_secs_f64();
            }
        }
        &mut open.intervals
    }
}

/// The entry of this frame.
fn at<T: Clone + Default>(frames: &mut Vec<T>, frame: usize) -> &mut T {
    if frames.len() <= frame {
        frames.resize(frame + 1, T::default());
    }
    &mut frames[frame]
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    const fn part(stage: Stage, phenomenon: Option<&str>) -> StagePart<'_> {
        StagePart { stage, phenomenon, is_mirrored: false }
    }

    #[test]
    fn a_stage_inside_another_is_not_counted_twice() {
        let times = StageTimes::default();
        times.begin(Stage::Draw, ms(1));
        times.begin(Stage::Write, ms(3));
        times.end(Stage::Write, ms(10));
        times.end(Stage::Draw, ms(11));
        assert_eq!([Stage::Draw, Stage::Write].map(|stage| times.seconds(stage)), [0.003, 0.007]);
    }

    #[test]
    fn compositing_is_what_parts_of_phenomena_leave() {
        let times = StageTimes::default();
        let (compositing, rain) = (part(Stage::Draw, None), part(Stage::Draw, Some("rain")));
        times.begin(Stage::Draw, ms(0));
        times.begin_part(compositing, ms(1));
        times.begin_part(rain, ms(3));
        // A thread that waits writes an earlier frame.
        times.begin(Stage::Write, ms(10));
        times.end(Stage::Write, ms(40));
        times.end_part(rain, ms(44));
        times.end_part(compositing, ms(50));
        times.end(Stage::Draw, ms(51));
        let parts = times.parts();
        assert_eq!(parts[0].frames, [0.008]);
        assert_eq!((parts[1].phenomenon.as_deref(), parts[1].frames[0]), (Some("rain"), 0.011));
        assert_eq!((times.seconds(Stage::Draw), times.seconds(Stage::Write)), (0.021, 0.03));
    }

    #[test]
    fn frames_are_told_apart_and_threads_are_summed() {
        let times = StageTimes::default();
        let (step, draw) = (part(Stage::Advance, Some("fire")), part(Stage::Draw, Some("fire")));
        for frame in 0..3_u64 {
            let start = 100 * frame;
            // Snapshots may advance in several calls.
            for step_start in [start, start + 10] {
                times.begin(Stage::Advance, ms(step_start));
                times.begin_part(step, ms(step_start + 1));
                times.end_part(step, ms(step_start + 2 + frame));
                times.end(Stage::Advance, ms(step_start + 6));
            }
            times.begin(Stage::Draw, ms(start + 20));
            thread::scope(|scope| {
                for thread in 0..2 {
                    let times = &times;
                    scope.spawn(move || {
                        times.begin_part(draw, ms(start + 21));
                        times.end_part(draw, ms(start + 22 + thread));
                    });
                }
            });
            times.end(Stage::Draw, ms(start + 25));
        }
        let parts = times.parts();
        assert_eq!(parts.len(), 2);
        let milliseconds = |part: &PartTimes| part.frames.iter().map(|s| (1e3 * s).round()).collect::<Vec<_>>();
        assert_eq!(milliseconds(&parts[0]), [2.0, 4.0, 6.0]);
        assert_eq!(milliseconds(&parts[1]), [3.0, 3.0, 3.0]);
        assert_eq!(times.frames().len(), 3);
        assert!((times.frames()[1][Stage::Advance as usize] - 0.012).abs() < 1e-9);
    }
}
