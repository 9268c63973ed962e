//! Stages of the computation as pictures of the drawn plane in place of the aurora's light: the figures of chapter 2 of the thesis.
//!
//! The drawn square fills the height or the width of the picture, whichever is smaller, whatever the camera: seen along the field, east to the right
//! and north up. `exposure_ev100 = 9.7` shows its white as white.

mod canvas;

use bansho_base::{
    image::Rect,
    math::{self, DVec2},
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
    },
};

pub(crate) use canvas::WHITE_LUMINANCE;
use canvas::{Canvas, color, false_color};

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
