//! Adaptive preview resolution: full size where the machine is fast enough, smaller where it is not and a smaller size helps.

/// Scales of the window's sides that a preview may have, the largest first.
const SCALES: [f64; 7] = [1.0, 0.75, 0.5, 0.375, 0.25, 0.1875, 0.125];

/// Where no size meets the target, a larger picture may take this many times the time of the smallest.
const WORTHWHILE_FACTOR: f64 = 1.5;

/// A larger scale is chosen only if it takes at most this fraction of the target, so that sizes do not oscillate (hysteresis).
const HEADROOM: f64 = 0.7;

/// Chooses the scale of previews by a cost model.
///
/// Drawing n pixels takes `fixed + each n` seconds: preparing streaks and particles does not depend on the size. Pictures of two sizes
/// determine both terms; at one size only their sum is known, and both are scaled by it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PreviewScale {
    step: usize,
    /// The fitted cost model, once a picture was timed.
    known: Option<CostModel>,
}

/// Cost of drawing a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CostModel {
    /// s.
    fixed: f64,
    /// s a pixel.
    each: f64,
    /// The last picture: pixels, and time to draw, s.
    last: [f64; 2],
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
    fn after(known: Option<Self>, pixels: f64, draw_s: f64) -> Self {
        let last = [pixels, draw_s];
        let Some(Self { fixed, each, last: [before, before_s] }) = known else {
            return Self { fixed: 0.0, each: draw_s / pixels, last };
        };
        if before == pixels {
            // The machine is busier, or there is more to draw.
            let grown = draw_s / (fixed + each * pixels).max(f64::MIN_POSITIVE);
            return Self { fixed: fixed * grown, each: each * grown, last };
        }
        let each = ((before_s - draw_s) / (before - pixels)).clamp(0.0, draw_s / pixels);
        Self { fixed: draw_s - each * pixels, each, last }
    }

    fn seconds(&self, pixels: f64) -> f64 {
        self.fixed + self.each * pixels
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
        let cost = CostModel::after(self.known, pixels, timing.draw_s);
        self.known = Some(cost);
        let present = self.scale();
        let seconds = |step: usize| {
            let ratio = SCALES[step] / present;
            timing.advance_s + cost.seconds(pixels * ratio * ratio)
        };
        let worthwhile = |step: usize, headroom: f64| {
            let smallest = seconds(SCALES.len() - 1);
            seconds(step)
                <= (headroom * target_s).max(if smallest > target_s { WORTHWHILE_FACTOR * smallest } else { 0.0 })
        };
        if !worthwhile(self.step, 1.0) {
            self.step = (self.step + 1..SCALES.len()).find(|&step| worthwhile(step, 1.0)).unwrap_or(SCALES.len() - 1);
        } else {
            self.step = (0..self.step).find(|&step| worthwhile(step, HEADROOM)).unwrap_or(self.step);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shares that a pace comes to where drawing 1e6 pixels takes `fixed` and `whole` more, s.
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
