//! How many pictures come a second.

/// Pictures a second, as they come while time passes.
#[derive(Default)]
pub(crate) struct Rate {
    last: Option<f64>,
    mean_s: Option<f64>,
}

impl Rate {
    /// A picture came at `now`, s.
    pub(crate) fn came(&mut self, now: f64) {
        /// Share of the newest interval in the mean.
        const NEWEST: f64 = 0.15;
        if let Some(last) = self.last.replace(now) {
            let interval = now - last;
            self.mean_s = Some(self.mean_s.map_or(interval, |mean| mean + NEWEST * (interval - mean)));
        }
    }

    /// How many come a second, once two came.
    pub(crate) fn pictures_per_s(&self) -> Option<f64> {
        self.mean_s.map(|mean| 1.0 / mean)
    }
}
