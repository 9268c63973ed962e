//! Discrete sine transform of type I (DST-I), two rows at a time.

use std::{f64::consts::PI, sync::Arc};

use bansho_base::math;
use fearless_simd::{Level, dispatch};
use rustfft::{Fft, FftPlanner, num_complex::Complex};

/// `F_k = sum_j f_j sin(pi j k / (n + 1))`, j and k from 1 to n; applied twice it is `(n + 1) / 2`.
///
/// A row of n values is folded into n + 1 values whose Fourier transform yields the even and the odd wave numbers (Press et al. 2007,
/// section 12.4.1). Two rows are transformed at once, as real and imaginary part. `rustfft` selects its code by the instruction set; on
/// machines with AVX and FMA it is always the same.
pub(super) struct SineTransform {
    fourier: Arc<dyn Fft<f64>>,
    /// `sin(pi j / (n + 1))`, j from 0 to n.
    sines: Vec<f64>,
    level: Level,
}

/// Scratch buffers of a thread.
pub(super) struct TransformScratch {
    spectrum: Vec<Complex<f64>>,
    inner: Vec<Complex<f64>>,
}

impl SineTransform {
    /// For rows of `length` values.
    pub(super) fn new(length: usize) -> Self {
        let whole = length + 1;
        let sines = (0..whole).map(|j| math::sin(PI * j as f64 / whole as f64)).collect();
        Self { fourier: FftPlanner::new().plan_fft_forward(whole), sines, level: bansho_base::math::simd::level() }
    }

    pub(super) fn scratch(&self) -> TransformScratch {
        TransformScratch {
            spectrum: vec![Complex::default(); self.sines.len()],
            inner: vec![Complex::default(); self.fourier.get_inplace_scratch_len()],
        }
    }

    /// Transforms one or two rows, one after the other in `rows`.
    pub(super) fn apply(&self, rows: &mut [f64], scratch: &mut TransformScratch) {
        let (first, second) = rows.split_at_mut(self.sines.len() - 1);
        let spectrum = &mut scratch.spectrum;
        dispatch!(self.level, _simd => self.fold(first, second, spectrum));
        self.fourier.process_with_scratch(spectrum, &mut scratch.inner);
        unfold(first, |k, mirror| {
            let (one, other) = (spectrum[k], spectrum[mirror]);
            [0.5 * (one.re + other.re), 0.5 * (other.im - one.im)]
        });
        unfold(second, |k, mirror| {
            let (one, other) = (spectrum[k], spectrum[mirror]);
            [0.5 * (one.im + other.im), 0.5 * (one.re - other.re)]
        });
    }

    /// Folds rows: `sin(pi j / N) (f_j + f_(N-j)) + (f_j - f_(N-j)) / 2` with N = n + 1, whose cosine sums are `F_(2k+1) - F_(2k-1)`
    /// and whose sine sums are `F_2k`. The first row is the real part, the second, if there is one, the imaginary part.
    #[inline(always)]
    fn fold(&self, first: &[f64], second: &[f64], spectrum: &mut [Complex<f64>]) {
        spectrum.fill(Complex::default());
        let folded = &mut spectrum[1..];
        for ((value, sine), (one, other)) in
            folded.iter_mut().zip(&self.sines[1..]).zip(first.iter().zip(first.iter().rev()))
        {
            value.re = sine.mul_add(one + other, 0.5 * (one - other));
        }
        for ((value, sine), (one, other)) in
            folded.iter_mut().zip(&self.sines[1..]).zip(second.iter().zip(second.iter().rev()))
        {
            value.im = sine.mul_add(one + other, 0.5 * (one - other));
        }
    }
}

/// Transform of a row from the cosine and sine sums of its folded values at wave number k, whose mirror is `(N - k) mod N`.
fn unfold(row: &mut [f64], sums: impl Fn(usize, usize) -> [f64; 2]) {
    let whole = row.len() + 1;
    let Some(first) = row.first_mut() else { return };
    let mut odd = 0.5 * sums(0, 0)[0];
    *first = odd;
    // In pairs F_2k, F_(2k+1); the last pair is incomplete if the number of values is even.
    for (k, values) in row[1..].chunks_mut(2).enumerate().map(|(k, values)| (k + 1, values)) {
        let [cosine, sine] = sums(k, whole - k);
        odd += cosine;
        values[0] = sine;
        if let Some(value) = values.get_mut(1) {
            *value = odd;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transform_is_its_sum() {
        for length in [1, 2, 3, 8, 16, 31, 100] {
            let transform = SineTransform::new(length);
            let given: Vec<f64> = (0..2 * length).map(|j| ((j * j * 37) % 11) as f64 - 4.0).collect();
            let mut rows = given.clone();
            transform.apply(&mut rows, &mut transform.scratch());
            let mut alone = given[..length].to_vec();
            transform.apply(&mut alone, &mut transform.scratch());
            for (index, value) in rows.iter().enumerate() {
                let (row, k) = (&given[index / length * length..][..length], index % length + 1);
                let term = |j: usize| row[j - 1] * math::sin(PI * (j * k) as f64 / (length + 1) as f64);
                let sum: f64 = (1..=length).map(term).sum();
                assert!((value - sum).abs() < 1e-10, "{length} {index}: {value} {sum}");
                assert!(index >= length || (alone[index] - sum).abs() < 1e-10);
            }
        }
    }
}
