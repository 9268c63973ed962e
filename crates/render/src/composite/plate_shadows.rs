//! The shadows that a plate casts on itself: from a grid of its pixels, rays are marched through the plate's depth toward a light.
//!
//! Only what the camera sees casts a shadow, as if it were as deep as it is wide, and at most [`MAX_THICKNESS`]. Flames are large, so rays go to several points of a light, and the shadows are
//! softened over a few pixels.

use std::{ops::Range, sync::Arc};

use bansho_base::{
    camera::Lens,
    host::parallel::prelude::*,
    image::Image,
    math::{DVec2, DVec3, approximations},
    phenomenon::surroundings::{Emitter, Light, Occluder},
    world::shadow,
};

use super::plate_surface::PlateSurface;

/// Longer side of a picture up to which a ray begins in each pixel, in each second, or else in each fourth.
const FINE_GRIDS: [(usize, usize); 2] = [(400, 1), (2000, 2)];
const COARSE_GRID: usize = 4;
/// How many times as large the cells are for lights that move.
const MOVING_SCALE: usize = 2;
/// Most steps of a ray.
const MAX_STEPS: usize = 64;
/// Largest depth that what the plate shows is assumed to reach behind its surface, m.
const MAX_THICKNESS: f32 = 0.35;
/// Relative change of the inverse depth from one cell to the next that is an edge, beyond that of the slope beside it.
const EDGE: f32 = 0.01;
/// Distance at which rays begin before a surface, in cells of the grid: beyond the rounding to whole cells on surfaces that are seen at any angle.
const START: f64 = 1.0;
/// Relative error of a depth.
const DEPTH_ERROR: f32 = 1e-3;
/// Length of rays toward lights at infinity, m.
const LONGEST_RAY: f64 = 200.0;
/// Angular radius of lights at infinity: that of the sun.
const SUN_RADIUS: f64 = 0.004_65;
/// Points of a light to which rays go, in its radii: the corners of a tetrahedron, whose distance is the root mean square of that in a ball.
const SAMPLES: [[f64; 3]; 4] = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
const SAMPLE_SCALE: f64 = 0.447;
/// Radius of lights to whose center alone a ray goes, m.
const SMALL_RADIUS: f64 = 0.03;
/// The visibility of a light from a cell that does not face it, or shows nothing.
const UNKNOWN: f32 = -1.0;

/// The depth of a plate in cells of several pixels.
pub(super) struct ShadowGrid {
    pub(super) surface: Arc<PlateSurface>,
    /// Side of a cell, pixels.
    side: usize,
    size: [usize; 2],
    /// Depth in the middle of each cell, m; infinite where the plate shows nothing.
    depth: Vec<f32>,
    /// Depth to which what is seen there is assumed to reach, m.
    back: Vec<f32>,
}

/// The fraction of a light that reaches each cell of a grid.
pub(super) struct PlateShadows<'a> {
    grid: &'a ShadowGrid,
    visibility: Vec<f32>,
}

/// A light whose shadows are computed.
struct ShadowedLight {
    light: Light,
    /// Radius, m; 0 for spots and lights at infinity.
    radius: f64,
    /// Points to which rays go, relative to the camera, m; none for a light at infinity.
    targets: Vec<DVec3>,
}

impl ShadowedLight {
    fn new(surface: &PlateSurface, emitter: Emitter) -> Self {
        let radius = if let Emitter::Point { radius, .. } = emitter { radius } else { 0.0 };
        let center = emitter.position().map(|position| position - surface.camera.position);
        // The projection of other lenses is slow.
        let is_small = radius < SMALL_RADIUS || surface.camera.lens != Lens::Perspective;
        let targets = match center {
            None => Vec::new(),
            Some(center) if is_small => vec![center],
            Some(center) => SAMPLES.map(|sample| center + DVec3::from(sample) * (SAMPLE_SCALE * radius)).to_vec(),
        };
        Self { light: Light { emitter, intensity: [1.0; 3] }, radius, targets }
    }
}

impl<'a> PlateShadows<'a> {
    /// The shadows of a light on a plate, cast by itself and by visible solids.
    pub(super) fn new(grid: &'a ShadowGrid, emitter: Emitter, casters: &[Occluder]) -> Self {
        let light = ShadowedLight::new(&grid.surface, emitter);
        let mut sharp = vec![UNKNOWN; grid.depth.len()];
        sharp.par_chunks_mut(grid.size[0].max(1)).enumerate().for_each(|(row, cells)| {
            for (column, cell) in cells.iter_mut().enumerate() {
                *cell = grid.visibility([column, row], &light, casters);
            }
        });
        Self { grid, visibility: grid.softened(&sharp) }
    }

    /// The fractions of the light that reach the pixels of row `y` of the picture, as many as rows of a [`PlateSurface`] have.
    pub(super) fn row(&self, y: usize) -> Vec<f32> {
        let Self { grid, .. } = self;
        let surface = &grid.surface;
        let mut visibility = vec![1.0; surface.stride];
        let (upper, lower, down) = grid.between(1, y);
        let depth = &surface.depth[y * surface.stride..][..surface.stride];
        let mut x = 0;
        while x < surface.size[0] {
            // Pixels between the same four cells.
            let (left, right, _) = grid.between(0, x);
            let [upper, lower] = [upper, lower].map(|row| row * grid.size[0]);
            let end = grid.end_between(x).min(surface.size[0]);
            self.fill([upper + left, upper + right, lower + left, lower + right], down, x..end, depth, &mut visibility);
            x = end;
        }
        visibility
    }

    /// Fills the pixels between four cells.
    fn fill(&self, corners: [usize; 4], down: f32, pixels: Range<usize>, pixel_depths: &[f32], visibility: &mut [f32]) {
        let values = corners.map(|corner| self.visibility[corner]);
        if values.iter().all(|value| *value == values[0]) {
            if values[0] >= 0.0 {
                visibility[pixels].fill(values[0]);
            }
            return;
        }
        let depths = corners.map(|corner| self.grid.depth[corner]);
        for x in pixels {
            let (.., across) = self.grid.between(0, x);
            let place = [(1.0 - across) * (1.0 - down), across * (1.0 - down), (1.0 - across) * down, across * down];
            let mut mean = KnownMean::default();
            for corner in 0..4 {
                mean.add(values[corner], place[corner] * likeness(depths[corner], pixel_depths[x]));
            }
            visibility[x] = mean.value().unwrap_or(1.0);
        }
    }
}

/// The weighted mean of those values that are known.
#[derive(Default)]
struct KnownMean {
    sum: f32,
    weight: f32,
}

impl KnownMean {
    #[inline(always)]
    fn add(&mut self, value: f32, weight: f32) {
        let weight = if value >= 0.0 { weight } else { 0.0 };
        self.sum += weight * value;
        self.weight += weight;
    }

    fn value(&self) -> Option<f32> {
        (self.weight > 0.0).then(|| self.sum / self.weight)
    }
}

/// How likely two depths belong to the same surface, as a weight.
fn likeness(a: f32, b: f32) -> f32 {
    let relative = (a - b) / b;
    // At infinity it is 0.
    1.0 / (1.0 + 1e5 * relative * relative)
}

impl ShadowGrid {
    /// The cells for lights that stand still, or for those that move, whose shadows are computed in each frame.
    pub(super) fn new(surface: &Arc<PlateSurface>, depth: &Image<1>, for_motion: bool) -> Self {
        let longest = surface.size[0].max(surface.size[1]);
        let fine = FINE_GRIDS.iter().find(|(side, _)| longest <= *side);
        let side = fine.map_or(COARSE_GRID, |(_, side)| *side);
        let side = if for_motion && side > 1 { side * MOVING_SCALE } else { side };
        let size = surface.size.map(|pixels| pixels.div_ceil(side));
        let mut cells = Vec::with_capacity(size[0] * size[1]);
        for row in 0..size[1] {
            for column in 0..size[0] {
                let [x, y] = middle_of_cell(side, [column, row], surface.size);
                let [depth] = depth.at(x, y);
                cells.push(if depth > 0.0 { depth } else { f32::INFINITY });
            }
        }
        let cell_angle = side as f64 / surface.camera.focal_pixels;
        let widths = widths(&cells, size);
        let back_of = |(depth, width): (&f32, &f32)| depth + (width * cell_angle as f32 * depth).min(MAX_THICKNESS);
        let back = cells.iter().zip(&widths).map(back_of).collect();
        Self { surface: surface.clone(), side, size, depth: cells, back }
    }

    /// The two cells whose middles a pixel is between, along an axis, and where it is between them, 0 to 1.
    fn between(&self, axis: usize, pixel: usize) -> (usize, usize, f32) {
        let last = self.size[axis].saturating_sub(1);
        let Some(from_first) = pixel.checked_sub(self.side / 2) else { return (0, 0, 0.0) };
        let (cell, rest) = (from_first / self.side, from_first % self.side);
        (cell.min(last), (cell + 1).min(last), rest as f32 / self.side as f32)
    }

    /// The first column that is not between the same cells as column `x`.
    fn end_between(&self, x: usize) -> usize {
        let half = self.side / 2;
        if x < half { half } else { half + ((x - half) / self.side + 1) * self.side }
    }

    /// The fraction of a light that reaches a cell.
    fn visibility(&self, cell: [usize; 2], light: &ShadowedLight, casters: &[Occluder]) -> f32 {
        let surface = &self.surface;
        let camera = &surface.camera;
        let [x, y] = middle_of_cell(self.side, cell, surface.size);
        let Some(position) = surface.position(x, y) else { return UNKNOWN };
        let normal = surface.normal_at(x, y);
        let arriving = light.light.incident_light(camera.position + position);
        if arriving.toward.dot(normal) <= 0.0 || arriving.illuminance[0] <= 0.0 {
            return UNKNOWN;
        }
        let is_far = light.targets.is_empty();
        if !is_far && arriving.distance <= light.radius {
            return 1.0;
        }
        let cell_size = self.side as f64 * f64::from(surface.depth[y * surface.stride + x]) / camera.focal_pixels;
        let start = position + normal * (START * cell_size);
        let of_plate = if is_far {
            f32::from(u8::from(!self.is_hidden(start, position + arriving.toward * LONGEST_RAY)))
        } else {
            let reached = light.targets.iter().filter(|target| !self.is_hidden(start, **target)).count();
            reached as f32 / light.targets.len() as f32
        };
        if casters.is_empty() || of_plate <= 0.0 {
            return of_plate;
        }
        let (distance, angular_radius) = if is_far {
            (LONGEST_RAY, SUN_RADIUS)
        } else {
            (arriving.distance - light.radius, light.radius / arriving.distance)
        };
        let point = camera.position + position;
        let of_casters = shadow::visibility(casters, point, arriving.toward, distance, angular_radius.clamp(1e-3, 0.5));
        of_plate * of_casters as f32
    }

    /// Whether what the plate shows is between two points relative to the camera.
    fn is_hidden(&self, from: DVec3, to: DVec3) -> bool {
        let camera = &self.surface.camera;
        if camera.lens == Lens::Perspective {
            let camera_from_world = camera.world_from_camera.transpose();
            return self.is_hidden_in_perspective(camera_from_world * from, camera_from_world * to);
        }
        let length = (to - from).length();
        let step = (to - from) / MAX_STEPS as f64;
        (1..=MAX_STEPS).any(|index| {
            let Some(seen) = camera.project(camera.position + from + step * index as f64) else { return false };
            let cell = self.cell(seen.pixel);
            self.is_behind(cell.as_vec2().to_array(), seen.depth as f32, (length / MAX_STEPS as f64) as f32)
        })
    }

    /// The same for points in camera space and a perspective camera, in whose picture rays are straight and the inverse of the depth is linear.
    fn is_hidden_in_perspective(&self, from: DVec3, to: DVec3) -> bool {
        let near = self.surface.camera.near.max(1e-3);
        let (from_depth, to_depth) = (-from.z, -to.z);
        if from_depth <= near {
            return false;
        }
        // Up to the plane before the camera.
        let to = if to_depth < near { from.lerp(to, (from_depth - near) / (from_depth - to_depth)) } else { to };
        let [start, end] = [from, to].map(|point| self.cell(self.pixel_in_perspective(point)));
        let way = end - start;
        // Up to the edge of the picture.
        let mut part = 1.0_f64;
        for (start, way, cells) in [(start.x, way.x, self.size[0]), (start.y, way.y, self.size[1])] {
            let edge = if way > 0.0 { cells as f64 } else { 0.0 };
            if way != 0.0 {
                part = part.min((edge - start) / way);
            }
        }
        let length = way.abs().max_element() * part;
        if length.is_nan() || length <= 0.0 {
            return false;
        }
        let steps = (length.ceil() as usize).clamp(1, MAX_STEPS);
        let (start, way) = ((start.as_vec2()).to_array(), (way * part).as_vec2().to_array());
        let inverse_from = 1.0 / from_depth;
        let (inverse, change) = (inverse_from as f32, ((-1.0 / to.z - inverse_from) * part) as f32);
        // Cell by cell at first, where contacts are, and in longer steps further on.
        let (per_step, first) = (1.0 / steps as f32, (steps as f64 / length).min(1.0) as f32);
        let mut last_depth = from_depth as f32;
        for step in 1..=steps {
            let t = step as f32 * per_step;
            let t = t * ((1.0 - first) * t + first);
            let depth = 1.0 / (change * t + inverse);
            if self.is_behind([way[0] * t + start[0], way[1] * t + start[1]], depth, (depth - last_depth).abs()) {
                return true;
            }
            last_depth = depth;
        }
        false
    }

    /// Whether a point at a position in cells and a depth is behind what the plate shows there, or has been within a step that changed its depth by this
    /// much.
    #[inline(always)]
    fn is_behind(&self, [x, y]: [f32; 2], depth: f32, step: f32) -> bool {
        let column = approximations::round_to_i32(x - 0.5).cast_unsigned() as usize;
        let row = approximations::round_to_i32(y - 0.5).cast_unsigned() as usize;
        if column >= self.size[0] || row >= self.size[1] {
            return false;
        }
        let cell = row * self.size[0] + column;
        depth > self.depth[cell] * (1.0 + DEPTH_ERROR) && depth - step < self.back[cell]
    }

    /// A position in the picture in cells, where the cell whose middle is nearest has its integer part.
    fn cell(&self, pixel: DVec2) -> DVec2 {
        (pixel - 0.5 - (self.side / 2) as f64) / self.side as f64 + 0.5
    }

    fn pixel_in_perspective(&self, point: DVec3) -> DVec2 {
        let camera = &self.surface.camera;
        camera.principal_point + DVec2::new(point.x, -point.y) * (camera.focal_pixels / -point.z)
    }

    /// The mean over each cell and its neighbors on the same surface.
    fn softened(&self, sharp: &[f32]) -> Vec<f32> {
        let [columns, rows] = self.size;
        let mut soft = vec![UNKNOWN; sharp.len()];
        soft.par_chunks_mut(columns.max(1)).enumerate().for_each(|(row, cells)| {
            for (column, cell) in cells.iter_mut().enumerate() {
                let own = row * columns + column;
                let mut mean = KnownMean::default();
                for y in row.saturating_sub(1)..(row + 2).min(rows) {
                    for x in column.saturating_sub(1)..(column + 2).min(columns) {
                        let nearness = [1.0, 0.5, 0.25][x.abs_diff(column) + y.abs_diff(row)];
                        let other = y * columns + x;
                        mean.add(sharp[other], nearness * likeness(self.depth[other], self.depth[own]));
                    }
                }
                if sharp[own] >= 0.0 {
                    *cell = mean.value().unwrap_or(sharp[own]);
                }
            }
        });
        soft
    }
}

/// The width in cells of what is seen in each cell, horizontally or vertically, whichever is less: bars are narrow in any direction but one.
fn widths(depth: &[f32], [columns, rows]: [usize; 2]) -> Vec<f32> {
    let mut widths = vec![0.0; depth.len()];
    for row in 0..rows {
        fill_runs(depth, (0..columns).map(|column| row * columns + column), &mut widths, |_, run| run);
    }
    for column in 0..columns {
        fill_runs(depth, (0..rows).map(|row| row * columns + column), &mut widths, f32::min);
    }
    widths
}

/// Combines the value of each cell along a line with the number of cells between the edges around it.
fn fill_runs(depth: &[f32], line: impl Iterator<Item = usize>, values: &mut [f32], combine: fn(f32, f32) -> f32) {
    let cells: Vec<usize> = line.collect();
    // The inverse depth of a plane is linear in a perspective picture.
    let inverse: Vec<f32> = cells.iter().map(|cell| 1.0 / depth[*cell]).collect();
    let mut first = 0;
    for last in 0..cells.len() {
        if last + 1 < cells.len() && !is_edge(&inverse, last) {
            continue;
        }
        let run = (last + 1 - first) as f32;
        for cell in &cells[first..=last] {
            values[*cell] = combine(values[*cell], run);
        }
        first = last + 1;
    }
}

/// Whether there is an edge between a position of a line and the next one.
fn is_edge(inverse: &[f32], index: usize) -> bool {
    let change = |index: usize| (inverse[index + 1] - inverse[index]).abs();
    let before = if index > 0 { change(index - 1) } else { f32::INFINITY };
    let after = if index + 2 < inverse.len() { change(index + 1) } else { f32::INFINITY };
    let slope = before.min(after);
    let slope = if slope < f32::INFINITY { slope } else { 0.0 };
    change(index) > EDGE * inverse[index].max(inverse[index + 1]) + 2.0 * slope
}

/// The pixel in the middle of a cell.
fn middle_of_cell(side: usize, cell: [usize; 2], size: [usize; 2]) -> [usize; 2] {
    [0, 1].map(|axis| (cell[axis] * side + side / 2).min(size[axis] - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_narrow_and_slanted_walls_are_wide() {
        let size = [40, 30];
        // A wall that recedes to the right, and before it a bar of three cells.
        let depth_at =
            |column: usize| if (10..13).contains(&column) { 1.5 } else { 4.0 / (1.0 - 0.02 * column as f32) };
        let depth: Vec<f32> = (0..size[0] * size[1]).map(|index| depth_at(index % size[0])).collect();
        let widths = widths(&depth, size);
        let row: Vec<f32> = widths[5 * size[0]..6 * size[0]].to_vec();
        assert!(row[..10].iter().all(|width| *width == 10.0), "{row:?}");
        assert!(row[10..13].iter().all(|width| *width == 3.0), "{row:?}");
        assert!(row[13..].iter().all(|width| *width == 27.0), "{row:?}");
    }
}
