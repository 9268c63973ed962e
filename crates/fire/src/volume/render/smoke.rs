//! Light on smoke: that of the fire, of lamps and of the sky, which smoke on the way weakens, at the cells of a coarse grid.
//!
//! The fire shines from the brightest clusters of its cells, whose light on the way to a cell is absorbed along a straight line through the coarse grid. Light is
//! scattered once, alike in all directions.

use bansho_base::{
    color,
    host::parallel::prelude::*,
    math::{
        self, DVec3, Vec3,
        simd::{FourLanes, Real},
    },
    phenomenon::surroundings::{Emitter, Light, Surroundings},
};
use bansho_fluid::{ActiveRows, Flow};
use fearless_simd::{Simd, prelude::*};

use super::{
    field::{GasField, spline_weights},
    optics::GasOptics,
};
use crate::volume::fuel::soot_profile;

/// Least side of a coarse cell, cells, and most coarse cells along a side of the grid.
const LEAST_SIDE: usize = 4;
const MOST_CELLS: usize = 32;
/// Side of a cluster of coarse cells that shine together, and number of clusters that shine.
const CLUSTER: usize = 4;
const MOST_EMITTERS: usize = 24;
/// Coarse cells around smoke on which light is computed, so that the splines in it read no others.
const MARGIN: usize = 2;

/// Cells in blocks.
#[derive(Clone, Copy, Debug)]
struct CoarseGrid {
    /// Side of a coarse cell, cells.
    side: usize,
    size: [usize; 3],
}

/// What the gas of a coarse cell emits and absorbs.
#[derive(Clone, Copy, Debug, Default)]
struct CoarseCell {
    /// Mean extinction coefficient of smoke, 1/m.
    smoke: f32,
    /// Luminous intensity without self-absorption, cd, ACEScg.
    intensity: [f32; 3],
}

/// Radiance that opaque smoke scatters toward the camera, at the cells of a coarse grid.
pub(crate) struct SmokeLight {
    grid: CoarseGrid,
    values: Vec<[f32; 4]>,
}

impl CoarseGrid {
    fn new(size: [usize; 3]) -> Self {
        let longest = size.into_iter().max().unwrap_or(1);
        let side = longest.div_ceil(MOST_CELLS).max(LEAST_SIDE);
        Self { side, size: size.map(|cells| cells.div_ceil(side)) }
    }

    fn cells(&self) -> usize {
        self.size.iter().product()
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (y * self.size[2] + z) * self.size[0] + x
    }

    fn cell(&self, index: usize) -> [usize; 3] {
        let [width, _, depth] = self.size;
        [index % width, index / (width * depth), index / width % depth]
    }

    /// Center of a coarse cell, in cells from the center of the first one.
    fn center(&self, cell: [usize; 3]) -> DVec3 {
        DVec3::from(cell.map(|place| ((place as f64 + 0.5) * self.side as f64) - 0.5))
    }
}

impl SmokeLight {
    /// The light on the gas of a field, isotropic single scattering with that albedo. `own` are the lights by which the flame shines on other objects: their sum is
    /// what the clusters shine with.
    pub(crate) fn new(
        field: &GasField,
        flow: &Flow,
        active: &ActiveRows,
        optics: &GasOptics,
        own: &[Light],
        surroundings: &Surroundings,
        albedo: f64,
    ) -> Option<Self> {
        field.blocks.seen_bounds?;
        let grid = CoarseGrid::new(field.grid.size);
        let cells = coarse_cells(grid, flow, active, optics);
        let smoke: Vec<f32> = cells.iter().map(|cell| cell.smoke).collect();
        let mut lights = emitters(grid, field, &cells, own);
        lights.extend_from_slice(&surroundings.others.lights);
        let factor = (albedo / (4.0 * std::f64::consts::PI)) as f32;
        // A uniform sky of that radiance shines from all sides: from below reflected.
        let sky = surroundings.sky.horizontal_illuminance().map(|value| 2.0 * value * factor);
        let from_sky = transmittance_from_sky(grid, &smoke, (field.grid.spacing * grid.side as f64) as f32);
        let is_near = near_smoke(grid, &smoke);
        let shadows = Shadows { field, grid, smoke: &smoke };
        let light = |index: usize| {
            if !is_near[index] {
                return [0.0; 4];
            }
            let center = grid.center(grid.cell(index));
            let point = field.point_in_world(center);
            let mut sum = sky.map(|value| value * from_sky[index]);
            for light in &lights {
                let incident = light.incident_light(point);
                let radius = if let Emitter::Point { radius, .. } = light.emitter { radius } else { 0.0 };
                let way = if light.emitter.position().is_some() { incident.distance - radius } else { f64::INFINITY };
                let transmittance = shadows.transmittance(center, incident.toward, way);
                (0..3).for_each(|c| sum[c] += incident.illuminance[c] * transmittance * factor);
            }
            [sum[0], sum[1], sum[2], 0.0]
        };
        Some(Self { grid, values: (0..grid.cells()).into_par_iter().map(light).collect() })
    }

    /// The radiance at a point in cells, by cubic B-splines.
    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, point: Vec3) -> [f32; 3] {
        let place = (point + 0.5) * (1.0 / self.grid.side as f32) - 0.5;
        let (x, weights_x) = clamped_taps(place.x, self.grid.size[0]);
        let (y, weights_y) = clamped_taps(place.y, self.grid.size[1]);
        let (z, weights_z) = clamped_taps(place.z, self.grid.size[2]);
        let mut sum = FourLanes::splat(simd, 0.0);
        for j in 0..4 {
            for k in 0..4 {
                let row = (y[j] * self.grid.size[2] + z[k]) * self.grid.size[0];
                let mut along = FourLanes::splat(simd, 0.0);
                for i in 0..4 {
                    let value = FourLanes::from_slice(simd, &self.values[row + x[i]]);
                    along = value.fma(value.broadcast(weights_x[i]), along);
                }
                sum = along.fma(along.broadcast(weights_y[j] * weights_z[k]), sum);
            }
        }
        [sum[0], sum[1], sum[2]]
    }
}

/// The four coarse cells around a place along an axis, and their weights.
#[inline(always)]
fn clamped_taps(place: f32, count: usize) -> ([usize; 4], [f32; 4]) {
    let from_first = place.simd_max(0.0).simd_min((count - 1) as f32);
    let below = from_first as usize;
    let last = count - 1;
    let taps = [below.saturating_sub(1), below, (below + 1).min(last), (below + 2).min(last)];
    (taps, spline_weights(from_first - below as f32))
}

/// What the gas in each coarse cell emits and absorbs.
fn coarse_cells(grid: CoarseGrid, flow: &Flow, active: &ActiveRows, optics: &GasOptics) -> Vec<CoarseCell> {
    let [width, height, depth] = flow.grid.size;
    let [columns, layers, rows] = grid.size;
    let volume = flow.grid.spacing * flow.grid.spacing * flow.grid.spacing;
    let per_cell = 1.0 / (grid.side * grid.side * grid.side) as f32;
    let [mixtures, deficits] = &flow.contents.quantities;
    let black_body = color::black_body();
    let row_of_cells = |row: usize| {
        let (layer, row) = (row / rows, row % rows);
        let mut cells = vec![CoarseCell::default(); columns];
        for y in layer * grid.side..((layer + 1) * grid.side).min(height) {
            for z in row * grid.side..((row + 1) * grid.side).min(depth) {
                let first = flow.grid.index([0, y, z]);
                for x in active.row(y, z) {
                    let (mixture, deficit) = (mixtures[first + x], deficits[first + x]);
                    if mixture <= optics.least_smoke {
                        continue;
                    }
                    let cell = &mut cells[x.min(width - 1) / grid.side];
                    cell.smoke += optics.smoke(mixture, deficit) * per_cell;
                    let soot = soot_profile(mixture / optics.mixture.stoichiometric);
                    if soot > 0.0 {
                        let area = optics.soot_absorption * soot * volume as f32;
                        let radiance = black_body.radiance(optics.mixture.temperature_k(mixture, deficit));
                        (0..3).for_each(|c| cell.intensity[c] += radiance[c] * area);
                    }
                }
            }
        }
        cells
    };
    (0..layers * rows).into_par_iter().flat_map_iter(row_of_cells).collect()
}

/// Point lights in place of the brightest clusters of coarse cells, with the intensity of all `own` lights together.
fn emitters(grid: CoarseGrid, field: &GasField, cells: &[CoarseCell], own: &[Light]) -> Vec<Light> {
    let size = grid.size.map(|cells| cells.div_ceil(CLUSTER));
    let mut clusters = vec![Vec::new(); size.iter().product()];
    for (index, cell) in cells.iter().enumerate() {
        if color::luminance(cell.intensity) > 0.0 {
            let [x, y, z] = grid.cell(index).map(|place| place / CLUSTER);
            let position = field.point_in_world(grid.center(grid.cell(index)));
            let radius = 0.5 * grid.side as f64 * field.grid.spacing;
            let emitter = Emitter::Point { position, radius };
            clusters[(y * size[2] + z) * size[0] + x].push(Light { emitter, intensity: cell.intensity });
        }
    }
    let mut lights: Vec<Light> = clusters.iter().filter_map(Light::merge_points).collect();
    // Sorting is stable, so that clusters of the same intensity keep their order.
    let strength = |light: &Light| color::luminance(light.intensity);
    lights.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    lights.truncate(MOST_EMITTERS);
    let sum = |lights: &[Light]| lights.iter().map(strength).sum::<f32>();
    let scale = sum(own) / sum(&lights).max(f32::MIN_POSITIVE);
    lights.into_iter().map(|light| light.scaled(scale)).collect()
}

/// Smoke that light crosses.
struct Shadows<'a> {
    field: &'a GasField,
    grid: CoarseGrid,
    smoke: &'a [f32],
}

impl Shadows<'_> {
    /// Share of the light that reaches a point (in cells, from the center of the first one) over a way of that many meters in a direction.
    fn transmittance(&self, point: DVec3, toward: DVec3, way: f64) -> f32 {
        let coarse = self.grid.side as f64 * self.field.grid.spacing;
        let first = ((point + 0.5) / self.grid.side as f64 - 0.5).as_vec3();
        let (toward, way) = (toward.as_vec3(), (way / coarse) as f32);
        let size = self.grid.size.map(|cells| cells as f32);
        let (mut depth, mut passed) = (0.0_f32, 0.0_f32);
        while passed < way {
            let step = (way - passed).min(1.0);
            let place = first + toward * (passed + 0.5 * step);
            let is_inside = (0..3).all(|axis| place[axis] > -1.0 && place[axis] < size[axis]);
            if !is_inside {
                break;
            }
            depth += step * self.smoke_at(place);
            passed += step;
        }
        math::f32::exp(-depth * coarse as f32)
    }

    /// Extinction coefficient at a place in coarse cells, 1/m; linear between their centers.
    fn smoke_at(&self, place: Vec3) -> f32 {
        let mut below = [0; 3];
        let mut next = [0; 3];
        let mut fraction = [0.0; 3];
        for axis in 0..3 {
            let last = self.grid.size[axis] - 1;
            let value = place[axis].clamp(0.0, last as f32);
            below[axis] = value as usize;
            next[axis] = (below[axis] + 1).min(last);
            fraction[axis] = value - below[axis] as f32;
        }
        let along_x = |y: usize, z: usize| {
            let [near, far] = [below[0], next[0]].map(|x| self.smoke[self.grid.index([x, y, z])]);
            near + fraction[0] * (far - near)
        };
        let layer = |y: usize| {
            let (near, far) = (along_x(y, below[2]), along_x(y, next[2]));
            near + fraction[2] * (far - near)
        };
        let (lower, upper) = (layer(below[1]), layer(next[1]));
        lower + fraction[1] * (upper - lower)
    }
}

/// Mean transmittance of smoke from the sky, from above and from four sides, at each coarse cell. `side` is that of a coarse cell, m.
fn transmittance_from_sky(grid: CoarseGrid, smoke: &[f32], side: f32) -> Vec<f32> {
    let mut mean = vec![0.0; smoke.len()];
    let [width, height, depth] = grid.size;
    let strides = [1, width * depth, width];
    for (axis, is_reversed, weight) in
        [(1, true, 1.0 / 3.0), (0, false, 1.0 / 6.0), (0, true, 1.0 / 6.0), (2, false, 1.0 / 6.0), (2, true, 1.0 / 6.0)]
    {
        let (length, stride) = ([width, height, depth][axis], strides[axis]);
        for first in (0..smoke.len()).filter(|index| grid.cell(*index)[axis] == 0) {
            let mut before = 0.0;
            for place in 0..length {
                let index = first + stride * if is_reversed { length - 1 - place } else { place };
                mean[index] += weight * math::f32::exp(-(before + 0.5 * smoke[index]) * side);
                before += smoke[index];
            }
        }
    }
    mean
}

/// Whether there is smoke in a coarse cell or near it.
fn near_smoke(grid: CoarseGrid, smoke: &[f32]) -> Vec<bool> {
    let mut is_near: Vec<bool> = smoke.iter().map(|smoke| *smoke > 0.0).collect();
    let [width, _, depth] = grid.size;
    for (axis, stride) in [(0, 1), (1, width * depth), (2, width)] {
        let before = is_near.clone();
        for (index, is_near) in is_near.iter_mut().enumerate() {
            let place = grid.cell(index)[axis];
            let first = index - place.min(MARGIN) * stride;
            let count = place.min(MARGIN) + (grid.size[axis] - 1 - place).min(MARGIN) + 1;
            *is_near = (0..count).any(|step| before[first + step * stride]);
        }
    }
    is_near
}
