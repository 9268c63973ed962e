//! SIMD vectors of sixteen numbers and the operations that they share with scalars, so that equations are written once for both.
//!
//! Names follow `std::simd`. They are never those of `f32` itself (`min`, `max`, `abs`, `sqrt`, `mul_add`): an inherent method wins over a
//! trait's, and `mul_add` of `fearless_simd` is not fused below AVX2, so that code would silently compile to something else.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m256, _mm256_shuffle_ps, _mm256_unpackhi_ps, _mm256_unpacklo_ps};
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::approximations::ROUNDING_MAGIC;
use fearless_simd::{Level, Simd, f32x4, f32x8, f32x16, prelude::*, u32x16};

#[cfg(test)]
pub(crate) use super::vector_level::available_levels;
pub use super::vector_level::{VectorLevel, VectorLevelError, level, set_vector_level};

/// Lanes of a vector, whatever the width of the processor's registers.
pub const LANES: usize = 16;

/// A scalar or a vector. Multiply-adds are fused at every vector width, so that all widths give the same bits.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// `value` in every lane of a vector as wide as `self`. (`splat` is the name of the constructor in `fearless_simd`.)
    #[must_use]
    fn broadcast(self, value: f32) -> Self;
    /// Fused multiply-add, `self * factor + term` rounded once; NaN if any of them is.
    #[must_use]
    fn fma(self, factor: Self, term: Self) -> Self;
    /// Square root; NaN below 0 and of NaN.
    #[must_use]
    fn simd_sqrt(self) -> Self;
    /// `1 / sqrt(self)` to two ulps, for normal numbers above 0; many times faster than a root and a division.
    #[must_use]
    fn simd_rsqrt(self) -> Self;
    /// Absolute value; clears the sign of NaN.
    #[must_use]
    fn simd_abs(self) -> Self;
    /// The smaller of two; `other` where either is NaN, in scalars and on x86 (`minps`).
    #[must_use]
    fn simd_min(self, other: Self) -> Self;
    /// The larger of two; `other` where either is NaN, in scalars and on x86 (`maxps`).
    #[must_use]
    fn simd_max(self, other: Self) -> Self;
    /// `low` where `self < limit`, else `high`, also where either is NaN.
    #[must_use]
    fn select_lt(self, limit: Self, low: Self, high: Self) -> Self;

    /// Clamped to [0, 1]; NaN becomes 0.
    #[must_use]
    #[inline(always)]
    fn simd_clamp01(self) -> Self {
        self.simd_max(self.broadcast(0.0)).simd_min(self.broadcast(1.0))
    }

    /// The cubic `3 t^2 - 2 t^3` of `t` clamped to [0, 1]; NaN becomes 0.
    #[must_use]
    #[inline(always)]
    fn simd_smoothstep(self) -> Self {
        let t = self.simd_clamp01();
        t * t * t.fma(t.broadcast(-2.0), t.broadcast(3.0))
    }
}

impl Real for f32 {
    #[inline(always)]
    fn broadcast(self, value: f32) -> Self {
        value
    }
    #[inline(always)]
    fn fma(self, factor: Self, term: Self) -> Self {
        super::MulAdd::fma(self, factor, term)
    }
    #[inline(always)]
    fn simd_sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn simd_rsqrt(self) -> Self {
        refine_rsqrt(self, Self::from_bits(RSQRT_MAGIC - (self.to_bits() >> 1)))
    }
    #[inline(always)]
    fn simd_abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn simd_min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn simd_max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn select_lt(self, limit: Self, low: Self, high: Self) -> Self {
        if self < limit { low } else { high }
    }
}

/// Magic constant of the fast inverse square root: subtracting half of the bits of a number gives the bits of a first guess (Lomont 2003).
const RSQRT_MAGIC: u32 = 0x5f34_0000;

/// Refines a guess at `1 / sqrt(value)`: multiplies it by a polynomial of its error `e = 1 - value guess^2`, from -0.033 to 0.094, which
/// approximates `1 / sqrt(1 - e)` to 2e-8 (least-squares fit).
#[inline(always)]
fn refine_rsqrt<R: Real>(value: R, guess: R) -> R {
    let splat = |constant: f32| value.broadcast(constant);
    let error = (-(value * guess)).fma(guess, splat(1.0));
    let low = error.fma(splat(0.500_001_4), splat(1.0));
    let high = error.fma(splat(0.311_153_4), splat(0.374_954_5));
    let square = error * error;
    guess * square.fma(square.fma(splat(0.316_214_53), high), low)
}

/// A vector of [`LANES`] numbers.
pub type Lanes<S> = f32x16<S>;

/// Sixteen numbers in memory: what a loop over lanes reads and writes where the compiler makes vectors of it.
pub type LaneArray = [f32; LANES];

/// Half as many lanes, for loops with frequent early exits.
pub type HalfLanes<S> = f32x8<S>;

/// Four lanes: four numbers that belong to one object.
pub type FourLanes<S> = f32x4<S>;

/// Implements [`Real`] for a vector type with that many lanes.
macro_rules! impl_real {
    ($Vector:ident, $count:expr) => {
        impl<S: Simd> Real for $Vector<S> {
            #[inline(always)]
            fn broadcast(self, value: f32) -> Self {
                Self::splat(self.simd, value)
            }
            #[inline(always)]
            fn fma(self, factor: Self, term: Self) -> Self {
                if cfg!(feature = "broken-kernel") && has_fma(self.simd.level()) {
                    return self * factor + term;
                }
                if has_fma(self.simd.level()) {
                    return self.mul_add(factor, term);
                }
                let mut result = [0.0; $count];
                fma_per_lane(self.as_slice(), factor.as_slice(), term.as_slice(), &mut result);
                Self::from_slice(self.simd, &result)
            }
            #[inline(always)]
            fn simd_sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn simd_rsqrt(self) -> Self {
                let guess = RSQRT_MAGIC - (self.to_bits() >> 1);
                refine_rsqrt(self, guess.bitcast())
            }
            #[inline(always)]
            fn simd_abs(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn simd_min(self, other: Self) -> Self {
                self.min(other)
            }
            #[inline(always)]
            fn simd_max(self, other: Self) -> Self {
                self.max(other)
            }
            #[inline(always)]
            fn select_lt(self, limit: Self, low: Self, high: Self) -> Self {
                self.simd_lt(limit).select(low, high)
            }
        }
    };
}

impl_real!(Lanes, LANES);
impl_real!(HalfLanes, LANES / 2);
impl_real!(FourLanes, LANES / 4);

/// Whether vectors of this level have a fused multiply-add; known when the code for the level is compiled.
#[inline(always)]
fn has_fma(level: Level) -> bool {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    return matches!(level, Level::Avx2(_) | Level::Avx512(_));
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    return !level.is_fallback();
}

/// Fused multiply-add lane by lane, for processors without the instruction: the same bits, but slow. Not inlined, since inlining would multiply the
/// code size.
#[inline(never)]
fn fma_per_lane(values: &[f32], factors: &[f32], terms: &[f32], results: &mut [f32]) {
    for (lane, result) in results.iter_mut().enumerate() {
        *result = values[lane].mul_add(factors[lane], terms[lane]);
    }
}

/// Runs code with the baseline instruction set of the target architecture, for tests and comparisons with the widest vectors.
#[doc(hidden)]
#[macro_export]
macro_rules! dispatch_baseline {
    ($simd:ident => $code:expr) => {
        fearless_simd::dispatch!(fearless_simd::Level::baseline(), $simd => $code)
    };
}

/// `first + step * lane`.
#[inline(always)]
pub fn ramp<S: Simd>(simd: S, first: f32, step: f32) -> Lanes<S> {
    const LANE: [f32; LANES] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];
    Lanes::splat(simd, step).fma(Lanes::from_slice(simd, &LANE), Lanes::splat(simd, first))
}

/// Whether any of the numbers is above 0.
#[inline(always)]
pub fn any_positive<S: Simd>(values: Lanes<S>) -> bool {
    values.simd_gt(values.broadcast(0.0)).any_true()
}

/// Evenly spaced numbers from `first` to `last`.
#[inline(always)]
pub fn linspace<S: Simd>(simd: S, first: f32, last: f32) -> Lanes<S> {
    ramp(simd, first, (last - first) * (1.0 / (LANES - 1) as f32))
}

/// Integer part, wrapped by `mask` (a power of two minus 1), and fraction in [0, 1].
///
/// An integer may be split into the integer below and the fraction 1, which interpolates to the same value.
#[inline(always)]
pub fn wrap_split<S: Simd>(value: Lanes<S>, mask: u32) -> (u32x16<S>, Lanes<S>) {
    let rounded = (value - value.broadcast(0.5)) + value.broadcast(ROUNDING_MAGIC);
    (rounded.to_bits() & mask, value - (rounded - value.broadcast(ROUNDING_MAGIC)))
}

/// Each lane rounded to the nearest integer, for values from 0 to 2^22.
#[inline(always)]
pub fn round_to_u32<S: Simd>(value: Lanes<S>) -> u32x16<S> {
    (value + value.broadcast(ROUNDING_MAGIC)).to_bits() & 0x003f_ffff
}

/// Gathers entry `index[lane]` of a table for each lane and transposes the entries of four numbers into four vectors.
///
/// `N` is a power of two; indices wrap.
#[inline(always)]
pub fn gather<S: Simd, const N: usize>(simd: S, table: &[[f32; 4]; N], index: u32x16<S>) -> [Lanes<S>; 4] {
    let mut offsets = [0; LANES];
    ((index << 2) & (4 * N as u32 - 4)).store_slice(&mut offsets);
    let values = table.as_flattened();
    let (low, high) = (gather_half(simd, values, &offsets, 0), gather_half(simd, values, &offsets, LANES / 2));
    let mut columns = [Lanes::splat(simd, 0.0); 4];
    for k in 0..4 {
        columns[k] = low[k].combine(high[k]);
    }
    columns
}

/// Gathers the entries of eight lanes from `first` on.
#[inline(always)]
fn gather_half<S: Simd>(simd: S, values: &[f32], offsets: &[u32; LANES], first: usize) -> [HalfLanes<S>; 4] {
    let mut pairs = [HalfLanes::splat(simd, 0.0); 4];
    for (lane, pair) in pairs.iter_mut().enumerate() {
        let [near, far] = [first + lane, first + lane + 4].map(|lane| {
            let offset = offsets[lane] as usize;
            f32x4::from_slice(simd, &values[offset..offset + 4])
        });
        *pair = near.combine(far);
    }
    transpose(simd, pairs)
}

/// Transposes eight entries of four numbers into four columns. Vector `i` holds entries `i` and `i + 4`.
#[inline(always)]
fn transpose<S: Simd>(simd: S, pairs: [HalfLanes<S>; 4]) -> [HalfLanes<S>; 4] {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = simd.level().as_avx2() {
        let [a, b, c, d] = pairs;
        let [red, green, blue, alpha] = transpose_avx2(avx2, a.into(), b.into(), c.into(), d.into());
        return [red.simd_into(simd), green.simd_into(simd), blue.simd_into(simd), alpha.simd_into(simd)];
    }
    let mut entries = [[0.0; 16]; 2];
    for (i, pair) in pairs.iter().enumerate() {
        let (first, second) = pair.split();
        first.store_slice(&mut entries[0][4 * i..4 * i + 4]);
        second.store_slice(&mut entries[1][4 * i..4 * i + 4]);
    }
    let [low, high] = entries.map(|entries| simd.load_four_interleaved_f32x4(&entries));
    [0, 1, 2, 3].map(|k| low[k].combine(high[k]))
}

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    /// Transposes within each half of the vectors, with half as many shuffles as for single entries.
    #[inline(always)]
    fn transpose_avx2(avx2: Avx2, a: __m256, b: __m256, c: __m256, d: __m256) -> [__m256; 4] {
        let (low, high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
        let (low_after, high_after) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0b01_00_01_00>(low, low_after),
            _mm256_shuffle_ps::<0b11_10_11_10>(low, low_after),
            _mm256_shuffle_ps::<0b01_00_01_00>(high, high_after),
            _mm256_shuffle_ps::<0b11_10_11_10>(high, high_after),
        ]
    }
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_and_fraction_make_the_number_again_and_wrap() {
        let input = [0.0, 0.25, 1.0, 1.75, 7.999, 8.0, 9.5, -0.25, -7.5, 511.3, 512.7, 3.0, 2.0, 1000.125, -1.0, 6.5];
        let (integer, fraction) = crate::dispatch_baseline!(simd => {
            let (integer, fraction) = wrap_split(Lanes::from_slice(simd, &input), 7);
            let (mut integers, mut fractions) = ([0; LANES], [0.0; LANES]);
            integer.store_slice(&mut integers);
            fraction.store_slice(&mut fractions);
            (integers, fractions)
        });
        for i in 0..LANES {
            let value = integer[i] as f32 + fraction[i];
            assert!((0.0..=1.0).contains(&fraction[i]) && integer[i] < 8);
            let difference = (value - input[i]).rem_euclid(8.0);
            assert!(difference.min(8.0 - difference) < 1e-3, "{} {} {}", input[i], integer[i], fraction[i]);
        }
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn the_smaller_and_the_larger_of_nan_and_a_number_is_the_second_operand() {
        let pairs = [(f32::NAN, 1.0), (1.0, f32::NAN), (f32::NAN, f32::NAN), (2.0, 3.0)];
        for (a, b) in pairs {
            let vectors = crate::dispatch_baseline!(simd => {
                let (a, b) = (Lanes::splat(simd, a), Lanes::splat(simd, b));
                [a.simd_min(b).as_slice()[3], a.simd_max(b).as_slice()[3], a.simd_clamp01().as_slice()[3]]
            });
            let scalars = [a.simd_min(b), a.simd_max(b), a.simd_clamp01()];
            assert_eq!(vectors.map(f32::to_bits), scalars.map(f32::to_bits), "{a} {b}");
        }
        assert_eq!((f32::NAN.simd_min(1.0), f32::NAN.simd_clamp01()), (1.0, 0.0));
    }

    #[test]
    fn inverse_roots_are_right_to_two_ulps_and_the_same_one_by_one() {
        for i in 0..200_000_u32 {
            let value = f32::from_bits(0x0090_0000 + i * 10_437);
            let exact = 1.0 / f64::from(value).sqrt();
            let error = f64::from(value.simd_rsqrt()) / exact - 1.0;
            assert!(error.abs() < 2e-7, "{value}: {error}");
        }
        let values: [f32; LANES] = std::array::from_fn(|lane| 1e-9 * (1_u64 << (3 * lane)) as f32);
        let roots =
            crate::dispatch_baseline!(simd => Lanes::from_slice(simd, &values).simd_rsqrt().as_slice().to_vec());
        assert_eq!(roots, values.map(Real::simd_rsqrt));
    }

    #[test]
    fn fetching_gathers_entries_lane_by_lane() {
        let table: [[f32; 4]; 32] = std::array::from_fn(|i| std::array::from_fn(|k| (10 * i + k) as f32));
        let index: [u32; LANES] = std::array::from_fn(|lane| (7 * lane % 32) as u32);
        let batches = crate::dispatch_baseline!(simd => gather(simd, &table, u32x16::from_slice(simd, &index)).map(|batch| batch.as_slice().to_vec()));
        for lane in 0..LANES {
            for k in 0..4 {
                assert_eq!(batches[k][lane], table[index[lane] as usize][k]);
            }
        }
    }
}
