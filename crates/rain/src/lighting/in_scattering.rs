//! Light of lamps and fires that the rain scatters toward the camera: integrated along the lines of sight at the corners of a grid, and kept while camera,
//! lamps and rain stay the same. Around each place at which a lamp is seen, also beyond the seam of a panorama, there is a finer grid: its halo.

use std::{
    ops::Range,
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
};

use bansho_base::{
    camera::Camera,
    host::parallel::prelude::*,
    image::Rect,
    math::{DVec2, DVec3, MulAdd},
    phenomenon::{
        strip::View,
        surroundings::{Emitter, Light},
    },
};
use fearless_simd::dispatch;

use super::{
    drop_lighting::DropLighting,
    equiangular::{Interval, MIN_LAMP_DISTANCE, SightLineIntegrator},
    extinction::{ExtinctionProfile, RainExtinction},
    lamp_shadows::LampShadows,
    tiles::{FINE_TILE, FINEST_TILE, GridPosition, TileGrid},
};

/// Corners of a grid that a thread integrates at a time.
const CORNERS_PER_TASK: usize = 32;
/// Distance from a lamp in the picture, in pixels, from which its scattered light is smooth over two tiles: it falls with this distance, so linear
/// interpolation is off by 1 %, and 3 % where the ground cuts lines of sight off.
const SMOOTH_RADIUS: f64 = 160.0;

/// In-scattered radiance accumulated from the camera up to each distance, at each corner of a grid.
#[derive(Debug)]
pub(super) struct InScattering {
    /// Number of distances.
    pub(super) distances: usize,
    /// For each corner, the radiance up to each distance, ACEScg, cd/m^2; the fourth component is 0.
    pub(super) sums: Vec<[f32; 4]>,
}

impl InScattering {
    /// The light of some lamps at the corners of a grid.
    fn new(integrator: &SightLineIntegrator, tiles: &TileGrid, lights: &[Light]) -> Self {
        Self::at_corners(integrator, tiles, lights, |_| true)
    }

    /// The light of some lamps at the corners of the picture's grid. Far from all lamps in the picture, every second corner is enough.
    fn over_picture(integrator: &SightLineIntegrator, tiles: &TileGrid, lights: &[Light], camera: &Camera) -> Self {
        // The edge of a cone or of a shadow may be anywhere in the picture, not only near its lamp.
        let has_edge = |light: &Light| {
            matches!(light.emitter, Emitter::Spot { .. }) || integrator.shadows.of(&light.emitter).is_some()
        };
        if lights.iter().any(has_edge) {
            return Self::new(integrator, tiles, lights);
        }
        let lamps: Vec<DVec2> = lights.iter().flat_map(|light| lamp_images(light, camera, SMOOTH_RADIUS)).collect();
        let mut scattering =
            Self::at_corners(integrator, tiles, lights, |corner| needs_integration(tiles, &lamps, corner));
        let [columns, rows] = tiles.size;
        // Even rows first: an odd row is interpolated from those above and below it, of which every second corner is interpolated itself.
        for row in (0..rows).step_by(2).chain((1..rows).step_by(2)) {
            for column in 0..columns {
                let corner = row * columns + column;
                if needs_integration(tiles, &lamps, corner) {
                    continue;
                }
                let step = if row % 2 == 1 && row + 1 < rows { columns } else { 1 };
                scattering.interpolate_corner(corner, step);
            }
        }
        scattering
    }

    /// The light of some lamps at those corners of a grid that are selected.
    fn at_corners(
        integrator: &SightLineIntegrator,
        tiles: &TileGrid,
        lights: &[Light],
        is_selected: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        let distances = integrator.intervals.len() + 1;
        let mut sums = vec![[0.0; 4]; distances * tiles.directions.len()];
        let level = bansho_base::math::simd::level();
        let tasks = sums.par_chunks_mut(distances * CORNERS_PER_TASK).enumerate();
        tasks.for_each(|(task, sums)| {
            let first = task * CORNERS_PER_TASK;
            for ((index, sums), direction) in sums.chunks_mut(distances).enumerate().zip(&tiles.directions[first..]) {
                if is_selected(first + index) {
                    dispatch!(level, _simd => integrator.accumulate(*direction, lights, sums));
                }
            }
        });
        Self { distances, sums }
    }

    /// Sets a corner to the mean of the corners `step` before and after it.
    fn interpolate_corner(&mut self, corner: usize, step: usize) {
        for index in corner * self.distances..(corner + 1) * self.distances {
            let [before, after] = [index - step * self.distances, index + step * self.distances];
            self.sums[index] = std::array::from_fn(|c| 0.5 * (self.sums[before][c] + self.sums[after][c]));
        }
    }

    /// Interpolates between a row of corners and the next, for some columns and indices of distances: the sums of the first column come first. Others
    /// are unspecified.
    #[inline(always)]
    pub(super) fn interpolate_rows(
        &self,
        tiles: &TileGrid,
        row: GridPosition,
        columns: Range<usize>,
        indices: Range<usize>,
        sums: &mut Vec<[f32; 4]>,
    ) {
        sums.resize(columns.len() * self.distances, [0.0; 4]);
        let start = row.index * tiles.size[0];
        for (column, sums) in columns.zip(sums.chunks_exact_mut(self.distances)) {
            let [above, below] = [start + column, start + tiles.size[0] + column]
                .map(|corner| &self.sums[corner * self.distances..][indices.clone()]);
            for ((sum, above), below) in sums[indices.clone()].iter_mut().zip(above).zip(below) {
                for c in 0..4 {
                    sum[c] = (below[c] - above[c]).fma(row.fraction, above[c]);
                }
            }
        }
    }
}

/// Whether the light at a corner of the picture's grid is integrated, with `lamps` at these pixels; otherwise it is interpolated between its neighbors.
fn needs_integration(tiles: &TileGrid, lamps: &[DVec2], corner: usize) -> bool {
    let [columns, rows] = tiles.size;
    let [column, row] = [corner % columns, corner / columns];
    // The last column and row are integrated even if their index is odd: there is none beyond them to interpolate from.
    let is_second = [(column, columns), (row, rows)].map(|(index, count)| index % 2 == 1 && index + 1 < count);
    let position = DVec2::from(tiles.pixel(corner).map(|coordinate| coordinate as f64));
    is_second == [false; 2] || lamps.iter().any(|lamp| lamp.distance_squared(position) < SMOOTH_RADIUS * SMOOTH_RADIUS)
}

/// A lamp in the picture. The light scattered around it falls as 1/h with the distance h of the ray from the lamp, and
/// its cone has an edge; neither survives linear interpolation between grid corners. Near the lamp a finer grid is
/// used, and the factor 1/h is divided out before interpolation.
#[derive(Debug)]
pub(super) struct LampHalo {
    /// Vector from the camera to the lamp, m.
    pub(super) offset: DVec3,
    /// Its position in the picture.
    pub(super) pixel: DVec2,
    /// The pixels near it.
    pub(super) rect: Rect,
    /// The part of the picture's grid that covers them, and its in-scattering at the corners.
    pub(super) tiles: TileGrid,
    pub(super) in_scattering: InScattering,
    /// A finer grid over them, and its in-scattering there times the distance of the ray from the lamp (m).
    pub(super) fine_tiles: TileGrid,
    pub(super) fine_in_scattering: InScattering,
    /// Corrections of its pixels.
    pub(super) corrections: HaloCorrections,
}

/// Corrections of the pixels near a lamp without a plate, for whole lines of sight: a row is computed by the strip that first draws it. They are the same in
/// every frame while camera and lamps stay the same.
pub(super) type HaloCorrections = Vec<OnceLock<Vec<[f32; 3]>>>;

/// Radius around a lamp with the finer grid, pixels.
pub(super) const HALO_RADIUS: f64 = 72.0;
/// Largest number of lamps with a finer grid.
const MAX_HALOS: usize = 8;

/// The pixels of a picture near a lamp.
fn halo_rect(lamp: DVec2, size: [usize; 2]) -> Rect {
    let [left, top] = [lamp.x - HALO_RADIUS, lamp.y - HALO_RADIUS].map(|side| side.max(0.0) as usize);
    let [right, bottom] = [lamp.x + HALO_RADIUS, lamp.y + HALO_RADIUS].map(|side| side.max(0.0) as usize);
    let rect = Rect { x: left, y: top, width: right - left, height: bottom - top };
    rect.intersection(&Rect::from_size(size[0], size[1]))
}

/// The rectangle of whole tiles of the picture's grid around some pixels.
fn around_tiles(rect: Rect) -> Rect {
    let [x, y] = [rect.x, rect.y].map(|side| side / FINE_TILE * FINE_TILE);
    let [right, bottom] = [rect.right(), rect.bottom()].map(|side| side.next_multiple_of(FINE_TILE));
    Rect { x, y, width: right - x, height: bottom - y }
}

/// Distance of a ray from the camera to the point at `offset` from the camera, m.
fn ray_distance(offset: DVec3, direction: DVec3) -> f32 {
    (offset - direction * offset.dot(direction)).length().max(MIN_LAMP_DISTANCE) as f32
}

/// Everything on which the scattered light of lamps depends.
#[derive(Clone, Debug, PartialEq)]
struct ScatteringInputs {
    camera: Camera,
    size: [usize; 2],
    eye: DVec3,
    lights: Vec<Light>,
    shadows: LampShadows,
    /// Extinction coefficient between a light and a drop, 1/m.
    light_extinction: f64,
    extinction: RainExtinction,
    /// Distance to which drops are drawn as streaks, m.
    streak_distance: f64,
    distances: Vec<f64>,
    end: f64,
    ground: f64,
}

/// Light of all lamps and fires scattered toward one camera.
#[derive(Debug)]
pub(super) struct LampScattering {
    inputs: ScatteringInputs,
    /// Of all lamps and fires, if there are any.
    pub(super) in_scattering: Option<InScattering>,
    /// Lamps in the picture.
    pub(super) halos: Vec<LampHalo>,
}

/// The scattered light of recent frames: that of a picture and of its mirror. While the camera and the lamps stand still it is the same in every frame, and
/// integrating it takes longer than all else.
#[derive(Debug, Default)]
pub(crate) struct LampScatteringCache(Mutex<Vec<Arc<LampScattering>>>);

impl LampScatteringCache {
    /// Number of results kept.
    const CAPACITY: usize = 2;

    /// Number of results that are kept.
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.lock().len()
    }

    /// The scattered light at the corners of `tiles`, as the integrator computes it.
    pub(super) fn scattering(
        &self,
        integrator: &InScatterIntegrator,
        tiles: &TileGrid,
        view: &View,
    ) -> Arc<LampScattering> {
        let inputs = integrator.inputs(view);
        if let Some(scattering) = self.lock().iter().find(|scattering| scattering.inputs == inputs) {
            return scattering.clone();
        }
        // Computed without the lock, so that no thread waits.
        let scattering = Arc::new(integrator.scattering(inputs, tiles, view));
        let mut recent = self.lock();
        recent.insert(0, scattering.clone());
        recent.truncate(Self::CAPACITY);
        scattering
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Arc<LampScattering>>> {
        // The list is always consistent, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Integrates single scattering of lamps along lines of sight.
pub(super) struct InScatterIntegrator<'a> {
    pub(super) lighting: &'a DropLighting<'a>,
    pub(super) extinction: ExtinctionProfile<'a>,
    pub(super) eye: DVec3,
    pub(super) distances: &'a [f64],
    pub(super) depths: &'a [f32],
    /// Light from beyond it is neglected, m.
    pub(super) end: f64,
}

impl InScatterIntegrator<'_> {
    fn inputs(&self, view: &View) -> ScatteringInputs {
        let ExtinctionProfile { shutter_state, extinction } = self.extinction;
        ScatteringInputs {
            camera: view.camera,
            size: view.size,
            eye: self.eye,
            lights: self.lighting.lights.to_vec(),
            shadows: self.lighting.shadows.clone(),
            light_extinction: self.lighting.extinction,
            extinction,
            streak_distance: shutter_state.distance,
            distances: self.distances.to_vec(),
            end: self.end,
            ground: shutter_state.ground,
        }
    }

    /// The intervals between the distances that lamps light.
    fn intervals(&self) -> Vec<Interval> {
        let mut intervals = Vec::with_capacity(self.distances.len());
        for (pair, depths) in self.distances.windows(2).zip(self.depths.windows(2)) {
            if pair[0] < self.end {
                let width = (pair[1] - pair[0]) as f32;
                let depth_slope = (depths[1] - depths[0]) / width;
                intervals.push(Interval { start: pair[0], width, depth: depths[0], depth_slope });
            }
        }
        intervals
    }

    fn scattering(&self, inputs: ScatteringInputs, tiles: &TileGrid, view: &View) -> LampScattering {
        let (visible, mut lights) = self.split_lights(view);
        let integrator = SightLineIntegrator {
            scattering: self.lighting.scattering,
            extinction: self.extinction,
            shadows: self.lighting.shadows,
            light_extinction: self.lighting.extinction as f32,
            intervals: &self.intervals(),
            eye: self.eye,
            eye_height: (self.eye.y - self.extinction.shutter_state.ground) as f32,
        };
        let mut halos = Vec::new();
        for (light, images) in &visible {
            halos.extend(images.iter().filter_map(|pixel| halo(&integrator, light, *pixel, view)));
        }
        // Lamps with a halo stay part of the coarse grid: a halo is a correction, which fades out, so that no seam is seen.
        lights.extend(visible.iter().map(|(light, _)| *light));
        let in_scattering =
            (!lights.is_empty()).then(|| InScattering::over_picture(&integrator, tiles, &lights, &view.camera));
        LampScattering { inputs, in_scattering, halos }
    }

    /// Lamps in and near the picture with their pixels, and all other lights.
    fn split_lights(&self, view: &View) -> (Vec<(Light, Vec<DVec2>)>, Vec<Light>) {
        let (mut visible, mut others) = (Vec::new(), Vec::new());
        for light in self.lighting.lights {
            let images = lamp_images(light, &view.camera, HALO_RADIUS);
            if images.is_empty() || visible.len() == MAX_HALOS {
                others.push(*light);
            } else {
                visible.push((*light, images));
            }
        }
        (visible, others)
    }
}

/// The pixels at which a lamp is seen, within the picture or at most `margin` pixels outside of it: several in a panorama, which repeats after 360
/// degrees, so that what surrounds a lamp is seen on both sides of the seam.
fn lamp_images(light: &Light, camera: &Camera, margin: f64) -> Vec<DVec2> {
    let Some(projection) = light.emitter.position().and_then(|position| camera.project(position)) else {
        return Vec::new();
    };
    let images = camera.line_images(projection.pixel, projection.pixel, margin);
    images.into_iter().map(|[pixel, _]| pixel).filter(|pixel| is_near_picture(camera, *pixel, margin)).collect()
}

/// Whether a position is within the picture or at most `margin` pixels outside of it.
fn is_near_picture(camera: &Camera, pixel: DVec2, margin: f64) -> bool {
    (0..2).all(|axis| (-margin..camera.size[axis] + margin).contains(&pixel[axis]))
}

/// The halo of a lamp; `None` for a light at infinity, and where no pixel is near it.
fn halo(integrator: &SightLineIntegrator, light: &Light, pixel: DVec2, view: &View) -> Option<LampHalo> {
    let offset = light.emitter.position()? - integrator.eye;
    let rect = halo_rect(pixel, view.size);
    if rect.is_empty() {
        return None;
    }
    let tiles = TileGrid::over(view, FINE_TILE, around_tiles(rect));
    // On both sides of the seam of a panorama the grid has the same corners.
    let repeats = view.camera.horizontal_period().is_some();
    let fine_tiles = TileGrid::over(view, FINEST_TILE, if repeats { around_tiles(rect) } else { rect });
    let [in_scattering, mut fine_in_scattering] =
        [&tiles, &fine_tiles].map(|tiles| InScattering::new(integrator, tiles, std::slice::from_ref(light)));
    let corners = fine_in_scattering.sums.chunks_mut(fine_in_scattering.distances);
    for (sums, direction) in corners.zip(&fine_tiles.directions) {
        let distance = ray_distance(offset, *direction);
        sums.iter_mut().flatten().for_each(|value| *value *= distance);
    }
    Some(LampHalo {
        offset,
        pixel,
        rect,
        tiles,
        in_scattering,
        fine_tiles,
        fine_in_scattering,
        corrections: (0..rect.height).map(|_| OnceLock::new()).collect(),
    })
}

#[cfg(test)]
mod tests {
    use bansho_base::phenomenon::surroundings::Surroundings;

    use super::*;
    use crate::{
        Rain, RainParameters,
        tests::{lamp, view_at, wind},
    };

    /// Light at all corners, and with every second one interpolated far from two flames.
    fn grids(size: [usize; 2]) -> (InScattering, InScattering) {
        let rain = Rain::new(RainParameters::default(), "rain", 1, None).unwrap();
        let (view, calm) = (view_at(1.0, 1.0 / 60.0, size), wind([0.0; 3], 0.0));
        let shutter_state = rain.shutter_state(&view, &Surroundings::from_wind(&calm));
        let extinction = RainExtinction { all: 0.02, streaks: 0.008 };
        let intervals = [
            Interval { start: 0.0, width: 3.0, depth: 0.0, depth_slope: 0.02 },
            Interval { start: 3.0, width: 20.0, depth: 0.06, depth_slope: 0.02 },
        ];
        let integrator = SightLineIntegrator {
            scattering: &rain.optics.scattering,
            extinction: ExtinctionProfile { shutter_state: &shutter_state, extinction },
            shadows: &LampShadows::default(),
            light_extinction: 0.02,
            intervals: &intervals,
            eye: view.camera.position,
            eye_height: 1.6,
        };
        let tiles = TileGrid::new(&view, FINE_TILE);
        let lights = [lamp([0.1, 1.9, -3.6], 300.0), lamp([-0.3, 1.7, -3.5], 200.0)];
        let all = InScattering::new(&integrator, &tiles, &lights);
        (all, InScattering::over_picture(&integrator, &tiles, &lights, &view.camera))
    }

    #[test]
    fn every_second_corner_is_enough_far_from_lamps() {
        // Odd and even numbers of corners.
        for size in [[1280, 720], [1264, 700]] {
            let (all, some) = grids(size);
            let brightest = all.sums.iter().flatten().copied().fold(0.0, f32::max);
            let (mut interpolated, mut same, mut worst) = (0, 0, 0.0);
            for (exact, found) in all.sums.iter().flatten().zip(some.sums.iter().flatten()) {
                worst = f32::max(worst, (exact - found).abs() / (exact + 1e-3 * brightest));
                interpolated += usize::from(exact != found);
                same += usize::from(exact == found && *exact > 0.0);
            }
            assert!(interpolated > same, "{interpolated} {same}");
            assert!(worst < 0.04, "{worst}");
        }
    }
}
