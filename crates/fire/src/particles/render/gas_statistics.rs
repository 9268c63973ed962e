//! What one pass over the gas tells of it: how it is spread in depth, and the scale of its detail.

use std::ops::Range;

use bansho_base::{math::DVec3, phenomenon::strip::View};

use super::{
    depth_layers::{DepthLayers, DepthMoments},
    gas::Gas,
    prepared::PARTICLES_PER_TASK,
};
use crate::particles::{
    look_parameters::{LookParameters, SpriteStyle},
    render::resolve::detail::DetailScale,
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

/// Whether a particle adds anything to the picture's light or shade.
#[inline(always)]
pub(crate) fn is_visible(gas: &Gas, look: &LookParameters, index: usize) -> bool {
    match look.sprite {
        SpriteStyle::Integral => gas.absorption(index, look) > 0.0 || gas.is_blue(index, look),
        SpriteStyle::Poly6 | SpriteStyle::Squares => true,
    }
}

/// Sums over the gas that shows, as a view sees it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GasStatistics {
    spread: DepthMoments,
    /// Of support radii, over all particles, m.
    radius_sum: f64,
    /// Of light, and of light times support radius, absorption and pixels a metre.
    light: [f64; 4],
}

impl GasStatistics {
    pub(crate) fn new(gas: &Gas, look: &LookParameters, view: &View) -> Self {
        let (count, level) = (gas.particles.len(), Level::new());
        let of_task = |task: usize| {
            let mut statistics = Self::default();
            let range = task * PARTICLES_PER_TASK..((task + 1) * PARTICLES_PER_TASK).min(count);
            dispatch!(level, _simd => statistics.add_all(gas, look, view, range.clone()));
            statistics
        };
        // Sums of whole tasks, added in order, are the same however many threads there are.
        let of_tasks: Vec<Self> = (0..count.div_ceil(PARTICLES_PER_TASK)).into_par_iter().map(of_task).collect();
        of_tasks.iter().fold(Self::default(), Self::merge)
    }

    #[inline(always)]
    fn add_all(&mut self, gas: &Gas, look: &LookParameters, view: &View, range: Range<usize>) {
        for index in range {
            self.add(gas, look, view, index);
        }
    }

    #[inline(always)]
    fn add(&mut self, gas: &Gas, look: &LookParameters, view: &View, index: usize) {
        let radius = f64::from(gas.particles.support_radius[index]);
        self.radius_sum += radius;
        if !is_visible(gas, look, index) {
            return;
        }
        let depth = view.camera.depth(gas.position(index, view.shutter.middle()));
        if depth <= 0.0 {
            return;
        }
        let volume = gas.volume(index);
        self.spread.add(depth, volume);
        let absorption = gas.absorption(index, look);
        if absorption > 0.0 && look.sprite == SpriteStyle::Integral {
            let light = absorption * volume * gas.luminance(index);
            let scale = view.camera.focal_pixels / depth;
            for (sum, value) in self.light.iter_mut().zip([1.0, radius, absorption, scale]) {
                *sum += light * value;
            }
        }
    }

    fn merge(mut self, other: &Self) -> Self {
        self.spread.merge(&other.spread);
        self.radius_sum += other.radius_sum;
        for (sum, other) in self.light.iter_mut().zip(other.light) {
            *sum += other;
        }
        self
    }

    /// The layers of the gas.
    pub(crate) fn layers(&self, gas: &Gas) -> DepthLayers {
        /// Thickness of a layer in mean support radii, which no view changes, so that layers stand still.
        const THICKNESS: f64 = 1.6;
        DepthLayers::new(&self.spread, THICKNESS * self.radius_sum / gas.particles.len().max(1) as f64)
    }

    /// Means that set the scale of detail, by light; `None` where nothing shines.
    pub(crate) fn scale(&self, gas: &Gas, view: &View) -> Option<DetailScale> {
        let [total, radius, absorption, pixels] = self.light;
        (total > 0.0).then(|| DetailScale {
            radius: radius / total,
            absorption: absorption / total,
            pixels_per_metre: pixels / total,
            time: view.shutter.middle(),
            exposure_s: view.shutter.duration(),
            camera_motion: camera_motion(gas.particles.origin, view),
        })
    }
}

/// How far what stands still at the flame moves before the camera while the shutter is open, m in the world.
fn camera_motion(position: DVec3, view: &View) -> [f64; 3] {
    let (opened, closed) = (view.camera_at(view.shutter.open), view.camera_at(view.shutter.close));
    let local = closed.to_camera(position) - opened.to_camera(position);
    (view.camera.orientation * local).to_array().map(|value| -value)
}
