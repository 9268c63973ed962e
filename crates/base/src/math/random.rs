//! Counter-based random numbers: a pure function of (seed, instance, id, step, purpose).
//!
//! Numbers are not drawn from a stream: each depends only on these arguments, so it is independent of frames, threads and the order of evaluation.
//! The generator is Philox4x32-10 (Salmon, Moraes, Dror & Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011);
//! it needs only 32-bit operations and the high half of a 32-bit product, so that shaders and WebAssembly give the same numbers.

use super::approximations;
use crate::math::{self, Vec3};

/// What a number is used for: different purposes have independent numbers. Created from a name, as in `Purpose::named("position")`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Purpose(pub u32);

impl Purpose {
    /// The purpose of that name.
    pub const fn named(name: &str) -> Self {
        Self(murmur3(name.as_bytes(), 0))
    }
}

/// The key of the random numbers of one instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Key([u32; 2]);

impl Key {
    /// The key of `instance` under `seed`. For one instance, different seeds always give different keys.
    pub const fn new(seed: u64, instance: &str) -> Self {
        // For a given text MurmurHash3 is a bijection of its 32-bit seed, so both halves together preserve all 64 bits.
        let low = murmur3(instance.as_bytes(), seed as u32);
        let high = murmur3(instance.as_bytes(), (seed >> 32) as u32 ^ 0x9e37_79b9);
        Self([low, high])
    }

    /// The two words that Philox takes as its key, for shaders.
    pub const fn to_words(self) -> [u32; 2] {
        self.0
    }

    /// Four random words for one object (`id`) at one `step` for one `purpose`.
    #[inline(always)]
    pub const fn words(self, id: u64, step: u32, purpose: Purpose) -> [u32; 4] {
        philox4x32_10([id as u32, (id >> 32) as u32, step, purpose.0], self.0)
    }

    /// Four uniform numbers in [0, 1), each a multiple of 2^-24.
    #[inline(always)]
    pub fn uniforms(self, id: u64, step: u32, purpose: Purpose) -> [f32; 4] {
        self.words(id, step, purpose).map(uniform)
    }
}

impl Key {
    /// The [`uniforms`](Self::uniforms) of `N` steps from `first` on, as four arrays over the steps, so that loops over steps are vectorized.
    #[inline(always)]
    pub fn uniforms_of_steps<const N: usize>(self, id: u64, first: u32, purpose: Purpose) -> [[f32; N]; 4] {
        let (mut a, mut b) = ([id as u32; N], [(id >> 32) as u32; N]);
        let (mut c, mut d) = ([first; N], [purpose.0; N]);
        for step in 0..N {
            c[step] = first.wrapping_add(step as u32);
        }
        let mut key = self.0;
        for _ in 0..ROUNDS {
            for step in 0..N {
                [a[step], b[step], c[step], d[step]] = philox_round([a[step], b[step], c[step], d[step]], key);
            }
            key = next_key(key);
        }
        let mut uniforms = [[0.0; N]; 4];
        for (uniforms, words) in uniforms.iter_mut().zip([a, b, c, d]) {
            for step in 0..N {
                uniforms[step] = uniform(words[step]);
            }
        }
        uniforms
    }
}

/// Rounds of Philox.
const ROUNDS: u32 = 10;

/// Philox4x32 with 10 rounds: a bijection of the 128-bit `counter` for each `key`.
#[inline(always)]
pub const fn philox4x32_10(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let (mut words, mut key) = (counter, key);
    let mut round = 0;
    while round < ROUNDS {
        words = philox_round(words, key);
        key = next_key(key);
        round += 1;
    }
    words
}

#[inline(always)]
const fn philox_round([a, b, c, d]: [u32; 4], [k0, k1]: [u32; 2]) -> [u32; 4] {
    let (high0, low0) = mul_wide(0xd251_1f53, a);
    let (high1, low1) = mul_wide(0xcd9e_8d57, c);
    [high1 ^ b ^ k0, low1, high0 ^ d ^ k1, low0]
}

/// Weyl sequence of the key: golden ratio and sqrt(3) - 1.
#[inline(always)]
const fn next_key([k0, k1]: [u32; 2]) -> [u32; 2] {
    [k0.wrapping_add(0x9e37_79b9), k1.wrapping_add(0xbb67_ae85)]
}

/// High and low half of the 64-bit product.
#[inline(always)]
const fn mul_wide(a: u32, b: u32) -> (u32, u32) {
    let product = a as u64 * b as u64;
    ((product >> 32) as u32, product as u32)
}

/// MurmurHash3_x86_32 (Appleby, public domain) of `bytes`: a stable text hash in 32-bit operations.
pub const fn murmur3(bytes: &[u8], seed: u32) -> u32 {
    let mut hash = seed;
    let mut start = 0;
    while start + 4 <= bytes.len() {
        let block = u32::from_le_bytes([bytes[start], bytes[start + 1], bytes[start + 2], bytes[start + 3]]);
        hash = (hash ^ murmur3_block(block)).rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
        start += 4;
    }
    let mut tail = 0;
    let mut index = bytes.len();
    while index > start {
        index -= 1;
        tail = tail << 8 | bytes[index] as u32;
    }
    hash ^= murmur3_block(tail) ^ bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

const fn murmur3_block(block: u32) -> u32 {
    block.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593)
}

/// A uniform number in [0, 1) from the upper 24 bits of a word, exact.
#[inline(always)]
pub fn uniform(word: u32) -> f32 {
    // Through a signed integer: every instruction set converts those to floats in one instruction.
    (word >> 8) as i32 as f32 * (1.0 / 16_777_216.0)
}

/// A uniform number in [0, 1) from the upper 53 bits of two words, exact.
#[inline(always)]
pub fn uniform_f64(high: u32, low: u32) -> f64 {
    (((high as u64) << 32 | low as u64) >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

/// Two independent standard normal numbers (Box & Muller 1958); their magnitude is at most 5.8.
#[inline(always)]
pub fn normal_pair(words: [u32; 2]) -> [f32; 2] {
    // From (0, 1], so that the logarithm is finite.
    let u = 1.0 - uniform(words[0]);
    let turns = uniform(words[1]);
    let radius = (-2.0 * approximations::ln(u)).sqrt();
    [radius * approximations::cos_turns(turns), radius * approximations::sin_turns(turns)]
}

/// A unit vector, uniformly distributed on the sphere.
#[inline(always)]
pub fn direction(words: [u32; 2]) -> Vec3 {
    let u = uniform(words[0]);
    let turns = uniform(words[1]);
    // The height z is uniform (Archimedes); 1 - z^2 = 4 u (1 - u).
    let radius = 2.0 * (u * (1.0 - u)).sqrt();
    Vec3::new(radius * approximations::cos_turns(turns), radius * approximations::sin_turns(turns), 1.0 - 2.0 * u)
}

/// Largest mean for which [`poisson`] uses sequential inversion.
const MAX_INVERSION_MEAN: f64 = 256.0;
const TWO_TO_52: f64 = 4_503_599_627_370_496.0;

/// A Poisson-distributed count with mean `mean`; 0 if the mean is not above 0 or NaN.
///
/// It is the quantile function at the uniform number given by `words`, so for fixed words it does not decrease as the mean grows
/// (except for rounding in the far tail).
/// Above a mean of 256 the quantile is the Cornish-Fisher expansion (1938), which sometimes differs by one count
/// from the exact one (by a few in the far tail).
pub fn poisson(mean: f64, words: [u32; 2]) -> u64 {
    // The midpoint of one of 2^52 equal intervals: never 0 or 1.
    let u = (((words[0] as u64) << 32 | words[1] as u64) >> 12) as f64 * (1.0 / TWO_TO_52) + 0.5 / TWO_TO_52;
    if mean.is_nan() || mean <= 0.0 {
        0
    } else if mean <= MAX_INVERSION_MEAN {
        poisson_by_inversion(mean, u)
    } else {
        poisson_cornish_fisher(mean, u)
    }
}

/// Smallest n whose cumulative probability exceeds `u`, by summing probabilities from 0.
fn poisson_by_inversion(mean: f64, u: f64) -> u64 {
    let mut probability = math::exp(-mean);
    let mut cumulative = probability;
    let mut count = 0;
    // Rounding may keep the sum just below 1: stop when the tail no longer changes it.
    while cumulative <= u && (probability > 1e-17 || (count as f64) < mean) {
        count += 1;
        probability *= mean / count as f64;
        cumulative += probability;
    }
    count
}

fn poisson_cornish_fisher(mean: f64, u: f64) -> u64 {
    let z = normal_quantile(u);
    let deviation = math::sqrt(mean);
    let x = mean + deviation * z + (z * z - 1.0) / 6.0 + (z - z * z * z) / (72.0 * deviation);
    (x + 0.5).floor().max(0.0) as u64
}

/// Acklam's approximation below the probability 0.02425, where the quantile grows with the logarithm of `p`.
fn tail_quantile(p: f64) -> f64 {
    let r = math::sqrt(-2.0 * math::ln(p));
    polynomial(
        r,
        [
            -7.784894002430293e-3,
            -3.223964580411365e-1,
            -2.400758277161838,
            -2.549732539343734,
            4.374664141464968,
            2.938163982698783,
        ],
    ) / polynomial(r, [7.784695709041462e-3, 3.224671290700398e-1, 2.445134137142996, 3.754408661907416, 1.0])
}

/// Quantile of the standard normal distribution at the probability `p`, 0 < p < 1;
/// relative error below 1.2e-9 (Acklam's rational approximation).
fn normal_quantile(p: f64) -> f64 {
    if p < 0.02425 {
        return tail_quantile(p);
    }
    if p > 1.0 - 0.02425 {
        return -tail_quantile(1.0 - p);
    }
    let q = p - 0.5;
    let r = q * q;
    let numerator = [
        -3.969683028665376e1,
        2.209460984245205e2,
        -2.759285104469687e2,
        1.38357751867269e2,
        -3.066479806614716e1,
        2.506628277459239,
    ];
    let denominator = [
        -5.447609879822406e1,
        1.615858368580409e2,
        -1.556989798598866e2,
        6.680131188771972e1,
        -1.328068155288572e1,
        1.0,
    ];
    q * polynomial(r, numerator) / polynomial(r, denominator)
}

/// Evaluates a polynomial, coefficients from the highest power down.
fn polynomial<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
    coefficients.into_iter().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSITION: Purpose = Purpose::named("position");
    const COUNT: u64 = 100_000;

    #[test]
    fn steps_drawn_together_are_those_drawn_one_by_one() {
        let key = Key::new(7, "steps");
        let together: [[f32; 16]; 4] = key.uniforms_of_steps(0x12_3456_789a, u32::MAX - 5, POSITION);
        for step in 0..16 {
            let alone = key.uniforms(0x12_3456_789a, (u32::MAX - 5).wrapping_add(step as u32), POSITION);
            assert_eq!(alone, [0, 1, 2, 3].map(|k| together[k][step]));
        }
    }

    #[test]
    fn philox_gives_the_published_answers() {
        // kat_vectors of the Random123 distribution.
        assert_eq!(philox4x32_10([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(philox4x32_10([!0; 4], [!0; 2]), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
        assert_eq!(
            philox4x32_10([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn murmur3_gives_the_published_answers() {
        assert_eq!(murmur3(b"", 0), 0);
        assert_eq!(murmur3(b"", 1), 0x514e_28b7);
        assert_eq!(murmur3(b"", !0), 0x81f1_6f39);
        assert_eq!(murmur3(b"test", 0), 0xba6b_d213);
        assert_eq!(murmur3(b"Hello, world!", 0), 0xc036_3e43);
        assert_eq!(murmur3(b"The quick brown fox jumps over the lazy dog", 0), 0x2e4f_f723);
    }

    #[test]
    fn keys_and_words_are_pinned_for_all_time() {
        let key = Key::new(0x0123_4567_89ab_cdef, "left log");
        assert_eq!(key.words(7, 3, POSITION), key.words(7, 3, POSITION));
        assert_eq!(key.to_words(), PINNED_KEY);
        assert_eq!(key.words(7 << 32 | 5, 3, POSITION), PINNED_WORDS);
    }

    // From an independent implementation in Python.
    const PINNED_KEY: [u32; 2] = [0x8b08_884c, 0x295e_92fa];
    const PINNED_WORDS: [u32; 4] = [0xf13a_b588, 0x05f3_6e4b, 0x15f7_28d3, 0xed2b_b441];

    #[test]
    fn every_part_of_the_address_changes_the_words() {
        let key = Key::new(1, "a");
        let words = key.words(1, 1, POSITION);
        let others = [
            Key::new(2, "a").words(1, 1, POSITION),
            Key::new(1 | 1 << 40, "a").words(1, 1, POSITION),
            Key::new(1, "b").words(1, 1, POSITION),
            key.words(2, 1, POSITION),
            key.words(1 | 1 << 32, 1, POSITION),
            key.words(1, 2, POSITION),
            key.words(1, 1, Purpose::named("velocity")),
        ];
        assert!(others.iter().all(|other| (0..4).all(|i| other[i] != words[i])));
    }

    #[test]
    fn uniforms_are_exact_at_their_ends() {
        assert_eq!((uniform(0), uniform(0xff), uniform(0x100), uniform(1 << 31)), (0.0, 0.0, 1.0 / 16_777_216.0, 0.5));
        assert!(uniform(!0) < 1.0 && uniform_f64(!0, !0) < 1.0);
        assert_eq!(uniform_f64(1 << 31, 0), 0.5);
    }

    /// Mean, variance and correlation of pairs.
    fn moments(pairs: impl Iterator<Item = (f64, f64)>) -> (f64, f64, f64) {
        let (mut n, mut x, mut y, mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (a, b) in pairs {
            (n, x, y, xx, yy, xy) = (n + 1.0, x + a, y + b, xx + a * a, yy + b * b, xy + a * b);
        }
        let (mean, other) = (x / n, y / n);
        let (variance, other_variance) = (xx / n - mean * mean, yy / n - other * other);
        (mean, variance, (xy / n - mean * other) / (variance * other_variance).sqrt())
    }

    #[test]
    fn neighbors_in_every_direction_are_uniform_and_uncorrelated() {
        let key = Key::new(42, "rain");
        let at = |key: Key, id: u64, step: u32, purpose: u32| key.uniforms(id, step, Purpose(purpose))[0] as f64;
        type Neighbor<'a> = &'a dyn Fn(u64) -> (f64, f64);
        let neighbors: [Neighbor; 5] = [
            &|i| (at(key, i, 0, 0), at(key, i + 1, 0, 0)),
            &|i| (at(key, 9, i as u32, 0), at(key, 9, i as u32 + 1, 0)),
            &|i| (at(key, 9, 0, i as u32), at(key, 9, 0, i as u32 + 1)),
            &|i| (at(Key::new(i, "rain"), 0, 0, 0), at(Key::new(i + 1, "rain"), 0, 0, 0)),
            &|i| (key.uniforms(i, 0, POSITION)[1] as f64, key.uniforms(i, 0, POSITION)[2] as f64),
        ];
        for neighbor in neighbors {
            let (mean, variance, correlation) = moments((0..COUNT).map(neighbor));
            // Four standard errors: 0.289 / sqrt(n), 1 / sqrt(180 n), 1 / sqrt(n).
            let root = (COUNT as f64).sqrt();
            assert!((mean - 0.5).abs() < 4.0 * 0.289 / root, "mean {mean}");
            assert!((variance - 1.0 / 12.0).abs() < 4.0 * 0.0745 / root, "variance {variance}");
            assert!(correlation.abs() < 4.0 / root, "correlation {correlation}");
        }
    }

    #[test]
    fn bytes_of_the_words_are_equally_frequent() {
        let key = Key::new(7, "spark");
        let mut counts = [0_u32; 256];
        for id in 0..COUNT / 16 {
            let words = key.words(id, 0, POSITION);
            words.iter().flat_map(|word| word.to_le_bytes()).for_each(|byte| counts[byte as usize] += 1);
        }
        let mean = counts.iter().sum::<u32>() as f64 / 256.0;
        let chi_squared: f64 = counts.iter().map(|&count| (count as f64 - mean) * (count as f64 - mean) / mean).sum();
        // 255 degrees of freedom: mean 255, standard deviation 22.6.
        assert!((chi_squared - 255.0).abs() < 4.0 * 22.6, "{chi_squared}");
    }

    #[test]
    fn normal_pairs_have_normal_moments() {
        let key = Key::new(3, "gust");
        let pair = |i: u64| {
            let words = key.words(i, 0, POSITION);
            normal_pair([words[0], words[1]]).map(f64::from)
        };
        let (mean, variance, correlation) = moments((0..COUNT).map(|i| (pair(i)[0], pair(i)[1])));
        let fourth = (0..COUNT).map(|i| pair(i)[1] * pair(i)[1] * pair(i)[1] * pair(i)[1]).sum::<f64>() / COUNT as f64;
        let beyond_two = (0..COUNT).filter(|&i| pair(i)[0].abs() > 2.0).count() as f64 / COUNT as f64;
        assert!(mean.abs() < 0.0127 && (variance - 1.0).abs() < 0.018 && correlation.abs() < 0.0127);
        assert!((fourth - 3.0).abs() < 0.13, "{fourth}");
        assert!((beyond_two - 0.0455).abs() < 0.0027, "{beyond_two}");
        let extremes = [normal_pair([!0, 0]), normal_pair([0, 0])];
        assert!(extremes.iter().flatten().all(|x| x.is_finite() && x.abs() < 5.8));
    }

    #[test]
    fn directions_are_unit_vectors_spread_evenly() {
        let key = Key::new(5, "ember");
        let (mut sum, mut squares) = (Vec3::ZERO, Vec3::ZERO);
        for i in 0..COUNT {
            let words = key.words(i, 0, POSITION);
            let direction = direction([words[0], words[1]]);
            assert!((direction.length() - 1.0).abs() < 1e-6);
            (sum, squares) = (sum + direction, squares + direction * direction);
        }
        let (mean, squares) = (sum / COUNT as f32, squares / COUNT as f32);
        assert!(mean.abs().max_element() < 4.0 * 0.577 / 316.0, "{mean}");
        assert!((squares - Vec3::splat(1.0 / 3.0)).abs().max_element() < 4.0 * 0.298 / 316.0, "{squares}");
    }

    #[test]
    fn poisson_counts_have_equal_mean_and_variance() {
        let key = Key::new(11, "drops");
        for mean in [0.01, 0.7, 5.0, 60.0, 255.0, 257.0, 1e4, 1e9] {
            let count = |i: u64| {
                let words = key.words(i, 0, POSITION);
                (poisson(mean, [words[0], words[1]]) as f64, 0.0)
            };
            let n = 20_000;
            let (sample_mean, variance, _) = moments((0..n).map(count).map(|(x, y)| (x - mean, y)));
            let error = (mean / n as f64).sqrt();
            assert!(sample_mean.abs() < 4.0 * error + 2e-3, "{mean}: {sample_mean}");
            let variance_error = ((mean + 2.0 * mean * mean) / n as f64).sqrt();
            assert!((variance - mean).abs() < 4.0 * variance_error, "{mean}: {variance}");
        }
    }

    #[test]
    fn poisson_is_a_quantile_that_rises_with_its_mean() {
        // Mean 1: P(0) = 0.3679, P(<= 1) = 0.7358, P(<= 2) = 0.9197.
        let word = |u: f64| [(u * 4_294_967_296.0) as u32, 0];
        assert_eq!([0.36, 0.37, 0.73, 0.74, 0.92].map(|u| poisson(1.0, word(u))), [0, 1, 1, 2, 3]);
        for high in [0, 1 << 28, 1 << 31, 0xfff0_0000] {
            let counts: Vec<u64> = (0..8000).map(|i| poisson(i as f64 * 0.1, [high, high])).collect();
            assert!(counts[..=2560].is_sorted() && counts[2561..].is_sorted());
            assert!(counts[2560].abs_diff(counts[2561]) <= 4, "{} {}", counts[2560], counts[2561]);
        }
        let farthest = [0.5, 20.0, 256.0, 300.0].map(|mean| (poisson(mean, [!0, !0]) as f64 - mean) / mean.sqrt());
        assert!(farthest.iter().all(|deviations| (6.0..30.0).contains(deviations)), "{farthest:?}");
        assert_eq!([f64::NAN, -1.0, 0.0].map(|mean| poisson(mean, [!0, !0])), [0, 0, 0]);
    }

    #[test]
    fn normal_quantiles_match_tables() {
        for (p, z) in [
            (0.5, 0.0),
            (0.975, 1.959_963_984_540_054),
            (0.001, -3.090_232_306_167_813_5),
            (0.99, 2.326_347_874_040_841),
        ] {
            assert!((normal_quantile(p) - z).abs() < 4e-9, "{p}");
        }
    }
}
