//! Adaptive preview resolution: full size if the machine is fast enough, else smaller if a smaller size is faster.

/// Scales of a preview relative to the viewport, the largest first.
const SCALES: [f64; 7] = [1.0, 0.75, 0.5, 0.375, 0.25, 0.1875, 0.125];

/// If no size meets the target, a larger picture may take this many times the time of the smallest.
const WORTHWHILE_FACTOR: f64 = 1.5;

/// A larger scale is chosen only if it takes at most this fraction of the target, so that sizes do not oscillate (hysteresis).
const HEADROOM: f64 = 0.7;

/// Chooses the scale of previews by a cost model.
///
/// Drawing n pixels takes `fixed_s + per_pixel_s n`: preparing streaks and particles does not depend on the size. Pictures of two sizes
/// determine both terms. Further pictures of the same size only determine the sum, so both terms are scaled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PreviewScale {
    step: usize,
    /// The fitted cost model, once a picture was timed.
    model: Option<CostModel>,
}

/// Cost of drawing a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CostModel {
    /// Time that does not depend on the size, s.
    fixed_s: f64,
    /// Time per pixel, s.
    per_pixel_s: f64,
    /// Pixels of the last picture.
    last_pixels: f64,
    /// Time to draw the last picture, s.
    last_s: f64,
}

/// Timing of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTiming {
    /// Pixels.
    pub pixels: usize,
    /// Drawing, s.
    pub draw_s: f64,
    /// The simulation, which does not depend on the size, s.
    pub advance_s: f64,
}

impl CostModel {
    /// The model updated by a picture of `pixels` that took `draw_s`.
    fn updated(previous: Option<Self>, pixels: f64, draw_s: f64) -> Self {
        let (fixed_s, per_pixel_s) = match previous {
            None => (0.0, draw_s / pixels),
            Some(last) if last.last_pixels == pixels => {
                // The load of the machine or the content of the scene changed.
                let factor = draw_s / last.seconds(pixels).max(f64::MIN_POSITIVE);
                (last.fixed_s * factor, last.per_pixel_s * factor)
            }
            Some(last) => {
                // The line through the last two pictures, whose ends are not negative.
                let slope = (last.last_s - draw_s) / (last.last_pixels - pixels);
                let per_pixel_s = slope.clamp(0.0, draw_s / pixels);
                (draw_s - per_pixel_s * pixels, per_pixel_s)
            }
        };
        Self { fixed_s, per_pixel_s, last_pixels: pixels, last_s: draw_s }
    }

    /// The predicted time to draw `pixels`, s.
    fn seconds(&self, pixels: f64) -> f64 {
        self.fixed_s + self.per_pixel_s * pixels
    }
}

impl PreviewScale {
    /// The scale of the next preview.
    pub fn scale(&self) -> f64 {
        SCALES[self.step]
    }

    /// Records the timing of a preview at the current scale; `target_s` is the wanted time, s.
    pub fn record(&mut self, timing: FrameTiming, target_s: f64) {
        let pixels = timing.pixels.max(1) as f64;
        let cost = CostModel::updated(self.model, pixels, timing.draw_s);
        self.model = Some(cost);
        let current = self.scale();
        let seconds = SCALES.map(|scale| {
            let ratio = scale / current;
            timing.advance_s + cost.seconds(pixels * ratio * ratio)
        });
        let last = SCALES.len() - 1;
        // Where even the smallest picture is too slow, a larger one that takes little longer is better.
        let least_limit = if seconds[last] > target_s { WORTHWHILE_FACTOR * seconds[last] } else { 0.0 };
        if seconds[self.step] > target_s.max(least_limit) {
            self.step = (self.step + 1..=last).find(|&step| seconds[step] <= target_s.max(least_limit)).unwrap_or(last);
        } else {
            // With headroom, so that the size does not change to and fro.
            let limit = (HEADROOM * target_s).max(least_limit);
            self.step = (0..self.step).find(|&step| seconds[step] <= limit).unwrap_or(self.step);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The chosen scales where drawing 1e6 pixels takes `fixed` + `whole`, s.
    fn scales(advance_s: f64, fixed: f64, whole: f64, pictures: usize) -> Vec<f64> {
        let mut preview_scale = PreviewScale::default();
        let mut scales = Vec::new();
        for _ in 0..pictures {
            let part = preview_scale.scale() * preview_scale.scale();
            preview_scale
                .record(FrameTiming { pixels: (1e6 * part) as usize, draw_s: fixed + whole * part, advance_s }, 0.1);
            scales.push(preview_scale.scale());
        }
        scales
    }

    #[test]
    fn previews_shrink_as_far_as_it_takes_and_grow_when_there_is_room() {
        assert_eq!(scales(0.0, 0.0, 0.39, 4), [0.5; 4], "a quarter of the pixels");
        assert_eq!(scales(0.0, 0.0, 100.0, 2), [0.125; 2], "never smaller than an eighth");
        assert_eq!(scales(0.0, 0.0, 0.09, 2), [1.0; 2]);
        let mut preview_scale = PreviewScale::default();
        preview_scale.record(FrameTiming { pixels: 100, draw_s: 0.4, advance_s: 0.0 }, 0.1);
        preview_scale.record(FrameTiming { pixels: 25, draw_s: 0.02, advance_s: 0.0 }, 0.1);
        assert_eq!(preview_scale.scale(), 0.75);
    }

    #[test]
    fn they_stay_large_where_shrinking_does_not_help() {
        let settled = scales(0.0, 1.9, 0.1, 12);
        assert_eq!(settled[0], 0.1875, "nothing was known");
        assert_eq!(settled[1..], [1.0; 11]);
        assert_eq!(scales(1.9, 0.0, 0.05, 12)[11], 1.0, "the simulation takes its time at any size");
    }

    #[test]
    fn they_shrink_as_far_as_it_helps() {
        let settled = *scales(0.0, 1.9, 14.0, 12).last().unwrap();
        assert!((0.1875..0.375).contains(&settled), "{settled}");
        assert_eq!(scales(0.0, 0.05, 0.19, 12), [0.5; 12], "0.05 + 0.19 / 4 is just enough");
    }

    #[test]
    fn a_busier_machine_shrinks_them_for_as_long_as_it_is_busy() {
        let mut preview_scale = PreviewScale::default();
        let mut record = |busy: f64| {
            let part = preview_scale.scale() * preview_scale.scale();
            preview_scale.record(
                FrameTiming { pixels: (1e6 * part) as usize, draw_s: busy * (0.01 + 0.05 * part), advance_s: 0.0 },
                0.1,
            );
            preview_scale.scale()
        };
        assert_eq!(record(1.0), 1.0);
        assert!(record(4.0) < 1.0);
        for _ in 0..8 {
            record(1.0);
        }
        assert_eq!(record(1.0), 1.0);
    }
}
