//! One octave of gradient noise (Perlin 1985, 2002) on a hashed lattice, in 2, 3 and 4 dimensions.
//!
//! All functions are branch-free and always inlined, so that a loop over 16 points is vectorized. Products and sums are
//! deliberately not fused: the arithmetic is mostly integer, and the scalar version stays fast on processors without fused multiply-add.

/// Dimensions of the noise: implemented for `[f32; 2]`, `[f32; 3]` and `[f32; 4]`.
pub trait Dimension: Copy + private::Sealed {
    /// Factor that scales the noise of unit gradients to [-1, 1].
    ///
    /// The unit gradient of a corner at distance d contributes at most d, so the noise is at most `sum w d <= sqrt(sum w d^2)` (the weights w
    /// sum to 1). That sum separates into one term per axis, `(1 - s) f^2 + s (1 - f)^2`, where s is the fade of f. Since s <= f for f <=
    /// 1/2, the term is at most `f^2 + f (1 - 2 f) = f - f^2 <= 1/4`: in n dimensions the noise is at most sqrt(n) / 2.
    const SCALE: f32;

    /// Noise in [-1, 1] at the fraction `self` of the cell that lies between the lattice coordinates `lower` and `upper`.
    fn gradient_noise(self, lower: Self::Cells, upper: Self::Cells, seed: u32) -> f32;

    /// Integer coordinates, one per axis.
    type Cells: Copy;
}

mod private {
    pub trait Sealed {}
    impl Sealed for [f32; 2] {}
    impl Sealed for [f32; 3] {}
    impl Sealed for [f32; 4] {}
}

const FACTORS: [u32; 4] = [0x9e37_79b1, 0x85eb_ca77, 0xc2b2_ae3d, 0x27d4_eb2f];

/// Adds a coordinate other than the first to a hash. One round of mixing between coordinates suffices to avoid translations
/// under which the lattice repeats. The result is shared by all corners with that coordinate.
#[inline(always)]
fn hash_coordinate(hash: u32, axis: usize, cell: u32) -> u32 {
    let hash = hash.wrapping_add(cell.wrapping_mul(FACTORS[axis]));
    (hash ^ hash >> 15).wrapping_mul(0x2c1b_3c6d)
}

/// Adds the first coordinate and mixes all bits into the upper ones ("lowbias32" by Wellons, public domain, without its last shift).
#[inline(always)]
fn hash_first(hash: u32, cell: u32) -> u32 {
    let hash = hash.wrapping_add(cell.wrapping_mul(FACTORS[0]));
    let hash = (hash ^ hash >> 16).wrapping_mul(0x7feb_352d);
    (hash ^ hash >> 15).wrapping_mul(0x846c_a68b)
}

/// Flips the sign of `x` if the highest bit of `bits` is set.
#[inline(always)]
fn signed(x: f32, bits: u32) -> f32 {
    f32::from_bits(x.to_bits() ^ (bits & 0x8000_0000))
}

/// The fade `6 f^5 - 15 f^4 + 10 f^3` (Perlin 2002): the first and second derivatives are 0 at both ends.
#[inline(always)]
fn fade(f: f32) -> f32 {
    f * f * f * (f * (f * 6.0 - 15.0) + 10.0)
}

#[inline(always)]
fn lerp(a: f32, b: f32, s: f32) -> f32 {
    a + (b - a) * s
}

/// Dot product of (`x`, `y`) with one of 8 unit vectors, at 22.5 + 45 k degrees.
#[inline(always)]
fn gradient_dot_2(hash: u32, x: f32, y: f32) -> f32 {
    const COS: f32 = 0.923_879_5;
    const SIN: f32 = 0.382_683_43;
    let swap = (hash as i32) < 0;
    let (u, v) = if swap { (y, x) } else { (x, y) };
    signed(u * COS, hash << 1) + signed(v * SIN, hash << 2)
}

/// Dot product of (`x`, `y`, `z`) with one of the 12 vertices of the icosahedron. They are isotropic up to fifth order (a spherical
/// 5-design), and none lies along an axis; the usual 12 edges of the cube are isotropic to third order only.
#[inline(always)]
fn gradient_dot_3(hash: u32, x: f32, y: f32, z: f32) -> f32 {
    // (0, 1, phi) / sqrt(1 + phi^2) and its cyclic permutations.
    const SHORT: f32 = 0.525_731_1;
    const LONG: f32 = 0.850_650_8;
    let (first, last) = thirds(hash);
    let u = if first {
        y
    } else if last {
        x
    } else {
        z
    };
    let v = if first {
        z
    } else if last {
        y
    } else {
        x
    };
    let bits = hash ^ hash >> 16;
    signed(u * SHORT, bits << 31) + signed(v * LONG, bits << 30)
}

/// Dot product of (`x`, `y`, `z`, `w`) with one of the 24 vertices of the 24-cell, the signed permutations of (1, 1, 0, 0) / sqrt(2): a spherical
/// 5-design.
#[inline(always)]
fn gradient_dot_4(hash: u32, x: f32, y: f32, z: f32, w: f32) -> f32 {
    const HALF_DIAGONAL: f32 = std::f32::consts::FRAC_1_SQRT_2;
    let bits = hash ^ hash >> 16;
    let (first, last) = thirds(hash);
    // There are three ways to divide the axes into two pairs; choose one, and one of its pairs.
    let other = bits & 4 != 0;
    let with_x = if first {
        y
    } else if last {
        w
    } else {
        z
    };
    let (u, v) = if other { (if first { z } else { y }, if last { z } else { w }) } else { (x, with_x) };
    (signed(u, bits << 31) + signed(v, bits << 30)) * HALF_DIAGONAL
}

/// Whether a hash lies in the first and in the last third of its range.
#[inline(always)]
fn thirds(hash: u32) -> (bool, bool) {
    let hash = hash as i32;
    (hash < -715_827_883, hash >= 715_827_883)
}

/// Noise on the edge between two corners of a cell; `hash` is that of all coordinates except the first.
#[inline(always)]
fn row_2(lower: u32, upper: u32, hash: u32, [x, y]: [f32; 2]) -> f32 {
    lerp(gradient_dot_2(hash_first(hash, lower), x, y), gradient_dot_2(hash_first(hash, upper), x - 1.0, y), fade(x))
}

#[inline(always)]
fn row_3(lower: u32, upper: u32, hash: u32, [x, y, z]: [f32; 3]) -> f32 {
    lerp(
        gradient_dot_3(hash_first(hash, lower), x, y, z),
        gradient_dot_3(hash_first(hash, upper), x - 1.0, y, z),
        fade(x),
    )
}

#[inline(always)]
fn row_4(lower: u32, upper: u32, hash: u32, [x, y, z, w]: [f32; 4]) -> f32 {
    lerp(
        gradient_dot_4(hash_first(hash, lower), x, y, z, w),
        gradient_dot_4(hash_first(hash, upper), x - 1.0, y, z, w),
        fade(x),
    )
}

/// Noise in the face between two rows.
#[inline(always)]
fn face_3(lower: [u32; 3], upper: [u32; 3], hash: u32, [x, y, z]: [f32; 3]) -> f32 {
    let near = row_3(lower[0], upper[0], hash_coordinate(hash, 1, lower[1]), [x, y, z]);
    lerp(near, row_3(lower[0], upper[0], hash_coordinate(hash, 1, upper[1]), [x, y - 1.0, z]), fade(y))
}

#[inline(always)]
fn face_4(lower: [u32; 4], upper: [u32; 4], hash: u32, [x, y, z, w]: [f32; 4]) -> f32 {
    let near = row_4(lower[0], upper[0], hash_coordinate(hash, 1, lower[1]), [x, y, z, w]);
    lerp(near, row_4(lower[0], upper[0], hash_coordinate(hash, 1, upper[1]), [x, y - 1.0, z, w]), fade(y))
}

/// Noise in the cube between two faces.
#[inline(always)]
fn cube_4(lower: [u32; 4], upper: [u32; 4], hash: u32, [x, y, z, w]: [f32; 4]) -> f32 {
    let near = face_4(lower, upper, hash_coordinate(hash, 2, lower[2]), [x, y, z, w]);
    lerp(near, face_4(lower, upper, hash_coordinate(hash, 2, upper[2]), [x, y, z - 1.0, w]), fade(z))
}

impl Dimension for [f32; 2] {
    const SCALE: f32 = std::f32::consts::SQRT_2;
    type Cells = [u32; 2];

    #[inline(always)]
    fn gradient_noise(self, lower: [u32; 2], upper: [u32; 2], seed: u32) -> f32 {
        let [x, y] = self;
        let near = row_2(lower[0], upper[0], hash_coordinate(seed, 1, lower[1]), self);
        lerp(near, row_2(lower[0], upper[0], hash_coordinate(seed, 1, upper[1]), [x, y - 1.0]), fade(y)) * Self::SCALE
    }
}

impl Dimension for [f32; 3] {
    const SCALE: f32 = 1.154_700_5;
    type Cells = [u32; 3];

    #[inline(always)]
    fn gradient_noise(self, lower: [u32; 3], upper: [u32; 3], seed: u32) -> f32 {
        let [x, y, z] = self;
        let near = face_3(lower, upper, hash_coordinate(seed, 2, lower[2]), self);
        lerp(near, face_3(lower, upper, hash_coordinate(seed, 2, upper[2]), [x, y, z - 1.0]), fade(z)) * Self::SCALE
    }
}

impl Dimension for [f32; 4] {
    const SCALE: f32 = 1.0;
    type Cells = [u32; 4];

    #[inline(always)]
    fn gradient_noise(self, lower: [u32; 4], upper: [u32; 4], seed: u32) -> f32 {
        let [x, y, z, w] = self;
        let near = cube_4(lower, upper, hash_coordinate(seed, 3, lower[3]), self);
        lerp(near, cube_4(lower, upper, hash_coordinate(seed, 3, upper[3]), [x, y, z, w - 1.0]), fade(w)) * Self::SCALE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every gradient a function can give, each as often as it comes up among many hashes.
    fn gradients<const N: usize>(slope: impl Fn(u32, [f32; N]) -> f32) -> Vec<[f64; N]> {
        let unit = |axis: usize| std::array::from_fn(|i| if i == axis { 1.0 } else { 0.0 });
        (0..60_000_u32)
            .map(|i| std::array::from_fn(|axis| slope(hash_first(hash_coordinate(0, 1, i), 3), unit(axis)) as f64))
            .collect()
    }

    /// Unit length, mean 0, and second and fourth moments of an even distribution over the sphere.
    fn assert_even<const N: usize>(gradients: &[[f64; N]], distinct: usize) {
        let n = N as f64;
        let mean = |f: &dyn Fn(&[f64; N]) -> f64| gradients.iter().map(f).sum::<f64>() / gradients.len() as f64;
        assert!(gradients.iter().all(|g| (g.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-6));
        for i in 0..N {
            let j = (i + 1) % N;
            assert!(mean(&|g| g[i]).abs() < 0.012);
            assert!((mean(&|g| g[i] * g[i]) - 1.0 / n).abs() < 0.01);
            assert!(mean(&|g| g[i] * g[j]).abs() < 0.01);
            assert!((mean(&|g| g[i] * g[i] * g[i] * g[i]) - 3.0 / (n * (n + 2.0))).abs() < 0.01);
            assert!((mean(&|g| g[i] * g[i] * g[j] * g[j]) - 1.0 / (n * (n + 2.0))).abs() < 0.01);
        }
        let mut bits: Vec<_> = gradients.iter().map(|g| g.map(f64::to_bits)).collect();
        bits.sort_unstable();
        let counts: Vec<usize> = bits.chunk_by(|a, b| a == b).map(<[_]>::len).collect();
        assert_eq!(counts.len(), distinct);
        let expected = gradients.len() / distinct;
        assert!(counts.iter().all(|&count| count.abs_diff(expected) < expected / 8));
    }

    #[test]
    fn gradients_favor_no_direction_up_to_fourth_order() {
        assert_even(&gradients::<2>(|hash, [x, y]| gradient_dot_2(hash, x, y)), 8);
        assert_even(&gradients::<3>(|hash, [x, y, z]| gradient_dot_3(hash, x, y, z)), 12);
        assert_even(&gradients::<4>(|hash, [x, y, z, w]| gradient_dot_4(hash, x, y, z, w)), 24);
    }

    #[test]
    fn one_cell_has_hand_worked_values() {
        // At a corner the noise is 0; next to it the noise is the dot product of that corner alone, since the fade starts with f^3.
        assert_eq!([0.0, 0.0].gradient_noise([3, 5], [4, 6], 9), 0.0);
        let hash = hash_first(hash_coordinate(9, 1, 5), 3);
        let (near, alone) = (
            [1e-3_f32, 0.0].gradient_noise([3, 5], [4, 6], 9),
            gradient_dot_2(hash, 1e-3, 0.0) * std::f32::consts::SQRT_2,
        );
        assert!((near - alone).abs() < 4e-8, "{near} {alone}");
        assert_eq!(fade(0.5), 0.5);
        // The middle of a cell: a quarter of the sum of four slopes.
        let corners = [(3, 5, 0.5, 0.5), (4, 5, -0.5, 0.5), (3, 6, 0.5, -0.5), (4, 6, -0.5, -0.5)];
        let sum: f32 =
            corners.iter().map(|&(i, j, x, y)| gradient_dot_2(hash_first(hash_coordinate(9, 1, j), i), x, y)).sum();
        let middle = [0.5, 0.5].gradient_noise([3, 5], [4, 6], 9);
        assert!((middle - sum / 4.0 * std::f32::consts::SQRT_2).abs() < 1e-6);
    }

    #[test]
    fn hash_changes_half_its_upper_bits_with_any_coordinate_bit() {
        let hash = |cell: [u32; 4]| {
            hash_first(
                hash_coordinate(hash_coordinate(hash_coordinate(7, 3, cell[3]), 2, cell[2]), 1, cell[1]),
                cell[0],
            )
        };
        for axis in 0..4 {
            for bit in 0..32 {
                let changed = |i: u32| {
                    let mut cell = [i, 2 * i, 5, i ^ 3];
                    let before = hash(cell);
                    cell[axis] ^= 1 << bit;
                    (before ^ hash(cell)) >> 16
                };
                let mean = (0..4000).map(|i| changed(i).count_ones()).sum::<u32>() as f64 / 4000.0;
                assert!((mean - 8.0).abs() < 0.8, "axis {axis} bit {bit}: {mean}");
            }
        }
    }
}
