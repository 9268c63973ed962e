//! Layers of depth within the gas: sheets of gas before and behind each other keep their own detail, and other phenomena can stand between.

use bansho_base::phenomenon::strip::DepthInterval;

/// Layers of equal thickness, anchored at whole multiples of it so that they stand still while the gas moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DepthLayers {
    /// Depth at which the first begins, m.
    pub(crate) near: f64,
    /// Thickness of each, m.
    pub(crate) thickness: f64,
    pub(crate) count: usize,
}

/// Most layers of a flame.
pub(crate) const MAX_LAYERS: usize = 4;

/// How gas is spread in depth: shares of the whole, and these times depth and its square.
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
    /// Layers that hold the bulk of the gas; what lies further out joins the outermost.
    ///
    /// `min_thickness` is the least thickness that pays, m.
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

    /// The layer before the depth, and the share of what lies there that belongs to the next.
    #[inline(always)]
    pub(crate) fn layer_at(&self, depth: f64) -> (usize, f32) {
        let layer_at = ((depth - self.near) / self.thickness - 0.5).clamp(0.0, (self.count - 1) as f64);
        let layer = (layer_at as usize).min(self.count.saturating_sub(2));
        (layer, (layer_at - layer as f64) as f32)
    }

    /// Depth of the middle of a layer, m.
    pub(crate) fn center(&self, layer: usize) -> f64 {
        self.near + (layer as f64 + 0.5) * self.thickness
    }

    /// The stretch of depth of each layer.
    pub(crate) fn intervals(&self) -> impl Iterator<Item = DepthInterval> + use<> {
        let Self { near, thickness, count } = *self;
        let edge = move |layer: usize| near + layer as f64 * thickness;
        (0..count).map(move |layer| DepthInterval { near: edge(layer), far: edge(layer + 1) })
    }
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
