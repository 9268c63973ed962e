//! Light of lamps and fires that the rain scatters toward the camera: integrated along the lines of sight at the corners of a grid, and kept while camera,
//! lamps and rain stay the same.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use bansho_base::{
    camera::Camera,
    image::Rect,
    math::{self, DVec2, DVec3},
    phenomenon::{
        strip::{DepthInterval, View},
        surroundings::{Emitter, Light},
    },
};

use super::{
    drop_lighting::DropLighting,
    extinction::RainExtinction,
    tiles::{FINEST_TILE, TileGrid},
};
use crate::drops::shutter_state::ShutterState;

/// Angle subtended at a lamp by one sample of the equiangular quadrature, radians.
const SAMPLE_ANGLE: f64 = 0.15;
/// Smallest distance of a ray from a lamp, m.
const MIN_LAMP_DISTANCE: f64 = 0.02;

/// Extinction coefficient as a function of the distance from the camera.
#[derive(Clone, Copy)]
pub(super) struct ExtinctionProfile<'a> {
    pub(super) shutter_state: &'a ShutterState,
    pub(super) extinction: RainExtinction,
}

impl ExtinctionProfile<'_> {
    pub(super) fn at(&self, distance: f64) -> f64 {
        self.extinction.all - self.extinction.streaks * f64::from(self.shutter_state.streak_weight(distance as f32))
    }
}

/// In-scattered radiance accumulated from the camera up to each distance, at each corner of a grid.
#[derive(Debug)]
pub(super) struct InScattering(pub(super) Vec<Vec<[f32; 3]>>);

impl InScattering {
    fn new(directions: &[Vec<[f32; 3]>], distances: usize) -> Self {
        Self((0..distances).map(|k| directions.iter().map(|sums| sums[k]).collect()).collect())
    }

    fn add(&mut self, other: &Self) {
        for (sum, more) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            (0..3).for_each(|c| sum[c] += more[c]);
        }
    }
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
    /// Its in-scattering at the corners of the picture's grid.
    pub(super) in_scattering: InScattering,
    /// A finer grid over the pixels near it, its in-scattering there, and the distances of the rays from the lamp, m.
    pub(super) fine_tiles: TileGrid,
    pub(super) fine_in_scattering: InScattering,
    pub(super) ray_distance: Vec<f32>,
    /// Corrections of its pixels for recent depth intervals.
    pub(super) corrections: HaloCorrectionCache,
}

/// Corrections of the pixels near a lamp, row by row, for recent depth intervals without a plate. They are the same in every frame while camera, lamps and
/// slices stay the same.
#[derive(Debug, Default)]
pub(super) struct HaloCorrectionCache(Mutex<Vec<(DepthInterval, Arc<HaloCorrections>)>>);

/// Corrections of the pixels near a lamp: a row is computed by the strip that first draws it.
pub(super) type HaloCorrections = Vec<OnceLock<Vec<[f32; 3]>>>;

impl HaloCorrectionCache {
    /// Number of depth intervals kept: a scene with other phenomena has several slices.
    const CAPACITY: usize = 4;

    /// The rows of a depth interval, at first without values.
    pub(super) fn rows(&self, slice: &DepthInterval, height: usize) -> Arc<HaloCorrections> {
        let mut recent = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, rows)) = recent.iter().find(|(known, _)| known == slice) {
            return rows.clone();
        }
        let rows = Arc::new((0..height).map(|_| OnceLock::new()).collect::<HaloCorrections>());
        recent.insert(0, (*slice, rows.clone()));
        recent.truncate(Self::CAPACITY);
        rows
    }
}

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

/// Distance of a ray from the camera to the point at `offset` from the camera, m.
pub(super) fn ray_distance(offset: DVec3, direction: DVec3) -> f32 {
    (offset - direction * offset.dot(direction)).length().max(MIN_LAMP_DISTANCE) as f32
}

/// Everything on which the scattered light of lamps depends.
#[derive(Clone, Debug, PartialEq)]
struct ScatteringInputs {
    camera: Camera,
    size: [usize; 2],
    eye: DVec3,
    lights: Vec<Light>,
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
        self.0.lock().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// The scattered light at the corners of `tiles`, as the integrator computes it.
    pub(super) fn scattering(
        &self,
        integrator: &InScatterIntegrator,
        tiles: &TileGrid,
        view: &View,
    ) -> Arc<LampScattering> {
        let inputs = integrator.inputs(view);
        // The list is always consistent, so a poisoned lock is usable.
        let cached = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = cached().iter().find(|known| known.inputs == inputs) {
            return known.clone();
        }
        // Computed without the lock, so that no thread waits.
        let scattering = Arc::new(integrator.scattering(inputs, tiles, view));
        let mut cached = cached();
        cached.insert(0, scattering.clone());
        cached.truncate(Self::CAPACITY);
        scattering
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
            light_extinction: self.lighting.extinction,
            extinction,
            streak_distance: shutter_state.distance,
            distances: self.distances.to_vec(),
            end: self.end,
            ground: shutter_state.ground,
        }
    }

    fn scattering(&self, inputs: ScatteringInputs, tiles: &TileGrid, view: &View) -> LampScattering {
        let (visible, others) = self.split_lights(view);
        let halos: Vec<LampHalo> =
            visible.into_iter().map(|(light, pixel)| self.halo(&light, pixel, tiles, view)).collect();
        let in_scattering = (!self.lighting.lights.is_empty()).then(|| {
            let radiance = tiles.map(|_, direction| self.accumulate(direction, &others));
            let mut in_scattering = InScattering::new(&radiance, self.distances.len());
            halos.iter().for_each(|halo| in_scattering.add(&halo.in_scattering));
            in_scattering
        });
        LampScattering { inputs, in_scattering, halos }
    }

    /// Lamps in and near the picture with their pixels, and all other lights.
    fn split_lights(&self, view: &View) -> (Vec<(Light, DVec2)>, Vec<Light>) {
        let (mut visible, mut others) = (Vec::new(), Vec::new());
        for light in self.lighting.lights {
            let projection = match light.emitter {
                Emitter::Point { position, .. } | Emitter::Spot { position, .. } => view.camera.project(position),
                Emitter::Directional { .. } => None,
            };
            let near = |pixel: DVec2| {
                (0..2).all(|axis| (-HALO_RADIUS..view.size[axis] as f64 + HALO_RADIUS).contains(&pixel[axis]))
            };
            match projection.map(|projection| projection.pixel).filter(|pixel| near(*pixel)) {
                Some(pixel) if visible.len() < MAX_HALOS => visible.push((*light, pixel)),
                _ => others.push(*light),
            }
        }
        (visible, others)
    }

    fn halo(&self, light: &Light, pixel: DVec2, tiles: &TileGrid, view: &View) -> LampHalo {
        let offset = match light.emitter {
            Emitter::Point { position, .. } | Emitter::Spot { position, .. } => position - self.eye,
            Emitter::Directional { toward } => toward,
        };
        let rect = halo_rect(pixel, view.size);
        let fine_tiles = TileGrid::over(view, FINEST_TILE, rect);
        let [in_scattering, fine_in_scattering] = [tiles, &fine_tiles].map(|tiles| {
            let radiance = tiles.map(|_, direction| self.accumulate(direction, std::slice::from_ref(light)));
            InScattering::new(&radiance, self.distances.len())
        });
        let ray_distance = fine_tiles.directions.iter().map(|direction| ray_distance(offset, *direction)).collect();
        LampHalo {
            offset,
            pixel,
            rect,
            in_scattering,
            fine_tiles,
            fine_in_scattering,
            ray_distance,
            corrections: HaloCorrectionCache::default(),
        }
    }

    /// Light of some lamps scattered toward the camera up to each distance.
    fn accumulate(&self, direction: DVec3, lights: &[Light]) -> Vec<[f32; 3]> {
        let mut sums = vec![[0.0; 3]; self.distances.len()];
        if direction == DVec3::ZERO {
            return sums;
        }
        for light in lights {
            let mut sum = [0.0_f32; 3];
            for k in 0..self.distances.len() - 1 {
                let in_range = self.distances[k] < self.end;
                let radiance = if in_range { self.segment(light, direction, k) } else { [0.0; 3] };
                for c in 0..3 {
                    sum[c] += radiance[c];
                    sums[k + 1][c] += sum[c];
                }
            }
        }
        sums
    }

    /// Light of one lamp scattered between two distances: `integral of beta E p / (4 pi) e^-tau ds`.
    fn segment(&self, light: &Light, direction: DVec3, k: usize) -> [f32; 3] {
        let [from, to] = [self.distances[k], self.distances[k + 1]];
        let position = match light.emitter {
            Emitter::Directional { .. } => return self.sample(light, direction, 0.5 * (from + to), to - from, k),
            Emitter::Point { position, .. } | Emitter::Spot { position, .. } => position,
        };
        // Equiangular sampling (Kulla & Fajardo 2012): steps of equal angle at the lamp. There ds / r^2 is the angle's
        // step over the smallest distance h, so the integrand has no peak near the lamp.
        let nearest = (position - self.eye).dot(direction);
        let h = (position - self.eye - direction * nearest).length().max(MIN_LAMP_DISTANCE);
        let [first, last] = [from, to].map(|s| math::atan((s - nearest) / h));
        let samples = ((last - first) / SAMPLE_ANGLE).ceil().max(1.0);
        let step = (last - first) / samples;
        (0..samples as usize).fold([0.0; 3], |sum: [f32; 3], index| {
            let offset = h * math::tan(first + step * (index as f64 + 0.5));
            let length = step * (h * h + offset * offset) / h;
            let radiance = self.sample(light, direction, nearest + offset, length, k);
            std::array::from_fn(|c| sum[c] + radiance[c])
        })
    }

    /// Light scattered within `length` of the line around a distance.
    fn sample(&self, light: &Light, direction: DVec3, at: f64, length: f64, k: usize) -> [f32; 3] {
        let point = self.eye + direction * at;
        let extinction = self.extinction.at(at);
        if extinction <= 0.0 || point.y < self.extinction.shutter_state.ground {
            return [0.0; 3];
        }
        let radiance = self.lighting.radiance(light, point, direction);
        let t = ((at - self.distances[k]) / (self.distances[k + 1] - self.distances[k])) as f32;
        let depth = self.depths[k] + (self.depths[k + 1] - self.depths[k]) * t;
        let scale = math::approximations::exp(-depth) * (extinction * length) as f32;
        radiance.map(|value| value * scale)
    }
}
