//! A ray in the picture of a perspective camera, where it is straight.

use bansho_base::math::DVec2;

/// A ray whose pixel at t is `origin + t * step`, and whose depth is `depth / (1 - t)`.
pub(super) struct ScreenRay {
    pub(super) origin: DVec2,
    pub(super) step: DVec2,
    /// Depth at the origin, m.
    pub(super) depth: f64,
}

impl ScreenRay {
    pub(super) fn pixel(&self, t: f64) -> DVec2 {
        self.origin + self.step * t
    }

    pub(super) fn depth(&self, t: f64) -> f64 {
        self.depth / (1.0 - t)
    }

    /// The last of `count` samples that is in the same tile as sample `first`. Though they are rounded, coordinates never turn back from
    /// sample to sample, so all between the two are in the tile.
    pub(super) fn last_in_tile(&self, side: usize, tile: [usize; 2], first: usize, count: usize) -> usize {
        let [columns, rows] = tile.map(|index| [index * side, (index + 1) * side].map(|edge| edge as f64));
        let is_in_tile = |sample: usize| {
            let pixel = self.pixel(sample as f64 / count as f64);
            (columns[0]..columns[1]).contains(&pixel.x) && (rows[0]..rows[1]).contains(&pixel.y)
        };
        let end = end_in(columns, self.origin.x, self.step.x).min(end_in(rows, self.origin.y, self.step.y));
        // The end is rounded as well.
        let mut last = ((end * count as f64) as usize).min(count - 1);
        while last > first && !is_in_tile(last) {
            last -= 1;
        }
        last.max(first)
    }
}

/// The parameter at which a coordinate leaves an interval; 1 if it never does.
fn end_in([lower, upper]: [f64; 2], origin: f64, step: f64) -> f64 {
    if step == 0.0 {
        return 1.0;
    }
    (if step > 0.0 { upper } else { lower } - origin) / step
}
