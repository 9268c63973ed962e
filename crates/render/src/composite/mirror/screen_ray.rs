//! A ray in the picture of a perspective camera, where it is straight.

use bansho_base::math::DVec2;

/// A ray whose pixel at parameter t is `origin + t * step`, and whose depth is `depth / (1 - t)`: from 0 at the mirror to 1 at infinity.
pub(super) struct ScreenRay {
    pub(super) origin: DVec2,
    pub(super) step: DVec2,
    /// Depth at the origin, m.
    pub(super) depth: f64,
}

/// The parameter t of a sample of a ray.
pub(super) fn parameter(sample: usize, samples: usize) -> f64 {
    sample as f64 / samples as f64
}

impl ScreenRay {
    pub(super) fn pixel(&self, t: f64) -> DVec2 {
        self.origin + self.step * t
    }

    pub(super) fn depth(&self, t: f64) -> f64 {
        self.depth / (1.0 - t)
    }

    /// The last sample that is in the same tile, of this side in pixels, as sample `first`. Coordinates are monotonic from sample to sample, even
    /// rounded, so all samples between the two are in the tile.
    pub(super) fn last_in_tile(&self, side: usize, tile: [usize; 2], first: usize, samples: usize) -> usize {
        let [columns, rows] = tile.map(|index| [index * side, (index + 1) * side].map(|edge| edge as f64));
        let is_in_tile = |sample: usize| {
            let pixel = self.pixel(parameter(sample, samples));
            (columns[0]..columns[1]).contains(&pixel.x) && (rows[0]..rows[1]).contains(&pixel.y)
        };
        let exit =
            exit_parameter(columns, self.origin.x, self.step.x).min(exit_parameter(rows, self.origin.y, self.step.y));
        let mut last = ((exit * samples as f64) as usize).min(samples - 1);
        // The exit is rounded too, and the edge itself may be outside.
        while last > first && !is_in_tile(last) {
            last -= 1;
        }
        last.max(first)
    }
}

/// The parameter at which a coordinate leaves an interval; 1 if it never does.
fn exit_parameter([lower, upper]: [f64; 2], origin: f64, step: f64) -> f64 {
    if step == 0.0 {
        return 1.0;
    }
    let edge = if step > 0.0 { upper } else { lower };
    (edge - origin) / step
}
