//! Time, texture scroll and frequencies of a sheet; in a seamless loop all are periodic by construction.

use bansho_base::parameters::animated::Animated;

/// The clock of one flame sheet: the distance `s (t - t0)` that its texture has scrolled, and frequencies rounded to multiples of the loop's.
#[derive(Clone, Debug)]
pub(crate) struct Clock {
    speed: Animated<f64>,
    loop_s: Option<f64>,
    scroll_per_loop: f64,
}

impl Clock {
    /// A clock for a scroll speed in sheet heights per second, which repeats every `loop_s` seconds, if given.
    pub(crate) fn new(speed: Animated<f64>, loop_s: Option<f64>) -> Self {
        let scroll_per_loop = loop_s.map_or(0.0, |length| speed.integral(0.0, length));
        Self { speed, loop_s, scroll_per_loop }
    }

    /// Time within the loop, s.
    pub(crate) fn time(&self, t: f64) -> f64 {
        self.loop_s.map_or(t, |length| t - (t / length).floor() * length)
    }

    /// `s (t - t0)` of eq. (1): the exact integral of the animated speed, sheet heights.
    pub(crate) fn scroll(&self, t: f64) -> f64 {
        self.speed.integral(0.0, self.time(t))
    }

    /// Scroll speed at `t`, sheet heights per second.
    pub(crate) fn speed(&self, t: f64) -> f64 {
        self.speed.at(self.time(t))
    }

    /// Length of the loop, s.
    pub(crate) fn loop_s(&self) -> Option<f64> {
        self.loop_s
    }

    /// The frequency nearest to `hz` that is periodic in the loop.
    pub(crate) fn frequency(&self, hz: f64) -> f64 {
        self.loop_s.map_or(hz, |length| (hz * length).round().max(1.0) / length)
    }

    /// The number of waves per sheet height (of either sign) nearest to `waves` with an integer number of waves in the distance that the texture scrolls
    /// in a loop; at least `min_per_loop`.
    pub(crate) fn waves(&self, waves: f64, min_per_loop: f64) -> f64 {
        if self.loop_s.is_none() || self.scroll_per_loop <= 0.0 {
            return waves;
        }
        let per_loop = (waves.abs() * self.scroll_per_loop).round().max(min_per_loop);
        (per_loop / self.scroll_per_loop).copysign(waves)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scroll_is_the_integral_of_speed_and_starts_again_with_the_loop() {
        let free = Clock::new(Animated::from(1.5), None);
        assert_eq!((free.scroll(2.0), free.scroll(600.0), free.frequency(0.7)), (3.0, 900.0, 0.7));
        bansho_base::assert_measured!("equation (1): scroll after 2 s, heights", free.scroll(2.0), 3.0, 0.0);
        let looped = Clock::new(Animated::from(1.5), Some(4.0));
        assert_eq!((looped.scroll(1.0), looped.scroll(5.0), looped.scroll(-3.0)), (1.5, 1.5, 1.5));
    }

    #[test]
    fn waves_and_frequencies_close_the_loop() {
        let looped = Clock::new(Animated::from(1.5), Some(4.0));
        assert_eq!((looped.frequency(0.7), looped.frequency(0.01)), (0.75, 0.25));
        assert_eq!(looped.waves(0.4, 1.0) * 6.0, 2.0);
        assert_eq!((looped.waves(-0.4, 0.0) * 6.0, looped.waves(0.01, 0.0)), (-2.0, 0.0));
    }
}
