//! What reaches a plate from lights that stand still, for each pixel: illuminance for an intensity of 1, with shadows. Frames share it.

use std::sync::Arc;

use bansho_base::{
    camera::directions::Directions,
    host::{
        observer::{self, Cancelled, Observer},
        parallel::prelude::*,
    },
    image::Image,
    math::simd::{LANES, Lanes, Real, any_positive},
    phenomenon::{
        light_batch::RelativeLight,
        surroundings::{Emitter, Light, Occluder},
    },
};
use fearless_simd::{dispatch, prelude::*};

use super::{
    plate_shadows::{PlateShadows, ShadowGrid},
    plate_surface::PlateSurface,
};

/// Most lights whose light on a plate is kept. Each takes 4 bytes for each pixel.
pub(crate) const MAX_TRANSPORTS: usize = 24;

/// The light of an emitter of intensity 1 on a plate.
#[derive(Debug)]
pub(super) struct LightTransport {
    /// Illuminance, in the rows of a [`PlateSurface`]: visibility times cosine over the square of the distance.
    pub(super) illuminance: Vec<f32>,
    /// The largest value of each row.
    pub(super) row_maxima: Vec<f32>,
}

impl LightTransport {
    fn new(grid: &ShadowGrid, emitter: Emitter, casters: &[Occluder]) -> Self {
        let surface = &*grid.surface;
        let shadows = PlateShadows::new(grid, emitter, casters);
        let light = RelativeLight::new(&Light { emitter, intensity: [1.0; 3] }, surface.camera.position);
        let stride = surface.stride.max(1);
        let mut illuminance = vec![0.0; surface.depth.len()];
        let mut row_maxima = vec![0.0; surface.size[1]];
        let level = bansho_base::math::simd::level();
        illuminance.par_chunks_mut(stride).zip(row_maxima.par_iter_mut()).enumerate().for_each(
            |(y, (values, maximum))| {
                let visibility = shadows.row(y);
                dispatch!(level, simd => fill_row(simd, surface, &light, &visibility, y, values));
                *maximum = values.iter().copied().fold(0.0, f32::max);
            },
        );
        Self { illuminance, row_maxima }
    }
}

#[inline(always)]
fn fill_row<S: Simd>(
    simd: S,
    surface: &PlateSurface,
    light: &RelativeLight,
    visibility: &[f32],
    y: usize,
    values: &mut [f32],
) {
    let mut x = 0;
    while x + LANES <= values.len() {
        let visible = Lanes::from_slice(simd, &visibility[x..x + LANES]);
        if any_positive(visible) {
            let illuminance = surface.batch(simd, x, y).unshadowed(simd, light);
            (illuminance * visible).store_slice(&mut values[x..x + LANES]);
        }
        x += LANES;
    }
}

/// Positions and normals of sixteen pixels of a surface.
pub(super) struct SurfaceBatch<S: Simd> {
    /// Relative to the camera, m.
    points: [Lanes<S>; 3],
    normals: [Lanes<S>; 3],
}

impl PlateSurface {
    /// The pixels from column `x` on in row `y`.
    #[inline(always)]
    pub(super) fn batch<S: Simd>(&self, simd: S, x: usize, y: usize) -> SurfaceBatch<S> {
        let at = y * self.stride + x;
        let directions = Directions::new(&self.camera, x, y);
        let depth = Lanes::from_slice(simd, &self.depth[at..at + LANES]);
        let points = [
            depth * Lanes::from_slice(simd, &directions.components[0]),
            depth * Lanes::from_slice(simd, &directions.components[1]),
            depth * Lanes::from_slice(simd, &directions.components[2]),
        ];
        let normals = [
            Lanes::from_slice(simd, &self.normal[0][at..at + LANES]),
            Lanes::from_slice(simd, &self.normal[1][at..at + LANES]),
            Lanes::from_slice(simd, &self.normal[2][at..at + LANES]),
        ];
        SurfaceBatch { points, normals }
    }
}

impl<S: Simd> SurfaceBatch<S> {
    /// Illuminance from a light relative to its intensity, without shadows.
    #[inline(always)]
    pub(super) fn unshadowed(&self, simd: S, light: &RelativeLight) -> Lanes<S> {
        let arriving = light.arriving(simd, &self.points);
        let [toward_x, toward_y, toward_z] = arriving.toward;
        let [x, y, z] = self.normals;
        let cos = toward_x.fma(x, toward_y.fma(y, toward_z * z));
        arriving.factor * cos.simd_max(Lanes::splat(simd, 0.0))
    }
}

/// A light whose transport is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TransportKey {
    pub(super) emitter: Emitter,
    /// Whether it moves, so that its shadows are computed for this frame alone, with fewer rays.
    pub(super) moves: bool,
}

/// A plate, and the grids for shadows on it.
struct ShadowGrids {
    surface: Arc<PlateSurface>,
    standing: ShadowGrid,
    moving: ShadowGrid,
}

/// The transports of recent frames. Each has the values that a new computation gives, so that no frame depends on those before it.
#[derive(Default)]
pub(super) struct TransportCache {
    grids: Option<ShadowGrids>,
    casters: Vec<Occluder>,
    /// In the order of their last use, the latest at the end.
    entries: Vec<(TransportKey, Arc<LightTransport>)>,
}

impl TransportCache {
    /// The transports of at most [`MAX_TRANSPORTS`] lights to the surface of a plate.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub(super) fn transports(
        &mut self,
        surface: &Arc<PlateSurface>,
        depth: &Image<1>,
        keys: &[TransportKey],
        casters: &[Occluder],
        observer: &dyn Observer,
    ) -> Result<Vec<Arc<LightTransport>>, Cancelled> {
        if !Occluder::are_same(&self.casters, casters) {
            self.entries.clear();
            self.casters = casters.to_vec();
        }
        let grids = self.grids.take().filter(|grids| Arc::ptr_eq(&grids.surface, surface));
        if grids.is_none() {
            self.entries.clear();
        }
        let grids = self.grids.insert(grids.unwrap_or_else(|| {
            let [standing, moving] = [false, true].map(|for_motion| ShadowGrid::new(surface, depth, for_motion));
            ShadowGrids { surface: surface.clone(), standing, moving }
        }));
        let mut transports = Vec::with_capacity(keys.len());
        for key in keys {
            let index = self.entries.iter().position(|(cached, _)| cached == key);
            let transport = match index {
                Some(index) => self.entries.remove(index).1,
                None => {
                    observer::check(observer)?;
                    // Before another is allocated. Those of this frame are the latest.
                    if self.entries.len() >= MAX_TRANSPORTS {
                        self.entries.remove(0);
                    }
                    let grid = if key.moves { &grids.moving } else { &grids.standing };
                    Arc::new(LightTransport::new(grid, key.emitter, casters))
                }
            };
            self.entries.push((*key, transport.clone()));
            transports.push(transport);
        }
        // Those that move are hardly the same in the next frame.
        self.entries.retain(|(key, _)| !key.moves || keys.contains(key));
        Ok(transports)
    }
}
