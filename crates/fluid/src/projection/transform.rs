//! Sine transform of rows whose values are 0 at their ends, which are half a cell beyond the first and the last value (DST-II, and its inverse, DST-III).

use std::{f64::consts::PI, sync::Arc};

use bansho_base::math;
use rustfft::{Fft, FftPlanner, num_complex::Complex};

/// The transform for rows of one length, two rows at a time, as the real and the imaginary part of one Fourier transform of the same length (Makhoul 1980).
///
/// Coefficients are in the order of falling wave numbers: number k belongs to `sin(pi (2 j + 1) (n - k) / (2 n))`.
pub(crate) struct SineTransform {
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    /// `exp(-i pi k / (2 n))`.
    twiddles: Vec<Complex<f32>>,
}

/// Buffers of a thread.
pub(crate) struct TransformScratch {
    values: Vec<Complex<f32>>,
    inner: Vec<Complex<f32>>,
}

impl SineTransform {
    pub(crate) fn new(length: usize) -> Self {
        let mut planner = FftPlanner::new();
        let twiddle = |k: usize| {
            let (sine, cosine) = math::sin_cos(PI * k as f64 / (2 * length) as f64);
            Complex::new(cosine as f32, -sine as f32)
        };
        Self {
            forward: planner.plan_fft_forward(length),
            inverse: planner.plan_fft_inverse(length),
            twiddles: (0..length).map(twiddle).collect(),
        }
    }

    pub(crate) fn scratch(&self) -> TransformScratch {
        let inner = self.forward.get_inplace_scratch_len().max(self.inverse.get_inplace_scratch_len());
        TransformScratch {
            values: vec![Complex::default(); self.twiddles.len()],
            inner: vec![Complex::default(); inner],
        }
    }

    /// Square of the wave number of coefficient `k` for the second difference, in cells: the second difference of its sine is minus this times the sine.
    pub(crate) fn eigenvalue(&self, k: usize) -> f64 {
        let cosine = math::cos(0.5 * PI * k as f64 / self.twiddles.len() as f64);
        4.0 * cosine * cosine
    }

    /// Coefficients of two rows. Value `j` of the first is `row[j * stride]`, that of the second `row[offset + j * stride]`.
    pub(crate) fn analyze(&self, row: &mut [f32], offset: usize, stride: usize, scratch: &mut TransformScratch) {
        let length = self.twiddles.len();
        let values = &mut scratch.values[..length];
        // Every other value changes its sign, which turns sines into cosines; even places come first, odd ones backward from the end.
        let (even, odd) = values.split_at_mut(length.div_ceil(2));
        for (j, value) in even.iter_mut().enumerate() {
            *value = Complex::new(row[2 * j * stride], row[offset + 2 * j * stride]);
        }
        for (j, value) in odd.iter_mut().rev().enumerate() {
            *value = -Complex::new(row[(2 * j + 1) * stride], row[offset + (2 * j + 1) * stride]);
        }
        self.forward.process_with_scratch(values, &mut scratch.inner);
        let mut store = |k: usize, value: Complex<f32>, mirror: Complex<f32>| {
            let twiddle = self.twiddles[k];
            let (first, second) = (value + mirror.conj(), value - mirror.conj());
            row[k * stride] = 0.5 * (twiddle.re * first.re - twiddle.im * first.im);
            // The spectrum of the second row is the difference over 2 i.
            row[offset + k * stride] = 0.5 * (twiddle.re * second.im + twiddle.im * second.re);
        };
        store(0, values[0], values[0]);
        for k in 1..length {
            store(k, values[k], values[length - k]);
        }
    }

    /// The two rows of these coefficients.
    pub(crate) fn synthesize(&self, row: &mut [f32], offset: usize, stride: usize, scratch: &mut TransformScratch) {
        let length = self.twiddles.len();
        let values = &mut scratch.values[..length];
        values[0] = Complex::new(row[0], row[offset]) * self.twiddles[0].conj();
        for k in 1..length {
            let [own, mirror] = [k * stride, (length - k) * stride];
            // The first row and i times the second, each a coefficient less i times its mirror.
            let both = Complex::new(row[own] + row[offset + mirror], row[offset + own] - row[mirror]);
            values[k] = both * self.twiddles[k].conj();
        }
        self.inverse.process_with_scratch(values, &mut scratch.inner);
        let scale = 1.0 / length as f32;
        let (even, odd) = values.split_at(length.div_ceil(2));
        for (j, value) in even.iter().enumerate() {
            row[2 * j * stride] = value.re * scale;
            row[offset + 2 * j * stride] = value.im * scale;
        }
        for (j, value) in odd.iter().rev().enumerate() {
            row[(2 * j + 1) * stride] = value.re * -scale;
            row[offset + (2 * j + 1) * stride] = value.im * -scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_are_those_of_the_sum_and_give_the_row_back() {
        for length in [4, 5, 16, 24, 33] {
            let transform = SineTransform::new(length);
            let mut scratch = transform.scratch();
            let row: Vec<f32> = (0..2 * length).map(|j| ((j * j * 7 + 3 * j) % 11) as f32 - 4.0).collect();
            let mut transformed = row.clone();
            transform.analyze(&mut transformed, length, 1, &mut scratch);
            for (k, value) in transformed.iter().enumerate() {
                let values = &row[k / length * length..][..length];
                let sine =
                    |j: usize| math::sin(PI * ((2 * j + 1) * (length - k % length)) as f64 / (2 * length) as f64);
                let sum: f64 = values.iter().enumerate().map(|(j, value)| f64::from(*value) * sine(j)).sum();
                assert!((f64::from(*value) - sum).abs() < 1e-4, "{length} {k}: {value} {sum}");
            }
            transform.synthesize(&mut transformed, length, 1, &mut scratch);
            assert!(transformed.iter().zip(&row).all(|(a, b)| (a - b).abs() < 1e-5), "{length}");
        }
    }
}
