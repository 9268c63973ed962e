//! Arbitrary output variables (AOVs): how samples are combined to one value per pixel.

use crate::math::MulAdd;

/// How the samples of an AOV are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AovRule {
    /// Their sum; 0 without samples.
    Sum,
    /// Their weighted mean, with weights defined by the AOV; 0 without samples.
    WeightedMean,
    /// The value of the nearest sample; 0 without samples.
    Nearest,
}

/// A quantity that a phenomenon can output besides its light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AovDescriptor {
    /// Name, appended to that of the phenomenon, such as `temperature_k` or `motion.X`.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Description: the quantity, its weights and its value without samples.
    pub doc: &'static str,
    /// How samples are combined.
    pub rule: AovRule,
}

/// The values of one AOV in a strip.
#[derive(Clone, Debug, Default)]
pub struct AovPlane {
    values: Vec<f32>,
    /// Sums of weights; for [`AovRule::Nearest`] 1/depth of the nearest sample, so that 0 means no sample.
    weights: Vec<f32>,
}

impl AovPlane {
    /// Adds a sample with `value` and `weight` at pixel `index` of the strip.
    pub fn add(&mut self, index: usize, value: f32, weight: f32) {
        self.values[index] = value.fma(weight, self.values[index]);
        self.weights[index] += weight;
    }

    /// Stores a sample with `value` at `depth` (m, above 0) if it is nearer than the current sample of pixel `index` of the strip, for
    /// [`AovRule::Nearest`].
    pub fn keep_nearest(&mut self, index: usize, value: f32, depth: f32) {
        self.keep(index, value, 1.0 / depth);
    }

    fn keep(&mut self, index: usize, value: f32, nearness: f32) {
        if nearness > self.weights[index] {
            (self.values[index], self.weights[index]) = (value, nearness);
        }
    }

    /// The combined value of the samples at pixel `index`.
    pub fn resolve(&self, index: usize, rule: AovRule) -> f32 {
        match rule {
            AovRule::Sum | AovRule::Nearest => self.values[index],
            AovRule::WeightedMean if self.weights[index] > 0.0 => self.values[index] / self.weights[index],
            AovRule::WeightedMean => 0.0,
        }
    }

    /// Adds the samples of another plane of the same size and AOV.
    pub fn add_plane(&mut self, other: &Self, rule: AovRule) {
        if rule == AovRule::Nearest {
            let samples = other.values.iter().zip(&other.weights).enumerate();
            samples.for_each(|(index, (value, nearness))| self.keep(index, *value, *nearness));
            return;
        }
        for (sums, more) in [(&mut self.values, &other.values), (&mut self.weights, &other.weights)] {
            sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        }
    }

    /// Adds the samples of another plane of the same size and AOV with a factor for their weights.
    pub(super) fn add_weighted(&mut self, other: &Self, weight: f32, rule: AovRule) {
        if rule == AovRule::Nearest {
            return self.add_plane(other, rule);
        }
        for (sums, more) in [(&mut self.values, &other.values), (&mut self.weights, &other.weights)] {
            sums.iter_mut().zip(more).for_each(|(sum, more)| *sum = weight.fma(*more, *sum));
        }
    }

    /// Blends with another plane of the same size and AOV: its own samples have the weight `own_weight`, the others the rest.
    pub(super) fn crossfade(&mut self, other: &Self, own_weight: f32, rule: AovRule) {
        if rule == AovRule::Nearest {
            return self.add_plane(other, rule);
        }
        blend(&mut self.values, &other.values, own_weight);
        blend(&mut self.weights, &other.weights, own_weight);
    }

    /// Resets it to an empty plane of `pixels` pixels.
    pub fn reset(&mut self, pixels: usize) {
        reset(&mut self.values, pixels, 0.0);
        reset(&mut self.weights, pixels, 0.0);
    }
}

/// Blends a plane with another one: `weight` of each value and `1 - weight` of the other.
pub(super) fn blend(values: &mut [f32], others: &[f32], weight: f32) {
    values.iter_mut().zip(others).for_each(|(value, other)| *value = weight.fma(*value - other, *other));
}

/// Fills a plane of `pixels` pixels with `value`.
pub(super) fn reset(plane: &mut Vec<f32>, pixels: usize, value: f32) {
    plane.clear();
    plane.resize(pixels, value);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_the_nearest_sample_the_order_does_not_matter_either() {
        let planes = [[(7.0, 4.0), (5.0, 2.0)], [(5.0, 2.0), (7.0, 4.0)]].map(|samples| {
            let mut plane = AovPlane::default();
            plane.reset(2);
            samples.into_iter().for_each(|(value, depth)| plane.keep_nearest(0, value, depth));
            plane
        });
        assert_eq!(planes[0].values, planes[1].values);
        let mut nearer = planes[0].clone();
        nearer.keep_nearest(0, 3.0, 1.0);
        for (mut sum, other) in [(planes[0].clone(), &nearer), (nearer.clone(), &planes[0])] {
            sum.add_plane(other, AovRule::Nearest);
            assert_eq!([0, 1].map(|index| sum.resolve(index, AovRule::Nearest)), [3.0, 0.0]);
        }
    }
}
