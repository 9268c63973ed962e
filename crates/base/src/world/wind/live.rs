//! The wind that a program sets while a shot runs.
//!
//! Gusts drift with the mean wind, so their positions depend on the distance that the mean wind has traveled since time 0. If a new velocity replaced
//! the old one for all time, it would move every gust by the elapsed time times the change. So a new velocity is a key at the present time: what has
//! blown before stays, and the distance is accumulated from key to key.

use std::collections::VecDeque;

use glam::DVec3;

/// Duration of the past for which keys are kept, s: longer than sparks live (20 s) and than gusts act on a drop (2 s). Older keys are folded into
/// one that leads to the same distance, so that the cost does not grow with the time that a program runs.
const MEMORY_S: f64 = 30.0;

/// Mean velocity and turbulence intensity at one time, linear in time from key to key and constant after the last.
#[derive(Clone, Copy, Debug, PartialEq)]
struct WindKey {
    /// s.
    time: f64,
    /// Mean velocity, m/s.
    velocity: DVec3,
    /// Turbulence intensity.
    gust: f64,
    /// Distance of the mean wind since time 0, m.
    travel: DVec3,
}

/// Wind keys in the order of their times. Two keys may have the same time; the wind then jumps from the first to the second.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LiveWind {
    keys: VecDeque<WindKey>,
    /// Once keys have been folded: the constant velocity that replaces the wind before the first key, m/s.
    folded: Option<DVec3>,
}

/// The wind between two keys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LiveState {
    pub(super) velocity: DVec3,
    pub(super) gust: f64,
    /// Distance of the mean wind since time 0, m.
    pub(super) travel: DVec3,
}

impl LiveWind {
    /// Begins at `time`, where the wind has these values.
    pub(super) fn new(time: f64, LiveState { velocity, gust, travel }: LiveState) -> Self {
        Self { keys: VecDeque::from([WindKey { time, velocity, gust, travel }]), folded: None }
    }

    /// The wind at time `t`; `None` before the first key, where it is still the planned wind.
    pub(super) fn at(&self, t: f64) -> Option<LiveState> {
        let after = self.keys.partition_point(|key| key.time <= t);
        if let Some(next) = self.keys.get(after) {
            let Some(key) = after.checked_sub(1).and_then(|index| self.keys.get(index)) else {
                let velocity = self.folded?;
                let travel = next.travel - velocity * (next.time - t);
                return Some(LiveState { velocity, gust: next.gust, travel });
            };
            let elapsed = t - key.time;
            let fraction = elapsed / (next.time - key.time);
            let velocity = key.velocity.lerp(next.velocity, fraction);
            let travel = key.travel + (key.velocity + velocity) * (0.5 * elapsed);
            return Some(LiveState { velocity, gust: key.gust + (next.gust - key.gust) * fraction, travel });
        }
        let last = self.keys.back()?;
        let travel = last.travel + last.velocity * (t - last.time);
        Some(LiveState { velocity: last.velocity, gust: last.gust, travel })
    }

    /// From `time` on the wind changes linearly to `velocity` and `gust`, which it has `transition_s` later. Keys after `time` are dropped.
    pub(super) fn change(&mut self, time: f64, velocity: DVec3, gust: f64, transition_s: f64) {
        // The last two keys are the beginning and the end of the last transition.
        let started = self.keys.len().checked_sub(2).map_or(f64::NEG_INFINITY, |index| self.keys[index].time);
        let is_last = self.keys.back().is_some_and(|last| (last.velocity, last.gust) == (velocity, gust));
        let Some(now) = self.at(time).filter(|_| !is_last || time < started) else { return };
        self.keys.retain(|key| key.time < time);
        let LiveState { velocity: before, gust: gust_before, travel } = now;
        self.keys.push_back(WindKey { time, velocity: before, gust: gust_before, travel });
        let travel = travel + (before + velocity) * (0.5 * transition_s);
        self.keys.push_back(WindKey { time: time + transition_s, velocity, gust, travel });
        self.fold(time - MEMORY_S);
    }

    /// Replaces the keys before `time` by a constant velocity that leads to the same distance.
    fn fold(&mut self, time: f64) {
        while self.keys.get(1).is_some_and(|second| second.time <= time) {
            self.keys.pop_front();
            let first = self.keys[0];
            self.folded = Some(if first.time > 0.0 { first.travel / first.time } else { first.velocity });
        }
    }

    /// Whether there are gusts at any key.
    pub(super) fn is_gusty(&self) -> bool {
        self.keys.iter().any(|key| key.gust > 0.0 && key.velocity != DVec3::ZERO)
    }

    #[cfg(test)]
    fn key_count(&self) -> usize {
        self.keys.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start() -> LiveWind {
        LiveWind::new(10.0, LiveState { velocity: DVec3::X, gust: 0.3, travel: DVec3::X * 10.0 })
    }

    #[test]
    fn the_distance_is_the_integral_of_the_velocity() {
        let mut wind = start();
        for step in 1..200 {
            let t = 10.0 + 0.1 * f64::from(step);
            wind.change(t, DVec3::new(f64::from(step % 7), 0.0, f64::from(step % 3)), 0.5, 0.25);
        }
        let (n, from, to) = (200_000, 10.0, 33.0);
        let middle = |i: i32| from + (to - from) * (f64::from(i) + 0.5) / f64::from(n);
        let sum: DVec3 =
            (0..n).map(|i| wind.at(middle(i)).unwrap().velocity).sum::<DVec3>() * ((to - from) / f64::from(n));
        let travel = wind.at(to).unwrap().travel - wind.at(from).unwrap().travel;
        assert!((travel - sum).length() < 1e-6, "{travel} {sum}");
        assert_eq!(wind.at(9.9), None);
    }

    #[test]
    fn a_change_leaves_the_past_and_reaches_its_value() {
        let mut wind = start();
        wind.change(12.0, DVec3::X * 3.0, 0.8, 0.5);
        assert_eq!(wind.at(12.0).unwrap().velocity, DVec3::X);
        assert_eq!(
            wind.at(12.25).unwrap(),
            LiveState { velocity: DVec3::X * 2.0, gust: 0.55, travel: DVec3::X * 12.375 }
        );
        let later = wind.at(20.0).unwrap();
        assert_eq!((later.velocity, later.gust), (DVec3::X * 3.0, 0.8));
        // Half way through the transition the wind turns back: nothing jumps.
        let before = wind.at(12.25).unwrap();
        wind.change(12.25, DVec3::ZERO, 0.0, 0.0);
        assert!(wind.at(12.25 - 1e-12).unwrap().travel.distance(before.travel) < 1e-9);
        assert_eq!((wind.at(12.25).unwrap().velocity, wind.at(13.0).unwrap().travel), (DVec3::ZERO, before.travel));
    }

    #[test]
    fn a_wind_that_changes_always_has_few_keys_and_loses_no_distance() {
        let (mut folding, mut all) = (start(), DVec3::X * 10.0);
        let dt = 1.0 / 60.0;
        for frame in 0..60 * 600 {
            let t = 10.0 + f64::from(frame) * dt;
            folding.change(t, DVec3::new(f64::from(frame % 5), 0.0, 0.0), 0.3, dt);
            all = folding.at(t + dt).unwrap().travel;
        }
        assert!(folding.key_count() < 2 * 60 * 31, "{}", folding.key_count());
        // The mean of 0 to 4, from 10 s to 610 s.
        assert!((all.x - 10.0 - 2.0 * 600.0).abs() < 1.0, "{all}");
        // Before its memory it has a constant velocity of the same distance.
        let long_ago = folding.at(100.0).unwrap();
        assert!((long_ago.travel.x - 100.0 * long_ago.velocity.x).abs() < 1e-6);
    }

    #[test]
    fn a_change_at_an_earlier_time_replaces_what_followed() {
        let mut wind = start();
        wind.change(20.0, DVec3::X * 3.0, 0.8, 0.5);
        wind.change(15.0, DVec3::X * 3.0, 0.8, 0.5);
        assert_eq!(wind.at(15.5).unwrap().velocity, DVec3::X * 3.0);
        assert!(wind.at(9.0).is_none());
    }

    #[test]
    fn what_does_not_change_adds_no_key() {
        let mut wind = start();
        wind.change(12.0, DVec3::X * 3.0, 0.8, 0.5);
        for frame in 0..1000 {
            wind.change(12.0 + f64::from(frame), DVec3::X * 3.0, 0.8, 0.5);
        }
        assert_eq!(wind.key_count(), 3);
    }
}
