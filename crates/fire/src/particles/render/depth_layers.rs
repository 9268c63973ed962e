//! Depth layers of the gas, and the statistics over all particles from which they are derived.
//!
//! Gas in different layers has its own detail, and other phenomena can be composited between layers.

use std::ops::Range;

use bansho_base::{
    host::parallel::prelude::*,
    math::{DVec3, Vec3},
    phenomenon::strip::DepthInterval,
};
use fearless_simd::dispatch;

use crate::particles::{
    parameters::{GasRenderingParameters, SpriteStyle},
    render::{
        gas::{Gas, PARTICLES_PER_TASK},
        gas_view::GasView,
        resolve::detail::DetailScale,
    },
};

/// Layers of equal thickness, at multiples of it, so that they do not move with the gas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DepthLayers {
    /// Depth of the near side of the first layer, m.
    pub(crate) near: f64,
    /// Thickness of each, m.
    pub(crate) thickness: f64,
    pub(crate) count: usize,
}

/// Weight of gas that does not absorb, as an absorption coefficient in 1/m: it decides where nothing absorbs.
const MIN_ABSORPTION: f64 = 1e-9;

/// Maximum number of layers of a flame.
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
    /// Layers that cover two standard deviations of the gas on both sides of the mean; gas beyond belongs to the outermost layers.
    ///
    /// Their thickness is at least `min_thickness`, m.
    pub(crate) fn new(&DepthMoments { total, first, second }: &DepthMoments, min_thickness: f64) -> Self {
        let mean = if total > 0.0 { first / total } else { 0.0 };
        let deviation = if total > 0.0 { (second / total - mean * mean).max(0.0).sqrt() } else { 0.0 };
        let mut thickness = min_thickness.max(1e-6);
        let (near, far) = ((mean - 2.0 * deviation).max(0.0), (mean + 2.0 * deviation).max(0.0));
        while Self::layer_count(near, far, thickness) > MAX_LAYERS as f64 {
            thickness *= 2.0;
        }
        let count = Self::layer_count(near, far, thickness) as usize;
        Self { near: (near / thickness).floor() * thickness, thickness, count }
    }

    /// Number of layers that an interval of depth touches; may be too large for an integer.
    fn layer_count(near: f64, far: f64, thickness: f64) -> f64 {
        (far / thickness).floor() - (near / thickness).floor() + 1.0
    }

    /// The layer in front of a depth, and the weight of the next layer there (linear interpolation between layer centers).
    #[inline(always)]
    pub(crate) fn layer_at(&self, depth: f64) -> (usize, f32) {
        let position = ((depth - self.near) / self.thickness - 0.5).clamp(0.0, (self.count - 1) as f64);
        let layer = (position as usize).min(self.count.saturating_sub(2));
        (layer, (position - layer as f64) as f32)
    }

    /// Depth of a layer's center, m.
    pub(crate) fn center(&self, layer: usize) -> f64 {
        self.near + (layer as f64 + 0.5) * self.thickness
    }

    /// Depth interval of each layer.
    pub(crate) fn intervals(&self) -> impl Iterator<Item = DepthInterval> + use<> {
        let Self { near, thickness, count } = *self;
        (0..count).map(move |layer| {
            let [near, far] = [layer, layer + 1].map(|edge| near + edge as f64 * thickness);
            DepthInterval { near, far }
        })
    }
}

/// Whether a particle contributes to the picture's light or opacity.
#[inline(always)]
pub(crate) fn is_visible(gas: &Gas, rendering: &GasRenderingParameters, index: usize) -> bool {
    match rendering.sprite {
        SpriteStyle::LineIntegral => gas.absorption(index, rendering) > 0.0 || gas.is_blue(index, rendering),
        SpriteStyle::Poly6 | SpriteStyle::Squares => true,
    }
}

/// Sums over the gas, as seen by a view.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GasStatistics {
    /// Depth of the visible gas, weighted by volume.
    depth: DepthMoments,
    /// Sum of all support radii, m.
    radius_sum: f64,
    luminous: LuminousSums,
    scale: ScaleSums,
}

/// Sums over the gas that is seen, weighted by its absorption, or, where nothing absorbs, by its volume.
#[derive(Clone, Copy, Debug, Default)]
struct ScaleSums {
    weight: f64,
    /// Of the support radius, pixels.
    radius: f64,
    /// Of the position relative to the particles' origin, m.
    position: DVec3,
}

/// Scale of the gas in the picture, which decides how many samples an exposure needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PictureScale {
    /// Mean support radius, pixels.
    pub(crate) radius: f64,
    /// Mean position, m.
    pub(crate) center: DVec3,
}

/// Sums over the gas that emits light, weighted by luminous intensity.
#[derive(Clone, Copy, Debug, Default)]
struct LuminousSums {
    /// Sum of luminous intensity.
    intensity: f64,
    /// Of the support radius, m.
    radius: f64,
    /// Of the absorption coefficient, 1/m.
    absorption: f64,
    /// Of the pixels per meter.
    pixels_per_meter: f64,
}

impl ScaleSums {
    #[inline(always)]
    fn add(&mut self, gas: &Gas, index: usize, weight: f64, pixels_per_meter: f64) {
        let [x, y, z] = &gas.particles.position;
        self.weight += weight;
        self.radius += weight * f64::from(gas.particles.support_radius[index]) * pixels_per_meter;
        self.position += Vec3::new(x[index], y[index], z[index]).as_dvec3() * weight;
    }

    fn merge(&mut self, other: &Self) {
        self.weight += other.weight;
        self.radius += other.radius;
        self.position += other.position;
    }
}

impl GasStatistics {
    pub(crate) fn new(gas: &Gas, rendering: &GasRenderingParameters, view: &GasView) -> Self {
        let (count, level) = (gas.particles.len(), bansho_base::math::simd::level());
        let tasks = (0..count.div_ceil(PARTICLES_PER_TASK)).into_par_iter();
        let statistics_of_tasks: Vec<Self> = tasks
            .map(|task| {
                let mut statistics = Self::default();
                let range = task * PARTICLES_PER_TASK..((task + 1) * PARTICLES_PER_TASK).min(count);
                dispatch!(level, _simd => statistics.add_all(gas, rendering, view, range.clone()));
                statistics
            })
            .collect();
        // Tasks are summed in order, so that the result does not depend on the number of threads.
        statistics_of_tasks.iter().fold(Self::default(), Self::merge)
    }

    #[inline(always)]
    fn add_all(&mut self, gas: &Gas, rendering: &GasRenderingParameters, view: &GasView, range: Range<usize>) {
        for index in range {
            self.add(gas, rendering, view, index);
        }
    }

    #[inline(always)]
    fn add(&mut self, gas: &Gas, rendering: &GasRenderingParameters, view: &GasView, index: usize) {
        let radius = f64::from(gas.particles.support_radius[index]);
        self.radius_sum += radius;
        if !is_visible(gas, rendering, index) {
            return;
        }
        let depth = view.camera.depth(gas.position(index, view.shutter.middle()));
        if depth <= 0.0 {
            return;
        }
        let volume = gas.volume(index);
        self.depth.add(depth, volume);
        let absorption = gas.absorption(index, rendering);
        self.scale.add(gas, index, volume * absorption.max(MIN_ABSORPTION), view.camera.focal_pixels / depth);
        if absorption > 0.0 && rendering.sprite == SpriteStyle::LineIntegral {
            let intensity = absorption * volume * gas.luminance(index);
            self.luminous.intensity += intensity;
            self.luminous.radius += intensity * radius;
            self.luminous.absorption += intensity * absorption;
            self.luminous.pixels_per_meter += intensity * (view.camera.focal_pixels / depth);
        }
    }

    fn merge(mut self, other: &Self) -> Self {
        self.depth.merge(&other.depth);
        self.radius_sum += other.radius_sum;
        self.scale.merge(&other.scale);
        self.luminous.intensity += other.luminous.intensity;
        self.luminous.radius += other.luminous.radius;
        self.luminous.absorption += other.luminous.absorption;
        self.luminous.pixels_per_meter += other.luminous.pixels_per_meter;
        self
    }

    /// The scale of the gas in the picture; `None` if none is seen.
    pub(crate) fn picture_scale(&self, gas: &Gas) -> Option<PictureScale> {
        let ScaleSums { weight, radius, position } = self.scale;
        (weight > 0.0)
            .then(|| PictureScale { radius: radius / weight, center: gas.particles.origin + position / weight })
    }

    /// The depth layers.
    pub(crate) fn layers(&self, gas: &Gas) -> DepthLayers {
        /// Thickness of a layer in mean support radii: independent of the view, so that layers do not move with the camera.
        const THICKNESS: f64 = 1.6;
        DepthLayers::new(&self.depth, THICKNESS * self.radius_sum / gas.particles.len().max(1) as f64)
    }

    /// Means, weighted by luminous intensity, that determine the scale of detail; `None` if no gas emits light.
    pub(crate) fn detail_scale(&self, gas: &Gas, view: &GasView) -> Option<DetailScale> {
        let LuminousSums { intensity, radius, absorption, pixels_per_meter } = self.luminous;
        (intensity > 0.0).then(|| DetailScale {
            radius: radius / intensity,
            absorption: absorption / intensity,
            pixels_per_meter: pixels_per_meter / intensity,
            time: view.shutter.middle(),
            exposure_s: view.shutter.duration(),
            camera_motion: camera_motion(gas.particles.origin, view),
        })
    }
}

/// Apparent motion of a static point at the flame while the shutter is open, m in world axes.
fn camera_motion(position: DVec3, view: &GasView) -> [f64; 3] {
    let Some([opened, closed]) = &view.ends else { return [0.0; 3] };
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
