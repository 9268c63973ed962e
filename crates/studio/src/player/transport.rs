//! Playback: play, pause, step, scrub and the loop range. The window passes the time in.

use std::ops::RangeInclusive;

/// Where in the shot the window is.
#[derive(Clone, Debug, PartialEq)]
pub struct Transport {
    frames: RangeInclusive<i64>,
    range: Option<RangeInclusive<i64>>,
    fps: f64,
    number: i64,
    playing: bool,
    /// Whether it stops at the end of the range rather than begins it again.
    once: bool,
    /// When the present frame was due, s.
    due: Option<f64>,
}

impl Default for Transport {
    fn default() -> Self {
        Self { frames: 0..=0, range: None, fps: 30.0, number: 0, playing: false, once: false, due: None }
    }
}

impl Transport {
    /// Takes the frames and the rate of a shot; stays where it is if that is still a frame of it.
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

    /// The frame that is shown.
    pub fn number(&self) -> i64 {
        self.number
    }

    /// When the frame that is shown begins, s from the shot's beginning.
    pub fn time_s(&self) -> f64 {
        (self.number - self.frames.start()) as f64 / self.fps
    }

    /// Length of a frame, s.
    pub fn frame_s(&self) -> f64 {
        1.0 / self.fps
    }

    /// Whether time passes.
    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// Lets time pass, or stops it.
    pub fn set_playing(&mut self, playing: bool) {
        (self.playing, self.once, self.due) = (playing, false, None);
    }

    /// Lets time pass up to the end of the range and no further, as for a recording.
    pub fn play_to_the_end(&mut self) {
        (self.playing, self.once, self.due) = (true, true, None);
    }

    /// The range that is played; the whole shot unless one was set.
    pub fn range(&self) -> RangeInclusive<i64> {
        self.range.clone().unwrap_or_else(|| self.frames.clone())
    }

    /// Plays only `range`, or the whole shot again.
    pub fn set_range(&mut self, range: Option<RangeInclusive<i64>>) {
        self.range = range.and_then(|range| self.within_shot(&range));
    }

    /// The part of `range` that the shot has; `None` where that is nothing, or all of it.
    fn within_shot(&self, range: &RangeInclusive<i64>) -> Option<RangeInclusive<i64>> {
        let part = *range.start().max(self.frames.start())..=*range.end().min(self.frames.end());
        (!part.is_empty() && part != self.frames).then_some(part)
    }

    /// Goes to frame `number`, or to the nearest of the shot.
    pub fn go_to(&mut self, number: i64) {
        self.number = number.clamp(*self.frames.start(), *self.frames.end());
        self.due = None;
    }

    /// Goes so many frames on or back and stops there.
    pub fn step(&mut self, by: i64) {
        self.playing = false;
        self.go_to(self.number.saturating_add(by));
    }

    /// Lets time pass up to `now`, s. Only where the present frame was `shown` does the next come; frames that are late by
    /// then are left out, up to `MOST_LEFT_OUT`, beyond which playing is slower than life. Whether another frame is due.
    pub fn tick(&mut self, now: f64, shown: bool) -> bool {
        const MOST_LEFT_OUT: i64 = 3;
        if !self.playing {
            return false;
        }
        let due = *self.due.get_or_insert(now);
        let late = ((now - due) * self.fps).floor() as i64;
        if !shown || late < 1 {
            return false;
        }
        let on = late.min(1 + MOST_LEFT_OUT);
        self.due = Some(if late > on { now } else { due + on as f64 / self.fps });
        if self.once && self.number + on >= *self.range().end() {
            self.go_to(*self.range().end());
            self.set_playing(false);
            return true;
        }
        self.number = self.wrapped(self.number + on);
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
        let due = self.due.filter(|_| self.playing)?;
        Some((due + 1.0 / self.fps - now).max(0.0))
    }
}
