//! Playback: play, pause, step, scrub and the loop range. The window passes the time in.

use std::ops::RangeInclusive;

/// The playback state.
#[derive(Clone, Debug, PartialEq)]
pub struct Transport {
    frames: RangeInclusive<i64>,
    range: Option<RangeInclusive<i64>>,
    fps: f64,
    number: i64,
    playing: bool,
    /// Whether playback stops at the end of the range instead of looping.
    once: bool,
    /// The time at which the current frame was due, s.
    due_s: Option<f64>,
}

impl Default for Transport {
    fn default() -> Self {
        Self { frames: 0..=0, range: None, fps: 30.0, number: 0, playing: false, once: false, due_s: None }
    }
}

impl Transport {
    /// Sets the frames and the frame rate of the shot. The current frame stays if the shot still has it.
    pub fn set_shot(&mut self, frames: RangeInclusive<i64>, fps: f64) {
        self.fps = fps;
        if self.frames != frames {
            self.frames = frames;
            self.range = self.range.take().and_then(|range| self.within_shot(&range));
            self.go_to(self.number);
        }
    }

    /// The shot's frames.
    pub fn frames(&self) -> RangeInclusive<i64> {
        self.frames.clone()
    }

    /// The current frame.
    pub fn number(&self) -> i64 {
        self.number
    }

    /// The time at which the current frame begins, s from the start of the shot.
    pub fn time_s(&self) -> f64 {
        (self.number - self.frames.start()) as f64 / self.fps
    }

    /// Length of a frame, s.
    pub fn frame_s(&self) -> f64 {
        1.0 / self.fps
    }

    /// Whether it plays.
    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// Plays or pauses.
    pub fn set_playing(&mut self, playing: bool) {
        (self.playing, self.once, self.due_s) = (playing, false, None);
    }

    /// Plays up to the end of the range and stops there, as for a recording.
    pub fn play_to_the_end(&mut self) {
        (self.playing, self.once, self.due_s) = (true, true, None);
    }

    /// The range that is played: the whole shot unless one was set.
    pub fn range(&self) -> RangeInclusive<i64> {
        self.range.clone().unwrap_or_else(|| self.frames.clone())
    }

    /// Plays only `range`, or the whole shot again.
    pub fn set_range(&mut self, range: Option<RangeInclusive<i64>>) {
        self.range = range.and_then(|range| self.within_shot(&range));
    }

    /// The intersection of `range` and the shot; `None` if it is empty or the whole shot.
    fn within_shot(&self, range: &RangeInclusive<i64>) -> Option<RangeInclusive<i64>> {
        let common = *range.start().max(self.frames.start())..=*range.end().min(self.frames.end());
        (!common.is_empty() && common != self.frames).then_some(common)
    }

    /// Seeks to frame `number`, clamped to the shot.
    pub fn go_to(&mut self, number: i64) {
        self.number = number.clamp(*self.frames.start(), *self.frames.end());
        self.due_s = None;
    }

    /// Pauses and moves by a number of frames.
    pub fn step(&mut self, by: i64) {
        self.playing = false;
        self.go_to(self.number.saturating_add(by));
    }

    /// Advances playback to `now`, s. The next frame follows only once the current frame was `shown`. Frames that are late then are skipped,
    /// up to `MAX_SKIPPED_FRAMES`; beyond that, playback is slower than real time. Returns whether the frame changed.
    pub fn tick(&mut self, now: f64, shown: bool) -> bool {
        const MAX_SKIPPED_FRAMES: i64 = 3;
        if !self.playing {
            return false;
        }
        let due = *self.due_s.get_or_insert(now);
        let late = ((now - due) * self.fps).floor() as i64;
        if !shown || late < 1 {
            return false;
        }
        let advance = late.min(1 + MAX_SKIPPED_FRAMES);
        self.due_s = Some(if late > advance { now } else { due + advance as f64 / self.fps });
        if self.once && self.number + advance >= *self.range().end() {
            self.go_to(*self.range().end());
            self.set_playing(false);
            return true;
        }
        self.number = self.wrapped(self.number + advance);
        true
    }

    fn wrapped(&self, number: i64) -> i64 {
        let range = self.range();
        if range.contains(&number) {
            return number;
        }
        let length = range.end() - range.start() + 1;
        range.start() + (number - range.start()).rem_euclid(length)
    }

    /// How long the window may sleep before the next frame is due, s.
    pub fn sleep_s(&self, now: f64) -> Option<f64> {
        let due = self.due_s.filter(|_| self.playing)?;
        Some((due + 1.0 / self.fps - now).max(0.0))
    }
}
