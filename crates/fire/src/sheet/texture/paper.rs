//! The paper's texture, eq. (20), exactly and as a table.

use std::f64::consts::{FRAC_PI_2, PI};

use bansho_base::math::{
    self, MulAdd,
    simd::{LANES, Lanes},
};
use fearless_simd::{Simd, prelude::*};

use super::{
    COLUMNS, ROWS,
    periodic::{PeriodicLayer, relative_speed},
};
use crate::sheet::animate::clock::Clock;

/// `Fx_0` of eq. (20), radians per unit of p.
const FIRST_FREQUENCY_P: f64 = 16.0;
/// `Fy_0` of eq. (20), radians per unit of q.
const FIRST_FREQUENCY_Q: f64 = 26.0;
/// `C_{i+1} / C_i` of eq. (20).
const AMPLITUDE_RATIO: f64 = 0.707;
/// Period in p: that of `sin(Fx_0 x / 2)`.
const PERIOD_P: f64 = PI / 4.0;
/// Period in q: that of `sin(Fy_0 y / 2)`.
const PERIOD_Q: f64 = 2.0 * PI / 13.0;

/// T(p, q) of eq. (20) with `octaves` terms, halved so that it lies in [0, 1] as eq. (2) demands.
pub fn paper_texture(p: f64, q: f64, octaves: u32) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for octave in Octave::all(octaves) {
        let phi = octave.across.fma(p, FRAC_PI_2 * math::sin(0.5 * octave.up * q));
        let psi = octave.up.fma(q, FRAC_PI_2 * math::sin(0.5 * octave.across * p));
        sum += octave.weight * (math::cos(phi) * math::cos(psi) + 1.0);
        weights += octave.weight;
    }
    0.5 * sum / weights
}

/// `Fx_i`, `Fy_i` and `C_i^2`.
#[derive(Clone, Copy)]
struct Octave {
    across: f64,
    up: f64,
    weight: f64,
}

impl Octave {
    fn all(octaves: u32) -> impl Iterator<Item = Self> {
        let first = Self { across: FIRST_FREQUENCY_P, up: FIRST_FREQUENCY_Q, weight: 1.0 };
        std::iter::successors(Some(first), |octave| Some(octave.next())).take(octaves as usize)
    }

    /// The octave of twice the frequency.
    fn next(&self) -> Self {
        let weight = self.weight * AMPLITUDE_RATIO * AMPLITUDE_RATIO;
        Self { across: 2.0 * self.across, up: 2.0 * self.up, weight }
    }

    /// The four functions of one coordinate whose products with those of the other sum to a term.
    ///
    /// With a = Fx x, b = Px(y), c = Fy y, d = Py(x): cos(a+b) cos(c+d) is the product of (cos a cos b - sin a sin b) and (cos c
    /// cos d - sin c sin d), where a, d depend on x and b, c on y.
    fn factors(coordinate: f64, frequency: f64) -> [f64; 4] {
        let (sin_coordinate, cos_coordinate) = math::sin_cos(frequency * coordinate);
        let (sin_phase, cos_phase) = math::sin_cos(FRAC_PI_2 * math::sin(0.5 * frequency * coordinate));
        [cos_coordinate * cos_phase, cos_coordinate * sin_phase, sin_coordinate * cos_phase, sin_coordinate * sin_phase]
    }
}

/// Eq. (20) over a grid as products of row functions and column functions: four multiply-adds per octave and sample.
#[derive(Clone, Debug)]
pub struct PaperTexture {
    /// For each octave and factor, its values over the columns, including signs and weights.
    across: Vec<Vec<f32>>,
    /// For each row, the values of each octave and factor.
    up: Vec<Vec<f32>>,
}

impl PaperTexture {
    /// Row and column functions of `octaves` terms at `p` (columns) and `q` (rows).
    pub fn new(p: &[f64], q: &[f64], octaves: u32) -> Self {
        let terms: Vec<Octave> = Octave::all(octaves).collect();
        let total: f64 = terms.iter().map(|octave| octave.weight).sum();
        let mut across = Vec::with_capacity(4 * terms.len());
        for octave in &terms {
            let factors: Vec<[f64; 4]> = p.iter().map(|p| Octave::factors(*p, octave.across)).collect();
            // cos a cos d, cos a sin d, sin a cos d, sin a sin d are multiplied by cos b cos c, cos b sin c, sin b cos c, sin b sin c.
            let scale = 0.5 * octave.weight / total;
            for (k, signed_scale) in [scale, -scale, -scale, scale].into_iter().enumerate() {
                across.push(factors.iter().map(|factor| (signed_scale * factor[k]) as f32).collect());
            }
        }
        let mut up = Vec::with_capacity(q.len());
        for q in q {
            let mut row = Vec::with_capacity(4 * terms.len());
            for octave in &terms {
                // Here the coordinate term is c = Fy y and the phase term b = Px(y): reorder [cc cb, cc sb, sc cb, sc sb] to match the columns.
                let [cc_cb, cc_sb, sc_cb, sc_sb] = Octave::factors(*q, octave.up).map(|value| value as f32);
                row.extend([cc_cb, sc_cb, cc_sb, sc_sb]);
            }
            up.push(row);
        }
        Self { across, up }
    }

    /// Writes row `row` for all columns; values in [0, 1].
    #[inline(always)]
    pub fn fill_row(&self, row: usize, values: &mut [f32]) {
        values.fill(0.5);
        for (column_factor, row_factor) in self.across.chunks_exact(4).zip(self.up[row].chunks_exact(4)) {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| &column_factor[k][..values.len()]);
            for (i, value) in values.iter_mut().enumerate() {
                let first = a[i].fma(row_factor[0], b[i].fma(row_factor[1], *value));
                *value = c[i].fma(row_factor[2], d[i].fma(row_factor[3], first));
            }
        }
    }

    /// Rows of the grid.
    pub fn rows(&self) -> usize {
        self.up.len()
    }
}

/// One period of the texture of `octaves` terms as a table.
pub(crate) fn paper_layer(octaves: u32, clock: &Clock) -> PeriodicLayer {
    let p: Vec<f64> = (0..COLUMNS).map(|i| PERIOD_P * i as f64 / COLUMNS as f64).collect();
    let q: Vec<f64> = (0..ROWS).map(|i| PERIOD_Q * i as f64 / ROWS as f64).collect();
    let texture = PaperTexture::new(&p, &q, octaves);
    let mut texels = vec![0.0; ROWS * COLUMNS];
    let level = bansho_base::math::simd::level();
    fearless_simd::dispatch!(level, _simd => fill(&texture, &mut texels));
    PeriodicLayer::new(&texels, [PERIOD_P, PERIOD_Q], clock)
}

/// Eq. (20), evaluated point by point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PaperSum {
    octaves: u32,
    /// As that of [`PeriodicLayer`].
    relative_speed: f64,
}

impl PaperSum {
    /// The sum of `octaves` terms.
    pub(crate) fn new(octaves: u32, clock: &Clock) -> Self {
        Self { octaves, relative_speed: relative_speed(PERIOD_Q, clock) }
    }

    /// T0 at sixteen points, eq. (2). Not inlined, so that the code is compiled once.
    #[inline(never)]
    pub(crate) fn sample<S: Simd>(&self, u: Lanes<S>, w: Lanes<S>, scroll: f64) -> Lanes<S> {
        let mut values = [0.0; LANES];
        for (lane, value) in values.iter_mut().enumerate() {
            let q = f64::from(w[lane]) - self.relative_speed * scroll;
            *value = paper_texture(f64::from(u[lane]), q, self.octaves) as f32;
        }
        Lanes::from_slice(u.simd, &values)
    }
}

#[inline(always)]
fn fill(texture: &PaperTexture, texels: &mut [f32]) {
    for (row, values) in texels.chunks_exact_mut(COLUMNS).enumerate() {
        texture.fill_row(row, values);
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{math::simd::Lanes, parameters::animated::Animated};
    use fearless_simd::prelude::*;

    use super::*;

    #[test]
    fn texture_20_has_hand_worked_values() {
        // At the origin every phase is 0: cos 0 cos 0 + 1 = 2, halved 1.
        assert_eq!(paper_texture(0.0, 0.0, 1), 1.0);
        bansho_base::assert_measured!("equation (20): T at the origin", paper_texture(0.0, 0.0, 1), 1.0, 0.0);
        assert_eq!(paper_texture(0.0, 0.0, 5), 1.0);
        // x = pi/16: PHI = pi, PSI = (pi/2) sin(pi/2) = pi/2, so the term is 1 and its half 1/2.
        assert!((paper_texture(PI / 16.0, 0.0, 1) - 0.5).abs() < 1e-12);
        // y = pi/26: PSI = pi, PHI = (pi/2) sin(pi/2) = pi/2.
        assert!((paper_texture(0.0, PI / 26.0, 1) - 0.5).abs() < 1e-12);
        // x = pi/8: PHI = 2 pi, PSI = (pi/2) sin(pi) = 0: the peak again; the second octave agrees.
        assert!((paper_texture(PI / 8.0, 0.0, 2) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn it_stays_within_0_and_1_and_has_the_stated_periods() {
        for i in 0..5000 {
            let (p, q) = (f64::from(i) * 0.00137, f64::from(i) * 0.00791);
            let value = paper_texture(p, q, 5);
            assert!((0.0..=1.0).contains(&value));
            assert!((paper_texture(p + PERIOD_P, q + PERIOD_Q, 5) - value).abs() < 1e-9);
        }
    }

    #[test]
    fn products_of_row_and_column_functions_are_the_sum() {
        let p: Vec<f64> = (0..40).map(|i| f64::from(i) * 0.0251).collect();
        let q: Vec<f64> = (0..30).map(|i| f64::from(i) * 0.0337 - 0.4).collect();
        let texture = PaperTexture::new(&p, &q, 5);
        let mut values = vec![0.0; 40];
        for (row, q) in q.iter().enumerate() {
            texture.fill_row(row, &mut values);
            for (value, p) in values.iter().zip(&p) {
                assert!((f64::from(*value) - paper_texture(*p, *q, 5)).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn the_table_is_the_texture_within_its_resolution() {
        let layer = paper_layer(5, &Clock::new(Animated::from(1.0), None));
        let scroll = 1234.567;
        let (u, w): ([f32; 16], [f32; 16]) =
            (std::array::from_fn(|i| 0.06 * i as f32 + 0.03), std::array::from_fn(|i| 0.055 * i as f32));
        let texture = layer.at(scroll);
        let values = bansho_base::dispatch_baseline!(simd => {
            texture.sample(Lanes::from_slice(simd, &u), Lanes::from_slice(simd, &w)).as_slice().to_vec()
        });
        for i in 0..16 {
            let exact = paper_texture(f64::from(u[i]), f64::from(w[i]) - scroll, 5);
            assert!((f64::from(values[i]) - exact).abs() < 0.02, "{} {exact}", values[i]);
        }
    }
}
