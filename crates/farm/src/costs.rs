//! What a shot costs: the time of a frame, measured by drawing a few frames of the shot, and the room of its files on the disk.

use std::{
    path::Path,
    sync::{Mutex, MutexGuard, PoisonError},
};

use bansho::{
    Observer, Stage, StagePart,
    job::{FrameDone, JobObserver, JobStarted, Warning},
};
use serde::{Deserialize, Serialize};

use super::error::FarmError;

/// Costs of a shot on one machine, measured or estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ShotCosts {
    /// Time from the start of the program to the first frame, s: reading the scene, building it, and the preroll of simulations.
    pub startup_s: f64,
    /// Time to step over a frame without drawing it, s; 0 where nothing is simulated.
    pub step_s: f64,
    /// Time to draw and write a frame, s, without stepping.
    pub draw_s: f64,
    /// Size of the file of a frame, bytes.
    pub frame_bytes: u64,
    /// Size of a snapshot, bytes; 0 where nothing is simulated.
    pub snapshot_bytes: u64,
}

/// Factor from the size of the frames that were measured to that of all: some are harder to compress.
const SIZE_HEADROOM: f64 = 1.2;

impl ShotCosts {
    /// Time of a frame that follows the one before it, s.
    pub fn frame_s(&self) -> f64 {
        self.step_s + self.draw_s
    }

    /// Bytes that this number of frames and snapshots will take.
    pub fn required_bytes(&self, frames: u64, snapshots: u64) -> u64 {
        let bytes = self.frame_bytes as f64 * frames as f64 + self.snapshot_bytes as f64 * snapshots as f64;
        (SIZE_HEADROOM * bytes) as u64
    }
}

/// Checks that `required` bytes fit into `folder`, where `available` bytes are free. Nothing is checked where that is unknown.
///
/// # Errors
/// They do not fit.
pub fn check_space(folder: &Path, required: u64, available: Option<u64>) -> Result<(), FarmError> {
    match available {
        Some(available) if available < required => Err(FarmError::Space {
            path: folder.to_path_buf(),
            required: in_words(required),
            available: in_words(available),
        }),
        _ => Ok(()),
    }
}

/// A number of bytes in words.
fn in_words(bytes: u64) -> String {
    const UNITS: [(&str, f64); 4] = [("TB", 1e12), ("GB", 1e9), ("MB", 1e6), ("kB", 1e3)];
    let bytes = bytes as f64;
    let unit = UNITS.into_iter().find(|(_, size)| bytes >= *size);
    unit.map_or_else(|| format!("{bytes} bytes"), |(unit, size)| format!("{:.1} {unit}", bytes / size))
}

/// Number of frames that are drawn to measure them.
const PROBES: usize = 4;
/// Frames from one of them to the next where the frames between must be stepped.
const STEPPED_SPACING: usize = 8;

/// The frames to measure: spread over the shot where each can be drawn alone, else close to its beginning, since the steps to a late frame would take as
/// long as the shot. They are frames like all others, and kept.
pub fn probe_frames(all: &[i64], is_stepped: bool) -> Vec<i64> {
    let count = PROBES.min(all.len());
    let last = all.len().saturating_sub(1);
    let mut frames = Vec::with_capacity(count);
    for probe in 0..count {
        let index = if is_stepped { (probe * STEPPED_SPACING).min(last) } else { probe * last / (count - 1).max(1) };
        frames.push(all[index]);
    }
    frames.dedup();
    frames
}

/// Observes a job and measures what its frames cost, by the clock of the caller.
pub struct ProbeObserver<'a> {
    inner: &'a dyn JobObserver,
    clock: &'a (dyn Fn() -> f64 + Sync),
    times: Mutex<Times>,
}

#[derive(Clone, Debug, Default)]
struct Times {
    /// When the stage that is being advanced began.
    advance_since: Option<f64>,
    /// Time of all steps after the first frame was drawn, s.
    steps_s: f64,
    /// When the first frame was drawn.
    first_drawn: Option<f64>,
    /// When the last frame was complete.
    last_done: f64,
    /// Number of complete frames.
    done: usize,
}

impl<'a> ProbeObserver<'a> {
    /// Passes everything on to `inner`. `clock` tells the seconds since the job began.
    pub fn new(inner: &'a dyn JobObserver, clock: &'a (dyn Fn() -> f64 + Sync)) -> Self {
        Self { inner, clock, times: Mutex::default() }
    }

    fn times(&self) -> MutexGuard<'_, Times> {
        self.times.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The costs of the shot, if all of `frames` were drawn; without the sizes of files.
    pub fn costs(&self, frames: &[i64]) -> Option<ShotCosts> {
        let times = self.times().clone();
        let first_drawn = times.first_drawn?;
        if times.done < frames.len() {
            return None;
        }
        if frames.len() == 1 {
            return Some(ShotCosts { startup_s: 0.0, draw_s: times.last_done, ..ShotCosts::default() });
        }
        let others = (frames.len() - 1) as f64;
        let steps = frames[frames.len() - 1].abs_diff(frames[0]).max(1) as f64;
        // The first frame is written while the second one is drawn.
        let draw_s = ((times.last_done - first_drawn - times.steps_s) / others).max(1e-4);
        let startup_s = (first_drawn - draw_s).max(0.0);
        Some(ShotCosts { startup_s, step_s: times.steps_s / steps, draw_s, ..ShotCosts::default() })
    }
}

impl Observer for ProbeObserver<'_> {
    fn begin(&self, stage: Stage) {
        if stage == Stage::Advance {
            self.times().advance_since = Some((self.clock)());
        }
        self.inner.begin(stage);
    }

    fn end(&self, stage: Stage) {
        let mut times = self.times();
        match stage {
            Stage::Advance => {
                // Steps before the first frame are the preroll, which is part of the startup.
                let since = times.advance_since.take();
                if let Some(since) = since.filter(|_| times.first_drawn.is_some()) {
                    times.steps_s += (self.clock)() - since;
                }
            }
            Stage::Draw => {
                times.first_drawn.get_or_insert_with(|| (self.clock)());
            }
            _ => {}
        }
        drop(times);
        self.inner.end(stage);
    }

    fn begin_part(&self, part: StagePart) {
        self.inner.begin_part(part);
    }

    fn end_part(&self, part: StagePart) {
        self.inner.end_part(part);
    }

    fn cancelled(&self) -> bool {
        self.inner.cancelled()
    }
}

impl JobObserver for ProbeObserver<'_> {
    fn started(&self, started: &JobStarted) {
        self.inner.started(started);
    }

    fn frame_done(&self, frame: &FrameDone) {
        let mut times = self.times();
        times.last_done = (self.clock)();
        times.done += 1;
        drop(times);
        self.inner.frame_done(frame);
    }

    fn warning(&self, warning: &Warning) {
        self.inner.warning(warning);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use bansho::Unobserved;

    use super::*;

    #[test]
    fn frames_are_spread_over_the_shot_unless_it_is_stepped() {
        let all: Vec<i64> = (100..200).collect();
        assert_eq!(probe_frames(&all, false), [100, 133, 166, 199]);
        assert_eq!(probe_frames(&all, true), [100, 108, 116, 124]);
        assert_eq!(probe_frames(&all[..2], false), [100, 101]);
        assert_eq!(probe_frames(&all[..5], true), [100, 104]);
        assert_eq!((probe_frames(&all[..1], true), probe_frames(&[], false)), (vec![100], vec![]));
    }

    #[test]
    fn startup_steps_and_drawing_are_told_apart() {
        let now = AtomicU64::new(0);
        let clock = || now.load(Ordering::Relaxed) as f64;
        let pass = |seconds: u64| now.fetch_add(seconds, Ordering::Relaxed);
        let probe = ProbeObserver::new(&Unobserved, &clock);
        // A preroll of 50 s, then 8 steps of 2 s and 10 s of drawing for each of three frames.
        pass(5);
        for frame in 0..3 {
            probe.begin(Stage::Advance);
            pass(if frame == 0 { 50 } else { 16 });
            probe.end(Stage::Advance);
            probe.begin(Stage::Draw);
            pass(10);
            probe.end(Stage::Draw);
            probe.frame_done(&FrameDone { number: 8 * frame, path: None, drawn: 1 });
        }
        let costs = probe.costs(&[0, 8, 16]).unwrap();
        assert_eq!((costs.startup_s, costs.step_s, costs.draw_s), (55.0, 2.0, 10.0));
        assert_eq!(probe.costs(&[0, 8, 16, 24]), None, "one was not drawn");
    }

    #[test]
    fn a_show_that_does_not_fit_is_refused_in_words() {
        let costs = ShotCosts { frame_bytes: 50_000_000, snapshot_bytes: 5_000_000, ..ShotCosts::default() };
        let required = costs.required_bytes(108_000, 100);
        assert_eq!(required, 6_480_600_000_000);
        check_space(Path::new("a"), required, Some(required)).unwrap();
        check_space(Path::new("a"), required, None).unwrap();
        let error = check_space(Path::new("a"), required, Some(900_000_000)).unwrap_err().to_string();
        assert_eq!(error, "a: the frames will take about 6.5 TB, but only 900.0 MB are free");
        assert_eq!(in_words(999), "999 bytes");
    }
}
