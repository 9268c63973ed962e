//! Quantities beside light: how their samples become one number a pixel.

use super::strip::{blend, reset};
use crate::math::MulAdd;

/// How the samples of an AOV become one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AovRule {
    /// Their sum; 0 where there is nothing.
    Sum,
    /// Their mean, weighted as the AOV says; 0 where there is nothing.
    WeightedMean,
    /// That of the nearest; 0 where there is nothing.
    Nearest,
}

/// A measured quantity that a phenomenon can write beside its light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AovDescriptor {
    /// Name behind the phenomenon's, such as `temperature_k` or `motion.X`.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// What it is, how it is weighted, and its empty value.
    pub doc: &'static str,
    /// How samples combine.
    pub rule: AovRule,
}

/// The plane of one AOV within a strip.
#[derive(Clone, Debug, Default)]
pub struct AovPlane {
    values: Vec<f32>,
    /// Sums of weights; of the nearest sample 1/depth, so that no sample is 0 too.
    weights: Vec<f32>,
}

impl AovPlane {
    /// Adds a sample of `value` that counts `weight` at pixel `index` of the strip.
    pub fn add(&mut self, index: usize, value: f32, weight: f32) {
        self.values[index] = value.fma(weight, self.values[index]);
        self.weights[index] += weight;
    }

    /// Keeps a sample of `value` at `depth` (m, above 0) if it is nearer than what pixel `index` of the strip has, for
    /// [`AovRule::Nearest`].
    pub fn keep_nearest(&mut self, index: usize, value: f32, depth: f32) {
        self.keep(index, value, 1.0 / depth);
    }

    fn keep(&mut self, index: usize, value: f32, nearness: f32) {
        if nearness > self.weights[index] {
            (self.values[index], self.weights[index]) = (value, nearness);
        }
    }

    /// What the samples at pixel `index` come to.
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
        let add = |sums: &mut [f32], more: &[f32]| sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        add(&mut self.values, &other.values);
        add(&mut self.weights, &other.weights);
    }

    /// Its samples count `share`, those of another plane of the same size and AOV the rest.
    pub(super) fn crossfade(&mut self, other: &Self, share: f32, rule: AovRule) {
        if rule == AovRule::Nearest {
            return self.add_plane(other, rule);
        }
        blend(&mut self.values, &other.values, share);
        blend(&mut self.weights, &other.weights, share);
    }

    /// Makes it an empty plane of so many pixels.
    pub fn reset(&mut self, pixels: usize) {
        reset(&mut self.values, pixels, 0.0);
        reset(&mut self.weights, pixels, 0.0);
    }
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
