//! Burners: how much gas enters which cell.

use bansho_base::{
    host::{assets::Assets, parallel::prelude::*},
    math::{
        DVec3,
        random::{Key, Purpose},
    },
    noise::{Coordinate, Fractal, Noise, VARIANCE},
};
use bansho_fluid::{Flow, Grid, Solids};

use crate::{
    particles::{BurnerParameters, FlameParticlesParameters, simulate::burner::Burner},
    volume::{
        error::{VolumeError, VolumeErrorKind},
        parameters::{FlameVolumeParameters, VolumeBurnerParameters},
    },
};

/// Samples of the surface of a burner for each cell of a disk of its area.
const SAMPLES_PER_CELL: f64 = 24.0;
/// Largest number of samples of a burner.
const MAX_SAMPLES: f64 = 60_000.0;
/// Size of the patches in which the flow of a burner varies, as a fraction of its diameter, and their lifetime in seconds for a diameter of one meter.
const PATCH: f64 = 0.3;
const PATCH_LIFETIME_S: f64 = 0.35;

/// A burner of a volume flame.
#[derive(Clone, Debug)]
pub(crate) struct VolumeBurner {
    pub(crate) parameters: VolumeBurnerParameters,
    surface: Burner,
    pub(crate) heat_release_kw: f64,
    pub(crate) largest_flow: f64,
    pub(crate) area_m2: f64,
    pub(crate) diameter: f64,
    /// Whether the scene gives its position.
    pub(crate) is_placed: bool,
    noise: Option<Noise<4>>,
}

impl VolumeBurner {
    /// The burners of a flame.
    pub(crate) fn list(
        parameters: &FlameVolumeParameters,
        key: Key,
        assets: &dyn Assets,
    ) -> Result<Vec<Self>, VolumeError> {
        let single = [VolumeBurnerParameters::default()];
        let listed = if parameters.burners.is_empty() { &single[..] } else { &parameters.burners };
        let burners = listed.iter().enumerate().map(|(index, burner)| {
            Self::new(burner, key, index, assets)
                .map_err(|kind| VolumeError { key: format!("burners.{index}.file"), kind })
        });
        burners.collect()
    }

    fn new(
        parameters: &VolumeBurnerParameters,
        key: Key,
        index: usize,
        assets: &dyn Assets,
    ) -> Result<Self, VolumeErrorKind> {
        let VolumeBurnerParameters { shape, position, rotation_deg, diameter, length, size, file, scale, .. } =
            parameters.clone();
        let of_surface = BurnerParameters {
            shape,
            position,
            rotation_deg,
            diameter,
            length,
            size,
            file,
            scale,
            ..BurnerParameters::default()
        };
        let surface =
            Burner::new(&of_surface, &FlameParticlesParameters::default(), assets).map_err(VolumeErrorKind::Burner)?;
        let seed = key.words(index as u64, 0, Purpose::named("burner flow"))[0];
        Ok(Self {
            heat_release_kw: parameters.heat_release_kw,
            largest_flow: parameters.flow.bounds()[1],
            area_m2: surface.area_m2,
            diameter: surface.diameter,
            is_placed: parameters.position != VolumeBurnerParameters::default().position,
            noise: Noise::new(seed, Fractal { octaves: 2, lacunarity: 2, gain: 0.5 }, [0; 4]).ok(),
            parameters: parameters.clone(),
            surface,
        })
    }

    /// Corners of its bounding box over time, relative to the flame's position, m.
    pub(crate) fn extent(&self) -> [DVec3; 2] {
        let [first, last] = self.parameters.position.bounds().map(DVec3::from);
        [first + self.surface.extent[0], last + self.surface.extent[1]]
    }

    /// The cells into which it emits at `t`. Cells of the same index are listed once, in rising order.
    fn cells(&self, grid: &Grid, solids: &Solids, key: Key, t: f64) -> Vec<BurnerCell> {
        let area = grid.spacing * grid.spacing;
        let count = (SAMPLES_PER_CELL * self.area_m2 / area).clamp(64.0, MAX_SAMPLES) as u64;
        let samples = (0..count).into_par_iter().filter_map(|id| {
            let place = self.surface.spawn_point(key, id, t);
            // Half a cell along the normal, out of what burns.
            let point = place.position + place.direction * (0.5 * grid.spacing);
            Some((free_cell(grid, solids, point, place.direction)?, place.position))
        });
        let mut samples: Vec<(usize, DVec3)> = samples.collect();
        samples.sort_by_key(|(index, _)| *index);
        let cells = samples.chunk_by(|(index, _), (next, _)| index == next).map(|samples| BurnerCell {
            index: samples[0].0,
            samples: samples.len() as f32,
            middle: samples.iter().map(|(_, position)| *position).sum::<DVec3>() / samples.len() as f64,
        });
        cells.collect()
    }

    /// The share of its gas of each of its cells at `t`.
    fn shares(&self, cells: &[BurnerCell], t: f64, unevenness: f64) -> Vec<(usize, f32)> {
        let noise_scale = 1.0 / (PATCH * self.diameter);
        let noise_time = t / (PATCH_LIFETIME_S * bansho_base::math::sqrt(self.diameter));
        let amplitude = unevenness / bansho_base::math::sqrt(VARIANCE[2] * 5.0 / 9.0);
        let weights = cells.iter().map(|cell| {
            let [x, y, z] = (cell.middle * noise_scale).to_array();
            let place = [x, y, z, noise_time].map(Coordinate::from_f64);
            let noise = self.noise.as_ref().map_or(0.0, |noise| f64::from(noise.at(place)));
            (cell.index, cell.samples * (1.0 + amplitude * noise).clamp(0.0, 3.0) as f32)
        });
        let mut shares: Vec<(usize, f32)> = weights.collect();
        let total: f32 = shares.iter().map(|(_, weight)| *weight).sum();
        shares.iter_mut().for_each(|(_, weight)| *weight /= total.max(f32::MIN_POSITIVE));
        shares
    }
}

/// A cell into which a burner emits.
#[derive(Clone, Copy, Debug)]
struct BurnerCell {
    index: usize,
    /// How many samples of the burner's surface are in it.
    samples: f32,
    /// The mean of their positions, m.
    middle: DVec3,
}

/// The cells of all burners, which stay the same while burners, grid and solids do.
#[derive(Debug, Default)]
pub(crate) struct BurnerCells(Vec<Option<(DVec3, Vec<BurnerCell>)>>);

impl BurnerCells {
    /// Forgets them: grid or solids have changed.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// The cells into which burner `number` emits at `t`, with the share of its gas of each.
    pub(crate) fn shares(
        &mut self,
        number: usize,
        burner: &VolumeBurner,
        flow: &Flow,
        key: Key,
        t: f64,
        unevenness: f64,
    ) -> Vec<(usize, f32)> {
        self.0.resize_with(self.0.len().max(number + 1), || None);
        let position = DVec3::from(burner.parameters.position.at(t));
        let kept = self.0[number].take().filter(|(at, _)| *at == position);
        let (_, cells) =
            self.0[number].insert(kept.unwrap_or_else(|| (position, burner.cells(&flow.grid, &flow.solids, key, t))));
        burner.shares(cells, t, unevenness)
    }
}

/// The cell at a point, or the next one in a direction that is not solid.
fn free_cell(grid: &Grid, solids: &Solids, point: DVec3, direction: DVec3) -> Option<usize> {
    /// How far gas finds its way out of a solid, cells.
    const REACH: usize = 4;
    for distance in 0..=REACH {
        let place = grid.point_in_cells(point + direction * (distance as f64 * grid.spacing));
        let cell: [usize; 3] =
            std::array::from_fn(|axis| (place[axis].floor().max(0.0) as usize).min(grid.size[axis] - 1));
        let index = grid.index(cell);
        if !solids.contains(index) {
            return Some(index);
        }
    }
    None
}
