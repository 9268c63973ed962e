//! Stages of the computation as pictures of the drawn plane in place of the aurora's light: the figures of chapter 2 of the thesis.
//!
//! The drawn square fills the height or the width of the picture, whichever is smaller, whatever the camera: seen along the field, east to the right
//! and north up. `exposure_ev100 = 9.7` shows its white as white.

use bansho_base::{
    color::acescg_from_srgb,
    image::Rect,
    math,
    math::DVec2,
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
    },
};

use crate::{
    AuroraStage,
    shapes::Shape,
    simulate::{AuroraSimulation, field::Grid2},
};

/// In front of everything: a stage is a diagram, not a thing in the scene.
pub(crate) const DEPTHS: DepthInterval = DepthInterval { near: 0.01, far: 0.02 };
const DEPTH: f32 = 0.015;

/// Cells between the arrows of the electric field, as in figure 2.12.
const ARROW_SPACING: usize = 10;
/// Length of the longest arrow relative to their spacing. Lengths grow with the square root of the field, which otherwise would be seen at the sheets only.
const ARROW_LENGTH: f64 = 0.95;
/// Width of lines relative to the side of the square.
const LINE_WIDTH: f64 = 1.0 / 300.0;

/// A frame of a stage.
pub(crate) struct PreparedStage {
    canvas: Canvas,
    /// Upper left pixel of the square in the whole picture.
    corner: [usize; 2],
    size: [usize; 2],
}

impl PreparedStage {
    /// A stage of a state in a view, in which the sheets have this shape.
    pub(crate) fn new(simulation: &AuroraSimulation, shape: &Shape, stage: AuroraStage, view: &View) -> Self {
        let side = view.size[0].min(view.size[1]);
        let canvas = draw(simulation, shape, stage, side);
        Self { canvas, corner: view.size.map(|length| (length - side) / 2), size: view.size }
    }
}

/// The picture of a stage.
fn draw(simulation: &AuroraSimulation, shape: &Shape, stage: AuroraStage, side: usize) -> Canvas {
    let mut canvas = Canvas::new(side, simulation.parameters().extent_km, color([1.0; 3]));
    match stage {
        AuroraStage::Light => {}
        AuroraStage::Shape => draw_shape(&mut canvas, shape),
        AuroraStage::ScatterCount => draw_counts(&mut canvas, simulation, simulation.scatter_counts()),
        AuroraStage::ParticleCount => draw_counts(&mut canvas, simulation, &simulation.particle_counts()),
        AuroraStage::PotentialNoise => draw_noise(&mut canvas, simulation),
        AuroraStage::Potential => draw_potential(&mut canvas, simulation),
        AuroraStage::NearCells => draw_near_cells(&mut canvas, simulation),
    }
    canvas
}

/// Control points in black, joined by green segments (figures 2.9, 2.15, 3.4 to 3.8).
fn draw_shape(canvas: &mut Canvas, shape: &Shape) {
    let width = LINE_WIDTH * canvas.side as f64;
    for sheet in &shape.sheets {
        sheet.points.windows(2).for_each(|pair| canvas.line([pair[0], pair[1]], width, color([0.02, 0.45, 0.05])));
        sheet.points.iter().for_each(|point| canvas.line([*point; 2], 2.6 * width, color([0.0; 3])));
    }
}

/// Numbers of particles per cell (figures 2.10 and 2.14): blue for none, red from twice the typical number of a cell within a sheet on.
fn draw_counts(canvas: &mut Canvas, simulation: &AuroraSimulation, counts: &Grid2) {
    let full = simulation.full_cell_count().max(1.0);
    canvas.fill(|position| false_color(cell_value(counts, position) / (2.0 * full)));
}

/// The noise (figure 2.11), from its lowest to its highest value.
fn draw_noise(canvas: &mut Canvas, simulation: &AuroraSimulation) {
    let grid = simulation.potential();
    canvas.fill(|position| [simulation.potential_noise(cell_center(grid, position)) as f32; 3]);
    let mut highest = 0.0_f64;
    for [value, ..] in &canvas.pixels {
        highest = highest.max(f64::from(value.abs()));
    }
    let scale = 0.5 / highest.max(f64::MIN_POSITIVE);
    for pixel in &mut canvas.pixels {
        *pixel = false_color(0.5 + scale * f64::from(pixel[0]));
    }
}

/// The potential with its noise, from blue where it is lowest to red, and the electric field as white arrows (figures 2.12, 3.14).
fn draw_potential(canvas: &mut Canvas, simulation: &AuroraSimulation) {
    let grid = simulation.potential();
    let lowest = grid.values().iter().copied().fold(0.0, f64::min);
    canvas.fill(|position| {
        let center = cell_center(grid, position);
        let potential = grid.sample(center.to_array()) + simulation.potential_noise(center);
        false_color(1.0 - potential / lowest.min(-f64::MIN_POSITIVE))
    });
    let [columns, rows] = grid.size();
    let spacing = grid.spacing();
    let mut arrows: Vec<[DVec2; 2]> = Vec::new();
    for row in (ARROW_SPACING / 2..rows).step_by(ARROW_SPACING) {
        for column in (ARROW_SPACING / 2..columns).step_by(ARROW_SPACING) {
            let position = DVec2::from(grid.origin()) + DVec2::new(column as f64 + 0.5, row as f64 + 0.5) * spacing;
            arrows.push([position, simulation.electric_field(position)]);
        }
    }
    let longest = arrows.iter().map(|[_, field]| field.length()).fold(0.0, f64::max);
    if longest > 0.0 {
        let length_km = ARROW_LENGTH * ARROW_SPACING as f64 * spacing;
        for [position, field] in arrows {
            let length = length_km * math::sqrt(field.length() / longest);
            draw_arrow(canvas, position, field.normalize_or_zero() * length);
        }
    }
}

/// An arrow with its middle at a position.
fn draw_arrow(canvas: &mut Canvas, middle: DVec2, arrow: DVec2) {
    let (white, width) = (color([1.0; 3]), 0.5 * LINE_WIDTH * canvas.side as f64);
    let (from, to) = (middle - 0.5 * arrow, middle + 0.5 * arrow);
    canvas.line([from, to], width, white);
    for side in [-1.0, 1.0] {
        canvas.line([to, to - 0.3 * arrow + 0.18 * side * arrow.perp()], width, white);
    }
}

/// Cells near the shape (2.3.4): red by both tests, yellow by the potential alone, as within a fold in figure 3.14; blue for others.
fn draw_near_cells(canvas: &mut Canvas, simulation: &AuroraSimulation) {
    let grid = simulation.potential();
    let [by_potential, by_both] = simulation.near_cells();
    canvas.fill(|position| {
        let Some(cell) = grid.index(position.to_array()) else { return false_color(0.0) };
        match (by_potential[cell], by_both[cell]) {
            (_, true) => false_color(1.0),
            (true, false) => false_color(0.7),
            (false, false) => false_color(0.0),
        }
    });
}

/// The value of the cell at a position.
fn cell_value(grid: &Grid2, position: DVec2) -> f64 {
    grid.index(position.to_array()).map_or(0.0, |cell| grid.values()[cell])
}

/// The center of the cell at a position.
fn cell_center(grid: &Grid2, position: DVec2) -> DVec2 {
    let origin = DVec2::from(grid.origin());
    origin + (((position - origin) / grid.spacing()).floor() + DVec2::splat(0.5)) * grid.spacing()
}

impl Prepared for PreparedStage {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        if slice.overlaps(&DEPTHS) { Rect::from_size(self.size[0], self.size[1]) } else { Rect::default() }
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        if !(slice.near <= f64::from(DEPTH) && f64::from(DEPTH) < slice.far) {
            return;
        }
        let (rect, side) = (strip.rect, self.canvas.side);
        let columns = rect.x.max(self.corner[0])..rect.right().min(self.corner[0] + side);
        if columns.is_empty() {
            return;
        }
        for y in rect.y.max(self.corner[1])..rect.bottom().min(self.corner[1] + side) {
            let start = (y - self.corner[1]) * side + columns.start - self.corner[0];
            let pixels = &self.canvas.pixels[start..start + columns.len()];
            let planes = [0, 1, 2].map(|channel| pixels.iter().map(|pixel| pixel[channel]).collect::<Vec<f32>>());
            let (opaque, depth) = (vec![1.0; pixels.len()], vec![DEPTH; pixels.len()]);
            let first = (y - rect.y) * rect.width + columns.start - rect.x;
            let [red, green, blue] = &planes;
            strip.add_row_behind(first, [red, green, blue], Some(&opaque), &depth);
        }
    }
}

/// Luminance of white, cd/m^2; that of the stages of a flame sheet is its own.
pub(crate) const WHITE_LUMINANCE: f64 = 1000.0;

/// ACEScg, cd/m^2, row by row from the north.
struct Canvas {
    side: usize,
    pixels: Vec<[f32; 3]>,
    /// Pixels per km.
    scale: f64,
}

/// A linear sRGB color of the figures, 1 is [`WHITE_LUMINANCE`], in the working space.
fn color(srgb: [f32; 3]) -> [f32; 3] {
    acescg_from_srgb(srgb).map(|value| value * WHITE_LUMINANCE as f32)
}

/// The color of a value from 0 to 1 as in the thesis's figures: blue, cyan, green, yellow, red.
fn false_color(value: f64) -> [f32; 3] {
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
    fn new(side: usize, extent_km: f64, background: [f32; 3]) -> Self {
        Self { side, pixels: vec![background; side * side], scale: side as f64 / extent_km }
    }

    /// Position of the center of a pixel in the drawn plane, km.
    fn position(&self, [x, y]: [usize; 2]) -> DVec2 {
        let half = 0.5 * self.side as f64;
        DVec2::new(x as f64 + 0.5 - half, y as f64 + 0.5 - half) / self.scale
    }

    /// Pixel coordinates of a position in the drawn plane.
    fn pixel(&self, position: DVec2) -> DVec2 {
        position * self.scale + DVec2::splat(0.5 * self.side as f64)
    }

    /// Colors each pixel by its position, km.
    fn fill(&mut self, color: impl Fn(DVec2) -> [f32; 3]) {
        for index in 0..self.pixels.len() {
            self.pixels[index] = color(self.position([index % self.side, index / self.side]));
        }
    }

    /// A line of a width in pixels from one position in km to another; of a single position a disc.
    fn line(&mut self, [from, to]: [DVec2; 2], width: f64, color: [f32; 3]) {
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
        let lit = (0..100 * 100).filter(|index| canvas.pixels[*index] == [1.0; 3]);
        let (mut column, mut row, mut count) = (0.0, 0.0, 0.0);
        for index in lit {
            (column, row, count) = (column + (index % 100) as f64, row + (index / 100) as f64, count + 1.0);
        }
        bansho_base::assert_measured!("figure 2.2: column of a point 50 km east", column / count, 75.0, 0.51);
        bansho_base::assert_measured!("figure 2.2: row of a point 60 km north", row / count, 20.0, 0.51);
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
