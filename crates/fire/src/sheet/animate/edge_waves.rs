//! P of eq. (15), the fluttering of an edge: random, or a curve that repeats.

use bansho_base::math::{
    MulAdd,
    curve::Curve,
    random::{Key, Purpose},
};

use super::{clock::Clock, fluctuation::Fluctuation};
use crate::sheet::parameters::SheetShapeParameters;

/// A function of the height in the texture, in [-1, 1]; P is (1 + value) / 2.
#[derive(Clone, Debug)]
pub(crate) enum EdgeWaves {
    /// A sum of sines.
    Random(Fluctuation),
    /// The curve of the scene along each wave.
    Curve {
        /// P from 0 to 1.
        curve: Curve,
        /// Waves per sheet height.
        waves: f64,
        /// Where on the curve the height 0 is.
        phase: f64,
    },
}

impl EdgeWaves {
    /// The waves of an edge, which scroll with the texture, so that a whole number of them passes in a loop.
    pub(crate) fn new(shape: &SheetShapeParameters, key: Key, purpose: Purpose, phase: f64, clock: &Clock) -> Self {
        match &shape.flutter_curve {
            Some(curve) => Self::Curve { curve: curve.clone(), waves: clock.waves(shape.flutter_waves, 1.0), phase },
            None => {
                let fit = |waves| clock.waves(waves, 1.0);
                Self::Random(Fluctuation::new(key, purpose, shape.flutter_waves, 0.9, fit))
            }
        }
    }

    /// The values at `start + i * step`, in sheet heights.
    pub(crate) fn fill(&self, start: f64, step: f64, values: &mut [f32]) {
        match self {
            Self::Random(fluctuation) => fluctuation.fill(start, step, values),
            Self::Curve { curve, waves, phase } => {
                for (index, value) in values.iter_mut().enumerate() {
                    let turns = waves.fma(step.fma(index as f64, start), *phase);
                    *value = (2.0 * curve.eval(turns - turns.floor()) - 1.0) as f32;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{math::curve::Interpolation, parameters::animated::Animated};

    use super::*;

    #[test]
    fn a_curve_repeats_with_each_wave_and_is_half_a_wave_later_on_the_left() {
        let triangle = Curve::new(vec![[0.0, 0.0], [0.5, 1.0], [1.0, 0.0]], Interpolation::Linear).unwrap();
        let shape = SheetShapeParameters {
            flutter_curve: Some(triangle),
            flutter_waves: 2.0,
            ..SheetShapeParameters::default()
        };
        let values = |phase: f64, start: f64, loop_s: Option<f64>| {
            let clock = Clock::new(Animated::from(1.3), loop_s);
            let waves = EdgeWaves::new(&shape, Key::new(1, "edge"), Purpose::named("edge"), phase, &clock);
            let mut values = [0.0; 5];
            waves.fill(start, 0.125, &mut values);
            values
        };
        // Two waves per height: a quarter of a wave from one value to the next.
        assert_eq!(values(0.0, 0.0, None), [-1.0, 0.0, 1.0, 0.0, -1.0]);
        assert_eq!(values(0.5, 0.0, None), [1.0, 0.0, -1.0, 0.0, 1.0]);
        assert_eq!(values(0.0, -1234.5, None), values(0.0, 0.0, None));
        // A loop of 1 s scrolls by 1.3 heights: 2.6 waves become 3.
        let [first, last] = [0.0, -1.3].map(|start| values(0.0, start, Some(1.0)));
        assert!(first.iter().zip(last).all(|(a, b)| (a - b).abs() < 1e-5), "{first:?} {last:?}");
    }
}
