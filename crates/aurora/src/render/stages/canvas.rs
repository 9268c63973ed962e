//! A square picture of the drawn plane, seen along the field: east to the right, north up.

use bansho_base::{color::acescg_from_srgb, math, math::DVec2};

/// Luminance of white, cd/m^2; that of the stages of a flame sheet is its own.
pub(crate) const WHITE_LUMINANCE: f64 = 1000.0;

/// ACEScg, cd/m^2, row by row from the north.
pub(super) struct Canvas {
    pub(super) side: usize,
    pub(super) pixels: Vec<[f32; 3]>,
    /// Pixels per km.
    scale: f64,
}

/// A linear sRGB color of the figures, 1 is [`WHITE_LUMINANCE`], in the working space.
pub(super) fn color(srgb: [f32; 3]) -> [f32; 3] {
    acescg_from_srgb(srgb).map(|value| value * WHITE_LUMINANCE as f32)
}

/// The color of a value from 0 to 1 as in the thesis's figures: blue, cyan, green, yellow, red.
pub(super) fn false_color(value: f64) -> [f32; 3] {
    let position = 4.0 * value.clamp(0.0, 1.0);
    // Positions at which red, green and blue are brightest: their ramps overlap by half.
    let srgb = [4.0 - 0.5, 2.0, 0.5].map(|peak: f64| {
        let code = (1.5 - (position - peak).abs()).clamp(0.0, 1.0) as f32;
        // Display codes rise evenly, so values are decoded.
        math::pow(f64::from(code), 2.2) as f32
    });
    color(srgb)
}

impl Canvas {
    /// A canvas of one color for a square of `extent_km`.
    pub(super) fn new(side: usize, extent_km: f64, background: [f32; 3]) -> Self {
        Self { side, pixels: vec![background; side * side], scale: side as f64 / extent_km }
    }

    /// Position of the center of a pixel in the drawn plane, km.
    pub(super) fn position(&self, [x, y]: [usize; 2]) -> DVec2 {
        let half = 0.5 * self.side as f64;
        DVec2::new(x as f64 + 0.5 - half, y as f64 + 0.5 - half) / self.scale
    }

    /// Pixel coordinates of a position in the drawn plane.
    fn pixel(&self, position: DVec2) -> DVec2 {
        position * self.scale + DVec2::splat(0.5 * self.side as f64)
    }

    /// Colors each pixel by its position, km.
    pub(super) fn fill(&mut self, color: impl Fn(DVec2) -> [f32; 3]) {
        for index in 0..self.pixels.len() {
            self.pixels[index] = color(self.position([index % self.side, index / self.side]));
        }
    }

    /// A line of a width in pixels from one position in km to another; of a single position a disc.
    pub(super) fn line(&mut self, [from, to]: [DVec2; 2], width: f64, color: [f32; 3]) {
        let (from, to) = (self.pixel(from), self.pixel(to));
        let reach = 0.5 * width + 1.0;
        let (low, high) = (from.min(to) - DVec2::splat(reach), from.max(to) + DVec2::splat(reach));
        let [columns, rows] = [(low.x, high.x), (low.y, high.y)].map(|(low, high)| {
            (low.floor().max(0.0) as usize).min(self.side)..(high.ceil().max(0.0) as usize).min(self.side)
        });
        for y in rows {
            for x in columns.clone() {
                let center = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let along = (to - from).length_squared();
                let fraction = if along > 0.0 { (center - from).dot(to - from) / along } else { 0.0 };
                let distance = center.distance(from.lerp(to, fraction.clamp(0.0, 1.0)));
                let coverage = (0.5 * width + 0.5 - distance).clamp(0.0, 1.0) as f32;
                let pixel = &mut self.pixels[y * self.side + x];
                for (value, color) in pixel.iter_mut().zip(color) {
                    *value += coverage * (color - *value);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn north_is_up_and_east_to_the_right() {
        let mut canvas = Canvas::new(100, 200.0, [0.0; 3]);
        // A disc 50 km east and 60 km north (negative z) of the middle.
        let place = DVec2::new(50.0, -60.0);
        canvas.line([place, place], 8.0, [1.0; 3]);
        assert_eq!(canvas.pixels[20 * 100 + 75], [1.0; 3]);
        assert_eq!(canvas.pixels[80 * 100 + 75], [0.0; 3]);
        // Its area is that of a circle of 8 pixels.
        let area: f32 = canvas.pixels.iter().map(|pixel| pixel[1]).sum();
        assert!((f64::from(area) / (std::f64::consts::PI * 16.0) - 1.0).abs() < 0.03, "{area}");
    }

    #[test]
    fn values_go_from_blue_over_green_to_red() {
        let [low, middle, high] = [0.0, 0.5, 1.0].map(|value| bansho_base::color::srgb_from_acescg(false_color(value)));
        assert!(low[2] > 300.0 && low[0] < 1.0, "{low:?}");
        assert!(middle[1] > 990.0 && middle[1] > 1.5 * middle[0].max(middle[2]), "{middle:?}");
        assert!(high[0] > 300.0 && high[1] < 1.0 && high[2] < 1.0, "{high:?}");
    }
}
