//! Fluctuations in closed form: sums of sines with incommensurate frequencies.

use bansho_base::math::{
    self, MulAdd, approximations,
    random::{Key, Purpose},
};

const WAVES: usize = 6;

/// Frequencies of the sines relative to the second, in irrational ratios; amplitudes decrease as 1/sqrt(f).
const RATIOS: [f64; WAVES] = [0.412_7, 1.0, 1.618_03, 2.539_1, 3.763_7, 5.871_3];

/// A function of one variable in [-1, 1] with mean 0.
#[derive(Clone, Debug)]
pub(crate) struct Fluctuation {
    frequencies: [f64; WAVES],
    phases: [f64; WAVES],
    amplitudes: [f32; WAVES],
}

impl Fluctuation {
    /// Sines about `frequency` (cycles per unit of the variable), each rounded by `fit` to one that is periodic in a loop.
    ///
    /// `roughness` in [0, 1] weights the higher frequencies.
    pub(crate) fn new(key: Key, purpose: Purpose, frequency: f64, roughness: f64, fit: impl Fn(f64) -> f64) -> Self {
        let mut phases = [0.0; WAVES];
        let uniforms = key.uniforms(0, 0, purpose).into_iter().chain(key.uniforms(1, 0, purpose));
        for (phase, uniform) in phases.iter_mut().zip(uniforms) {
            *phase = f64::from(uniform);
        }
        let raw = RATIOS.map(|ratio| if ratio <= 1.0 { 1.0 } else { roughness / math::sqrt(ratio) });
        let total: f64 = raw.iter().sum();
        Self {
            frequencies: RATIOS.map(|ratio| fit(ratio * frequency)),
            phases,
            // Six sines hardly ever peak together: a factor of 1.4 makes use of the range, and rare larger sums are clamped.
            amplitudes: raw.map(|amplitude| (1.4 * amplitude / total) as f32),
        }
    }

    /// The value at `x`.
    pub(crate) fn at(&self, x: f64) -> f32 {
        let mut sum = 0.0_f32;
        for i in 0..WAVES {
            let phase = math::reduce_phase(self.frequencies[i].fma(x, self.phases[i]));
            sum = self.amplitudes[i].fma(approximations::sin_turns(phase), sum);
        }
        sum.clamp(-1.0, 1.0)
    }

    /// The values at `start + i * step`; phases are reduced in f64 before they become `f32`.
    pub(crate) fn fill(&self, start: f64, step: f64, values: &mut [f32]) {
        values.fill(0.0);
        for i in 0..WAVES {
            let phase = math::reduce_phase(self.frequencies[i].fma(start, self.phases[i]));
            let phase_step = (self.frequencies[i] * step) as f32;
            for (index, value) in values.iter_mut().enumerate() {
                *value = self.amplitudes[i].fma(approximations::sin_turns(phase_step.fma(index as f32, phase)), *value);
            }
        }
        values.iter_mut().for_each(|value| *value = value.clamp(-1.0, 1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fluctuation(fit: impl Fn(f64) -> f64) -> Fluctuation {
        Fluctuation::new(Key::new(7, "test"), Purpose::named("swing"), 1.0, 0.8, fit)
    }

    #[test]
    fn fluctuation_is_within_one_and_has_mean_zero() {
        let swing = fluctuation(|f| f);
        let values: Vec<f32> = (0..40_000).map(|i| swing.at(f64::from(i) * 0.01)).collect();
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        let spread = (values.iter().map(|v| v * v).sum::<f32>() / values.len() as f32).sqrt();
        assert!(values.iter().all(|v| v.abs() <= 1.0) && mean.abs() < 0.02 && spread > 0.25, "{mean} {spread}");
    }

    #[test]
    fn rows_agree_with_single_values() {
        let swing = fluctuation(|f| f);
        let mut row = [0.0; 64];
        swing.fill(123.4, 0.02, &mut row);
        for (i, value) in row.iter().enumerate() {
            assert!((value - swing.at(123.4 + 0.02 * i as f64)).abs() < 1e-4);
        }
    }

    #[test]
    fn whole_frequencies_repeat_and_others_do_not() {
        let periodic = fluctuation(|f| f.round().max(1.0));
        assert!((periodic.at(0.3) - periodic.at(5.3)).abs() < 1e-5);
        let free = fluctuation(|f| f);
        let difference: f32 =
            (0..100).map(|i| (free.at(f64::from(i) * 0.1) - free.at(5.0 + f64::from(i) * 0.1)).abs()).sum();
        assert!(difference > 5.0);
    }
}
