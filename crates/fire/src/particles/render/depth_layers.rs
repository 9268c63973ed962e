//! Depth layers of the gas, and statistics over all particles from which they follow.
//!
//! Gas in different layers has its own detail, and other phenomena can be composited between layers.

use std::ops::Range;

use bansho_base::{
    math::DVec3,
    phenomenon::strip::{DepthInterval, View},
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use crate::particles::{
    parameters::{RenderingParameters, SpriteStyle},
    render::{
        gas::{Gas, PARTICLES_PER_TASK},
        resolve::detail::DetailScale,
    },
};

/// Layers of equal thickness, at multiples of it, so that they stay in place while the gas moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DepthLayers {
    /// Depth of the near side of the first layer, m.
    pub(crate) near: f64,
    /// Thickness of each, m.
    pub(crate) thickness: f64,
    pub(crate) count: usize,
}

/// Greatest number of layers of a flame.
pub(crate) const MAX_LAYERS: usize = 4;

/// Moments of the gas's distribution in depth: weight, weight times depth, and weight times depth squared.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DepthMoments {
    total: f64,
    first: f64,
    second: f64,
}

impl DepthMoments {
    #[inline(always)]
    pub(crate) fn add(&mut self, depth: f64, weight: f64) {
        self.total += weight;
        self.first += weight * depth;
        self.second += weight * depth * depth;
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.total += other.total;
        self.first += other.first;
        self.second += other.second;
    }
}

impl DepthLayers {
    /// Layers that hold the bulk of the gas; gas farther out belongs to the outermost.
    ///
    /// `min_thickness` is their least thickness, m.
    pub(crate) fn new(&DepthMoments { total, first, second }: &DepthMoments, min_thickness: f64) -> Self {
        let mean = if total > 0.0 { first / total } else { 0.0 };
        let deviation = if total > 0.0 { (second / total - mean * mean).max(0.0).sqrt() } else { 0.0 };
        let mut thickness = min_thickness.max(1e-6);
        let (near, far) = ((mean - 2.0 * deviation).max(0.0), (mean + 2.0 * deviation).max(0.0));
        let count = |thickness: f64| (far / thickness).floor() - (near / thickness).floor() + 1.0;
        while count(thickness) > MAX_LAYERS as f64 {
            thickness *= 2.0;
        }
        Self { near: (near / thickness).floor() * thickness, thickness, count: count(thickness) as usize }
    }

    /// The layer before a depth, and the weight of the next layer there (linear interpolation between layer centers).
    #[inline(always)]
    pub(crate) fn layer_at(&self, depth: f64) -> (usize, f32) {
        let layer_at = ((depth - self.near) / self.thickness - 0.5).clamp(0.0, (self.count - 1) as f64);
        let layer = (layer_at as usize).min(self.count.saturating_sub(2));
        (layer, (layer_at - layer as f64) as f32)
    }

    /// Depth of a layer's center, m.
    pub(crate) fn center(&self, layer: usize) -> f64 {
        self.near + (layer as f64 + 0.5) * self.thickness
    }

    /// Depth interval of each layer.
    pub(crate) fn intervals(&self) -> impl Iterator<Item = DepthInterval> + use<> {
        let Self { near, thickness, count } = *self;
        let edge = move |layer: usize| near + layer as f64 * thickness;
        (0..count).map(move |layer| DepthInterval { near: edge(layer), far: edge(layer + 1) })
    }
}

/// Whether a particle contributes to the picture's light or opacity.
#[inline(always)]
pub(crate) fn is_visible(gas: &Gas, look: &RenderingParameters, index: usize) -> bool {
    match look.sprite {
        SpriteStyle::LineIntegral => gas.absorption(index, look) > 0.0 || gas.is_blue(index, look),
        SpriteStyle::Poly6 | SpriteStyle::Squares => true,
    }
}

/// Sums over the visible gas, as seen by a view.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GasStatistics {
    spread: DepthMoments,
    /// Sum of all support radii, m.
    radius_sum: f64,
    /// Sums of luminous intensity, and of it times support radius, absorption coefficient and pixels per meter.
    light: [f64; 4],
}

impl GasStatistics {
    pub(crate) fn new(gas: &Gas, look: &RenderingParameters, view: &View) -> Self {
        let (count, level) = (gas.particles.len(), Level::new());
        let of_task = |task: usize| {
            let mut statistics = Self::default();
            let range = task * PARTICLES_PER_TASK..((task + 1) * PARTICLES_PER_TASK).min(count);
            dispatch!(level, _simd => statistics.add_all(gas, look, view, range.clone()));
            statistics
        };
        // Tasks are summed in order, so that the result does not depend on the number of threads.
        let of_tasks: Vec<Self> = (0..count.div_ceil(PARTICLES_PER_TASK)).into_par_iter().map(of_task).collect();
        of_tasks.iter().fold(Self::default(), Self::merge)
    }

    #[inline(always)]
    fn add_all(&mut self, gas: &Gas, look: &RenderingParameters, view: &View, range: Range<usize>) {
        for index in range {
            self.add(gas, look, view, index);
        }
    }

    #[inline(always)]
    fn add(&mut self, gas: &Gas, look: &RenderingParameters, view: &View, index: usize) {
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
        if absorption > 0.0 && look.sprite == SpriteStyle::LineIntegral {
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

    /// The depth layers.
    pub(crate) fn layers(&self, gas: &Gas) -> DepthLayers {
        /// Thickness of a layer in mean support radii: independent of the view, so that layers stay in place.
        const THICKNESS: f64 = 1.6;
        DepthLayers::new(&self.spread, THICKNESS * self.radius_sum / gas.particles.len().max(1) as f64)
    }

    /// Luminance-weighted means that set the scale of detail; `None` where nothing glows.
    pub(crate) fn scale(&self, gas: &Gas, view: &View) -> Option<DetailScale> {
        let [total, radius, absorption, pixels] = self.light;
        (total > 0.0).then(|| DetailScale {
            radius: radius / total,
            absorption: absorption / total,
            pixels_per_meter: pixels / total,
            time: view.shutter.middle(),
            exposure_s: view.shutter.duration(),
            camera_motion: camera_motion(gas.particles.origin, view),
        })
    }
}

/// Apparent motion of a static point at the flame while the shutter is open, m in world axes.
fn camera_motion(position: DVec3, view: &View) -> [f64; 3] {
    let (opened, closed) = (view.camera_at(view.shutter.open), view.camera_at(view.shutter.close));
    let local = closed.point_in_camera(position) - opened.point_in_camera(position);
    (view.camera.world_from_camera * local).to_array().map(|value| -value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_hold_the_bulk_and_stay_few() {
        for spread in [0.0, 0.01, 0.3, 5.0, 400.0] {
            let mut gas = DepthMoments::default();
            (0..100).for_each(|i| gas.add(1000.0 + spread * (f64::from(i) / 99.0 - 0.5), 1.0));
            let layers = DepthLayers::new(&gas, 0.1);
            assert!((1..=MAX_LAYERS).contains(&layers.count), "{layers:?}");
            assert!(layers.intervals().any(|interval| interval.contains(1000.0)), "{layers:?}");
        }
    }

    #[test]
    fn a_depth_is_shared_by_the_two_layers_around_it() {
        let layers = DepthLayers { near: 2.0, thickness: 0.5, count: 3 };
        assert_eq!((layers.layer_at(2.25), layers.layer_at(2.5)), ((0, 0.0), (0, 0.5)));
        assert_eq!(
            (layers.layer_at(0.0), layers.layer_at(3.25), layers.layer_at(99.0)),
            ((0, 0.0), (1, 1.0), (1, 1.0))
        );
        let lone = DepthLayers { count: 1, ..layers };
        assert_eq!((lone.layer_at(0.0), lone.layer_at(9.0)), ((0, 0.0), (0, 0.0)));
    }
}
